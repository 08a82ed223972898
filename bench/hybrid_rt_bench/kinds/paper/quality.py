"""What the answers of a cell are worth: alpha, verdicts, errors, and the pixels of its figure."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

import hybrid_rt as hrt
from hybrid_rt.judging import metrics
from hybrid_rt_bench.kinds.paper.columns import PIXEL_CLASSES
from hybrid_rt_bench.measure import shade


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
    truth: hrt.Truth,
) -> Quality:
    """Return alpha, the rate of every verdict with its interval, and the errors in t and pixels."""
    judged = metrics.judge(
        rays,
        result.hits,
        result.resolved,
        reference,
        gbuffer.known_scene,
        gbuffer.camera,
        pixel=result.pixel,
        truth=truth,
    )
    rates = metrics.rates(judged)
    wrong = np.isin(judged.verdict, [metrics.Verdict.FALSE_HIT, metrics.Verdict.FALSE_MISS])
    n = len(rays)
    alpha = rates["alpha"]
    columns: dict[str, Any] = {
        "rays": n,
        "resolved": alpha.count,
        "alpha": alpha.value,
        "alpha_low": alpha.low,
        "alpha_high": alpha.high,
        **_rate("wrong", hrt.Rate.of(int(wrong.sum()), n)),
    }
    for name, rate in rates.items():
        if name not in ("alpha", "correct"):
            columns |= _rate(name, rate)
    for name in ("error_t", "error_px"):
        values: NDArray[np.float64] = getattr(judged, name)[result.resolved]
        values = values[np.isfinite(values)]
        p50, p99 = np.quantile(values, [0.5, 0.99]) if len(values) else (np.nan, np.nan)
        columns |= {f"{name}_p50": float(p50), f"{name}_p99": float(p99)}
    return Quality(columns, _counts(result.status, judged.verdict), wrong)


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


def _rate(name: str, rate: hrt.Rate) -> dict[str, Any]:
    return {
        f"{name}_count": rate.count,
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
