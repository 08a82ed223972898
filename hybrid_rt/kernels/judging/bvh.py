"""Build a tree of boxes over triangles, split where a binned surface-area heuristic says.

Wald 2007, "On fast construction of SAH-based bounding volume hierarchies". Coordinates are float32
and a box is made of minima and maxima only, so every box is exact.
"""

from __future__ import annotations

import numpy as np

from hybrid_rt.kernels._jit import called, inlined, kernel, parallel_kernel
from hybrid_rt.kernels._queue import part

BINS = 16
LEAF = 4
# Below this depth ranges are halved by number, which ends after 31 more levels.
DEEPEST = 60
STACK = DEEPEST + 36


@parallel_kernel
def corners(share, vertices, faces, ids, low, high):
    """Boxes `low`, `high` (n, 3) of the triangles `ids` (n,)."""
    for i in part(share, len(ids)):
        for k in range(3):
            a = vertices[faces[ids[i], 0], k]
            b = vertices[faces[ids[i], 1], k]
            c = vertices[faces[ids[i], 2], k]
            low[i, k] = min(a, b, c)
            high[i, k] = max(a, b, c)


@inlined
def _centre(low, high, i, k):
    """Twice the centre of a box."""
    return np.float64(low[i, k]) + np.float64(high[i, k])


@inlined
def _grow(box, row, low, high, i):
    for k in range(3):
        box[row, k] = min(box[row, k], low[i, k])
        box[row, 3 + k] = max(box[row, 3 + k], high[i, k])


@inlined
def _empty(box, row):
    for k in range(3):
        box[row, k] = np.inf
        box[row, 3 + k] = -np.inf


@inlined
def _join(box, row, other):
    for k in range(3):
        box[row, k] = min(box[row, k], box[other, k])
        box[row, 3 + k] = max(box[row, 3 + k], box[other, 3 + k])


@inlined
def _half_area(box, row):
    x = np.float64(box[row, 3]) - np.float64(box[row, 0])
    y = np.float64(box[row, 4]) - np.float64(box[row, 1])
    z = np.float64(box[row, 5]) - np.float64(box[row, 2])
    return x * y + y * z + z * x


@called
def _widest(low, high, order, begin, end):
    """Return (axis, start, extent) along which the centres are spread most."""
    axis, start, extent = 0, 0.0, -1.0
    for k in range(3):
        least, most = np.inf, -np.inf
        for j in range(begin, end):
            c = _centre(low, high, order[j], k)
            least, most = min(least, c), max(most, c)
        if most - least > extent:
            axis, start, extent = k, least, most - least
    return axis, start, extent


@called
def _split(low, high, order, begin, end, bins, count, price):
    """Reorder `order[begin:end]` into two parts; return where the second starts.

    `bins` (BINS + 1, 6) float32, `count` (BINS,) int64 and `price` (BINS,) float64 are room.
    """
    axis, start, extent = _widest(low, high, order, begin, end)
    middle = (begin + end) // 2
    if not extent > 0.0:
        return middle
    scale = BINS / extent
    count[:] = 0
    for b in range(BINS):
        _empty(bins, b)
    for j in range(begin, end):
        i = order[j]
        b = min(BINS - 1, int((_centre(low, high, i, axis) - start) * scale))
        count[b] += 1
        _grow(bins, b, low, high, i)
    _empty(bins, BINS)
    left = 0
    for b in range(BINS - 1):  # what lies left of plane b costs
        left += count[b]
        _join(bins, BINS, b)
        price[b] = left * _half_area(bins, BINS) if left else np.inf
    _empty(bins, BINS)
    right, best, plane = 0, np.inf, -1
    for b in range(BINS - 2, -1, -1):
        right += count[b + 1]
        _join(bins, BINS, b + 1)
        if right:
            total = price[b] + right * _half_area(bins, BINS)
            if total < best:
                best, plane = total, b
    if plane < 0:
        return middle
    i, j = begin, end
    while i < j:
        b = min(BINS - 1, int((_centre(low, high, order[i], axis) - start) * scale))
        if b <= plane:
            i += 1
        else:
            j -= 1
            order[i], order[j] = order[j], order[i]
    return i if begin < i < end else middle


@kernel
def build(low, high, order, box, link):
    """Build the tree over the boxes `low`, `high` (n, 3) float32, n >= 1; return its nodes.

    `order` (n,) int32 holds 0 .. n - 1 and is permuted. `box` (2 n, 6) float32: least corner, then
    greatest. `link` (2 n, 2) int32: (first, number) of a leaf's entries in `order`, or (left child,
    0), with the right child behind the left. Node 0 is the root; no path is longer than STACK - 2.
    """
    bins = np.empty((BINS + 1, 6), np.float32)
    count, price = np.empty(BINS, np.int64), np.empty(BINS)
    stack = np.empty((STACK, 4), np.int64)
    stack[0] = 0, 0, len(order), 0
    nodes, top = 1, 1
    while top > 0:
        top -= 1
        node, begin, end, depth = stack[top, 0], stack[top, 1], stack[top, 2], stack[top, 3]
        _empty(box, node)
        for j in range(begin, end):
            _grow(box, node, low, high, order[j])
        if end - begin <= LEAF:
            link[node, 0], link[node, 1] = begin, end - begin
            continue
        middle = (begin + end) // 2
        if depth < DEEPEST:
            middle = _split(low, high, order, begin, end, bins, count, price)
        link[node, 0], link[node, 1] = nodes, 0
        stack[top] = nodes + 1, middle, end, depth + 1
        stack[top + 1] = nodes, begin, middle, depth + 1
        top += 2
        nodes += 2
    return nodes
