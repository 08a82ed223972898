"""Columns, arches, vaults, cloth and other fine work of the atrium."""

from __future__ import annotations

import numpy as np

from hybrid_rt_scenes.furniture import smooth
from hybrid_rt_scenes.primitives import (
    F64,
    Part,
    boxes,
    join,
    lathe,
    place,
    quad,
    surface,
    surfaces,
    tubes,
)


def column(height: float, radius: float, detail: int) -> Part:
    """Return a column with a moulded base, a fluted shaft and a capital of leaves."""
    r, h = radius, height
    sides = 6 + 2 * detail
    base = lathe(
        smooth([[1.45 * r, 0.12], [1.5 * r, 0.2], [1.2 * r, 0.28], [1.3 * r, 0.36], [r, 0.42]],
               detail // 3), sides
    )  # fmt: skip
    s = np.linspace(0, 1, 3 + detail // 2)
    swelling = r * (1 - 0.14 * s + 0.05 * np.sin(np.pi * s))
    shaft = lathe(
        np.column_stack([swelling, 0.42 + (h - 1.0) * s]),
        sides if detail < 5 else 16 * (1 + detail // 5),
        flutes=0 if detail < 5 else 16,
        depth=0.09,
    )
    top = h - 0.58
    bell = lathe(
        smooth([[0.86 * r, top], [0.95 * r, top + 0.04], [0.86 * r, top + 0.08],
                [0.95 * r, h - 0.3], [1.4 * r, h - 0.12]], detail // 3), sides
    )  # fmt: skip
    blocks = boxes(
        [[-1.6 * r, 0, -1.6 * r], [-1.6 * r, h - 0.12, -1.6 * r]],
        [[1.6 * r, 0.12, 1.6 * r], [1.6 * r, h, 1.6 * r]],
    )
    parts = [base, shaft, bell, blocks]
    if detail >= 2:
        for row, (low, number) in enumerate(((top + 0.06, 8), (top + 0.2, 8))):
            turn = 2 * np.pi * (np.arange(number) + 0.5 * row) / number
            out = np.stack([np.sin(turn), 0 * turn, np.cos(turn)], axis=1) * r * 0.9
            parts.append(place(_acanthus(r, detail - 2), np.add(out, [0.0, low, 0.0]), turn))
    return join(parts)


def _acanthus(r: float, detail: int) -> Part:
    """Return a leaf that climbs along +y and curls over towards +z, its edge notched."""
    rows, columns = 3 + detail // 2, 3 + 2 * (detail // 3)
    t = np.linspace(0, 1, rows)[:, None]
    u = np.linspace(-1, 1, columns)[None]
    notch = 1 + 0.25 * np.cos(5 * np.pi * t)
    x = 0.42 * r * u * np.sin(np.pi * (0.15 + 0.75 * t)) * notch
    y = 0.26 * np.sin(0.62 * np.pi * t) - 0.03 * u**2
    z = 0.75 * r * t**2.5 + 0.1 * r * (1 - u**2)
    return surface(np.stack(np.broadcast_arrays(x, y, z), axis=-1))


def arch(width: float, spring: float, top: float, thick: float, detail: int) -> Part:
    """Return the wall above one arch from 0 to `width`, both faces, and its moulded band."""
    n = 6 + 2 * detail
    turn = np.pi * (1 - np.linspace(0, 1, n + 1))
    half = width / 2 - 0.32
    rise = min(half, top - spring - 0.25)
    curve = np.column_stack([width / 2 + half * np.cos(turn), spring + rise * np.sin(turn)])
    outer = np.column_stack([np.linspace(0, width, n + 1), np.full(n + 1, top)])
    outer[0, 1] = outer[-1, 1] = top
    inner3 = np.column_stack([curve, np.full(n + 1, thick / 2)])
    outer3 = np.column_stack([outer, np.full(n + 1, thick / 2)])
    back = np.array([0.0, 0.0, -thick])
    parts = [surface([outer3, inner3]), surface([outer3 + back, inner3 + back])]
    parts.append(surface([inner3, inner3 + back]))
    for x0, x1 in ((0.0, 0.32), (width - 0.32, width)):
        foot = Part(
            np.array([[x0, spring, 0], [x1, spring, 0], [x0 if x0 == 0 else x1, top, 0]]),
            np.array([[0, 1, 2]]),
        )
        parts += [foot.moved([0, 0, thick / 2]), foot.moved([0, 0, -thick / 2])]
        parts.append(quad([x0, spring, thick / 2], [x1 - x0, 0, 0], back))
    # The band: a profile swept along the arch on both faces.
    k = 3 + detail
    s = np.linspace(0, 1, k)[:, None]
    away = 1 + 0.16 * s
    out = thick / 2 + 0.07 * np.sin(np.pi * s) * (1 + 0.3 * np.cos(4 * np.pi * s))
    band = np.stack(
        np.broadcast_arrays(
            width / 2 + half * away * np.cos(turn), spring + rise * away * np.sin(turn), out
        ),
        axis=-1,
    )
    parts += [surface(band), surface(band * [1, 1, -1])]
    return join(parts)


def vault(width: float, deep: float, spring: float, rise: float, detail: int) -> Part:
    """Return a groin vault over (0, width) by (0, -deep)."""
    n = 4 + 2 * detail
    u = np.linspace(-1, 1, n + 1)
    f = np.sqrt(np.maximum(0, 1 - u**2))
    height = spring + rise * np.maximum(f[None, :], f[:, None])
    x = np.broadcast_to((u[None] + 1) / 2 * width, height.shape)
    z = np.broadcast_to(-(u[:, None] + 1) / 2 * deep, height.shape)
    return surface(np.stack([x, height, z], axis=-1))


def curtain(width: float, tall: float, detail: int, rng: np.random.Generator) -> Part:
    """Return a cloth hung from y = `tall`, parted in the middle, with folds widening downwards."""
    columns, rows = 5 + 6 * detail, 3 + 2 * detail
    phase = rng.uniform(0, 2 * np.pi, 3)
    parts = []
    for side in (-1.0, 1.0):
        u = np.linspace(0, 1, columns)[None]
        t = np.linspace(0, 1, rows)[:, None]
        tied = 1 - 0.55 * np.exp(-(((t - 0.62) / 0.2) ** 2))
        x = side * (width / 2 - (width / 2 - 0.1) * u * (0.55 + 0.45 * (1 - t) ** 0.5) * tied)
        fold = np.sin(2 * np.pi * 5 * u + phase[0]) + 0.4 * np.sin(2 * np.pi * 11 * u + phase[1])
        z = (0.05 + 0.07 * t) * fold + 0.03 * np.sin(7 * t + phase[2])
        y = np.broadcast_to(tall - (tall - 0.12) * t, z.shape) - 0.04 * np.cos(10 * np.pi * u) * t
        parts.append(np.stack(np.broadcast_arrays(x, y, z), axis=-1))
    rod = np.array(
        [[[-width / 2, tall + 0.03, 0.0], [0, tall + 0.03, 0], [width / 2, tall + 0.03, 0]]]
    )
    return join([surfaces(np.stack(parts)), tubes(rod, 0.03, 4 + detail)])


def swag(length: float, wide: float, sag: float, detail: int, rng: np.random.Generator) -> Part:
    """Return a cloth hung by both ends along z, from -length / 2 to length / 2, with ripples."""
    rows, columns = 9 + 8 * detail, 4 + 3 * detail
    t = np.linspace(-1, 1, rows)[:, None]
    u = np.linspace(-1, 1, columns)[None]
    phase = rng.uniform(0, 6, 2)
    pinch = 0.35 + 0.65 * (1 - t**2) ** 0.5
    x = wide / 2 * u * pinch + 0.1 * np.sin(4 * t + phase[0])
    y = -sag * (1 - t**2) - 0.16 * u**2 * pinch + 0.05 * np.sin(9 * u + 5 * t + phase[1])
    z = np.broadcast_to(length / 2 * t, y.shape)
    return surface(np.stack(np.broadcast_arrays(x, y, z), axis=-1))


def baluster(detail: int) -> Part:
    """Return a baluster of 0.8 m."""
    profile = smooth(
        [[0.06, 0], [0.06, 0.06], [0.035, 0.1], [0.075, 0.3], [0.03, 0.6], [0.055, 0.7],
         [0.055, 0.8]], detail // 2,
    )  # fmt: skip
    return lathe(profile, 4 + detail)


def rosette(detail: int) -> Part:
    """Return a flower in relief of radius 1 in the plane z = 0, rising along +z."""
    rings, around = 2 + detail, 8 + 4 * detail
    r = np.linspace(0.04, 1, rings + 1)[:, None]
    a = np.linspace(0, 2 * np.pi, around + 1)[None]
    petals = np.abs(np.cos(4 * a)) ** 0.7
    edge = r * (0.75 + 0.25 * petals)
    z = 0.28 * np.sin(np.pi * r**0.7) * (0.5 + 0.5 * petals) + 0.25 * np.exp(-30 * r**2)
    points = np.stack(np.broadcast_arrays(edge * np.cos(a), edge * np.sin(a), z), axis=-1).copy()
    points[:, -1] = points[:, 0]
    return surface(points)


def lantern(drop: float, detail: int) -> Part:
    """Return a lantern that hangs by a chain of rings, `drop` metres below the origin."""
    body = lathe(
        smooth([[0.0, -0.55], [0.06, -0.5], [0.17, -0.36], [0.2, -0.12], [0.08, 0.0], [0.0, 0.06]],
               detail // 2), 6 + detail
    ).moved([0, -drop, 0])  # fmt: skip
    links = max(2, int(drop / 0.12)) if detail else 0
    if not links:
        line = np.array([[[0.0, -drop, 0.0], [0, -drop / 2, 0], [0, 0, 0]]])
        return join([body, tubes(line, 0.01, 3)])
    around = 5 + detail
    a = np.linspace(0, 2 * np.pi, around + 1)
    ring = np.column_stack([0.035 * np.cos(a), 0.075 * np.sin(a), 0 * a])
    link = tubes(ring[None], 0.011, 3 + detail // 3)
    y = -drop * (np.arange(links) + 0.5) / links
    at = np.column_stack([0 * y, y, 0 * y])
    return join([body, place(link, at, np.pi / 2 * (np.arange(links) % 2))])


def fountain(detail: int) -> Part:
    """Return a basin of two tiers, 2.1 m high."""
    profile = [
        [1.7, 0], [1.75, 0.12], [1.6, 0.2], [1.55, 0.55], [1.75, 0.62], [1.62, 0.68], [1.4, 0.6],
        [1.3, 0.25], [0.3, 0.22], [0.22, 0.5], [0.3, 0.9], [0.16, 1.05], [0.75, 1.25], [0.8, 1.32],
        [0.6, 1.3], [0.15, 1.2], [0.1, 1.6], [0.16, 1.8], [0.0, 2.1],
    ]  # fmt: skip
    return lathe(smooth(profile, detail), 10 + 6 * detail, flutes=12, depth=0.03)


def tiles(width: float, deep: float, rise: float, detail: int) -> Part:
    """Return a roof over (0, width), climbing from z = 0 to z = -deep, ribbed along the slope."""
    ribs = max(4, int(width / 0.3))
    columns = ribs * (2 + 2 * min(detail, 4)) + 1
    rows = 2 + detail
    u = np.linspace(0, 1, columns)[None]
    t = np.linspace(0, 1, rows)[:, None]
    y = rise * t + 0.07 * np.abs(np.sin(np.pi * ribs * u)) - 0.03 * (t * (rows - 1) % 2)
    points = np.stack(np.broadcast_arrays(width * u, y, -deep * t), axis=-1)
    return surface(points)


def along(count: int, width: float, y: float, z: float) -> F64:
    """Return (count, 3) points at the middle of `count` equal pieces of (0, width)."""
    x = (np.arange(count) + 0.5) * width / count
    return np.column_stack([x, np.full(count, y), np.full(count, z)])
