"""Explicit SIMD vectors for Numba: each vector is one LLVM vector, each operation one instruction.

A vector has a kind (f32, f64, i32, i64 or mask) and a number of lanes. The lanes are `WIDTH` unless
a constructor is told otherwise, so code that names no number runs on any machine, and a mask fits
vectors of every kind; LLVM splits what is wider than a register. Everything here is for compiled
code only; nothing can be called from Python.

    @kernel
    def saxpy(a, x, y, out):
        n = x.size
        for i in range(0, n, WIDTH):
            live = first(n - i)
            v = a * load_masked(x, i, live, 0.0) + load_masked(y, i, live, 0.0)
            store_masked(out, i, v, live)

Operators are Python's: `+ - *` and unary `-` on numbers, `/` on floats, `< <= > >= == !=` giving a
mask, `& | ^ ~` on masks and integers, `<< >>` on integers. One operand may be a scalar: it is
converted to the kind of the vector and stands in all lanes. `and`, `or` and `not` on masks do not
compile: they are control flow. No operation is reordered, contracted or approximated, so each lane
is NumPy's answer bit for bit (integers wrap; comparisons with NaN are false, `!=` is true).

`WIDTH` follows from the name and the features of the CPU that Numba compiles for and from nothing
else. Numba's cache on disk is keyed by just these, so that code cached for one width is never
loaded for another.
"""

from __future__ import annotations

import operator

from llvmlite import ir
from numba import types
from numba.core import cgutils, errors
from numba.core.imputils import lower_builtin
from numba.core.registry import cpu_target
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import intrinsic, models, register_model


def _target_features():
    """Return the names of the features that Numba compiles for, such as "avx2"."""
    _, _, features = cpu_target.target_context.codegen().magic_tuple()
    return frozenset(name[1:] for name in features.split(",") if name.startswith("+"))


FEATURES = _target_features()
"""What the compiled code may use; NUMBA_CPU_NAME and NUMBA_CPU_FEATURES change it."""

AVX512 = {"avx512f", "avx512bw", "avx512dq", "avx512vl"} <= FEATURES

WIDTH = 16 if AVX512 else 8 if "avx2" in FEATURES else 4
"""Lanes of a vector unless told otherwise: a register of 32-bit lanes."""

_I32 = ir.IntType(32)
_I64 = ir.IntType(64)
_ELEMENT = {
    "f32": (types.float32, ir.FloatType()),
    "f64": (types.float64, ir.DoubleType()),
    "i32": (types.int32, _I32),
    "i64": (types.int64, _I64),
    "mask": (types.boolean, ir.IntType(1)),
}
# What an array's element is in memory and the kind of vector it is read as.
_MEMORY = {
    types.float32: ("f32", ir.FloatType()),
    types.float64: ("f64", ir.DoubleType()),
    types.int32: ("i32", _I32),
    types.int64: ("i64", _I64),
    types.uint8: ("i32", ir.IntType(8)),
    types.boolean: ("mask", ir.IntType(8)),
}


class Vector(types.Type):
    """The Numba type of a vector.

    Parameters
    ----------
    kind : {"f32", "f64", "i32", "i64", "mask"}
    lanes : int
        A power of two from 2 to 64.
    """

    def __init__(self, kind, lanes):
        if lanes not in (2, 4, 8, 16, 32, 64):
            raise errors.TypingError(f"lanes must be a power of two from 2 to 64, got {lanes}")
        self.kind = kind
        self.lanes = lanes
        super().__init__(name=f"{kind}x{lanes}")

    @property
    def group(self):
        """What the lanes are: "float", "int" or "mask"."""
        return {"f": "float", "i": "int", "m": "mask"}[self.kind[0]]

    @property
    def scalar(self):
        """The Numba type of one lane."""
        return _ELEMENT[self.kind][0]

    @property
    def llvm(self):
        """The LLVM type."""
        return ir.VectorType(_ELEMENT[self.kind][1], self.lanes)

    def of(self, kind):
        """Return the type of as many lanes of another kind."""
        return Vector(kind, self.lanes)


@register_model(Vector)
class _VectorModel(models.PrimitiveModel):
    def __init__(self, dmm, fe_type):
        super().__init__(dmm, fe_type, fe_type.llvm)


# ---------------------------------------------------------------------------------------------
# Building blocks


class _Gep(ir.instructions.Instruction):
    """`getelementptr` with a vector of indices, which llvmlite's own does not type.

    Gathers need this form: with pointers put together from integers LLVM may lose sight of the base
    and the 32-bit indices, and gather by 64-bit ones.
    """

    def __init__(self, parent, element, base, index, name=""):
        typ = ir.VectorType(base.type, index.type.count)
        super().__init__(parent, typ, "getelementptr", [base, index], name=name)
        self.element = element

    def descr(self, buf):
        """Write the instruction."""
        base, index = self.operands
        buf.append(
            f"getelementptr {self.element}, {base.type} {base.get_reference()}, "
            f"{index.type} {index.get_reference()}\n"
        )


