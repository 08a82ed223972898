"""Parts that walls of any building are made of."""

from __future__ import annotations

import numpy as np

from hybrid_rt_scenes.primitives import Part, join, quad, surface


def opening(x0: float, x1: float, y0: float, y1: float, deep: float, arch: int) -> Part:
    """Return the wall of a unit cell with a hole, its reveals and the pane at its back.

    With `arch` > 0 the hole ends in a half ellipse of that many pieces above `y1`.
    """
    outline = [[x0, y0], [x0, y1]]
    outer = [[0.0, y0], [0.0, 1.0]]
    rise = 0.6 * (1 - y1) if arch else 0.0
    for k in range(1, arch):
        turn = np.pi * (1 - k / arch)
        middle, half = (x0 + x1) / 2, (x1 - x0) / 2
        outline.append([middle + half * np.cos(turn), y1 + rise * np.sin(turn)])
        outer.append([k / arch, 1.0])
    outline += [[x1, y1], [x1, y0]]
    outer += [[1.0, 1.0], [1.0, y0]]
    inside = np.column_stack([outline, np.zeros(len(outline))])
    outside = np.column_stack([outer, np.zeros(len(outer))])
    parts = [
        surface([outside, inside]),
        surface([inside, inside - [0, 0, deep]]),
        quad([x0, y0, 0], [x1 - x0, 0, 0], [0, 0, -deep]),
        quad([x0, y0, -deep], [x1 - x0, 0, 0], [0, y1 + rise - y0, 0]),
    ]
    if y0 > 0:
        parts.append(quad([0, 0, 0], [1, 0, 0], [0, y0, 0]))
    return join(parts)


def moulding(x0: float, x1: float, y: float, tall: float, out: float, detail: int) -> Part:
    """Return a ledge with a swelling profile and closed ends; `detail` rounds it."""
    k = 3 + 2 * detail
    s = np.linspace(0, 1, k)
    swell = out * (0.35 + 0.65 * s**0.7) * (1 + 0.08 * np.sin(6 * np.pi * s))
    profile = np.vstack([[y, 0.0], np.column_stack([y + tall * s, swell]), [y + tall, 0.0]])
    left = np.column_stack([np.full(len(profile), x0), profile])
    right = np.column_stack([np.full(len(profile), x1), profile])
    back = np.array([0.0, 0.0, 1.0])
    ends = [surface([e, e - e * back]) for e in (left[1:-1], right[1:-1])]
    return join([surface([left, right]), *ends])
