"""Embree's ray queries from compiled loops.

Embree's functions come as addresses in int64 arguments, never as globals, so that the machine code
holds nothing of this process and can be cached on disk.

A packet of `width` rays is field by field in memory (RTCRayHit4/8/16), and for width 1 that is the
layout of RTCRayHit too: origin 0 to 2, tnear 3, direction 4 to 6, time 7, tfar 8, mask 9, id 10,
flags 11, Ng 12 to 14, u 15, v 16, primID 17, geomID 18, instID 19. Embree built with instance
arrays has instPrimID as field 20; room is kept for it either way. Field 21 is ours: the factor
by which the direction was multiplied.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic
from numpy.typing import NDArray

from hybrid_rt.kernels import simd
from hybrid_rt.kernels._aligned import aligned
from hybrid_rt.kernels._jit import inlined, kernel, parallel_kernel
from hybrid_rt.kernels._queue import take
from hybrid_rt.kernels.simd import WIDTH

SCALE = 21
FIELDS = 22


class Query(NamedTuple):
    """What is asked of Embree.

    `function`, `scene` and `arguments` are addresses: the call for `width`, the RTCScene and the
    RTCIntersectArguments or RTCOccludedArguments. With `indexed` only the rays at `indices` (M,)
    int32 are traced, in that order, and no other row is written. With `by_direction` those of a
    chunk are traced sorted by where they go.
    """

    function: int
    scene: int
    arguments: int
    width: int
    indexed: bool
    indices: NDArray[np.int32]
    by_direction: bool


LARGEST = np.float32(np.finfo(np.float32).max)
SHORT, LONG = np.float32(2.0**-40), np.float32(2.0**40)  # of directions given as they are
CELLS = 24  # of directions: octants times longest axis
CHUNK = 2048  # rays that a thread takes at a time; a multiple of every width


@intrinsic
def _call3(typingctx, function, a, b, c):
    """Call ``void function(a, b, c)`` at an address; all arguments are pointers as int64."""
    return _signature_of(3), _generator_of(3)


@intrinsic
def _call4(typingctx, function, a, b, c, d):
    """Call ``void function(a, b, c, d)`` at an address; all arguments are pointers as int64."""
    return _signature_of(4), _generator_of(4)


def _signature_of(count):
    return types.void(*[types.int64] * (count + 1))


def _generator_of(count):
    def generate(context, builder, signature, arguments):
        word = ir.IntType(64)
        function_type = ir.FunctionType(ir.VoidType(), [word] * count)
        target = builder.inttoptr(arguments[0], function_type.as_pointer())
        builder.call(target, arguments[1:])
        return context.get_dummy_value()

    return generate


@inlined
def _usable(ox, oy, oz, dx, dy, dz, near, far):
    """Whether a ray may go to Embree: finite, with a direction, and not empty.

    `&`, and not `and`, which would branch; no comparison holds for a NaN.
    """
    return (
        (abs(ox) <= LARGEST)
        & (abs(oy) <= LARGEST)
        & (abs(oz) <= LARGEST)
        & (abs(dx) <= LARGEST)
        & (abs(dy) <= LARGEST)
        & (abs(dz) <= LARGEST)
        & ((dx != 0) | (dy != 0) | (dz != 0))
        & (abs(near) <= LARGEST)
        & (near <= far)
    )


@inlined
def _scale(dx, dy, dz):
    """Return a power of two that makes a direction one that Embree can follow: mostly 1.

    Embree inverts no component below 1e-18 and overflows with very long ones: without this, rays
    with directions shorter than 2**-55 miss what lies in front of them.
    """
    largest = max(abs(dx), abs(dy), abs(dz))
    if largest >= SHORT and largest <= LONG:
        return np.float32(1.0)
    return np.float32(math.ldexp(1.0, min(-math.frexp(largest)[1], 127)))


@inlined
def _packet(width):
    """Return a packet as float32 and as int32, and the flags of its lanes.

    What no ray changes is set here once: time and id 0, all of the mask, nothing hit.
    """
    packet = aligned(FIELDS * width // 2 + 1).view(np.float32)  # packets of 16 must be
    packet[:] = 0.0
    words = packet.view(np.int32)
    for k in range(width):
        words[9 * width + k] = -1
        for field in range(17, SCALE):
            words[field * width + k] = -1
    return packet, words, aligned(width // 2 + 1).view(np.int32)


@inlined
def _queue():
    """Return room for the rays of a chunk, their keys, and the ends of the keys' runs."""
    return np.empty(CHUNK, np.int64), np.empty(CHUNK, np.uint8), np.empty(CELLS + 1, np.int64)


@inlined
def _towards(x, y, z):
    """Return a number from 0 to CELLS - 1 for a direction: its octant and its longest axis."""
    octant = (1 if x < 0 else 0) + (2 if y < 0 else 0) + (4 if z < 0 else 0)
    x, y, z = abs(x), abs(y), abs(z)
    axis = 0 if (x >= y) & (x >= z) else (1 if y >= z else 2)
    return np.uint64(8 * axis + octant)


