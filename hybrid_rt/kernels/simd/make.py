"""Vectors of scalars and of lane numbers, and masks of the first lanes and of bits."""

from __future__ import annotations

from llvmlite import ir
from numba import types
from numba.core import errors
from numba.extending import intrinsic

from ._build import constant, first_lanes, widen
from ._vector import Vector, given, lanes_of, need_integer


def _constructor(kind, scalars):
    def typed(typingctx, x, lanes=None):
        vector = Vector(kind, lanes_of(lanes))
        if not isinstance(x, scalars):
            raise errors.TypingError(f"{kind}: x must be a scalar, got {x}")

        def generate(context, builder, sig, args):
            return widen(context, builder, args[0], sig.args[0], vector)

        return vector(*given(x, lanes)), generate

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
    vector = Vector("i32", lanes_of(lanes))

    def generate(context, builder, sig, args):
        return constant(vector.llvm, range(vector.lanes))

    return vector(*given(lanes)), generate


@intrinsic(prefer_literal=True)
def first(typingctx, n, lanes=None):
    """Return the mask of the first n lanes, none or all if n is out of range: first(n[, lanes])."""
    vector = Vector("mask", lanes_of(lanes))
    if not isinstance(n, types.Integer):
        raise errors.TypingError(f"first: n must be an integer, got {n}")

    def generate(context, builder, sig, args):
        n = context.cast(builder, args[0], sig.args[0], types.int64)
        return first_lanes(builder, n, vector.lanes)

    return vector(*given(n, lanes)), generate


@intrinsic(prefer_literal=True)
def mask_of_bits(typingctx, n, lanes=None):
    """Return the mask whose lane k is bit k of an integer: mask_of_bits(n[, lanes])."""
    need_integer("mask_of_bits", "n", n)
    vector = Vector("mask", lanes_of(lanes))

    def generate(context, builder, sig, args):
        n = context.cast(builder, args[0], sig.args[0], types.int64)
        packed = n if vector.lanes == 64 else builder.trunc(n, ir.IntType(vector.lanes))
        return builder.bitcast(packed, vector.llvm)

    return vector(*given(n, lanes)), generate
