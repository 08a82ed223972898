"""The tables of the goal: what the certified hybrid is worth on each scene at each size."""

from __future__ import annotations

import pandas as pd

from hybrid_rt_bench.judged.columns import EMBREE, POINT, STRICT, WRONG
from hybrid_rt_bench.judged.pooling import Pooled, pools
from hybrid_rt_bench.judged.tables import (
    BOUND_NOTES,
    STRICT_NOTE,
    cells_text,
    count_text,
    pays,
    rate_text,
    share,
    shared,
    speedup_text,
    table_counts,
    table_main,
    timed,
)
from hybrid_rt_bench.report.table import Table, number
from hybrid_rt_bench.results.folder import RunData

MARCH_GOAL = 0.3
"""What the march may cost, in times of Embree on the same rays."""
WRONG_GOAL = 0.001
"""The share of all rays that a technique may get wrong and still count as nearly right."""

COLUMNS = [
    "", "alpha", "wrong", "march, ns a ray", "Embree, ns a ray",
    f"march / Embree, goal {MARCH_GOAL:g}", "speed-up, measured", "lowest camera",
    "if the march took no time", "may cost, ns a ray", "data, ms a view",
]  # fmt: skip
CERTIFIED, CHEAPEST = "certified", "certified at its cheapest"


def tables(run: RunData) -> list[Table]:
    """Return the speed-up by scene and camera, what is nearly right and fastest, all counts."""
    return [
        table_goal(run),
        *table_nearly_right(run),
        table_cameras(run),
        table_main(run),
        table_counts(run),
    ]


def table_goal(run: RunData) -> Table:
    """Return what each point of the certified march is worth, by scene and size, all cameras."""
    table = Table("Speed-up of the certified hybrid over the strongest Embree", COLUMNS)
    rows = _certified(run)
    scenes = {_title(run, scene): part for (scene,), part in pools(rows, ["scene"]).items()}
    for title, part in {**scenes, "all scenes": Pooled(rows)}.items():
        table.rows.append([title])
        for (width, height, *point), pooled in pools(part.rows, [*SIZE, *POINT]).items():
            name = f"{width}x{height}, {_name(*point)}"
            table.rows.append(_row(name, pooled, run.samples, _lowest(pooled, run.samples)))
    table.notes += [
        f"{cells_text(rows)}. Alpha and counts of all cameras together. At its cheapest: "
        + "; ".join(dict.fromkeys(rows.loc[~rows["default"], "point"]))
        + ".",
        STRICT_NOTE,
        "March / Embree: T(march) / T(strongest Embree, every ray). Speed-up: T(strongest Embree, "
        "every ray) / T(march + compaction + fallback + merge). Both run side by side; geometric "
        "mean over cameras of the median over rounds [95 % bootstrap interval over rounds].",
        *BOUND_NOTES,
        "Data: lists and pyramid, made once a view, not in the speed-up.",
    ]
    return table


def table_cameras(run: RunData) -> Table:
    """Return `table_goal` camera by camera."""
    columns = [name for name in COLUMNS if name != "lowest camera"]
    lowest = COLUMNS.index("lowest camera")
    table = Table("Speed-up of the certified hybrid, camera by camera", columns, detail=True)
    for (scene, width, height, *point), part in pools(
        _certified(run), ["scene", *SIZE, *POINT]
    ).items():
        table.rows.append([f"{scene}, {width}x{height}, {_name(*point)}"])
        every = {camera: pooled for (camera,), pooled in pools(part.rows, ["camera"]).items()}
        for name, pooled in {**every, "geometric mean": part}.items():
            row = _row(name, pooled, run.samples, "")
            table.rows.append(row[:lowest] + row[lowest + 1 :])
    table.notes.append(
        "As the table before. Geometric mean: of the ratios; all else of all rays together."
    )
    return table


def table_nearly_right(run: RunData) -> list[Table]:
    """Return, for each scene, the fastest technique that is hardly ever wrong."""
    rows = shared(run)
    rows = rows[rows["technique"] != EMBREE]
    if rows["technique"].nunique() < 2:
        return []
    most = f"{100 * WRONG_GOAL:g} %"
    table = Table(
        f"The fastest technique that is wrong on at most {most} of all rays",
        ["", "technique", "alpha", "wrong, % of all rays", "speed-up, measured", "pays"],
    )
    groups = {scene: part for (scene,), part in pools(rows, ["scene"]).items()}
    for scene, part in {**groups, "all scenes": Pooled(rows)}.items():
        best = _fastest(part, run.samples)
        if best is None:
            table.rows.append([scene, "none", *["–"] * 4])
            continue
        name, pooled = best
        speedup = pooled.speedup(run.samples)
        wrong = rate_text(pooled.rate(WRONG, of_all=True))
        table.rows.append([scene, name, share(pooled), wrong, speedup_text(speedup), pays(speedup)])
    names = ", ".join(_name(*key) for key in pools(rows, POINT))
    table.notes += [
        f"{cells_text(rows)}. Of: {names}.",
        "Wrong: false hits and false misses, of all rays of the hybrid; the rate and the upper end "
        f"of its 95 % interval are at most {most}.",
        "Pays: the interval of the speed-up lies above 1.",
    ]
    return [table]


SIZE = ("width", "height")


def _certified(run: RunData) -> pd.DataFrame:
    rows = timed(run)
    return rows[rows["technique"] == CERTIFIED]


def _fastest(part: Pooled, samples: pd.DataFrame) -> tuple[str, Pooled] | None:
    found = []
    for key, pooled in pools(part.rows, POINT).items():
        speedup = pooled.speedup(samples)
        # The upper bound is above the rate.
        if speedup is not None and pooled.rate(WRONG, of_all=True).high <= WRONG_GOAL:
            found.append((speedup.value, _name(*key), pooled))
    return max(found, key=lambda each: each[0])[1:] if found else None


def _lowest(pooled: Pooled, samples: pd.DataFrame) -> str:
    by = ["camera"] if pooled.rows["scene"].nunique() == 1 else ["scene", "camera"]
    speedups = {key: part.speedup(samples) for key, part in pools(pooled.rows, by).items()}
    known = {key: speedup.value for key, speedup in speedups.items() if speedup is not None}
    if not known:
        return "–"
    key = min(known, key=known.__getitem__)
    return f"{' '.join(key)} {number(known[key])}"


def _row(name: str, pooled: Pooled, samples: pd.DataFrame, lowest: str) -> list[str]:
    march = pooled.ratio(samples, "march", "embree")
    return [
        name,
        share(pooled),
        count_text(pooled.rate(STRICT)),
        number(pooled.nanoseconds("march_ms")),
        number(pooled.nanoseconds("embree_ms")),
        "–" if march is None else number(march.value),
        speedup_text(pooled.speedup(samples)),
        lowest,
        speedup_text(pooled.free_march(samples)),
        number(pooled.may_cost(samples)),
        number(pooled.mean("prepare_ms")),
    ]


def _name(technique: str, point: str) -> str:
    return technique if technique != CERTIFIED or point == "base" else CHEAPEST


def _title(run: RunData, scene: str) -> str:
    sizes = {entry["name"]: entry["triangles"] for entry in run.meta["scenes"]}
    return f"{scene} ({sizes[scene]:,} triangles)" if scene in sizes else scene
