"""Grade answers to the rays of a hard case.

The words are those of `hybrid_rt.judging.metrics`; the truth is `hard.truth` and no
tracer. Of a ray that a technique answers:

===============  ==================================================================================
CORRECT          The nearest triangle, with t in its interval; or a miss that is one.
TIE              Another answer that float32 cannot tell from it.
FALSE_MISS       A miss is claimed where none is possible.
WRONG_PRIMITIVE  A triangle that may not be answered, but within a pixel of the true hit.
FALSE_HIT        A hit is claimed where the truth is a miss or farther off than that.
===============  ==================================================================================

A right triangle with a t beyond its interval is *imprecise* within a pixel of the true hit, and
FALSE_HIT farther off. Within a pixel means: the point at the claimed t, or the centre of the
claimed pixel, lies within 1 pixel of the true hit on screen, and the point's depth differs from the
true one by no more than the true surface's depth changes over a pixel, plus 5 %: a ray that
projects to a point is never far off on screen.

An answer by pixel can be no better than a pixel, so WRONG_PRIMITIVE and imprecise are counted but
fail nobody, unless a technique is held to exact answers. Such a one also fails where it hands over
a ray as free up to a distance beyond the true hit (*false_free*).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

import hybrid_rt as hrt
from hybrid_rt import _check
from hybrid_rt.kernels.arrays import F64, Bool
from hybrid_rt_scenes.hard.case import BuiltCase
from hybrid_rt_scenes.hard.truth import Truth

FIRST = 5
"""How many offending rays are named."""
WRONG = ("false_hit", "false_miss")
INEXACT = ("wrong_primitive", "imprecise", "false_free")


@dataclass(frozen=True)
class CaseResult:
    """What a technique's answers to a case are worth.

    Attributes
    ----------
    case : str
    exact : bool
        Whether the technique is held to exact answers.
    rays, unresolved : int
    correct, tie, false_hit, false_miss, wrong_primitive, imprecise, false_free : int
        Numbers of rays, as in the module's docstring.
    first : dict of str to list of int
        The first few rays of every kind of error.
    """

    case: str
    exact: bool
    rays: int
    unresolved: int
    correct: int
    tie: int
    false_hit: int
    false_miss: int
    wrong_primitive: int
    imprecise: int
    false_free: int
    first: dict[str, list[int]] = field(default_factory=dict)

    @classmethod
    def nothing(cls, case: str, rays: int, *, exact: bool) -> CaseResult:
        """Return the result of a technique that gave no answers at all."""
        return cls(case, exact, rays, rays, 0, 0, 0, 0, 0, 0, 0)

    @property
    def wrong(self) -> int:
        """Number of rays that fail the case."""
        kinds = WRONG + INEXACT if self.exact else WRONG
        return sum(int(getattr(self, kind)) for kind in kinds)

    @property
    def passed(self) -> bool:
        """Whether no ray fails the case."""
        return self.wrong == 0


def grade(case: BuiltCase, answers: hrt.Marched | hrt.Hits, *, exact: bool = False) -> CaseResult:
    """Return what answers to the rays of a case are worth.

    Parameters
    ----------
    case : BuiltCase
    answers : Marched or Hits
        Of a march, or of a tracer, which answers every ray.
    exact : bool
        Hold the technique to exact answers: a wrong primitive and an imprecise t fail it too.

    Raises
    ------
    ArgumentError
        Another number of answers than of rays.
    """
    _check.instance("answers", answers, hrt.Marched if hasattr(answers, "resolved") else hrt.Hits)
    _check.same_length("answers", answers.prim_id, "case.rays", len(case.rays))
    n, truth = len(case.rays), case.truth
    pixel = np.full((n, 2), -1, np.int32)
    resolved = np.ones(n, np.bool_)
    false_free = np.zeros(n, np.bool_)
    if isinstance(answers, hrt.Marched):
        pixel, resolved = answers.pixel, answers.resolved
        false_free = ~resolved & (answers.t_free > _farthest(truth))
    claim, t = answers.prim_id, answers.t.astype(np.float64)

    missed = resolved & (claim < 0)
    hit = resolved & (claim >= 0)
    known = hit & (claim < truth.may_hit.shape[1])
    row, column = np.arange(n), np.where(known, claim, 0)
    right = known & truth.may_hit[row, column]
    precise = right & (t >= truth.t_low[row, column]) & (t <= truth.t_high[row, column])
    accepted = precise | (missed & truth.may_miss)
    first_answer = claim == truth.prim_id
    close = _within_a_pixel(case, hit & ~precise, t, pixel)
    kinds = {
        "unresolved": ~resolved,
        "correct": accepted & first_answer,
        "tie": accepted & ~first_answer,
        "false_hit": hit & ~precise & ~close,
        "false_miss": missed & ~truth.may_miss,
        "wrong_primitive": hit & ~right & close,
        "imprecise": right & ~precise & close,
        "false_free": false_free,
    }
    return CaseResult(
        case.name,
        exact,
        n,
        **{kind: int(of.sum()) for kind, of in kinds.items()},
        first={
            kind: [int(i) for i in np.flatnonzero(kinds[kind])[:FIRST]]
            for kind in WRONG + INEXACT
            if kinds[kind].any()
        },
    )


def _farthest(truth: Truth) -> F64:
    """Return the largest t (N,) that may be answered, infinity where a miss may."""
    t = np.where(truth.may_hit, truth.t_high, -np.inf).max(axis=1)
    return np.where(truth.may_miss, np.inf, t)


def _within_a_pixel(case: BuiltCase, asked: Bool, t: F64, pixel: Any) -> Bool:
    """Return (N,) whether claims are within a pixel of the truth; False where not `asked`."""
    close = np.zeros(len(t), np.bool_)
    truth = case.truth
    at = np.flatnonzero(asked & truth.may_hit.any(axis=1) & np.isfinite(t))
    if len(at) == 0:
        return close
    first = np.where(truth.may_hit[at], truth.t_low[at], np.inf).argmin(axis=1)
    middle = (truth.t_low[at, first] + truth.t_high[at, first]) / 2
    is_hit = truth.prim_id[at] >= 0
    prim = np.where(is_hit, truth.prim_id[at], first)
    true, true_depth = _project(case, at, np.where(is_hit, truth.t[at], middle))
    claimed, depth = _project(case, at, t[at])
    apart = np.abs(claimed - true).max(axis=1)
    by_pixel = (pixel[at] >= 0).all(axis=1)
    apart = np.where(by_pixel, np.fmin(apart, np.abs(pixel[at] + 0.5 - true).max(axis=1)), apart)
    with np.errstate(divide="ignore", invalid="ignore"):
        change = np.abs(depth / true_depth - 1)
        close[at] = (true_depth > 0) & (depth > 0) & (apart <= 1) & (
            change <= _depth_change(case, prim, true_depth) + 0.05
        )  # fmt: skip
    return close


def _project(case: BuiltCase, at: Any, t: F64) -> tuple[F64, F64]:
    """Return where the points at t are on screen, (N, 2), and their depth."""
    o, d = (a[at].astype(np.float64) for a in (case.rays.origin, case.rays.direction))
    seen = hrt.project(case.camera, o + t[:, None] * d)
    return seen[:, :2], seen[:, 2]


def _depth_change(case: BuiltCase, prim: Any, depth: F64) -> F64:
    """Return by which share the depth of triangles (N,) changes from one pixel to the next."""
    a, b, c = (case.scene.vertices[case.scene.faces[prim, k]].astype(np.float64) for k in range(3))
    view, normal = case.camera.arrays, np.cross(b - a, c - a)
    height = (normal * (a - view.eye)).sum(axis=1)
    below = height * view.frame[3, 3] - normal @ view.frame[3, :3]
    slopes = view.sigma * (normal @ view.frame[:2, :3].T)  # depth is linear on the screen
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.abs(slopes / below[:, None]).sum(axis=1) / depth)
