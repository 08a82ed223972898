"""What is done to each lane alone and is no operator."""

from __future__ import annotations

from llvmlite import ir
from numba.core import errors
from numba.extending import intrinsic

from ._build import Freeze, append, call, extreme, suffix, widen
from ._vector import ELEMENT, NUMBERS, common, need


@intrinsic
def select(typingctx, m, a, b):
    """Return a where the mask m is set and b elsewhere; one of a and b may be a scalar."""
    need("select", "m", m, "mask")
    vector = common("select", (a, b))
    if vector.lanes != m.lanes:
        raise errors.TypingError(f"select: m must have {vector.lanes} lanes, got {m.lanes}")

    def generate(context, builder, sig, args):
        a = widen(context, builder, args[1], sig.args[1], vector)
        b = widen(context, builder, args[2], sig.args[2], vector)
        return builder.select(args[0], a, b)

    return vector(m, a, b), generate


def _extreme_of(name, symbol):
    def typed(typingctx, a, b):
        vector = common(name, (a, b))
        need(name, "a", vector, *NUMBERS)

        def generate(context, builder, sig, args):
            a, b = (
                widen(context, builder, v, t, vector) for v, t in zip(args, sig.args, strict=True)
            )
            return extreme(builder, symbol, a, b)

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
        need(name, "v", v, *kinds)

        def generate(context, builder, sig, args):
            if v.group == "int":  # the least integer has no absolute value: it stays
                args = (args[0], ir.Constant(ir.IntType(1), 0))
            function = f"llvm.{called[v.group]}.{suffix(v.llvm)}"
            return call(builder, function, v.llvm, list(args))

        return v(v), generate

    typed.__name__ = typed.__qualname__ = name
    typed.__doc__ = doc
    return intrinsic(typed)


absolute = _math(
    "absolute", {"float": "fabs", "int": "abs"}, NUMBERS,
    "Return the absolute value; the least integer stays itself.",
)  # fmt: skip
floor = _math(
    "floor", {"float": "floor"}, ("f32", "f64"), "Return the greatest whole number not above."
)
root = _math("root", {"float": "sqrt"}, ("f32", "f64"), "Return the square root, rounded.")


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
        return append(builder, Freeze(builder.block, builder.fptosi(value, to)))
    return builder.sext(value, to) if new.kind == "i64" else builder.trunc(value, to)


def _conversion(kind, detail):
    name = f"to_{kind}"

    def typed(typingctx, v):
        need(name, "v", v, *ELEMENT)
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
        need(name, "v", v, *kinds)
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
