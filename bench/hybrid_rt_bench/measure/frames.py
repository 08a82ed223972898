"""Frames of someone's own: a depth buffer in a file, and the camera that it was drawn with.

``.npz``
    ``depth`` (H, W), as `hybrid_rt.GBuffer.from_arrays` takes it. If wanted ``kind``, ``bits``,
    ``far``, ``origin`` and ``background``, as there. The camera, if it is in the file, by the keys
    of a form of `hybrid_rt.camera_files`: ``view``, ``projection`` and ``convention``; ``K``,
    ``R`` and ``t``; or ``eye``, ``target``, ``up``, ``vfov_deg`` and ``near``. Its size is that of
    ``depth``.
``.exr``
    The channel ``Z``, one whose name ends in ``.Z``, or the only one there is: distances along the
    view, kind "linear" unless another is said.
``.png``
    16 bits of grey, kind "standard" unless another is said.
"""

from __future__ import annotations

import math
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

import hybrid_rt as hrt
from hybrid_rt.camera_files import camera_of
from hybrid_rt.errors import ArgumentError, UnknownNameError
from hybrid_rt_bench.measure.viewpoints import camera_in

READING = ("kind", "bits", "far", "origin", "background")
"""How a depth buffer is to be read: what `GBuffer.from_arrays` is told besides its camera."""
CAMERA = (
    "form", "eye", "target", "up", "vfov_deg", "near", "view_height", "view", "projection",
    "convention", "K", "R", "t",
)  # fmt: skip
FORMS = {"view": "matrices", "K": "intrinsics", "view_height": "orthographic", "eye": "look_at"}
"""By which key a camera in an .npz is known."""
SHAPES_DIFFER = 0.01
"""By how much a camera's picture may be of another shape than the depth buffer, relative."""


@dataclass(frozen=True, eq=False)
class Frame:
    """A depth buffer with its camera.

    Attributes
    ----------
    name : str
        Of its file.
    camera : Camera
    depth : (H, W) array
    reading : dict
        Some of `READING`.
    """

    name: str
    camera: hrt.Camera
    depth: NDArray[Any]
    reading: dict[str, Any]

    def gbuffer(self, tracer: hrt.EmbreeTracer | None = None) -> hrt.GBuffer:
        """Return what it shows: by the mesh of a tracer, or alone.

        Raises
        ------
        ArgumentError
            As `hybrid_rt.GBuffer.from_arrays`, with the file.
        """
        try:
            return hrt.GBuffer.from_arrays(self.camera, self.depth, tracer=tracer, **self.reading)
        except ArgumentError as error:
            where = f"{self.name}: {error.argument}"
            raise ArgumentError(where, error.expected, error.got) from None


def read_frame(
    path: str | Path, *, camera: str | None = None, channel: str | None = None, **reading: Any
) -> Frame:
    """Return the frame in a file.

    Parameters
    ----------
    path : str or Path
        An .npz, .exr or .png; see the module.
    camera : str, optional
        A file of cameras, ``FILE`` or ``FILE:NAME``, in place of the camera in the file.
    channel : str, optional
        Of an .exr.
    **reading
        Of `READING`, in place of what the file says; None changes nothing.

    Raises
    ------
    ArgumentError, UnknownNameError
        A file that is absent or none of these, without the channel or the keys, without a camera,
        or whose picture has another shape than the camera's.
    """
    path = Path(path)
    if not path.is_file():
        raise ArgumentError("--depth", "an existing .npz, .exr or .png file", repr(str(path)))
    suffix = path.suffix.lower()
    if channel is not None and suffix != ".exr":
        raise ArgumentError("--channel", "none but for an .exr", repr(channel))
    said: dict[str, Any] = {}
    if suffix == ".npz":
        depth, said, in_file = _npz(path)
    elif suffix == ".exr":
        depth, said, in_file = _exr(path, channel), {"kind": "linear"}, None
    elif suffix == ".png":
        depth, in_file = _png(path), None
    else:
        raise ArgumentError("--depth", "a file that ends in .npz, .exr or .png", repr(str(path)))
    if depth.ndim != 2 or 0 in depth.shape:
        raise ArgumentError(f"{path.name}: depth", "an array (H, W)", f"shape {depth.shape}")
    height, width = depth.shape
    if camera is not None:
        view = _sized(camera_in("--camera", camera), width, height)
    elif in_file is not None:
        view = _from_keys(in_file, width, height, path.name)
    else:
        expected = "a file of cameras, since the depth buffer has none with it"
        raise ArgumentError("--camera", expected, "none")
    given = {key: value for key, value in reading.items() if value is not None}
    return Frame(path.stem, view, depth, {**said, **given})


