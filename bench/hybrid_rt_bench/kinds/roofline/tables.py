"""The tables of a run of kind "roofline"."""

from __future__ import annotations

from typing import Any

import pandas as pd

from hybrid_rt_bench.kinds.roofline.reckon import (
    RASTER,
    STRUCTURES,
    far_gathers_ns,
    far_ns,
    near_gathers_ns,
    ns_element,
)
from hybrid_rt_bench.report.scenes import scene_name
from hybrid_rt_bench.report.table import (
    Table,
    interval,
    number,
    threads_text,
)
from hybrid_rt_bench.results.folder import RunData

STAGES = ("step", "look", "entry", "plane", "test")
NEVER = "none"
"""What stands for a break-even march time where Embree takes no longer for all rays than for the
unresolved ones."""


def tables(run: RunData) -> list[Table]:
    """Return every table of the run, in the order of reading."""
    made = (budgets, parts, work, busy, gathers, machine, raster)
    return [make(run) for make in made]


def budgets(run: RunData) -> Table:
    """Return the break-even march time, and what the march and its floors are of that."""
    table = Table(
        "The break-even march time, and what the march takes, ns per ray",
        ["", "alpha", "Embree, all rays", "Embree, unresolved rays", "list, merge",
         "break-even march", "march", "march / break-even", "set-up / break-even",
         "near gathers / break-even", "far gathers / break-even", "speed-up, measured"],
    )  # fmt: skip
    for heading, rows in _groups(run):
        table.rows.append([heading])
        for row in _rows(rows):
            table.rows.append(
                [
                    view(run, row),
                    number(row.alpha),
                    number(row.embree_ns),
                    number(row.fallback_ns),
                    number(row.compaction_ns + row.merge_ns),
                    number(row.budget_ns),
                    number(row.march_ns),
                    of_budget(row, row.march_ns),
                    of_budget(row, row.start_ns),
                    of_budget(row, near_gathers_ns(run.meta["rates"], row)),
                    of_budget(row, far_gathers_ns(run.meta["rates"], row)),
                    interval(row.speedup, row.speedup_low, row.speedup_high),
                ]
            )
    table.notes += [
        "Nanoseconds of wall time over all mirror rays. Embree: the strongest of its paths for "
        "these rays. Unresolved rays: those that the march does not answer, from where it hands "
        "them over. Break-even: Embree for all rays, less Embree for the unresolved ones, the list "
        "of these and the hits of the others; a march of that time makes the hybrid as fast as "
        "Embree alone, and below a march / break-even of 1 the hybrid wins; where it is below 0 no "
        f"march is fast enough, and its multiples are {NEVER}.",
        "Set-up: a march of one step. Near gathers: what gathers from the arrays of the view and "
        "the scene would take alone, at the fastest rate of any table; where this or set-up is "
        "above 1, a march that does this work by gathers cannot win here. Far gathers: all, at "
        "random places of their working sets (table 'Gathers'); no such bound, since neighbouring "
        "rays read the same places.",
        f"Medians of {run.meta['spec']['rounds']} rounds, each of which times everything in turn; "
        "speed-up: of the paired ratios.",
    ]
    return table


def parts(run: RunData) -> Table:
    """Return the time per ray and per step, in lanes and without, and the floors."""
    table = Table(
        "The march's time",
        ["", "march, ns per ray", "march, ns per step", "set-up, one step, write, ns per ray",
         "near gathers, ns per ray", "far gathers, ns per ray", "without vectors, ns per ray",
         "vectors' speed-up"],
    )  # fmt: skip
    rates = run.meta["rates"]
    for heading, rows in _groups(run):
        table.rows.append([heading])
        for row in _rows(rows):
            table.rows.append(
                [
                    view(run, row),
                    interval(row.march_ns, row.march_ns_low, row.march_ns_high),
                    number(row.march_ns * row.rays / row.steps),
                    number(row.start_ns),
                    number(near_gathers_ns(rates, row)),
                    number(far_gathers_ns(rates, row)),
                    number(row.scalar_ns),
                    interval(
                        row.vectors_speedup, row.vectors_speedup_low, row.vectors_speedup_high
                    ),
                ]
            )
    table.notes.append(
        "Set-up, near and far gathers: see above. The march's own slots are among the far gathers "
        "and not among the near ones: another order of the same work may do without them."
    )
    return table


def work(run: RunData) -> Table:
    """Return what is done per ray."""
    table = Table(
        "The march's work per ray",
        ["", "rays", "steps", "pixels looked at", "entries", "planes", "exact tests",
         "32-bit elements gathered", "bytes touched"],
    )  # fmt: skip
    for row in _rows(_once(run)):
        counted = (row.steps, row.looks, row.entries, row.planes, row.tests)
        gathered = sum(row[f"{name}_gathered"] for name in STRUCTURES)
        table.rows.append(
            [
                view(run, row),
                f"{int(row.rays):,}",
                *(number(value / row.rays) for value in counted),
                number(gathered / row.rays),
                number(row.touched_bytes / row.rays),
            ]
        )
    table.notes.append(
        "A pixel is looked at again after an exact test. Bytes touched: 4 for each element "
        "gathered (those of the march's own slots are among them), the ray and its row of results."
    )
    return table


