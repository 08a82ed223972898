"""What is done with an object that a call has given back: it must hold, or be refused by name."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import hybrid_rt as hrt
from support.fuzz import examples as of


def _scene(scene: hrt.Scene) -> None:
    hrt.rasterize(scene, of.camera())
    hrt.EmbreeTracer(scene, threads=1).intersect(of.rays())
    hrt.Truth(scene, threads=1).nearest(of.rays().take(slice(0, 3)))


def _camera(camera: hrt.Camera) -> None:
    if camera.width * camera.height <= 1 << 20:
        buffer = hrt.rasterize(of.scene(), camera)
        hrt.march(hrt.mirror_rays(buffer), hrt.prepare(buffer, "certified"))


def _gbuffer(buffer: hrt.GBuffer) -> None:
    rays = hrt.mirror_rays(buffer)
    for name in hrt.TECHNIQUES:
        hrt.march(rays, hrt.prepare(buffer, name))


def _rays(rays: hrt.Rays) -> None:
    for name in hrt.TECHNIQUES:
        hrt.march(rays, hrt.prepare(of.gbuffer(), name))
    hrt.trace_hybrid(rays, of.screen(), of.tracer())
    of.truth().nearest(rays.take(slice(0, 3)))


def _screen(screen: hrt.Screen) -> None:
    hrt.march(of.rays(), screen)
    hrt.trace_hybrid(of.rays(), screen, of.tracer())


def _technique(technique: hrt.Technique) -> None:
    hrt.march(of.rays(), hrt.prepare(of.gbuffer(), technique))


def _tracer(tracer: Any) -> None:
    hrt.trace_hybrid(of.rays(), of.screen(), tracer)
    tracer.occluded(of.rays())


def _hits(hits: hrt.Hits) -> None:
    every = [True] * len(of.rays())
    hrt.judge(of.rays(), hits, every, of.hits(), of.scene(), of.camera())


def _light(light: hrt.Light) -> None:
    hrt.shadow_rays(of.gbuffer(), light)


def _mesh(mesh: hrt.Mesh) -> None:
    _scene(hrt.Scene.from_meshes([mesh]))


def _judged(judged: hrt.Judged) -> None:
    hrt.rates(judged)


def _rate(rate: hrt.Rate) -> None:
    float(rate.value)


USES: dict[str, Callable[[Any], None]] = {
    "Scene": _scene,
    "Pinhole": _camera,
    "Orthographic": _camera,
    "GBuffer": _gbuffer,
    "Rays": _rays,
    "Screen": _screen,
    "EmbreeTracer": _tracer,
    "BruteForceTracer": _tracer,
    "Hits": _hits,
    "Judged": _judged,
    "Mesh": _mesh,
    "Rate": _rate,
    "PointLight": _light,
    "AreaLight": _light,
    "DirectionalLight": _light,
}


def use(result: Any) -> None:
    """Use a public object as its kind is used; anything else is left alone."""
    name = type(result).__name__
    if name in USES:
        USES[name](result)
    elif isinstance(result, hrt.Technique):
        _technique(result)