@inlined
def _take(start, stop, indexed, indices, by_direction, direction, queue, keys, ends):
    """Write the rays at places `start` to `stop` into `queue`, with `by_direction` sorted by it.

    A stable counting sort: rays that go the same way stay in their order. The queue is short enough
    to stay in the cache with its rays, so sorting costs no way through memory.
    """
    if not by_direction:
        for place in range(start, stop):
            queue[place - start] = indices[place] if indexed else place
        return
    for key in range(CELLS + 1):
        ends[key] = 0
    for place in range(start, stop):
        i = np.uint64(indices[place]) if indexed else np.uint64(place)
        key = _towards(direction[i, 0], direction[i, 1], direction[i, 2])
        keys[place - start] = key
        ends[key + np.uint64(1)] += 1
    for key in range(CELLS):
        ends[key + 1] += ends[key]
    for place in range(start, stop):
        key = keys[place - start]
        queue[ends[key]] = indices[place] if indexed else place
        ends[key] += 1


@inlined
def _load(
    first, count, width, in_order, queue, origin, direction, t_near, t_far, packet, words, valid
):  # fmt: skip
    """Fill a packet from place `first` of the queue on; return whether any of its lanes is valid.

    No row like ``origin[i]`` is formed, here or in any loop over rays: Numba counts references to
    it, in atomic steps that take longer than everything else here.
    """
    if width == WIDTH and in_order:
        done, some = _load_vectors(
            queue[first], count - first, origin, direction, t_near, t_far, packet, words, valid
        )
        if done:
            return some
    some = False
    for k in range(width):
        i = np.uint64(queue[min(first + k, count - 1)])  # unsigned spares the test for < 0
        ox, oy, oz, near = origin[i, 0], origin[i, 1], origin[i, 2], t_near[i]
        dx, dy, dz, far = direction[i, 0], direction[i, 1], direction[i, 2], t_far[i]
        if _usable(ox, oy, oz, dx, dy, dz, near, far) and first + k < count:
            some = True
            scale = _scale(dx, dy, dz)
            valid[k] = -1
            packet[k] = ox
            packet[width + k] = oy
            packet[2 * width + k] = oz
            packet[3 * width + k] = near / scale
            packet[4 * width + k] = dx * scale
            packet[5 * width + k] = dy * scale
            packet[6 * width + k] = dz * scale
            packet[8 * width + k] = far / scale
            packet[SCALE * width + k] = scale
        else:
            valid[k] = 0
            for field in range(9):
                packet[field * width + k] = 0.0
        words[18 * width + k] = -1
    return some


@inlined
def _finite(v):
    return simd.absolute(v) <= LARGEST


@inlined
def _load_vectors(i, n, origin, direction, t_near, t_far, packet, words, valid):
    """Do what `_load` does for WIDTH rays side by side, of which there are n from i on.

    Return whether it is done, and whether a lane is valid. It is not done where a direction needs a
    factor. Rays that do not lie side by side would be gathered, and that takes longer than reading
    one after the other.
    """
    live = simd.first(n)
    ox, oy, oz = simd.load_triples(origin, 3 * i, n)
    dx, dy, dz = simd.load_triples(direction, 3 * i, n)
    near = simd.load_masked(t_near, i, live, 0.0)
    far = simd.load_masked(t_far, i, live, 0.0)
    largest = simd.maximum(simd.absolute(dx), simd.absolute(dy))
    largest = simd.maximum(largest, simd.absolute(dz))
    usable = live & _finite(ox) & _finite(oy) & _finite(oz) & _finite(near) & (near <= far)
    usable = usable & _finite(dx) & _finite(dy) & _finite(dz)
    plain = (largest >= SHORT) & (largest <= LONG)
    if simd.any_(usable & ~plain):
        return False, False
    simd.store(valid, 0, -simd.to_i32(usable))
    simd.store(packet, 0, simd.select(usable, ox, 0.0))
    simd.store(packet, WIDTH, simd.select(usable, oy, 0.0))
    simd.store(packet, 2 * WIDTH, simd.select(usable, oz, 0.0))
    simd.store(packet, 3 * WIDTH, simd.select(usable, near, 0.0))
    simd.store(packet, 4 * WIDTH, simd.select(usable, dx, 0.0))
    simd.store(packet, 5 * WIDTH, simd.select(usable, dy, 0.0))
    simd.store(packet, 6 * WIDTH, simd.select(usable, dz, 0.0))
    simd.store(packet, 8 * WIDTH, simd.select(usable, far, 0.0))
    simd.store(packet, SCALE * WIDTH, simd.f32(1.0))
    simd.store(words, 18 * WIDTH, simd.i32(-1))
    return True, simd.any_(usable)


