"""Count what a technique answers of a frame's rays and, where there is a mesh, what is wrong."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

import hybrid_rt as hrt
from hybrid_rt_bench.judged.columns import MAP_CLASSES
from hybrid_rt_bench.kinds.frame.columns import NOWHERE, UNJUDGED, WRONG
from hybrid_rt_bench.measure.loaded import LoadedScene
from hybrid_rt_bench.measure.queries import query_of
from hybrid_rt_bench.measure.screens import Screens
from hybrid_rt_bench.measure.workloads import Workload

STRICT = (*WRONG, "wrong_primitive")


@dataclass(frozen=True, eq=False)
class Counted:
    """What is kept of a technique on one kind of rays.

    Attributes
    ----------
    row : dict
        Of the results.
    verdicts : list of dict
        Rays by status and verdict.
    maps : dict of (H, W) uint8
        "status": `MarchStatus` of the ray of each pixel, and "classes": its `MAP_CLASSES`, where
        answers were judged.
    """

    row: dict[str, Any]
    verdicts: list[dict[str, Any]]
    maps: dict[str, NDArray[np.uint8]]


def count(
    screens: Screens,
    rays: hrt.Rays,
    workload: Workload,
    technique: hrt.Technique,
    loaded: LoadedScene | None,
) -> Counted:
    """Return what a technique answers, and how many answers are wrong if the mesh is loaded."""
    screen = screens.of(technique)
    shape = screens.gbuffer.depth.shape
    if loaded is None:
        marched = hrt.march(rays, screen, any_hit=workload.any_hit, threads=screens.threads)
        verdict = np.full(len(rays), UNJUDGED, object)
        counts: dict[str, int] = dict.fromkeys(STRICT, 0)
        found = np.full(3, np.nan)
    else:
        query = query_of(workload)
        reference = query.trace(loaded.reference, rays)
        result = query.hybrid(rays, screen, loaded.reference, screens.threads)
        marched = result.marched
        judged = query.judge(
            rays, query.claims(result), reference, screen.camera, loaded.truth, marched.pixel
        )
        names = np.array([v.name for v in hrt.Verdict], object)
        verdict = names[judged.verdict]
        counts = {name: int((verdict[marched.resolved] == name.upper()).sum()) for name in STRICT}
        rate = hrt.Rate.of(sum(counts[name] for name in WRONG), int(marched.resolved.sum()))
        found = np.array([rate.value, rate.low, rate.high])
    verdict[~marched.resolved] = hrt.Verdict.UNRESOLVED.name
    resolved = int(marched.resolved.sum())
    row = {
        "technique": technique.name,
        "judged": loaded is not None,
        "rays": len(rays),
        "resolved": resolved,
        "hits": int((marched.resolved & (marched.prim_id >= 0)).sum()),
        **counts,
        "alpha": resolved / max(1, len(rays)),
        **dict(zip(("wrong_rate", "wrong_low", "wrong_high"), found.tolist(), strict=True)),
        "steps": float(marched.steps.sum(dtype=np.int64)),
    }
    maps = {"status": _map(shape, rays, marched.status, NOWHERE)}
    if loaded is not None:
        maps["classes"] = _map(shape, rays, _classes(verdict), MAP_CLASSES["background"])
    return Counted(row, _by_status(technique.name, marched, verdict), maps)


def _classes(verdict: NDArray[Any]) -> NDArray[np.uint8]:
    classes = np.full(len(verdict), MAP_CLASSES["right"], np.uint8)
    for name in ("unresolved", *STRICT):
        classes[verdict == name.upper()] = MAP_CLASSES[name]
    return classes


def _map(
    shape: tuple[int, ...], rays: hrt.Rays, values: NDArray[np.uint8], nowhere: int
) -> NDArray[np.uint8]:
    """Return values of rays at the pixels that they start in."""
    image = np.full(shape, nowhere, np.uint8)
    image[rays.pixel[:, 1], rays.pixel[:, 0]] = values
    return image


def _by_status(technique: str, marched: hrt.Marched, verdict: NDArray[Any]) -> list[dict[str, Any]]:
    rows = []
    for status in hrt.MarchStatus:
        names, counts = np.unique(verdict[marched.status == status].astype(str), return_counts=True)
        rows += [
            {"technique": technique, "status": status.name, "verdict": str(name), "count": int(n)}
            for name, n in zip(names, counts, strict=True)
        ]
    return rows
