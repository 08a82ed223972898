"""A courtyard with two storeys of colonnades, open to the sky, of any number of triangles."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

import hybrid_rt as hrt
from hybrid_rt_scenes.builder import Builder, checked_size, choose_detail
from hybrid_rt_scenes.furniture import vase
from hybrid_rt_scenes.ornament import (
    along,
    arch,
    baluster,
    column,
    curtain,
    fountain,
    lantern,
    rosette,
    swag,
    tiles,
    vault,
)
from hybrid_rt_scenes.plants import ivy
from hybrid_rt_scenes.primitives import (
    F64,
    Part,
    boxes,
    cobbles,
    join,
    leaves,
    place,
    quad,
    scatter_in_ball,
)
from hybrid_rt_scenes.walls import moulding, opening

SMALLEST, LARGEST = 2**15, 2**23

_FLOOR, _TOP = 4.9, 9.0  # of the gallery, and of its walls
_SPRING, _SPRING_HIGH = 3.1, 7.3  # where the arches begin
_THICK = 0.5


@dataclass(frozen=True)
class Side:
    """One side of the courtyard: in its own frame x runs along it and z points into the court."""

    corner: tuple[float, float, float]
    yaw: float
    bays: int
    width: float  # of a bay
    deep: float  # of the walk behind it

    @property
    def length(self) -> float:
        """Metres along the court."""
        return self.bays * self.width

    def put(self, part: Part) -> Part:
        """Return a part of the side's own frame in the world."""
        return place(part, self.corner, self.yaw)

    def world(self, points: F64) -> F64:
        """Return (n, 3) points of the side's own frame in the world."""
        return self.put(Part(points, np.zeros((0, 3), np.int64))).vertices


SIDES = (
    Side((-12.0, 0.0, -4.0), 0.0, 8, 3.0, 3.5),
    Side((12.0, 0.0, 4.0), np.pi, 8, 3.0, 3.5),
    Side((-12.0, 0.0, 4.0), np.pi / 2, 3, 8 / 3, 3.0),
    Side((12.0, 0.0, -4.0), -np.pi / 2, 3, 8 / 3, 3.0),
)
OUTER = (  # the walls behind, facing inwards, in bays of 3 m
    Side((-15.0, 0.0, -7.5), 0.0, 10, 3.0, 0.0),
    Side((15.0, 0.0, 7.5), np.pi, 10, 3.0, 0.0),
    Side((-15.0, 0.0, 7.5), np.pi / 2, 5, 3.0, 0.0),
    Side((15.0, 0.0, -7.5), -np.pi / 2, 5, 3.0, 0.0),
)


def atrium(size: int = 2**18, seed: int = 1) -> hrt.Mesh:
    """Return a courtyard of exactly `size` triangles.

    Colonnades on two storeys, groin vaults, curtains and swags with folds, balusters, friezes,
    vases with plants, lanterns on chains, a fountain, ivy. More triangles become finer flutes,
    folds, profiles and more leaves; the plan stays the same, and so do its cameras.

    Parameters
    ----------
    size : int
        Number of triangles, 2**15 to 2**23.
    seed : int
        The same bits for the same seed.

    Raises
    ------
    ArgumentError
        `size` or `seed` is not an integer or out of range.
    """
    rng = checked_size(size, seed, SMALLEST, LARGEST)
    builder = Builder()
    _add_shell(builder, 0.05 * size)
    _add_floor(builder, 0.06 * size, rng)
    _add_colonnades(builder, size)
    _add_trim(builder, size)
    _add_cloth(builder, 0.13 * size, rng)
    _add_things(builder, 0.06 * size)
    _add_plants(builder, size, rng)
    return hrt.Mesh.from_arrays(*builder.arrays())


def _detail(
    builder: Builder, make: Callable[[int], list[Part]], budget: float, most: int = 24
) -> None:
    """Add the parts that `make` returns at the largest detail within `budget`, one object each."""
    detail = choose_detail(lambda d: sum(p.triangles for p in make(d)), budget, most)
    for part in make(detail):
        builder.add(part)


