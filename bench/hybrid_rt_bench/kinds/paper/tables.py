"""The tables of a run: the paper's three in the paper's shape, and what the paper leaves open."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pandas as pd

from hybrid_rt_bench.kinds.paper import published as paper
from hybrid_rt_bench.kinds.paper import summary
from hybrid_rt_bench.kinds.paper.columns import STAGES
from hybrid_rt_bench.report.style import ordered
from hybrid_rt_bench.report.table import (
    Table,
    interval,
    number,
    threads_text,
)
from hybrid_rt_bench.results import statistics as stats
from hybrid_rt_bench.results.folder import RunData

Samples = dict[str, Any]


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
    for technique in _techniques(run):
        rows = _of(run.results, technique=technique)
        table.rows.append(
            [
                f"{_mode(technique)}, all scenes",
                *_by_resolution(rows, columns, lambda r: number(r.march_ms.mean())),
            ]
        )
        for scene in _scenes(run):
            part = rows[rows.scene == scene]
            cells = _by_resolution(part, columns, lambda r: number(r.march_ms.mean()))
            table.rows.append([_label(run, scene), *cells])
    table.rows.append(["paper, RTX 2080 Super", *_quote(paper.SSRM_MS, columns)])
    table.notes.append(
        f"Mean over cameras of the median of the rounds; {_threads(run)}. One mirror ray for each "
        "covered pixel."
    )
    return table


def table_2(run: RunData) -> Table:
    """Return Table 2: the time of tracing every ray."""
    columns = _resolutions(run)
    table = Table("Table 2. Tracing every ray, strongest Embree, mean time in ms", ["", *columns])
    rows = _of(run.results, technique=_techniques(run)[0])
    for scene in _scenes(run):
        part = rows[rows.scene == scene]
        cells = _by_resolution(part, columns, _mean_of("embree_ms", np.mean))
        table.rows.append([_label(run, scene), *cells])
        _paper_row(table, run, scene, paper.RT_MS, columns)
    table.notes.append(
        "The fastest of all of Embree's paths for the cell's own rays, chosen in the same run (see "
        f"the last table); {_threads(run)}. The paper: hardware ray tracing, RTX 2080 Super."
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
    for technique in _techniques(run):
        for scene in _scenes(run):
            table.rows.append([_label(run, scene, technique)])
            for label, speedup in lines:
                cells = [
                    _speedup(run, scene, technique, resolution, speedup) for resolution in columns
                ]
                table.rows.append([label, *cells])
            _paper_row(table, run, scene, paper.SPEEDUP, columns, ", estimated, alpha 0.31")
    table.notes += [
        "Estimated: T_rt / (T_march + (1 - alpha) T_rt). Measured: "
        "T_rt / (T_march + T_compaction + T_fallback + T_merge), all of one round.",
        "Geometric mean over cameras of the median of the rounds' paired ratios, "
        "[95 % bootstrap interval over rounds]. Above 1 the hybrid wins.",
    ]
    return table


def table_alpha(run: RunData) -> Table:
    """Return the share of resolved rays, for each scene and camera."""
    columns = _resolutions(run)
    table = Table("Alpha: share of rays that the screen answers", ["", *columns])
    for technique in _techniques(run):
        rows = _of(run.results, technique=technique)

        def cells(part: pd.DataFrame) -> list[str]:
            return _by_resolution(part, columns, lambda r: f"{r.alpha.mean():.3f}")

        for scene in _scenes(run):
            part = rows[rows.scene == scene]
            table.rows.append([_label(run, scene, technique)])
            for camera in ordered(part.camera):
                table.rows.append([camera, *cells(part[part.camera == camera])])
            table.rows.append([f"{scene}, mean", *cells(part)])
        table.rows.append(["mean of all", *cells(rows)])
    table.rows.append(["paper, mean of all", *[f"{paper.ALPHA:.2f}" for _ in columns]])
    return table


def table_errors(run: RunData) -> Table:
    """Return what the answers get wrong, for each scene and camera."""
    table = Table(
        "Errors of the rays that the screen answers, by a float64 judge, %",
        [
            "",
            "resolved rays",
            "false hit",
            "false miss",
            "wrong primitive",
            "tie",
            "wrong, of all",
            "px p50",
            "px p99",
        ],
        detail=True,
    )
    for technique in _techniques(run):
        for scene in _scenes(run):
            table.rows.append([_short(run, scene, technique)])
            rows = _of(_largest(run), technique=technique)
            for _, row in rows[rows.scene == scene].iterrows():
                kinds = ("false_hit", "false_miss", "wrong_primitive")
                table.rows.append(
                    [
                        f"{row.camera}, {int(row.width)}x{int(row.height)}",
                        f"{int(row.resolved):,}",
                        *(_rate(row, kind) for kind in kinds),
                        number(100 * row.tie_rate),
                        number(100 * row.wrong_rate),
                        number(row.error_px_p50, 2),
                        number(row.error_px_p99, 2),
                    ]
                )
    table.notes += [
        "Share of the resolved rays with its 95 % Clopper-Pearson interval, at each camera's "
        "largest resolution.",
        "False hit: more than a pixel from the truth, or none there. Wrong primitive: another "
        "triangle than the true one, within a pixel of the truth.",
        "Wrong, of all: false hits and false misses among all rays of the cell.",
    ]
    return table


def table_status(run: RunData) -> Table:
    """Return how the marches ended and how often each ending was wrong."""
    table = Table("How the marches ended, %", ["", "of all rays", "false hit or miss, of resolved"])
    for technique in _techniques(run):
        for scene in _scenes(run):
            part = _of(run.verdicts, technique=technique)
            part = part[part.scene == scene]
            total = part["count"].sum()
            table.rows.append([_label(run, scene, technique)])
            for status in ordered(part.status):
                rows = part[part.status == status]
                resolved = rows.loc[rows.verdict != "UNRESOLVED", "count"].sum()
                wrong = rows.loc[rows.verdict.isin(["FALSE_HIT", "FALSE_MISS"]), "count"].sum()
                table.rows.append(
                    [
                        status.lower(),
                        number(100 * rows["count"].sum() / total),
                        number(100 * wrong / resolved) if resolved else "–",
                    ]
                )
    return table


def table_raster(run: RunData) -> Table:
    """Return the raster against Embree's primary rays, and the pyramid against the march."""
    columns = _resolutions(run)
    table = Table("Raster against Embree's primary rays; pyramid against the march", ["", *columns])
    rows = _of(run.results, technique=_techniques(run)[0])
    lines: tuple[tuple[str, str, Callable[[Any], float]], ...] = (
        ("raster, ms", "raster_ms", np.mean),
        ("Embree primary, ms", "embree_primary_ms", np.mean),
        ("raster / Embree primary", "raster_over_embree", stats.geometric_mean),
        ("pyramid, ms", "pyramid_ms", np.mean),
        ("pyramid / march", "pyramid_over_march", stats.geometric_mean),
    )
    for scene in _scenes(run):
        part = rows[rows.scene == scene]
        table.rows.append([_label(run, scene)])
        for label, column, mean in lines:
            values = _by_resolution(part, columns, _mean_of(column, mean))
            table.rows.append([label, *values])
    table.notes.append("Times: mean over cameras. Ratios: geometric mean of the paired ratios.")
    return table