class _Freeze(ir.instructions.Instruction):
    """`freeze`, which llvmlite lacks: lanes that are undefined become some number."""

    def __init__(self, parent, value, name=""):
        super().__init__(parent, value.type, "freeze", [value], name=name)

    def descr(self, buf):
        """Write the instruction."""
        (value,) = self.operands
        buf.append(f"freeze {value.type} {value.get_reference()}\n")


def _append(builder, instruction):
    builder._insert(instruction)
    return instruction


def _call(builder, name, result, arguments):
    """Call an LLVM intrinsic."""
    function = ir.FunctionType(result, [a.type for a in arguments])
    return builder.call(cgutils.get_or_insert_function(builder.module, function, name), arguments)


def _suffix(typ):
    """Return what LLVM calls a vector type in the names of its intrinsics, such as "v16f32"."""
    letter = {ir.FloatType(): "f32", ir.DoubleType(): "f64"}.get(typ.element)
    return f"v{typ.count}{letter or f'i{typ.element.width}'}"


def _constant(typ, values):
    return ir.Constant(typ, list(values))


def _splat(builder, scalar, lanes):
    typ = ir.VectorType(scalar.type, lanes)
    undefined = ir.Constant(typ, ir.Undefined)
    one = builder.insert_element(undefined, scalar, ir.Constant(_I32, 0))
    return builder.shuffle_vector(
        one, undefined, _constant(ir.VectorType(_I32, lanes), [0] * lanes)
    )


def _take(builder, vector, lanes):
    """Return the lanes of a vector that a list of numbers names."""
    undefined = ir.Constant(vector.type, ir.Undefined)
    return builder.shuffle_vector(
        vector, undefined, _constant(ir.VectorType(_I32, len(lanes)), lanes)
    )


def _join(builder, low, high):
    lanes = 2 * low.type.count
    return builder.shuffle_vector(low, high, _constant(ir.VectorType(_I32, lanes), range(lanes)))


def _fits(vector, scalar):
    """Whether a scalar may stand beside a vector: an integer vector takes no float."""
    allowed = {
        "float": (types.Integer, types.Float),
        "int": (types.Integer,),
        "mask": (types.Boolean,),
    }
    return isinstance(scalar, allowed[vector.group])


def _common(name, arguments):
    """Return the vector type that scalars and vectors have in common, or say why there is none."""
    vectors = {a for a in arguments if isinstance(a, Vector)}
    if len(vectors) == 1:
        (vector,) = vectors
        if all(a is vector or _fits(vector, a) for a in arguments if not isinstance(a, Vector)):
            return vector
    got = ", ".join(str(a) for a in arguments)
    raise errors.TypingError(
        f"{name} takes vectors of one kind and number of lanes, and scalars that fit; got {got}"
    )


def _widen(context, builder, value, typ, vector):
    """Return a value as a vector: as it is, or a scalar converted and put in all lanes."""
    if isinstance(typ, Vector):
        return value
    return _splat(builder, context.cast(builder, value, typ, vector.scalar), vector.lanes)


def _need(name, argument, typ, *kinds):
    """Raise unless an argument is a vector of one of some kinds."""
    if not (isinstance(typ, Vector) and typ.kind in kinds):
        raise errors.TypingError(
            f"{name}: {argument} must be a vector of kind {' or '.join(kinds)}, got {typ}"
        )


_NUMBERS = ("f32", "f64", "i32", "i64")


def _lanes(lanes):
    """Return a number of lanes from the type of the argument that gives it, if any does."""
    if lanes is None or isinstance(lanes, (types.NoneType, types.Omitted)):
        return WIDTH
    if not isinstance(lanes, types.IntegerLiteral):
        raise errors.TypingError(f"lanes must be a constant, got {lanes}")
    return lanes.literal_value


def _given(*arguments):
    """Return the types of arguments for a signature: constants as numbers, what is left out."""
    return [types.none if a is None else types.unliteral(a) for a in arguments]


# ---------------------------------------------------------------------------------------------
# Constructors


