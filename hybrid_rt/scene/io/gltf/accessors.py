"""Arrays of a glTF file: buffers, buffer views and accessors, sparse and compressed ones too."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybrid_rt.scene.io.fault import Budget
from hybrid_rt.scene.io.gltf import codecs
from hybrid_rt.scene.io.gltf.container import read_buffer
from hybrid_rt.scene.io.gltf.tree import At
from hybrid_rt.scene.io.words import F64, I64

COMPONENTS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
_INDEX_TYPES = (5121, 5123, 5125)


class Arrays:
    """The arrays of one file, each decoded once.

    Parameters
    ----------
    path : Path
        The file; buffers are looked for in its folder.
    tree : At
    binary : bytes or None
        The binary chunk of a .glb.
    budget : Budget
    """

    def __init__(self, path: Path, tree: At, binary: bytes | None, budget: Budget) -> None:
        self._path = path
        self._binary = binary
        self._budget = budget
        self.accessors = tree.all("accessors")
        self.views = tree.all("bufferViews")
        self.buffers = tree.all("buffers")
        self._bytes: dict[int, bytes] = {}
        self._decoded: dict[int, NDArray[np.uint8]] = {}
        self._kept: dict[int, NDArray[Any]] = {}

    def buffer(self, k: int) -> bytes:
        """Return the bytes of a buffer."""
        if k not in self._bytes:
            self._bytes[k] = read_buffer(self._path, self.buffers[k], self._binary, self._budget)
        return self._bytes[k]

    def part(self, place: At) -> bytes:
        """Return what an object with buffer, byteOffset and byteLength points at."""
        data = self.buffer(place.need("buffer").index(self.buffers))
        offset = place.get("byteOffset")
        begin = 0 if offset is None else offset.integer()
        end = begin + place.need("byteLength").integer(1)
        if end > len(data):
            raise place.fault(f"it ends at byte {end} of a buffer of {len(data)} bytes")
        return data[begin:end]

    def view(self, k: int) -> NDArray[np.uint8]:
        """Return the bytes of a buffer view, decompressed."""
        if k not in self._decoded:
            view = self.views[k]
            packed = next(filter(None, map(view.extension, codecs.MESHOPT)), None)
            if packed is None or self._has_fallback(view):
                self._decoded[k] = np.frombuffer(self.part(view), np.uint8)
            else:
                count, stride = (packed.need(n).integer(1) for n in ("count", "byteStride"))
                self._budget.spend(count * stride, packed.place)
                self._decoded[k] = codecs.meshopt(packed, self.part(packed))
        return self._decoded[k]

    def _has_fallback(self, view: At) -> bool:
        """Return whether a compressed buffer view has plain bytes too, for other readers."""
        buffer = self.buffers[view.need("buffer").index(self.buffers)]
        return buffer.get("uri") is not None

    def floats(self, place: At, kind: str) -> F64:
        """Return an accessor (count, width) as float64, normalised where it says so."""
        k = place.index(self.accessors)
        values = self._values(k, place, kind)
        accessor = self.accessors[k]
        flag = accessor.get("normalized")
        if flag is None or not flag.flag():
            return values.astype(np.float64)
        return normalised(values, accessor)

    def integers(self, place: At, kind: str) -> I64:
        """Return an accessor of unsigned integers, (count, width)."""
        k = place.index(self.accessors)
        _check_unsigned(self.accessors[k].need("componentType"))
        return self._values(k, place, kind).astype(np.int64)

    def count(self, place: At) -> int:
        """Return how many elements an accessor has."""
        return self.accessors[place.index(self.accessors)].need("count").integer(1)

    def _values(self, k: int, place: At, wanted: str) -> NDArray[Any]:
        accessor = self.accessors[k]
        kind = accessor.need("type").text()
        if kind != wanted:
            raise place.fault(f"expected an accessor of type {wanted}, got {kind}")
        if k not in self._kept:
            self._kept[k] = self._read(accessor, WIDTHS[kind])
        return self._kept[k]

    def _read(self, accessor: At, width: int) -> NDArray[Any]:
        dtype = component(accessor.need("componentType"))
        count = accessor.need("count").integer(1)
        self._budget.spend(count * width * dtype.itemsize, accessor.place)
        if accessor.get("bufferView") is None:
            values = np.zeros((count, width), dtype)
        else:
            values = self._dense(accessor, accessor, dtype, count, width)
        sparse = accessor.get("sparse")
        if sparse is None:
            return values
        n = sparse.need("count").integer(1)
        indices = sparse.need("indices")
        kind = indices.need("componentType")
        _check_unsigned(kind)
        where = self._dense(indices, indices, component(kind), n, 1)[:, 0].astype(np.int64)
        if (where >= count).any() or (np.diff(where) <= 0).any():
            raise indices.fault(f"expected ascending indices below {count}")
        values = values.copy()
        entries = sparse.need("values")
        values[where] = self._dense(entries, entries, dtype, n, width)
        return values

    def _dense(
        self, place: At, owner: At, dtype: np.dtype[Any], count: int, width: int
    ) -> NDArray[Any]:
        k = place.need("bufferView").index(self.views)
        data = self.view(k)
        offset, step = place.get("byteOffset"), self.views[k].get("byteStride")
        begin = 0 if offset is None else offset.integer()
        size = width * dtype.itemsize
        stride = size if step is None else step.integer(1)
        if stride < size:
            raise self.views[k].fault(f"byteStride {stride} is less than an element, {size}")
        end = begin + stride * (count - 1) + size
        if end > len(data):
            raise owner.fault(f"it ends at byte {end} of a buffer view of {len(data)} bytes")
        rows = np.lib.stride_tricks.as_strided(
            data[begin:], (count, size), (stride, 1), writeable=False
        )
        return np.ascontiguousarray(rows).view(dtype)


def _check_unsigned(place: At) -> None:
    if not isinstance(place.value, int) or place.value not in _INDEX_TYPES:
        raise place.fault(f"expected unsigned integers, got {place.value!r}")


def component(place: At) -> np.dtype[Any]:
    """Return the NumPy type of a componentType."""
    if not isinstance(place.value, int) or place.value not in COMPONENTS:
        raise place.fault(f"{place.value!r} is no component type of glTF 2.0")
    return np.dtype(COMPONENTS[place.value])


def normalised(values: NDArray[Any], place: At) -> F64:
    """Return normalised integers as what they stand for, -1 to 1 or 0 to 1."""
    if values.dtype.kind not in "iu" or values.dtype.itemsize > 2:
        raise place.fault(f"normalised values of {values.dtype} make no sense")
    scaled = values.astype(np.float64) / np.iinfo(values.dtype).max
    return np.maximum(scaled, -1.0)
