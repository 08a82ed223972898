"""Views of a scene that nobody has placed cameras in.

A view frames what there is: at least half of its pixels show a surface. Its eye never stands inside
closed geometry, which the winding number tells: the solid angle of all triangles seen from there,
in turns of the sphere, is 0 outside and 1 or -1 inside, and somewhere between where a surface is
open.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

import hybrid_rt as hrt
from hybrid_rt_scenes.spec import CameraSpec

F64 = NDArray[np.float64]

COVERED = 0.5
"""Share of a view's pixels that show a surface, at least."""
INSIDE = 0.5
"""Winding number from which on a place counts as inside."""
TRIED = 96, 54
"""Pixels of the pictures in which coverage is counted."""
CLOSER = 0.88
"""A view that shows too little is tried again from so much of its distance."""
CLOSEST = 1e-4
"""Nearest that an eye comes to what it looks at, as a share of the scene's diagonal."""

OUTSIDE = {
    "front": (0.0, 0.25, 1.0),
    "side": (1.0, 0.25, 0.0),
    "corner": (1.0, 0.6, 1.0),
    "above": (0.2, 1.0, 0.3),
}
"""From where views look at the scene, +Y up."""
WITHIN = {"inside_x": (1.0, 0.0, 0.0), "inside_z": (0.0, 0.0, 1.0)}
"""Where views from the centre look."""


def automatic_cameras(scene: hrt.Scene) -> dict[str, CameraSpec]:
    """Return up to six views of a scene, +Y up, none of them inside closed geometry.

    Four look at it from outside, from as far as half of the picture shows it; two look along the
    horizontal axes from the centre of its bounds, where that is open and shows enough.

    Raises
    ------
    ArgumentError
        Triangles that span no space, or of which no picture shows anything.
    """
    low, high = scene.bounds
    centre, diagonal = (low + high) / 2, scene.diagonal
    if diagonal == 0.0:
        raise hrt.ArgumentError("scene", "triangles that span some space", "a single point")
    found = {
        name: _from_outside(scene, np.array(towards) / np.linalg.norm(towards), centre)
        for name, towards in OUTSIDE.items()
    }
    for name, axis in WITHIN.items():
        view = _view(centre, centre + diagonal * np.array(axis), diagonal)
        if coverage(scene, view) >= COVERED and not inside(scene, centre):
            found[name] = view
    views = {name: view for name, view in found.items() if view is not None}
    if not views:
        raise hrt.ArgumentError("scene", "triangles that a picture shows", "none of any view's")
    return views


def coverage(scene: hrt.Scene, view: CameraSpec) -> float:
    """Return the share of a view's pixels that show a surface."""
    return float((hrt.rasterize(scene, view.sized(*TRIED)).prim_id >= 0).mean())


def inside(scene: hrt.Scene, point: Any) -> bool:
    """Return whether a point, three float, world, lies inside closed geometry."""
    return abs(winding_number(scene, point)) > INSIDE


def winding_number(scene: hrt.Scene, point: Any) -> float:
    """Return how many times the triangles of a scene go around a point.

    References
    ----------
    A. Van Oosterom and J. Strackee, "The solid angle of a plane triangle", IEEE Transactions on
    Biomedical Engineering 30 (2), 1983, for the angle of each; A. Jacobson, L. Kavan and O.
    Sorkine-Hornung, "Robust inside-outside segmentation using generalized winding numbers", ACM
    Transactions on Graphics 32 (4), 2013.
    """
    total = 0.0
    for start in range(0, len(scene), 1 << 18):
        faces = scene.faces[start : start + (1 << 18)]
        a, b, c = (scene.vertices[faces[:, k]].astype(np.float64) - point for k in range(3))
        la, lb, lc = (np.linalg.norm(corner, axis=1) for corner in (a, b, c))
        volume = (a * np.cross(b, c)).sum(axis=1)
        below = la * lb * lc + (a * b).sum(axis=1) * lc
        below += (b * c).sum(axis=1) * la + (c * a).sum(axis=1) * lb
        total += float(np.arctan2(volume, below).sum())
    return total / (2 * math.pi)


def _from_outside(scene: hrt.Scene, towards: F64, centre: F64) -> CameraSpec | None:
    """Return a view along -towards that shows enough, or None where none is found.

    It looks at the centre, from as far as that goes; where there is nothing, as between two balls,
    at what is seen nearest to the centre of a picture of all.
    """
    far = 1.1 * scene.diagonal  # 60 degrees then hold the bounding sphere
    for target in (centre, _seen(scene, _view(centre + far * towards, centre, scene.diagonal))):
        distance = far
        while target is not None and distance >= CLOSEST * scene.diagonal:
            eye = target + distance * towards
            view = _view(eye, target, min(distance, scene.diagonal))
            if coverage(scene, view) >= COVERED and not inside(scene, eye):
                return view
            distance *= CLOSER
    return None


def _view(eye: F64, target: F64, size: float) -> CameraSpec:
    return CameraSpec(eye=tuple(eye), target=tuple(target), near=1e-4 * size)


def _seen(scene: hrt.Scene, view: CameraSpec) -> F64 | None:
    """Return the world point that a view shows nearest to the centre of its picture."""
    camera = view.sized(*TRIED)
    gbuffer = hrt.rasterize(scene, camera)
    y, x = np.nonzero(gbuffer.prim_id >= 0)
    if len(x) == 0:
        return None
    k = int(np.argmin((x - camera.width / 2) ** 2 + (y - camera.height / 2) ** 2))
    place = [x[k] + 0.5, y[k] + 0.5, gbuffer.depth[y[k], x[k]]]
    return np.asarray(hrt.unproject(camera, [place])[0])
