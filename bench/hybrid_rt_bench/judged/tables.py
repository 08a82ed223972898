"""Tables of runs that judge: what each technique is worth, and what it gets wrong."""

from __future__ import annotations

from typing import Any

import pandas as pd

from hybrid_rt.judging.rate import Rate
from hybrid_rt_bench.judged.columns import CELL, EMBREE, POINT, STRICT, WRONG
from hybrid_rt_bench.judged.pooling import Pooled, pools
from hybrid_rt_bench.report.table import Table, interval, number
from hybrid_rt_bench.results import statistics as stats
from hybrid_rt_bench.results.folder import RunData

STRICT_NOTE = (
    "Wrong: false hits, false misses and wrong primitives together, among the rays that the "
    "screen answers [95 % upper bound of their rate; 3 / N if none was seen]."
)
BOUND_NOTES = (
    "If the march took no time: the speed-up without T(march) in it, the most that any march "
    "which answers the same rays could reach.",
    "May cost: the march at which the hybrid would break even, (T(strongest Embree, every ray) "
    "- T(compaction) - T(fallback) - T(merge)) / rays, of the same runs. Below 0, what is left "
    "for Embree takes longer than all rays did: no march is fast enough.",
)
"""What `Pooled.free_march` and `Pooled.may_cost` are, under the tables that show them."""


def table_main(run: RunData) -> Table:
    """Return speed against error of every point, over the cells that all of them share."""
    table = Table(
        "Speed against error",
        [
            "", "alpha", "wrong, % of answers", "wrong primitive, %", "wrong, % of all rays",
            "march, Mrays/s", "steps a ray", "speed-up, measured",
        ],
    )  # fmt: skip
    rows = shared(run)
    samples = run.samples
    for (technique, point), pooled in pools(rows, POINT).items():
        table.rows.append(
            [
                full_name(technique, point, pooled),
                share(pooled),
                rate_text(pooled.rate(WRONG)),
                percent_text(pooled.rate("wrong_primitive")),
                rate_text(pooled.rate(WRONG, of_all=True)),
                number(march_rate(technique, pooled)),
                number(pooled.steps_per_ray),
                speedup_text(pooled.speedup(samples)),
            ]
        )
    table.notes += [
        f"{cells_text(rows)}. Answers: the rays that the screen resolves; alpha is their share.",
        "Wrong: a false hit or a false miss, more than a pixel from the truth. Wrong primitive: "
        "another triangle than the true one, within a pixel. All rays: of the hybrid with robust "
        "Embree as its fallback, so that an error of the hand-over is counted.",
        "[95 % interval: Clopper-Pearson for shares of rays, as if each were drawn by itself; "
        "bootstrap over rounds for speed-ups]. None seen among N rays: at most 3 / N.",
        "Speed-up: T(strongest Embree, every ray) / T(march + compaction + fallback + merge), run "
        "side by side; geometric mean over cells of the median over rounds. The raster and what is "
        "built from it are not in it: see 'When does it pay'.",
        "embree robust is what everything else is judged against; counted as wrong is where a "
        "float64 judge found it so, looking only where a technique disagreed with it.",
    ]
    return table


def table_scenes(run: RunData) -> Table:
    """Return speed against error of every technique's default point, scene by scene."""
    table = Table(
        "Speed against error, scene by scene",
        [
            "", "alpha", "wrong, % of answers", "wrong, % of all rays", "march, Mrays/s",
            "speed-up, measured",
        ],
        detail=True,
    )  # fmt: skip
    rows = defaults(shared(run))
    for (scene,), part in pools(rows, ["scene"]).items():
        table.rows.append([scene])
        for (technique, point), pooled in pools(part.rows, POINT).items():
            table.rows.append(
                [
                    point_name(technique, point),
                    share(pooled),
                    rate_text(pooled.rate(WRONG)),
                    rate_text(pooled.rate(WRONG, of_all=True)),
                    number(march_rate(technique, pooled)),
                    speedup_text(pooled.speedup(run.samples)),
                ]
            )
    table.notes.append("Default parameters of each technique; otherwise as the table before.")
    return table


def table_workloads(run: RunData) -> Table:
    """Return, for each kind of rays, what each technique is worth and whether it pays."""
    table = Table(
        "When does it pay",
        [
            "", "alpha", "wrong, % of answers", "speed-up, measured", "pays",
            "strongest Embree, Mrays/s", "data for the march, ms a view",
        ],
    )  # fmt: skip
    rows = defaults(timed(run))
    for (workload,), part in pools(rows, ["workload"]).items():
        table.rows.append([workload])
        for (technique, point), pooled in pools(part.rows, POINT).items():
            if technique == EMBREE:
                continue
            speedup = pooled.speedup(run.samples)
            table.rows.append(
                [
                    point_name(technique, point),
                    share(pooled),
                    rate_text(pooled.rate(WRONG)),
                    speedup_text(speedup),
                    pays(speedup),
                    number(pooled.per_second("embree_ms")),
                    number(pooled.mean("prepare_ms")),
                ]
            )
    table.notes += [
        f"Default parameters of each technique. {cells_text(rows)}.",
        "Pays: the interval of the speed-up lies above 1. Data for the march: pyramids, and lists "
        "of primitives if any, made once a view and not counted in the speed-up.",
    ]
    return table