def busy(run: RunData) -> Table:
    """Return which share of the lanes each stage keeps at work."""
    once = _once(run)
    table = Table(
        f"Lanes at work, % of {int(once.lanes.iloc[0])}",
        ["", *STAGES, "vectors per ray"],
    )
    for row in _rows(once):
        vectors = sum(row[f"{stage}_vectors"] for stage in STAGES)
        shares = [number(100 * row[f"busy_{stage}"]) for stage in STAGES]
        table.rows.append([view(run, row), *shares, number(vectors / row.rays)])
    table.notes.append(
        "Entry: a place of the lists of as many pixels as there are lanes; plane: where that names "
        "a triangle that was not tested just before. Vectors: of all five stages."
    )
    return table


def raster(run: RunData) -> Table:
    """Return what the raster of the views takes, stage by stage, beside Embree's primary rays."""
    table = Table(
        "The raster's time, ms per view",
        ["", "Embree, primary rays", "raster", "Embree / raster", *RASTER],
    )
    for heading, rows in _groups(run):
        table.rows.append([heading])
        for row in _rows(rows):
            table.rows.append(
                [
                    view(run, row),
                    number(row.primary_ms),
                    number(row.raster_ms),
                    interval(row.raster_speedup, row.raster_speedup_low, row.raster_speedup_high),
                    *(number(row[f"{stage}_ms"]) for stage in RASTER),
                ]
            )
    table.notes.append(
        "Depth, derivatives and primitive of every pixel. Vertices: "
        "projecting them; cull: which faces may cover a pixel; records: their planes, and the "
        "tiles they are put into; tiles: drawing these and writing the images. Embree: the "
        "strongest of its paths for the primary rays."
    )
    return table


def gathers(run: RunData) -> Table:
    """Return what is gathered from each structure, and what that takes at the machine's rates."""
    counts = sorted(int(n) for n in run.results.threads.unique())
    table = Table(
        "Gathers",
        ["", "working set, MiB", "32-bit elements per ray", "places per ray",
         *(f"ns per element, {threads_text(n)}" for n in counts),
         *(f"ns per ray, {threads_text(n)}" for n in counts)],
        detail=True,
    )  # fmt: skip
    rates = run.meta["rates"]
    for row in _rows(_once(run)):
        table.rows.append([view(run, row)])
        for name in STRUCTURES:
            size = float(row[f"{name}_bytes"])
            each = [{**row, "threads": n} for n in counts]
            table.rows.append(
                [
                    name,
                    number(size / 2**20),
                    number(row[f"{name}_gathered"] / row.rays),
                    number(row[f"{name}_places"] / row.rays),
                    *(number(ns_element(rates, size, n)) for n in counts),
                    *(number(far_ns(rates, r, name)) for r in each),
                ]
            )
    table.notes.append(
        "Elements that lie side by side, those of a plane and of a triangle's corners, are one "
        "place: the first is taken at the rate of the working set, the others at the fastest rate "
        "of any table. A working set is all of a structure, whatever a view reads of it."
    )
    return table


def machine(run: RunData) -> Table:
    """Return the rates of the machine."""
    rates = pd.DataFrame(run.meta["rates"])
    counts = sorted(int(n) for n in rates.threads.unique())
    table = Table(
        "How fast the machine reads",
        ["table, KiB", *(f"gathers, G elements/s, {threads_text(n)}" for n in counts),
         *(f"latency of a vector, ns, {threads_text(n)}" for n in counts),
         *(f"loads, GB/s, {threads_text(n)}" for n in counts)],
    )  # fmt: skip
    for size, part in rates.groupby("bytes"):
        by: Any = part.set_index(["kind", "threads"])
        table.rows.append(
            [
                f"{int(str(size)) // 1024}",
                *(number(1 / by.ns_element["gather", n]) for n in counts),
                *(number(by.ns_vector["chain", n]) for n in counts),
                *(number(4 / by.ns_element["load", n]) for n in counts),
            ]
        )
    caches = ", ".join(f"{c['name']} {c['bytes'] // 1024} KiB" for c in run.meta["caches"])
    table.notes.append(
        f"Vectors of {int(run.results.lanes.iloc[0])} float32 at random places; best of "
        f"{run.meta['spec']['repeats']}. Gathers do not wait for each other; where a latency is "
        "told, each takes its places from the one before. Threads read the same table."
        + (f" Caches: {caches}." if caches else "")
    )
    return table


def of_budget(row: Any, ns: float) -> str:
    """Return a time as a multiple of the break-even march time."""
    return number(ns / row.budget_ns) if row.budget_ns > 0 else NEVER


def view(run: RunData, row: Any) -> str:
    """Return the name of a view; with its size where the run has several."""
    sizes = run.results[["width", "height"]].drop_duplicates()
    size = f", {int(row.width)}x{int(row.height)}" if len(sizes) > 1 else ""
    return f"{scene_name(run, str(row.scene))}, {row.camera}{size}"


def _groups(run: RunData) -> list[tuple[str, pd.DataFrame]]:
    return [
        (threads_text(int(str(threads))), rows) for threads, rows in run.results.groupby("threads")
    ]


def _once(run: RunData) -> pd.DataFrame:
    """Return the rows of one number of threads: what a march does is the same with any."""
    rows: pd.DataFrame = run.results[run.results.threads == run.results.threads.max()]
    return rows


def _rows(rows: pd.DataFrame) -> list[Any]:
    return [row for _, row in rows.iterrows()]
