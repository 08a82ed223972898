"""Trees, ivy and bushes: many small loose leaves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hybrid_rt_scenes.primitives import F64, Part, join, leaves, scatter_in_ball, tubes


@dataclass(frozen=True)
class Tree:
    """A tree: where it stands, the middle of its crown above that, and the crown's radius."""

    at: tuple[float, float, float]
    crown: float
    radius: float


def wood(trees: list[Tree], detail: int, rng: np.random.Generator) -> tuple[Part, list[F64]]:
    """Return trunks and branches, and for each tree (n, 3) points where twigs end.

    Detail 0 is a trunk of three sides; each step adds branches, sides and pieces.
    """
    parts, twigs = [], []
    sides, pieces = 3 + detail, 3 + detail
    for tree in trees:
        foot = np.array(tree.at)
        middle = np.add(foot, [0, tree.crown, 0])
        fork = np.add(foot, [0, tree.crown - 0.8 * tree.radius, 0])
        s = np.linspace(0, 1, pieces)[:, None]
        lean = np.array([0.12, 0, 0.05]) * np.sin(np.pi * s)
        parts.append(tubes((foot + s * (fork - foot) + lean)[None], 0.16 - 0.06 * s[:, 0], sides))
        starts = fork[None]
        thick = 0.09
        for level in range(min(detail, 3)):
            number = 5 + detail
            begin = np.repeat(starts, number, axis=0)
            goal = middle + tree.radius * (0.45 + 0.22 * level) * scatter_in_ball(
                len(begin), rng, 0.8
            ) * [1, 0.85, 1]
            end = begin + (0.75 if level else 1.0) * (goal - begin)
            s = np.linspace(0, 1, max(3, pieces - level))[None, :, None]
            curve = begin[:, None] * (1 - s) + end[:, None] * s
            curve[..., 1] += 0.12 * tree.radius * np.sin(np.pi * s[..., 0])
            taper = thick * (1 - 0.6 * s[0, :, 0])
            parts.append(tubes(curve, taper, max(3, sides - 2 * level)))
            starts, thick = end, 0.4 * thick
        twigs.append(starts)
    return join(parts), twigs


def foliage(
    trees: list[Tree], twigs: list[F64], count: int, rng: np.random.Generator
) -> list[Part]:
    """Return `count` leaves, shared among the trees by volume, in clumps about the twigs."""
    volume = np.array([tree.radius**3 for tree in trees])
    ends = np.round(np.cumsum(volume) / volume.sum() * count).astype(int)
    numbers = np.diff(np.concatenate([[0], ends]))
    parts = []
    for tree, tips, n in zip(trees, twigs, numbers, strict=True):
        middle = np.add(tree.at, [0, tree.crown, 0])
        loose = middle + 0.85 * tree.radius * scatter_in_ball(n, rng) * [1, 0.85, 1]
        centres = rng.choice(tips, min(len(tips), 24), replace=False)
        clumps = centres[rng.integers(0, len(centres), n)]
        reach = tree.radius * (0.22 + 0.14 * ((clumps[:, :1] * 7.3) % 1))
        near = clumps + reach * scatter_in_ball(n, rng) * [1, 0.6, 1]
        where = np.where(rng.uniform(size=(n, 1)) < (0.92 if len(tips) > 8 else 0.0), near, loose)
        # About 2.5 square metres of leaf in a cubic metre of crown, however many leaves make it.
        area = 2.5 * 4.2 * tree.radius**3 / max(n, 1)
        size = min(0.6, float(np.sqrt(area / 0.33)))
        parts.append(leaves(where, size * rng.uniform(0.7, 1.3, n), rng))
    return parts


def ivy(corner: F64, side: F64, rise: F64, out: F64, count: int, rng: np.random.Generator) -> Part:
    """Return `count` leaves that climb a wall from `corner` along `side`, up to `rise`."""
    u = rng.uniform(size=count)
    top = 0.45 + 0.35 * np.sin(9 * u) * np.sin(23 * u + 1) + 0.2 * rng.uniform(size=count)
    v = np.clip(top, 0.05, 1) * rng.uniform(size=count) ** 0.7
    depth = 0.18 * rng.uniform(size=count) ** 2 + 0.02
    where = corner + u[:, None] * side + v[:, None] * rise + depth[:, None] * out
    area = 1.5 * np.linalg.norm(side) * np.linalg.norm(rise) / max(count, 1)
    size = min(0.4, float(np.sqrt(area / 0.33)))
    return leaves(where, size * rng.uniform(0.7, 1.3, count), rng)
