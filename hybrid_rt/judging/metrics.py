"""Judge answers, and count: the one place that says what right and wrong mean.

A *resolved* ray is one that the judged technique answers, with a hit (a primitive) or with a miss.
Its answer is the *claim*; the *reference* is the answer of a robust tracer. Where both name the
same primitive, or both a miss, the claim is CORRECT, and no more is asked, unless `judge` is told
to look at every ray. Everything else is held against the truth over all triangles of the scene,
found by `judge.truth`, which says what it is to *hit*, to *graze* or to *miss* a triangle.

An answer is *right*, the claim and the reference each on its own, if

- it is a miss, and no triangle is hit; or
- its primitive is hit or grazed at a t that exceeds that of the nearest hit, if there is one, by no
  more than ``8 * 2**-24 * (t + largest coordinate / |direction|)``. So an answer is right that
  ties with the truth at a shared edge or vertex, on a coplanar duplicate or where triangles pass
  through each other; and a triangle that is only grazed may be there or not.

Verdicts, the first that fits:

======================  ===========================================================================
UNRESOLVED              The technique gives no answer.
CORRECT                 The same primitive, or both a miss; if looked at, right.
TIE                     Both answers are right, and differ.
REFERENCE_WRONG         The claim is right, the reference is not.
FALSE_MISS              The claim is a miss, and something is hit.
WRONG_PRIMITIVE         Another primitive than the true one, but within `pixel_tolerance` pixels of
                        the true hit.
FALSE_HIT               A hit is claimed where the truth is a miss or farther off than that.
======================  ===========================================================================

That the reference is wrong is told apart from the verdict as well, in `Judged.reference_wrong`:
where claim and reference are both wrong, the verdict is on the claim.

The technique of the paper answers with a pixel. On a mesh of pixel-sized triangles such an answer
is often right to the pixel and wrong in the triangle, so WRONG_PRIMITIVE is kept apart. The
opposite, the right primitive at a distant pixel, is CORRECT: the pixel stands for the plane of its
primitive, the t that follows from that plane is exact, and on a large triangle that is what the
tilted plane is for. Whoever wants distant pixels counted whatever their primitive has "pixel_error"
in `rates`: claimed hits that lie more than `pixel_tolerance` pixels from the truth.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass
from typing import Any

import numpy as np

from hybrid_rt import _check
from hybrid_rt.camera.camera import Camera, project
from hybrid_rt.errors import ArgumentError
from hybrid_rt.judging.rate import Rate
from hybrid_rt.judging.truth import MISSED, Truth
from hybrid_rt.kernels.arrays import F32, F64, I32, U8, Bool
from hybrid_rt.rays.hits import Hits
from hybrid_rt.rays.rays import Rays
from hybrid_rt.scene.mesh import Scene


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
        ``abs(t - t_true) / t_true`` of a claimed hit, with t_true in float64: of the claimed
        primitive where the claim is right, of the nearest otherwise. NaN where nothing is claimed
        to be hit or nothing is.
    error_px : (N,) float64
        The larger of the distances in x and y, in pixels, between the true hit's place on screen
        and the centre of the claimed pixel, or the place of the claimed hit for an answer without a
        pixel. Infinite where nothing is truly hit, or where only one of the two is in front of the
        camera; NaN where no hit is claimed, or an answer without a pixel is, like the truth,
        behind the camera.
    reference_wrong : (N,) bool
        Whether the reference was looked at and is wrong, whatever the claim.
    pixel_tolerance : float
        The `pixel_tolerance` of the judge.
    """

    verdict: U8
    error_t: F64
    error_px: F64
    reference_wrong: Bool
    pixel_tolerance: float

    def __post_init__(self) -> None:
        verdict = _check.array("verdict", self.verdict, ("N",), np.uint8)
        _check.in_range("verdict", verdict, 0, len(Verdict) - 1, "of Verdict")
        _check.real("pixel_tolerance", self.pixel_tolerance, above=0.0)
        object.__setattr__(self, "verdict", verdict)
        for name, dtype in (
            ("error_t", np.float64), ("error_px", np.float64), ("reference_wrong", np.bool_),
        ):  # fmt: skip
            value = _check.array(name, getattr(self, name), ("N",), dtype)
            _check.same_length(name, value, "verdict", len(verdict))
            object.__setattr__(self, name, value)

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
    *,
    truth: Truth | None = None,
    every: bool = False,
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
    truth : Truth, optional
        Of `scene`, to be built once and used for many judgements. Default: a new one, whose tree is
        built only if an answer has to be looked at.
    every : bool
        Look at every resolved ray, also where claim and reference agree.

    Returns
    -------
    Judged

    Raises
    ------
    ArgumentError
        Arrays of different lengths, a prim_id that the scene does not have, or a truth of another
        scene.
    """
    for name, value, cls in (
        ("rays", rays, Rays),
        ("claimed", claimed, Hits),
        ("reference", reference, Hits),
        ("scene", scene, Scene),
        ("camera", camera, Camera),
    ):
        _check.instance(name, value, cls)
    _check_scene(rays, scene)
    n = len(rays)
    answered = _check.array("resolved", resolved, ("N",), np.bool_)
    _check.same_length("resolved", answered, "rays", n)
    for name, hits in (("claimed", claimed), ("reference", reference)):
        hits._checked(name, n, len(scene))
    if pixel is None:
        px = np.full((n, 2), -1, np.int32)
    else:
        px = _check.array("pixel", pixel, ("N", 2), np.int32)
        _check.same_length("pixel", px, "rays", n)
    tolerance = _check.real("pixel_tolerance", pixel_tolerance, above=0.0)

    every = _check.boolean("every", every)
    truth = _truth_of(scene, truth)

    judged = Judged(
        np.full(n, Verdict.UNRESOLVED, np.uint8),
        np.full(n, np.nan),
        np.full(n, np.nan),
        np.zeros(n, np.bool_),
        tolerance,
    )
    at = np.flatnonzero(answered)
    rays, claim, ref = rays.take(at), claimed.prim_id[at], reference.prim_id[at]
    look = np.asarray((claim != ref) | every)
    claim_right, reference_right, t_true = _hold(rays, claim, ref, reference.t[at], look, truth)
    error_t, error_px = _errors(rays, claim, claimed.t[at], t_true, camera, px[at])
    judged.verdict[at] = np.select(
        [
            claim_right & reference_right & (claim == ref),
            claim_right & reference_right,
            claim_right,
            claim < 0,
            error_px <= tolerance,
        ],
        [
            Verdict.CORRECT,
            Verdict.TIE,
            Verdict.REFERENCE_WRONG,
            Verdict.FALSE_MISS,
            Verdict.WRONG_PRIMITIVE,
        ],
        Verdict.FALSE_HIT,
    )
    judged.error_t[at], judged.error_px[at] = error_t, error_px
    judged.reference_wrong[at] = ~reference_right
    return judged


def judge_occlusion(
    rays: Rays,
    claimed: Any,
    resolved: Any,
    reference: Any,
    scene: Scene,
    *,
    truth: Truth | None = None,
) -> Judged:
    """Return what is right and what is wrong in the answers to any-hit queries.

    Parameters
    ----------
    rays : Rays
        N rays; a hit with ``t_near <= t <= t_far`` occludes.
    claimed : (N,) array_like of bool
        Which rays are said to be occluded; those of unresolved rays are not looked at.
    resolved : (N,) array_like of bool
        The rays that the technique answers.
    reference : (N,) array_like of bool
        The answers of a robust tracer.
    scene : Scene
        What was traced.
    truth : Truth, optional
        As in `judge`.

    Returns
    -------
    Judged
        The verdicts UNRESOLVED, CORRECT, TIE, FALSE_HIT (occluded is claimed, and nothing is hit or
        grazed), FALSE_MISS (free is claimed, and something is hit) and REFERENCE_WRONG. A ray that
        grazes and hits nothing may be called either. No primitive and no place is claimed, so both
        errors are NaN.

    Raises
    ------
    ArgumentError
        Arrays of different lengths, or a truth of another scene.
    """
    _check.instance("rays", rays, Rays)
    _check.instance("scene", scene, Scene)
    _check_scene(rays, scene)
    n = len(rays)
    flags = []
    for name, value in (("claimed", claimed), ("resolved", resolved), ("reference", reference)):
        flag = _check.array(name, value, ("N",), np.bool_)
        _check.same_length(name, flag, "rays", n)
        flags.append(flag)
    claim, answered, ref = flags
    truth = _truth_of(scene, truth)
    verdict = np.where(answered, Verdict.CORRECT, Verdict.UNRESOLVED).astype(np.uint8)
    reference_wrong = np.zeros(n, np.bool_)
    at = np.flatnonzero(answered & (claim != ref))
    nearest = truth.nearest(rays.take(at))
    hit = nearest.prim_id >= 0
    either = ~hit & np.isfinite(nearest.t_grazed)
    claim_right, reference_right = either | (claim[at] == hit), either | (ref[at] == hit)
    verdict[at] = np.select(
        [claim_right & reference_right, claim_right, claim[at]],
        [Verdict.TIE, Verdict.REFERENCE_WRONG, Verdict.FALSE_HIT],
        Verdict.FALSE_MISS,
    )
    reference_wrong[at] = ~reference_right
    nothing = np.full(n, np.nan)
    return Judged(verdict, nothing, nothing.copy(), reference_wrong, 1.0)


def _check_scene(rays: Rays, scene: Scene) -> None:
    """Raise if rays were made for another scene."""
    if rays.scene is not None and not rays.scene.same_as(scene):
        got = f"rays of another scene, {rays.scene.name!r}"
        raise ArgumentError("rays", f"rays of scene {scene.name!r}, or of none", got)


def _truth_of(scene: Scene, truth: Truth | None) -> Truth:
    """Return a truth of `scene`: the one given, if it is."""
    if truth is None:
        return Truth(scene)
    _check.instance("truth", truth, Truth)
    if not truth.scene.same_as(scene):
        raise ArgumentError("truth", "a Truth of `scene`", f"one of scene {truth.scene.name!r}")
    return truth


def _hold(
    rays: Rays, claim: I32, ref: I32, ref_t: F32, look: Bool, truth: Truth
) -> tuple[Bool, Bool, F64]:
    """Hold claim and reference against the truth where `look` says so, and trust them elsewhere.

    Return which claims and which references are right, and the true t.
    """
    claim_right, reference_right = np.ones(len(rays), np.bool_), np.ones(len(rays), np.bool_)
    state, t_claim = truth.touch(rays, claim)
    t_true = np.where(state == MISSED, ref_t, t_claim)
    at = np.flatnonzero(look)
    if len(at) == 0:
        return claim_right, reference_right, t_true
    rays, claim, ref, t_claim = rays.take(at), claim[at], ref[at], t_claim[at]
    other = claim != ref
    t_ref = t_claim.copy()
    t_ref[other] = truth.touch(rays.take(other), ref[other])[1]
    nearest = truth.nearest(rays)
    slack = truth.tolerance(rays, nearest.prim_id, nearest.t)
    nothing = nearest.prim_id < 0
    # The t of what is missed is NaN, and no NaN is small enough to be right.
    for answer, t, right in ((claim, t_claim, claim_right), (ref, t_ref, reference_right)):
        tie = np.maximum(slack, truth.tolerance(rays, answer, t))
        right[at] = np.where(answer < 0, nothing, t <= nearest.t + tie)
    # A claim that is right is met at its own t. A reference that is right by a graze alone is all
    # the truth that there is to measure a wrong claim against.
    t_reference = np.where(reference_right[at] & (ref >= 0), t_ref, np.inf)
    t_true[at] = np.where(
        claim_right[at] & (claim >= 0), t_claim, np.minimum(nearest.t, t_reference)
    )
    return claim_right, reference_right, t_true


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


def rates(judged: Judged) -> dict[str, Rate]:
    """Return all rates of a judged set of rays.

    Returns
    -------
    dict of str to Rate
        "alpha" of all rays. Of the resolved rays: one for each verdict on the claim ("correct",
        "tie", "false_hit", "false_miss", "wrong_primitive"); "reference_wrong" (the reference was
        looked at and is wrong, whatever the claim); and "pixel_error" (a hit is claimed, more than
        `pixel_tolerance` pixels from the truth, whatever its verdict).

    Notes
    -----
    "pixel_error" is meant for answers by pixel. Those of a tracer may lie beside the camera, where
    a pixel is so thin that rounding alone moves a hit by more than one.
    """
    _check.instance("judged", judged, Judged)
    resolved = judged.verdict != Verdict.UNRESOLVED
    total = int(resolved.sum())
    counts = np.bincount(judged.verdict, minlength=len(Verdict))
    result = {"alpha": Rate.of(total, len(judged))}
    for verdict in Verdict:
        if verdict is not Verdict.UNRESOLVED:
            result[verdict.name.lower()] = Rate.of(int(counts[verdict]), total)
    result["reference_wrong"] = Rate.of(int(judged.reference_wrong.sum()), total)
    result["pixel_error"] = Rate.of(int((judged.error_px > judged.pixel_tolerance).sum()), total)
    return result