def _constructor(kind, scalars):
    def typed(typingctx, x, lanes=None):
        vector = Vector(kind, _lanes(lanes))
        if not isinstance(x, scalars):
            raise errors.TypingError(f"{kind}: x must be a scalar, got {x}")

        def generate(context, builder, sig, args):
            return _widen(context, builder, args[0], sig.args[0], vector)

        return vector(*_given(x, lanes)), generate

    typed.__name__ = typed.__qualname__ = kind
    typed.__doc__ = f"""Return a vector of kind {kind} with x in all lanes: {kind}(x[, lanes])."""
    return intrinsic(prefer_literal=True)(typed)


_SCALARS = (types.Integer, types.Float, types.Boolean)
f32 = _constructor("f32", _SCALARS)
f64 = _constructor("f64", _SCALARS)
i32 = _constructor("i32", _SCALARS)
i64 = _constructor("i64", _SCALARS)
mask = _constructor("mask", (types.Boolean,))


@intrinsic(prefer_literal=True)
def iota(typingctx, lanes=None):
    """Return the i32 vector 0, 1, 2, ...: iota([lanes])."""
    vector = Vector("i32", _lanes(lanes))

    def generate(context, builder, sig, args):
        return _constant(vector.llvm, range(vector.lanes))

    return vector(*_given(lanes)), generate


@intrinsic(prefer_literal=True)
def first(typingctx, n, lanes=None):
    """Return the mask of the first n lanes, none or all if n is out of range: first(n[, lanes])."""
    vector = Vector("mask", _lanes(lanes))
    if not isinstance(n, types.Integer):
        raise errors.TypingError(f"first: n must be an integer, got {n}")

    def generate(context, builder, sig, args):
        n = context.cast(builder, args[0], sig.args[0], types.int64)
        return _first(builder, n, vector.lanes)

    return vector(*_given(n, lanes)), generate


def _first(builder, n, lanes):
    """Return the mask of the first n lanes for an LLVM i64."""
    zero, most = ir.Constant(_I64, 0), ir.Constant(_I64, lanes)
    n = builder.select(builder.icmp_signed("<", n, zero), zero, n)
    n = builder.select(builder.icmp_signed("<", n, most), n, most)
    iota = _constant(ir.VectorType(_I32, lanes), range(lanes))
    return builder.icmp_signed("<", iota, _splat(builder, builder.trunc(n, _I32), lanes))


# ---------------------------------------------------------------------------------------------
# Operators


def _operator(op, builds, result=None):
    """Give vectors a binary operator: how to build it by group, and the result's kind if another."""

    @infer_global(op)
    class Template(AbstractTemplate):
        def generic(self, args, kws):
            if kws or len(args) != 2 or not any(isinstance(a, Vector) for a in args):
                return None
            vector = _common(op.__name__, args)
            if vector.group not in builds:
                return None
            scalar = vector.scalar
            operands = [a if isinstance(a, Vector) else scalar for a in args]
            return signature(vector.of(result) if result else vector, *operands)

    def lower(context, builder, sig, args):
        vector = _common(op.__name__, sig.args)
        operands = [
            _widen(context, builder, a, t, vector) for a, t in zip(args, sig.args, strict=True)
        ]
        return builds[vector.group](builder, *operands)

    for scalar in (types.Number, types.Boolean):
        lower_builtin(op, Vector, scalar)(lower)
        lower_builtin(op, scalar, Vector)(lower)
    lower_builtin(op, Vector, Vector)(lower)


def _unary(op, builds):
    @infer_global(op)
    class Template(AbstractTemplate):
        def generic(self, args, kws):
            if kws or len(args) != 1 or not isinstance(args[0], Vector):
                return None
            return signature(args[0], args[0]) if args[0].group in builds else None

    @lower_builtin(op, Vector)
    def lower(context, builder, sig, args):
        return builds[sig.args[0].group](builder, *args)


_Builder = ir.IRBuilder
_operator(operator.add, {"float": _Builder.fadd, "int": _Builder.add})
_operator(operator.sub, {"float": _Builder.fsub, "int": _Builder.sub})
_operator(operator.mul, {"float": _Builder.fmul, "int": _Builder.mul})
_operator(operator.truediv, {"float": _Builder.fdiv})
_operator(operator.and_, {"int": _Builder.and_, "mask": _Builder.and_})
_operator(operator.or_, {"int": _Builder.or_, "mask": _Builder.or_})
_operator(operator.xor, {"int": _Builder.xor, "mask": _Builder.xor})
_unary(operator.neg, {"float": _Builder.fneg, "int": _Builder.neg})
_unary(operator.invert, {"int": _Builder.not_, "mask": _Builder.not_})


def _within(builder, count):
    """Return shift counts modulo the bits of a lane: LLVM leaves others undefined."""
    bits = count.type.element.width
    return builder.and_(count, _constant(count.type, [bits - 1] * count.type.count))