def table_counts(run: RunData) -> Table:
    """Return how many rays were judged in all, and the counts with their upper bounds."""
    table = Table(
        "All rays that were judged",
        [
            "", "rays", "answers", *(_words(name) for name in STRICT), "rate of all three",
            "at most", "rate of all rays of the hybrid", "at most",
        ],
    )  # fmt: skip
    rows = run.results[run.results.technique != EMBREE]
    rows = defaults(rows)
    for (technique, point), pooled in pools(rows, POINT).items():
        mine, of_all = pooled.rate(STRICT), pooled.rate(STRICT, of_all=True)
        table.rows.append(
            [
                point_name(technique, point),
                f"{pooled.rays:,}",
                f"{pooled.resolved:,}",
                *(f"{pooled.rate(name).count:,}" for name in STRICT),
                _power(mine.value),
                f"{_power(mine.high)}",
                _power(of_all.value),
                f"{_power(of_all.high)}",
            ]
        )
    table.notes.append(
        "Every cell, timed or counted, each technique with its default parameters. At most: the "
        "upper end of the 95 % interval; 3 / N for a count of zero."
    )
    return table


def table_lists(run: RunData) -> list[Table]:
    """Return what longer lists of primitives answer and cost, if there is more than one length."""
    rows = run.results
    rows = rows[
        (rows["lists_mib"] > 0) & rows["timed"] & (rows["workload"] == rows["workload"].iloc[0])
    ]
    if rows["point"].nunique() < 2:
        return []
    table = Table(
        "How long a list of primitives pays",
        [
            "", "alpha, mean of cameras", "exact tests a ray", "steps a ray", "lists, MiB a view",
            "making them, ms a view", "march, Mrays/s", "speed-up, measured",
        ],
    )  # fmt: skip
    for (scene,), part in pools(rows, ["scene"]).items():
        table.rows.append([scene])
        for (technique, point), pooled in pools(part.rows, POINT).items():
            table.rows.append(
                [
                    point,
                    number(pooled.mean("alpha")),
                    number(pooled.rows["tests"].sum() / pooled.rays),
                    number(pooled.steps_per_ray),
                    number(pooled.mean("lists_mib")),
                    number(pooled.mean("prepare_ms")),
                    number(march_rate(technique, pooled)),
                    speedup_text(pooled.speedup(run.samples)),
                ]
            )
    table.notes += [
        f"{cells_text(rows)}. A list takes 8 bytes a primitive and 4 for the bound of the rest, "
        "for every pixel, full or not; what does not fit makes rays unresolved, never wrong.",
        "Making them: the lists and the conservative pyramid.",
    ]
    return [table]


def table_cameras(run: RunData) -> Table:
    """Return the alpha of every technique's default point at each camera's largest resolution."""
    rows = defaults(run.results)
    rows = rows[(rows["workload"] == rows["workload"].iloc[0]) & (rows["technique"] != EMBREE)]
    rows = rows[rows["height"] == rows.groupby(["scene", "camera"])["height"].transform("max")]
    names = list(dict.fromkeys(rows["technique"]))
    table = Table("Alpha, camera by camera", ["", *names], detail=True)
    for (scene,), part in pools(rows, ["scene"]).items():
        cameras = part.rows.pivot_table("alpha", "camera", "technique", sort=False)
        table.rows.append([scene])
        for camera, alphas in cameras.iterrows():
            table.rows.append([str(camera), *(number(float(alphas[name])) for name in names)])
        means = cameras.mean()
        table.rows.append([f"{scene}, mean", *(number(float(means[name])) for name in names)])
    table.notes.append(f"{_words(rows['workload'].iloc[0])} rays, default parameters.")
    return table


def table_status(run: RunData) -> Table:
    """Return how the marches of each technique ended and how often each ending was wrong."""
    table = Table(
        "How the marches ended, %", ["", "of all rays", "of them answered", "wrong, of answers"],
        detail=True,
    )  # fmt: skip
    rows = defaults(shared(run))
    counts = run.verdicts.merge(rows[[*CELL, *POINT]], on=[*CELL, *POINT])
    for key, part in counts.groupby(list(POINT), sort=False):
        table.rows.append([point_name(*(str(k) for k in key))])
        total = part["count"].sum()
        for status, group in part.groupby("status", sort=False):
            by_verdict = group.groupby("verdict")["count"].sum()
            whole = int(by_verdict.sum())
            answered = whole - int(by_verdict.get("UNRESOLVED", 0))
            wrong = sum(int(by_verdict.get(name.upper(), 0)) for name in WRONG)
            table.rows.append(
                [
                    str(status).lower(),
                    number(100 * whole / total),
                    number(100 * answered / whole),
                    rate_text(Rate.of(wrong, answered)) if answered else "–",
                ]
            )
    return table