@inlined
def _store_vectors(i, n, packet, words, t, prim_id, u, v, n_g):
    """Do what `_store` does for WIDTH rays side by side, of which there are n from i on."""
    live = simd.first(n)
    hit = simd.load(words, 18 * WIDTH) == 0
    distance = simd.load(packet, 8 * WIDTH) * simd.load(packet, SCALE * WIDTH)
    # A t beyond float32 stays finite: infinity would say that there is no hit.
    distance = simd.minimum(distance, LARGEST)
    simd.store_masked(t, i, simd.select(hit, distance, np.inf), live)
    simd.store_masked(prim_id, i, simd.select(hit, simd.load(words, 17 * WIDTH), -1), live)
    simd.store_masked(u, i, simd.select(hit, simd.load(packet, 15 * WIDTH), 0.0), live)
    simd.store_masked(v, i, simd.select(hit, simd.load(packet, 16 * WIDTH), 0.0), live)
    x = simd.select(hit, simd.load(packet, 12 * WIDTH), 0.0)
    y = simd.select(hit, simd.load(packet, 13 * WIDTH), 0.0)
    z = simd.select(hit, simd.load(packet, 14 * WIDTH), 0.0)
    simd.store_triples(n_g, 3 * i, x, y, z, live)


@inlined
def _store(first, count, width, in_order, queue, packet, words, hits):
    """Write the hits of a packet; what Embree left in the fields of a miss is not looked at."""
    t, prim_id, u, v, n_g = hits
    nothing = np.float32(0.0)
    if width == WIDTH and in_order:
        _store_vectors(queue[first], count - first, packet, words, t, prim_id, u, v, n_g)
        return
    for k in range(width):
        if first + k >= count:
            break
        i = np.uint64(queue[first + k])
        hit = words[18 * width + k] == 0  # the one geometry of the scene
        distance = min(packet[8 * width + k] * packet[SCALE * width + k], LARGEST)
        t[i] = distance if hit else np.float32(np.inf)
        prim_id[i] = words[17 * width + k] if hit else np.int32(-1)
        n_g[i, 0] = packet[12 * width + k] if hit else nothing
        n_g[i, 1] = packet[13 * width + k] if hit else nothing
        n_g[i, 2] = packet[14 * width + k] if hit else nothing
        u[i] = packet[15 * width + k] if hit else nothing
        v[i] = packet[16 * width + k] if hit else nothing


@inlined
def _query(function, scene, arguments, width, packet, valid):
    if width == 1:
        _call3(function, scene, packet.ctypes.data, arguments)
    else:
        _call4(function, valid.ctypes.data, scene, packet.ctypes.data, arguments)


@inlined
def _store_occluded(first, count, width, in_order, queue, packet, words, hit):
    """Write which rays of a packet hit anything."""
    for k in range(width):
        if first + k >= count:
            break
        # Embree writes tfar = -inf for an occluded ray and leaves a masked lane alone.
        hit[np.uint64(queue[first + k])] = packet[8 * width + k] == -np.inf


@inlined
def _trace(share, query, rays, store, answers):
    """Trace rays in packets and store their answers by a function; see `intersect`."""
    width, indexed, indices, by_direction = query[3:]
    origin, direction, _, t_near, t_far = rays
    count = len(indices) if indexed else len(origin)
    in_order = not (indexed or by_direction)
    packet, words, valid = _packet(width)
    queue, keys, ends = _queue()
    start = take(share, CHUNK)
    while start < count:
        length = min(CHUNK, count - start)
        _take(start, start + length, indexed, indices, by_direction, direction, queue, keys, ends)
        for first in range(0, length, width):
            if _load(
                first, length, width, in_order, queue,
                origin, direction, t_near, t_far, packet, words, valid,
            ):  # fmt: skip
                _query(query.function, query.scene, query.arguments, width, packet, valid)
            store(first, length, width, in_order, queue, packet, words, answers)
        start = take(share, CHUNK)


@parallel_kernel
def intersect(share, query, rays, hits):
    """Nearest hits of rays by rtcIntersect1/4/8/16, written to the rows of the rays.

    Threads take chunks of rays from a common counter; which one traces a ray does not show.
    """
    _trace(share, query, rays, _store, hits)


@parallel_kernel
def occluded(share, query, rays, hit):
    """Whether rays hit anything, (N,) bool, by rtcOccluded1/4/8/16; as `intersect`."""
    _trace(share, query, rays, _store_occluded, hit)


@kernel
def usable(origin, direction, t_near, t_far, out, scale):
    """Set `out` (N,) bool where a ray may go to Embree, `scale` (N,) to its direction's factor."""
    for i in range(len(origin)):
        dx, dy, dz = direction[i, 0], direction[i, 1], direction[i, 2]
        out[i] = _usable(origin[i, 0], origin[i, 1], origin[i, 2], dx, dy, dz, t_near[i], t_far[i])
        scale[i] = _scale(dx, dy, dz) if out[i] else np.float32(1.0)