_operator(operator.lshift, {"int": lambda b, x, n: b.shl(x, _within(b, n))})
_operator(operator.rshift, {"int": lambda b, x, n: b.ashr(x, _within(b, n))})


def _comparison(op, symbol):
    # NaN compares false, and differs from everything.
    def floats(builder, x, y):
        compare = builder.fcmp_unordered if symbol == "!=" else builder.fcmp_ordered
        return compare(symbol, x, y)

    def ints(builder, x, y):
        return builder.icmp_signed(symbol, x, y)

    builds = {"float": floats, "int": ints}
    if symbol in ("==", "!="):
        builds["mask"] = ints
    _operator(op, builds, "mask")


for _op, _symbol in (
    (operator.lt, "<"), (operator.le, "<="), (operator.gt, ">"), (operator.ge, ">="),
    (operator.eq, "=="), (operator.ne, "!="),
):  # fmt: skip
    _comparison(_op, _symbol)


# ---------------------------------------------------------------------------------------------
# Lane by lane


@intrinsic
def select(typingctx, m, a, b):
    """Return a where the mask m is set and b elsewhere; one of a and b may be a scalar."""
    _need("select", "m", m, "mask")
    vector = _common("select", (a, b))
    if vector.lanes != m.lanes:
        raise errors.TypingError(f"select: m must have {vector.lanes} lanes, got {m.lanes}")

    def generate(context, builder, sig, args):
        a = _widen(context, builder, args[1], sig.args[1], vector)
        b = _widen(context, builder, args[2], sig.args[2], vector)
        return builder.select(args[0], a, b)

    return vector(m, a, b), generate


def _extreme(builder, symbol, a, b):
    floats = isinstance(a.type.element, (ir.FloatType, ir.DoubleType))
    compare = builder.fcmp_ordered if floats else builder.icmp_signed
    return builder.select(compare(symbol, a, b), a, b)


def _extreme_of(name, symbol):
    def typed(typingctx, a, b):
        vector = _common(name, (a, b))
        _need(name, "a", vector, *_NUMBERS)

        def generate(context, builder, sig, args):
            a, b = (
                _widen(context, builder, v, t, vector) for v, t in zip(args, sig.args, strict=True)
            )
            return _extreme(builder, symbol, a, b)

        return vector(a, b), generate

    typed.__name__ = typed.__qualname__ = name
    typed.__doc__ = (
        f"""Return a where a {symbol} b and b elsewhere: b if either is NaN, b of two zeros."""
    )
    return intrinsic(typed)


minimum = _extreme_of("minimum", "<")
maximum = _extreme_of("maximum", ">")


def _math(name, called, kinds, doc):
    def typed(typingctx, v):
        _need(name, "v", v, *kinds)

        def generate(context, builder, sig, args):
            if v.group == "int":  # the least integer has no absolute value: it stays
                args = (args[0], ir.Constant(ir.IntType(1), 0))
            function = f"llvm.{called[v.group]}.{_suffix(v.llvm)}"
            return _call(builder, function, v.llvm, list(args))

        return v(v), generate

    typed.__name__ = typed.__qualname__ = name
    typed.__doc__ = doc
    return intrinsic(typed)


absolute = _math(
    "absolute", {"float": "fabs", "int": "abs"}, _NUMBERS,
    "Return the absolute value; the least integer stays itself.",
)  # fmt: skip
sqrt = _math("sqrt", {"float": "sqrt"}, ("f32", "f64"), "Return the square root, NaN below zero.")
floor = _math(
    "floor", {"float": "floor"}, ("f32", "f64"), "Return the greatest whole number not above."
)


# ---------------------------------------------------------------------------------------------
# Conversions


def _convert(builder, value, old, new):
    """Return a vector of type `old` as one of type `new`."""
    if old.kind == new.kind:
        return value
    to = new.llvm
    if old.group == "mask":
        return builder.zext(value, to) if new.group == "int" else builder.uitofp(value, to)
    if new.group == "float":
        if old.group == "int":
            return builder.sitofp(value, to)
        return builder.fpext(value, to) if new.kind == "f64" else builder.fptrunc(value, to)
    if old.group == "float":
        # Frozen: what lies out of range is some number, and not a licence to delete code.
        return _append(builder, _Freeze(builder.block, builder.fptosi(value, to)))
    return builder.sext(value, to) if new.kind == "i64" else builder.trunc(value, to)


def _conversion(kind, detail):
    name = f"to_{kind}"

    def typed(typingctx, v):
        _need(name, "v", v, *_ELEMENT)
        result = v.of(kind)

        def generate(context, builder, sig, args):
            return _convert(builder, args[0], v, result)

        return result(v), generate

    typed.__name__ = typed.__qualname__ = name
    typed.__doc__ = f"Return the lanes as {kind}, {detail}; a mask gives 0 and 1."
    return intrinsic(typed)


