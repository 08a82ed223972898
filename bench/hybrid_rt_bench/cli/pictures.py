"""Pictures of one view: shaded, depth, normals, and how the march of every mirror ray ended."""

from __future__ import annotations

import io
import os
from pathlib import Path
from typing import Literal

import matplotlib as mpl
import numpy as np
import psutil
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray
from PIL import Image

import hybrid_rt as hrt
from hybrid_rt.errors import ArgumentError
from hybrid_rt_bench.measure import shade
from hybrid_rt_bench.measure.loaded import native_path
from hybrid_rt_bench.report.style import hexadecimal, reduced
from hybrid_rt_bench.results.files import write_bytes

U8 = NDArray[np.uint8]
What = Literal["shaded", "depth", "normals", "status", "all"]
PICTURES: tuple[What, ...] = ("shaded", "depth", "normals", "status", "all")

BACKGROUND = (250, 240, 215)
STATUS_COLOURS = {
    hrt.MarchStatus.HIT: (240, 240, 240),
    hrt.MarchStatus.MISS: (86, 180, 233),
    hrt.MarchStatus.OFFSCREEN: (230, 159, 0),
    hrt.MarchStatus.HIDDEN: (0, 92, 158),
    hrt.MarchStatus.NEAR: (0, 158, 115),
    hrt.MarchStatus.EXHAUSTED: (204, 121, 167),
    hrt.MarchStatus.INVALID: (226, 26, 28),
    hrt.MarchStatus.UNDECIDED: (120, 94, 60),
    hrt.MarchStatus.SKIPPED: (60, 60, 60),
}
STATUS_WORDS = {
    hrt.MarchStatus.HIT: "hit: answered",
    hrt.MarchStatus.MISS: "miss: in front of everything",
    hrt.MarchStatus.OFFSCREEN: "offscreen: leaves the image",
    hrt.MarchStatus.HIDDEN: "hidden: behind a surface",
    hrt.MarchStatus.NEAR: "near: towards the observer",
    hrt.MarchStatus.EXHAUSTED: "exhausted: step budget",
    hrt.MarchStatus.INVALID: "invalid",
    hrt.MarchStatus.UNDECIDED: "undecided: closer than can be told",
    hrt.MarchStatus.SKIPPED: "skipped: no probe answered",
}
BYTES_A_PIXEL: dict[What, int] = {
    "shaded": 340, "depth": 140, "normals": 190, "status": 220, "all": 340,
}  # fmt: skip
"""What a picture takes at its most, G-buffer and rays too: measured at 2560x1440, rounded up."""

SHEET = 960
"""Width of a picture on a contact sheet."""


def render(scene: hrt.Scene, camera: hrt.Camera, what: What, threads: int | None = None) -> U8:
    """Return a picture of a view.

    Parameters
    ----------
    scene : Scene
    camera : Camera
    what : {"shaded", "depth", "normals", "status", "all"}
        "all" is a contact sheet of the others with captions.
    threads : int, optional

    Returns
    -------
    (H, W, 3) uint8
    """
    gbuffer = hrt.rasterize(scene, camera, threads=threads)
    kinds = ("shaded", "depth", "normals", "status") if what == "all" else (what,)
    rays = hrt.mirror_rays(gbuffer)
    images: dict[str, U8] = {}
    status: NDArray[np.uint8] | None = None
    for kind in kinds:
        if kind == "shaded":
            tracer = hrt.EmbreeTracer(scene, threads=threads, path=native_path())
            images[kind] = shade.shaded(gbuffer, rays, tracer, samples=16)
        elif kind == "depth":
            images[kind] = depth_image(gbuffer)
        elif kind == "normals":
            images[kind] = normals_image(gbuffer)
        else:
            screen = hrt.prepare(gbuffer, "paper", threads=threads)
            status = hrt.march(rays, screen, threads=threads).status
            images[kind] = status_image(gbuffer, rays, status)
    if what == "all":
        return _contact_sheet(scene, images, status)
    if status is not None:
        return _with_legend(images["status"], status)
    return images[what]


def depth_image(gbuffer: hrt.GBuffer) -> U8:
    """Return the distance, near bright and far dark on a logarithmic scale; cream where none.

    Of parallel lines of sight the scale is linear, as their depth is. The ends of the scale are the
    1st and 99th percentile of the distances in view.
    """
    covered = gbuffer.prim_id >= 0
    image = np.full((*covered.shape, 3), BACKGROUND, np.uint8)
    if covered.any():
        depth = gbuffer.depth[covered]
        scale = depth if gbuffer.camera.parallel else np.log(depth)
        low, high = np.quantile(scale, [0.01, 0.99])
        scaled = np.clip((scale - low) / max(high - low, 1e-6), 0, 1)
        image[covered] = (255 * mpl.colormaps["cividis"](scaled)[:, :3]).astype(np.uint8)
    return image


def normals_image(gbuffer: hrt.GBuffer) -> U8:
    """Return the normals turned to the viewer: x, y, z from -1..1 as red, green, blue."""
    image = np.round(127.5 * (shade.normals(gbuffer) + 1)).astype(np.uint8)
    image[gbuffer.prim_id < 0] = BACKGROUND
    return image


