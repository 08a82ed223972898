"""The table of an ablation: each switch of the certified march by itself, against one base."""

from __future__ import annotations

import pandas as pd

from hybrid_rt_bench.judged.columns import EMBREE, POINT, STRICT
from hybrid_rt_bench.judged.pooling import Pooled, pools
from hybrid_rt_bench.judged.tables import (
    BOUND_NOTES,
    STRICT_NOTE,
    cells_text,
    count_text,
    share,
    speedup_text,
    table_counts,
    table_status,
    timed,
)
from hybrid_rt_bench.report.table import Table, number
from hybrid_rt_bench.results.folder import RunData

COLUMNS = [
    "", "alpha", "steps a ray", "exact tests a ray", "march, ns a ray", "of base", "wrong",
    "speed-up, measured", "if the march took no time", "may cost, ns a ray", "Embree, ns a ray",
    "data, ms a view", "data, MiB a view",
]  # fmt: skip


def tables(run: RunData) -> list[Table]:
    """Return what each switch is worth, over all scenes and by scene, and counts of the defaults.

    The first point measured is the base.
    """
    rows = timed(run)
    rows = rows[rows["technique"] != EMBREE]
    whole = Table("What each part of the certified march is worth", COLUMNS)
    whole.rows += _rows(rows, run.samples)
    whole.notes += [
        f"{cells_text(rows)}. Each row differs from the first, the default, by what it says. Lists "
        "of k primitives a pixel are a depth buffer of k layers; cells of n x n pixels share a "
        "list; guard x2 has lists for a view twice as wide and high as the screen.",
        STRICT_NOTE,
        "Speed-up: T(strongest Embree, every ray) / T(march + compaction + fallback + merge), run "
        "side by side; geometric mean over cells of the median over rounds [95 % interval].",
        *BOUND_NOTES,
        "Data: made for the march once a view (pyramid, and lists if any), not in the speed-up.",
    ]
    others = [table_counts(run), table_status(run)]
    scenes = pools(rows, ["scene"])
    if len(scenes) == 1:
        return [whole, *others]
    parts = Table(f"{whole.title}, scene by scene", COLUMNS, detail=True)
    for (scene,), part in scenes.items():
        parts.rows += [[scene], *_rows(part.rows, run.samples)]
    parts.notes.append("As the table before.")
    return [whole, parts, *others]


def _rows(rows: pd.DataFrame, samples: pd.DataFrame) -> list[list[str]]:
    found = pools(rows, POINT)
    base = next(iter(found.values())).nanoseconds("march_ms")
    return [_row(_name(*key), pooled, samples, base) for key, pooled in found.items()]


def _name(technique: str, point: str) -> str:
    return point if technique == "certified" else technique


def _row(name: str, pooled: Pooled, samples: pd.DataFrame, base: float) -> list[str]:
    march = pooled.nanoseconds("march_ms")
    return [
        name,
        share(pooled),
        number(pooled.steps_per_ray),
        number(pooled.rows["tests"].sum() / pooled.rays),
        number(march),
        number(march / base),
        count_text(pooled.rate(STRICT)),
        speedup_text(pooled.speedup(samples)),
        speedup_text(pooled.free_march(samples)),
        number(pooled.may_cost(samples)),
        number(pooled.nanoseconds("embree_ms")),
        number(pooled.mean("prepare_ms")),
        number(pooled.mean("prepare_mib")),
    ]