_ROUNDED = "rounded to nearest, ties to even"
_TRUNCATED = (
    "floats truncated and wider integers wrapped. NaN and floats out of range give some integer, "
    "which one is not specified"
)
to_f32 = _conversion("f32", _ROUNDED)
to_f64 = _conversion("f64", _ROUNDED)
to_i32 = _conversion("i32", _TRUNCATED)
to_i64 = _conversion("i64", _TRUNCATED)


def _bit_cast(name, kinds, doc):
    def typed(typingctx, v):
        _need(name, "v", v, *kinds)
        result = v.of(kinds[v.kind])

        def generate(context, builder, sig, args):
            return builder.bitcast(args[0], result.llvm)

        return result(v), generate

    typed.__name__ = typed.__qualname__ = name
    typed.__doc__ = doc
    return intrinsic(typed)


bits_i32 = _bit_cast("bits_i32", {"f32": "i32"}, "Return the bits of f32 lanes as i32.")
bits_i64 = _bit_cast("bits_i64", {"f64": "i64"}, "Return the bits of f64 lanes as i64.")
float_of_bits = _bit_cast(
    "float_of_bits", {"i32": "f32", "i64": "f64"},
    "Return the floats that have the bits of integers: f32 of i32, f64 of i64.",
)  # fmt: skip


# ---------------------------------------------------------------------------------------------
# Memory


def _element_of(name, arr, *, written=False):
    """Return the kind that an array's elements are read as and their LLVM type, or raise."""
    if not isinstance(arr, types.Array) or arr.layout != "C":
        raise errors.TypingError(f"{name}: arr must be a C-contiguous array, got {arr}")
    if arr.dtype not in _MEMORY:
        known = ", ".join(str(t) for t in _MEMORY)
        raise errors.TypingError(f"{name}: arr must hold one of {known}, got {arr.dtype}")
    if written and not arr.mutable:
        raise errors.TypingError(f"{name}: arr must be writable, got {arr}")
    return _MEMORY[arr.dtype]


def _integer(name, argument, typ):
    if not isinstance(typ, types.Integer):
        raise errors.TypingError(f"{name}: {argument} must be an integer, got {typ}")


def _pointer(context, builder, arr, value):
    return context.make_array(arr)(context, builder, value).data


def _address(context, builder, sig, args, element, lanes):
    """Return the address of `lanes` elements of the array in args[0] from the index in args[1]."""
    base = _pointer(context, builder, sig.args[0], args[0])
    index = context.cast(builder, args[1], sig.args[1], types.intp)
    return builder.bitcast(builder.gep(base, [index]), ir.VectorType(element, lanes).as_pointer())


def _from_memory(builder, value, vector):
    """Return lanes as they lie in memory as a vector: bytes widened, flags compared with zero."""
    if value.type == vector.llvm:
        return value
    if vector.kind == "mask":
        return builder.icmp_unsigned("!=", value, ir.Constant(value.type, None))
    return builder.zext(value, vector.llvm)


def _to_memory(builder, value, element):
    """Return a vector as it lies in memory: integers cut to bytes, masks as bytes 0 and 1."""
    old = value.type.element
    to = ir.VectorType(element, value.type.count)
    if old == element:
        return value
    return builder.zext(value, to) if old.width < element.width else builder.trunc(value, to)


def _bytes(element):
    return 8 if isinstance(element, ir.DoubleType) else getattr(element, "width", 32) // 8


def _align(element):
    return ir.Constant(_I32, _bytes(element))


@intrinsic(prefer_literal=True)
def load(typingctx, arr, i, lanes=None):
    """Return the elements of a C-contiguous array from flat index i: load(arr, i[, lanes]).

    All lanes must lie in the array; that is not checked. Elements are float32, float64, int32,
    int64, uint8 (read as i32) or bool (read as a mask).
    """
    kind, element = _element_of("load", arr)
    _integer("load", "i", i)
    vector = Vector(kind, _lanes(lanes))

    def generate(context, builder, sig, args):
        address = _address(context, builder, sig, args, element, vector.lanes)
        return _from_memory(builder, builder.load(address, align=_bytes(element)), vector)

    return vector(*_given(arr, i, lanes)), generate


@intrinsic
def store(typingctx, arr, i, v):
    """Write the lanes of v to a C-contiguous array from flat index i; see `load`."""
    kind, element = _element_of("store", arr, written=True)
    _integer("store", "i", i)
    _need("store", "v", v, kind)

    def generate(context, builder, sig, args):
        address = _address(context, builder, sig, args, element, v.lanes)
        builder.store(_to_memory(builder, args[2], element), address, align=_bytes(element))
        return context.get_dummy_value()

    return types.none(arr, i, v), generate


