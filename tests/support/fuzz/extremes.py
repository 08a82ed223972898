"""Scenes, views and rays that are allowed and that nobody has: huge, tiny, flat, in one point."""

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np

import hybrid_rt as hrt

SIZES = (0.0, 1e-45, 1e-38, 1e-20, 1e-3, 1.0, 7.0, 1e3, 1e10, 1e18, 1e19, 1e30, 3e38)
"""Of numbers; around 1e19 squares leave float32."""


def numbers(rng: np.random.Generator, shape: tuple[int, ...]) -> np.ndarray:
    """Return numbers of one size, or of all at once, of either sign."""
    sizes = rng.choice(SIZES, shape) if rng.random() < 0.4 else np.full(shape, rng.choice(SIZES))
    factor = rng.choice([-1.0, -0.5, 0.0, 0.25, 1.0], shape)
    return np.clip(sizes * factor, -3.4e38, 3.4e38)


def scene(rng: np.random.Generator) -> hrt.Scene:
    """Return a scene of a few triangles, some without area."""
    vertices = int(rng.integers(3, 9))
    faces = rng.integers(0, vertices, (int(rng.integers(1, 7)), 3))
    return hrt.Scene.from_arrays(numbers(rng, (vertices, 3)), faces)


def camera(rng: np.random.Generator, seen: hrt.Scene) -> hrt.Camera:
    """Return a camera with a lens and a near plane of any size, most often before a scene."""
    width, height = (int(n) for n in rng.choice([1, 2, 3, 17, 64], 2))
    eye, target = numbers(rng, (3,)), numbers(rng, (3,))
    near = float(rng.choice([1e-30, 1e-3, 1.0, 1e10, 1e30]))
    if rng.random() < 0.7:
        target = seen.bounds.mean(axis=0)
        eye = target + seen.diagonal * rng.uniform(-2, 2, 3)
        near = float(rng.choice([1e-9, 1e-3, 0.3]) * (seen.diagonal or 1.0))
    size = {"width": width, "height": height}
    lens = {"aspect": 1.0, "shift_px": (0.0, 0.0)}
    if rng.random() < 0.5:
        lens["aspect"] = float(rng.choice([1e-6, 0.5, 1.0, 30.0]))
        lens["shift_px"] = tuple(rng.choice([-1e9, -300.5, 0.0, 7.0, 1e5], 2).tolist())
    if rng.random() < 0.4:
        deep = float(rng.choice([1e-3, 1.0, 5.0, 1e12]) * (seen.diagonal or 1.0))
        near = float(rng.choice([0.0, -1.0, 0.5]) * deep)
        shown = float(rng.choice([1e-6, 0.3, 1.0, 1e6]) * (seen.diagonal or 1.0))
        view = hrt.Camera.orthographic(
            eye, target, (0.1, 1, 0.2), view_height=shown, near=near, far=near + deep, **size
        )
        return dataclasses.replace(view, **lens)
    degrees = float(rng.choice([1e-3, 1.0, 60.0, 170.0, 179.99]))
    view = hrt.Camera.look_at(eye, target, (0.1, 1, 0.2), vfov_deg=degrees, near=near, **size)
    return dataclasses.replace(view, **lens)


def rays(rng: np.random.Generator, n: int = 40) -> hrt.Rays:
    """Return rays with limits of any size."""
    limits = np.sort(np.abs(numbers(rng, (2, n))), axis=0)
    if rng.random() < 0.5:
        limits[1] = np.inf
    return hrt.Rays.from_arrays(numbers(rng, (n, 3)), numbers(rng, (n, 3)), None, *limits)


def try_all(seed: int) -> None:
    """Do everything with one scene, one view and rays; what is refused by name is left out."""
    rng = np.random.default_rng(seed)

    def tried(call: Callable[..., Any], *arguments: Any, **others: Any) -> Any:
        if any(argument is None for argument in arguments):
            return None
        try:
            return call(*arguments, **others)
        except hrt.HybridRTError:
            return None

    place = scene(rng)
    eye = tried(camera, rng, place)
    tracer = tried(hrt.EmbreeTracer, place, threads=1)
    truth = tried(hrt.Truth, place)
    buffer = tried(hrt.rasterize, place, eye)
    every = [tried(rays, rng), tried(hrt.mirror_rays, buffer)]
    every.append(tried(hrt.ambient_occlusion_rays, buffer, 1.0))
    for some in every:
        found = tried(lambda r: tracer.intersect(r) if tracer else None, some)
        tried(lambda r: tracer.occluded(r) if tracer else None, some)
        tried(lambda r: truth.nearest(r) if truth else None, some)
        for name in hrt.TECHNIQUES:
            screen = tried(hrt.prepare, buffer, name)
            for any_hit in (False, True):
                tried(hrt.march, some, screen, any_hit=any_hit)
            result = tried(hrt.trace_hybrid, some, screen, tracer)
            tried(hrt.occluded_hybrid, some, screen, tracer)
            if result is not None and found is not None:
                tried(hrt.judge, some, result.hits, result.resolved, found, place, eye)
