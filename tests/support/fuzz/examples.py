"""One valid value for each parameter of the public API, by the parameter's name.

What a fuzzer replaces by junk, one argument at a time. A parameter that has no default and no
value here is a gap in the table: `arguments` says so by raising `NoExampleError`.
"""

import dataclasses
import functools
import inspect
import tempfile
from typing import Any

import numpy as np

import hybrid_rt as hrt
import hybrid_rt_scenes as hrs
from support import soup


class NoExampleError(Exception):
    """The table has no value for a required parameter."""


@functools.cache
def scratch():
    return tempfile.TemporaryDirectory()


@functools.cache
def scene():
    return soup.random_scene(np.random.default_rng(5), 24)


@functools.cache
def camera():
    return hrt.Camera.look_at((0, 0, 6), (0.1, 0, 0), width=12, height=9, near=0.05)


@functools.cache
def flat():
    return hrt.Camera.orthographic(
        (0, 0, 6), (0.1, 0, 0), view_height=5, width=12, height=9, near=0.05, far=15
    )


@functools.cache
def gbuffer():
    return hrt.rasterize(scene(), camera())


@functools.cache
def rays():
    return hrt.mirror_rays(gbuffer())


@functools.cache
def screen():
    return hrt.prepare(gbuffer(), "certified")


@functools.cache
def marched():
    return hrt.march(rays(), screen())


@functools.cache
def tracer():
    return hrt.EmbreeTracer(scene(), threads=1)


@functools.cache
def hits():
    return tracer().intersect(rays())


@functools.cache
def truth():
    return hrt.Truth(scene())


@functools.cache
def hybrid():
    return hrt.trace_hybrid(rays(), screen(), tracer())


@functools.cache
def occlusion():
    return hrt.occluded_hybrid(rays(), screen(), tracer())


@functools.cache
def judged():
    return hrt.judge(rays(), hits(), np.ones(len(rays()), bool), hits(), scene(), camera())


INSTANCES = {
    "Scene": scene,
    "Pinhole": camera,
    "Orthographic": flat,
    "GBuffer": gbuffer,
    "Rays": rays,
    "Screen": screen,
    "Marched": marched,
    "EmbreeTracer": tracer,
    "BruteForceTracer": lambda: hrt.BruteForceTracer(scene()),
    "Hits": hits,
    "Truth": truth,
    "Nearest": lambda: truth().nearest(rays()),
    "HybridResult": hybrid,
    "OcclusionResult": occlusion,
    "Judged": judged,
    "Compiling": lambda: hrt.Compiling("raster.tiles.draw_tiles", "the raster", 1, 5, 2.5),
    "Point": lambda: hrt.Point("4 samples", hrt.Paper()),
    "Rate": lambda: hrt.Rate.of(3, 10),
    "Registry": lambda: hrt.TECHNIQUES,
    "Share": lambda: hrt.Share(0.01),
    "Mesh": lambda: hrt.Mesh.from_arrays(scene().vertices, scene().faces),
    "PointLight": lambda: hrt.PointLight((0, 4, 4)),
    "AreaLight": lambda: hrt.AreaLight((0, 4, 4), (1, 0, 0), (0, 0, 1)),
    "DirectionalLight": lambda: hrt.DirectionalLight((0, 1, 0)),
    "DepthPyramid": lambda: hrt.build_depth_pyramid(gbuffer()),
    "SlopePyramid": lambda: hrt.build_slope_pyramid(gbuffer()),
    "PrimitiveLists": lambda: screen().data.lists,
    "MarchWork": lambda: marched().work,
}
"""One object of each public class that cannot be made without arguments."""


def _faces():
    return np.array([[0, 1, 2], [2, 1, 3]], np.int32)


def _vertices():
    return np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0.5]], np.float32)


def _ones():
    return np.ones(len(rays()), bool)


