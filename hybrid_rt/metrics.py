"""Judge answers, and count: the one place that says what right and wrong mean.

A *resolved* ray is one that the judged technique answers, with a hit (a primitive) or with a miss.
Its answer is the *claim*; the *reference* is the answer of a robust tracer. Where both name the
same primitive, or both a miss, the claim is CORRECT. Everything else is decided by a float64 judge,
which takes the ray and the triangles, all float32, as exact, and intersects the ray with the two
primitives named. Each is

- *hit*: the ray passes through the closed triangle with t_near <= t <= t_far;
- *grazed*: not hit, but the ray passes its edge within ``8 * 2**-24`` times the largest coordinate
  of the origin and the triangle, or t exceeds a limit by as little. A tracer in float32 cannot
  tell a grazed triangle from a hit one;
- *missed* otherwise. A triangle without area is always missed.

Verdicts, the first that fits:

======================  ===========================================================================
UNRESOLVED              The technique gives no answer.
CORRECT                 The same primitive, or both a miss.
TIE                     Both primitives are touched (hit or grazed) and their t differ by no more
                        than ``8 * 2**-24 * (t + largest coordinate / |direction|)``: shared edges
                        and vertices, coplanar duplicates. Or the nearer of the two is only grazed
                        and the other answer is right if it is not there.
REFERENCE_WRONG         The claimed primitive is hit, nearer than the reference's if that is
                        touched at all; or the claim is a miss and the reference's primitive missed.
FALSE_MISS              The claim is a miss, and the reference's primitive is hit.
WRONG_PRIMITIVE         Another primitive than the true one, but within `pixel_tolerance` pixels of
                        the true hit.
FALSE_HIT               A hit is claimed where the truth is a miss or farther off than that.
======================  ===========================================================================

The technique of the paper answers with a pixel. On a mesh of pixel-sized triangles such an answer
is often right to the pixel and wrong in the triangle, so WRONG_PRIMITIVE is kept apart. The
opposite, the right primitive at a distant pixel, is CORRECT: the pixel stands for the plane of its
primitive, the t that follows from that plane is exact, and on a large triangle that is what the
tilted plane is for. Whoever wants distant pixels counted whatever their primitive has "pixel_error"
in `rates`: claimed hits that lie more than `pixel_tolerance` pixels from the truth.

The truth is never sought beyond the two primitives named: where the reference overlooks a third
that is nearer than both, so does the judge.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass
from typing import Any

import numpy as np

from hybrid_rt import _check
from hybrid_rt.camera import project
from hybrid_rt.errors import ArgumentError
from hybrid_rt.kernels import metrics as kernels
from hybrid_rt.rate import Rate
from hybrid_rt.types import F32, F64, I32, U8, Bool, Camera, Hits, MarchStatus, Rays, Scene

TIE_ULPS = 8 * 2.0**-24


class Verdict(enum.IntEnum):
    """What the judge says of one ray; defined in the module's docstring."""

    UNRESOLVED = 0
    CORRECT = 1
    TIE = 2
    FALSE_HIT = 3
    FALSE_MISS = 4
    WRONG_PRIMITIVE = 5
    REFERENCE_WRONG = 6


@dataclass(frozen=True, eq=False)
class Judged:
    """What the judge says of every ray.

    Attributes
    ----------
    verdict : (N,) uint8
        A `Verdict` for each ray.
    error_t : (N,) float64
        ``abs(t - t_true) / t_true`` of a claimed hit; NaN where nothing is claimed to be hit or
        nothing is.
    error_px : (N,) float64
        The larger of the distances in x and y, in pixels, between the true hit's place on screen
        and the centre of the claimed pixel, or the place of the claimed hit for an answer without a
        pixel. Infinite where nothing is truly hit, or where only one of the two is in front of the
        camera; NaN where no hit is claimed, or an answer without a pixel is, like the truth,
        behind the camera.
    pixel_tolerance : float
        The `pixel_tolerance` of the judge.
    """

    verdict: U8
    error_t: F64
    error_px: F64
    pixel_tolerance: float

    def __len__(self) -> int:
        return len(self.verdict)


