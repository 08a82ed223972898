"""What nobody should pass, for every kind of argument."""

import functools
from typing import Any

import numpy as np

import hybrid_rt as hrt
from support.fuzz import examples


class Liar:
    """Says that it is an array, and is not."""

    def __array__(self, *args: Any, **kwargs: Any) -> Any:
        raise RuntimeError("no array after all")

    def __len__(self) -> int:
        return -1

    def __repr__(self) -> str:
        raise RuntimeError("no name either")


def _endless() -> list[Any]:
    held: list[Any] = []
    held.append(held)
    return held


def _deep() -> list[Any]:
    held: list[Any] = []
    for _ in range(5000):
        held = [held]
    return held


SCALARS: dict[str, Any] = {
    "None": lambda: None,
    "nan": lambda: float("nan"),
    "inf": lambda: float("inf"),
    "-inf": lambda: float("-inf"),
    "1e300": lambda: 1e300,
    "5e-324": lambda: 5e-324,
    "-1": lambda: -1,
    "0": lambda: 0,
    "-0.5": lambda: -0.5,
    "2.5": lambda: 2.5,
    "70000": lambda: 70_000,
    "2**31": lambda: 2**31,
    "2**63": lambda: 2**63,
    "10**400": lambda: 10**400,
    "True": lambda: True,
    "1j": lambda: 1j,
    "np.nan": lambda: np.float32("nan"),
    "np.int64": lambda: np.int64(-(2**63)),
    "date": lambda: np.datetime64("2001-01-01"),
    "text": lambda: "x",
    "no text": lambda: "",
    "NUL": lambda: "\0",
    "surrogate": lambda: "\ud800",
    "long text": lambda: "x" * 100_000,
    "bytes": lambda: b"",
    "object": object,
    "class": lambda: dict,
    "function": lambda: len,
    "...": lambda: ...,
    "liar": Liar,
    "dict": lambda: {"a": 1},
    "generator": lambda: (i for i in range(3)),
}
"""Junk without a shape."""

ARRAYS: dict[str, Any] = {
    "[]": lambda: [],
    "()": lambda: (),
    "[1]": lambda: [1],
    "ragged": lambda: [[1, 2], [3]],
    "endless": _endless,
    "deep": _deep,
    "texts": lambda: ["x", "y", "z"],
    "nones": lambda: (None, None, None),
    "huge vector": lambda: (1e300, 1e300, 1e300),
    "huge integers": lambda: [10**30, 1, 2],
    "zero vector": lambda: (0.0, 0.0, 0.0),
    "nan vector": lambda: (float("nan"),) * 3,
    "no rows": lambda: np.zeros((0, 3), np.float32),
    "no dimension": lambda: np.array(1.0),
    "objects": lambda: np.array([object()] * 3, object),
    "structured": lambda: np.zeros(3, [("a", "f4")]),
    "many dimensions": lambda: np.zeros((1,) * 9),
    "broadcast": lambda: np.broadcast_to(np.float32(1), (1 << 40, 3)),
    "dates": lambda: np.zeros(3, "M8[s]"),
    "far indices": lambda: np.array([[0, 1, 10**8]], np.int32),
    "negative indices": lambda: np.array([[0, 1, -(2**31)]], np.int32),
}
"""Junk with a shape."""


def _cut(a):
    return a[:-1]


CHANGES: dict[str, Any] = {
    "strided": lambda a: np.repeat(a, 2, axis=0)[::2],
    "reversed": lambda a: a[::-1],
    "Fortran": np.asfortranarray,
    "big-endian": lambda a: a.astype(a.dtype.newbyteorder(">")),
    "read-only": lambda a: _frozen(a.copy()),
    "a row less": _cut,
    "a row more": lambda a: np.concatenate([a, a[-1:]]),
    "no rows of it": lambda a: a[:0],
    "flat": lambda a: a.reshape(-1),
    "one more dimension": lambda a: a[None],
    "transposed": lambda a: a.T,
    "as objects": lambda a: a.astype(object),
    "as text": lambda a: a.astype(str),
    "as doubles": lambda a: a.astype(np.float64),
    "as halves": lambda a: a.astype(np.float16),
    "as long integers": lambda a: np.nan_to_num(a, posinf=7, neginf=7).astype(np.int64),
    "as bytes": lambda a: np.nan_to_num(a, posinf=7, neginf=7).astype(np.uint8),
    "as truths": lambda a: a.astype(bool),
    "as complex": lambda a: a.astype(complex),
    "all 10**8": lambda a: np.full_like(a, 10**8) if a.dtype.kind in "if" else a,
    "all lowest": lambda a: np.full_like(a, _lowest(a.dtype)),
    "all highest": lambda a: np.full_like(a, _highest(a.dtype)),
    "all nan": lambda a: np.full_like(a, np.nan) if a.dtype.kind == "f" else a[:-1],
    "all inf": lambda a: np.full_like(a, np.inf) if a.dtype.kind == "f" else a[:-1],
    "all smallest": lambda a: np.full_like(a, 1e-45) if a.dtype.kind == "f" else a[:-1],
    "masked": np.ma.masked_array,
    "unaligned": lambda a: _unaligned(a),
}
"""What is done to a valid array of at least one dimension."""


def _frozen(a):
    a.flags.writeable = False
    return a


def _lowest(dtype):
    if dtype.kind == "f":
        return np.finfo(dtype).min
    return False if dtype.kind == "b" else np.iinfo(dtype).min


def _highest(dtype):
    if dtype.kind == "f":
        return np.finfo(dtype).max
    return True if dtype.kind == "b" else np.iinfo(dtype).max


def _unaligned(a):
    raw = np.zeros(a.nbytes + 1, np.uint8)
    view = raw[1:].view(a.dtype).reshape(a.shape)
    view[...] = a
    return view


@functools.cache
def public_objects() -> tuple[str, ...]:
    """Return the names of public classes of which there is an example."""
    return tuple(sorted(name for name in examples.INSTANCES if hasattr(hrt, name)))


def labels(valid: Any) -> list[str]:
    """Return the names of all junk that can stand where `valid` stood."""
    names = [*SCALARS, *ARRAYS]
    names += [f"a {name}" for name in public_objects() if name != type(valid).__name__]
    if isinstance(valid, np.ndarray) and valid.ndim and len(valid):
        names += CHANGES
    return names


def value(label: str, valid: Any) -> Any:
    """Return the junk of that name, in place of `valid`."""
    if label in SCALARS:
        return SCALARS[label]()
    if label in ARRAYS:
        return ARRAYS[label]()
    if label in CHANGES:
        return CHANGES[label](valid)
    return examples.instance(label.removeprefix("a "))
