"""Putting two vectors together lane by lane, and taking a vector apart."""

from __future__ import annotations

from llvmlite import ir
from numba.core import errors
from numba.extending import intrinsic

from ._build import I32, constant, take
from ._vector import NUMBERS, Vector, common, given, lanes_of, need, need_integer


@intrinsic
def interleave(typingctx, a, b):
    """Return twice the lanes: a[0], b[0], a[1], b[1] ...

    Three rounds of it, each on the vectors of the last, make rows of columns: eight vectors of
    eight lanes come out as one of 64, transposed, if the halves are taken as pairs.
    """
    vector = common("interleave", (a, b))
    need("interleave", "a", a, *NUMBERS)
    need("interleave", "b", b, *NUMBERS)
    result = Vector(vector.kind, 2 * vector.lanes)

    def generate(context, builder, sig, args):
        lanes = [k for pair in zip(range(vector.lanes), range(vector.lanes, 2 * vector.lanes),
                                   strict=True) for k in pair]  # fmt: skip
        mask = constant(ir.VectorType(I32, len(lanes)), lanes)
        return builder.shuffle_vector(*args, mask)

    return result(a, b), generate


@intrinsic(prefer_literal=True)
def part(typingctx, v, k, lanes=None):
    """Return part number k of a vector cut in parts of some lanes: part(v, k[, lanes]).

    k is a constant.
    """
    need("part", "v", v, *NUMBERS)
    need_integer("part", "k", k)
    result = Vector(v.kind, lanes_of(lanes))
    number = getattr(k, "literal_value", None)
    if number is None or not 0 <= number < v.lanes // result.lanes:
        raise errors.TypingError(
            f"part: k must be a constant from 0 to {v.lanes // result.lanes - 1}, got {k}"
        )

    def generate(context, builder, sig, args):
        return take(
            builder, args[0], list(range(number * result.lanes, (number + 1) * result.lanes))
        )

    return result(v, k, given(lanes)[0]), generate
