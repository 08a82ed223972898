"""The linear march in the world.

In units of w where the ray starts, which is z_view for a pinhole and 1 for parallel lines of sight,
the ray's length is u; with what w grows by along a direction of unit length, g, which is its cosine
with the camera's or 0, ``w(u) = w (1 + u g)``, so the screen parameter of `placing` is
``s = u / (1 + u g)``.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hybrid_rt.kernels import simd
from hybrid_rt.kernels.techniques.cells import F0, F1, HALF, ONE, ZERO, pixel_of, slab_bottom
from hybrid_rt.kernels.techniques.driver import Answers, begins, finishes, steps
from hybrid_rt.kernels.techniques.placing import LANES
from hybrid_rt.kernels.techniques.screen import EXHAUSTED, HIDDEN, HIT


class LinearNumbers(NamedTuple):
    """Parameters of `hybrid_rt.Linear`; `slab_a`, `slab_b`: see `cells.slab_bottom`.

    stride: in units of w where a ray starts.
    """

    slab_a: float
    slab_b: float
    stride: float
    refinements: int
    max_steps: int


class Strides(NamedTuple):
    """Rays that go by strides, scaled to unit length in float32, and what is known of them.

    low, high: u that a hit lies between; s_hit, s_free f32; i, j, the pixel of the hit, step, left,
    refinements to come, steps, status i32; passed, where a ray has gone behind a surface, and
    refining, where its hit is found, masks.
    """

    x: object
    y: object
    z: object
    dx: object
    dy: object
    dz: object
    cosine: object
    s_end: object
    low: object
    high: object
    s_hit: object
    s_free: object
    i: object
    j: object
    step: object
    left: object
    steps: object
    status: object
    passed: object
    refining: object


@begins(LinearNumbers)
def linear_begin(numbers, buffers, pyramid, rays, kept):
    """Begin rays, as `driver.begin`."""
    length = rays.length
    zero, nothing, none = simd.f32(0.0, LANES), simd.i32(0, LANES), simd.i32(-1, LANES)
    no = simd.mask(False, LANES)
    return Strides(
        simd.to_f32(rays.x), simd.to_f32(rays.y), simd.to_f32(rays.depth),
        simd.to_f32(rays.dx / length), simd.to_f32(rays.dy / length),
        simd.to_f32(rays.dz / length), simd.to_f32(rays.gw / length),
        simd.to_f32(rays.s_end * length), zero, zero, zero, zero, none, none, nothing,
        simd.i32(numbers.refinements, LANES), nothing, kept.status, no, no,
    )  # fmt: skip


@steps(LinearNumbers)
def linear_step(numbers, buffers, pyramid, kept, state, active, counts):
    """Take a step, or halve the last one, as `driver.step`."""
    height, width = buffers.depth.shape
    stride = np.float32(numbers.stride)
    refining = state.refining & active
    going = active & ~refining
    step = simd.select(going, state.step + ONE, state.step)
    u = simd.select(refining, HALF * (state.low + state.high), simd.to_f32(step) * stride)
    stretch = F1 + u * state.cosine
    s = u / stretch
    over = going & ((stretch <= F0) | ~(s < state.s_end))
    tired = going & ~over & (step > np.int32(numbers.max_steps))
    ended = over | tired
    looks = active & ~ended
    going = going & ~ended

    i = pixel_of(state.x + state.dx * s, width)
    j = pixel_of(state.y + state.dy * s, height)
    # The pixel that a ray starts from is not compared with itself.
    others = looks & ~((i == kept.own_x) & (j == kept.own_y))
    surface = simd.gather(buffers.depth, j * np.int32(width) + i, others, F0)
    depth = state.z + state.dz * s
    behind = others & (surface > F0) & ~(depth > surface)
    bottom = slab_bottom(surface, np.float32(numbers.slab_a), np.float32(numbers.slab_b))
    inside = behind & (depth >= bottom)

    found = going & inside
    passed = state.passed | (going & behind & ~inside)
    low = simd.select(found, u - stride, simd.select(refining & ~inside, u, state.low))
    left = simd.select(refining, state.left - ONE, state.left)
    refined = (refining | found) & (left == ZERO)
    status = simd.select(tired, EXHAUSTED, simd.select(inside, HIT, state.status))
    steps_now = simd.select(ended, step - ONE, step + np.int32(numbers.refinements))
    after = Strides(
        state.x, state.y, state.z, state.dx, state.dy, state.dz, state.cosine, state.s_end, low,
        simd.select(inside, u, state.high), simd.select(inside, s, state.s_hit),
        simd.select(going & ~inside & ~passed, s, state.s_free), simd.select(inside, i, state.i),
        simd.select(inside, j, state.j), step, left,
        simd.select(ended | refined, steps_now, state.steps), status, passed,
        state.refining | found,
    )  # fmt: skip
    return after, active & ~ended & ~refined


@finishes(LinearNumbers)
def linear_finish(numbers, buffers, pyramid, kept, state, done):
    """Finish rays, as `driver.finish`."""
    hit = state.refining
    through = ~hit & (state.status != EXHAUSTED)
    status = simd.select(through & state.passed, HIDDEN, state.status)
    s_free = simd.select(through & ~state.passed, state.s_end, state.s_free)
    return Answers(
        status, hit, state.i, state.j, simd.to_f64(state.s_hit) / kept.length,
        simd.to_f64(s_free) / kept.length, state.steps,
    )  # fmt: skip
