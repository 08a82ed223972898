"""The hierarchical-Z march with a confidence, as AMD documents it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hybrid_rt.kernels import simd
from hybrid_rt.kernels._jit import inlined
from hybrid_rt.kernels.techniques.cells import (
    F0,
    F1,
    HALF,
    NONE,
    ZERO,
    Walk,
    begin_walk,
    behind_nearest,
    exits_of,
    limited,
    onwards,
    reading,
    within,
)
from hybrid_rt.kernels.techniques.driver import Answers, begins, finishes, steps
from hybrid_rt.kernels.techniques.placing import LANES
from hybrid_rt.kernels.techniques.screen import EXHAUSTED, HIDDEN, HIT, MISS


class HiZNumbers(NamedTuple):
    """Parameters of `hybrid_rt.HiZ`; `thickness` in world units.

    unit: the near plane's distance or, with `parallel` lines of sight, that of far and near plane.
    Last the pyramid's `raster.pyramid.bits` and its last level.
    """

    thickness: float
    unit: float
    parallel: bool
    threshold: float
    border: float
    exhausted_hits: bool
    trace_background: bool
    max_steps: int
    bits: tuple[int, int]
    top: int


begins(HiZNumbers)(begin_walk)


@steps(HiZNumbers)
def hiz_step(numbers, buffers, pyramid, kept, state, active, counts):
    """Take a step, as `driver.step`."""
    height, width = buffers.depth.shape
    line, level, s = state.line, state.level, state.s
    cell = exits_of(line, state.cx, state.cy, level)
    reads, tired, taken = reading(state, active, numbers.max_steps, counts)
    nearest, blocked = behind_nearest(state, cell, reads, pyramid, numbers.bits)
    # In front at its entry: it meets the cell's depth on its way away from the eye.
    above = blocked & (line.z + line.dz * s > nearest)
    s = simd.select(above, limited((nearest - line.z) / line.dz, s, simd.maximum(cell.s, s)), s)
    arrived = active & ~blocked & ~tired & (cell.s >= line.s_end)
    place = simd.select(above, s, line.s_end)
    left, up = line.inv_x < F0, line.inv_y < F0
    x = within(line.x + line.dx * place, cell.x, level, state.cx, cell.right, left)
    y = within(line.y + line.dy * place, cell.y, level, state.cy, cell.down, up)
    x, y = simd.select(above | arrived, x, state.cx), simd.select(above | arrived, y, state.cy)
    moved = Walk(
        line, x, y, level, state.status, s, state.sampled, state.steps, state.sideways, state.own
    )
    return onwards(moved, cell, active, blocked, tired, taken, 1, numbers.top, width, height, HIT)


@inlined
def smoothstep(x):
    """Return the cubic that rises from 0 at 0 to 1 at 1 and is level there."""
    x = limited(x, F0, F1)
    return x * x * (np.float32(3.0) - (x + x))


@inlined
def fade(place, size, margin):
    """Return the vignette of one axis, 0 at either side of the image to 1 from `margin` on."""
    if margin <= F0:
        return simd.f32(1.0, LANES)
    return smoothstep(simd.minimum(np.float32(size) - place, place) / margin)


@inlined
def faces_ray(i, j, surface, asked, buffers, line, parallel):
    """Return whether the planes of pixels (i, j) are seen from the side that the rays come from.

    In homogeneous screen space the plane is ``q_d - (a q_x + b q_y + c q_w) = 0``, positive towards
    the viewer. Along the ray of a pinhole, where q_d = near, it falls if
    ``a dx + b dy - dz (c + a x0 + b y0) / z0 > 0``; of parallel lines of sight, where q_w = 1, if
    ``a dx + b dy - dz > 0``.
    """
    at = j * np.int32(buffers.depth.shape[1]) + i
    a = simd.gather(buffers.ddx, at, asked, F0)
    b = simd.gather(buffers.ddy, at, asked, F0)
    if parallel:
        return a * line.dx + b * line.dy > line.dz
    out_x, out_y = line.x - simd.to_f32(i) - HALF, line.y - simd.to_f32(j) - HALF
    plane = surface + a * out_x + b * out_y
    return line.z * (a * line.dx + b * line.dy) > line.dz * plane


@inlined
def confidence(i, j, s, surface, asked, buffers, line, numbers):
    """Return how far stops at s in pixels (i, j) are to be trusted, 0 to 1."""
    height, width = buffers.depth.shape
    unit, margin = np.float32(numbers.unit), np.float32(numbers.border * height)
    parallel = numbers.parallel
    ray = line.z + line.dz * s
    if parallel:
        apart = simd.absolute(ray - surface) * unit
    else:
        apart = simd.absolute(unit / ray - unit / surface)
    vignette = fade(line.x + line.dx * s, width, margin) * fade(
        line.y + line.dy * s, height, margin
    )
    trust = (F1 - smoothstep(apart / np.float32(numbers.thickness))) * vignette
    seen = (ray > F0) & (surface > F0) & faces_ray(i, j, surface, asked, buffers, line, parallel)
    return simd.select(asked & seen, trust, F0)


@finishes(HiZNumbers)
def hiz_finish(numbers, buffers, pyramid, kept, state, done):
    """Finish rays, as `driver.finish`."""
    height, width = buffers.depth.shape
    how = state.status
    x = limited(state.cx, ZERO, np.int32(width - 1))
    y = limited(state.cy, ZERO, np.int32(height - 1))
    judged = how == HIT
    if numbers.exhausted_hits:
        judged = judged | (how == EXHAUSTED)
    judged = judged & done
    missed = done & (how == MISS)
    surface = simd.gather(buffers.depth, y * np.int32(width) + x, judged | missed, F0)
    background = (judged | missed) & (surface <= F0)
    judged = judged & ~background
    trust = confidence(x, y, state.s, surface, judged, buffers, state.line, numbers)
    trusted = judged & (simd.to_f64(trust) >= numbers.threshold)
    resolved = trusted
    if not numbers.trace_background:
        resolved = resolved | background
    status = simd.select(judged & ~trusted & (how == HIT), HIDDEN, how)
    s = simd.to_f64(state.s)
    return Answers(
        status, resolved, simd.select(trusted, x, NONE), simd.select(trusted, y, NONE), s, s,
        state.steps,
    )  # fmt: skip