def _masked(name, kind, m, v):
    """Return the vector type of `kind` that goes with a mask, or raise if `v` cannot be in it."""
    _need(name, "m", m, "mask")
    vector = m.of(kind)
    if v != vector and (isinstance(v, Vector) or not _fits(vector, v)):
        raise errors.TypingError(f"{name}: wanted {vector} or a scalar that fits, got {v}")
    return vector


@intrinsic
def load_masked(typingctx, arr, i, m, default):
    """Return what `load` does in the lanes of m and the default, a scalar or vector, elsewhere.

    Lanes outside m read nothing and may lie outside the array.
    """
    kind, element = _element_of("load_masked", arr)
    _integer("load_masked", "i", i)
    vector = _masked("load_masked", kind, m, default)

    def generate(context, builder, sig, args):
        address = _address(context, builder, sig, args, element, vector.lanes)
        other = _widen(context, builder, args[3], sig.args[3], vector)
        typ = ir.VectorType(element, vector.lanes)
        narrow = _to_memory(builder, other, element)
        name = f"llvm.masked.load.{_suffix(typ)}.p0"
        read = _call(builder, name, typ, [address, _align(element), args[2], narrow])
        if typ == vector.llvm:
            return read
        return builder.select(args[2], _from_memory(builder, read, vector), other)

    return vector(arr, i, m, default), generate


@intrinsic
def store_masked(typingctx, arr, i, v, m):
    """Write the lanes of v that are in m; lanes outside m write nothing. See `store`."""
    kind, element = _element_of("store_masked", arr, written=True)
    _integer("store_masked", "i", i)
    vector = _masked("store_masked", kind, m, v)

    def generate(context, builder, sig, args):
        address = _address(context, builder, sig, args, element, vector.lanes)
        value = _widen(context, builder, args[2], sig.args[2], vector)
        value = _to_memory(builder, value, element)
        name = f"llvm.masked.store.{_suffix(value.type)}.p0"
        _call(builder, name, ir.VoidType(), [value, address, _align(element), args[3]])
        return context.get_dummy_value()

    return types.none(arr, i, v, m), generate


@intrinsic
def gather(typingctx, arr, idx, m, default):
    """Return arr.flat[idx] in the lanes of m and the default, a scalar or vector, elsewhere.

    The indices are i32 or i64, count elements from the start of the array and are not checked.
    Those outside m may be anything.
    """
    kind, element = _element_of("gather", arr)
    _need("gather", "idx", idx, "i32", "i64")
    vector = _masked("gather", kind, m, default)
    if idx.lanes != m.lanes:
        raise errors.TypingError(f"gather: idx must have {m.lanes} lanes, got {idx.lanes}")

    def generate(context, builder, sig, args):
        base = _pointer(context, builder, sig.args[0], args[0])
        other = _widen(context, builder, args[3], sig.args[3], vector)
        at = _append(builder, _Gep(builder.block, element, base, args[1]))
        typ = ir.VectorType(element, vector.lanes)
        narrow = _to_memory(builder, other, element)
        name = f"llvm.masked.gather.{_suffix(typ)}.v{vector.lanes}p0"
        read = _call(builder, name, typ, [at, _align(element), args[2], narrow])
        if typ == vector.llvm:
            return read
        return builder.select(args[2], _from_memory(builder, read, vector), other)

    return vector(arr, idx, m, default), generate


@intrinsic
def scatter(typingctx, arr, idx, v, m):
    """Write arr.flat[idx] = v in the lanes of m; the highest lane wins where indices are equal."""
    kind, element = _element_of("scatter", arr, written=True)
    _need("scatter", "idx", idx, "i32", "i64")
    vector = _masked("scatter", kind, m, v)
    if idx.lanes != m.lanes:
        raise errors.TypingError(f"scatter: idx must have {m.lanes} lanes, got {idx.lanes}")

    def generate(context, builder, sig, args):
        base = _pointer(context, builder, sig.args[0], args[0])
        value = _widen(context, builder, args[2], sig.args[2], vector)
        value = _to_memory(builder, value, element)
        at = _append(builder, _Gep(builder.block, element, base, args[1]))
        name = f"llvm.masked.scatter.{_suffix(value.type)}.v{vector.lanes}p0"
        _call(builder, name, ir.VoidType(), [value, at, _align(element), args[3]])
        return context.get_dummy_value()

    return types.none(arr, idx, v, m), generate


# ---------------------------------------------------------------------------------------------
# Lane packing


