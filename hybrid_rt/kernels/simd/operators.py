"""Python's operators on vectors; importing this module gives them to Numba."""

from __future__ import annotations

import operator

from llvmlite import ir
from numba import types
from numba.core.imputils import lower_builtin
from numba.core.typing.templates import AbstractTemplate, infer_global, signature

from ._build import constant, widen
from ._vector import Vector, common


def _operator(op, builds, result=None):
    """Give vectors a binary operator: how to build it by group, and the kind of the result."""

    @infer_global(op)
    class Template(AbstractTemplate):
        def generic(self, args, kws):
            if kws or len(args) != 2 or not any(isinstance(a, Vector) for a in args):
                return None
            vector = common(op.__name__, args)
            if vector.group not in builds:
                return None
            scalar = vector.scalar
            operands = [a if isinstance(a, Vector) else scalar for a in args]
            return signature(vector.of(result) if result else vector, *operands)

    def lower(context, builder, sig, args):
        vector = common(op.__name__, sig.args)
        operands = [
            widen(context, builder, a, t, vector) for a, t in zip(args, sig.args, strict=True)
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
    return builder.and_(count, constant(count.type, [bits - 1] * count.type.count))


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
