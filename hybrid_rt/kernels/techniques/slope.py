"""The paper's march over planes that bound tilted pixels."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hybrid_rt.kernels import simd
from hybrid_rt.kernels._jit import inlined
from hybrid_rt.kernels.techniques.cells import (
    BLOCKED,
    F0,
    HALF,
    NONE,
    begin_walk,
    cells_of,
    exits_of,
    onwards,
    reading,
)
from hybrid_rt.kernels.techniques.driver import Answers, begins, finishes, steps
from hybrid_rt.kernels.techniques.placing import LANES
from hybrid_rt.kernels.techniques.screen import HIDDEN, HIT

# A ray that enters a pixel on its plane may come out behind it by rounding: of the depth and of the
# plane's value, some half-ulps each, and of the place on the screen, a half-ulp of the coordinate
# times the slope for the ray's product, its sum and the plane's centre.
ROUNDING = np.float32(2.0**-22)


class SlopeNumbers(NamedTuple):
    """Parameters of `hybrid_rt.SlopeAware`; the pyramid's `raster.pyramid.bits`, its last level."""

    samples: int
    max_steps: int
    bits: tuple[int, int]
    top: int


begins(SlopeNumbers)(begin_walk)


@inlined
def plane_of(pyramid, numbers, walk, cell, m):
    """Return the planes of cells: depth at the centre, slopes, and the centre."""
    at = cells_of(walk.level, cell.x, cell.y, numbers.bits) * np.int32(3)
    half = HALF * simd.to_f32(simd.i32(1, LANES) << walk.level)
    return (
        simd.gather(pyramid.cells, at, m, F0),
        simd.gather(pyramid.cells, at + np.int32(1), m, F0),
        simd.gather(pyramid.cells, at + np.int32(2), m, F0),
        simd.to_f32(cell.x << walk.level) + half,
        simd.to_f32(cell.y << walk.level) + half,
    )


@inlined
def height_above(plane, line, s):
    """Return how far the points of rays at s are in front of planes, and the rounding of that."""
    centre, slope_x, slope_y, centre_x, centre_y = plane
    x, y, z = line.x + line.dx * s, line.y + line.dy * s, line.z + line.dz * s
    out_x, out_y = slope_x * (x - centre_x), slope_y * (y - centre_y)
    size = simd.absolute(z) + simd.absolute(slope_x) * x + simd.absolute(slope_y) * y
    return z - (centre + out_x + out_y), ROUNDING * size


@steps(SlopeNumbers)
def slope_step(numbers, buffers, pyramid, kept, state, active, counts):
    """Take a step, as `driver.step`."""
    height, width = buffers.depth.shape
    cell = exits_of(state.line, state.cx, state.cy, state.level)
    s_exit = simd.maximum(cell.s, state.s)
    reads, tired, taken = reading(state, active, numbers.max_steps, counts)
    plane = plane_of(pyramid, numbers, state, cell, reads)
    entry, slack = height_above(plane, state.line, state.s)
    leave, _ = height_above(plane, state.line, s_exit)
    blocked = reads & ((entry < -slack) | (leave <= F0))
    return onwards(
        state, cell, active, blocked, tired, taken, numbers.samples, numbers.top, width, height,
        BLOCKED,
    )  # fmt: skip


@finishes(SlopeNumbers)
def slope_finish(numbers, buffers, pyramid, kept, state, done):
    """Finish rays, as `driver.finish`."""
    blocked = done & (state.status == BLOCKED)
    cell = exits_of(state.line, state.cx, state.cy, state.level)
    s_exit = simd.maximum(cell.s, state.s)
    plane = plane_of(pyramid, numbers, state, cell, blocked)
    entry, slack = height_above(plane, state.line, state.s)
    leave, _ = height_above(plane, state.line, s_exit)
    answers = blocked & ~(entry < -slack)
    entry = simd.maximum(entry, F0)
    s = state.s + (s_exit - state.s) * (entry / (entry - leave))
    s = simd.select(answers & (entry > leave), s, state.s)
    status = simd.select(blocked, HIDDEN, state.status)
    return Answers(
        simd.select(answers, HIT, status), answers, simd.select(answers, state.cx, NONE),
        simd.select(answers, state.cy, NONE), simd.to_f64(s), simd.to_f64(s), state.steps,
    )  # fmt: skip
