"""The meshes of a glTF file: primitives as triangles, morphed by their weights."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybrid_rt.scene.io.gltf.accessors import Arrays, component, normalised
from hybrid_rt.scene.io.gltf.codecs import Draco
from hybrid_rt.scene.io.gltf.tree import At
from hybrid_rt.scene.io.parts import fan, strip
from hybrid_rt.scene.io.words import F64, I64

_WITHOUT_SURFACE = ("points", "lines", "lines", "lines")
_TRIANGLES, _STRIP, _FAN = 4, 5, 6


@dataclasses.dataclass
class Shape:
    """A mesh in its own space.

    Attributes
    ----------
    vertices : (V, 3) float64
    faces : (F, 3) int64
    counts : list of int
        Triangles of each primitive.
    joints, weights : (V, 4 k) int64 and float64, or None
        What moves each vertex, where all primitives say so.
    skipped : set of str
        Primitives that are no triangles.
    """

    vertices: F64
    faces: I64
    counts: list[int]
    joints: I64 | None
    weights: F64 | None
    skipped: set[str]


class _Group:
    """Primitives that share their vertices."""

    def __init__(self, attributes: tuple[NDArray[Any], ...]) -> None:
        self.attributes = attributes
        self.faces: list[I64] = []

    def compact(self) -> tuple[tuple[NDArray[Any], ...], list[I64]]:
        """Return attributes and faces, with the used vertices alone if few of many are used.

        Exporters let the meshes of a file share one long array; every mesh would copy all of it.
        """
        corners = np.concatenate([f.ravel() for f in self.faces])
        if len(corners) >= len(self.attributes[0]):
            return self.attributes, self.faces
        used, again = np.unique(corners, return_inverse=True)
        cuts = np.cumsum([f.size for f in self.faces])[:-1]
        faces = [f.reshape(-1, 3) for f in np.split(again.ravel(), cuts)]
        return tuple(a[used] for a in self.attributes), faces


def read_mesh(arrays: Arrays, mesh: At, weights: At | None, skinned: bool) -> Shape:
    """Return a mesh, morphed by `weights`, a node's, or else by its own."""
    groups: dict[Any, _Group] = {}
    order: list[tuple[Any, int]] = []
    skipped = set()
    chosen = mesh.get("weights") if weights is None else weights
    for primitive in mesh.all("primitives"):
        given = primitive.get("mode")
        mode = _TRIANGLES if given is None else given.integer()
        if mode < _TRIANGLES:
            skipped.add(_WITHOUT_SURFACE[mode])
            continue
        if given is not None and mode > _FAN:
            raise given.fault(f"there is no mode {mode}")
        key, attributes, faces = _primitive(arrays, primitive, mode, chosen, skinned, groups)
        group = groups.setdefault(key, _Group(attributes))
        order.append((key, len(group.faces)))
        group.faces.append(faces)
    return _joined(groups, order, skinned, skipped)


def _joined(
    groups: dict[Any, _Group], order: list[tuple[Any, int]], skinned: bool, skipped: set[str]
) -> Shape:
    compact, start, columns = {}, 0, []
    for key, group in groups.items():
        attributes, faces = group.compact()
        compact[key] = [f + start for f in faces]
        columns.append(attributes)
        start += len(attributes[0])
    ordered = [compact[key][k] for key, k in order]
    if not ordered:
        return Shape(np.empty((0, 3)), np.empty((0, 3), np.int64), [], None, None, skipped)
    joints = weights = None
    if skinned:
        width = max(a[1].shape[1] for a in columns)
        joints, weights = (
            np.concatenate([np.pad(a[k], ((0, 0), (0, width - a[k].shape[1]))) for a in columns])
            for k in (1, 2)
        )
    vertices = np.concatenate([a[0] for a in columns])
    counts = [len(f) for f in ordered]
    return Shape(vertices, np.concatenate(ordered), counts, joints, weights, skipped)


