"""Triangles without order, rays among them and views of them, for the certified march."""

import numpy as np

import hybrid_rt as hrt


def random_scene(rng, n, *, spread=3.0, sliver=0.3):
    """Return triangles before, behind and across the eye's plane, slivers and near-points."""
    centre = rng.uniform(-spread, spread, (n, 1, 3)) * (1, 1, 1.5)
    corner = centre + rng.normal(size=(n, 3, 3)) * rng.choice([0.02, 0.3, 3.0], (n, 1, 1))
    thin = rng.random(n) < sliver
    corner[thin, 2] = corner[thin, 0] + (corner[thin, 1] - corner[thin, 0]) * rng.uniform(
        0, 1, (thin.sum(), 1)
    )
    corner[thin, 2] += rng.normal(size=(thin.sum(), 3)) * 1e-5
    return hrt.Scene.from_arrays(corner.reshape(-1, 3), np.arange(3 * n).reshape(n, 3))


def random_rays(rng, scene, camera, n):
    """Return rays from visible surfaces and from anywhere before the camera, some with limits."""
    gbuffer = hrt.rasterize(scene, camera)
    mirror = hrt.mirror_rays(gbuffer)
    place = rng.uniform((-0.1, -0.1, 0.01), (1.1, 1.1, 0.9), (n, 3))
    place[:, :2] *= (camera.width, camera.height)
    origin = hrt.unproject(camera, place)
    direction = rng.normal(size=(n, 3))
    direction[rng.random((n, 3)) < 0.1] = 0.0
    direction[(direction == 0).all(axis=1)] = (1, 0, 0)
    if len(mirror):
        pick = rng.integers(0, len(mirror), n)
        on_surface = rng.random(n) < 0.6
        origin[on_surface] = mirror.origin[pick[on_surface]]
        mirrored = rng.random(n) < 0.3
        direction[on_surface & mirrored] = mirror.direction[pick[on_surface & mirrored]]
    t_near = np.where(rng.random(n) < 0.3, rng.uniform(0, 1, n), 1e-4)
    t_far = np.where(rng.random(n) < 0.3, t_near + rng.uniform(0, 6, n), np.inf)
    return hrt.Rays.from_arrays(origin, direction, None, t_near, t_far)


FORMS = (
    {"cell": 4},
    {"guard": 2.0},
    {"cell": 3, "guard": 1.7},
    {"cell": 64},
    {"cell": 2, "guard": 8.0},
)
"""Lists in other pixels than those of the screen: coarse, wide, both, one for everything."""
