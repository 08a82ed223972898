"""Loads and stores of triples that follow each other, such as the rows of an (N, 3) array.

A vector holds one coordinate of all of them. That takes three loads or stores and a few shuffles,
where three gathers or scatters would touch every element alone.
"""

from __future__ import annotations

from llvmlite import ir
from numba import types
from numba.core import errors
from numba.extending import intrinsic

from ._build import I32, I64, call, constant, first_lanes, suffix, take
from ._vector import Vector, given, lanes_of, need, need_integer
from .memory import _address, _align, _element_of


def _triples_of(name, arr, *, written=False):
    """Return the kind of an array of numbers and their LLVM type, or raise."""
    kind, element = _element_of(name, arr, written=written)
    if arr.dtype not in (types.float32, types.float64, types.int32, types.int64):
        raise errors.TypingError(
            f"{name}: arr must hold float32, float64, int32 or int64, got {arr.dtype}"
        )
    return kind, element


def _row(context, builder, sig, args, element, lanes, k):
    """Return the address of row number k of `lanes` elements from the index in args[1]."""
    start = context.cast(builder, args[1], sig.args[1], types.intp)
    start = builder.add(start, ir.Constant(start.type, k * lanes))
    return _address(
        context, builder, sig.return_type(sig.args[0], types.intp), (args[0], start), element, lanes
    )


def _shuffle(builder, a, b, lanes):
    return builder.shuffle_vector(a, b, constant(ir.VectorType(I32, len(lanes)), lanes))


@intrinsic(prefer_literal=True)
def load_triples(typingctx, arr, i, n, lanes=None):
    """Return three vectors: arr.flat[i], [i + 3] ..., arr.flat[i + 1] ... and arr.flat[i + 2] ...

    load_triples(arr, i, n[, lanes]) reads n triples, at most as many as there are lanes and none
    if n is negative; the lanes behind them are 0. arr is as for `load`, and holds float32, float64,
    int32 or int64.
    """
    kind, element = _triples_of("load_triples", arr)
    need_integer("load_triples", "i", i)
    need_integer("load_triples", "n", n)
    vector = Vector(kind, lanes_of(lanes))
    count = vector.lanes

    def generate(context, builder, sig, args):
        left = context.cast(builder, args[2], sig.args[2], types.int64)
        left = builder.mul(left, ir.Constant(I64, 3))
        name = f"llvm.masked.load.{suffix(vector.llvm)}.p0"
        rows = []
        for k in range(3):
            live = first_lanes(builder, builder.sub(left, ir.Constant(I64, k * count)), count)
            address = _row(context, builder, sig, args, element, count, k)
            zero = ir.Constant(vector.llvm, None)
            rows.append(call(builder, name, vector.llvm, [address, _align(element), live, zero]))
        result = []
        for k in range(3):
            places = [3 * lane + k for lane in range(count)]
            early = _shuffle(builder, *rows[:2], [p if p < 2 * count else 0 for p in places])
            late = [j if p < 2 * count else p - count for j, p in enumerate(places)]
            result.append(_shuffle(builder, early, rows[2], late))
        return context.make_tuple(builder, sig.return_type, result)

    return types.UniTuple(vector, 3)(*given(arr, i, n, lanes)), generate


@intrinsic
def store_triples(typingctx, arr, i, a, b, c, m):
    """Write a, b and c to arr.flat[i], [i + 3] ..., arr.flat[i + 1] ... and arr.flat[i + 2] ...

    Lanes outside m write nothing. arr is as for `load_triples`.
    """
    kind, element = _triples_of("store_triples", arr, written=True)
    need_integer("store_triples", "i", i)
    need("store_triples", "m", m, "mask")
    vector = m.of(kind)
    for name, v in (("a", a), ("b", b), ("c", c)):
        if v != vector:
            raise errors.TypingError(f"store_triples: {name} must be {vector}, got {v}")
    count = vector.lanes

    def generate(context, builder, sig, args):
        _, _, a, b, c, m = args
        name = f"llvm.masked.store.{suffix(vector.llvm)}.p0"
        for k in range(3):
            places = [divmod(k * count + lane, 3) for lane in range(count)]
            early = _shuffle(builder, a, b, [r + count * (axis == 1) for r, axis in places])
            late = [j if axis < 2 else count + r for j, (r, axis) in enumerate(places)]
            value = _shuffle(builder, early, c, late)
            live = take(builder, m, [r for r, _ in places])
            address = _row(context, builder, sig, args, element, count, k)
            call(builder, name, ir.VoidType(), [value, address, _align(element), live])
        return context.get_dummy_value()

    return types.none(arr, i, a, b, c, m), generate
