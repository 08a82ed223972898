"""A narrow street with a small square, of any number of triangles."""

from __future__ import annotations

import numpy as np

import hybrid_rt as hrt
from hybrid_rt_scenes.builder import Builder, checked_size, choose_detail
from hybrid_rt_scenes.facades import Facade, add_bays, add_tops, awning
from hybrid_rt_scenes.furniture import bollard, cables, chair, lamp, parasol, table, vase
from hybrid_rt_scenes.plants import Tree, foliage, ivy, wood
from hybrid_rt_scenes.primitives import (
    F64,
    Part,
    boxes,
    cobbles,
    join,
    leaves,
    quad,
    scatter_in_ball,
)

SMALLEST, LARGEST = 2**10, 2**23

# Shares of the triangles; leaves take what is left, so that the number is met exactly.
_BAYS, _TRIM, _PAVING, _FURNITURE, _AWNINGS, _LINES, _WOOD = (
    0.27,
    0.06,
    0.17,
    0.08,
    0.02,
    0.04,
    0.03,
)

_HALF_ROAD, _HALF_STREET, _KERB, _END, _SQUARE = 3.4, 6.0, 0.14, 36.0, 10.0


def street(size: int = 2**20, seed: int = 1) -> hrt.Mesh:
    """Return a street of exactly `size` triangles.

    House fronts on both sides and at both ends, a square with trees and cafe tables, cables with
    bulbs from wall to wall, lamps, awnings, ivy, cobbles. More triangles become more leaves,
    stones, slats, balusters and rounder profiles; the plan of the street stays the same, and so do
    its cameras.

    Parameters
    ----------
    size : int
        Number of triangles, 2**10 to 2**23.
    seed : int
        The same bits for the same seed.

    Raises
    ------
    ArgumentError
        `size` or `seed` is not an integer or out of range.
    """
    rng = checked_size(size, seed, SMALLEST, LARGEST)
    builder = Builder()
    facades = _facades(rng)
    _add_ground(builder)
    add_bays(builder, facades, _BAYS * size)
    add_tops(builder, facades, _TRIM * size)
    _add_paving(builder, _PAVING * size, rng)
    _add_furniture(builder, _FURNITURE * size, rng)
    _add_awnings(builder, facades, _AWNINGS * size)
    _add_lines(builder, _LINES * size, rng)
    _add_plants(builder, size, rng)
    return hrt.Mesh.from_arrays(*builder.arrays())


def _facades(rng: np.random.Generator) -> list[Facade]:
    """Return the house fronts round the street and its square."""
    w, e, s = _HALF_STREET, _END, _SQUARE
    runs = [  # corner, yaw, lengths of the houses
        ((-w, e), np.pi / 2, [11, 13, 10, 14, 12, 12]),
        ((w, -e), -np.pi / 2, [12, 14]),
        ((w + 10, -s), -np.pi / 2, [20]),
        ((w, s), -np.pi / 2, [13, 13]),
        ((w, -s), 0.0, [10]),
        ((w + 10, s), np.pi, [10]),
        ((-w, -e), 0.0, [12]),
        ((w, e), np.pi, [12]),
    ]
    facades: list[Facade] = []
    for (x, z), yaw, widths in runs:
        along = np.array([np.cos(yaw), 0, -np.sin(yaw)])
        at = np.array([x, 0.0, z])
        for width in widths:
            storeys = int(rng.integers(2, 5))
            style = len(facades) % 3
            facades.append(
                Facade((float(at[0]), 0.0, float(at[2])), yaw, float(width), storeys, style)
            )
            at = at + width * along
    return facades


def _add_ground(builder: Builder) -> None:
    r, w, e, k = _HALF_ROAD, _HALF_STREET, _END, _KERB
    builder.add(quad([-r, 0, e], [2 * r, 0, 0], [0, 0, -2 * e]))
    for sign in (-1, 1):
        edge = quad([sign * r, 0, e], [0, 0, -2 * e], [0, k, 0])
        top = quad([sign * r, k, e], [sign * (w - r), 0, 0], [0, 0, -2 * e])
        builder.add(edge, top)
    builder.add(quad([w, k, _SQUARE], [10, 0, 0], [0, 0, -2 * _SQUARE]))


