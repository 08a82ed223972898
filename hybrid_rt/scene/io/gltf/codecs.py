"""Compressed glTF geometry, decoded by libraries that are extras of this project.

DracoPy wraps Google's decoder, is kept and ships binaries: ``pip install "hybrid-rt[draco]"``.
meshoptimizer wraps its author's C++ and is young; pip builds it: ``pip install
"hybrid-rt[meshopt]"``. Who has no such files needs neither.
"""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybrid_rt.scene.io.gltf.tree import At

# The second is the first under its later name.
MESHOPT = ("EXT_meshopt_compression", "KHR_meshopt_compression")
_EXTRAS = {"DracoPy": "draco", "meshoptimizer": "meshopt"}
_DRACO_HEAD = 11  # "DRACO", version, kind, method, flags: bytes


def _library(name: str, place: At, extension: str) -> Any:
    try:
        return importlib.import_module(name)
    except ImportError as error:
        hint = f'pip install "hybrid-rt[{_EXTRAS[name]}]"'
        raise place.fault(f"{extension} needs {name}: {hint}") from error


class Draco:
    """Triangles and attributes of one primitive under KHR_draco_mesh_compression."""

    def __init__(self, place: At, data: bytes) -> None:
        library = _library("DracoPy", place, "KHR_draco_mesh_compression")
        self._place = place
        if len(data) < _DRACO_HEAD or data[:5] != b"DRACO":
            raise place.fault("not Draco data")
        try:
            self._mesh = library.decode(data)
            faces = np.asarray(getattr(self._mesh, "faces", np.empty((0, 3))))
            self.faces = faces.astype(np.int64).reshape(-1, 3)
        except Exception as error:  # whatever the decoder says of broken data
            raise place.fault(f"corrupt Draco data ({error})") from error

    def attribute(self, name: str) -> NDArray[Any] | None:
        """Return an attribute (count, width) as it is stored, or None where there is none."""
        number = self._place.need("attributes").get(name)
        if number is None:
            return None
        unique = number.integer()
        for attribute in self._mesh.attributes:
            if attribute["unique_id"] == unique:
                values = np.asarray(attribute["data"])
                return values.reshape(len(values), -1)
        raise number.fault(f"the Draco data has no attribute {unique}")


def meshopt(place: At, data: bytes) -> NDArray[np.uint8]:
    """Return the bytes of a buffer view under EXT_meshopt_compression."""
    library = _library("meshoptimizer", place, "EXT_meshopt_compression")
    count, stride = place.need("count").integer(1), place.need("byteStride").integer(1)
    mode = place.need("mode").text()
    named = place.get("filter")
    chosen = "NONE" if named is None else named.text()
    if mode == "ATTRIBUTES" and (stride % 4 or stride > 256):
        raise place.fault(f"byteStride {stride}: expected a multiple of 4, up to 256")
    if mode in ("TRIANGLES", "INDICES") and (
        stride not in (2, 4) or chosen != "NONE" or (mode == "TRIANGLES" and count % 3)
    ):
        raise place.fault(f"{mode} of {count} x {stride} bytes and filter {chosen}")
    try:
        if mode == "ATTRIBUTES":
            row = np.dtype((np.uint8, (stride,)))
            out = library.decode_vertex_buffer(count, stride, data, dtype=row)
        elif mode == "TRIANGLES":
            out = library.decode_index_buffer(count, 4, data)
        elif mode == "INDICES":
            out = library.decode_index_sequence(count, 4, data)
        else:
            raise place.fault(f"mode {mode} cannot be read")
        if chosen == "EXPONENTIAL":
            out = library.decode_filter_exp(np.ascontiguousarray(out), count, stride)
        elif chosen != "NONE":
            raise place.fault(f"filter {chosen} cannot be read for geometry")
    except (ValueError, RuntimeError) as error:
        raise place.fault(f"corrupt data ({error})") from error
    if mode != "ATTRIBUTES":
        out = np.asarray(out).reshape(-1).astype(f"<u{stride}")
    return np.ascontiguousarray(out).reshape(-1).view(np.uint8)
