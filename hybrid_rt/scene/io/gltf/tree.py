"""The JSON of a glTF file, read with the place of every value at hand."""

from __future__ import annotations

import json
import math
from typing import Any

from hybrid_rt.scene.io.fault import FormatError


class At:
    """A JSON value and its place, such as ``nodes[3].mesh``.

    Every method raises a FormatError that names the place when the value is not what it should be.
    """

    def __init__(self, value: Any, place: str = "") -> None:
        self.value = value
        self.place = place

    def fault(self, what: str) -> FormatError:
        """Return what is wrong here, to be raised."""
        return FormatError(f"{self.place or 'glTF'}: {what}")

    def get(self, key: str) -> At | None:
        """Return a member of an object, or None where it has none."""
        if not isinstance(self.value, dict):
            raise self.fault(f"expected an object, got {_shown(self.value)}")
        if key not in self.value:
            return None
        return At(self.value[key], f"{self.place}.{key}" if self.place else key)

    def need(self, key: str) -> At:
        """Return a member that must be there."""
        found = self.get(key)
        if found is None:
            raise self.fault(f"no {key}")
        return found

    def items(self) -> list[At]:
        """Return the items of an array."""
        if not isinstance(self.value, list):
            raise self.fault(f"expected an array, got {_shown(self.value)}")
        return [At(item, f"{self.place}[{k}]") for k, item in enumerate(self.value)]

    def all(self, key: str) -> list[At]:
        """Return the items of a member, none where it is absent."""
        found = self.get(key)
        return [] if found is None else found.items()

    def keys(self) -> list[str]:
        """Return the names of the members of an object."""
        if not isinstance(self.value, dict):
            raise self.fault(f"expected an object, got {_shown(self.value)}")
        return list(self.value)

    def text(self) -> str:
        """Return the value, a string."""
        if not isinstance(self.value, str):
            raise self.fault(f"expected a string, got {_shown(self.value)}")
        return self.value

    def integer(self, least: int = 0) -> int:
        """Return the value, an integer of at least `least` (2.0 is one)."""
        value = self.value
        if isinstance(value, float) and value.is_integer():
            value = int(value)
        if isinstance(value, bool) or not isinstance(value, int) or not least <= value < 2**53:
            raise self.fault(f"expected an integer >= {least}, got {_shown(self.value)}")
        return value

    def number(self) -> float:
        """Return the value, a finite number."""
        if not isinstance(self.value, bool) and isinstance(self.value, int | float):
            try:
                value = float(self.value)
            except OverflowError:
                value = math.inf
            if math.isfinite(value):
                return value
        raise self.fault(f"expected a finite number, got {_shown(self.value)}")

    def numbers(self, count: int | None = None) -> list[float]:
        """Return the value, `count` finite numbers."""
        found = [item.number() for item in self.items()]
        if count is not None and len(found) != count:
            raise self.fault(f"expected {count} numbers, got {len(found)}")
        return found

    def flag(self) -> bool:
        """Return the value, true or false."""
        if not isinstance(self.value, bool):
            raise self.fault(f"expected true or false, got {_shown(self.value)}")
        return self.value

    def index(self, among: list[At]) -> int:
        """Return the value, an index into one of the file's arrays."""
        k = self.integer()
        if k >= len(among):
            raise self.fault(f"there is no number {k}, only {len(among)}")
        return k

    def extension(self, name: str) -> At | None:
        """Return one extension of this object."""
        extensions = self.get("extensions")
        return None if extensions is None else extensions.get(name)


def _shown(value: Any) -> str:
    text = json.dumps(value)
    return text if len(text) <= 40 else text[:37] + "..."


def parse(data: bytes) -> At:
    """Return the tree of a glTF file; a byte order mark of UTF-8 is passed over."""
    try:
        value = json.loads(data.decode("utf-8-sig"))
    except (ValueError, RecursionError) as error:
        raise FormatError(f"truncated or corrupt JSON ({error})") from error
    if not isinstance(value, dict):
        raise FormatError(f"expected a JSON object, got {_shown(value)}")
    return At(value)
