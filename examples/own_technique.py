"""A technique of your own, measured beside those that come with the library.

The paper's march guesses wrong mostly where it lands near an edge of what is visible. "careful"
keeps an answer of the paper only where the surface around the hit pixel goes on: fewer rays are
answered, and fewer of the answers are wrong. The tracer answers the other rays.

python examples/own_technique.py
"""

from dataclasses import dataclass

import numpy as np

import hybrid_rt as hrt
from hybrid_rt_scenes import get_scene


@hrt.register
@dataclass(frozen=True)
class Careful(hrt.Technique):
    """Ask the paper's march, and believe it away from edges."""

    name = "careful"
    description = "The paper's march, believed only where depth goes on around the hit pixel"

    jump: float = 0.02  # change of the distance to a neighbour that is an edge, as a share of it

    def _read(self, gbuffer, threads):
        depth = np.maximum(gbuffer.depth, 1e-30)
        edge = gbuffer.depth == 0
        for axis in (0, 1):
            for way in (1, -1):
                edge |= np.abs(np.log(np.roll(depth, way, axis) / depth)) > self.jump
        return hrt.prepare(gbuffer, "paper", threads=threads), edge

    def _march(self, rays, screen, any_hit, threads):
        paper, edge = screen.data
        marched = hrt.march(rays, paper, any_hit=any_hit, threads=threads)
        x, y = np.maximum(marched.pixel, 0).T
        doubtful = marched.resolved & edge[y, x]
        marched.resolved[doubtful] = False
        marched.status[doubtful] = hrt.MarchStatus.UNDECIDED
        marched.pixel[doubtful], marched.prim_id[doubtful] = -1, -1
        marched.t[doubtful] = np.inf
        return marched


place = get_scene("sphere")
scene, camera = place.load(), place.camera("close", 640, 360)
gbuffer = hrt.rasterize(scene, camera)
rays, tracer = hrt.mirror_rays(gbuffer), hrt.EmbreeTracer(scene)
reference, truth = tracer.intersect(rays), hrt.Truth(scene)
print(f"{len(rays)} mirror rays      answered    false hits among the answers")
for name in ("linear", "paper", "careful", "certified"):
    result = hrt.trace_hybrid(rays, hrt.prepare(gbuffer, name), tracer)
    found = (rays, result.hits, result.resolved, reference, scene, camera, result.pixel)
    rates = hrt.rates(hrt.judge(*found, truth=truth))
    print(f"{name:20} {rates['alpha'].value:10.1%} {rates['false_hit'].value:15.3%}")
