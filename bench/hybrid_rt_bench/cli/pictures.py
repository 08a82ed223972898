"""Pictures of one view: shaded, depth, normals, and how the march of every mirror ray ended."""

from __future__ import annotations

import io
import os
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
import psutil
from numpy.typing import NDArray
from PIL import Image

import hybrid_rt as hrt
from hybrid_rt.errors import ArgumentError
from hybrid_rt_bench.measure import shade
from hybrid_rt_bench.measure.loaded import native_path
from hybrid_rt_bench.report.looks import STATUSES, rgb
from hybrid_rt_bench.report.sheet import Entry, Picture, Scale, pixels, reduced, sheet
from hybrid_rt_bench.results.files import write_bytes

U8 = NDArray[np.uint8]
What = Literal["shaded", "depth", "normals", "status", "all"]
PICTURES: tuple[What, ...] = ("shaded", "depth", "normals", "status", "all")

BACKGROUND = rgb(STATUSES[""])
STATUS_WORDS = {
    hrt.MarchStatus.HIT: "hit: resolved",
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

NORMALS = "normals, turned to the viewer: x, y, z from −1 to 1 as red, green, blue"
AXES = (
    ("#FF8080", "+x"), ("#80FF80", "+y"), ("#8080FF", "+z"),
    ("#008080", "−x"), ("#800080", "−y"), ("#808000", "−z"),
)  # fmt: skip
"""The colours of normals along the axes."""

SHEET = 960
"""Width of a picture on a contact sheet."""


def render(scene: hrt.Scene, camera: hrt.Camera, what: What, threads: int | None = None) -> U8:
    """Return a picture of a view.

    Parameters
    ----------
    scene : Scene
    camera : Camera
    what : {"shaded", "depth", "normals", "status", "all"}
        "all" is a contact sheet of the others with captions. Where colours mean something, the
        picture stands over a legend or a scale.
    threads : int, optional

    Returns
    -------
    (H, W, 3) uint8
    """
    return of_view(hrt.rasterize(scene, camera, threads=threads), what, threads)


def of_view(gbuffer: hrt.GBuffer, what: What, threads: int | None = None) -> U8:
    """Return a picture of a G-buffer, as `render`.

    Raises
    ------
    ArgumentError
        "shaded" of one whose scene is not known; of such "all" are the others.
    """
    scene = gbuffer.scene
    every = ("depth", "normals", "status") if scene is None else PICTURES[:4]
    kinds: tuple[str, ...] = every if what == "all" else (what,)
    rays = hrt.mirror_rays(gbuffer)
    made: dict[str, Picture] = {}
    entries: list[Entry] = []
    for kind in kinds:
        if kind == "shaded":
            tracer = hrt.EmbreeTracer(gbuffer.known_scene, threads=threads, path=native_path())
            made[kind] = Picture(shade.shaded(gbuffer, rays, tracer, samples=16))
        elif kind == "depth":
            made[kind] = Picture(*depth_picture(gbuffer))
        elif kind == "normals":
            made[kind] = Picture(normals_image(gbuffer), NORMALS)
            entries += AXES if what == "normals" else ()
        else:
            screen = hrt.prepare(gbuffer, "paper", threads=threads)
            status = hrt.march(rays, screen, threads=threads).status
            caption = "how the march of each mirror ray ended, technique paper"
            made[kind] = Picture(status_image(gbuffer, rays, status), caption)
            entries += status_entries(status)
    if what == "shaded":
        return made[what].image
    if (gbuffer.prim_id < 0).any() and what != "all":
        entries.append((STATUSES[""], "no surface"))
    title = ""
    if what == "all":
        title = "a depth buffer" if scene is None else f"{scene.name}, {len(scene):,} triangles"
        made = {k: replace(p, image=reduced(p.image, SHEET)) for k, p in made.items()}
        entries.append((STATUSES[""], "no surface"))
    return pixels(sheet(list(made.values()), columns=2, title=title, legend=entries))


def depth_picture(gbuffer: hrt.GBuffer) -> tuple[U8, str, Scale | None]:
    """Return distances in colours, a caption where there is none, and their scale.

    Near is bright and far dark, between the 1st and the 99th percentile of the distances in view,
    on a logarithmic scale, or a linear one where lines of sight are parallel; white where there is
    no surface. No scale where nothing is in view.
    """
    covered = gbuffer.prim_id >= 0
    image = np.full((*covered.shape, 3), BACKGROUND, np.uint8)
    if not covered.any():
        return image, "depth: no surface is in view", None
    camera = gbuffer.camera
    z = camera.z_view(gbuffer.depth[covered])
    low, high = (float(end) for end in np.quantile(z, [0.01, 0.99]))
    if high - low <= 1e-3 * abs(high):  # one distance: a scale about it
        about = 0.01 * abs(high) or 0.01
        low, high = low - about, high + about
    label = "distance along the view axis, z, in the scene's units"
    # Between planes of parallel sight distances may be below zero, and nothing is far off.
    scale = Scale(label, low, high, "cividis_r", logarithmic=not camera.parallel)
    image[covered] = scale.painted(z)
    return image, "", scale


def normals_image(gbuffer: hrt.GBuffer) -> U8:
    """Return the normals turned to the viewer: x, y, z from -1..1 as red, green, blue."""
    image = np.round(127.5 * (shade.normals(gbuffer) + 1)).astype(np.uint8)
    image[gbuffer.prim_id < 0] = BACKGROUND
    return image


def status_image(gbuffer: hrt.GBuffer, rays: hrt.Rays, status: NDArray[np.uint8]) -> U8:
    """Return the status of every mirror ray, in its colour, at the pixel that it starts from."""
    palette = np.array([rgb(STATUSES[s.name]) for s in hrt.MarchStatus], np.uint8)
    image = np.full((*gbuffer.prim_id.shape, 3), BACKGROUND, np.uint8)
    image[rays.pixel[:, 1], rays.pixel[:, 0]] = palette[status]
    return image


def status_entries(status: NDArray[np.uint8]) -> list[Entry]:
    """Return the colour and the share of each status that there is."""
    counts = [(s, int(np.count_nonzero(status == s))) for s in hrt.MarchStatus]
    return [
        (STATUSES[s.name], f"{STATUS_WORDS[s]} ({100 * count / len(status):.1f} %)")
        for s, count in counts
        if count
    ]


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
