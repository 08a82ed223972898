"""The tables of a run of kind "peers"."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from hybrid_rt.judging.rate import Rate
from hybrid_rt_bench.kinds.peers.columns import SCHEMA
from hybrid_rt_bench.report.scenes import scene_name
from hybrid_rt_bench.report.table import DASH, Table, interval, number, rate_text, threads_text
from hybrid_rt_bench.report.words import listed
from hybrid_rt_bench.results import statistics as stats
from hybrid_rt_bench.results.folder import RunData

RASTER = "raster"
TRACED = ("mirror", "primary")
"""The workloads of rays."""


def tables(run: RunData) -> list[Table]:
    """Return every table of the run, in the order of reading."""
    made = [rays(run), pictures(run), agreement(run), views(run), programs(run)]
    return [table for table in made if table.rows]


def rays(run: RunData) -> Table:
    """Return the rates of all peers, scene by scene, and how far they agree with robust Embree."""
    table = Table(
        "The same rays through other programs",
        ["", "mirror, Mrays/s", "primary, Mrays/s", "time / strongest Embree's, mirror", "threads",
         "cores busy", "same primitive, % of rays", "error of t, largest", "build, s",
         "peak memory, MiB"],
    )  # fmt: skip
    for scene, part in by_scene(traced(run)):
        table.rows.append([scene_label(run, scene)])
        for name, rows in _by_peer(part):
            mirror = ok(rows[rows.workload == "mirror"])
            every = ok(rows)
            if every.empty:
                table.rows.append(_not_run(table, name))
                continue
            table.rows.append(
                [
                    name + (f" ({every.rays.sum():,} rays)" if every.sampled.any() else ""),
                    number(rate(mirror)),
                    number(rate(ok(rows[rows.workload == "primary"]))),
                    ratio(run, mirror),
                    f"{int(every.threads.iloc[0])}",
                    number(float(mirror.cores.mean()), 2) if len(mirror) else DASH,
                    _share(_pooled(every, "same")),
                    _power(float(every.t_max.max())),
                    number(float(every.build_seconds.iloc[0])),
                    number(float(every.peak_mib.iloc[0])),
                ]
            )
    rounds, threads = run.meta["spec"]["rounds"], run.meta["environment"]["threads"]
    table.notes += [
        f"Mean over views ({views_text(run)}) of the median of {rounds} rounds; "
        f"{threads_text(threads)} where a program takes a number. In each round a peer runs right "
        "beside the strongest Embree on the same rays. Time per ray over that of the strongest "
        "Embree: geometric mean "
        "over views of the median of the paired ratios, [95 % bootstrap interval over rounds]; "
        "the row embree is that against itself.",
        "Timed: from rays in a peer's own arrays to its evaluated results. Making those arrays, "
        "the first call (which compiles) and the way back to NumPy are not in it, and neither "
        "are the hybrid's lists and pyramid: see 'View by view'.",
        "Same primitive: the share of all rays, of both kinds, whose primitive (or miss) is that "
        "of robust Embree. Error of t: |t - t_ref| / t_ref where it is the same.",
        "Cores busy: processor time of the whole process over wall time while mirror rays are "
        "traced; less than the threads where the machine was shared. Peak memory: of a process "
        "with the peer and a scene, over one with the scene alone; the peer's libraries are in it.",
    ]
    table.notes += _reasons(run, traced(run))
    return table


def pictures(run: RunData) -> Table:
    """Return the raster peers beside our raster."""
    table = Table(
        "The same picture by OpenGL on the processor",
        ["", "draw, ms", "draw / ours", "read back, ms", "threads", "cores busy",
         "same primitive, % of pixels", "depth off, p50", "depth off, p99", "depth off, largest",
         "first draw, ms"],
    )  # fmt: skip
    every = drawn(run)
    for scene, part in by_scene(every):
        table.rows.append([scene_label(run, scene)])
        for name, rows in _by_peer(part):
            done = ok(rows)
            if done.empty:
                table.rows.append(_not_run(table, name))
                continue
            table.rows.append(
                [
                    name,
                    number(float(done.ms.mean())),
                    ratio(run, done),
                    number(float(done.read_ms.mean())),
                    f"{int(done.threads.iloc[0])}",
                    number(float(done.cores.mean()), 2),
                    _share(_pooled(done, "same")),
                    *(_power(float(done[f"depth_{end}"].max())) for end in ("p50", "p99", "max")),
                    number(float(done.first_ms.max())),
                ]
            )
    table.notes += [
        "Draw: from the clear to glFinish, or one call of hybrid_rt.rasterize, which makes the "
        "derivatives of depth as well; mean over views of the median. Read back: glReadPixels of "
        "both buffers; ours are NumPy arrays from the start. Ratio as above, beside our raster.",
        "Depth off: |d - d_ours| / d_ours where the primitive is the same, worst view. llvmpipe "
        "has a float32 depth buffer, reversed, and gl_PrimitiveID in 32 bits.",
        "LP_NUM_THREADS is set to the number of threads. llvmpipe starts so many for its tiles; "
        "vertices, clipping and binning stay on the calling thread.",
    ]
    table.notes += _reasons(run, every)
    return table


def agreement(run: RunData) -> Table:
    """Return how the answers of each peer differ from those of robust Embree."""
    table = Table(
        "How answers differ from those of robust Embree",
        ["", "rays", "differ, rays", "differ, % of rays",
         "other primitive at the same place, % of rays", "hit before t_near, % of rays",
         "error of t, p99", "error of t, largest"],
        detail=True,
    )  # fmt: skip
    for workload in TRACED:
        rows = ok(_whole(run.results[run.results.workload == workload]))
        if len(rows):
            table.rows.append([f"{workload} rays, all scenes"])
        for name, part in _by_peer(rows):
            table.rows.append(
                [
                    name,
                    f"{int(part.rays.sum()):,}",
                    f"{int(part.different.sum()):,}" if part.different.notna().any() else DASH,
                    _rate(part.different, part.rays),
                    _rate(part.same_place * part.rays, part.rays),
                    _rate(part.early * part.rays, part.rays),
                    _power(float(part.t_p99.max())),
                    _power(float(part.t_max.max())),
                ]
            )
    table.notes.append(
        "At the same place: both hit, and t differs by less than 1e-5 of it: a shared edge or a "
        "duplicate. Before t_near: only our own calls tell Embree from which t on a hit counts. "
        "Shares with their 95 % interval; none seen among N rays: at most 3 / N."
    )
    return table


def views(run: RunData) -> Table:
    """Return every peer on every view."""
    table = Table(
        "View by view",
        [
            "",
            "ms",
            "Mrays/s",
            "time / strongest Embree's",
            "first call, ms",
            "before it, ms",
            "way",
        ],
        detail=True,
    )
    keys = ["scene", "camera", "width", "height", "workload"]
    for _, part in ok(run.results).groupby(keys, sort=False):
        one: Any = part.iloc[0]
        size = f"{int(one.width)}x{int(one.height)}"
        name = scene_name(run, str(one.scene))
        table.rows.append([f"{name}, {one.camera}, {size}, {one.workload}"])
        for _, row in part.iterrows():
            table.rows.append(
                [
                    row.technique,
                    interval(row.ms, row.ms_low, row.ms_high),
                    number(row.rays / row.ms / 1e3),
                    interval(row.ratio, row.ratio_low, row.ratio_high),
                    number(row.first_ms),
                    number(row.convert_ms),
                    row.label or DASH,
                ]
            )
    table.notes.append(
        "Before it: making the peer's arrays; for the hybrid, lists of primitives and the pyramid; "
        "for Mitsuba, compiling both kernels and trying them as well; for llvmpipe, the frame "
        "buffer and a picture. In pictures, pixels for rays, and the ratio is to our raster."
    )
    return table


def programs(run: RunData) -> Table:
    """Return what each peer is, and its version."""
    table = Table("The programs", ["", "version, and what is called"], detail=True, sentences=True)
    for peer in run.meta["peers"]:
        version = ", ".join(text for text in (peer["version"], peer["detail"]) if text)
        table.rows.append([peer["name"], f"{version or 'no version known'}; {peer['description']}"])
    return table


def rate(rows: pd.DataFrame) -> float:
    """Return millions of rays per second over all views, NaN for no view."""
    return float(rows.rays.sum() / rows.ms.sum() / 1e3) if len(rows) else float("nan")


def traced(run: RunData) -> pd.DataFrame:
    """Return the rows of what traces rays, with NaN for what no peer of the run could tell."""
    return _whole(run.results[run.results.workload != RASTER])


def drawn(run: RunData) -> pd.DataFrame:
    """Return the rows of what draws, as `traced`."""
    return _whole(run.results[run.results.workload == RASTER])


def ok(rows: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of what ran."""
    return rows[rows.state == "ok"]