def _add_paving(builder: Builder, budget: float, rng: np.random.Generator) -> None:
    """Add cobbles on the road and slabs on the square; none when they would be giants."""
    length, width = 2 * _END, 2 * _HALF_ROAD
    rounds = 2
    # Stones shrink to 13 cm, then they get rounder.
    while rounds < 8 and 0.8 * budget / (2 * rounds**2) > length * width / 0.13**2:
        rounds += 1
    pitch = max(0.13, float(np.sqrt(length * width / (0.8 * budget / (2 * rounds**2)))))
    if pitch < 0.7:
        rows, columns = int(length / pitch), int(width / pitch)
        z, x = np.meshgrid(np.arange(rows) + 0.5, np.arange(columns) + 0.5, indexing="ij")
        x = (x + 0.25 * (-1.0) ** np.arange(rows)[:, None]) / (columns + 0.5) + 0.25 / columns
        builder.add(
            _stones(
                x.ravel() * width * 0.98 - _HALF_ROAD,
                z.ravel() / rows * length - _END,
                0.0,
                pitch,
                rounds,
                rng,
            )
        )
    pitch = max(0.3, float(np.sqrt(574 / (0.2 * budget / 8))))
    if pitch < 1.2:
        n, m = int(10 / pitch), int(2 * _SQUARE / pitch)
        x, z = np.meshgrid((np.arange(n) + 0.5) / n * 10, (np.arange(m) + 0.5) / m * 2 * _SQUARE)
        builder.add(_stones(x.ravel() + _HALF_STREET, z.ravel() - _SQUARE, _KERB, pitch, 2, rng))
        deep = _HALF_STREET - _HALF_ROAD
        n, m = int(deep / pitch), int(length / pitch)
        x, z = np.meshgrid((np.arange(n) + 0.5) / n * deep, (np.arange(m) + 0.5) / m * length)
        for sign in (-1, 1):
            out = sign * (x.ravel() + _HALF_ROAD)
            builder.add(_stones(out, z.ravel() - _END, _KERB, deep / n, 2, rng))


def _stones(x: F64, z: F64, y: float, pitch: float, rounds: int, rng: np.random.Generator) -> Part:
    n = len(x)
    jitter = rng.uniform(-0.05, 0.05, (2, n)) * pitch
    at = np.stack([x + jitter[0], np.full(n, y), z + jitter[1]], axis=1)
    half = 0.47 * pitch * rng.uniform(0.88, 1.0, (n, 2))
    height = 0.03 * min(1.0, pitch / 0.2) * rng.uniform(0.6, 1.4, n)
    return cobbles(at, half, height, rng.normal(0, 0.04, n), rounds)


def _add_furniture(builder: Builder, budget: float, rng: np.random.Generator) -> None:
    square = np.stack(np.meshgrid([7.6, 9.7, 11.8], [-7.4, -4.6, 4.4, 7.2]), axis=-1).reshape(-1, 2)
    kerb = np.array([[-5.0, z] for z in (-19.0, -16.6, -14.2, 3.2, 5.6, 8.0)])
    spots = np.concatenate([square, kerb]) + rng.uniform(-0.2, 0.2, (18, 2))
    tables = np.column_stack([spots[:, 0], np.full(18, _KERB), spots[:, 1]])
    turn = rng.uniform(0, 2 * np.pi, 18)[:, None] + 2 * np.pi / 3 * np.arange(3)
    turn = (turn + rng.normal(0, 0.2, turn.shape)).ravel()
    around = np.stack([np.sin(turn), 0 * turn, np.cos(turn)], axis=1)
    chairs = np.repeat(tables, 3, axis=0) + 0.62 * around
    chairs[:, 0] = np.maximum(chairs[:, 0], -5.7)
    builder.fill(chair, chairs, turn + np.pi, 0.5 * budget)
    builder.fill(table, tables, np.zeros(18), 0.15 * budget)
    shades = tables[[0, 4, 5, 8, 11]]
    builder.fill(parasol, shades, turn[::3][:5], 0.05 * budget)
    z = np.arange(-33.0, 34.0, 3.0)
    posts = np.concatenate([[[s * 3.7, _KERB, v] for v in z] for s in (-1, 1)])
    builder.fill(bollard, posts, np.zeros(len(posts)), 0.15 * budget)
    pots = np.array([[s * 5.5, _KERB, v] for s in (-1, 1) for v in (-30.0, -23, 13, 20, 28)])
    builder.fill(vase, pots, np.zeros(len(pots)), 0.15 * budget)


