"""How far a peer's answers are those of the reference."""

from __future__ import annotations

from typing import Any

import numpy as np

import hybrid_rt as hrt
from hybrid_rt_bench.kinds.peers.programs.base import Answers, PeerError, Picture

SAME_PLACE = 1e-5
"""Hits that differ in t by at most this share of it are at one place: a shared edge or a twin."""


def of_rays(answers: Answers, reference: hrt.Hits, rays: hrt.Rays) -> dict[str, Any]:
    """Return the columns for a peer's answers beside those of robust Embree.

    Parameters
    ----------
    answers : Answers
    reference : Hits
        Of the same N rays.
    rays : Rays

    Returns
    -------
    dict
        Shares of all rays: "same" primitive or both a miss; of the others, "same_place" (both hit,
        at one distance) and "early" (a hit before the ray's t_near, which the peer cannot be told
        of). "t_max" and "t_p99": the relative difference of t where both hit the same primitive,
        NaN for a peer that says no distances.

    Raises
    ------
    PeerError
        Another number of answers than rays.
    """
    n = len(rays)
    if answers.prim_id.shape != (n,) or answers.t.shape != (n,):
        raise PeerError(
            f"expected {n} answers, got {answers.prim_id.shape} primitives and "
            f"{answers.t.shape} distances"
        )
    same = answers.prim_id == reference.prim_id
    both = (answers.prim_id >= 0) & (reference.prim_id >= 0)
    off = np.full(n, np.inf)
    # Embree's t may be 0, where nothing is relative.
    scale = np.maximum(reference.t[both], np.finfo(np.float32).tiny).astype(np.float64)
    off[both] = np.abs(answers.t[both].astype(np.float64) - reference.t[both]) / scale
    agreed = off[both & same]
    early = ~same & (answers.prim_id >= 0) & (answers.t < rays.t_near)
    return {
        "same": float(same.mean()),
        "different": int(n - same.sum()),
        "same_place": float((~same & (off <= SAME_PLACE)).mean()),
        "early": float(early.mean()),
        "t_p99": float(np.quantile(agreed, 0.99)) if len(agreed) else np.nan,
        "t_max": float(agreed.max()) if len(agreed) else np.nan,
    }


def of_pictures(picture: Picture, reference: hrt.GBuffer) -> dict[str, Any]:
    """Return the columns for a peer's picture beside ours.

    Returns
    -------
    dict
        "same": share of all pixels with the same primitive or both empty. "covered" of either that
        the other leaves empty: "only_here", "only_ours", shares of all pixels. "depth_p50",
        "depth_p99", "depth_max": relative difference of depth where the primitive is the same.

    Raises
    ------
    PeerError
        A picture of another size.
    """
    if picture.prim_id.shape != reference.prim_id.shape:
        raise PeerError(
            f"expected a picture of shape {reference.prim_id.shape}, got {picture.prim_id.shape}"
        )
    same = picture.prim_id == reference.prim_id
    mine, ours = picture.prim_id >= 0, reference.prim_id >= 0
    agreed = same & ours
    depth = reference.depth[agreed].astype(np.float64)
    off = np.abs(picture.depth[agreed] - depth) / depth
    ends = np.quantile(off, [0.5, 0.99, 1.0]) if len(off) else np.full(3, np.nan)
    return {
        "same": float(same.mean()),
        "different": int(same.size - same.sum()),
        "only_here": float((mine & ~ours).mean()),
        "only_ours": float((ours & ~mine).mean()),
        **{f"depth_{name}": float(v) for name, v in zip(("p50", "p99", "max"), ends, strict=True)},
    }