def by_scene(rows: pd.DataFrame) -> list[tuple[str, pd.DataFrame]]:
    """Return the rows of each scene."""
    return [(str(name), part) for name, part in rows.groupby("scene", sort=False)]


def _by_peer(rows: pd.DataFrame) -> list[tuple[str, pd.DataFrame]]:
    return [(str(name), part) for name, part in rows.groupby("technique", sort=False)]


def ratio(run: RunData, rows: pd.DataFrame) -> str:
    """Return the geometric mean over views of the ratio of times, from the raw samples."""
    keys = ["scene", "camera", "width", "height", "technique", "workload"]
    if rows.empty or run.samples.empty:
        return DASH
    mine = run.samples.merge(rows[[*keys, "rays"]], on=keys)
    groups = []
    for _, part in mine.groupby(keys, sort=False):
        seconds, rays, beside, amount = (
            part[c].to_numpy(np.float64) for c in ("seconds", "rays", "beside", "beside_rays")
        )
        groups.append((seconds / rays) / (beside / amount))
    if not groups:
        return DASH
    mean = stats.geometric_mean_of_medians(groups)
    return interval(mean.value, mean.low, mean.high)


def _pooled(rows: pd.DataFrame, column: str) -> float:
    """Return a share over the rays of all rows."""
    return float((rows[column] * rows.rays).sum() / rows.rays.sum())