def table_stages(run: RunData) -> Table:
    """Return the time of every stage, for each cell."""
    short = {"embree_primary": "Embree primary", "embree": "Embree mirror", "rays": "rays"}
    names = [short.get(stage, label) for stage, label in STAGES.items()]
    columns = ["", *names, "hybrid", "steps a ray"]
    table = Table("Time of each stage, ms", columns, detail=True)
    for technique in _techniques(run):
        rows = _of(run.results, technique=technique)
        for scene in _scenes(run):
            table.rows.append([_short(run, scene, technique)])
            for _, row in rows[rows.scene == scene].iterrows():
                name = f"{row.camera}, {int(row.width)}x{int(row.height)}"
                times = [number(row[f"{stage}_ms"]) for stage in STAGES]
                hybrid = interval(row.hybrid_ms, row.hybrid_ms_low, row.hybrid_ms_high)
                table.rows.append([name, *times, hybrid, number(row.steps_per_ray)])
    first = run.results.iloc[0]
    table.notes.append(
        f"Medians of {int(first.rounds)} rounds, stages interleaved, JIT compilation apart; "
        f"[{100 * first.coverage_of_intervals:.0f} % order-statistic interval]."
    )
    return table


def table_embree(run: RunData) -> Table:
    """Return which of Embree's paths was the strongest in each cell."""
    table = Table(
        "The strongest Embree of each cell",
        ["", "mirror rays", "Mrays/s", "primary rays", "Mrays/s"],
        detail=True,
    )
    rows = _of(run.results, technique=_techniques(run)[0])
    for scene in _scenes(run):
        table.rows.append([scene])
        for _, row in rows[rows.scene == scene].iterrows():
            pixels = row.width * row.height
            table.rows.append(
                [
                    f"{row.camera}, {int(row.width)}x{int(row.height)}",
                    row.embree_path,
                    number(row.rays / row.embree_ms / 1e3),
                    row.embree_primary_path,
                    number(pixels / row.embree_primary_ms / 1e3),
                ]
            )
    return table


