"""Small scenes whose every reflection can be followed by eye."""

from __future__ import annotations

import numpy as np

import hybrid_rt as hrt
from hybrid_rt_scenes.builder import Builder
from hybrid_rt_scenes.primitives import Part, boxes, place, quad


def geodesic(frequency: int, radius: float) -> Part:
    """Return a sphere of 20 frequency**2 nearly equal triangles, closed to the bit."""
    g = (1 + np.sqrt(5)) / 2
    corners = np.array(
        [
            [-1, g, 0], [1, g, 0], [-1, -g, 0], [1, -g, 0], [0, -1, g], [0, 1, g],
            [0, -1, -g], [0, 1, -g], [g, 0, -1], [g, 0, 1], [-g, 0, -1], [-g, 0, 1],
        ]
    )  # fmt: skip
    faces = np.array(
        [
            [0, 11, 5], [0, 5, 1], [0, 1, 7], [0, 7, 10], [0, 10, 11], [1, 5, 9], [5, 11, 4],
            [11, 10, 2], [10, 7, 6], [7, 1, 8], [3, 9, 4], [3, 4, 2], [3, 2, 6], [3, 6, 8],
            [3, 8, 9], [4, 9, 5], [2, 4, 11], [6, 2, 10], [8, 6, 7], [9, 8, 1],
        ]
    )  # fmt: skip
    f = frequency
    i, j = (k.ravel() for k in np.meshgrid(np.arange(f + 1), np.arange(f + 1), indexing="ij"))
    i, j = i[i + j <= f], j[i + j <= f]
    number = np.full((f + 2, f + 2), -1)
    number[i, j] = np.arange(len(i))
    up = np.stack([number[i, j], number[i + 1, j], number[i, j + 1]], axis=1)[i + j < f]
    inner = (i + j < f - 1) & (f > 1)
    i2, j2 = i[inner], j[inner]
    down = np.stack([number[i2 + 1, j2], number[i2 + 1, j2 + 1], number[i2, j2 + 1]], axis=1)
    lattice = np.concatenate([up, down])
    weights = np.stack([f - i - j, i, j], axis=1) / f
    points = np.einsum("pk,nkx->npx", weights, corners[faces]).reshape(-1, 3)
    points *= radius / np.linalg.norm(points, axis=1, keepdims=True)
    triangles = (lattice[None] + (np.arange(20) * len(i))[:, None, None]).reshape(-1, 3)
    # Points on an edge were made once for each of its faces: keep one of them.
    _, first, same = np.unique(
        np.round(points / radius, 9) + 0.0, axis=0, return_index=True, return_inverse=True
    )
    return Part(points[first], same.reshape(-1)[triangles])


def _stage(radius: float, ground: float) -> list[Part]:
    """Return a floor, two walls and blocks round a ball of `radius` that rests at `ground`."""
    r = radius
    floor = quad([-5 * r, ground, 6 * r], [10 * r, 0, 0], [0, 0, -10 * r])
    back = quad([-5 * r, ground, -4 * r], [10 * r, 0, 0], [0, 6 * r, 0])
    left = quad([-5 * r, ground, 6 * r], [0, 0, -10 * r], [0, 6 * r, 0])
    at = np.array([[-2.6, 0, -2.2], [2.5, 0, -2.0], [2.4, 0, 1.4], [-2.9, 0, 1.9], [0.6, 0, 2.6]])
    size = np.array(
        [[0.6, 3.4, 0.6], [0.8, 1.8, 0.5], [0.4, 0.7, 0.9], [0.5, 1.1, 0.5], [0.35, 0.3, 0.35]]
    )
    block = boxes([-1, 0, -1], [1, 1, 1])
    blocks = place(block, at * r + [0, ground, 0], [0.3, -0.5, 0.2, 0.7, 0.4], size * r)
    ids = np.split(blocks.faces, len(at))
    return [floor, back, left, *(Part(blocks.vertices, faces) for faces in ids)]


def _mesh(parts: list[Part]) -> hrt.Mesh:
    builder = Builder()
    for part in parts:
        builder.add(part)
    return hrt.Mesh.from_arrays(*builder.arrays())


def stage(x: float, z: float, radius: float, ground: float) -> hrt.Mesh:
    """Return a floor, two walls and blocks round a ball that rests on `ground` at (x, z)."""
    return _mesh([part.moved([x, 0, z]) for part in _stage(radius, ground)])


def sphere() -> hrt.Mesh:
    """Return a ball of 980 triangles on a floor, with two walls and blocks to reflect."""
    return _mesh([geodesic(7, 1.0), *_stage(1.0, -1.0)])


def cornell() -> hrt.Mesh:
    """Return a box room, open to the front, with two blocks and a lamp: 36 triangles.

    After the proportions of the Cornell box, with round numbers and in metres.
    """
    block = boxes([-0.5, 0, -0.5], [0.5, 1, 0.5])
    return _mesh(
        [
            quad([-2.75, 0, 2.75], [5.5, 0, 0], [0, 0, -5.5]),
            quad([-2.75, 5.5, 2.75], [5.5, 0, 0], [0, 0, -5.5]),
            quad([-2.75, 0, -2.75], [5.5, 0, 0], [0, 5.5, 0]),
            quad([-2.75, 0, 2.75], [0, 0, -5.5], [0, 5.5, 0]),
            quad([2.75, 0, 2.75], [0, 0, -5.5], [0, 5.5, 0]),
            quad([-0.65, 5.48, -0.5], [1.3, 0, 0], [0, 0, 1.05]),
            place(block, [[0.93, 0, 1.1]], -0.29, [[1.65, 1.65, 1.65]]),
            place(block, [[-0.92, 0, -0.75]], 0.31, [[1.65, 3.3, 1.65]]),
        ]
    )