def _add_shell(builder: Builder, budget: float) -> None:
    """Add outer walls with niches and windows, gallery floor, ceiling with beams, and roof."""
    below = []
    for side in OUTER:
        at = along(side.bays, side.length, 0, 0) - [side.width / 2, 0.0, 0.0]
        below.append(np.column_stack([side.world(at), np.full(side.bays, side.yaw)]))
    place_low = np.concatenate(below)
    scale_low, scale_high = [3.0, _FLOOR, 1.0], [3.0, _TOP - _FLOOR, 1.0]
    above = np.add(place_low, [0, _FLOOR, 0, 0])

    def walls(detail: int) -> list[Part]:
        niche = opening(0.25, 0.75, 0.12, 0.48, 0.35, 4 + 2 * detail)
        window = opening(0.33, 0.67, 0.25, 0.6, 0.3, 4 + 2 * detail)
        return [
            place(niche, place_low[:, :3], place_low[:, 3], scale_low),
            place(window, above[:, :3], above[:, 3], scale_high),
        ]

    _detail(builder, walls, 0.5 * budget)
    slabs, beams = [], []
    for side in SIDES:
        w, d = side.length, side.deep
        extra = 3.0 if side.bays == 8 else 0.0  # the long sides have the corners
        for y in (_FLOOR - 0.1, _FLOOR, _TOP):
            slab = quad([-extra, y, -0.2], [w + 2 * extra, 0, 0], [0, 0, -d + 0.2])
            slabs.append(side.put(slab))
        n = 3 * side.bays
        x = along(n, w, 0, 0)[:, 0]
        low = np.column_stack([x - 0.08, np.full(n, _TOP - 0.22), np.full(n, -d)])
        beams.append(side.put(boxes(low, low + np.array([0.16, 0.22, d]))))
    builder.add(*slabs)
    builder.add(*beams)

    def roof(detail: int) -> list[Part]:
        return [
            join(
                [
                    side.put(
                        tiles(side.length + 7, 4.6, 1.3, detail).moved([-3.5, _TOP + 0.1, 0.7])
                    )
                    for side in SIDES
                ]
            )
        ]

    _detail(builder, roof, 0.5 * budget, 12)


def _add_floor(builder: Builder, budget: float, rng: np.random.Generator) -> None:
    builder.add(quad([-15, 0, 7.5], [30, 0, 0], [0, 0, -15]))
    pitch = max(0.2, float(np.sqrt(450 / (budget / 8))))
    n, m = int(30 / pitch), int(15 / pitch)
    x, z = np.meshgrid((np.arange(n) + 0.5) / n * 30 - 15, (np.arange(m) + 0.5) / m * 15 - 7.5)
    at = np.stack([x.ravel(), np.zeros(n * m), z.ravel()], axis=1)
    half = 0.49 * np.tile([30 / n, 15 / m], (n * m, 1))
    builder.add(cobbles(at, half, rng.uniform(0.006, 0.014, n * m), np.zeros(n * m), 2))


def _add_colonnades(builder: Builder, size: int) -> None:
    """Add columns, arches on both storeys, corner piers and vaults."""
    low, yaw = [], []
    for side in SIDES:
        x = np.arange(1, side.bays) * side.width
        low.append(side.world(np.column_stack([x, 0 * x, 0 * x])))
        yaw.append(np.full(len(x), side.yaw))
    at, turn = np.concatenate(low), np.concatenate(yaw)
    builder.fill(lambda d: column(_SPRING, 0.24, d), at, turn, 0.14 * size, most=40)
    above = np.add(at, [0, _FLOOR, 0])
    high = _SPRING_HIGH - _FLOOR
    builder.fill(lambda d: column(high, 0.16, d), above, turn, 0.09 * size, most=40)
    piers = np.array([[x, 0.0, z] for x in (-12, 12) for z in (-4, 4)])
    half = np.array([0.42, 0, 0.42])
    builder.add(boxes(piers - half, piers + half + [0, _TOP, 0]))

    def arches(detail: int) -> list[Part]:
        found = []
        for spring, top in ((_SPRING, _FLOOR), (_SPRING_HIGH, _TOP)):
            storey = []
            for side in SIDES:
                one = arch(side.width, spring, top, _THICK, detail)
                x = np.arange(side.bays) * side.width
                storey.append(side.put(place(one, np.column_stack([x, 0 * x, 0 * x]))))
            found.append(join(storey))
        return found

    _detail(builder, arches, 0.1 * size, 40)

    def vaults(detail: int) -> list[Part]:
        found = []
        for side in SIDES:
            one = vault(side.width, side.deep, _SPRING, _FLOOR - 0.15 - _SPRING, detail)
            x = np.arange(side.bays) * side.width
            found.append(side.put(place(one, np.column_stack([x, 0 * x, 0 * x]))))
        corners = np.array([[-15, 0, -4], [12, 0, -4], [-15, 0, 7.5], [12, 0, 7.5]])
        corner = vault(3.0, 3.5, _SPRING, _FLOOR - 0.15 - _SPRING, detail)
        found.append(place(corner, corners))
        return [join(found)]

    _detail(builder, vaults, 0.06 * size, 40)


