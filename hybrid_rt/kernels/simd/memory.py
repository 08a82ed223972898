"""Loads and stores: in a row, under a mask, and at indices."""

from __future__ import annotations

from llvmlite import ir
from numba import types
from numba.core import errors
from numba.extending import intrinsic

from ._build import I32, I64, Gep, append, bytes_of, call, suffix, widen
from ._vector import Vector, given, lanes_of, need, need_integer, need_masked

# What an array's element is in memory and the kind of vector it is read as.
_MEMORY = {
    types.float32: ("f32", ir.FloatType()),
    types.float64: ("f64", ir.DoubleType()),
    types.int32: ("i32", I32),
    types.int64: ("i64", I64),
    types.uint8: ("i32", ir.IntType(8)),
    types.boolean: ("mask", ir.IntType(8)),
}


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


def _align(element):
    return ir.Constant(I32, bytes_of(element))


@intrinsic(prefer_literal=True)
def load(typingctx, arr, i, lanes=None):
    """Return the elements of a C-contiguous array from flat index i: load(arr, i[, lanes]).

    All lanes must lie in the array; that is not checked. Elements are float32, float64, int32,
    int64, uint8 (read as i32) or bool (read as a mask).
    """
    kind, element = _element_of("load", arr)
    need_integer("load", "i", i)
    vector = Vector(kind, lanes_of(lanes))

    def generate(context, builder, sig, args):
        address = _address(context, builder, sig, args, element, vector.lanes)
        return _from_memory(builder, builder.load(address, align=bytes_of(element)), vector)

    return vector(*given(arr, i, lanes)), generate


@intrinsic
def store(typingctx, arr, i, v):
    """Write the lanes of v to a C-contiguous array from flat index i; see `load`."""
    kind, element = _element_of("store", arr, written=True)
    need_integer("store", "i", i)
    need("store", "v", v, kind)

    def generate(context, builder, sig, args):
        address = _address(context, builder, sig, args, element, v.lanes)
        builder.store(_to_memory(builder, args[2], element), address, align=bytes_of(element))
        return context.get_dummy_value()

    return types.none(arr, i, v), generate


@intrinsic
def load_masked(typingctx, arr, i, m, default):
    """Return what `load` does in the lanes of m and the default, a scalar or vector, elsewhere.

    Lanes outside m read nothing and may lie outside the array.
    """
    kind, element = _element_of("load_masked", arr)
    need_integer("load_masked", "i", i)
    vector = need_masked("load_masked", kind, m, default)

    def generate(context, builder, sig, args):
        address = _address(context, builder, sig, args, element, vector.lanes)
        other = widen(context, builder, args[3], sig.args[3], vector)
        typ = ir.VectorType(element, vector.lanes)
        narrow = _to_memory(builder, other, element)
        name = f"llvm.masked.load.{suffix(typ)}.p0"
        read = call(builder, name, typ, [address, _align(element), args[2], narrow])
        if typ == vector.llvm:
            return read
        return builder.select(args[2], _from_memory(builder, read, vector), other)

    return vector(arr, i, m, default), generate


@intrinsic
def store_masked(typingctx, arr, i, v, m):
    """Write the lanes of v that are in m; lanes outside m write nothing. See `store`."""
    kind, element = _element_of("store_masked", arr, written=True)
    need_integer("store_masked", "i", i)
    vector = need_masked("store_masked", kind, m, v)

    def generate(context, builder, sig, args):
        address = _address(context, builder, sig, args, element, vector.lanes)
        value = widen(context, builder, args[2], sig.args[2], vector)
        value = _to_memory(builder, value, element)
        name = f"llvm.masked.store.{suffix(value.type)}.p0"
        call(builder, name, ir.VoidType(), [value, address, _align(element), args[3]])
        return context.get_dummy_value()

    return types.none(arr, i, v, m), generate


@intrinsic
def gather(typingctx, arr, idx, m, default):
    """Return arr.flat[idx] in the lanes of m and the default, a scalar or vector, elsewhere.

    The indices are i32 or i64, count elements from the start of the array and are not checked.
    Those outside m may be anything.
    """
    kind, element = _element_of("gather", arr)
    need("gather", "idx", idx, "i32", "i64")
    vector = need_masked("gather", kind, m, default)
    if idx.lanes != m.lanes:
        raise errors.TypingError(f"gather: idx must have {m.lanes} lanes, got {idx.lanes}")

    def generate(context, builder, sig, args):
        base = _pointer(context, builder, sig.args[0], args[0])
        other = widen(context, builder, args[3], sig.args[3], vector)
        at = append(builder, Gep(builder.block, element, base, args[1]))
        typ = ir.VectorType(element, vector.lanes)
        narrow = _to_memory(builder, other, element)
        name = f"llvm.masked.gather.{suffix(typ)}.v{vector.lanes}p0"
        read = call(builder, name, typ, [at, _align(element), args[2], narrow])
        if typ == vector.llvm:
            return read
        return builder.select(args[2], _from_memory(builder, read, vector), other)

    return vector(arr, idx, m, default), generate


@intrinsic
def scatter(typingctx, arr, idx, v, m):
    """Write arr.flat[idx] = v in the lanes of m; the highest lane wins where indices are equal."""
    kind, element = _element_of("scatter", arr, written=True)
    need("scatter", "idx", idx, "i32", "i64")
    vector = need_masked("scatter", kind, m, v)
    if idx.lanes != m.lanes:
        raise errors.TypingError(f"scatter: idx must have {m.lanes} lanes, got {idx.lanes}")

    def generate(context, builder, sig, args):
        base = _pointer(context, builder, sig.args[0], args[0])
        value = widen(context, builder, args[2], sig.args[2], vector)
        value = _to_memory(builder, value, element)
        at = append(builder, Gep(builder.block, element, base, args[1]))
        name = f"llvm.masked.scatter.{suffix(value.type)}.v{vector.lanes}p0"
        call(builder, name, ir.VoidType(), [value, at, _align(element), args[3]])
        return context.get_dummy_value()

    return types.none(arr, idx, v, m), generate


@intrinsic
def prefetch(typingctx, arr, idx, m):
    """Ask for the cache lines of arr.flat[idx] in the lanes of m, before they are needed."""
    _element_of("prefetch", arr)
    need("prefetch", "idx", idx, "i32", "i64")
    need("prefetch", "m", m, "mask")

    def generate(context, builder, sig, args):
        base = _pointer(context, builder, sig.args[0], args[0])
        zero = ir.Constant(args[1].type, None)
        index = builder.select(args[2], args[1], zero)
        byte = ir.IntType(8).as_pointer()
        for k in range(m.lanes):
            lane = builder.sext(builder.extract_element(index, ir.Constant(I32, k)), ir.IntType(64))
            address = builder.bitcast(builder.gep(base, [lane]), byte)
            flags = [ir.Constant(I32, n) for n in (0, 3, 1)]  # read, keep in all caches, data
            call(builder, "llvm.prefetch.p0", ir.VoidType(), [address, *flags])
        return context.get_dummy_value()

    return types.none(arr, idx, m), generate