def _add_awnings(builder: Builder, facades: list[Facade], budget: float) -> None:
    chosen = [f for f in facades[::2] if f.width > 9]
    detail = choose_detail(lambda d: awning(4.0, d).triangles * len(chosen), budget, 30)
    if awning(4.0, detail).triangles * len(chosen) > budget:
        return
    for facade in chosen:
        wide = facade.width / facade.bays * (facade.bays // 2)
        builder.add(facade.put(awning(wide - 0.2, detail).moved([0.1, 3.3, 0.1])))


def _add_lines(builder: Builder, budget: float, rng: np.random.Generator) -> None:
    """Add cables across the street and along it, bulbs, and lamps."""
    z = np.linspace(-32, 32, 17) + rng.uniform(-1, 1, 17)
    high = rng.uniform(5.2, 8.5, (2, 17))
    slant = rng.uniform(-2.5, 2.5, 17)
    right = np.where(np.abs(z + slant) < _SQUARE, _HALF_STREET + 10.0, _HALF_STREET)
    start = np.column_stack([np.full(17, -_HALF_STREET), high[0], z])
    end = np.column_stack([right, high[1], z + slant])
    ends = np.linspace(-35, 35, 8)
    for height in (6.6, 9.2):
        wall = np.column_stack([np.full(8, -_HALF_STREET + 0.25), np.full(8, height), ends])
        start, end = np.vstack([start, wall[:-1]]), np.vstack([end, wall[1:]])
    sag = rng.uniform(0.3, 0.9, len(start))

    def make(detail: int) -> list[Part]:
        bulbs = 3 * detail if detail < 5 else 15
        return [
            *cables(start[:17], end[:17], sag[:17], detail, bulbs),
            *cables(start[17:], end[17:], 0.4 * sag[17:], detail, 0),
        ]

    detail = choose_detail(lambda d: join(make(d)).triangles, 0.5 * budget, 20)
    if join(make(detail)).triangles <= 0.5 * budget:
        for part in make(detail):
            builder.add(part)
    posts = [[s * 3.9, _KERB, v] for v in (-29.0, -17, -5, 7, 19, 31) for s in (-1, 1)]
    builder.fill(lamp, np.array(posts), np.zeros(12), 0.5 * budget)


def _add_plants(builder: Builder, size: int, rng: np.random.Generator) -> None:
    """Add trees, bushes and ivy; their leaves bring the count to `size`."""
    places = [(-4.5, z) for z in (-30.0, -21.5, -9.5, 0.5, 14.0, 24.5)]
    places += [(4.5, z) for z in (-27.0, -16.0, 17.5, 28.5)]
    trees = [
        Tree((x, _KERB, z), float(rng.uniform(4.8, 5.8)), float(rng.uniform(1.8, 2.4)))
        for x, z in places
    ]
    trees += [Tree((9.0, _KERB, 0.6), 5.6, 3.1), Tree((13.4, _KERB, -2.6), 4.9, 2.4)]
    detail = choose_detail(
        lambda d: wood(trees, d, np.random.default_rng(0))[0].triangles, _WOOD * size, 8
    )
    branches, twigs = wood(trees, detail, rng)
    builder.add(branches)
    left = size - builder.triangles
    number = left // 2
    climbing, bushes = int(0.12 * number), int(0.06 * number)
    w = _HALF_STREET
    builder.add(
        ivy(
            np.array([-w, 0.2, 2.0]),
            np.array([0.0, 0, -9]),
            np.array([0.0, 8.5, 0]),
            np.array([1.0, 0, 0]),
            climbing // 2,
            rng,
        )
    )
    builder.add(
        ivy(
            np.array([w + 10, 0.2, -9.0]),
            np.array([0.0, 0, 8]),
            np.array([0.0, 7, 0]),
            np.array([-1.0, 0, 0]),
            climbing - climbing // 2,
            rng,
        )
    )
    pots = np.array([[s * 5.5, 1.2, v] for s in (-1, 1) for v in (-30.0, -23, 13, 20, 28)])
    where = pots[rng.integers(0, len(pots), bushes)] + 0.42 * scatter_in_ball(bushes, rng, 0.3)
    builder.add(leaves(where, min(0.3, 2.6 / np.sqrt(max(bushes, 1) / 10)), rng))
    for part in foliage(trees, twigs, number - climbing - bushes, rng):
        builder.add(part)
    if left % 2:
        builder.add(Part(boxes([12, 1.0, 9.8], [13, 2, 9.9]).vertices, np.array([[0, 2, 6]])))