def _primitive(
    arrays: Arrays, primitive: At, mode: int, chosen: At | None, skinned: bool, groups: Any
) -> tuple[Any, tuple[NDArray[Any], ...], I64]:
    """Return what is shared by primitives of the same vertices, those vertices, and triangles."""
    attributes = primitive.need("attributes")
    place = attributes.need("POSITION")
    draco = _draco(arrays, primitive, place, mode)
    names = [n for n in sorted(attributes.keys()) if n.startswith(("JOINTS_", "WEIGHTS_"))]
    targets = [target.get("POSITION") for target in primitive.all("targets")]
    key = (
        primitive.place if draco else None,
        place.index(arrays.accessors),
        *(attributes.need(name).index(arrays.accessors) for name in names if skinned),
        *(-1 if t is None else t.index(arrays.accessors) for t in targets),
    )
    if key in groups:
        columns = groups[key].attributes
    else:
        columns = (_morphed(arrays, place, draco, targets, primitive, chosen),)
        if skinned:
            columns += _influences(arrays, attributes, draco, len(columns[0]))
    n = len(columns[0])
    if draco:
        return key, columns, _in_range(draco.faces, n, primitive)
    place_of_indices = primitive.get("indices")
    if place_of_indices is None:
        corners = np.arange(n)
    else:
        corners = _in_range(arrays.integers(place_of_indices, "SCALAR"), n, place_of_indices)[:, 0]
    if mode == _TRIANGLES and len(corners) % 3:
        raise primitive.fault(f"triangles of {len(corners)} corners, no multiple of 3")
    if mode == _TRIANGLES:
        return key, columns, corners.reshape(-1, 3)
    return key, columns, strip(corners) if mode == _STRIP else fan(corners)


def _in_range(indices: I64, n: int, place: At) -> I64:
    high = int(indices.max(initial=-1))
    if high >= n or int(indices.min(initial=0)) < 0:
        raise place.fault(f"takes vertex {high} of {n}")
    return indices


def _draco(arrays: Arrays, primitive: At, place: At, mode: int) -> Draco | None:
    """Return Draco's geometry where the primitive has no other."""
    packed = primitive.extension("KHR_draco_mesh_compression")
    if packed is None:
        return None
    plain = arrays.accessors[place.index(arrays.accessors)]
    if plain.get("bufferView") is not None:
        return None  # what readers without the extension are to use
    if mode != _TRIANGLES:
        raise packed.fault("Draco with another mode than triangles cannot be read")
    view = packed.need("bufferView").index(arrays.views)
    return Draco(packed, arrays.view(view).tobytes())


def _attribute(arrays: Arrays, place: At, draco: Draco | None, name: str, kind: str) -> F64:
    values = None if draco is None else draco.attribute(name)
    if values is None:
        return arrays.floats(place, kind)
    accessor = arrays.accessors[place.index(arrays.accessors)]
    whole = component(accessor.need("componentType"))
    if whole.kind in "iu" and values.dtype != whole:  # DracoPy hands out positions as floats
        kept = values
        with np.errstate(invalid="ignore"):
            values = kept.astype(whole)
        if (values != kept).any():
            raise accessor.fault(f"the Draco data does not fit {whole}")
    flag = accessor.get("normalized")
    if flag is not None and flag.flag():
        return normalised(values, accessor)
    return values.astype(np.float64)


def _morphed(
    arrays: Arrays,
    place: At,
    draco: Draco | None,
    targets: list[At | None],
    primitive: At,
    chosen: At | None,
) -> F64:
    positions = _attribute(arrays, place, draco, "POSITION", "VEC3")
    if positions.shape[1] != 3:
        raise place.fault("positions that are no VEC3")
    amounts = [] if chosen is None else chosen.numbers()
    if amounts and len(amounts) != len(targets):
        raise primitive.fault(f"{len(targets)} targets, and {len(amounts)} weights")
    for amount, target in zip(amounts, targets, strict=False):
        if target is None or amount == 0:
            continue
        moved = arrays.floats(target, "VEC3")
        if len(moved) != len(positions):
            raise target.fault(f"{len(moved)} displacements of {len(positions)} positions")
        positions = positions + amount * moved
    if not np.isfinite(positions).all():
        row = int(np.argmin(np.isfinite(positions).all(axis=1)))
        raise place.fault(f"position {row} is not finite")
    return positions


def _influences(arrays: Arrays, attributes: At, draco: Draco | None, n: int) -> tuple[I64, F64]:
    """Return which joints move each vertex, and how much."""
    joints: list[F64] = []
    weights: list[F64] = []
    while attributes.get(f"JOINTS_{len(joints)}") is not None:
        k = len(joints)
        for into, name in ((joints, f"JOINTS_{k}"), (weights, f"WEIGHTS_{k}")):
            place = attributes.need(name)
            values = _attribute(arrays, place, draco, name, "VEC4")
            if values.shape != (n, 4):
                raise place.fault(f"{len(values)} of them for {n} positions")
            if name.startswith("J") and not (values == np.floor(values)).all():
                raise place.fault("joints that are no whole numbers")
            into.append(values)
    if not joints:
        raise attributes.fault("no JOINTS_0 in a mesh that has a skin")
    return np.concatenate(joints, axis=1).astype(np.int64), np.concatenate(weights, axis=1)
