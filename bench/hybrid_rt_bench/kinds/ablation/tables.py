"""The table of an ablation: each switch of the certified march by itself, against one base."""

from __future__ import annotations

import pandas as pd

from hybrid_rt_bench.judged.columns import EMBREE, POINT, STRICT
from hybrid_rt_bench.judged.pooling import Pooled, pools
from hybrid_rt_bench.judged.tables import common, shared, table_counts, table_status
from hybrid_rt_bench.judged.text import (
    BOUND_NOTES,
    SPEEDUP_NOTE,
    STRICT_NOTE,
    cells_text,
    count_text,
    share,
    speedup_text,
)
from hybrid_rt_bench.report.scenes import scene_name
from hybrid_rt_bench.report.table import Table, number
from hybrid_rt_bench.results.folder import RunData

COLUMNS = [
    "", "march, ns per ray", "march, times the base", "alpha", "wrong, resolved rays",
    "speed-up, measured", "speed-up if the march took no time", "break-even march, ns per ray",
    "Embree, ns per ray", "steps per ray", "exact tests per ray", "data, ms per view",
    "data, MiB per view",
]  # fmt: skip


def tables(run: RunData) -> list[Table]:
    """Return what each switch is worth, over all scenes and by scene, and counts of the defaults.

    The first point measured is the base.
    """
    rows = shared(run)
    rows = rows[rows["technique"] != EMBREE]
    whole = Table("What each part of the certified march is worth", COLUMNS)
    whole.rows += _rows(rows, run.samples)
    whole.notes += [
        f"{cells_text(rows)}. Each row differs from the first, the default, by what it says. Lists "
        "of k primitives a pixel are a depth buffer of k layers; cells of n x n pixels share a "
        "list; guard x2 has lists for a view twice as wide and high as the screen.",
        STRICT_NOTE,
        SPEEDUP_NOTE,
        *BOUND_NOTES,
        "Data: made for the march once per view (pyramid, and lists if any), not in the speed-up.",
    ]
    others = [table_counts(run), table_status(run)]
    scenes = pools(rows, ["scene"])
    if len(scenes) == 1:
        return [whole, *others]
    parts = Table(f"{whole.title}, scene by scene", COLUMNS, detail=True)
    for (scene,), part in scenes.items():
        parts.rows += [[scene_name(run, scene)], *_rows(common(part.rows), run.samples)]
    parts.notes.append("As the table before.")
    return [whole, parts, *others]


def _rows(rows: pd.DataFrame, samples: pd.DataFrame) -> list[list[str]]:
    found = pools(rows, POINT)
    if not found:
        return []
    base = next(iter(found.values())).nanoseconds("march_ms")
    return [_row(name_of(*key), pooled, samples, base) for key, pooled in found.items()]


def name_of(technique: str, point: str) -> str:
    """Return what a point is called: of technique certified its switch stands beside the name."""
    return f"{technique}, {point}" if technique == "certified" else technique


def _row(name: str, pooled: Pooled, samples: pd.DataFrame, base: float) -> list[str]:
    march = pooled.nanoseconds("march_ms")
    return [
        name,
        number(march),
        number(march / base),
        share(pooled),
        count_text(pooled.rate(STRICT)),
        speedup_text(pooled.speedup(samples)),
        speedup_text(pooled.free_march(samples)),
        number(pooled.break_even_ns(samples)),
        number(pooled.nanoseconds("embree_ms")),
        number(pooled.steps_per_ray),
        number(pooled.tests_per_ray),
        number(pooled.mean("prepare_ms")),
        number(pooled.mean("prepare_mib")),
    ]