def status_image(gbuffer: hrt.GBuffer, rays: hrt.Rays, status: NDArray[np.uint8]) -> U8:
    """Return the status of every mirror ray at the pixel that it starts from."""
    palette = np.array([STATUS_COLOURS[s] for s in hrt.MarchStatus], np.uint8)
    image = np.full((*gbuffer.prim_id.shape, 3), BACKGROUND, np.uint8)
    light = 0.72 + 0.28 * np.abs(shade.normals(gbuffer) @ shade.SUN)
    x, y = rays.pixel[:, 0], rays.pixel[:, 1]
    image[y, x] = (palette[status] * light[y, x, None]).astype(np.uint8)
    return image


def check_memory(width: int, height: int, what: What) -> None:
    """Raise unless a picture of that size can be made in the memory that is free.

    Raises
    ------
    ArgumentError
        With how much it takes and how much there is.
    """
    needed = width * height * BYTES_A_PIXEL[what]
    free = psutil.virtual_memory().available
    if needed > free:
        raise ArgumentError(
            "size",
            f"a picture that fits in memory ({free / 2**30:.1f} GiB are free)",
            f"{width}x{height}, which takes about {needed / 2**30:.1f} GiB",
        )


def write_png(path: Path, image: U8) -> None:
    """Write a picture.

    Raises
    ------
    ArgumentError
        A name that does not end in ``.png``, or a folder that is absent or cannot be written to.
    """
    check_output(path)
    buffer = io.BytesIO()
    Image.fromarray(image).save(buffer, "PNG")
    write_bytes(path, buffer.getvalue())


def check_output(path: Path) -> None:
    """Raise unless `path` names a PNG in a folder that is there and can be written to."""
    if path.suffix.lower() != ".png":
        raise ArgumentError("output", "a file name that ends in .png", repr(str(path)))
    folder = path.parent
    if not folder.is_dir():
        raise ArgumentError("output", "a file in an existing folder", repr(str(path)))
    if not os.access(folder, os.W_OK):
        raise ArgumentError("output", "a file in a folder that can be written to", repr(str(path)))


def _with_legend(image: U8, status: NDArray[np.uint8]) -> U8:
    height, width = image.shape[:2]
    foot = max(60, round(width * 0.075))
    figure = Figure(figsize=(width / 100, (height + foot) / 100), dpi=100)
    ax = figure.add_axes((0, foot / (height + foot), 1, height / (height + foot)))
    ax.imshow(image, interpolation="nearest", aspect="auto")
    ax.set_axis_off()
    figure.legend(
        handles=_status_patches(status), loc="lower center", ncols=3, frameon=False,
        fontsize=max(6.0, min(13.0, width / 90)), borderpad=0.2,
    )  # fmt: skip
    return _pixels(figure)


def _status_patches(status: NDArray[np.uint8]) -> list[Patch]:
    patches = []
    for s in hrt.MarchStatus:
        count = int(np.count_nonzero(status == s))
        if count:
            share = 100 * count / len(status)
            colour = hexadecimal(STATUS_COLOURS[s])
            label = f"{STATUS_WORDS[s]} ({share:.1f} %)"
            patches.append(Patch(facecolor=colour, edgecolor="#777777", lw=0.5, label=label))
    patches.append(
        Patch(facecolor=hexadecimal(BACKGROUND), edgecolor="#777777", lw=0.5, label="no surface")
    )
    return patches


def _contact_sheet(scene: hrt.Scene, images: dict[str, U8], status: NDArray[np.uint8] | None) -> U8:
    small = {kind: reduced(image, SHEET) for kind, image in images.items()}
    height, width = next(iter(small.values())).shape[:2]
    caption, gap, foot = 30, 10, max(60, round(width * 0.07))
    total_w = 2 * width + gap
    total_h = 2 * (height + caption) + foot
    figure = Figure(figsize=(total_w / 100, total_h / 100), dpi=100)
    words = {
        "shaded": f"{scene.name}, {len(scene):,} triangles",
        "depth": "distance: bright near, dark far (logarithmic)",
        "normals": "normals, turned to the viewer",
        "status": "how the march of each mirror ray ended",
    }
    for number, (kind, image) in enumerate(small.items()):
        x = (number % 2) * (width + gap)
        top = (number // 2) * (height + caption)
        ax = figure.add_axes(
            (x / total_w, 1 - (top + height) / total_h, width / total_w, height / total_h)
        )
        ax.imshow(image, interpolation="nearest", aspect="auto")
        ax.set_axis_off()
        figure.text(
            (x + 6) / total_w, 1 - (top + height + 5) / total_h, words[kind], va="top",
            fontsize=max(6.0, min(12.0, width / 60)),
        )  # fmt: skip
    if status is not None:
        figure.legend(
            handles=_status_patches(status), loc="lower center", ncols=4, frameon=False,
            fontsize=max(5.0, min(11.0, width / 70)), borderpad=0.2,
        )  # fmt: skip
    return _pixels(figure)


def _pixels(figure: Figure) -> U8:
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=100)
    return np.asarray(Image.open(buffer).convert("RGB"))
