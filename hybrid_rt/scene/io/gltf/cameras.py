"""The cameras of a glTF file."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import numpy as np

from hybrid_rt.scene.io.gltf.container import open_file
from hybrid_rt.scene.io.gltf.nodes import Nodes
from hybrid_rt.scene.io.gltf.tree import At
from hybrid_rt.scene.io.words import F64

Vector = tuple[float, float, float]


@dataclasses.dataclass(frozen=True)
class FileCamera:
    """A camera as a file has it.

    Attributes
    ----------
    name : str
        Of the node, else of the camera, else "camera 0", "camera 1" ...
    eye, target, up : (float, float, float), world
        The target is one unit ahead; `up` is of length 1 and at right angles to that.
    yfov : float or None
        Vertical field of view, radians; None of an orthographic camera.
    ymag : float or None
        Half of what the height of an orthographic camera shows, world units; None of a perspective
        one.
    aspect : float or None
        Width / height; None where the file leaves it to the window.
    znear : float
        Distance of the near plane, world units.
    zfar : float or None
        Distance of the far plane; None for infinite.
    """

    name: str
    eye: Vector
    target: Vector
    up: Vector
    yfov: float | None
    ymag: float | None
    aspect: float | None
    znear: float
    zfar: float | None


def read(path: Path, data: bytes) -> list[FileCamera]:
    """Return the cameras of the default scene, in the order of its nodes.

    A camera looks along -z of its node, +y up. The scale of a node does not change it.
    """
    tree, _ = open_file(path, data)
    cameras = tree.all("cameras")
    nodes = Nodes(tree)
    found: list[FileCamera] = []
    for k in nodes.shown():
        node = nodes.nodes[k]
        link = node.get("camera")
        if link is None:
            continue
        camera = cameras[link.index(cameras)]
        found.append(_camera(node, camera, nodes.world(k), f"camera {len(found)}"))
    return found


Lens = tuple[float | None, float | None, float | None, float, float | None]
"""yfov, ymag, aspect, znear and zfar."""


def _lens(camera: At) -> Lens:
    """Return what a camera's lens says, of whichever type it is."""
    kind = camera.need("type")
    if kind.text() == "perspective":
        return _perspective(camera.need("perspective"))
    if kind.text() == "orthographic":
        return _orthographic(camera.need("orthographic"))
    raise kind.fault("expected 'perspective' or 'orthographic'")


def _orthographic(lens: At) -> Lens:
    xmag, ymag, znear, zfar = (lens.need(key).number() for key in ("xmag", "ymag", "znear", "zfar"))
    if xmag == 0 or ymag == 0 or not 0 <= znear < zfar:
        raise lens.fault("expected an xmag and a ymag other than 0, and 0 <= znear < zfar")
    return None, abs(ymag), abs(xmag / ymag), znear, zfar


def _perspective(lens: At) -> Lens:
    yfov, znear = lens.need("yfov").number(), lens.need("znear").number()
    aspect, zfar = (
        None if place is None else place.number()
        for place in (lens.get("aspectRatio"), lens.get("zfar"))
    )
    if not 0 < yfov < math.pi or znear <= 0 or (zfar is not None and zfar <= znear):
        raise lens.fault("expected 0 < yfov < pi and 0 < znear < zfar")
    if aspect is not None and aspect <= 0:
        raise lens.fault("expected an aspectRatio > 0")
    return yfov, None, aspect, znear, zfar


def _camera(node: At, camera: At, world: F64, default: str) -> FileCamera:
    lens = _lens(camera)
    ahead, up, eye = -world[:3, 2], world[:3, 1], world[:3, 3]
    with np.errstate(all="ignore"):
        ahead = ahead / np.linalg.norm(ahead)
        up = up - ahead * (up @ ahead)
        up = up / np.linalg.norm(up)
    if not (np.isfinite(ahead).all() and np.isfinite(up).all()):
        raise node.fault("its transform leaves a camera no direction")
    named = [place.text() for place in (node.get("name"), camera.get("name")) if place is not None]
    name = next((text for text in named if text), default)
    return FileCamera(name, _vector(eye), _vector(eye + ahead), _vector(up), *lens)


def _vector(values: F64) -> Vector:
    x, y, z = values.tolist()
    return x, y, z
