"""The tables of a run: the paper's three in the paper's shape, and what else was measured."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pandas as pd

from hybrid_rt.judging.rate import Rate
from hybrid_rt_bench.kinds.paper import published as paper
from hybrid_rt_bench.kinds.paper import summary
from hybrid_rt_bench.kinds.paper.columns import STAGES
from hybrid_rt_bench.report.scenes import scene_name
from hybrid_rt_bench.report.style import ordered
from hybrid_rt_bench.report.table import (
    ABSENT,
    DASH,
    QUOTED,
    Table,
    interval,
    number,
    rate_text,
    share_text,
    threads_text,
)
from hybrid_rt_bench.results import statistics as stats
from hybrid_rt_bench.results.folder import RunData

Samples = dict[str, Any]

VIEWS = ["scene", "camera", "width", "height"]
"""Columns that tell views apart."""


def tables(run: RunData) -> list[Table]:
    """Return every table of the run, in the order of reading."""
    return [
        table_1(run),
        table_2(run),
        table_3(run),
        table_alpha(run),
        table_errors(run),
        table_status(run),
        table_raster(run),
        table_stages(run),
        table_embree(run),
    ]


def table_1(run: RunData) -> Table:
    """Return Table 1: the mean time of the march."""
    columns = _resolutions(run)
    table = Table("Table 1. March (SSRM), mean time in ms", ["", *columns])
    parts = {"all scenes": common(run.results)}
    parts |= {label(run, scene): of_scene(run, scene) for scene in scenes(run)}
    for technique in techniques(run):
        for name, part in parts.items():
            rows = of_technique(part, technique)
            cells = _by_resolution(rows, columns, lambda r: number(r.march_ms.mean()))
            table.rows.append([f"{technique}: {name}", *cells])
    if _all_own(run):
        table.rows.append([f"{QUOTED}, its own scenes", *_quote(paper.SSRM_MS, columns)])
    table.notes.append(
        f"Technique: scene. Mean over cameras of the median of the rounds; {_threads(run)}. One "
        f"mirror ray for each covered pixel. The paper's: {paper.MACHINE}."
    )
    return table


def table_2(run: RunData) -> Table:
    """Return Table 2: the time of tracing every ray."""
    columns = _resolutions(run)
    table = Table("Table 2. Tracing every ray, strongest Embree, mean time in ms", ["", *columns])
    rows = _views(run)
    for scene in scenes(run):
        part = rows[rows.scene == scene]
        cells = _by_resolution(part, columns, _mean_of("embree_ms", np.mean))
        table.rows.append([label(run, scene), *cells])
        _paper_row(table, run, scene, paper.RT_MS, columns)
    table.notes.append(
        "The fastest of all of Embree's paths for the cell's own rays, chosen in the same run (see "
        f"the last table); {_threads(run)}. The paper's: hardware ray tracing, {paper.MACHINE}."
    )
    return table


def table_3(run: RunData) -> Table:
    """Return Table 3: the speed-up, estimated by the paper's formula and measured."""
    columns = _resolutions(run)
    table = Table("Table 3. Speed-up of the hybrid over tracing every ray", ["", *columns])
    lines: list[tuple[str, Callable[[Samples, float], Any]]] = [
        ("estimated, alpha as measured", summary.estimated_speedup),
        ("estimated, the paper's alpha", lambda s, _: summary.estimated_speedup(s, paper.ALPHA)),
        ("measured", lambda s, _: summary.measured_speedup(s)),
        ("measured, with the pyramid", lambda s, _: summary.measured_speedup(s, with_pyramid=True)),
    ]
    for technique in techniques(run):
        for scene in scenes(run):
            table.rows.append([f"{technique}: {label(run, scene)}"])
            for line, speedup in lines:
                cells = [
                    _speedup(run, scene, technique, resolution, speedup) for resolution in columns
                ]
                table.rows.append([line, *cells])
            _paper_row(table, run, scene, paper.SPEEDUP, columns, ", estimated, alpha 0.31")
    table.notes += [
        "Technique: scene. Estimated: T_rt / (T_march + (1 - alpha) T_rt). Measured: "
        "T_rt / (T_march + T_compaction + T_fallback + T_merge), all of one round.",
        "Geometric mean over cameras of the median of the rounds' paired ratios, "
        "[95 % bootstrap interval over rounds]. Above 1 the hybrid wins.",
    ]
    return table