def _in_register(typ):
    """Whether AVX-512 packs vectors of this type in one instruction."""
    return AVX512 and typ.count * _bytes(typ.element) in (16, 32, 64)


def _halves(builder, vector):
    half = vector.type.count // 2
    return _take(builder, vector, range(half)), _take(builder, vector, range(half, 2 * half))


def _wide(typ):
    """Whether a vector is wider than a register that AVX-512 packs."""
    return AVX512 and typ.count * _bytes(typ.element) > 64


def _bits(builder, m):
    """Return a mask as an LLVM i64, lane 0 in bit 0."""
    packed = builder.bitcast(m, ir.IntType(m.type.count))
    return packed if m.type.count == 64 else builder.zext(packed, _I64)


def _count(builder, m):
    return builder.ctpop(_bits(builder, m))


def _compress(builder, v, m):
    """Return the lanes of v in m moved to the front, zeros behind."""
    zero = ir.Constant(v.type, None)
    if _in_register(v.type):
        name = f"llvm.x86.avx512.mask.compress.{_suffix(v.type)}"
        return _call(builder, name, v.type, [v, zero, m])
    lanes = v.type.count
    if _wide(v.type):
        # Pack both halves, then move the upper to where the lower ends: some of it still goes in
        # the lower half, the rest opens the upper.
        half = lanes // 2
        (low, high), (m_low, m_high) = _halves(builder, v), _halves(builder, m)
        low, high = _compress(builder, low, m_low), _compress(builder, high, m_high)
        count = _count(builder, m_low)
        room = builder.not_(_first(builder, count, half))
        rest = builder.not_(_first(builder, builder.sub(ir.Constant(_I64, half), count), half))
        return _join(builder, _expand(builder, high, room, low), _compress(builder, high, rest))
    # Every lane is written, and what comes after a lane outside the mask overwrites it. The last
    # lanes are zeroed where nothing was packed.
    buffer = cgutils.alloca_once(builder, ir.ArrayType(v.type.element, lanes))
    place = ir.Constant(_I32, 0)
    origin = ir.Constant(_I32, 0)
    for k in range(lanes):
        lane = ir.Constant(_I32, k)
        builder.store(builder.extract_element(v, lane), builder.gep(buffer, [origin, place]))
        place = builder.add(place, builder.zext(builder.extract_element(m, lane), _I32))
    packed = builder.load(
        builder.bitcast(buffer, v.type.as_pointer()), align=_bytes(v.type.element)
    )
    return builder.select(_first(builder, builder.zext(place, _I64), lanes), packed, zero)


def _expand(builder, v, m, other):
    """Return the first lanes of v moved to the lanes of m, `other` elsewhere."""
    if _in_register(v.type):
        name = f"llvm.x86.avx512.mask.expand.{_suffix(v.type)}"
        return _call(builder, name, v.type, [v, other, m])
    lanes = v.type.count
    if _wide(v.type):
        # The upper half begins where the lower half's mask ends counting.
        half = lanes // 2
        (low, high), (m_low, m_high) = _halves(builder, v), _halves(builder, m)
        other_low, other_high = _halves(builder, other)
        count = _count(builder, m_low)
        left = builder.not_(_first(builder, count, half))
        room = builder.not_(_first(builder, builder.sub(ir.Constant(_I64, half), count), half))
        upper = _expand(builder, high, room, _compress(builder, low, left))
        return _join(
            builder,
            _expand(builder, low, m_low, other_low),
            _expand(builder, upper, m_high, other_high),
        )
    buffer = cgutils.alloca_once(builder, ir.ArrayType(v.type.element, lanes))
    builder.store(v, builder.bitcast(buffer, v.type.as_pointer()), align=_bytes(v.type.element))
    place = ir.Constant(_I32, 0)
    origin = ir.Constant(_I32, 0)
    result = ir.Constant(v.type, ir.Undefined)
    for k in range(lanes):  # place is at most k, so the load stays in the buffer
        lane = ir.Constant(_I32, k)
        read = builder.load(builder.gep(buffer, [origin, place]))
        result = builder.insert_element(result, read, lane)
        place = builder.add(place, builder.zext(builder.extract_element(m, lane), _I32))
    return builder.select(m, result, other)


@intrinsic
def compress(typingctx, v, m):
    """Return the lanes of v that are in m moved to the front in their order, the rest zero."""
    _need("compress", "v", v, *_NUMBERS)
    _masked("compress", v.kind, m, v)

    def generate(context, builder, sig, args):
        return _compress(builder, *args)

    return v(v, m), generate


