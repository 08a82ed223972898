"""The march of "Ray Tracing Algorithm Based on Screen Space Ray Marching"."""

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
    behind_nearest,
    exits_of,
    onwards,
    reading,
)
from hybrid_rt.kernels.techniques.driver import Answers, begins, finishes, steps
from hybrid_rt.kernels.techniques.screen import HIDDEN, HIT


class PaperNumbers(NamedTuple):
    """Parameters of `hybrid_rt.Paper`; the pyramid's `raster.pyramid.bits` and its last level."""

    samples: int
    max_steps: int
    bits: tuple[int, int]
    top: int


begins(PaperNumbers)(begin_walk)


@steps(PaperNumbers)
def paper_step(numbers, buffers, pyramid, kept, state, active, counts):
    """Take a step, as `driver.step`."""
    height, width = buffers.depth.shape
    cell = exits_of(state.line, state.cx, state.cy, state.level)
    reads, tired, taken = reading(state, active, numbers.max_steps, counts)
    _, blocked = behind_nearest(state, cell, reads, pyramid, numbers.bits)
    return onwards(
        state, cell, active, blocked, tired, taken, numbers.samples, numbers.top, width, height,
        BLOCKED,
    )  # fmt: skip


@inlined
def tilted_plane_s(i, j, asked, buffers, line):
    """Return the s at which rays meet the planes of pixels (i, j) inside these, or -1.

    The pixel is the plane ``depth + ddx (x - i - 1/2) + ddy (y - j - 1/2)``; the ray must reach it
    from the observer's side. Paper: "Correct".
    """
    none = np.float32(-1.0)
    at = j * np.int32(buffers.depth.shape[1]) + i
    centre = simd.gather(buffers.depth, at, asked, F0)
    a = simd.gather(buffers.ddx, at, asked, F0)
    b = simd.gather(buffers.ddy, at, asked, F0)
    right, left = line.inv_x > F0, line.inv_x < F0
    down, up = line.inv_y > F0, line.inv_y < F0
    enters = (simd.to_f32(i + simd.to_i32(left)) - line.x) * line.inv_x
    leaves = (simd.to_f32(i + simd.to_i32(right)) - line.x) * line.inv_x
    first = simd.select(right | left, simd.maximum(enters, F0), F0)
    last = simd.select(right | left, simd.minimum(leaves, line.s_end), line.s_end)
    enters = (simd.to_f32(j + simd.to_i32(up)) - line.y) * line.inv_y
    leaves = (simd.to_f32(j + simd.to_i32(down)) - line.y) * line.inv_y
    first = simd.select(down | up, simd.maximum(enters, first), first)
    last = simd.select(down | up, simd.minimum(leaves, last), last)
    # Height of the ray in front of the plane, linear in s: h(s) = h0 + s * hs.
    out_x, out_y = line.x - simd.to_f32(i) - HALF, line.y - simd.to_f32(j) - HALF
    h0 = line.z - (centre + a * out_x + b * out_y)
    hs = line.dz - (a * line.dx + b * line.dy)
    in_front = h0 + first * hs
    behind = h0 + last * hs
    met = first + (last - first) * (in_front / (in_front - behind))
    met = simd.select(in_front == behind, first, met)
    off = (in_front < F0) | (behind > F0) | (last < first)
    return simd.select(asked & (centre > F0) & ~off, met, none)


@finishes(PaperNumbers)
def paper_finish(numbers, buffers, pyramid, kept, state, done):
    """Finish rays, as `driver.finish`."""
    line = state.line
    blocked = done & (state.status == BLOCKED)
    x, y = state.cx, state.cy
    hit = tilted_plane_s(x, y, blocked, buffers, line)
    # Then the pixel that the ray has come from.
    second = blocked & (hit < F0) & (state.s > F0)
    back_x = simd.to_i32(line.inv_x < F0) - simd.to_i32(line.inv_x > F0)
    back_y = simd.to_i32(line.inv_y < F0) - simd.to_i32(line.inv_y > F0)
    before_x = simd.select(state.sideways, x + back_x, x)
    before_y = simd.select(state.sideways, y, y + back_y)
    second = second & ~((before_x == kept.own_x) & (before_y == kept.own_y))
    hit = simd.select(second, tilted_plane_s(before_x, before_y, second, buffers, line), hit)
    x, y = simd.select(second, before_x, x), simd.select(second, before_y, y)
    answers = blocked & ~(hit < F0)
    status = simd.select(blocked, HIDDEN, state.status)
    return Answers(
        simd.select(answers, HIT, status), answers, simd.select(answers, x, NONE),
        simd.select(answers, y, NONE), simd.to_f64(hit),
        simd.to_f64(simd.select(answers, simd.minimum(hit, state.s), state.s)), state.steps,
    )  # fmt: skip
