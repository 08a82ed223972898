"""Records whose arrays are checked where they are made and read-only from then on."""

from __future__ import annotations

import dataclasses
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray


def read_only(array: NDArray[Any]) -> NDArray[Any]:
    """Return a view of an array through which it cannot be written."""
    view = array.view()
    view.flags.writeable = False
    return view


class Record:
    """Base of frozen dataclasses that own arrays.

    The attributes are read-only views. `arrays` holds what they are views of, as kernels take it:
    Numba would compile every kernel once more for read-only arrays.
    """

    _arrays: Any

    def _own(self, arrays: NamedTuple) -> None:
        """Take over checked arrays that nobody else holds; their names are those of attributes."""
        object.__setattr__(self, "_arrays", arrays)
        for name, array in arrays._asdict().items():
            object.__setattr__(self, name, read_only(array))

    @classmethod
    def _made(cls, arrays: NamedTuple, **others: Any) -> Self:
        """Return a record of what the library itself made; nothing is checked and nothing copied.

        `others` are all attributes that are no arrays.
        """
        record = object.__new__(cls)
        record._own(arrays)
        for name, value in others.items():
            object.__setattr__(record, name, value)
        return record

    def __reduce__(self) -> tuple[Any, ...]:
        fields = dataclasses.fields(self)  # type: ignore[arg-type]
        return type(self), tuple(getattr(self, field.name) for field in fields if field.init)


def writable(array: NDArray[Any]) -> NDArray[Any]:
    """Return an array in C order that a kernel takes: itself, or a copy if it cannot be written."""
    return np.require(array, requirements=["C", "W"])