@intrinsic
def expand(typingctx, v, m, default):
    """Return the first lanes of v moved to the lanes of m in their order, the default elsewhere."""
    _need("expand", "v", v, *_NUMBERS)
    _masked("expand", v.kind, m, v)
    _masked("expand", v.kind, m, default)

    def generate(context, builder, sig, args):
        other = _widen(context, builder, args[2], sig.args[2], v)
        return _expand(builder, args[0], args[1], other)

    return v(v, m, default), generate


# ---------------------------------------------------------------------------------------------
# Across lanes


@intrinsic
def bits(typingctx, m):
    """Return a mask as an int64, lane 0 in bit 0."""
    _need("bits", "m", m, "mask")

    def generate(context, builder, sig, args):
        return _bits(builder, args[0])

    return types.int64(m), generate


@intrinsic(prefer_literal=True)
def mask_of_bits(typingctx, n, lanes=None):
    """Return the mask whose lane k is bit k of an integer: mask_of_bits(n[, lanes])."""
    _integer("mask_of_bits", "n", n)
    vector = Vector("mask", _lanes(lanes))

    def generate(context, builder, sig, args):
        n = context.cast(builder, args[0], sig.args[0], types.int64)
        packed = n if vector.lanes == 64 else builder.trunc(n, ir.IntType(vector.lanes))
        return builder.bitcast(packed, vector.llvm)

    return vector(*_given(n, lanes)), generate


@intrinsic
def any_(typingctx, m):
    """Return whether any lane of a mask is set."""
    _need("any_", "m", m, "mask")

    def generate(context, builder, sig, args):
        return builder.icmp_unsigned("!=", _bits(builder, args[0]), ir.Constant(_I64, 0))

    return types.boolean(m), generate


@intrinsic
def all_(typingctx, m):
    """Return whether all lanes of a mask are set."""
    _need("all_", "m", m, "mask")

    def generate(context, builder, sig, args):
        outside = _bits(builder, builder.not_(args[0]))
        return builder.icmp_unsigned("==", outside, ir.Constant(_I64, 0))

    return types.boolean(m), generate


@intrinsic
def count(typingctx, m):
    """Return how many lanes of a mask are set, an int64."""
    _need("count", "m", m, "mask")

    def generate(context, builder, sig, args):
        return _count(builder, args[0])

    return types.int64(m), generate


def _add(builder, a, b):
    floats = isinstance(a.type.element, (ir.FloatType, ir.DoubleType))
    return builder.fadd(a, b) if floats else builder.add(a, b)


def _reduction(name, combine, doc):
    def typed(typingctx, v):
        _need(name, "v", v, *_NUMBERS)

        def generate(context, builder, sig, args):
            value = args[0]
            while value.type.count > 1:
                value = combine(builder, *_halves(builder, value))
            return builder.extract_element(value, ir.Constant(_I32, 0))

        return v.scalar(v), generate

    typed.__name__ = typed.__qualname__ = name
    typed.__doc__ = f"""Return {doc} of all lanes, a scalar of their kind.

    The upper half of the lanes is put on the lower until one lane is left, always in this order.
    """
    return intrinsic(typed)


reduce_add = _reduction("reduce_add", _add, "the sum")
reduce_min = _reduction(
    "reduce_min", lambda b, x, y: _extreme(b, "<", x, y), "the `minimum` (so NaN may be lost)"
)
reduce_max = _reduction(
    "reduce_max", lambda b, x, y: _extreme(b, ">", x, y), "the `maximum` (so NaN may be lost)"
)


def _lane(context, builder, value, typ, lanes):
    """Return a lane's number, modulo the lanes: LLVM leaves others undefined."""
    k = context.cast(builder, value, typ, types.int64)
    return builder.and_(k, ir.Constant(_I64, lanes - 1))


@intrinsic
def extract(typingctx, v, k):
    """Return lane k, which is taken modulo the lanes and need not be a constant."""
    _need("extract", "v", v, *_ELEMENT)
    _integer("extract", "k", k)

    def generate(context, builder, sig, args):
        return builder.extract_element(
            args[0], _lane(context, builder, args[1], sig.args[1], v.lanes)
        )

    return v.scalar(v, k), generate


@intrinsic
def insert(typingctx, v, k, x):
    """Return v with x, converted to its kind, in lane k, which is taken modulo the lanes."""
    _need("insert", "v", v, *_ELEMENT)
    _integer("insert", "k", k)
    if not _fits(v, x):
        raise errors.TypingError(f"insert: x must be a scalar that fits {v}, got {x}")

    def generate(context, builder, sig, args):
        x = context.cast(builder, args[2], sig.args[2], v.scalar)
        lane = _lane(context, builder, args[1], sig.args[1], v.lanes)
        return builder.insert_element(args[0], x, lane)

    return v(v, k, x), generate
