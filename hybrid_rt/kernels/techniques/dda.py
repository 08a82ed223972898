"""The perspective-correct pixel DDA of "Efficient GPU Screen-Space Ray Tracing".

On the screen x, y and depth are linear in s, so equal steps of s are equal steps of pixels and, for
a pinhole, 1 / z_view is interpolated, as the paper has it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hybrid_rt.kernels import simd
from hybrid_rt.kernels.techniques.cells import (
    F0,
    F1,
    HALF,
    ONE,
    limited,
    lines_of,
    pixel_of,
    slab_bottom,
)
from hybrid_rt.kernels.techniques.driver import Answers, begins, finishes, steps
from hybrid_rt.kernels.techniques.placing import LANES
from hybrid_rt.kernels.techniques.screen import EXHAUSTED, HIDDEN, HIT

FAR = np.float32(1e37)  # an s beyond all others that can still be doubled


class PixelDDANumbers(NamedTuple):
    """Parameters of `hybrid_rt.PixelDDA`; `slab_a`, `slab_b`: see `cells.slab_bottom`."""

    slab_a: float
    slab_b: float
    stride: int
    jitter: float
    max_steps: int


class Samples(NamedTuple):
    """Rays that are sampled: their line, end and step in s; what is free, the hit, how they ended.

    number, of the next sample, first, where its interval begins, s_hit, s_free, f32; i, j, steps,
    status i32; passed, where a ray has gone behind a surface, a mask.
    """

    line: object
    s_end: object
    step: object
    number: object
    first: object
    s_hit: object
    s_free: object
    i: object
    j: object
    steps: object
    status: object
    passed: object


@begins(PixelDDANumbers)
def dda_begin(numbers, buffers, pyramid, rays, kept):
    """Begin rays, as `driver.begin`."""
    line = lines_of(rays)
    # A ray straight towards or away from the eye stays in its pixel: one sample is all of it.
    longer = simd.maximum(simd.absolute(line.dx), simd.absolute(line.dy))
    step = simd.minimum(np.float32(numbers.stride) / longer, FAR)
    number, zero = simd.f32(numbers.jitter, LANES), simd.f32(0.0, LANES)
    nothing, none = simd.i32(0, LANES), simd.i32(-1, LANES)
    return Samples(
        line, simd.minimum(line.s_end, FAR), step, number, zero, zero, zero, none, none, nothing,
        kept.status, simd.mask(False, LANES),
    )  # fmt: skip


@steps(PixelDDANumbers)
def dda_step(numbers, buffers, pyramid, kept, state, active, counts):
    """Take a sample, as `driver.step`."""
    height, width = buffers.depth.shape
    line, first, s_end = state.line, state.first, state.s_end
    active = active & (first < s_end)
    at = simd.minimum(state.number * state.step, s_end)
    last = simd.minimum((state.number + HALF) * state.step, s_end)
    i = pixel_of(line.x + line.dx * at, width)
    j = pixel_of(line.y + line.dy * at, height)
    # The pixel that a ray starts from is not compared with itself.
    reads = active & ~((i == kept.own_x) & (j == kept.own_y))
    tired = reads & (state.steps == np.int32(numbers.max_steps))
    active, reads = active & ~tired, reads & ~tired
    surface = simd.gather(buffers.depth, j * np.int32(width) + i, reads, F0)
    a, b = line.z + line.dz * first, line.z + line.dz * last
    behind = reads & (surface > F0) & (simd.minimum(b, a) <= surface)
    bottom = slab_bottom(surface, np.float32(numbers.slab_a), np.float32(numbers.slab_b))
    hit = behind & (simd.maximum(b, a) >= bottom)
    # Where in the interval the ray's depth is nearest to the surface's.
    met = limited((surface - line.z) / line.dz, first, last)
    met = simd.select(line.dz == F0, first, met)
    passed = state.passed | (behind & ~hit)
    active = active & ~hit
    status = simd.select(tired, EXHAUSTED, simd.select(hit, HIT, state.status))
    first = simd.select(active, last, first)
    after = Samples(
        line, s_end, state.step, state.number + F1, first, simd.select(hit, met, state.s_hit),
        simd.select(active & ~passed, last, state.s_free), simd.select(hit, i, state.i),
        simd.select(hit, j, state.j), simd.select(reads, state.steps + ONE, state.steps), status,
        passed,
    )  # fmt: skip
    return after, active & (first < s_end)


@finishes(PixelDDANumbers)
def dda_finish(numbers, buffers, pyramid, kept, state, done):
    """Finish rays, as `driver.finish`."""
    hit = state.i >= 0
    through = ~hit & (state.status != EXHAUSTED)
    status = simd.select(through & state.passed, HIDDEN, state.status)
    s_free = simd.select(through & ~state.passed, state.s_end, state.s_free)
    return Answers(
        status, hit, state.i, state.j, simd.to_f64(state.s_hit), simd.to_f64(s_free), state.steps
    )
