"""The tables of the goal: what the certified hybrid is worth on each scene at each size."""

from __future__ import annotations

import pandas as pd

from hybrid_rt_bench.judged.columns import EMBREE, POINT, STRICT, WRONG
from hybrid_rt_bench.judged.pooling import Pooled, pools
from hybrid_rt_bench.judged.tables import common, shared, table_counts, table_main, timed
from hybrid_rt_bench.judged.text import (
    BOUND_NOTES,
    SPEEDUP_NOTE,
    STRICT_NOTE,
    cells_text,
    count_text,
    pays,
    share,
    speedup_text,
)
from hybrid_rt_bench.report.scenes import scene_name
from hybrid_rt_bench.report.table import DASH, Table, number, rate_text
from hybrid_rt_bench.results.folder import RunData

MARCH_GOAL = 0.3
"""The march's time over that of Embree on the same rays, at most."""
WRONG_GOAL = 0.001
"""The share of all rays that a technique may get wrong and still count as nearly right."""

COLUMNS = [
    "", "speed-up, measured", "lowest camera", "alpha", "wrong, resolved rays",
    f"march / Embree (goal {MARCH_GOAL:g})", "march, ns per ray", "Embree, ns per ray",
    "break-even march, ns per ray", "speed-up if the march took no time", "data, ms per view",
]  # fmt: skip
CERTIFIED, CHEAPEST = "certified", "certified at its cheapest"


def tables(run: RunData) -> list[Table]:
    """Return the speed-up by scene and camera, what is nearly right and fastest, all counts."""
    every = [
        table_goal(run),
        *table_nearly_right(run),
        table_cameras(run),
        table_main(run),
        table_counts(run),
    ]
    return [table for table in every if table.rows]


def table_goal(run: RunData) -> Table:
    """Return what each point of the certified march is worth, by scene and size, all cameras."""
    table = Table("Speed-up of the certified hybrid over the strongest Embree", COLUMNS)
    rows = common(certified(run))
    if rows.empty:
        return table
    scenes = {_title(run, scene): part for (scene,), part in pools(rows, ["scene"]).items()}
    for title, part in {**scenes, "all scenes": Pooled(rows)}.items():
        table.rows.append([title])
        for (width, height, *point), pooled in pools(part.rows, [*SIZE, *POINT]).items():
            name = f"{width}x{height}, {name_of(*point)}"
            table.rows.append(_row(name, pooled, run.samples, _lowest(pooled, run.samples)))
    table.notes += [
        f"{cells_text(rows)}. Alpha and counts of all cameras together. At its cheapest: "
        + "; ".join(dict.fromkeys(rows.loc[~rows["default"], "point"]))
        + ".",
        STRICT_NOTE,
        "March / Embree: T(march) / T(strongest Embree, every ray).",
        SPEEDUP_NOTE,
        *BOUND_NOTES,
        "Data: lists and pyramid, made once per view, not in the speed-up.",
    ]
    return table


def table_cameras(run: RunData) -> Table:
    """Return `table_goal` camera by camera."""
    columns = [name for name in COLUMNS if name != "lowest camera"]
    lowest = COLUMNS.index("lowest camera")
    table = Table("Speed-up of the certified hybrid, camera by camera", columns, detail=True)
    for (scene, width, height, *point), part in pools(
        certified(run), ["scene", *SIZE, *POINT]
    ).items():
        name = scene_name(run, scene)
        table.rows.append([f"{name}, {width}x{height}, {name_of(*point)}"])
        every = {camera: pooled for (camera,), pooled in pools(part.rows, ["camera"]).items()}
        for camera, pooled in {**every, "geometric mean": part}.items():
            row = _row(camera, pooled, run.samples, "")
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
    groups = {scene_name(run, scene): part for (scene,), part in pools(rows, ["scene"]).items()}
    for scene, part in {**groups, "all scenes": Pooled(rows)}.items():
        best = _fastest(common(part.rows), run.samples)
        if best is None:
            table.rows.append([scene, "none", *[DASH] * 4])
            continue
        name, pooled = best
        speedup = pooled.speedup(run.samples)
        wrong = rate_text(pooled.rate(WRONG, of_all=True))
        table.rows.append([scene, name, share(pooled), wrong, speedup_text(speedup), pays(speedup)])
    names = ", ".join(name_of(*key) for key in pools(rows, POINT))
    table.notes += [
        f"{cells_text(rows)}. Of: {names}.",
        "Wrong: false hits and false misses, of all rays of the hybrid; the rate and the upper end "
        f"of its 95 % interval are at most {most}.",
        "Pays: the interval of the speed-up lies above 1.",
    ]
    return [table]


SIZE = ("width", "height")


def certified(run: RunData) -> pd.DataFrame:
    """Return the timed rows of the certified march."""
    rows = timed(run)
    return rows[rows["technique"] == CERTIFIED]


def _fastest(rows: pd.DataFrame, samples: pd.DataFrame) -> tuple[str, Pooled] | None:
    found = []
    for key, pooled in pools(rows, POINT).items():
        speedup = pooled.speedup(samples)
        # The upper bound is above the rate.
        if speedup is not None and pooled.rate(WRONG, of_all=True).high <= WRONG_GOAL:
            found.append((speedup.value, name_of(*key), pooled))
    return max(found, key=lambda each: each[0])[1:] if found else None


def _lowest(pooled: Pooled, samples: pd.DataFrame) -> str:
    by = ["camera"] if pooled.rows["scene"].nunique() == 1 else ["scene", "camera"]
    speedups = {key: part.speedup(samples) for key, part in pools(pooled.rows, by).items()}
    known = {key: speedup.value for key, speedup in speedups.items() if speedup is not None}
    if not known:
        return DASH
    key = min(known, key=known.__getitem__)
    return f"{' '.join(key)} {number(known[key])}"


def _row(name: str, pooled: Pooled, samples: pd.DataFrame, lowest: str) -> list[str]:
    march = pooled.ratio(samples, "march", "embree")
    return [
        name,
        speedup_text(pooled.speedup(samples)),
        lowest,
        share(pooled),
        count_text(pooled.rate(STRICT)),
        DASH if march is None else number(march.value),
        number(pooled.nanoseconds("march_ms")),
        number(pooled.nanoseconds("embree_ms")),
        number(pooled.break_even_ns(samples)),
        speedup_text(pooled.free_march(samples)),
        number(pooled.mean("prepare_ms")),
    ]


def name_of(technique: str, point: str) -> str:
    """Return what a point is called; of the certified march the one beside its default."""
    return technique if technique != CERTIFIED or point == "base" else CHEAPEST


def _title(run: RunData, scene: str) -> str:
    sizes = {entry["name"]: entry["triangles"] for entry in run.meta["scenes"]}
    name = scene_name(run, scene)
    return f"{name}, {sizes[scene]:,} triangles" if scene in sizes else name
