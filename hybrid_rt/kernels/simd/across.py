"""What depends on all lanes together, and single lanes."""

from __future__ import annotations

from llvmlite import ir
from numba import types
from numba.core import errors
from numba.extending import intrinsic

from ._build import I32, I64, bits_of, count_of, extreme, halves
from ._vector import ELEMENT, NUMBERS, fits, need, need_integer


@intrinsic
def bits(typingctx, m):
    """Return a mask as an int64, lane 0 in bit 0."""
    need("bits", "m", m, "mask")

    def generate(context, builder, sig, args):
        return bits_of(builder, args[0])

    return types.int64(m), generate


@intrinsic
def lowest(typingctx, n):
    """Return the number of the lowest set bit of an integer, a lane of `bits`; 64 of zero."""
    need_integer("lowest", "n", n)

    def generate(context, builder, sig, args):
        word = context.cast(builder, args[0], sig.args[0], types.int64)
        return builder.cttz(word, ir.Constant(ir.IntType(1), 0))

    return types.int64(n), generate


@intrinsic
def any_(typingctx, m):
    """Return whether any lane of a mask is set."""
    need("any_", "m", m, "mask")

    def generate(context, builder, sig, args):
        return builder.icmp_unsigned("!=", bits_of(builder, args[0]), ir.Constant(I64, 0))

    return types.boolean(m), generate


@intrinsic
def all_(typingctx, m):
    """Return whether all lanes of a mask are set."""
    need("all_", "m", m, "mask")

    def generate(context, builder, sig, args):
        outside = bits_of(builder, builder.not_(args[0]))
        return builder.icmp_unsigned("==", outside, ir.Constant(I64, 0))

    return types.boolean(m), generate


@intrinsic
def count(typingctx, m):
    """Return how many lanes of a mask are set, an int64."""
    need("count", "m", m, "mask")

    def generate(context, builder, sig, args):
        return count_of(builder, args[0])

    return types.int64(m), generate


def _add(builder, a, b):
    floats = isinstance(a.type.element, (ir.FloatType, ir.DoubleType))
    return builder.fadd(a, b) if floats else builder.add(a, b)


def _reduction(name, combine, doc):
    def typed(typingctx, v):
        need(name, "v", v, *NUMBERS)

        def generate(context, builder, sig, args):
            value = args[0]
            while value.type.count > 1:
                value = combine(builder, *halves(builder, value))
            return builder.extract_element(value, ir.Constant(I32, 0))

        return v.scalar(v), generate

    typed.__name__ = typed.__qualname__ = name
    typed.__doc__ = f"""Return {doc} of all lanes, a scalar of their kind.

    The upper half of the lanes is put on the lower until one lane is left, always in this order.
    """
    return intrinsic(typed)


reduce_add = _reduction("reduce_add", _add, "the sum")
reduce_min = _reduction(
    "reduce_min", lambda b, x, y: extreme(b, "<", x, y), "the `minimum` (so NaN may be lost)"
)


def _lane(context, builder, value, typ, lanes):
    """Return a lane's number, modulo the lanes: LLVM leaves others undefined."""
    k = context.cast(builder, value, typ, types.int64)
    return builder.and_(k, ir.Constant(I64, lanes - 1))


@intrinsic
def extract(typingctx, v, k):
    """Return lane k, which is taken modulo the lanes and need not be a constant."""
    need("extract", "v", v, *ELEMENT)
    need_integer("extract", "k", k)

    def generate(context, builder, sig, args):
        return builder.extract_element(
            args[0], _lane(context, builder, args[1], sig.args[1], v.lanes)
        )

    return v.scalar(v, k), generate


@intrinsic
def insert(typingctx, v, k, x):
    """Return v with x, converted to its kind, in lane k, which is taken modulo the lanes."""
    need("insert", "v", v, *ELEMENT)
    need_integer("insert", "k", k)
    if not fits(v, x):
        raise errors.TypingError(f"insert: x must be a scalar that fits {v}, got {x}")

    def generate(context, builder, sig, args):
        x = context.cast(builder, args[2], sig.args[2], v.scalar)
        lane = _lane(context, builder, args[1], sig.args[1], v.lanes)
        return builder.insert_element(args[0], x, lane)

    return v(v, k, x), generate
