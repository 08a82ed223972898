"""Things that stand and hang about: chairs, tables, lamps, cables, vases."""

from __future__ import annotations

import numpy as np

from hybrid_rt_scenes.primitives import (
    F64,
    Part,
    boxes,
    catenary,
    join,
    lathe,
    place,
    surface,
    tubes,
)


def smooth(profile: list[list[float]], detail: int) -> F64:
    """Return a profile with `detail` further points in each of its pieces, rounded."""
    p = np.array(profile)
    if detail <= 0:
        return p
    at = np.linspace(0, len(p) - 1, (len(p) - 1) * (detail + 1) + 1)
    lower = np.minimum(at.astype(int), len(p) - 2)
    t = (at - lower)[:, None]
    # Catmull-Rom through the given points, ends doubled.
    padded = np.vstack([p[:1], p, p[-1:]])
    a, b, c, d = (padded[lower + k] for k in range(4))
    curve = 0.5 * (
        2 * b + (c - a) * t + (2 * a - 5 * b + 4 * c - d) * t**2 + (3 * b - a - 3 * c + d) * t**3
    )
    curve[0], curve[-1] = p[0], p[-1]  # to the bit, so that a pole stays a pole
    # A curve that swings below the axis would pinch the surface.
    curve[1:-1, 0] = np.maximum(curve[1:-1, 0], 0.004)
    return np.asarray(curve)


def chair(detail: int) -> Part:
    """Return a cafe chair, 0.9 m tall, its back towards -z; detail 0 is made of boxes."""
    if detail == 0:
        return boxes(
            [[-0.2, 0.43, -0.2], [-0.2, 0.6, -0.22], [-0.2, 0, -0.2], [0.16, 0, -0.2],
             [-0.2, 0, 0.16], [0.16, 0, 0.16]],
            [[0.2, 0.46, 0.2], [0.2, 0.9, -0.18], [-0.16, 0.6, -0.16], [0.2, 0.6, -0.16],
             [-0.16, 0.43, 0.2], [0.2, 0.43, 0.2]],
        )  # fmt: skip
    sides, k = 3 + detail, 3 + 2 * detail
    s = np.linspace(0, 1, k)
    turn = np.pi * s
    back = np.column_stack(
        [-0.2 * np.cos(turn), 0.45 + 0.45 * np.sin(turn), -0.2 - 0.06 * np.sin(turn)]
    )
    inner = back * [0.55, 1, 1] - [0, 0.07, 0] * np.sin(turn)[:, None]
    curves = [back, inner]
    for x in (-0.2, 0.2):
        for z in (-0.2, 0.2):
            splay = 0.06 * (1 - s) ** 2
            curves.append(
                np.column_stack([x * (0.85 + splay * 3), 0.45 * s, z * (0.85 + splay * 3)])
            )
    hoop = 2 * np.pi * s
    curves.append(np.column_stack([0.19 * np.cos(hoop), np.full(k, 0.45), 0.19 * np.sin(hoop)]))
    slats = 3 + 2 * detail
    places = np.linspace(-0.17, 0.17, slats)
    low = np.column_stack([places - 0.2 / slats, np.full(slats, 0.45), np.full(slats, -0.18)])
    return join(
        [
            tubes(np.stack(curves), 0.012, sides),
            boxes(low, np.add(low, [0.3 / slats, 0.015, 0.36])),
        ]
    )


def table(detail: int) -> Part:
    """Return a round cafe table of 0.72 m with a cup on it."""
    sides = 5 + 3 * detail
    top = lathe([[0, 0.7], [0.36, 0.7], [0.36, 0.72], [0, 0.72]], sides)
    stem = lathe(smooth([[0.03, 0.04], [0.025, 0.3], [0.04, 0.5], [0.025, 0.7]], detail), sides)
    foot = lathe([[0.22, 0], [0.2, 0.03], [0.03, 0.05]], sides)
    parts = [top, stem, foot]
    if detail:
        cup = lathe(
            smooth([[0, 0.72], [0.03, 0.725], [0.042, 0.79], [0.036, 0.79], [0, 0.74]], detail),
            sides,
        )
        parts += [cup.moved([0.12, 0, 0.05]), cup.moved([-0.14, 0, 0.1])]
    return join(parts)


