"""Tuples of vectors: chosen from lane by lane, and kept in memory."""

from __future__ import annotations

from llvmlite import ir
from numba import types
from numba.core import errors
from numba.extending import intrinsic

from ._build import bytes_of
from ._vector import Vector, need
from .packing import _compress, _expand


def _vectors_of(record):
    """Yield the vectors that a tuple, or the tuples in it, are made of."""
    for part in record:
        if isinstance(part, types.BaseTuple):
            yield from _vectors_of(part)
        else:
            yield part


def _select(builder, m, a, b, record):
    made = a
    for k, part in enumerate(record):
        new, old = builder.extract_value(a, k), builder.extract_value(b, k)
        if isinstance(part, types.BaseTuple):
            chosen = _select(builder, m, new, old, part)
        else:
            chosen = builder.select(m, new, old)
        made = builder.insert_value(made, chosen, k)
    return made


@intrinsic
def select_each(typingctx, m, a, b):
    """Return a tuple of the lanes of a's vectors where the mask m is set, and of b's elsewhere.

    a and b are tuples, named or not, of one type, whose parts are vectors, masks among them, or
    tuples of such.
    """
    need("select_each", "m", m, "mask")
    of_vectors = isinstance(a, types.BaseTuple) and all(
        isinstance(v, Vector) and v.lanes == m.lanes for v in _vectors_of(a)
    )
    if a != b or not of_vectors:
        raise errors.TypingError(
            f"select_each takes two tuples of one type, of vectors of {m.lanes} lanes; "
            f"got {a} and {b}"
        )

    def generate(context, builder, sig, args):
        return _select(builder, *args, a)

    return a(m, a, b), generate


def _rows(builder, record, value, row=0):
    """Yield the vectors of a record, with the number of the row that each has in memory."""
    for k, part in enumerate(record):
        inner = builder.extract_value(value, k)
        if isinstance(part, types.BaseTuple):
            yield from _rows(builder, part, inner, row)
            row += sum(1 for _ in _vectors_of(part))
        else:
            yield row, part, inner
            row += 1


def _row_address(context, builder, sig, args, row, vector):
    """Return the address of entry args[1] of a row of the memory in args[0], as a vector's."""
    memory = context.make_array(sig.args[0])(context, builder, args[0])
    pitch = builder.extract_value(memory.shape, 1)
    start = builder.mul(pitch, ir.Constant(pitch.type, row))
    base = builder.gep(memory.data, [start])
    element = ir.IntType(32) if vector.kind == "mask" else vector.llvm.element
    base = builder.bitcast(base, element.as_pointer())
    at = context.cast(builder, args[1], sig.args[1], types.intp)
    whole = ir.VectorType(element, vector.lanes)
    return builder.bitcast(builder.gep(base, [at]), whole.as_pointer()), whole


def _check_memory(name, memory, record):
    if not (
        isinstance(memory, types.Array)
        and memory.dtype == types.int64
        and memory.ndim == 2
        and memory.layout == "C"
    ):
        raise errors.TypingError(f"{name}: memory must be a C array (R, N) of int64, got {memory}")
    if not isinstance(record, types.BaseTuple):
        raise errors.TypingError(f"{name}: record must be a tuple of vectors, got {record}")


@intrinsic
def push(typingctx, memory, at, record, m):
    """Write the lanes of m of a record's vectors, one after the other, from entry `at` on.

    memory (R, N) int64 has a row for each vector of the record, which is as for `select_each`, in
    their order. N entries of 8 bytes, `WIDTH` of them behind the last that is used: a whole vector
    is written.
    """
    _check_memory("push", memory, record)

    def generate(context, builder, sig, args):
        for row, vector, value in _rows(builder, record, args[2]):
            address, whole = _row_address(context, builder, sig, args, row, vector)
            if vector.kind == "mask":
                value = builder.zext(value, whole)
            value = _compress(builder, value, args[3])
            builder.store(value, address, align=bytes_of(whole.element))
        return context.get_dummy_value()

    return types.none(memory, at, record, m), generate


@intrinsic
def pull(typingctx, memory, at, record, m):
    """Return a record with the lanes of m taken from the entries from `at` on; see `push`."""
    _check_memory("pull", memory, record)

    def taken(context, builder, sig, args, part, value, row):
        made = value
        for k, inner in enumerate(part):
            old = builder.extract_value(value, k)
            if isinstance(inner, types.BaseTuple):
                new, row = taken(context, builder, sig, args, inner, old, row)
            else:
                address, whole = _row_address(context, builder, sig, args, row, inner)
                read = builder.load(address, align=bytes_of(whole.element))
                if inner.kind == "mask":
                    spread = _expand(builder, read, args[3], ir.Constant(whole, None))
                    spread = builder.icmp_unsigned("!=", spread, ir.Constant(whole, None))
                    new = builder.select(args[3], spread, old)
                else:
                    new = _expand(builder, read, args[3], old)
                row += 1
            made = builder.insert_value(made, new, k)
        return made, row

    def generate(context, builder, sig, args):
        made, _ = taken(context, builder, sig, args, record, args[2], 0)
        return made

    return record(memory, at, record, m), generate


@intrinsic
def rows_of(typingctx, record):
    """Return the number of vectors of a record: the rows of memory that `push` needs."""
    rows = len(list(_vectors_of(record)))

    def generate(context, builder, sig, args):
        return ir.Constant(ir.IntType(64), rows)

    return types.int64(record), generate
