"""House fronts: bays with windows, doors and shops, cornices, roofs.

A facade has its own frame: x along the wall, y up, z out of it. A bay is modelled in a unit cell
(x and y from 0 to 1, z in metres) and placed many times, scaled to the bay's width and height.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from hybrid_rt_scenes.builder import Builder, choose_detail
from hybrid_rt_scenes.primitives import (
    EMPTY,
    F64,
    Part,
    boxes,
    join,
    lathe,
    leaves,
    place,
    quad,
    surface,
    tubes,
)
from hybrid_rt_scenes.walls import moulding, opening

GROUND_HEIGHT = 4.0
STOREY_HEIGHT = 3.2
MOST_DETAIL = 28


@dataclass(frozen=True)
class Facade:
    """A house front.

    Attributes
    ----------
    corner : three float
        World position of its lower corner, from which it runs along its own x.
    yaw : float
        Its outward direction is (sin yaw, 0, cos yaw).
    width : float
        Metres.
    storeys : int
        Above the ground floor.
    style : int
        Which windows it has.
    """

    corner: tuple[float, float, float]
    yaw: float
    width: float
    storeys: int
    style: int

    @property
    def bays(self) -> int:
        """Number of bays side by side."""
        return max(2, round(self.width / 2.5))

    @property
    def height(self) -> float:
        """Metres up to the cornice."""
        return GROUND_HEIGHT + self.storeys * STOREY_HEIGHT

    def world(self, points: F64) -> F64:
        """Return (n, 3) points of the facade's own frame in the world."""
        return place(Part(points, np.zeros((0, 3), np.int64)), self.corner, self.yaw).vertices

    def put(self, part: Part) -> Part:
        """Return a part of the facade's own frame in the world."""
        return place(part, self.corner, self.yaw)


def _bars(x0: float, x1: float, y0: float, y1: float, z: float, across: int, up: int) -> Part:
    """Return a window frame with `across` by `up` panes."""
    low = [[x, y0, z] for x in np.linspace(x0, x1, across + 1) - 0.012]
    high = [[x + 0.024, y1, z + 0.05] for x in np.linspace(x0, x1, across + 1) - 0.012]
    low += [[x0, y, z] for y in np.linspace(y0, y1, up + 1) - 0.008]
    high += [[x1, y + 0.016, z + 0.045] for y in np.linspace(y0, y1, up + 1) - 0.008]
    return boxes(low, high)


def _shutter(x0: float, x1: float, y0: float, y1: float, slats: int) -> Part:
    frame = boxes(
        [[x0, y0, 0.02], [x1 - 0.02, y0, 0.02], [x0, y0, 0.02], [x0, y1 - 0.02, 0.02]],
        [[x0 + 0.02, y1, 0.07], [x1, y1, 0.07], [x1, y0 + 0.02, 0.07], [x1, y1, 0.07]],
    )
    y = np.linspace(y0 + 0.03, y1 - 0.03, slats)[:, None]
    gap = (y1 - y0) / slats
    slat = boxes([0, -0.2 * gap, 0.0], [1, 0.2 * gap, 0.012])
    tilt = slat.vertices.copy()
    tilt[:, 2] += 0.5 * tilt[:, 1]
    at = np.hstack([np.full_like(y, x0), y, np.full_like(y, 0.03)])
    return join([frame, place(Part(tilt, slat.faces), at, 0.0, [[x1 - x0, 1.0, 1.0]])])