def judge(
    rays: Rays,
    claimed: Hits,
    resolved: Any,
    reference: Hits,
    scene: Scene,
    camera: Camera,
    pixel: Any = None,
    pixel_tolerance: float = 1.0,
) -> Judged:
    """Return what is right and what is wrong in the answers to rays.

    Parameters
    ----------
    rays : Rays
        N rays.
    claimed : Hits
        The answers to judge; those of unresolved rays are not looked at.
    resolved : (N,) array_like of bool
        The rays that the technique answers.
    reference : Hits
        The answers of a robust tracer.
    scene : Scene
        What was traced.
    camera : Camera
        The view in whose pixels errors are measured.
    pixel : (N, 2) array_like of int, optional
        The pixel that stands for each answer, (-1, -1) for answers without one. Default: none has.
    pixel_tolerance : float
        Pixels, > 0.

    Returns
    -------
    Judged

    Raises
    ------
    ArgumentError
        Arrays of different lengths, or a prim_id that the scene does not have.
    """
    for name, value, cls in (
        ("rays", rays, Rays),
        ("claimed", claimed, Hits),
        ("reference", reference, Hits),
        ("scene", scene, Scene),
        ("camera", camera, Camera),
    ):
        _check.instance(name, value, cls)
    n = len(rays)
    answered = _check.array("resolved", resolved, ("N",), np.bool_)
    _check.same_length("resolved", answered, "rays", n)
    for name, hits in (("claimed", claimed), ("reference", reference)):
        _check.same_length(name, hits.prim_id, "rays", n)
        if n and int(hits.prim_id.max()) >= len(scene):
            raise ArgumentError(
                f"{name}.prim_id", f"less than {len(scene)}", f"{int(hits.prim_id.max())}"
            )
    if pixel is None:
        px = np.full((n, 2), -1, np.int32)
    else:
        px = _check.array("pixel", pixel, ("N", 2), np.int32)
        _check.same_length("pixel", px, "rays", n)
    tolerance = _check.real("pixel_tolerance", pixel_tolerance, above=0.0)

    judged = Judged(
        np.full(n, Verdict.UNRESOLVED, np.uint8), np.full(n, np.nan), np.full(n, np.nan), tolerance
    )
    at = np.flatnonzero(answered)
    verdict, error_t, error_px = _judge_resolved(
        rays.take(at),
        claimed.prim_id[at],
        claimed.t[at],
        reference.prim_id[at],
        reference.t[at],
        scene,
        camera,
        px[at],
        tolerance,
    )
    judged.verdict[at], judged.error_t[at], judged.error_px[at] = verdict, error_t, error_px
    return judged


def _judge_resolved(
    rays: Rays,
    claim: I32,
    claim_t: F32,
    ref: I32,
    ref_t: F32,
    scene: Scene,
    camera: Camera,
    pixel: I32,
    pixel_tolerance: float,
) -> tuple[U8, F64, F64]:
    """Judge rays that are all resolved; the definitions are those of the module's docstring."""
    same = claim == ref
    r_state, r_t, r_tolerance = _touch(rays, ref, scene)
    c_state, c_t, c_tolerance = _touch(rays, np.where(same, -1, claim).astype(np.int32), scene)
    r_touched, c_touched = r_state != kernels.MISSED, c_state != kernels.MISSED

    tie = r_touched & c_touched & (np.abs(r_t - c_t) <= np.maximum(r_tolerance, c_tolerance))
    c_first = c_touched & (~r_touched | (c_t < r_t))
    r_first = r_touched & ~c_first
    # A nearer primitive that is only grazed may be there or not: the other answer is right too, if
    # it is what lies behind. For a claimed miss that is nothing.
    tie |= c_first & (c_state == kernels.GRAZED)
    tie |= r_first & (r_state == kernels.GRAZED) & (c_touched | (claim < 0))
    reference_wrong = (c_first & (c_state == kernels.HIT)) | ((claim < 0) & ~r_touched)

    t_true = np.where(r_touched, r_t, ref_t.astype(np.float64))
    t_true = np.where(~same & c_first, c_t, t_true)
    t_true = np.where(~same & reference_wrong & (claim < 0), np.inf, t_true)
    error_t, error_px = _errors(rays, claim, claim_t, t_true, camera, pixel)

    verdict = np.select(
        [same, tie, reference_wrong, claim < 0, error_px <= pixel_tolerance],
        [
            Verdict.CORRECT,
            Verdict.TIE,
            Verdict.REFERENCE_WRONG,
            Verdict.FALSE_MISS,
            Verdict.WRONG_PRIMITIVE,
        ],
        Verdict.FALSE_HIT,
    )
    return verdict.astype(np.uint8), error_t, error_px


def _touch(rays: Rays, prim_id: I32, scene: Scene) -> tuple[U8, F64, F64]:
    """Return how each ray meets the primitive named for it: state, t and the tolerance of t."""
    n = len(rays)
    state, t, tolerance = np.empty(n, np.uint8), np.empty(n), np.empty(n)
    kernels.touch(
        rays.origin, rays.direction, rays.t_near, rays.t_far, prim_id,
        scene.vertices, scene.faces, TIE_ULPS, state, t, tolerance,
    )  # fmt: skip
    return state, t, tolerance


