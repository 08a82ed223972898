"""Pieces of LLVM code that the operations on vectors are put together from."""

from __future__ import annotations

from llvmlite import ir
from numba.core import cgutils

from ._vector import Vector

I32 = ir.IntType(32)
I64 = ir.IntType(64)


class Gep(ir.instructions.Instruction):
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


class Freeze(ir.instructions.Instruction):
    """`freeze`, which llvmlite lacks: lanes that are undefined become some number."""

    def __init__(self, parent, value, name=""):
        super().__init__(parent, value.type, "freeze", [value], name=name)

    def descr(self, buf):
        """Write the instruction."""
        (value,) = self.operands
        buf.append(f"freeze {value.type} {value.get_reference()}\n")


def append(builder, instruction):
    builder._insert(instruction)
    return instruction


def call(builder, name, result, arguments):
    """Call an LLVM intrinsic."""
    function = ir.FunctionType(result, [a.type for a in arguments])
    return builder.call(cgutils.get_or_insert_function(builder.module, function, name), arguments)


def suffix(typ):
    """Return what LLVM calls a vector type in the names of its intrinsics, such as "v16f32"."""
    letter = {ir.FloatType(): "f32", ir.DoubleType(): "f64"}.get(typ.element)
    return f"v{typ.count}{letter or f'i{typ.element.width}'}"


def constant(typ, values):
    return ir.Constant(typ, list(values))


def bytes_of(element):
    return 8 if isinstance(element, ir.DoubleType) else getattr(element, "width", 32) // 8


def splat(builder, scalar, lanes):
    typ = ir.VectorType(scalar.type, lanes)
    undefined = ir.Constant(typ, ir.Undefined)
    one = builder.insert_element(undefined, scalar, ir.Constant(I32, 0))
    return builder.shuffle_vector(one, undefined, constant(ir.VectorType(I32, lanes), [0] * lanes))


def take(builder, vector, lanes):
    """Return the lanes of a vector that a list of numbers names."""
    undefined = ir.Constant(vector.type, ir.Undefined)
    return builder.shuffle_vector(
        vector, undefined, constant(ir.VectorType(I32, len(lanes)), lanes)
    )


def join(builder, low, high):
    lanes = 2 * low.type.count
    return builder.shuffle_vector(low, high, constant(ir.VectorType(I32, lanes), range(lanes)))


def halves(builder, vector):
    half = vector.type.count // 2
    return take(builder, vector, range(half)), take(builder, vector, range(half, 2 * half))


def widen(context, builder, value, typ, vector):
    """Return a value as a vector: as it is, or a scalar converted and put in all lanes."""
    if isinstance(typ, Vector):
        return value
    return splat(builder, context.cast(builder, value, typ, vector.scalar), vector.lanes)


def first_lanes(builder, n, lanes):
    """Return the mask of the first n lanes for an LLVM i64."""
    zero, most = ir.Constant(I64, 0), ir.Constant(I64, lanes)
    n = builder.select(builder.icmp_signed("<", n, zero), zero, n)
    n = builder.select(builder.icmp_signed("<", n, most), n, most)
    iota = constant(ir.VectorType(I32, lanes), range(lanes))
    return builder.icmp_signed("<", iota, splat(builder, builder.trunc(n, I32), lanes))


def bits_of(builder, m):
    """Return a mask as an LLVM i64, lane 0 in bit 0."""
    packed = builder.bitcast(m, ir.IntType(m.type.count))
    return packed if m.type.count == 64 else builder.zext(packed, I64)


def count_of(builder, m):
    return builder.ctpop(bits_of(builder, m))


def extreme(builder, symbol, a, b):
    floats = isinstance(a.type.element, (ir.FloatType, ir.DoubleType))
    compare = builder.fcmp_ordered if floats else builder.icmp_signed
    return builder.select(compare(symbol, a, b), a, b)