def _balcony(x0: float, x1: float, y: float, detail: int) -> Part:
    """Return a slab on two brackets with balusters and a rail."""
    deep, tall = 0.55, 0.3
    slab = boxes([x0, y - 0.045, 0.0], [x1, y, deep])
    n, sides = 7 + detail // 2, 3 + detail // 2
    s = np.linspace(0, 1, 4 + detail)
    profile = np.column_stack([0.016 + 0.014 * np.sin(2.6 * np.pi * s) ** 2, tall * s])
    baluster = lathe(profile, sides).scaled([1, 1, 1.6])
    x = np.linspace(x0 + 0.02, x1 - 0.02, n)
    front = place(baluster, np.column_stack([x, np.full(n, y), np.full(n, deep - 0.05)]))
    rail = boxes(
        [[x0, y + tall, deep - 0.08], [x0, y + tall, 0], [x1 - 0.03, y + tall, 0]],
        [
            [x1, y + tall + 0.02, deep],
            [x0 + 0.03, y + tall + 0.02, deep],
            [x1, y + tall + 0.02, deep],
        ],
    )
    curve = np.linspace(0, 1, 4 + detail)
    path = np.column_stack([0 * curve, -0.12 * (1 - curve) ** 2, 0.5 * curve])
    feet = np.array([[[x0 + 0.1, y - 0.05, 0]], [[x1 - 0.1, y - 0.05, 0]]])
    bracket = tubes(path + feet, 0.025, sides)
    return join([slab, front, rail, bracket])


def window_bay(detail: int, style: int) -> tuple[Part, Part]:
    """Return wall and trim of one bay of an upper storey; detail 0 is a blank wall."""
    if detail == 0:
        return quad([0, 0, 0], [1, 0, 0], [0, 1, 0]), EMPTY
    x0, x1, y0, y1 = 0.29, 0.71, 0.26, 0.78
    arch = 2 + 2 * detail if style == 1 else 0
    wall = opening(x0, x1, y0, y1, 0.22, arch)
    parts: list[Part] = []
    if detail >= 2:
        parts.append(_bars(x0, x1, y0, y1, -0.2, 2, 3))
        parts.append(moulding(x0 - 0.05, x1 + 0.05, y0 - 0.035, 0.035, 0.12, detail - 2))
    if detail >= 3:
        if style == 0:
            slats = 2 + 2 * detail
            parts += [_shutter(0.07, 0.27, y0, y1, slats), _shutter(0.73, 0.93, y0, y1, slats)]
            parts.append(moulding(x0 - 0.06, x1 + 0.06, y1 + 0.05, 0.06, 0.16, detail))
        elif style == 1:
            parts.append(_balcony(x0 - 0.14, x1 + 0.14, y0 - 0.1, detail - 3))
        else:
            parts.append(boxes([x0, y0, 0.02], [x1, y0 + 0.07, 0.2]))
            rng = np.random.default_rng(7)
            n = 12 * (detail - 2) ** 2
            at = rng.uniform([x0, y0 + 0.05, 0.0], [x1, y0 + 0.17, 0.24], (n, 3))
            parts.append(leaves(at, 0.2 / np.sqrt(detail), rng))
            parts.append(moulding(x0 - 0.04, x1 + 0.04, y1, 0.05, 0.1, detail))
    return wall, join(parts)


def shop_bay(detail: int, door: bool) -> tuple[Part, Part]:
    """Return wall and trim of one bay of the ground floor, a shop window or a door."""
    if detail == 0:
        return quad([0, 0, 0], [1, 0, 0], [0, 1, 0]), EMPTY
    parts: list[Part] = []
    if door:
        wall = opening(0.28, 0.72, 0.0, 0.62, 0.35, 2 + 2 * detail)
        if detail >= 2:
            x, y = np.meshgrid([0.32, 0.53], [0.05, 0.24, 0.43])
            low = np.column_stack([x.ravel(), y.ravel(), np.full(6, -0.36)])
            parts.append(boxes(low, np.add(low, [0.15, 0.15, 0.05])))
            knob = lathe([[0, -0.02], [0.02, 0], [0, 0.02]], 4 + detail)
            parts.append(knob.moved([0.5, 0.3, -0.3]))
            parts.append(boxes([0.22, 0.0, 0.0], [0.78, 0.035, 0.3]))
    else:
        wall = opening(0.08, 0.92, 0.2, 0.72, 0.25, 0)
        if detail >= 2:
            parts.append(_bars(0.08, 0.92, 0.2, 0.72, -0.22, 3, 2))
            low = np.array([[0.1 + 0.28 * k, 0.04, 0.0] for k in range(3)])
            parts.append(boxes(low, np.add(low, [0.24, 0.12, 0.04])))
    if detail >= 2:
        parts.append(moulding(0.0, 1.0, 0.9, 0.07, 0.18, detail - 2))
        n, sides = 2 + detail, 4 + detail
        pilaster = lathe(
            [[0.05, 0.0], [0.035, 0.04], [0.03, 0.5], [0.035, 0.86], [0.06, 0.9]], sides
        )
        parts.append(pilaster.scaled([1, 1, 2.2]).moved([0.0, 0.0, 0.0]))
        dentils = np.linspace(0.03, 0.93, n)
        low = np.column_stack([dentils, np.full(n, 0.85), np.zeros(n)])
        parts.append(boxes(low, np.add(low, [0.4 / n, 0.05, 0.1])))
    return wall, join(parts)