def samples_of(run: RunData, technique: str) -> Iterator[tuple[Any, Samples]]:
    """Yield each results row of a technique with its measured samples by stage."""
    measured = run.samples[run.samples.phase == "measured"]
    keys = ["scene", "camera", "width", "height"]
    groups = dict(list(measured.groupby(keys)))
    for _, row in _of(run.results, technique=technique).iterrows():
        group = groups[tuple(row[k] for k in keys)]
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
        for row, samples in samples_of(run, technique)
        if row.scene == scene and f"{int(row.width)}x{int(row.height)}" == resolution
    ]
    if not ratios:
        return "–"
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
    return [cell(part) if len(part) else "–" for part in parts]


def _paper_row(
    table: Table,
    run: RunData,
    scene: str,
    values: dict[str, dict[str, float]],
    columns: list[str],
    what: str = "",
) -> None:
    row = _scene(run, scene)["row"]
    if row in values:
        table.rows.append([f"paper, {row}{what}", *_quote(values[row], columns)])


def _quote(values: dict[str, float], columns: list[str]) -> list[str]:
    return [f"{values[column]:g}" if column in values else "–" for column in columns]


def _label(run: RunData, scene: str, technique: str | None = None) -> str:
    entry = _scene(run, scene)
    stands = f", {entry['row']}-class" if entry["row"] and entry["builtin"] else ""
    label = f"{scene} ({_count(entry['triangles'])} triangles{stands})"
    if technique is not None and len(_techniques(run)) > 1:
        label += f", {_mode(technique)}"
    return label


def _short(run: RunData, scene: str, technique: str) -> str:
    return f"{scene}, {_mode(technique)}" if len(_techniques(run)) > 1 else scene


def _rate(row: Any, kind: str) -> str:
    """Return a rate and its interval in per cent; a zero stays a zero."""
    value, low, high = (100 * row[f"{kind}_{end}"] for end in ("rate", "low", "high"))
    return f"{number(value)} [{number(low, 2)}, {number(high, 2)}]"


def _mean_of(column: str, mean: Callable[[Any], float]) -> Callable[[pd.DataFrame], str]:
    return lambda rows: number(float(mean(rows[column])))


def _count(n: int) -> str:
    if n < 10_000:
        return f"{n}"
    return f"{n / 1e3:.0f}k" if n < 1_000_000 else f"{n / 1e6:.2f}M"


def _scene(run: RunData, scene: str) -> dict[str, Any]:
    return next(entry for entry in run.meta["scenes"] if entry["name"] == scene)


def _scenes(run: RunData) -> list[str]:
    return ordered(run.results.scene)


def _techniques(run: RunData) -> list[str]:
    return ordered(run.results.technique)


def _mode(technique: str) -> str:
    return f"mode {technique!r}"


def _of(frame: pd.DataFrame, *, technique: str) -> pd.DataFrame:
    return frame[frame.technique == technique]


def _largest(run: RunData) -> pd.DataFrame:
    rows = run.results.assign(pixels=run.results.width * run.results.height)
    best = rows.groupby(["scene", "camera", "technique"], sort=False).pixels.transform("max")
    return rows[rows.pixels == best]


def _threads(run: RunData) -> str:
    environment = run.meta["environment"]
    return f"{threads_text(environment['threads'])}, {environment['cpu']}"