def _share(value: float) -> str:
    """Return a share near 1 in per cent, with as many nines as it has."""
    if not np.isfinite(value):
        return DASH
    return "100" if value == 1 else f"{100 * value:.4f}"


def _power(value: float) -> str:
    return DASH if not np.isfinite(value) else "0" if value == 0 else f"{value:.1e}"


def _whole(rows: pd.DataFrame) -> pd.DataFrame:
    """Return rows with all columns; those that are optional are absent where no peer has them."""
    return rows.reindex(columns=list(dict.fromkeys([*SCHEMA.tables["results"], *rows.columns])))


def _rate(counts: Any, rays: Any) -> str:
    """Return the share of rays that were counted; a dash where nobody did."""
    if counts.isna().all():
        return DASH
    return rate_text(Rate.of(round(float(counts.sum())), int(rays[counts.notna()].sum())))


def _not_run(table: Table, name: str) -> list[str]:
    return [name, "not run", *[DASH] * (len(table.columns) - 2)]


def _reasons(run: RunData, rows: pd.DataFrame) -> list[str]:
    """Return a sentence for each peer that did not run, or not on all rays, and why."""
    lost = rows[rows.state != "ok"]
    found: dict[tuple[str, str], list[str]] = {}
    for (name, reason, scene), _ in lost.groupby(["technique", "reason", "scene"], sort=False):
        found.setdefault((str(name), str(reason)), []).append(scene_name(run, str(scene)))
    return [
        f"{name} was not run on {listed(scenes)}: {reason or 'no reason is known'}."
        for (name, reason), scenes in found.items()
    ]


def views_text(run: RunData) -> str:
    """Return how many views there are, and of which sizes, in words."""
    cells: Any = run.results[["scene", "camera", "width", "height"]].drop_duplicates()
    sizes = ", ".join(
        dict.fromkeys(f"{int(w)}x{int(h)}" for w, h in zip(cells.width, cells.height, strict=True))
    )
    return f"{len(cells)} view{'s' if len(cells) != 1 else ''}, {sizes}"


def scene_label(run: RunData, scene: str) -> str:
    """Return a scene's name with its mark, if it has one, and its number of triangles."""
    n = next(int(e["triangles"]) for e in run.meta["scenes"] if e["name"] == scene)
    count = f"{n}" if n < 10_000 else f"{n / 1e3:.0f}k" if n < 1e6 else f"{n / 1e6:.2f}M"
    return f"{scene_name(run, scene)}, {count} triangles"