def lamp(detail: int) -> Part:
    """Return a street lamp of 4.2 m with two lanterns on bent arms."""
    sides = 4 + detail
    post = lathe(
        smooth(
            [[0.2, 0], [0.19, 0.25], [0.1, 0.35], [0.12, 0.5], [0.07, 0.65], [0.055, 2.2],
             [0.09, 2.3], [0.05, 2.4], [0.045, 3.9], [0.08, 4.0], [0.0, 4.2]],
            detail,
        ),
        sides, flutes=8 if detail > 3 else 0, depth=0.15,
    )  # fmt: skip
    s = np.linspace(0, 1, 4 + 2 * detail)
    arm = np.column_stack([0.6 * s, 3.5 + 0.35 * np.sin(1.3 * np.pi * s), 0 * s])
    arms = tubes(np.stack([arm, arm * [-1, 1, 1]]), 0.025, max(3, sides - 1))
    lantern = lathe(
        smooth(
            [[0, -0.5], [0.1, -0.46], [0.16, -0.1], [0.2, -0.06], [0.06, 0.08], [0, 0.12]],
            detail // 2,
        ),
        max(4, sides),
    )
    heads = place(lantern, [arm[-1], arm[-1] * [-1, 1, 1]])
    return join([post, arms, heads])


def vase(detail: int) -> Part:
    """Return a vase 0.9 m tall, open at the top."""
    return lathe(
        smooth(
            [[0.0, 0], [0.24, 0.0], [0.24, 0.08], [0.12, 0.14], [0.3, 0.42], [0.34, 0.6],
             [0.22, 0.76], [0.3, 0.9], [0.26, 0.88], [0.18, 0.74], [0.0, 0.7]],
            detail,
        ),
        6 + 4 * detail, flutes=12 if detail > 2 else 0, depth=0.06,
    )  # fmt: skip


def parasol(detail: int) -> Part:
    """Return a parasol of 2.5 m, its eight panels sagging between the ribs."""
    around, rows = 8 * (1 + detail), 3 + detail
    angle = np.linspace(0, 2 * np.pi, around + 1)
    t = np.linspace(0.02, 1, rows)[:, None]
    sag = 0.12 * t * np.abs(np.sin(4 * angle))
    radius = 1.3 * t * (1 - 0.05 * np.abs(np.sin(4 * angle)))
    height = 2.5 - 0.45 * t**1.4 - sag
    cloth = surface(np.stack([radius * np.cos(angle), height, radius * np.sin(angle)], axis=-1))
    pole = lathe([[0.25, 0], [0.25, 0.06], [0.025, 0.08], [0.025, 2.55]], 5 + detail)
    return join([cloth, pole])


def bollard(detail: int) -> Part:
    """Return a cast bollard of 0.9 m."""
    return lathe(
        smooth([[0.12, 0], [0.11, 0.1], [0.07, 0.16], [0.06, 0.7], [0.09, 0.74], [0.08, 0.84],
                 [0, 0.92]], detail), 5 + 2 * detail
    )  # fmt: skip


def cables(start: F64, end: F64, sag: F64, detail: int, bulbs: int) -> list[Part]:
    """Return hanging cables between (n, 3) ends, and the bulbs on them."""
    line = catenary(start, end, sag, 5 + 3 * detail)
    parts = [tubes(line, 0.012, 3 + detail // 3)]
    if bulbs:
        at = catenary(start, end, sag, bulbs + 2)[:, 1:-1].reshape(-1, 3)
        bulb = lathe([[0, -0.16], [0.05, -0.11], [0.035, -0.04], [0.015, 0.0]], 3 + detail // 2)
        parts.append(place(bulb, at))
    return parts