def _npz(path: Path) -> tuple[NDArray[Any], dict[str, Any], dict[str, Any] | None]:
    """Return depth, how to read it, and the keys of the camera if there are any."""
    try:
        with np.load(path, allow_pickle=False) as stored:
            arrays = {key: stored[key] for key in stored.files}
    except (OSError, ValueError, EOFError, zipfile.BadZipFile) as error:
        raise ArgumentError("--depth", "an .npz of plain arrays", f"{path}: {error}") from None
    known = ("depth", *READING, *CAMERA)
    for key in arrays:
        if key not in known:
            raise UnknownNameError(f"key of {path.name}", key, known)
    if "depth" not in arrays:
        raise ArgumentError(f"{path.name}: depth", "an array (H, W)", "none")
    reading = {key: _plain(arrays[key]) for key in READING if key in arrays}
    camera = {key: _plain(arrays[key]) for key in CAMERA if key in arrays}
    return arrays["depth"], reading, camera or None


def _plain(array: NDArray[Any]) -> Any:
    """Return a number or a text of no dimensions, else lists; a mask stays an array."""
    return array if array.dtype == np.bool_ and array.ndim else array.tolist()


def _from_keys(keys: Mapping[str, Any], width: int, height: int, source: str) -> hrt.Camera:
    form = next((form for key, form in FORMS.items() if key in keys), "look_at")
    table = {"form": form, **keys, "width": width, "height": height}
    return camera_of(table, source)


def _sized(camera: hrt.Camera, width: int, height: int) -> hrt.Camera:
    """Return a camera with the size of a depth buffer, whose shape it must have."""
    ratio = (camera.width / camera.height) / (width / height)
    if not math.isclose(ratio, 1.0, rel_tol=SHAPES_DIFFER):
        expected = f"a camera of the depth buffer's shape, {width}x{height} pixels"
        raise ArgumentError("--camera", expected, f"one of {camera.width}x{camera.height}")
    if (camera.width, camera.height) == (width, height):
        return camera
    return camera.resized(width, height)


def _exr(path: Path, channel: str | None) -> NDArray[Any]:
    """Return a channel of an OpenEXR file."""
    try:
        import OpenEXR
    except ImportError:
        expected = "the package OpenEXR for an .exr (pip install 'hybrid-rt[exr]')"
        raise ArgumentError("--depth", expected, "none installed") from None
    try:
        with OpenEXR.File(str(path), separate_channels=True) as file:
            part = file.parts[0]
            names = list(part.channels)
            chosen = _channel(names, channel, path)
            pixels = np.array(part.channels[chosen].pixels)
            windows = part.header["dataWindow"], part.header["displayWindow"]
    except RuntimeError as error:
        raise ArgumentError("--depth", "a readable OpenEXR file", f"{path}: {error}") from None
    sizes = [np.subtract(w[1], w[0]) for w in windows]
    if any((a != b).any() for a, b in zip(*windows, strict=True)):
        expected = "an image of the whole picture, not of a part of it"
        got = f"{sizes[0][0] + 1}x{sizes[0][1] + 1} of {sizes[1][0] + 1}x{sizes[1][1] + 1} pixels"
        raise ArgumentError("--depth", expected, f"{path}: {got}")
    return pixels


def _channel(names: list[str], wanted: str | None, path: Path) -> str:
    """Return the channel that holds depth."""
    if wanted is not None:
        if wanted not in names:
            raise UnknownNameError(f"channel of {path.name}", wanted, names)
        return wanted
    found = [n for n in names if n == "Z"] or [n for n in names if n.endswith(".Z")]
    found = found or (names if len(names) == 1 else [])
    if len(found) != 1:
        got = f"none that is alone named Z among {', '.join(sorted(names))}"
        raise ArgumentError("--channel", f"the channel of {path.name} that holds depth", got)
    return found[0]


def _png(path: Path) -> NDArray[Any]:
    """Return the 16 bits of a picture in greys."""
    try:
        with Image.open(path) as image:
            mode = image.mode
            pixels = np.asarray(image) if mode.startswith("I") else None
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError) as error:
        raise ArgumentError("--depth", "a readable PNG", f"{path}: {error}") from None
    if pixels is None or pixels.ndim != 2:
        raise ArgumentError("--depth", "a PNG of 16 bits of grey", f"{path}: of mode {mode!r}")
    return pixels.astype(np.uint16)
