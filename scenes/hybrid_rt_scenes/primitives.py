"""Shapes to build places from, many copies at a time.

Every function returns a `Part`, works in float64 and has no loop over triangles. Local frames are
+Y up; a facade's own frame is x along the wall, y up, z out of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

F64 = NDArray[np.float64]
I64 = NDArray[np.int64]


class Part(NamedTuple):
    """A piece of geometry: vertices (V, 3) float64 and faces (F, 3) int64."""

    vertices: F64
    faces: I64

    @property
    def triangles(self) -> int:
        """Number of triangles."""
        return len(self.faces)

    def moved(self, offset: ArrayLike) -> Part:
        """Return the part shifted by three numbers."""
        return Part(self.vertices + np.asarray(offset, np.float64), self.faces)

    def scaled(self, factors: ArrayLike) -> Part:
        """Return the part scaled along the axes."""
        return Part(self.vertices * np.asarray(factors, np.float64), self.faces)

    def first(self, count: int) -> Part:
        """Return the first `count` triangles."""
        return Part(self.vertices, self.faces[: max(count, 0)])


EMPTY = Part(np.zeros((0, 3)), np.zeros((0, 3), np.int64))


def join(parts: Sequence[Part]) -> Part:
    """Return several parts as one."""
    if not parts:
        return EMPTY
    starts = np.cumsum([0] + [len(p.vertices) for p in parts[:-1]])
    return Part(
        np.concatenate([p.vertices for p in parts]),
        np.concatenate([p.faces + s for p, s in zip(parts, starts, strict=True)]),
    )


def _lattice(rows: int, columns: int) -> I64:
    """Return the 2 (rows - 1) (columns - 1) triangles of a lattice of points, row by row."""
    a = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    b, c, d = a + 1, a + columns, a + columns + 1
    return np.stack([a, b, d, a, d, c], axis=1).reshape(-1, 3)


def surface(points: ArrayLike) -> Part:
    """Return the surface through a (rows, columns, 3) lattice of points."""
    p = np.asarray(points, np.float64)
    return Part(p.reshape(-1, 3), _lattice(p.shape[0], p.shape[1]))


def surfaces(points: ArrayLike) -> Part:
    """Return n surfaces through (n, rows, columns, 3) points."""
    p = np.asarray(points, np.float64)
    n, rows, columns = p.shape[:3]
    faces = _lattice(rows, columns)[None] + (np.arange(n) * rows * columns)[:, None, None]
    return Part(p.reshape(-1, 3), faces.reshape(-1, 3))


def quad(
    corner: ArrayLike, side: ArrayLike, other: ArrayLike, cuts: tuple[int, int] = (1, 1)
) -> Part:
    """Return a parallelogram from a corner and two sides, cut into cells."""
    u = np.linspace(0, 1, cuts[0] + 1)[None, :, None] * np.asarray(side, np.float64)
    v = np.linspace(0, 1, cuts[1] + 1)[:, None, None] * np.asarray(other, np.float64)
    return surface(np.asarray(corner, np.float64) + u + v)


_BOX_FACES = np.array(
    [
        [0, 4, 6], [0, 6, 2], [1, 3, 7], [1, 7, 5], [0, 1, 5], [0, 5, 4],
        [2, 6, 7], [2, 7, 3], [0, 2, 3], [0, 3, 1], [4, 5, 7], [4, 7, 6],
    ]
)  # fmt: skip


def boxes(low: ArrayLike, high: ArrayLike) -> Part:
    """Return n boxes from their (n, 3) lowest and highest corners: 12 triangles each."""
    lo, hi = np.broadcast_arrays(np.atleast_2d(low), np.atleast_2d(high))
    pick = np.stack(np.meshgrid([0, 1], [0, 1], [0, 1], indexing="ij"), axis=-1).reshape(8, 3)
    corners = np.where(pick[None] == 0, lo[:, None].astype(float), hi[:, None].astype(float))
    # pick counts x slowest: corner index 4 x + 2 y + z
    faces = _BOX_FACES[None] + 8 * np.arange(len(lo))[:, None, None]
    return Part(corners.reshape(-1, 3), faces.reshape(-1, 3))


def lathe(profile: ArrayLike, segments: int, flutes: int = 0, depth: float = 0.0) -> Part:
    """Return a profile of (k, 2) radius and height turned about +Y.

    With `flutes`, grooves of `depth` of the radius run along it. Where the radius is 0 the ring is
    a point and carries one triangle a segment.
    """
    r, y = np.asarray(profile, np.float64).T
    angle = np.linspace(0, 2 * np.pi, segments + 1)
    ripple = 1.0 - depth * (0.5 + 0.5 * np.cos(flutes * angle)) if flutes else np.ones(segments + 1)
    radius = r[:, None] * ripple
    points = np.stack(
        [
            radius * np.cos(angle),
            np.broadcast_to(y[:, None], radius.shape),
            radius * np.sin(angle),
        ],
        axis=-1,
    )
    points[:, -1] = points[:, 0]  # the seam closes to the bit
    part = surface(points)
    ring = part.faces // (segments + 1)
    at_pole = (r == 0)[ring].sum(axis=1) > 1
    return Part(part.vertices, part.faces[~at_pole])


def tubes(points: ArrayLike, radius: ArrayLike, sides: int) -> Part:
    """Return n tubes along (n, k, 3) polylines; `radius` broadcasts to (n, k).

    2 sides (k - 1) triangles each, without caps.
    """
    p = np.asarray(points, np.float64)
    n, k = p.shape[:2]
    along = np.gradient(p, axis=1)
    along /= np.linalg.norm(along, axis=-1, keepdims=True)
    # One reference direction a tube, away from its course, so that the rings do not twist.
    course = np.abs(along).mean(axis=1)
    reference = np.eye(3)[course.argmin(axis=1)][:, None]
    x = np.cross(along, reference)
    x /= np.linalg.norm(x, axis=-1, keepdims=True)
    y = np.cross(along, x)
    angle = np.linspace(0, 2 * np.pi, sides + 1)
    r = np.broadcast_to(np.asarray(radius, np.float64), (n, k))[:, :, None, None]
    rings = p[:, :, None] + r * (
        np.cos(angle)[:, None] * x[:, :, None] + np.sin(angle)[:, None] * y[:, :, None]
    )
    rings[:, :, -1] = rings[:, :, 0]
    return surfaces(rings)


def place(
    part: Part, at: ArrayLike, yaw: ArrayLike = 0.0, scale: ArrayLike = 1.0, flip: ArrayLike = False
) -> Part:
    """Return copies of `part`: scaled by (n, 3), turned about +Y by (n,), moved to (n, 3).

    `yaw` turns +Z towards +X. `scale` may be one number, (n, 1) or (n, 3); `flip` mirrors x.
    """
    where = np.atleast_2d(np.asarray(at, np.float64))
    n = len(where)
    turn = np.broadcast_to(np.asarray(yaw, np.float64), n)
    factors = np.array(np.broadcast_to(np.asarray(scale, np.float64), (n, 3)))
    factors[:, 0] *= np.where(np.broadcast_to(flip, n), -1.0, 1.0)
    v = part.vertices[None] * factors[:, None]
    c, s = np.cos(turn)[:, None], np.sin(turn)[:, None]
    x = c * v[..., 0] + s * v[..., 2]
    z = -s * v[..., 0] + c * v[..., 2]
    out = np.stack([x, v[..., 1], z], axis=-1) + where[:, None]
    faces = part.faces[None] + (np.arange(n) * len(part.vertices))[:, None, None]
    return Part(out.reshape(-1, 3), faces.reshape(-1, 3))


def leaves(centres: F64, size: ArrayLike, rng: np.random.Generator) -> Part:
    """Return a leaf at each of (n, 3) centres: two triangles folded along the rib.

    Loose leaves that hide each other in no order are what makes foliage hard for a depth buffer.
    """
    n = len(centres)
    rib = rng.normal(size=(n, 3))
    rib /= np.linalg.norm(rib, axis=1, keepdims=True)
    across = np.cross(rib, rng.normal(size=(n, 3)))
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    fold = np.cross(rib, across)
    s = np.broadcast_to(np.asarray(size, np.float64), (n,))[:, None]
    corners = np.stack(
        [
            centres - 0.5 * s * rib,
            centres + s * (0.33 * across + 0.12 * fold),
            centres + 0.5 * s * rib,
            centres + s * (-0.33 * across + 0.12 * fold),
        ],
        axis=1,
    )
    faces = np.array([[0, 1, 2], [0, 2, 3]])[None] + 4 * np.arange(n)[:, None, None]
    return Part(corners.reshape(-1, 3), faces.reshape(-1, 3))


def cobbles(centres: F64, half: ArrayLike, height: ArrayLike, yaw: ArrayLike, rounds: int) -> Part:
    """Return domed paving stones, `rounds` by `rounds` cells each, standing on `centres`.

    Their rims are sunk below, so that no flat corner of a stone lies in the plane of the ground.
    2 rounds**2 triangles each; `half` is (n, 2) half widths along x and z.
    """
    u = np.linspace(-1, 1, rounds + 1)
    x, z = np.meshgrid(u, u)
    dome = 1.1 * ((1 - x**2) * (1 - z**2)) ** 0.25 - 0.1
    # Outer points in to a rounded square, so that joints stay open.
    shrink = 1 - 0.12 * x**2 * z**2
    template = surface(np.stack([x * shrink, dome, z * shrink], axis=-1))
    h = np.asarray(half, np.float64)
    tall = np.broadcast_to(np.asarray(height, np.float64), len(h))
    return place(template, centres, yaw, np.stack([h[:, 0], tall, h[:, 1]], axis=1))


def catenary(start: ArrayLike, end: ArrayLike, sag: ArrayLike, points: int) -> F64:
    """Return (n, points, 3) hanging lines between (n, 3) ends; `sag` is the drop at mid span."""
    a, b = np.atleast_2d(np.asarray(start, float)), np.atleast_2d(np.asarray(end, float))
    t = np.linspace(0, 1, points)[None, :, None]
    line = a[:, None] * (1 - t) + b[:, None] * t
    drop = np.broadcast_to(np.asarray(sag, np.float64), len(a))[:, None] * 4 * (t * (1 - t))[..., 0]
    line[..., 1] -= drop
    return line


def scatter_in_ball(n: int, rng: np.random.Generator, shell: float = 0.0) -> F64:
    """Return (n, 3) points in the unit ball, uniform outside the radius `shell`."""
    d = rng.normal(size=(n, 3))
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    return d * np.cbrt(rng.uniform(shell**3, 1, size=(n, 1)))
