"""The cells of a pyramid and the way of rays through them, a ray in each lane."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import types
from numba.extending import overload

from hybrid_rt.kernels import simd
from hybrid_rt.kernels._jit import OPTIONS, inlined
from hybrid_rt.kernels.techniques.placing import LANES
from hybrid_rt.kernels.techniques.screen import EXHAUSTED, OFFSCREEN

F0 = np.float32(0.0)
F1 = np.float32(1.0)
HALF = np.float32(0.5)
ONE = np.int32(1)
ZERO = np.int32(0)
NONE = np.int32(-1)
INF = np.float32(np.inf)
BLOCKED = -1
"""Status of a ray that a pixel stops: how it ends is for `finish` to say."""


class Lines(NamedTuple):
    """Rays on the screen in float32: start, deltas, end.

    Borders are reached at ``s = (border - start) * inv + bias``. A delta of zero, or one so small
    that its reciprocal overflows, never reaches one: inv 0 and bias infinity say so without
    0 * infinity.
    """

    x: object
    y: object
    z: object
    dx: object
    dy: object
    dz: object
    s_end: object
    inv_x: object
    inv_y: object
    bias_x: object
    bias_y: object


class Exits(NamedTuple):
    """Cells (x, y) of a level and where rays leave them: through a vertical border at `at_x`..."""

    x: object
    y: object
    right: object
    down: object
    at_x: object
    at_y: object
    s: object


@inlined
def reciprocal(delta):
    """Return what `Lines` says of a delta: inv and bias."""
    inv = F1 / delta
    never = simd.absolute(inv) == INF
    return simd.select(never, F0, inv), simd.select(never, simd.f32(INF, LANES), F0)


@inlined
def lines_of(rays):
    """Return `placing.ScreenRays` as lines."""
    dx, dy = simd.to_f32(rays.dx), simd.to_f32(rays.dy)
    inv_x, bias_x = reciprocal(dx)
    inv_y, bias_y = reciprocal(dy)
    return Lines(
        simd.to_f32(rays.x), simd.to_f32(rays.y), simd.to_f32(rays.depth), dx, dy,
        simd.to_f32(rays.dz), simd.to_f32(rays.s_end), inv_x, inv_y, bias_x, bias_y,
    )  # fmt: skip


@inlined
def pixel_of(place, size):
    """Return the pixels of places on an axis of the screen; a place at its end is in the last."""
    return simd.minimum(simd.maximum(simd.to_i32(place), ZERO), np.int32(size - 1))


@inlined
def cells_of(level, x, y, bits):
    """Return the places of cells (x, y) of a level in a pyramid; see `raster.pyramid.layout`."""
    columns = simd.maximum(simd.i32(bits[0], LANES) - level, ZERO)
    rows = simd.maximum(simd.i32(bits[1], LANES) - level, ZERO)
    return (simd.i32(1, LANES) << (columns + rows)) + (y << columns) + x


@inlined
def exits_of(line, cx, cy, level):
    """Return the cells of a level that pixels (cx, cy) are in, and where the rays leave these."""
    lx, ly = cx >> level, cy >> level
    right, down = line.inv_x > F0, line.inv_y > F0
    edge_x = simd.to_f32((lx + simd.to_i32(right)) << level)
    edge_y = simd.to_f32((ly + simd.to_i32(down)) << level)
    at_x = (edge_x - line.x) * line.inv_x + line.bias_x
    at_y = (edge_y - line.y) * line.inv_y + line.bias_y
    s = simd.minimum(simd.minimum(at_x, at_y), line.s_end)
    return Exits(lx, ly, right, down, at_x, at_y, s)


@inlined
def within(place, cell, level, now, forward, backward):
    """Return the pixels of places in cells, not behind the pixels `now` that rays came from."""
    low = cell << level
    high = low + (simd.i32(1, LANES) << level) - ONE
    low = simd.select(forward, now, low)
    high = simd.select(backward, now, high)
    return simd.minimum(simd.maximum(simd.to_i32(place), low), high)


@inlined
def next_pixels(line, cell, level, s, cx, cy):
    """Return the pixels in which rays at s enter the next cells, and where through the side.

    (cx, cy) are the pixels in which they entered the cells that they leave.
    """
    through_side = cell.at_x < cell.at_y
    size = simd.i32(1, LANES) << level
    left, top = cell.x << level, cell.y << level
    along_x = within(line.x + line.dx * s, cell.x, level, cx, cell.right, line.inv_x < F0)
    along_y = within(line.y + line.dy * s, cell.y, level, cy, cell.down, line.inv_y < F0)
    beyond_x = simd.select(cell.right, left + size, left - ONE)
    beyond_y = simd.select(cell.down, top + size, top - ONE)
    x = simd.select(through_side, beyond_x, along_x)
    y = simd.select(through_side, along_y, beyond_y)
    return x, y, through_side


@inlined
def limited(value, low, high):
    """Return values limited to [low, high]; NaN stays."""
    return simd.select(value < low, low, simd.select(value > high, high, value))


@inlined
def slab_bottom(depth, a, b):
    """Return the depth at a thickness behind `depth`, along the view: (depth - b) / (1 + a depth).

    a, b: of the thickness, `hybrid_rt.camera.camera.Camera.receding`. For a pinhole that is
    ``near / (z_view + thickness)`` for ``depth = near / z_view``.
    """
    return (depth - b) / (F1 + depth * a)


class Walk(NamedTuple):
    """Rays on their way through a pyramid.

    line, `Lines`; cx, cy, the pixels in which they came into their cells, level, status, i32; s up
    to which nothing is in their way, f32; sampled, samples of this level, and steps, i32; sideways,
    where they came in through a vertical border, and own, where they have not left the pixel that
    they start on the surface of, masks.
    """

    line: object
    cx: object
    cy: object
    level: object
    status: object
    s: object
    sampled: object
    steps: object
    sideways: object
    own: object


def begin_walk(numbers, buffers, pyramid, rays, kept):
    """Begin rays, as `driver.begin`, for all techniques that walk through a pyramid.

    A ray on the visible surface of its own pixel leaves that pixel unread: the surface would only
    be compared with itself.
    """
    height, width = buffers.depth.shape
    line = lines_of(rays)
    cx, cy = pixel_of(line.x, width), pixel_of(line.y, height)
    own = (cx == kept.own_x) & (cy == kept.own_y)
    nothing, none = simd.i32(0, LANES), simd.mask(False, LANES)
    s = simd.f32(0.0, LANES)
    return Walk(line, cx, cy, nothing, kept.status, s, nothing, nothing, none, own)


@inlined
def reading(walk, active, max_steps, counts):
    """Return which lanes read their cell, which have no step left, and the steps with this one."""
    reads = active & ~walk.own
    tired = reads & (walk.steps == np.int32(max_steps))
    reads = reads & ~tired
    count_steps(counts, walk.level, reads)
    return reads, tired, simd.select(reads, walk.steps + ONE, walk.steps)


@inlined
def behind_nearest(walk, cell, reads, pyramid, bits):
    """Return the nearest depths of cells in a depth pyramid, and where these block rays."""
    line = walk.line
    at = cells_of(walk.level, cell.x, cell.y, bits)
    nearest = simd.gather(pyramid.cells, at, reads, F0)
    farthest_ray = line.z + line.dz * simd.select(line.dz < F0, cell.s, walk.s)
    return nearest, reads & (nearest > F0) & ~(farthest_ray > nearest)


@inlined
def onwards(walk, cell, active, blocked, tired, taken, samples, top, width, height, ends):
    """Return the walks after a step, and which lanes are still active.

    Blocked lanes go one level down, or stop, with status `ends`; the others leave their cell, and
    go one level up after so many `samples`.
    """
    line, level, cx, cy = walk.line, walk.level, walk.cx, walk.cy
    stops = blocked & (level == ZERO)
    free = active & ~blocked & ~tired
    s = simd.select(free & (cell.s > walk.s), cell.s, walk.s)
    go = free & (cell.s < line.s_end)
    x, y, sideways = next_pixels(line, cell, level, s, cx, cy)
    outside = (x < ZERO) | (y < ZERO) | (x >= np.int32(width)) | (y >= np.int32(height))
    off = go & outside
    down = blocked & ~stops
    sampled = walk.sampled + ONE
    up = go & (sampled == np.int32(samples))
    sampled = simd.select(up | blocked, ZERO, sampled)
    raised = simd.minimum(level + ONE, np.int32(top))
    level = simd.select(up, raised, simd.select(down, level - ONE, level))
    status = simd.select(stops, np.int32(ends), walk.status)
    status = simd.select(tired, np.int32(EXHAUSTED), status)
    status = simd.select(off, np.int32(OFFSCREEN), status)
    after = Walk(
        line, simd.select(go, x, cx), simd.select(go, y, cy), level, status, s, sampled, taken,
        simd.select(go, sideways, walk.sideways), walk.own & ~active,
    )  # fmt: skip
    return after, (go & ~off) | down


def count_steps(counts, level, m):
    """Count a step of each lane in m at its level, if `counts` is not ()."""
    raise NotImplementedError("for compiled code only")


@overload(count_steps, jit_options=OPTIONS | {"forceinline": True})
def _count_steps(counts, level, m):
    if isinstance(counts, types.BaseTuple):
        return lambda counts, level, m: None

    def count(counts, level, m):
        # No two lanes share a counter: what one of them adds is not lost.
        at = level * np.int32(LANES) + simd.iota(LANES)
        simd.scatter(counts, at, simd.gather(counts, at, m, 0) + 1, m)

    return count
