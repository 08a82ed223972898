"""Set up, march and write, one ray after the other."""

import numpy as np

import hybrid_rt as hrt
from naive.stepping.compiled import inlined
from naive.stepping.dda import dda_ray
from naive.stepping.hiz import hiz_ray
from naive.stepping.linear import linear_ray
from naive.stepping.paper import paper_ray
from naive.stepping.screen import screen_ray, write_row
from naive.stepping.slope import slope_ray


def _loop(march_ray):
    march_ray = inlined(march_ray)

    @inlined
    def loop(rays, view, buffers, pyramid, numbers, out, steps_by_level):
        height, width = buffers.depth.shape
        for i in range(len(rays.t_near)):
            ray, scale = screen_ray(i, rays, view, width, height)
            row = ray.status, False, -1, -1, np.float32(0.0), np.float32(0.0), 0
            if ray.s_end >= 0.0:
                own_x, own_y = rays.pixel[i, 0], rays.pixel[i, 1]
                row = march_ray(numbers, buffers, pyramid, ray, own_x, own_y, steps_by_level)
            write_row(i, row, ray, scale, rays, buffers.prim_id, out)

    return loop


LOOPS = {
    "paper": _loop(paper_ray),
    "slope": _loop(slope_ray),
    "hiz": _loop(hiz_ray),
    "dda": _loop(dda_ray),
    "linear": _loop(linear_ray),
}


def march(rays, screen):
    """Return what a stepping technique says about each ray, and its steps by level (L,) int64."""
    technique, pyramid = screen.technique, screen.data
    marched = hrt.Marched.unfilled(len(rays))
    steps = np.zeros(1 if pyramid is None else len(pyramid), np.int64)
    LOOPS[technique.name](
        rays.arrays, screen.camera.arrays, screen.gbuffer.arrays,
        () if pyramid is None else pyramid.arrays, technique._numbers(screen), marched.arrays,
        steps,
    )  # fmt: skip
    if pyramid is None:
        steps[0] = marched.steps.sum()
    return marched, steps
