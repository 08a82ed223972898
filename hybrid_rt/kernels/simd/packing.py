"""Moving the lanes of a mask together and apart again."""

from __future__ import annotations

from llvmlite import ir
from numba.core import cgutils
from numba.extending import intrinsic

from ._build import I32, I64, bytes_of, call, count_of, first_lanes, halves, join, suffix, widen
from ._vector import AVX512, NUMBERS, need, need_masked


def _in_register(typ):
    """Whether AVX-512 packs vectors of this type in one instruction."""
    return AVX512 and typ.count * bytes_of(typ.element) in (16, 32, 64)


def _wide(typ):
    """Whether a vector is wider than a register that AVX-512 packs."""
    return AVX512 and typ.count * bytes_of(typ.element) > 64


def _compress(builder, v, m):
    """Return the lanes of v in m moved to the front, zeros behind."""
    zero = ir.Constant(v.type, None)
    if _in_register(v.type):
        name = f"llvm.x86.avx512.mask.compress.{suffix(v.type)}"
        return call(builder, name, v.type, [v, zero, m])
    lanes = v.type.count
    if _wide(v.type):
        # Pack both halves, then move the upper to where the lower ends: some of it still goes in
        # the lower half, the rest opens the upper.
        half = lanes // 2
        (low, high), (m_low, m_high) = halves(builder, v), halves(builder, m)
        low, high = _compress(builder, low, m_low), _compress(builder, high, m_high)
        count = count_of(builder, m_low)
        room = builder.not_(first_lanes(builder, count, half))
        rest = builder.not_(first_lanes(builder, builder.sub(ir.Constant(I64, half), count), half))
        return join(builder, _expand(builder, high, room, low), _compress(builder, high, rest))
    # Every lane is written, and what comes after a lane outside the mask overwrites it. The last
    # lanes are zeroed where nothing was packed.
    buffer = cgutils.alloca_once(builder, ir.ArrayType(v.type.element, lanes))
    place = ir.Constant(I32, 0)
    origin = ir.Constant(I32, 0)
    for k in range(lanes):
        lane = ir.Constant(I32, k)
        builder.store(builder.extract_element(v, lane), builder.gep(buffer, [origin, place]))
        place = builder.add(place, builder.zext(builder.extract_element(m, lane), I32))
    packed = builder.load(
        builder.bitcast(buffer, v.type.as_pointer()), align=bytes_of(v.type.element)
    )
    return builder.select(first_lanes(builder, builder.zext(place, I64), lanes), packed, zero)


def _expand(builder, v, m, other):
    """Return the first lanes of v moved to the lanes of m, `other` elsewhere."""
    if _in_register(v.type):
        name = f"llvm.x86.avx512.mask.expand.{suffix(v.type)}"
        return call(builder, name, v.type, [v, other, m])
    lanes = v.type.count
    if _wide(v.type):
        # The upper half begins where the lower half's mask ends counting.
        half = lanes // 2
        (low, high), (m_low, m_high) = halves(builder, v), halves(builder, m)
        other_low, other_high = halves(builder, other)
        count = count_of(builder, m_low)
        left = builder.not_(first_lanes(builder, count, half))
        room = builder.not_(first_lanes(builder, builder.sub(ir.Constant(I64, half), count), half))
        upper = _expand(builder, high, room, _compress(builder, low, left))
        return join(
            builder,
            _expand(builder, low, m_low, other_low),
            _expand(builder, upper, m_high, other_high),
        )
    buffer = cgutils.alloca_once(builder, ir.ArrayType(v.type.element, lanes))
    builder.store(v, builder.bitcast(buffer, v.type.as_pointer()), align=bytes_of(v.type.element))
    place = ir.Constant(I32, 0)
    origin = ir.Constant(I32, 0)
    result = ir.Constant(v.type, ir.Undefined)
    for k in range(lanes):  # place is at most k, so the load stays in the buffer
        lane = ir.Constant(I32, k)
        read = builder.load(builder.gep(buffer, [origin, place]))
        result = builder.insert_element(result, read, lane)
        place = builder.add(place, builder.zext(builder.extract_element(m, lane), I32))
    return builder.select(m, result, other)


@intrinsic
def compress(typingctx, v, m):
    """Return the lanes of v that are in m moved to the front in their order, the rest zero."""
    need("compress", "v", v, *NUMBERS)
    need_masked("compress", v.kind, m, v)

    def generate(context, builder, sig, args):
        return _compress(builder, *args)

    return v(v, m), generate


@intrinsic
def expand(typingctx, v, m, default):
    """Return the first lanes of v moved to the lanes of m in their order, the default elsewhere."""
    need("expand", "v", v, *NUMBERS)
    need_masked("expand", v.kind, m, v)
    need_masked("expand", v.kind, m, default)

    def generate(context, builder, sig, args):
        other = widen(context, builder, args[2], sig.args[2], v)
        return _expand(builder, args[0], args[1], other)

    return v(v, m, default), generate
