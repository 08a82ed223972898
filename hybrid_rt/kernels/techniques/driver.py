"""The one loop of all marches that step: set up, march and write, a ray in each lane.

A technique is known by the type of its numbers. It says what a lane knows of a ray that begins
(`begins`), what a step makes of that (`steps`) and what the screen says about a ray that has ended
(`finishes`); Numba puts these into a copy of the loop. Lanes whose rays have ended are given the
next ones, in the order of the caller, once a few are free. What comes out does not depend on the
number of lanes, or on which rays are neighbours.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import types
from numba.extending import overload

from hybrid_rt.kernels import simd
from hybrid_rt.kernels._borrow import borrowed_record, keep
from hybrid_rt.kernels._jit import OPTIONS, called, inlined, parallel_kernel
from hybrid_rt.kernels._queue import take
from hybrid_rt.kernels.techniques.placing import LANES, rays_t, screen_rays
from hybrid_rt.kernels.techniques.screen import LARGEST_T, MISS

CHUNK = 1024  # rays that a thread takes at a time
BATCH = 128
"""Rays that are set up at a time: what is known of them stays in the L1 cache."""
REFILL = max(1, 3 * LANES // 8)
"""Free lanes before rays are put in."""

F0 = np.float32(0.0)
ONE = np.int32(1)
NONE = np.int32(-1)
INF = np.float32(np.inf)


class Kept(NamedTuple):
    """What is kept of a ray while it is marched: its number, pixel, end, and the way from s to t.

    index, own_x, own_y, status i32; w, gw, length, t_near, scale f64: see `ScreenRays`.
    """

    index: object
    own_x: object
    own_y: object
    status: object
    w: object
    gw: object
    length: object
    t_near: object
    scale: object


class Answers(NamedTuple):
    """What the screen says about rays.

    status i32; resolved, a mask; pixel x and y i32, -1 where no pixel answers with a hit; s of the
    hit and s found free, float64; steps i32.
    """

    status: object
    resolved: object
    x: object
    y: object
    s_hit: object
    s_free: object
    steps: object


def begin(numbers, buffers, pyramid, rays, kept):
    """Return the state, a tuple of vectors, of rays (`ScreenRays`) that begin."""
    raise NotImplementedError("for compiled code only")


def step(numbers, buffers, pyramid, kept, state, active, counts):
    """Return the state of the lanes after a step of the active ones, and which are active still."""
    raise NotImplementedError("for compiled code only")


def finish(numbers, buffers, pyramid, kept, state, done):
    """Return the `Answers` of the lanes `done`, whose rays have ended."""
    raise NotImplementedError("for compiled code only")


INLINED = {"jit_options": OPTIONS | {"forceinline": True}}


def _is(numbers, numbers_class):
    return getattr(numbers, "instance_class", None) is numbers_class


def begins(numbers_class):
    """Decorate the function that begins rays for numbers of a class, as `begin` says."""

    def decorate(function):
        @overload(begin, **INLINED)
        def choose(numbers, buffers, pyramid, rays, kept):
            return function if _is(numbers, numbers_class) else None

        return function

    return decorate


def steps(numbers_class):
    """Decorate the function that takes a step for numbers of a class, as `step` says."""

    def decorate(function):
        @overload(step, **INLINED)
        def choose(numbers, buffers, pyramid, kept, state, active, counts):
            return function if _is(numbers, numbers_class) else None

        return function

    return decorate


def finishes(numbers_class):
    """Decorate the function that finishes rays for numbers of a class, as `finish` says."""

    def decorate(function):
        @overload(finish, **INLINED)
        def choose(numbers, buffers, pyramid, kept, state, done):
            return function if _is(numbers, numbers_class) else None

        return function

    return decorate


@inlined
def write(answers, kept, done, marched, rays, prim_ids, width, out):
    """Write the rows of the rays in lanes `done`, of which some have been `marched`."""
    index = simd.to_i64(kept.index)
    hit = done & (answers.x >= 0)
    t_free = rays_t(answers.s_free, kept.w, kept.gw, kept.t_near) * kept.scale
    t_free = simd.select(marched, simd.to_f32(t_free), F0)
    missed = done & (answers.status == np.int32(MISS))
    t_free = simd.gather(rays.t_far, index, missed, t_free)
    t_hit = rays_t(answers.s_hit, kept.w, kept.gw, kept.t_near) * kept.scale
    t_hit = simd.to_f32(simd.minimum(t_hit, LARGEST_T))
    pixel = answers.y * np.int32(width) + answers.x
    simd.scatter(out.status, index, answers.status, done)
    simd.scatter(out.resolved, index, answers.resolved, done)
    simd.scatter(out.pixel, index + index, simd.select(hit, answers.x, NONE), done)
    simd.scatter(out.pixel, index + index + 1, simd.select(hit, answers.y, NONE), done)
    simd.scatter(out.prim_id, index, simd.gather(prim_ids, pixel, hit, NONE), done)
    simd.scatter(out.t, index, simd.select(hit, t_hit, INF), done)
    simd.scatter(out.t_free, index, t_free, done)
    simd.scatter(out.steps, index, answers.steps, done)


@inlined
def begun(first, many, rays, view, buffers, pyramid, numbers):
    """Return `many` rays, at most LANES, from `first` on: what is kept, the state, and which start.

    The statuses of the others are in what is kept.
    """
    height, width = buffers.depth.shape
    live = simd.first(many, LANES)
    ox, oy, oz = simd.load_triples(rays.origin, 3 * first, many, LANES)
    dx, dy, dz = simd.load_triples(rays.direction, 3 * first, many, LANES)
    t_near = simd.load_masked(rays.t_near, first, live, F0)
    t_far = simd.load_masked(rays.t_far, first, live, F0)
    placed = screen_rays(ox, oy, oz, dx, dy, dz, t_near, t_far, view, width, height)
    at = simd.to_i64(simd.iota(LANES)) * 2 + 2 * first
    kept = Kept(
        simd.iota(LANES) + np.int32(first), simd.gather(rays.pixel, at, live, NONE),
        simd.gather(rays.pixel, at + 1, live, NONE), placed.status, placed.w, placed.gw,
        placed.length, placed.t_near, placed.scale,
    )  # fmt: skip
    state = begin(numbers, buffers, pyramid, placed, kept)
    return kept, state, live & (placed.s_end >= 0.0)


@called
def set_up(first, last, queue, rays, view, buffers, pyramid, numbers, out):
    """Set up rays first..last-1; return how many wait in the queue.

    Those that cannot be marched are written at once.
    """
    width = buffers.depth.shape[1]
    waiting = 0
    for k in range(first, last, LANES):
        many = min(LANES, last - k)
        kept, state, starts = begun(k, many, rays, view, buffers, pyramid, numbers)
        simd.push(queue, waiting, (kept, state), starts)
        waiting += simd.count(starts)
        ends = simd.first(many, LANES) & ~starts
        if simd.any_(ends):
            nothing, none = simd.i32(0, LANES), simd.i32(-1, LANES)
            zero, resolved = simd.f64(0.0, LANES), simd.mask(False, LANES)
            answers = Answers(kept.status, resolved, none, none, zero, zero, nothing)
            write(answers, kept, ends, starts, rays, buffers.prim_id, width, out)
    return waiting


@called
def finish_some(at, many, queue, rays, view, buffers, pyramid, numbers, out):
    """Finish `many` rays, at most LANES, from entry `at` of a queue on, and write their rows."""
    live = simd.first(many, LANES)
    kept, state, _ = begun(0, 0, rays, view, buffers, pyramid, numbers)
    kept, state = simd.pull(queue, at, (kept, state), live)
    answers = finish(numbers, buffers, pyramid, kept, state, live)
    write(answers, kept, live, live, rays, buffers.prim_id, buffers.depth.shape[1], out)


@called
def march_share(share, rays, view, buffers, pyramid, numbers, out, counts):
    """March rays as long as there are any to take.

    Rays are set up a batch at a time, and finished a vector at a time, so that these stages find
    their lanes full; between them they wait in queues.
    """
    # The arguments are alive, and counting references to their arrays costs time in every chunk.
    rays, view, buffers = borrowed_record(rays), borrowed_record(view), borrowed_record(buffers)
    pyramid, out = borrowed_record(pyramid), borrowed_record(out)
    n = len(rays.t_near)
    kept, state, active = begun(0, 0, rays, view, buffers, pyramid, numbers)
    filled = active
    rows = simd.rows_of((kept, state))
    ready, ended = np.empty((rows, BATCH + LANES), np.int64), np.empty((rows, 3 * LANES), np.int64)
    taken, waiting, over = 0, 0, 0
    first, last = 0, 0
    while True:
        done = filled & ~active
        simd.push(ended, over, (kept, state), done)
        over += simd.count(done)
        if over >= LANES:
            over -= LANES
            finish_some(over, LANES, ended, rays, view, buffers, pyramid, numbers, out)
        if taken == waiting and first < n:
            if first >= last:
                first = take(share, CHUNK)
                last = min(n, first + CHUNK)
            until = min(last, first + BATCH)
            taken = 0
            waiting = set_up(first, until, ready, rays, view, buffers, pyramid, numbers, out)
            first = until if until > first else n
        filled = active
        many = min(LANES - simd.count(active), waiting - taken)
        if many > 0:
            free = ~active
            free = free & (simd.expand(simd.iota(LANES), free, np.int32(LANES)) < np.int32(many))
            kept, state = simd.pull(ready, taken, (kept, state), free)
            taken += many
            active = active | free
            filled = active
        elif first >= n and not simd.any_(active):
            break
        enough = REFILL if taken < waiting or first < n else LANES
        while LANES - simd.count(active) < enough:
            state, active = step(numbers, buffers, pyramid, kept, state, active, counts)
    finish_some(0, over, ended, rays, view, buffers, pyramid, numbers, out)
    keep(ready)
    keep(ended)


@parallel_kernel
def march(share, rays, view, buffers, pyramid, numbers, out, counts):
    """March rays; out (N,).

    rays, view, buffers, pyramid, out: as in `hybrid_rt.kernels.arrays`; pyramid may be () for a
    technique that reads none. counts: (), or (workers, L * LANES) int64 that steps are added to.
    """
    march_share(share, rays, view, buffers, pyramid, numbers, out, counts_of(counts, share.worker))


def counts_of(counts, worker):
    """Return the counters of a worker, () if nothing is counted."""
    raise NotImplementedError("for compiled code only")


@overload(counts_of, jit_options=OPTIONS | {"forceinline": True})
def _counts_of(counts, worker):
    if isinstance(counts, types.Array):
        return lambda counts, worker: counts[worker]
    return lambda counts, worker: ()