def table_alpha(run: RunData) -> Table:
    """Return the share of resolved rays, for each scene and camera."""
    columns = _resolutions(run)
    table = Table("Alpha: share of rays that the screen answers", ["", *columns])

    def cells(part: pd.DataFrame, technique: str) -> list[str]:
        rows = of_technique(part, technique)
        return _by_resolution(rows, columns, lambda r: f"{r.alpha.mean():.3f}")

    for technique in techniques(run):
        for scene in scenes(run):
            part = run.results[run.results.scene == scene]
            table.rows.append([f"{technique}: {label(run, scene)}"])
            for camera in ordered(part.camera):
                table.rows.append([camera, *cells(part[part.camera == camera], technique)])
            table.rows.append(["mean of the cameras", *cells(of_scene(run, scene), technique)])
        whole = cells(common(run.results), technique)
        table.rows += [[f"{technique}: all scenes"], ["mean of all views", *whole]]
    table.notes.append("Technique: scene.")
    if _all_own(run):
        table.rows.append([f"{QUOTED}, its own scenes", *[f"{paper.ALPHA:.2f}" for _ in columns]])
        table.notes.append("The paper gives one mean over its scenes and sizes.")
    return table


def table_errors(run: RunData) -> Table:
    """Return what the answers get wrong, for each scene and camera."""
    table = Table(
        "Errors of the rays that the screen answers, by a float64 judge",
        [
            "",
            "resolved rays",
            "false hit, % of resolved rays",
            "false miss, % of resolved rays",
            "wrong primitive, % of resolved rays",
            "tie, % of resolved rays",
            "wrong, % of all rays",
            "error, pixels, p50",
            "error, pixels, p99",
        ],
        detail=True,
    )
    for technique in techniques(run):
        for scene in scenes(run):
            table.rows.append([f"{technique}: {scene_name(run, scene)}"])
            rows = of_technique(_largest(run), technique)
            for _, row in rows[rows.scene == scene].iterrows():
                kinds = ("false_hit", "false_miss", "wrong_primitive", "tie", "wrong")
                table.rows.append(
                    [
                        f"{row.camera}, {size_of(row)}",
                        f"{int(row.resolved):,}",
                        *(_rate(row, kind) for kind in kinds),
                        number(row.error_px_p50, 2),
                        number(row.error_px_p99, 2),
                    ]
                )
    table.notes += [
        "Technique: scene, at each camera's largest resolution. Shares with their 95 % "
        "Clopper-Pearson interval; none seen among N rays: at most 3 / N.",
        "False hit: more than a pixel from the truth, or none there. Wrong primitive: another "
        "triangle than the true one, within a pixel of the truth.",
        "Wrong: false hits and false misses among all rays of the cell.",
    ]
    return table


def table_status(run: RunData) -> Table:
    """Return how the marches ended and how often each ending was wrong."""
    table = Table(
        "How the marches ended",
        ["", "rays, % of all rays", "false hits and misses, % of those resolved"],
    )
    for technique in techniques(run):
        for scene in scenes(run):
            part = of_technique(run.verdicts, technique)
            part = part[part.scene == scene]
            total = part["count"].sum()
            table.rows.append([f"{technique}: {label(run, scene)}"])
            for status in ordered(part.status):
                rows = part[part.status == status]
                resolved = int(rows.loc[rows.verdict != "UNRESOLVED", "count"].sum())
                wrong = rows.loc[rows.verdict.isin(["FALSE_HIT", "FALSE_MISS"]), "count"].sum()
                rate = Rate.of(int(wrong), resolved)
                share = number(100 * rows["count"].sum() / total)
                table.rows.append([status.lower(), share, rate_text(rate)])
    table.notes.append("Technique: scene. Shares with their 95 % interval.")
    return table


