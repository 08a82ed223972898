"""``hybrid-rt render``."""

from __future__ import annotations

from dataclasses import replace
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from hybrid_rt.errors import ArgumentError
from hybrid_rt_bench.cli import terminal
from hybrid_rt_bench.cli.common import Threads

if TYPE_CHECKING:
    from hybrid_rt.camera.camera import Camera
    from hybrid_rt.raster.gbuffer import GBuffer


class What(StrEnum):
    """What `render` can show."""

    shaded = "shaded"
    depth = "depth"
    normals = "normals"
    status = "status"
    all = "all"


def render(
    output: Annotated[Path, typer.Option("-o", "--output", help="PNG to write.")],
    scene: Annotated[
        str | None,
        typer.Argument(
            help="Name of a scene, or path of a mesh file or a definition; may be left out "
            "beside --depth."
        ),
    ] = None,
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
    size: Annotated[
        str | None, typer.Option("--size", help="WIDTHxHEIGHT in pixels; default: 1280x720.")
    ] = None,
    what: Annotated[
        What | None,
        typer.Option(
            "--what", help="What to show; default: shaded, of a depth buffer alone depth."
        ),
    ] = None,
    depth: Annotated[
        str | None, typer.Option("--depth", help="Depth buffer of your own: .npz, .exr or .png")
    ] = None,
    kind: Annotated[
        str | None,
        typer.Option("--kind", help="What it holds: standard, reversed, linear or distance"),
    ] = None,
    bits: Annotated[
        int | None, typer.Option("--bits", help="Bits of its integers that are depth.")
    ] = None,
    far: Annotated[
        float | None, typer.Option("--far", help="Distance of its far plane, world units.")
    ] = None,
    origin: Annotated[
        str | None, typer.Option("--origin", help="Where its first row is: top or bottom")
    ] = None,
    background: Annotated[
        float | None,
        typer.Option("--background", help="What else than the far plane stands for nothing in it."),
    ] = None,
    channel: Annotated[
        str | None, typer.Option("--channel", help="Which channel of an .exr is depth.")
    ] = None,
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

    * `hybrid-rt render --depth dump.npz --what normals -o normals.png` - a frame of your own

    * `hybrid-rt render hall.glb --eye 0,1.7,5 --target 0,1,0 --fov 75 -o hall.png`
    """
    from hybrid_rt_bench.cli import pictures
    from hybrid_rt_bench.measure import viewpoints
    from hybrid_rt_bench.measure.experiment import Resolution
    from hybrid_rt_bench.measure.plan import find_scene

    pictures.check_output(output)
    reading = {"kind": kind, "bits": bits, "far": far, "origin": origin, "background": background}
    if depth is not None:
        _check_alone(eye, target, size)
        if scene is None and what is What.shaded:
            expected = "depth, normals, status or all, where no scene is named beside --depth"
            raise ArgumentError("--what", expected, "shaded")
        gbuffer = _gbuffer(depth, scene, camera, {**reading, "channel": channel}, threads)
        shown = what or (What.depth if gbuffer.scene is None else What.shaded)
        _write(output, pictures.of_view(gbuffer, shown.value, threads))
        return
    for option, value in {**reading, "channel": channel}.items():
        if value is not None:
            raise ArgumentError(f"--{option}", "none without --depth", repr(value))
    if scene is None:
        raise ArgumentError("SCENE", "a scene, a mesh file or --depth", "none")
    pixels = Resolution.parse("--size", size or "1280x720")
    shown = what or What.shaded
    spec = find_scene(scene)
    own = None
    if eye is not None or target is not None:
        own = _own_camera(eye, target, up, fov, camera)
    if own is None and camera is not None and viewpoints.is_file(camera):
        view = viewpoints.camera_in("--camera", camera).resized(pixels.width, pixels.height)
    else:
        view = own or spec.camera(camera or next(iter(spec.cameras)), pixels.width, pixels.height)
    pictures.check_memory(pixels.width, pixels.height, shown.value)
    loaded = spec.load()
    if own is not None:
        near = 1e-4 * loaded.diagonal
        view = replace(own, width=pixels.width, height=pixels.height, near=near)
    _write(output, pictures.render(loaded, view, shown.value, threads))


def _write(output: Path, picture: Any) -> None:
    from hybrid_rt_bench.cli import pictures

    pictures.write_png(output, picture)
    terminal.err().print(f"wrote {output}", soft_wrap=True, highlight=False)


def _check_alone(eye: str | None, target: str | None, size: str | None) -> None:
    """Raise where options place a camera or choose a size beside a depth buffer, which has both."""
    for option, value in (("--eye", eye), ("--target", target), ("--size", size)):
        if value is not None:
            raise ArgumentError(option, "none beside --depth, whose own it is", repr(value))


def _gbuffer(
    depth: str, scene: str | None, camera: str | None, reading: dict[str, Any], threads: int | None
) -> GBuffer:
    """Return what a depth buffer shows, by the mesh of a scene if one is given."""
    import hybrid_rt as hrt
    from hybrid_rt_bench.measure.frames import read_frame
    from hybrid_rt_bench.measure.loaded import native_path
    from hybrid_rt_bench.measure.plan import find_scene

    frame = read_frame(depth, camera=camera, **reading)
    tracer = None
    if scene is not None:
        loaded = find_scene(scene).load()
        tracer = hrt.EmbreeTracer(loaded, threads=threads, path=native_path())
    gbuffer = frame.gbuffer(tracer)
    terminal.err().print(repr(gbuffer), soft_wrap=True, highlight=False, markup=False)
    return gbuffer


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