VALUES = {
    "scene": scene,
    "camera": camera,
    "gbuffer": gbuffer,
    "rays": rays,
    "screen": screen,
    "tracer": tracer,
    "truth": truth,
    "judged": judged,
    "technique": lambda: "certified",
    "light": lambda: hrt.AreaLight((0, 4, 4), (1, 0, 0), (0, 0, 1)),
    "v": _vertices,
    "f": _faces,
    "vertices": _vertices,
    "eye": lambda: (0, 0, 6),
    "target": lambda: (0, 0, 0),
    "origin": lambda: np.zeros((len(rays()), 3), np.float32),
    "direction": lambda: rays().direction,
    "points_w": _vertices,
    "points_px": lambda: np.array([[1.5, 2.5, 0.25], [0.5, 0.5, 0.5]]),
    "x": lambda: np.array([1.5, 2.5]),
    "y": lambda: np.array([0.5, 7.0]),
    "depth": lambda: np.array([0.25, 1.0]),
    "z_view": lambda: np.array([0.5, 3.0]),
    "length": lambda: 0.5,
    "view_height": lambda: 5.0,
    "far": lambda: 15.0,
    "view": lambda: np.eye(4),
    "projection": lambda: np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, -1, -0.1], [0, 0, -1, 0]]),
    "K": lambda: np.array([[9, 0, 6], [0, 9, 4], [0, 0, 1]]),
    "R": lambda: np.diag([1, -1, -1]),
    "width": lambda: 12,
    "height": lambda: 9,
    "factor": lambda: 1.5,
    "roughness": lambda: 0.3,
    "radius": lambda: 1.0,
    "resolved": _ones,
    "claimed": hits,
    "reference": hits,
    "hits": lambda: tracer().intersect(rays()),
    "occluded": lambda: np.zeros(len(rays()), bool),
    "values": hits,
    "indices": lambda: np.arange(len(rays()), dtype=np.int32),
    "index": lambda: 0,
    "n": lambda: 4,
    "prim_id": lambda: np.zeros(len(rays()), np.int32),
    "t": lambda: np.ones(len(rays())),
    "count": lambda: 3,
    "total": lambda: 10,
    "low": lambda: 0.1,
    "high": lambda: 0.6,
    "path": lambda: "nowhere.npz",
    "meshes": lambda: [INSTANCES["Mesh"]()],
    "mesh_or_scene": lambda: INSTANCES["Mesh"](),
    "callback": lambda: None,
    "position": lambda: (0, 4, 4),
    "corner": lambda: (0, 4, 4),
    "edge_u": lambda: (1, 0, 0),
    "edge_v": lambda: (0, 0, 1),
    "which": lambda: "all",
    "name": lambda: "certified",
    "thing": lambda: hrt.Paper,
    "argument": lambda: "hits",
    "t_near": lambda: np.zeros(len(rays()), np.float32),
    "what": lambda: "technique",
    "group": lambda: "hybrid_rt.nothing",
    "key": lambda: "certified",
    "other": scene,
    "size": lambda: len(rays()),
    "faces": _faces,
    "value": lambda: 0.005,
}
"""A value for each required parameter, by name; optional ones keep their defaults."""

SPECIAL = {
    ("DirectionalLight", "direction"): lambda: (0, 1, 0),
    ("occluded_hybrid", "reference"): _ones,
    ("judge_occlusion", "claimed"): _ones,
    ("judge_occlusion", "reference"): _ones,
    ("TRACERS.__getitem__", "name"): lambda: "brute",
    ("TRACERS.check", "thing"): lambda: hrt.BruteForceTracer,
    ("TRACERS.register", "thing"): lambda: hrt.BruteForceTracer,
    **{(f"{kind}.from_intrinsics", "t"): lambda: (0, 0, 6) for kind in ("Pinhole", "Orthographic")},
    ("Point", "technique"): hrt.Paper,
    ("Screen.of", "technique"): hrt.Certified,
    ("Rays.take", "index"): lambda: np.arange(3),
    ("Hits.put", "index"): lambda: np.arange(len(rays())),
    ("Hits.checked", "n"): lambda: len(rays()),
    ("Hits.checked", "faces"): lambda: len(scene()),
    ("Marched.checked", "n"): lambda: len(rays()),
    ("Marched.checked", "faces"): lambda: len(scene()),
    ("save_cameras", "path"): lambda: f"{scratch().name}/views.toml",
    ("save_cameras", "cameras"): lambda: {"a": camera()},
    ("load_cameras", "path"): lambda: hrs.registry.DEFINITIONS / "sphere.toml",
    ("GBuffer.from_arrays", "depth"): lambda: 1.0 - gbuffer().depth,
    ("GBuffer.from_arrays", "kind"): lambda: "standard",
    ("GBuffer.from_arrays", "origin"): lambda: "top",
    ("Scene.from_arrays", "name"): lambda: "scene",
    ("Scene.from_meshes", "name"): lambda: "scene",
}
"""Values for one parameter of one callable, where the name alone does not tell."""


def instance(name: str) -> Any:
    """Return an object of the public class of that name."""
    if name in INSTANCES:
        return INSTANCES[name]()
    thing = getattr(hrt, name)
    return thing() if inspect.isclass(thing) else thing


def _of_fields(cls: type) -> dict[str, Any] | None:
    """Return what a dataclass is made of: the fields of an object of it."""
    if not dataclasses.is_dataclass(cls) or cls.__name__ not in INSTANCES:
        return None
    whole = INSTANCES[cls.__name__]()
    return {f.name: getattr(whole, f.name) for f in dataclasses.fields(cls) if f.init}


def _is_technique(thing: Any) -> bool:
    return inspect.isclass(thing) and issubclass(thing, hrt.Technique)


def arguments(label: str, function: Any) -> dict[str, Any]:
    """Return valid arguments for a callable, by parameter; defaults where there is no value."""
    if inspect.isclass(function) and (fields := _of_fields(function)) is not None:
        return fields
    found = {}
    for parameter in inspect.signature(function).parameters.values():
        if parameter.kind in (parameter.VAR_POSITIONAL, parameter.VAR_KEYWORD):
            continue
        value = SPECIAL.get((label, parameter.name))
        owner = getattr(hrt, label.partition(".")[0])
        if parameter.name == "screen" and owner is not hrt.Technique and _is_technique(owner):
            value = functools.partial(hrt.prepare, gbuffer(), owner())
        if value is None and parameter.default is parameter.empty:
            value = VALUES.get(parameter.name)
            if value is None:
                raise NoExampleError(f"{label}: a value for {parameter.name!r}")
        found[parameter.name] = parameter.default if value is None else value()
    return found
