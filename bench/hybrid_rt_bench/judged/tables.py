"""Tables of runs that judge: what each technique is worth, and what it gets wrong."""

from __future__ import annotations

from collections.abc import Iterable

import pandas as pd

from hybrid_rt.judging.rate import Rate
from hybrid_rt_bench.judged.columns import CELL, EMBREE, POINT, STRICT, WRONG
from hybrid_rt_bench.judged.pooling import Pooled, pools
from hybrid_rt_bench.judged.text import (
    SPEEDUP_NOTE,
    cells_text,
    full_name,
    pays,
    plain,
    point_name,
    power,
    share,
    speedup_text,
)
from hybrid_rt_bench.report.scenes import scene_name
from hybrid_rt_bench.report.table import ABSENT, DASH, Table, number, rate_text
from hybrid_rt_bench.results.folder import RunData


def table_main(run: RunData) -> Table:
    """Return speed against error of every point, over the cells that all of them share."""
    table = Table(
        "Speed against error",
        [
            "", "alpha", "wrong, % of resolved rays", "wrong, % of all rays", "march, Mrays/s",
            "speed-up, measured", "wrong primitive, % of resolved rays", "steps per ray",
        ],
    )  # fmt: skip
    rows = shared(run)
    for (technique, point), pooled in pools(rows, POINT).items():
        table.rows.append(
            [
                full_name(technique, point, pooled),
                share(pooled),
                rate_text(pooled.rate(WRONG)),
                rate_text(pooled.rate(WRONG, of_all=True)),
                number(march_rate(technique, pooled)),
                speedup_text(pooled.speedup(run.samples)),
                rate_text(pooled.rate("wrong_primitive")),
                number(pooled.steps_per_ray),
            ]
        )
    table.notes += [
        f"{cells_text(rows)}. Resolved rays: those that the screen answers; alpha is their share.",
        "Wrong: a false hit or a false miss, more than a pixel from the truth. Wrong primitive: "
        "another triangle than the true one, within a pixel. All rays: of the hybrid with robust "
        "Embree as its fallback, so that an error of the hand-over is counted.",
        "[95 % interval: Clopper-Pearson for shares of rays, as if each were drawn by itself]. "
        "None seen among N rays: at most 3 / N.",
        f"{SPEEDUP_NOTE} The raster and what is built from it are not in it: see 'When does it "
        "pay'.",
        "embree robust is what everything else is judged against; counted as wrong is where a "
        "float64 judge found it so, looking only where a technique disagreed with it.",
    ]
    return table


def table_scenes(run: RunData) -> Table:
    """Return speed against error of every technique's default point, scene by scene."""
    table = Table(
        "Speed against error, scene by scene",
        [
            "", "alpha", "wrong, % of resolved rays", "wrong, % of all rays", "march, Mrays/s",
            "speed-up, measured",
        ],
        detail=True,
    )  # fmt: skip
    rows = defaults(shared(run))
    names = _names(rows)
    for (scene,), part in pools(rows, ["scene"]).items():
        table.rows.append([scene_name(run, scene)])
        found = pools(part.rows, POINT)
        for (technique, point), pooled in found.items():
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
        table.rows += _lacking(table, names, found)
    table.notes.append("Default parameters of each technique; otherwise as the table before.")
    return table


def table_workloads(run: RunData) -> Table:
    """Return, for each kind of rays, what each technique is worth and whether it pays."""
    table = Table(
        "When does it pay",
        [
            "", "alpha", "wrong, % of resolved rays", "speed-up, measured", "pays",
            "strongest Embree, Mrays/s", "data for the march, ms per view",
        ],
    )  # fmt: skip
    rows = defaults(timed(run))
    rows = rows[rows["technique"] != EMBREE]
    names = _names(rows)
    for (workload,), part in pools(rows, ["workload"]).items():
        table.rows.append([f"{plain(workload)} rays"])
        found = pools(common(part.rows), POINT)
        for (technique, point), pooled in found.items():
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
        table.rows += _lacking(table, names, found)
    table.notes += [
        f"Default parameters of each technique. {cells_text(rows)}.",
        "Pays: the interval of the speed-up lies above 1. Data for the march: pyramids, and lists "
        "of primitives if any, made once per view and not counted in the speed-up.",
    ]
    return table


