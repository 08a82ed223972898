"""What the answers are worth: alpha, verdicts and errors of one cell, and the pixels of its figure."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import hybrid_rt as hrt
import numpy as np
from hybrid_rt import metrics
from numpy.typing import NDArray

from hybrid_rt_bench import shade
from hybrid_rt_bench.results import PIXEL_CLASSES

CLAIMS = ("FALSE_HIT", "FALSE_MISS", "WRONG_PRIMITIVE", "TIE")


@dataclass(frozen=True, eq=False)
class Quality:
    """What the judge found.

    Attributes
    ----------
    columns : dict
        Columns of the results row.
    verdicts : list of dict
        Number of rays by status and verdict.
    wrong : (N,) bool
        False hits and false misses among the rays that the march answered.
    """

    columns: dict[str, Any]
    verdicts: list[dict[str, Any]]
    wrong: NDArray[np.bool_]


def judge(
    rays: hrt.Rays,
    gbuffer: hrt.GBuffer,
    result: hrt.HybridResult,
    reference: hrt.Hits,
) -> Quality:
    """Return alpha, the rate of every verdict with its interval, and the errors in t and pixels."""
    judged = metrics.judge(
        rays,
        result.hits,
        result.resolved,
        reference,
        gbuffer.scene,
        gbuffer.camera,
        pixel=result.pixel,
    )
    n, resolved = len(rays), int(result.resolved.sum())
    verdict = np.asarray(judged.verdict)
    columns: dict[str, Any] = {"rays": n, "resolved": resolved}
    alpha = metrics.Rate.of(resolved, n)
    columns |= {"alpha": alpha.value, "alpha_low": alpha.low, "alpha_high": alpha.high}
    for name in CLAIMS:
        count = int(np.count_nonzero(verdict == metrics.Verdict[name]))
        columns |= _rate(name.lower(), count, resolved)
    wrong = np.isin(verdict, [metrics.Verdict.FALSE_HIT, metrics.Verdict.FALSE_MISS])
    columns |= _rate("wrong", int(wrong.sum()), n)
    columns["reference_wrong_count"] = int(
        np.count_nonzero(verdict == metrics.Verdict.REFERENCE_WRONG)
    )
    for name in ("error_t", "error_px"):
        values = np.asarray(getattr(judged, name))[result.resolved]
        values = values[np.isfinite(values)]
        p50, p99 = np.quantile(values, [0.5, 0.99]) if len(values) else (np.nan, np.nan)
        columns |= {f"{name}_p50": float(p50), f"{name}_p99": float(p99)}
    return Quality(columns, _counts(result.status, verdict), wrong)


def picture(
    gbuffer: hrt.GBuffer,
    rays: hrt.Rays,
    result: hrt.HybridResult,
    wrong: NDArray[np.bool_],
) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """Return the reflections in greys, and the class of every pixel (see `PIXEL_CLASSES`).

    Returns
    -------
    grey, classes : (H, W) uint8
    """
    shape = gbuffer.prim_id.shape
    x, y = rays.pixel[:, 0], rays.pixel[:, 1]
    grey, classes = np.zeros(shape, np.uint8), np.zeros(shape, np.uint8)
    grey[y, x] = np.round(255 * shade.reflected_grey(rays, result.hits))
    kinds = np.where(result.resolved, PIXEL_CLASSES["right"], PIXEL_CLASSES["unresolved"])
    classes[y, x] = np.where(wrong, PIXEL_CLASSES["wrong"], kinds)
    return grey, classes


def _rate(name: str, count: int, total: int) -> dict[str, Any]:
    rate = metrics.Rate.of(count, total)
    return {
        f"{name}_count": count,
        f"{name}_rate": rate.value,
        f"{name}_low": rate.low,
        f"{name}_high": rate.high,
    }


def _counts(status: NDArray[np.uint8], verdict: NDArray[Any]) -> list[dict[str, Any]]:
    return [
        {"status": s.name, "verdict": v.name, "count": count}
        for s in hrt.MarchStatus
        for v in metrics.Verdict
        if (count := int(np.count_nonzero((status == s) & (verdict == v))))
    ]