def _errors(
    rays: Rays, claim: I32, claim_t: F32, t_true: F64, camera: Camera, pixel: I32
) -> tuple[F64, F64]:
    """Return `Judged.error_t` and `Judged.error_px`."""
    error_t, error_px = np.full(len(rays), np.nan), np.full(len(rays), np.nan)
    error_px[(claim >= 0) & ~np.isfinite(t_true)] = np.inf
    at = np.flatnonzero((claim >= 0) & np.isfinite(t_true))
    t, true = claim_t[at].astype(np.float64), t_true[at]
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        error_t[at] = np.where(t == true, 0.0, np.abs(t - true) / np.abs(true))
        on_screen, truth_ahead = _screen(rays.take(at), true, camera)
        claimed, claim_ahead = _screen(rays.take(at), t, camera)
    by_pixel = np.asarray((pixel[at] >= 0).all(axis=1))
    claimed = np.where(by_pixel[:, None], pixel[at] + 0.5, claimed)
    claim_ahead |= by_pixel
    both = truth_ahead & claim_ahead
    error = np.where(truth_ahead | claim_ahead, np.inf, np.nan)
    error[both] = np.abs(claimed[both] - on_screen[both]).max(axis=1)
    error_px[at] = error
    return error_t, error_px


def _screen(rays: Rays, t: F64, camera: Camera) -> tuple[F64, Bool]:
    """Return where the points at t fall on screen, (N, 2), and whether they are in front."""
    points = rays.origin.astype(np.float64) + t[:, None] * rays.direction.astype(np.float64)
    xy_depth = project(camera, points)
    return xy_depth[:, :2], (xy_depth[:, 2] > 0) & np.isfinite(xy_depth).all(axis=1)


def alpha(resolved: Any) -> Rate:
    """Return the share of resolved rays.

    Parameters
    ----------
    resolved : (N,) array_like of bool
    """
    answered = _check.array("resolved", resolved, ("N",), np.bool_)
    return Rate.of(int(answered.sum()), len(answered))


def rates(judged: Judged) -> dict[str, Rate]:
    """Return all rates of a judged set of rays.

    Returns
    -------
    dict of str to Rate
        "alpha" of all rays. Of the resolved rays: one for each verdict ("correct", "tie",
        "false_hit", "false_miss", "wrong_primitive", "reference_wrong"), and "pixel_error" (a hit
        is claimed, more than `pixel_tolerance` pixels from the truth, whatever its verdict).

    Notes
    -----
    "pixel_error" is meant for answers by pixel. Those of a tracer may lie beside the camera, where
    a pixel is so thin that rounding alone moves a hit by more than one (0.05 % of mirror rays).
    """
    _check.instance("judged", judged, Judged)
    resolved = judged.verdict != Verdict.UNRESOLVED
    total = int(resolved.sum())
    counts = np.bincount(judged.verdict, minlength=len(Verdict))
    result = {"alpha": alpha(resolved)}
    for verdict in Verdict:
        if verdict is not Verdict.UNRESOLVED:
            result[verdict.name.lower()] = Rate.of(int(counts[verdict]), total)
    result["pixel_error"] = Rate.of(int((judged.error_px > judged.pixel_tolerance).sum()), total)
    return result


def by_status(status: Any, judged: Judged) -> dict[str, dict[str, float]]:
    """Return, for each way that a march can end, how many rays did and what became of them.

    Parameters
    ----------
    status : (N,) array_like of int
        A `MarchStatus` for each ray.
    judged : Judged
        Of the same rays.

    Returns
    -------
    dict of str to dict of str to float
        A row for each status, under its name: "rays"; "share" of all rays; the number of rays with
        each verdict, under its name in lower case; "pixel_error" as in `rates`.
    """
    _check.instance("judged", judged, Judged)
    ended = _check.array("status", status, ("N",), np.uint8)
    _check.same_length("status", ended, "judged", len(judged))
    table: dict[str, dict[str, float]] = {}
    for kind in MarchStatus:
        of_kind = ended == kind
        counts = np.bincount(judged.verdict[of_kind], minlength=len(Verdict))
        rays = int(of_kind.sum())
        row: dict[str, float] = {"rays": rays, "share": rays / max(1, len(judged))}
        row |= {verdict.name.lower(): int(counts[verdict]) for verdict in Verdict}
        row["pixel_error"] = int((judged.error_px[of_kind] > judged.pixel_tolerance).sum())
        table[kind.name] = row
    return table
