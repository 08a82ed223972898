"""``hybrid-rt render``."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from hybrid_rt_bench.cli import terminal
from hybrid_rt_bench.cli.common import Threads


class What(StrEnum):
    """What `render` can show."""

    shaded = "shaded"
    depth = "depth"
    normals = "normals"
    status = "status"
    all = "all"


def render(
    scene: Annotated[str, typer.Argument(help="Name of a scene, or path of a mesh file.")],
    output: Annotated[Path, typer.Option("-o", "--output", help="PNG to write.")],
    camera: Annotated[
        str | None, typer.Option("--camera", help="Name of a camera; default: the first.")
    ] = None,
    size: Annotated[str, typer.Option("--size", help="WIDTHxHEIGHT in pixels.")] = "1280x720",
    what: Annotated[What, typer.Option("--what", help="What to show.")] = What.shaded,
    threads: Threads = None,
) -> None:
    """Write one picture of a scene.

    * `shaded` - sun, sky and shadows on bare geometry

    * `depth` - distance on a logarithmic scale

    * `normals` - turned to the viewer

    * `status` - how the march of every mirror ray ended, with a legend

    * `all` - a contact sheet of the four

    Examples
    --------
    * `hybrid-rt render atrium -o atrium.png`

    * `hybrid-rt render sponza --camera nave --what all --size 1920x1080 -o sponza.png`
    """
    from hybrid_rt_bench.cli import pictures
    from hybrid_rt_bench.measure.experiment import Resolution
    from hybrid_rt_bench.measure.plan import find_scene

    pixels = Resolution.parse("--size", size)
    spec = find_scene(scene)
    view = spec.camera(camera or next(iter(spec.cameras)), pixels.width, pixels.height)
    pictures.check_output(output)
    pictures.check_memory(pixels.width, pixels.height, what.value)
    pictures.write_png(output, pictures.render(spec.load(), view, what.value, threads))
    terminal.err().print(f"wrote {output}", soft_wrap=True, highlight=False)