def table_raster(run: RunData) -> Table:
    """Return the raster against Embree's primary rays, and the pyramid against the march."""
    columns = _resolutions(run)
    table = Table("Raster against Embree's primary rays; pyramid against the march", ["", *columns])
    rows = _views(run)
    lines: tuple[tuple[str, str, Callable[[Any], float]], ...] = (
        ("raster, ms", "raster_ms", np.mean),
        ("Embree primary, ms", "embree_primary_ms", np.mean),
        ("raster / Embree primary", "raster_over_embree", stats.geometric_mean),
    )
    own: tuple[tuple[str, str, Callable[[Any], float]], ...] = (
        ("pyramid, ms", "pyramid_ms", np.mean),
        ("pyramid / march", "pyramid_over_march", stats.geometric_mean),
    )
    for scene in scenes(run):
        part = rows[rows.scene == scene]
        table.rows.append([label(run, scene)])
        for line, column, mean in lines:
            values = _by_resolution(part, columns, _mean_of(column, mean))
            table.rows.append([line, *values])
        for technique in techniques(run):
            part = of_technique(run.results, technique)
            part = part[part.scene == scene]
            for line, column, mean in own:
                values = _by_resolution(part, columns, _mean_of(column, mean))
                table.rows.append([f"{technique}: {line}", *values])
    table.notes.append("Times: mean over cameras. Ratios: geometric mean of the paired ratios.")
    return table


def table_stages(run: RunData) -> Table:
    """Return the time of every stage, for each cell."""
    short = {"embree_primary": "Embree primary", "embree": "Embree mirror", "rays": "rays"}
    names = [short.get(stage, label) for stage, label in STAGES.items()]
    columns = ["", *names, "hybrid", "steps per ray"]
    table = Table("Time of each stage, ms", columns, detail=True)
    for technique in techniques(run):
        rows = of_technique(run.results, technique)
        for scene in scenes(run):
            table.rows.append([f"{technique}: {scene_name(run, scene)}"])
            for _, row in rows[rows.scene == scene].iterrows():
                name = f"{row.camera}, {size_of(row)}"
                times = [number(row[f"{stage}_ms"]) for stage in STAGES]
                hybrid = interval(row.hybrid_ms, row.hybrid_ms_low, row.hybrid_ms_high)
                table.rows.append([name, *times, hybrid, number(row.steps_per_ray)])
    first = run.results.iloc[0]
    table.notes.append(
        f"Technique: scene. Medians of {int(first.rounds)} rounds, stages interleaved, JIT "
        f"compilation apart; [{100 * first.coverage_of_intervals:.0f} % order-statistic interval]."
    )
    return table


def table_embree(run: RunData) -> Table:
    """Return which of Embree's paths was the strongest in each cell."""
    table = Table(
        "The strongest Embree of each cell",
        ["", "path, mirror rays", "mirror, Mrays/s", "path, primary rays", "primary, Mrays/s"],
        detail=True,
    )
    rows = _views(run)
    for scene in scenes(run):
        table.rows.append([scene_name(run, scene)])
        for _, row in rows[rows.scene == scene].iterrows():
            pixels = row.width * row.height
            table.rows.append(
                [
                    f"{row.camera}, {size_of(row)}",
                    row.embree_path,
                    number(row.rays / row.embree_ms / 1e3),
                    row.embree_primary_path,
                    number(pixels / row.embree_primary_ms / 1e3),
                ]
            )
    return table


def samples_of(
    run: RunData, technique: str, rows: pd.DataFrame | None = None
) -> Iterator[tuple[Any, Samples]]:
    """Yield each row of a technique, of all results or of `rows`, with its samples by stage."""
    measured = run.samples[run.samples.phase == "measured"]
    groups = dict(list(measured.groupby(VIEWS)))
    for _, row in of_technique(run.results if rows is None else rows, technique).iterrows():
        group = groups[tuple(row[k] for k in VIEWS)]
        group = group[group.technique.isin(["", technique])].sort_values("round")
        yield row, {str(stage): part.seconds.to_numpy() for stage, part in group.groupby("stage")}


def _speedup(
    run: RunData,
    scene: str,
    technique: str,
    resolution: str,
    speedup: Callable[[Samples, float], Any],
) -> str:
    ratios = [
        speedup(samples, row.alpha)
        for row, samples in samples_of(run, technique, of_scene(run, scene))
        if size_of(row) == resolution
    ]
    if not ratios:
        return ABSENT
    mean = stats.geometric_mean_of_medians(ratios)
    return interval(mean.value, mean.low, mean.high)