def _add_trim(builder: Builder, size: int) -> None:
    """Add cornices, dentils, balustrades, friezes of rosettes and two large medallions."""

    def cornices(detail: int) -> list[Part]:
        found = []
        for side in SIDES:
            w, z = side.length, _THICK / 2
            for y, tall, out in ((_FLOOR - 0.2, 0.28, 0.3), (_TOP - 0.3, 0.4, 0.45)):
                ledge = moulding(-0.2, w + 0.2, y, tall, out, detail).moved([0, 0, z])
                found.append(side.put(ledge))
                if detail:
                    n = int(w / 0.3)
                    x = along(n, w, 0, 0)[:, 0]
                    low = np.column_stack([x - 0.07, np.full(n, y - 0.16), np.full(n, z - 0.02)])
                    found.append(side.put(boxes(low, low + np.array([0.14, 0.17, 0.15]))))
        return [join(found)]

    _detail(builder, cornices, 0.05 * size)
    posts, rails, flowers, turns = [], [], [], []
    for side in SIDES:
        n = 9 * side.bays
        posts.append(side.world(along(n, side.length, _FLOOR + 0.08, 0)))
        w = side.length
        rails.append(
            side.put(
                boxes(
                    [[0, _FLOOR, -0.12], [0, _FLOOR + 0.88, -0.12]],
                    [[w, _FLOOR + 0.08, 0.12], [w, _FLOOR + 1.0, 0.12]],
                )
            )
        )
        n = 5 * side.bays
        flowers.append(side.world(along(n, w, _FLOOR - 0.55, _THICK / 2)))
        turns.append(np.full(n, side.yaw))
    builder.add(*rails)
    every = np.concatenate(posts)
    builder.fill(baluster, every, 0.0, 0.09 * size)
    at, yaw = np.concatenate(flowers), np.concatenate(turns)
    builder.fill(rosette, at, yaw, 0.05 * size, scale=0.13)
    builder.fill(
        rosette, [[-14.98, 6.6, 0.0], [14.98, 6.6, 0.0]], [np.pi / 2, -np.pi / 2], 0.01 * size,
        scale=0.9, most=60,
    )  # fmt: skip


def _add_cloth(builder: Builder, budget: float, rng: np.random.Generator) -> None:
    """Add curtains in every other bay below, and swags across the court above."""
    seeds = rng.integers(0, 2**31, 32)
    hung = [(side, bay) for side in SIDES[:2] for bay in range(0, side.bays, 2)]
    hung += [(SIDES[1], 3), (SIDES[2], 0), (SIDES[2], 2), (SIDES[3], 0), (SIDES[3], 2)]

    def curtains(detail: int) -> list[Part]:
        found = []
        for (side, bay), seed in zip(hung, seeds, strict=False):
            cloth = curtain(side.width - 0.6, _SPRING, detail, np.random.default_rng(seed))
            found.append(side.put(cloth.moved([(bay + 0.5) * side.width, 0, -0.35])))
        return found

    _detail(builder, curtains, 0.65 * budget, 60)

    def swags(detail: int) -> list[Part]:
        return [
            swag(7.4, 1.7, 1.5, detail, np.random.default_rng(seed)).moved([x, 7.9, 0])
            for x, seed in zip((-9.0, -4.5, 4.5, 9.0), seeds[16:], strict=False)
        ]

    _detail(builder, swags, 0.35 * budget, 60)


_POTS = np.array([[x, 0.0, s * 3.2] for s in (-1, 1) for x in (-9.0, -3.0, 3.0, 9.0)])


def _add_things(builder: Builder, budget: float) -> None:
    builder.fill(vase, _POTS, 0.0, 0.4 * budget)
    builder.fill(fountain, [[0.0, 0.0, 0.0]], 0.0, 0.2 * budget, most=40)
    hung = [
        side.world(along(side.bays, side.length, _FLOOR - 0.2, -side.deep / 2)) for side in SIDES
    ]
    builder.fill(lambda d: lantern(1.3, d), np.concatenate(hung), 0.0, 0.4 * budget)


def _add_plants(builder: Builder, size: int, rng: np.random.Generator) -> None:
    """Add plants in the vases and ivy from the gallery; they bring the count to `size`.

    All other shares add up to less than 0.9, so there is always something left to bring.
    """
    left = size - builder.triangles
    number = left // 2
    hanging = number // 2
    potted = number - hanging
    where = _POTS[rng.integers(0, 8, potted)] + [0, 1.25, 0]
    where = where + 0.5 * scatter_in_ball(potted, rng) * [1, 1.1, 1]
    builder.add(leaves(where, min(0.35, 4.2 / np.sqrt(max(potted, 1) / 8)), rng))
    spots = [
        (SIDES[0], 4.0, 3.5),
        (SIDES[0], 16.0, 5.0),
        (SIDES[1], 9.0, 4.5),
        (SIDES[2], 2.0, 4.0),
    ]
    shares = np.diff(np.linspace(0, hanging, len(spots) + 1).astype(int))
    for (side, start, long), n in zip(spots, shares, strict=True):
        # From the rail downwards.
        corner = side.world(np.array([[start, _FLOOR + 1.05, 0.3]]))[0]
        end = side.world(np.array([[start + long, _FLOOR + 1.05, 0.3]]))[0]
        out = np.array([np.sin(side.yaw), 0.0, np.cos(side.yaw)])
        builder.add(ivy(corner, end - corner, np.array([0.0, -2.1, 0.0]), out, int(n), rng))
    if left % 2:
        builder.add(quad([-0.2, 2.1, 0], [0.4, 0, 0], [0, 0.2, 0]).first(1))
