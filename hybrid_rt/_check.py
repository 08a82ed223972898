"""The one place that validates arguments; every failure names argument, expected and got."""

from __future__ import annotations

import math
import numbers
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybrid_rt.errors import ArgumentError


def describe(value: Any) -> str:
    """Return a short description of a value for an error message."""
    if isinstance(value, np.ndarray):
        return f"an array of shape {value.shape} and dtype {value.dtype}"
    try:
        shown = repr(value)
    except Exception:  # whatever somebody's own class does
        shown = "an object"
    if len(shown) > 80:
        shown = shown[:77] + "..."
    return f"{shown} ({type(value).__name__})"


def _shape_text(shape: tuple[int | str, ...]) -> str:
    return "(" + ", ".join(str(n) for n in shape) + ("," if len(shape) == 1 else "") + ")"


def array(
    argument: str, value: Any, shape: tuple[int | str, ...], dtype: type[np.generic]
) -> NDArray[Any]:
    """Return `value` as a C-contiguous array of `dtype`, converted where no meaning is lost.

    Parameters
    ----------
    argument : str
        Name for the error message.
    value : array_like
        What the caller passed.
    shape : tuple of int or str
        Expected shape; a string stands for any length ("N"), the same string for the same length.
    dtype : type
        Wanted dtype. Floating targets take real numbers (float64 is rounded), integer targets take
        any integer input that fits, bool takes bool.

    Raises
    ------
    ArgumentError
        Wrong kind, wrong shape, or an integer that does not fit.
    """
    want = np.dtype(dtype)
    expected = f"an array of shape {_shape_text(shape)} and dtype {want}"
    try:
        arr = np.asarray(value)
    except Exception as error:  # of lists that are ragged, of somebody's own __array__
        raise ArgumentError(argument, expected, describe(value)) from error
    kinds = {"f": "fiu", "i": "iu", "u": "iu", "b": "b"}[want.kind]
    if arr.dtype.kind not in kinds:
        raise ArgumentError(argument, expected, describe(arr))
    lengths: dict[str, int] = {}
    fits = arr.ndim == len(shape) and all(
        n == lengths.setdefault(m, n) if isinstance(m, str) else n == m
        for n, m in zip(arr.shape, shape, strict=True)
    )
    if not fits:
        raise ArgumentError(argument, expected, describe(arr))
    if want.kind in "iu" and arr.dtype != want and arr.size:
        info = np.iinfo(want)
        low, high = int(arr.min()), int(arr.max())
        if low < info.min or high > info.max:
            raise ArgumentError(argument, f"integers that fit {want}", f"values {low} to {high}")
    try:
        with np.errstate(over="ignore", invalid="ignore"):
            return np.ascontiguousarray(arr, dtype=want)
    except MemoryError as error:
        raise ArgumentError(argument, f"{expected} that memory can hold", describe(arr)) from error


def reals(argument: str, value: Any) -> NDArray[np.float64]:
    """Return `value`, real numbers in an array of any shape or alone, as float64."""
    try:
        shape = np.shape(value)
    except Exception as error:  # of lists that are ragged, of somebody's own __array__
        raise ArgumentError(argument, "an array of numbers", describe(value)) from error
    return array(argument, value, shape, np.float64).reshape(shape)


def owned(
    argument: str, value: Any, shape: tuple[int | str, ...], dtype: type[np.generic]
) -> NDArray[Any]:
    """Return what `array` does, in memory that the caller has no hold of."""
    arr = array(argument, value, shape, dtype)
    if isinstance(value, np.ndarray) and np.may_share_memory(arr, value):
        try:
            return arr.copy()
        except MemoryError as error:
            expected = "an array that memory can hold"
            raise ArgumentError(argument, expected, describe(arr)) from error
    return arr


def writable(argument: str, value: Any, shape: tuple[int, ...], dtype: type[np.generic]) -> None:
    """Raise unless `value` is an array that a kernel can fill in place: C-contiguous, writable."""
    fits = (
        isinstance(value, np.ndarray)
        and value.shape == shape
        and value.dtype == dtype
        and value.flags.c_contiguous
        and value.flags.writeable
    )
    if not fits:
        expected = f"a writable, C-contiguous array of shape {_shape_text(shape)}"
        got = describe(value)
        if isinstance(value, np.ndarray):
            if not value.flags.writeable:
                got += ", read-only"
            if not value.flags.c_contiguous:
                got += ", strided"
        raise ArgumentError(argument, f"{expected} and dtype {np.dtype(dtype)}", got)


def same_length(argument: str, value: NDArray[Any], other: str, length: int) -> None:
    """Raise unless `value` has `length` rows, the length of the argument named `other`."""
    if len(value) != length:
        raise ArgumentError(argument, f"{length} rows, as many as {other}", f"{len(value)} rows")


