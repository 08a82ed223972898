"""Which rays are measured: what leaves the visible surfaces of a view."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

import hybrid_rt as hrt
from hybrid_rt.errors import UnknownNameError
from hybrid_rt_scenes import LightsSpec, SceneSpec, automatic_lights

OCCLUSION_REACH = 0.02
"""Length of ambient-occlusion rays, as a share of the diagonal of the scene's bounds."""

Make = Callable[[SceneSpec | None, hrt.GBuffer, int], hrt.Rays]


@dataclass(frozen=True)
class Workload:
    """Rays that a renderer asks for.

    Attributes
    ----------
    name : str
    description : str
    any_hit : bool
        Whether it is only asked if a ray meets anything (`occluded_hybrid`), and not what it meets
        first (`trace_hybrid`).
    make : function of a SceneSpec, a GBuffer of that scene, and a seed
        Returns the rays. Without a SceneSpec, and then also without a mesh, only what is in
        `MESHLESS`.
    """

    name: str
    description: str
    any_hit: bool
    make: Make


def _mirror(spec: SceneSpec | None, gbuffer: hrt.GBuffer, seed: int) -> hrt.Rays:
    return hrt.mirror_rays(gbuffer)


def _glossy(roughness: float) -> Workload:
    def make(spec: SceneSpec | None, gbuffer: hrt.GBuffer, seed: int) -> hrt.Rays:
        return hrt.glossy_rays(gbuffer, roughness, seed)

    text = f"Reflections at GGX microfacets of roughness {roughness} (alpha {roughness**2:.2g})"
    return Workload(f"glossy_{roughness}", text, False, make)


def _diffuse(spec: SceneSpec | None, gbuffer: hrt.GBuffer, seed: int) -> hrt.Rays:
    return hrt.diffuse_rays(gbuffer, seed)


def _ambient_occlusion(spec: SceneSpec | None, gbuffer: hrt.GBuffer, seed: int) -> hrt.Rays:
    low, high = gbuffer.bounds
    radius = OCCLUSION_REACH * float(np.linalg.norm(high - low))
    return hrt.ambient_occlusion_rays(gbuffer, radius, seed)


def _lights(spec: SceneSpec | None, gbuffer: hrt.GBuffer) -> LightsSpec:
    if spec is None:
        return automatic_lights(gbuffer.known_scene)
    return spec.lights_of(gbuffer.known_scene)


def _shadow_point(spec: SceneSpec | None, gbuffer: hrt.GBuffer, seed: int) -> hrt.Rays:
    return hrt.shadow_rays(gbuffer, _lights(spec, gbuffer).point_light, seed)


def _shadow_area(spec: SceneSpec | None, gbuffer: hrt.GBuffer, seed: int) -> hrt.Rays:
    return hrt.shadow_rays(gbuffer, _lights(spec, gbuffer).area_light, seed)


def _shadow_sun(spec: SceneSpec | None, gbuffer: hrt.GBuffer, seed: int) -> hrt.Rays:
    return hrt.shadow_rays(gbuffer, _lights(spec, gbuffer).directional_light, seed)


WORKLOADS = {
    workload.name: workload
    for workload in (
        Workload("mirror", "The mirror ray of every pixel", False, _mirror),
        _glossy(0.1),
        _glossy(0.3),
        _glossy(0.6),
        Workload("diffuse", "One bounce, weighted by the cosine", False, _diffuse),
        Workload(
            "ambient_occlusion",
            f"Diffuse rays of {OCCLUSION_REACH:.0%} of the scene's diagonal",
            True,
            _ambient_occlusion,
        ),
        Workload("shadow_point", "To the small lamp of the scene", True, _shadow_point),
        Workload("shadow_area", "To random points of its large lamp", True, _shadow_area),
        Workload("shadow_sun", "To its sun", True, _shadow_sun),
    )
}


MESHLESS = frozenset(name for name in WORKLOADS if not name.startswith("shadow_"))
"""The rays that need no mesh: all but those to the lights of a scene."""


def get_workload(name: str) -> Workload:
    """Return a registered workload.

    Raises
    ------
    UnknownNameError
        No such workload; with the nearest known one.
    """
    if name not in WORKLOADS:
        raise UnknownNameError("workload", name, WORKLOADS)
    return WORKLOADS[name]
