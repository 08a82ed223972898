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

import numpy as np
from llvmlite import ir
from numba import prange, types
from numba.extending import intrinsic

from hybrid_rt.kernels._jit import inlined, kernel, parallel_kernel
from hybrid_rt.kernels._queue import fetch_add

SCALE = 21
FIELDS = 22
CHUNK = 512  # rays that a thread takes at a time; a multiple of every width


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
def _aligned(words):
    """Return `words` float32 that start at a multiple of 64 bytes, as packets of 16 must."""
    raw = np.zeros(words + 16, np.float32)
    start = (-raw.ctypes.data % 64) // 4
    return raw[start : start + words]


@inlined
def _usable(o, d, near, far):
    """Whether a ray may go to Embree: finite, with a direction, and not empty."""
    finite = (
        math.isfinite(o[0])
        and math.isfinite(o[1])
        and math.isfinite(o[2])
        and math.isfinite(d[0])
        and math.isfinite(d[1])
        and math.isfinite(d[2])
    )
    aimed = d[0] != 0 or d[1] != 0 or d[2] != 0
    return finite and aimed and math.isfinite(near) and near <= far


@inlined
def _scale(d):
    """Return a power of two that makes a direction one that Embree can follow: mostly 1.

    Embree inverts no component below 1e-18 and overflows with very long ones: without this, rays
    with directions shorter than 2**-55 miss what lies in front of them.
    """
    largest = max(abs(d[0]), abs(d[1]), abs(d[2]))
    if largest >= 2.0**-40 and largest <= 2.0**40:
        return np.float32(1.0)
    return np.float32(math.ldexp(1.0, min(-math.frexp(largest)[1], 127)))


@inlined
def _load(
    first, count, width, indexed, indices, origin, direction, t_near, t_far, packet, words, valid
):
    """Fill a packet from place `first` on; return whether any of its lanes is valid."""
    some = False
    for k in range(width):
        i = _ray(first + k, count, indexed, indices)
        if i >= 0 and _usable(origin[i], direction[i], t_near[i], t_far[i]):
            some = True
            scale = _scale(direction[i])
            valid[k] = -1
            packet[k] = origin[i, 0]
            packet[width + k] = origin[i, 1]
            packet[2 * width + k] = origin[i, 2]
            packet[3 * width + k] = t_near[i] / scale
            packet[4 * width + k] = direction[i, 0] * scale
            packet[5 * width + k] = direction[i, 1] * scale
            packet[6 * width + k] = direction[i, 2] * scale
            packet[8 * width + k] = t_far[i] / scale
            words[9 * width + k] = -1
            packet[SCALE * width + k] = scale
        else:
            valid[k] = 0
            for field in range(10):
                packet[field * width + k] = 0.0
        for field in range(17, SCALE):
            words[field * width + k] = -1
    return some


@inlined
def _ray(place, count, indexed, indices):
    """Return which ray is at a place of the queue, -1 behind its end."""
    if place >= count:
        return np.int64(-1)
    if indexed:
        return np.int64(indices[place])
    return np.int64(place)


@inlined
def _store(first, count, width, indexed, indices, packet, words, t, prim_id, u, v, n_g):
    """Write the hits of a packet; what Embree left in the fields of a miss is not looked at."""
    for k in range(min(width, count - first)):
        i = _ray(first + k, count, indexed, indices)
        if words[18 * width + k] == 0:  # the one geometry of the scene
            t[i] = packet[8 * width + k] * packet[SCALE * width + k]
            prim_id[i] = words[17 * width + k]
            n_g[i, 0] = packet[12 * width + k]
            n_g[i, 1] = packet[13 * width + k]
            n_g[i, 2] = packet[14 * width + k]
            u[i] = packet[15 * width + k]
            v[i] = packet[16 * width + k]
        else:
            _miss(i, t, prim_id, u, v, n_g)


@inlined
def _miss(i, t, prim_id, u, v, n_g):
    t[i] = np.inf
    prim_id[i] = -1
    u[i] = 0.0
    v[i] = 0.0
    n_g[i, 0] = 0.0
    n_g[i, 1] = 0.0
    n_g[i, 2] = 0.0


@inlined
def _query(function, scene, arguments, width, packet, valid):
    if width == 1:
        _call3(function, scene, packet.ctypes.data, arguments)
    else:
        _call4(function, valid.ctypes.data, scene, packet.ctypes.data, arguments)


@parallel_kernel
def intersect(
    function, scene, arguments, width, workers, indexed, indices,
    origin, direction, t_near, t_far,
    t, prim_id, u, v, n_g,
):  # fmt: skip
    """Nearest hits of (N, 3) rays by rtcIntersect1/4/8/16, written to the rows of the rays.

    `function`, `scene` and `arguments` are addresses: the call for `width`, the RTCScene and the
    RTCIntersectArguments. With `indexed` only the rays at `indices` (M,) int32 are traced, in that
    order, and no other row is written. `workers` threads take chunks of rays from a common counter,
    since a chunk of sky costs a fraction of a chunk of foliage; which thread traces a ray does not
    show.
    """
    count = len(indices) if indexed else len(origin)
    taken = np.zeros(1, np.int64)
    for _ in prange(workers):
        packet = _aligned(FIELDS * width)
        words = packet.view(np.int32)
        valid = _aligned(width).view(np.int32)
        start = fetch_add(taken.ctypes.data, CHUNK)
        while start < count:
            for first in range(start, min(start + CHUNK, count), width):
                if _load(
                    first, count, width, indexed, indices,
                    origin, direction, t_near, t_far, packet, words, valid,
                ):  # fmt: skip
                    _query(function, scene, arguments, width, packet, valid)
                _store(first, count, width, indexed, indices, packet, words, t, prim_id, u, v, n_g)
            start = fetch_add(taken.ctypes.data, CHUNK)


@parallel_kernel
def occluded(
    function, scene, arguments, width, workers, indexed, indices,
    origin, direction, t_near, t_far,
    hit,
):  # fmt: skip
    """Whether (N, 3) rays hit anything, by rtcOccluded1/4/8/16; arguments as in `intersect`."""
    count = len(indices) if indexed else len(origin)
    taken = np.zeros(1, np.int64)
    for _ in prange(workers):
        packet = _aligned(FIELDS * width)
        words = packet.view(np.int32)
        valid = _aligned(width).view(np.int32)
        start = fetch_add(taken.ctypes.data, CHUNK)
        while start < count:
            for first in range(start, min(start + CHUNK, count), width):
                if _load(
                    first, count, width, indexed, indices,
                    origin, direction, t_near, t_far, packet, words, valid,
                ):  # fmt: skip
                    _query(function, scene, arguments, width, packet, valid)
                for k in range(min(width, count - first)):
                    # Embree writes tfar = -inf for an occluded ray and leaves a masked lane alone.
                    i = _ray(first + k, count, indexed, indices)
                    hit[i] = packet[8 * width + k] == -np.inf
            start = fetch_add(taken.ctypes.data, CHUNK)


@kernel
def usable(origin, direction, t_near, t_far, out, scale):
    """Set `out` (N,) bool where a ray may go to Embree, `scale` (N,) to its direction's factor."""
    for i in range(len(origin)):
        out[i] = _usable(origin[i], direction[i], t_near[i], t_far[i])
        scale[i] = _scale(direction[i]) if out[i] else np.float32(1.0)