def in_range(argument: str, value: NDArray[Any], low: int, high: int, what: str) -> None:
    """Raise, naming the first bad place and how many there are, unless low <= value <= high.

    `what` says in words where the range comes from.
    """
    if value.size == 0 or (int(value.min()) >= low and int(value.max()) <= high):
        return
    bad = np.argwhere((value < low) | (value > high))
    first = tuple(int(k) for k in bad[0])
    where = str(first[0]) if len(first) == 1 else str(first)
    raise ArgumentError(
        argument,
        f"values from {low} to {high} ({what})",
        f"{len(bad)} out of range, the first, at {where}, is {value[first]}",
    )


def finite_rows(argument: str, value: NDArray[Any], what: str) -> None:
    """Raise, naming the first bad row and how many there are, unless all of `value` is finite."""
    flat = value.reshape(len(value), -1)
    bad = ~np.isfinite(flat).all(axis=1)
    if bad.any():
        first = int(np.argmax(bad))
        row = ", ".join(f"{x:g}" for x in flat[first])
        raise ArgumentError(
            argument,
            f"finite {what}",
            f"{int(bad.sum())} not finite, the first at index {first}: ({row})",
        )


def vector3(argument: str, value: Any) -> tuple[float, float, float]:
    """Return `value` as three finite floats."""
    expected = "three finite numbers"
    try:
        arr = np.asarray(value)
        with np.errstate(over="ignore"):
            arr = arr.astype(np.float64) if arr.dtype.kind in "fiu" else np.empty(0)
    except Exception as error:  # of lists that are ragged, of somebody's own __array__
        raise ArgumentError(argument, expected, describe(value)) from error
    if arr.shape != (3,) or not np.isfinite(arr).all():
        raise ArgumentError(argument, expected, describe(value))
    return float(arr[0]), float(arr[1]), float(arr[2])


def point3(argument: str, value: Any) -> tuple[float, float, float]:
    """Return `value` as three floats within float32, as vertices have them."""
    point = vector3(argument, value)
    if max(map(abs, point)) > float(np.finfo(np.float32).max):
        expected = "coordinates within float32, as vertices have them"
        raise ArgumentError(argument, expected, describe(value))
    return point


def real(
    argument: str,
    value: Any,
    *,
    above: float = -math.inf,
    below: float = math.inf,
) -> float:
    """Return `value` as a finite float strictly between `above` and `below`."""
    expected = "a finite number"
    if above > -math.inf:
        expected += f" > {above:g}"
    if below < math.inf:
        expected += f" and < {below:g}" if above > -math.inf else f" < {below:g}"
    x = _float(argument, value, expected)
    if not (math.isfinite(x) and above < x < below):
        raise ArgumentError(argument, expected, describe(value))
    return x


def float32_length(argument: str, value: Any) -> float:
    """Return `value` as a float > 0 that float32 can hold without losing digits."""
    x = real(argument, value, above=0.0)
    limits = np.finfo(np.float32)
    if not float(limits.tiny) <= x <= float(limits.max):
        raise ArgumentError(argument, "a length within float32", describe(value))
    return x


def _float(argument: str, value: Any, expected: str) -> float:
    if isinstance(value, bool) or not isinstance(value, numbers.Real):
        raise ArgumentError(argument, expected, describe(value))
    try:
        return float(value)
    except OverflowError as error:
        raise ArgumentError(argument, expected, describe(value)) from error


def fraction(argument: str, value: Any) -> float:
    """Return `value` as a float from 0 to 1, both included."""
    expected = "a number from 0 to 1"
    x = _float(argument, value, expected)
    if not 0.0 <= x <= 1.0:
        raise ArgumentError(argument, expected, describe(value))
    return x


def boolean(argument: str, value: Any) -> bool:
    """Return `value` if it is True or False."""
    if not isinstance(value, bool | np.bool_):
        raise ArgumentError(argument, "True or False", describe(value))
    return bool(value)


def text(argument: str, value: Any) -> str:
    """Return `value` if it is a str."""
    if not isinstance(value, str):
        raise ArgumentError(argument, "a str", describe(value))
    return value


def integer(argument: str, value: Any, *, least: int, most: int | None = None) -> int:
    """Return `value` as an int of at least `least` and at most `most`."""
    expected = f"an integer >= {least}" + (f" and <= {most}" if most is not None else "")
    if isinstance(value, bool) or not isinstance(value, numbers.Integral):
        raise ArgumentError(argument, expected, describe(value))
    n = int(value)
    if n < least or (most is not None and n > most):
        raise ArgumentError(argument, expected, describe(value))
    return n


def choice(argument: str, value: Any, choices: tuple[Any, ...]) -> Any:
    """Return `value` if it is one of `choices`, and of their type."""
    if not any(type(value) is type(c) and value == c for c in choices):
        listed = ", ".join(repr(c) for c in choices)
        raise ArgumentError(argument, f"one of {listed}", describe(value))
    return value


def instance(argument: str, value: Any, cls: type) -> None:
    """Raise unless `value` is an instance of `cls`."""
    if not isinstance(value, cls):
        raise ArgumentError(argument, f"a {cls.__name__}", describe(value))