def table_t_error(run: RunData) -> Table:
    """Return how far the distances of claimed hits are off."""
    table = Table(
        "Error of t, |t - t_true| / t_true, of claimed hits",
        ["", "p50, median over cells", "p99, median over cells", "p99, worst cell", "largest"],
        detail=True,
    )
    for (technique, point), pooled in pools(shared(run), POINT).items():
        if pooled.rows["error_t_p50"].notna().any():
            table.rows.append(
                [
                    full_name(technique, point, pooled),
                    _power(pooled.median("error_t_p50")),
                    _power(pooled.median("error_t_p99")),
                    _power(pooled.largest("error_t_p99")),
                    _power(pooled.largest("error_t_max")),
                ]
            )
    table.notes.append(
        "Of answers whose ray truly hits something: p50 and p99 of every 8th ray; the largest of "
        "these and of all that differ from the reference. Float32 has 6e-8."
    )
    return table


def table_image(run: RunData) -> list[Table]:
    """Return how far the image of the reflections is off; nothing if no cell kept its picture."""
    if "flip" not in run.results:
        return []
    rows = run.results[run.results.flip.notna()]
    table = Table(
        "Error of the image of mirror reflections, hybrid against robust Embree",
        ["", "FLIP, mean", "FLIP, worst view", "RMSE, mean", "RMSE, worst view"],
    )
    for (technique, point), pooled in pools(rows, POINT).items():
        means = (("mean", pooled.mean), ("largest", pooled.largest))
        table.rows.append(
            [
                point_name(technique, point),
                *(number(of(column)) for column in ("flip", "rmse") for _, of in means),
            ]
        )
    table.notes.append(
        f"{len(rows[[*CELL]].drop_duplicates())} views, 0 to 1. What the screen does not answer is "
        "traced, so an image errs only by what a technique claims."
    )
    return [table]


def shared(run: RunData) -> pd.DataFrame:
    """Return the rows of the timed cells in which every point was measured."""
    rows = timed(run)
    points = rows.groupby(list(POINT), sort=False).ngroups
    of_cell = rows.groupby(list(CELL))["technique"].transform("size")
    whole = rows[of_cell == points]
    return whole if len(whole) else rows


def timed(run: RunData) -> pd.DataFrame:
    """Return the rows of timed cells."""
    return run.results[run.results.timed]


def defaults(rows: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of default parameters."""
    return rows[rows.default]


def march_rate(technique: str, pooled: Pooled) -> float:
    """Return Mrays/s of a technique by itself: of its march, or of Embree."""
    return pooled.per_second("hybrid_ms" if technique == EMBREE else "march_ms")


def point_name(technique: str, point: str) -> str:
    """Return what one of the defaults is called; Embree has two."""
    return f"{technique}, {point}" if technique == EMBREE else technique


def full_name(technique: str, point: str, pooled: Pooled) -> str:
    """Return what a point is called among all the points of its technique."""
    if technique == EMBREE:
        return f"{technique}, {point}"
    chosen = bool(pooled.rows.default.iloc[0])
    return f"{technique}, {point}" + (" (default)" if chosen and point != "default" else "")


def share(pooled: Pooled) -> str:
    """Return alpha."""
    return f"{pooled.alpha:.3f}"


def count_text(rate: Rate) -> str:
    """Return how many rays were counted, and the upper end of the interval of their rate."""
    return f"{rate.count:,} [at most {_power(rate.high)}]" if rate.total else "–"


def rate_text(rate: Rate) -> str:
    """Return a rate in per cent with its interval; a zero stays a zero, with its bound."""
    if rate.total == 0:
        return "–"
    low, high = number(100 * rate.low, 2), number(100 * rate.high, 2)
    if rate.count == 0:
        return f"0 [at most {high}]"
    return f"{number(100 * rate.value)} [{low}, {high}]"


def percent_text(rate: Rate) -> str:
    """Return a rate in per cent."""
    return number(100 * rate.value)


def speedup_text(speedup: stats.Estimate | None) -> str:
    """Return a speed-up with its interval."""
    return "–" if speedup is None else interval(speedup.value, speedup.low, speedup.high)


def pays(speedup: stats.Estimate | None) -> str:
    """Return on which side of 1 the interval of a speed-up lies."""
    if speedup is None:
        return "–"
    return "yes" if speedup.low > 1 else "no" if speedup.high < 1 else "break-even"


def _power(value: float) -> str:
    """Return a small number with two digits and an exponent; zero and one as they are."""
    if value != value:
        return "–"
    return f"{value:.1e}" if 0 < value < 0.01 else number(value, 2)


def _words(name: str) -> str:
    return name.replace("_", " ")


def cells_text(rows: pd.DataFrame) -> str:
    """Return which cells rows are of, in words."""

    def listed(column: str) -> str:
        return ", ".join(str(value) for value in dict.fromkeys(rows[column]))

    cells: Any = rows[[*CELL]].drop_duplicates()
    sizes = dict.fromkeys(f"{w}x{h}" for w, h in zip(cells.width, cells.height, strict=True))
    count = f"{len(cells)} cell" + ("s" if len(cells) != 1 else "")
    return f"{count}: {listed('scene')}; {listed('workload')} rays; {', '.join(sizes)}"
