"""Arrays that Numba does not count references of."""

from __future__ import annotations

from numba import types
from numba.core import cgutils, errors
from numba.extending import intrinsic


@intrinsic
def borrowed(typingctx, array):
    """Return an array as it is, but without the count of its references.

    Numba counts up and down, atomically, around calls of inlined functions that have a loop; a
    borrowed array costs nothing to pass. What it was made of must be kept alive by other means: an
    argument of the kernel is, and so is what `keep` is given after the last use.
    """
    if not isinstance(array, types.Array):
        raise errors.TypingError(f"borrowed: array must be an array, got {array}")

    def generate(context, builder, signature, arguments):
        return _uncounted(context, builder, array, arguments[0])

    return array(array), generate


@intrinsic
def borrowed_record(typingctx, record):
    """Return a tuple as it is, but its arrays as `borrowed` returns them."""
    if not isinstance(record, types.BaseTuple):
        raise errors.TypingError(f"borrowed_record: record must be a tuple, got {record}")

    def generate(context, builder, signature, arguments):
        made = arguments[0]
        for index, kind in enumerate(record):
            if isinstance(kind, types.Array):
                array = builder.extract_value(made, index)
                array = _uncounted(context, builder, kind, array)
                made = builder.insert_value(made, array, index)
        return made

    return record(record), generate


def _uncounted(context, builder, kind, array):
    """Return a value of an array type without what its references are counted by."""
    make = context.make_array(kind)
    old, new = make(context, builder, array), make(context, builder)
    for name in ("nitems", "itemsize", "data", "shape", "strides"):
        setattr(new, name, getattr(old, name))
    for name in ("meminfo", "parent"):
        setattr(new, name, cgutils.get_null_value(getattr(old, name).type))
    return new._getvalue()


@intrinsic
def keep(typingctx, array):
    """Use an array, so that it is alive up to here."""

    def generate(context, builder, signature, arguments):
        return context.get_dummy_value()

    return types.none(array), generate