def table_counts(run: RunData) -> Table:
    """Return how many rays were judged in all, and the counts with their upper bounds."""
    table = Table(
        "All rays that were judged",
        [
            "", "rays", "resolved rays", *(plain(name) for name in STRICT),
            "all three, share of resolved rays", "all three, share of all rays of the hybrid",
        ],
    )  # fmt: skip
    rows = defaults(run.results[run.results.technique != EMBREE])
    for (technique,), pooled in pools(rows, ["technique"]).items():
        table.rows.append(
            [
                technique,
                f"{pooled.rays:,}",
                f"{pooled.resolved:,}",
                *(f"{pooled.rate(name).count:,}" for name in STRICT),
                _bounded(pooled.rate(STRICT)),
                _bounded(pooled.rate(STRICT, of_all=True)),
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
    rows = rows[(rows["lists_mib"] > 0) & rows["timed"] & (rows["workload"] == _first(run))]
    if rows["point"].nunique() < 2:
        return []
    table = Table(
        "How long a list of primitives pays",
        [
            "", "alpha, mean of cameras", "exact tests per ray", "steps per ray",
            "lists, MiB per view", "making them, ms per view", "march, Mrays/s",
            "speed-up, measured",
        ],
    )  # fmt: skip
    for (scene,), part in pools(rows, ["scene"]).items():
        table.rows.append([scene_name(run, scene)])
        for (technique, point), pooled in pools(common(part.rows), POINT).items():
            table.rows.append(
                [
                    f"{technique}, {point}",
                    number(pooled.mean("alpha")),
                    number(pooled.tests_per_ray),
                    number(pooled.steps_per_ray),
                    number(pooled.mean("lists_mib")),
                    number(pooled.mean("prepare_ms")),
                    number(march_rate(technique, pooled)),
                    speedup_text(pooled.speedup(run.samples)),
                ]
            )
    table.notes += [
        f"{cells_text(rows)}. A list takes 8 bytes for each primitive, and 4 for the bound of "
        "those that it has no place for, for every pixel, full or not; what does not fit leaves "
        "rays unresolved, never wrong.",
        "Making them: the lists and the conservative pyramid.",
    ]
    return [table]


def table_cameras(run: RunData) -> Table:
    """Return the alpha of every technique's default point at each camera's largest resolution."""
    rows = defaults(run.results)
    rows = rows[(rows["workload"] == _first(run)) & (rows["technique"] != EMBREE)]
    rows = rows[rows["height"] == rows.groupby(["scene", "camera"])["height"].transform("max")]
    names = _names(rows)
    table = Table("Alpha, camera by camera", ["", *names], detail=True)
    for (scene,), part in pools(rows, ["scene"]).items():
        cameras = part.rows.pivot_table("alpha", "camera", "technique", sort=False)
        cameras = cameras.reindex(columns=names)
        table.rows.append([scene_name(run, scene)])
        for camera, alphas in cameras.iterrows():
            table.rows.append([str(camera), *(_alpha(float(alphas[name])) for name in names)])
        # Of the cameras that every technique of the scene has.
        means = cameras.dropna(axis="columns", how="all").dropna().mean().reindex(names)
        table.rows.append(["mean", *(_alpha(float(means[name])) for name in names)])
    table.notes.append(
        f"{plain(_first(run))} rays, default parameters, at the largest size of each camera. Mean: "
        "of the cameras that every technique of the scene was measured with."
    )
    return table


def table_status(run: RunData) -> Table:
    """Return how the marches of each technique ended and how often each ending was wrong."""
    table = Table(
        "How the marches ended",
        [
            "", "rays, % of all rays", "resolved, % of these rays", "wrong, % of those resolved",
        ],
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
                    rate_text(Rate.of(wrong, answered)),
                ]
            )
    table.notes.append("Wrong: false hits and false misses, with their 95 % interval.")
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
                    power(pooled.median("error_t_p50")),
                    power(pooled.median("error_t_p99")),
                    power(pooled.largest("error_t_p99")),
                    power(pooled.largest("error_t_max")),
                ]
            )
    table.notes.append(
        "Of resolved rays that truly hit something: p50 and p99 of every 8th ray; the largest of "
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
        f"{len(rows[[*CELL]].drop_duplicates())} views; 0: the same image, 1: the largest "
        "difference. What the screen does not answer is traced, so an image errs only by what a "
        "technique claims."
    )
    return [table]


def shared(run: RunData) -> pd.DataFrame:
    """Return the rows of the timed cells in which every point was measured."""
    return common(timed(run))


def common(rows: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of the cells that have every point of `rows`; all rows if none has."""
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


def _first(run: RunData) -> str:
    return str(run.results["workload"].iloc[0])


def _names(rows: pd.DataFrame) -> list[str]:
    return [str(name) for name in dict.fromkeys(rows["technique"])]


def _lacking(
    table: Table, names: Iterable[str], found: Iterable[tuple[str, ...]]
) -> list[list[str]]:
    """Return a row for each technique that was not measured where others were."""
    there = {technique for technique, *_ in found}
    width = len(table.columns) - 1
    return [[name, *[ABSENT] * width] for name in names if name not in there]


def _alpha(value: float) -> str:
    return ABSENT if value != value else f"{value:.3f}"


def _bounded(rate: Rate) -> str:
    return f"{power(rate.value)} [at most {power(rate.high)}]" if rate.total else DASH