def _resolutions(run: RunData) -> list[str]:
    sizes = run.results[["width", "height"]].drop_duplicates()
    pairs = sorted((int(w) * int(h), int(w), int(h)) for w, h in sizes.to_numpy())
    return [f"{w}x{h}" for _, w, h in pairs]


def _by_resolution(
    rows: pd.DataFrame, columns: list[str], cell: Callable[[pd.DataFrame], str]
) -> list[str]:
    sizes = rows.width.astype(int).astype(str) + "x" + rows.height.astype(int).astype(str)
    parts = [rows[sizes == column] for column in columns]
    return [cell(part) if len(part) else ABSENT for part in parts]


def _paper_row(
    table: Table,
    run: RunData,
    scene: str,
    values: dict[str, dict[str, float]],
    columns: list[str],
    what: str = "",
) -> None:
    """Add what the paper has for a scene, if the scene is the paper's own."""
    row = _own_row(run, scene)
    if row in values:
        name = f"{QUOTED} {row}, about {paper.TRIANGLES[row]} triangles{what}"
        table.rows.append([name, *_quote(values[row], columns)])


def _own_row(run: RunData, scene: str) -> str:
    """Return the row of a scene that is the paper's own; empty for any other."""
    entry = _scene(run, scene)
    return "" if entry["builtin"] else str(entry["row"])


def _all_own(run: RunData) -> bool:
    """Tell whether means over all scenes of the run are over scenes of the paper alone."""
    return all(_own_row(run, scene) in paper.RT_MS for scene in scenes(run))


def _quote(values: dict[str, float], columns: list[str]) -> list[str]:
    return [f"{values[column]:g}" if column in values else DASH for column in columns]


def label(run: RunData, scene: str) -> str:
    """Return a scene's name, its mark if it has one, and its number of triangles."""
    return f"{scene_name(run, scene)}, {_count(_scene(run, scene)['triangles'])} triangles"


def size_of(row: Any) -> str:
    """Return the size of a row's picture in words."""
    return f"{int(row.width)}x{int(row.height)}"


def _rate(row: Any, kind: str) -> str:
    return share_text(*(float(row[f"{kind}_{end}"]) for end in ("rate", "low", "high")))


def _mean_of(column: str, mean: Callable[[Any], float]) -> Callable[[pd.DataFrame], str]:
    return lambda rows: number(float(mean(rows[column])))


def _count(n: int) -> str:
    if n < 10_000:
        return f"{n}"
    return f"{n / 1e3:.0f}k" if n < 1_000_000 else f"{n / 1e6:.2f}M"


def _scene(run: RunData, scene: str) -> dict[str, Any]:
    return next(entry for entry in run.meta["scenes"] if entry["name"] == scene)


def scenes(run: RunData) -> list[str]:
    """Return the names of the scenes."""
    return ordered(run.results.scene)


def techniques(run: RunData) -> list[str]:
    """Return the names of the techniques."""
    return ordered(run.results.technique)


def of_technique(frame: pd.DataFrame, technique: str) -> pd.DataFrame:
    """Return the rows of a technique."""
    return frame[frame.technique == technique]


def common(rows: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of the views that have every technique of `rows`; all rows if none has."""
    of_view = rows.groupby(VIEWS)["technique"].transform("size")
    whole = rows[of_view == rows["technique"].nunique()]
    return whole if len(whole) else rows


def of_scene(run: RunData, scene: str) -> pd.DataFrame:
    """Return the rows of a scene, of the views that every technique measured there has."""
    return common(run.results[run.results.scene == scene])


def _views(run: RunData) -> pd.DataFrame:
    """Return a row for each cell: what belongs to all techniques is the same in all of its rows."""
    return run.results.drop_duplicates(VIEWS)


def _largest(run: RunData) -> pd.DataFrame:
    rows = run.results.assign(pixels=run.results.width * run.results.height)
    best = rows.groupby(["scene", "camera", "technique"], sort=False).pixels.transform("max")
    return rows[rows.pixels == best]


def _threads(run: RunData) -> str:
    environment = run.meta["environment"]
    return f"{threads_text(environment['threads'])}, {environment['cpu']}"