def _bay_places(facades: list[Facade], storey_bays: bool) -> tuple[F64, F64, F64, F64]:
    """Return corner, yaw, scale and style of every bay, above or on the ground floor."""
    at, yaw, scale, style = [], [], [], []
    for facade in facades:
        wide = facade.width / facade.bays
        storeys = range(1, facade.storeys + 1) if storey_bays else range(1)
        for storey in storeys:
            y = GROUND_HEIGHT + (storey - 1) * STOREY_HEIGHT if storey else 0.0
            own = np.zeros((facade.bays, 3))
            own[:, 0], own[:, 1] = wide * np.arange(facade.bays), y
            at.append(facade.world(own))
            yaw.append(np.full(facade.bays, facade.yaw))
            tall = STOREY_HEIGHT if storey else GROUND_HEIGHT
            scale.append(np.tile([wide, tall, 1.0], (facade.bays, 1)))
            if storey:
                style.append(np.full(facade.bays, (facade.style + (storey > 2)) % 3))
            else:
                style.append((np.arange(facade.bays) + facade.style) % 3 == 1)
    return tuple(np.concatenate(x).astype(np.float64) for x in (at, yaw, scale, style))  # type: ignore[return-value]


def add_bays(builder: Builder, facades: list[Facade], budget: float) -> None:
    """Add all bays of `facades`, as detailed as `budget` triangles allow."""
    upper = _bay_places(facades, True)
    ground = _bay_places(facades, False)
    kinds: list[tuple[Callable[[int], tuple[Part, Part]], tuple[F64, F64, F64, F64], float]] = [
        (lambda d: window_bay(d, 0), upper, 0),
        (lambda d: window_bay(d, 1), upper, 1),
        (lambda d: window_bay(d, 2), upper, 2),
        (lambda d: shop_bay(d, False), ground, 0),
        (lambda d: shop_bay(d, True), ground, 1),
    ]
    numbers = [int((places[3] == want).sum()) for _, places, want in kinds]
    for (make, places, want), n in zip(kinds, numbers, strict=True):
        if n == 0:
            continue
        share = budget * n / sum(numbers)
        detail = choose_detail(partial(_cost, make, n), share, MOST_DETAIL)
        chosen = places[3] == want
        for part in make(detail):
            builder.add(place(part, *(p[chosen] for p in places[:3])))


def _cost(make: Callable[[int], tuple[Part, Part]], copies: int, detail: int) -> int:
    return copies * sum(part.triangles for part in make(detail))


def add_tops(builder: Builder, facades: list[Facade], budget: float) -> None:
    """Add roofs and chimneys, and cornices, dentils and corner stones as `budget` allows."""
    for facade in facades:
        w, h = facade.width, facade.height
        slope = quad([0, h, 0], [w, 0, 0], [0, 2.4, -1.6])
        flat = quad([0, h + 2.4, -1.6], [w, 0, 0], [0, 0, -6.0])
        sides = [
            Part(
                np.array([[x, h, 0], [x, h + 2.4, -1.6], [x, h, -7.6], [x, h + 2.4, -7.6]]),
                np.array([[0, 1, 2], [1, 3, 2]]),
            )
            for x in (0.0, w)
        ]
        # Where another front stands in the plane of a side wall, only what rises above it is built.
        low = [_front_beside(facade, x, facades) for x in (0.0, w)]
        walls = [
            quad([x, y, 0], [0, 0, -7.6], [0, h - y, 0])
            for x, y in zip((0.0, w), low, strict=True)
            if y < h
        ]
        builder.add(facade.put(join([slope, flat, *sides, *walls])))
    each = budget / len(facades)
    for facade in facades:
        builder.add(facade.put(_trim(facade, each)))


