"""``hybrid-rt render``."""

from __future__ import annotations

from dataclasses import replace
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from hybrid_rt.errors import ArgumentError
from hybrid_rt_bench.cli import terminal
from hybrid_rt_bench.cli.common import Threads

if TYPE_CHECKING:
    from hybrid_rt.camera.camera import Camera


class What(StrEnum):
    """What `render` can show."""

    shaded = "shaded"
    depth = "depth"
    normals = "normals"
    status = "status"
    all = "all"


def render(
    scene: Annotated[
        str, typer.Argument(help="Name of a scene, or path of a mesh file or a definition.")
    ],
    output: Annotated[Path, typer.Option("-o", "--output", help="PNG to write.")],
    camera: Annotated[
        str | None,
        typer.Option(
            "--camera",
            help="Name of a camera, or FILE or FILE:NAME of .toml, .glb or .gltf; "
            "default: the first.",
        ),
    ] = None,
    eye: Annotated[
        str | None, typer.Option("--eye", help="X,Y,Z of a camera of your own; with --target.")
    ] = None,
    target: Annotated[str | None, typer.Option("--target", help="X,Y,Z that it looks at.")] = None,
    up: Annotated[str, typer.Option("--up", help="X,Y,Z that points upwards in it.")] = "0,1,0",
    fov: Annotated[float, typer.Option("--fov", help="Its vertical field of view, degrees.")] = 60,
    size: Annotated[str, typer.Option("--size", help="WIDTHxHEIGHT in pixels.")] = "1280x720",
    what: Annotated[What, typer.Option("--what", help="What to show.")] = What.shaded,
    threads: Threads = None,
) -> None:
    """Write one picture of a scene.

    * `shaded` - sun, sky and shadows on bare geometry

    * `depth` - distance along the view axis, with its logarithmic scale

    * `normals` - turned to the viewer, with a legend

    * `status` - how the march of every mirror ray ended, with a legend

    * `all` - a contact sheet of the four

    Examples
    --------
    * `hybrid-rt render atrium -o atrium.png`

    * `hybrid-rt render sponza --camera nave --what all --size 1920x1080 -o sponza.png`

    * `hybrid-rt render hall.glb -o hall.png` - by the file's own camera, if it has one

    * `hybrid-rt render hall.obj --camera views.toml:door -o hall.png`

    * `hybrid-rt render hall.glb --eye 0,1.7,5 --target 0,1,0 --fov 75 -o hall.png`
    """
    from hybrid_rt_bench.cli import pictures
    from hybrid_rt_bench.measure import viewpoints
    from hybrid_rt_bench.measure.experiment import Resolution
    from hybrid_rt_bench.measure.plan import find_scene

    pixels = Resolution.parse("--size", size)
    spec = find_scene(scene)
    own = None
    if eye is not None or target is not None:
        own = _own_camera(eye, target, up, fov, camera)
    if own is None and camera is not None and viewpoints.is_file(camera):
        view = viewpoints.camera_in("--camera", camera).resized(pixels.width, pixels.height)
    else:
        view = own or spec.camera(camera or next(iter(spec.cameras)), pixels.width, pixels.height)
    pictures.check_output(output)
    pictures.check_memory(pixels.width, pixels.height, what.value)
    loaded = spec.load()
    if own is not None:
        near = 1e-4 * loaded.diagonal
        view = replace(own, width=pixels.width, height=pixels.height, near=near)
    pictures.write_png(output, pictures.render(loaded, view, what.value, threads))
    terminal.err().print(f"wrote {output}", soft_wrap=True, highlight=False)


def _own_camera(
    eye: str | None, target: str | None, up: str, fov: float, camera: str | None
) -> Camera:
    """Return the camera that options place; its pixels and near plane are still to be chosen."""
    from hybrid_rt.camera.camera import Camera

    if camera is not None:
        raise ArgumentError("--camera", "none beside --eye and --target", repr(camera))
    for option, text in (("--eye", eye), ("--target", target)):
        if text is None:
            raise ArgumentError(option, "X,Y,Z, as --eye and --target go together", "none")
    places = [
        _vector(option, str(text))
        for option, text in (("--eye", eye), ("--target", target), ("--up", up))
    ]
    try:
        return Camera.look_at(*places, vfov_deg=fov)
    except ArgumentError as error:
        option = {"vfov_deg": "--fov"}.get(error.argument, f"--{error.argument}")
        raise ArgumentError(option, error.expected, error.got) from None


def _vector(option: str, text: str) -> tuple[float, ...]:
    """Return the numbers of an option "X,Y,Z"."""
    try:
        numbers = tuple(float(part) for part in text.split(","))
    except ValueError:
        numbers = ()
    if len(numbers) != 3:
        raise ArgumentError(option, "three numbers, X,Y,Z", repr(text))
    return numbers