def _front_beside(facade: Facade, x: float, facades: list[Facade]) -> float:
    """Return the height of the front that covers the side wall of `facade` at x, or 0."""
    inside = facade.put(Part(np.array([[x, 0.0, -1.0]]), np.empty((0, 3), np.int64))).vertices[0]
    for other in facades:
        away = inside - np.array(other.corner)
        c, s = np.cos(other.yaw), np.sin(other.yaw)
        along, out = c * away[0] - s * away[2], s * away[0] + c * away[2]
        if abs(out) < 1e-6 and 0 <= along <= other.width:
            return other.height
    return 0.0


def _trim(facade: Facade, budget: float) -> Part:
    w, h = facade.width, facade.height

    def make(detail: int) -> Part:
        cornice = moulding(-0.1, w + 0.1, h - 0.45, 0.45, 0.55, detail)
        parts = [cornice]
        if detail >= 1:
            storeys = [GROUND_HEIGHT + STOREY_HEIGHT * k for k in range(facade.storeys)]
            parts += [moulding(0, w, y - 0.12, 0.18, 0.14, detail - 1) for y in storeys]
            dormers = 0.5 + np.arange(facade.bays // 2) * 2
            x = dormers * w / facade.bays
            low = np.column_stack([x, np.full(len(x), h + 0.4), np.full(len(x), -1.6)])
            parts.append(boxes(low, np.add(low, [1.2, 1.5, 1.2])))
            parts.append(boxes([w - 1.6, h, -3.4], [w - 0.5, h + 4.0, -2.6]))
        if detail >= 2:
            n = int(w / 0.4)
            x = (np.arange(n) + 0.25) * w / n
            low = np.column_stack([x, np.full(n, h - 0.62), np.zeros(n)])
            parts.append(boxes(low, np.add(low, [0.2, 0.17, 0.22])))
            y = np.arange(0.2, h - 0.8, 0.5)
            long = np.where(np.arange(len(y)) % 2, 0.45, 0.28)
            for x0, sign in ((0.0, 1.0), (w, -1.0)):
                a = np.column_stack([np.full(len(y), x0), y, np.zeros(len(y))])
                b = np.column_stack([x0 + sign * long, y + 0.44, np.full(len(y), 0.06)])
                parts.append(boxes(np.minimum(a, b), np.maximum(a, b)))
            pot = lathe([[0.12, 0], [0.1, 0.5], [0.14, 0.55], [0.13, 0.62]], 4 + detail)
            at = [[w - 1.4 + 0.35 * k, h + 4.0, -3.0] for k in range(3)]
            parts.append(place(pot, at))
        return join(parts)

    detail = choose_detail(lambda d: make(d).triangles, budget, MOST_DETAIL)
    part = make(detail)
    return part if part.triangles <= budget else Part(part.vertices, part.faces[:0])


def awning(width: float, detail: int) -> Part:
    """Return a striped cloth over a shop, from the wall at z = 0 out and down, with its arms."""
    columns, rows = 2 + 6 * detail, 2 + detail
    x = np.linspace(0, width, columns)
    t = np.linspace(0, 1, rows)[:, None]
    sag = 0.05 * np.sin(np.pi * t) * np.cos(12 * np.pi * x / width)
    z = np.broadcast_to(1.7 * t, (rows, columns))
    y = -0.75 * t**1.3 - sag
    cloth = np.stack([np.broadcast_to(x, (rows, columns)), y, z], axis=-1)
    # The hanging edge, scalloped.
    hem = cloth[-1] - np.column_stack(
        [0 * x, 0.16 + 0.09 * np.abs(np.sin(8 * np.pi * x / width)), 0 * x]
    )
    arms = np.array([[[0.05, -0.9, 0.0], [0.05, -0.75, 1.68]]])
    arms = np.concatenate([arms, np.add(arms, [width - 0.1, 0, 0])])
    return join([surface(cloth), surface([cloth[-1], hem]), tubes(arms, 0.02, 3 + detail)])
