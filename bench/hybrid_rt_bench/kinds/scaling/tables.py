"""The tables of an experiment of kind "scaling"."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import pandas as pd

from hybrid_rt_bench.kinds.scaling.stages import (
    A_RAY,
    Key,
    name_of,
    ordered,
)
from hybrid_rt_bench.report.table import (
    ABSENT,
    DASH,
    Table,
    interval,
    number,
    threads_text,
)
from hybrid_rt_bench.results import exponents
from hybrid_rt_bench.results import statistics as stats
from hybrid_rt_bench.results.folder import RunData
from hybrid_rt_bench.results.schema import HYBRID_STAGES

FROM, TO, GOAL = 2**14, 2**23, 1.5
"""The march's time may grow by no more than GOAL from FROM to TO triangles."""

SURE = 0.9
"""Coverage that an interval must have to be spoken of; five rounds give it 0.94, three 0.75."""

AXES = {"triangles": "triangles", "pixels": "pixels", "threads": "threads"}

MIB = 2**20


def tables(run: RunData) -> list[Table]:
    """Return every table of the run, in the order of reading."""
    found: list[Table] = []
    for name in series_names(run):
        part = of_series(run, name)
        axis = str(part.axis.iloc[0])
        if axis == "triangles":
            found.append(growth_table(run, name))
        found.append(fitted(run, name))
        if axis == "threads":
            found.append(speedup(run, name))
        found += [times(run, name), times_a_ray(run, name)]
    return [*found, memory(run), answers(run), paths(run)]


def series_names(run: RunData) -> list[str]:
    """Return the names of the series, in the order in which they were measured."""
    return [str(name) for name in dict.fromkeys(run.results.series)]


def of_series(run: RunData, name: str) -> pd.DataFrame:
    """Return the rows of a series, in ascending order of what it goes along."""
    return run.results[run.results.series == name].sort_values("x", kind="stable")


def stages_of(part: pd.DataFrame) -> list[Key]:
    """Return technique and stage of everything timed, what belongs to no technique first."""
    return ordered(zip(part.technique, part.stage, strict=True))


def fixed(part: pd.DataFrame) -> str:
    """Return in words what the cells of a series share."""
    row = part.iloc[0]
    words = [f"scene {row.scene}, camera {row.camera}"]
    if row.axis != "triangles":
        words.append(f"{row.triangles:,} triangles")
    if row.axis != "pixels":
        words.append(f"{row.width}x{row.height}")
    if row.axis != "threads":
        words.append(threads_text(row.threads))
    return ", ".join(words)


@dataclass(frozen=True)
class Growth:
    """By how much the time of a stage grows between two sizes of a series.

    Attributes
    ----------
    key : tuple of str
        Technique and stage.
    first_ms, last_ms : float
        Medians at the two sizes.
    ratio : Estimate
        The last time over the first, paired by round.
    per_ray : float
        The same ratio of times per ray.
    """

    key: Key
    first_ms: float
    last_ms: float
    ratio: stats.Estimate
    per_ray: float


def growths(run: RunData, name: str) -> list[Growth]:
    """Return by how much march, hybrid and Embree grow from 2^14 to 2^23, or as was measured."""
    part = of_series(run, name)
    first, last = ends(part)
    rounds, found = _rounds(run, name), []
    for key in [key for key in stages_of(part) if key[1] in ("march", "hybrid", "embree")]:
        rows = part[(part.technique == key[0]) & (part.stage == key[1])].set_index("x")
        if first in rows.index and last in rows.index:
            ratio = _paired(rounds, rows, key, first, last)
            per_ray = float(ratio.value * rows.rays[first] / rows.rays[last])
            found.append(Growth(key, rows.ms[first], rows.ms[last], ratio, per_ray))
    return found


def growth_table(run: RunData, name: str) -> Table:
    """Return by how much the times grow from 2^14 to 2^23 triangles, or as far as was measured."""
    part = of_series(run, name)
    first, last = ends(part)
    names = labels(part)
    asked = f"2^{FROM.bit_length() - 1} to 2^{TO.bit_length() - 1}"
    whole = (first, last) == (FROM, TO)
    table = Table(
        f"Growth from {names[first]} to {names[last]} triangles at a fixed view ({name})",
        ["", f"{names[first]}, ms", f"{names[last]}, ms", "ratio [interval]", "ratio per ray",
         f"goal: < {GOAL}"],
    )  # fmt: skip
    for found in growths(run, name):
        goal = DASH
        if found.key[1] == "march":
            goal = goal_said(found.ratio) if whole else f"not said: {asked} not measured"
        table.rows.append(
            [
                name_of(*found.key),
                number(found.first_ms),
                number(found.last_ms),
                ratio_text(found.ratio),
                number(found.per_ray),
                goal,
            ]
        )
    table.notes += [
        f"{_capital(fixed(part))}. Median of the ratios inside the rounds, with the interval of "
        f"order statistics; {_coverage(part)}.",
    ]
    if not whole:
        table.notes.append(f"The goal is put for {asked} triangles, which this run does not hold.")
    return table


def ratio_text(ratio: stats.Estimate) -> str:
    """Return a ratio with its interval, a dash for the interval of one round."""
    if ratio.count > 1:
        return interval(ratio.value, ratio.low, ratio.high)
    return f"{number(ratio.value)} [{DASH}]"


def fitted(run: RunData, name: str) -> Table:
    """Return the exponent that each stage grows with."""
    part = of_series(run, name)
    axis = AXES[str(part.axis.iloc[0])]
    names = labels(part)
    table = Table(
        f"Exponents: time as a power of {axis} ({name})",
        ["", "exponent [95 %]", "upper half of the range [95 %]", "measured at", "ratio, ends"],
    )
    for key in stages_of(part):
        rows = part[(part.technique == key[0]) & (part.stage == key[1])]
        if len(rows) < 2:
            continue
        above = exponents.upper_half(rows.x)
        upper = exponents.fit(rows.x[above], rows.ms[above])
        table.rows.append(
            [
                name_of(*key),
                exponent_text(exponents.fit(rows.x, rows.ms)),
                exponent_text(upper) if above.sum() < len(rows) else "the same",
                f"{names[int(rows.x.iloc[0])]} to {names[int(rows.x.iloc[-1])]}",
                number(rows.ms.iloc[-1] / rows.ms.iloc[0]),
            ]
        )
    if not table.rows:
        table.notes.append("One size alone has no exponent.")
    table.notes += [
        f"{_capital(fixed(part))}. Slope of log time over log {axis} through the medians of the "
        "rounds, by least squares; Student's interval from the scatter about the line (a dash: "
        "fewer than three points), which is wide where the curve bends.",
    ]
    said = {
        "triangles": "0: no growth, O(1). O(log n) over this range looks like about "
        f"{_log_exponent(part)}. 1: O(n).",
        "pixels": "1: in proportion to the pixels.",
        "threads": "-1: twice the threads halve the time. 0: threads do not help.",
    }
    table.notes.append(said[str(part.axis.iloc[0])])
    return table


def speedup(run: RunData, name: str) -> Table:
    """Return what threads are worth: the time of one over the time of many."""
    part = of_series(run, name)
    places = list(dict.fromkeys(part.x))
    table = Table(
        f"Speed-up by threads, and share of the ideal ({name})",
        ["", *[f"{x} threads" if x != 1 else "1 thread" for x in places]],
    )
    for key in stages_of(part):
        rows = part[(part.technique == key[0]) & (part.stage == key[1])].set_index("x")
        if places[0] not in rows.index:
            continue
        cells = []
        for x in places:
            ratio = rows.ms[places[0]] / rows.ms[x] if x in rows.index else math.nan
            cells.append(f"{number(ratio)} ({number(100 * ratio * places[0] / x, 2)} %)")
        table.rows.append([name_of(*key), *cells])
    table.notes.append(f"{_capital(fixed(part))}. Ratio of the medians of the rounds.")
    return table


def times(run: RunData, name: str) -> Table:
    """Return the time of every stage in milliseconds."""
    part = of_series(run, name)
    table = _over(
        part, f"Times in ms ({name})", stages_of(part), lambda row: number(row.ms),
    )  # fmt: skip
    table.notes.append(
        f"{_capital(fixed(part))}. Median of {_round_counts(part)}. The hybrid: march, "
        "compaction, fallback and merge; in the line after it also the raster, and what the march "
        "reads. "
        "Intervals are in results.csv, every sample in samples.parquet."
    )
    return table


def times_a_ray(run: RunData, name: str) -> Table:
    """Return the time per ray, in nanoseconds, all threads together."""
    part = of_series(run, name)
    keys = [key for key in stages_of(part) if key[1] in A_RAY]
    table = _over(
        part, f"Times in ns per ray, all threads together ({name})", keys,
        lambda row: number(row.ns_per_ray),
    )  # fmt: skip
    counts = part.drop_duplicates("x")
    table.rows.append(["number of rays", *[f"{rays:,}" for rays in counts.rays]])
    brute = part[part.stage == "brute_force"]
    if len(brute):
        table.notes.append(
            f"Brute force: every triangle in float64, for a sample of {brute.timed_rays.max():,} "
            f"of the rays; {ABSENT} where a round would take longer than the experiment allows."
        )
    return table


def memory(run: RunData) -> Table:
    """Return the peak memory of every cell."""
    table = Table(
        "Peak memory of the process of each cell, MiB",
        ["", "peak", "of that: program", "scene", "all else", "all else, bytes per triangle",
         "all else, bytes per pixel"],
        detail=True,
    )  # fmt: skip
    unsure = False
    for name in series_names(run):
        table.rows.append([name])
        for cell in _cells(run, name):
            if not cell["peak_bytes"]:
                table.rows.append([str(cell["label"]), ABSENT])
                continue
            unsure |= not cell["peak_is_of_rounds"]
            other = max(0, cell["peak_bytes"] - cell["program_bytes"] - cell["scene_bytes"])
            table.rows.append(
                [
                    str(cell["label"]),
                    *(
                        f"{value / MIB:,.0f}"
                        for value in (
                            cell["peak_bytes"], cell["program_bytes"], cell["scene_bytes"], other,
                        )
                    ),
                    number(other / cell["triangles"]),
                    number(other / (cell["width"] * cell["height"])),
                ]
            )  # fmt: skip
    table.notes.append(
        "Each cell has a process of its own. Program: interpreter, libraries and compiled kernels. "
        "Scene: triangles as loaded. All else: Embree's structure, G-buffers with and without "
        "lists, pyramids, rays and answers at their most in any round."
    )
    if unsure:
        table.notes.append(
            "This system cannot count a peak from a given moment on: peaks hold the making of the "
            "scene and the choice of the strongest Embree (four structures) as well."
        )
    return table


def answers(run: RunData) -> Table:
    """Return alpha and steps per ray of each technique: what the times were spent on."""
    table = Table(
        "Share of rays that the screen answers, and steps per ray", ["", "alpha", "steps per ray"],
        detail=True,
    )  # fmt: skip
    marches = run.results[run.results.stage == "march"]
    for name in series_names(run):
        rows = marches[marches.series == name].sort_values("x", kind="stable")
        if rows.axis.iloc[0] == "threads":
            rows = rows[rows.x == rows.x.min()]
        for technique in dict.fromkeys(rows.technique):
            table.rows.append([f"{name}, {technique}"])
            table.rows += [
                [str(row.label), f"{row.alpha:.3f}", number(float(row.steps_per_ray))]
                for _, row in rows[rows.technique == technique].iterrows()
            ]
    return table


def paths(run: RunData) -> Table:
    """Return which way through Embree was the strongest in each cell."""
    table = Table(
        "The strongest Embree", ["", "path", "triangles", "compilation or its loading, s"],
        detail=True,
    )  # fmt: skip
    for name in series_names(run):
        table.rows.append([name])
        for cell in _cells(run, name):
            table.rows.append(
                [
                    str(cell["label"]),
                    str(cell["embree_path"]),
                    f"{cell['triangles']:,}",
                    number(cell["compile_seconds"]),
                ]
            )
    return table


def _over(part: pd.DataFrame, title: str, keys: list[Key], text: Callable[[Any], str]) -> Table:
    names = labels(part)
    table = Table(title, ["", *names.values()])
    for technique, stage in keys:
        rows = part[(part.technique == technique) & (part.stage == stage)]
        by_x = {int(row.x): text(row) for _, row in rows.iterrows()}
        table.rows.append([name_of(technique, stage), *[by_x.get(x, ABSENT) for x in names]])
    return table


def _cells(run: RunData, name: str) -> list[dict[str, Any]]:
    cells = [c for c in run.meta["cells"] if c["state"] == "measured" and c["series"] == name]
    return sorted(cells, key=lambda cell: int(cell["x"]))


def labels(part: pd.DataFrame) -> dict[int, str]:
    """Return what the places of a series are called."""
    rows = part.drop_duplicates("x")
    return {int(x): str(label) for x, label in zip(rows.x, rows.label, strict=True)}


def ends(part: pd.DataFrame) -> tuple[int, int]:
    """Return the sizes nearest to FROM and TO that were measured, from inside where possible."""
    sizes = sorted(int(x) for x in set(part.x))
    inside = [x for x in sizes if FROM <= x <= TO] or sizes
    return inside[0], inside[-1]


def _rounds(run: RunData, name: str) -> pd.DataFrame:
    """Return the seconds of a series, a row a round, a column (technique, stage, x)."""
    samples = run.samples
    mine = samples[(samples.series == name) & (samples.phase == "measured")]
    return mine.pivot_table(
        index="round", columns=["technique", "stage", "x"], values="seconds", aggfunc="first"
    )


def _paired(
    rounds: pd.DataFrame, rows: pd.DataFrame, key: Key, first: int, last: int
) -> stats.Estimate:
    """Return the ratio of two sizes' times, paired by round."""
    technique, stage = key
    parts = HYBRID_STAGES if stage == "hybrid" else (stage,)
    first_s, last_s = (
        rounds[[(technique, part, x) for part in parts]].sum(axis=1, skipna=False)
        for x in (first, last)
    )
    paired = (last_s / first_s).dropna()
    if paired.empty:  # a cell lost before the other had its turn
        value = float(rows.ms[last] / rows.ms[first])
        return stats.Estimate(value, math.nan, math.nan, math.nan, 0)
    return stats.median(paired.to_numpy())


def goal_said(ratio: stats.Estimate) -> str:
    """Tell whether the goal is reached, and if the interval says so too or too few rounds ran."""
    held = ratio.value < GOAL
    sure = ratio.coverage >= SURE and (ratio.high < GOAL if held else ratio.low > GOAL)
    return ("held" if held else "missed") + ("" if sure else ", by its median alone")


def exponent_text(found: exponents.Exponent) -> str:
    """Return an exponent with its interval, a dash for what too few sizes do not give."""
    if math.isnan(found.value):
        return DASH
    if math.isinf(found.low):
        return f"{found.value:.2f} [{DASH}]"
    return f"{found.value:.2f} [{found.low:.2f}, {found.high:.2f}]"


def _log_exponent(part: pd.DataFrame) -> str:
    sizes = part.drop_duplicates("x").x.to_numpy(float)
    if len(sizes) < 2 or sizes.min() < 2:
        return DASH
    return f"{exponents.fit(sizes, [math.log(x) for x in sizes]).value:.2f}"


def _round_counts(part: pd.DataFrame) -> str:
    low, high = int(part.rounds.min()), int(part.rounds.max())
    return f"{low} round{'s' if low != 1 else ''}" if low == high else f"{low} to {high} rounds"


def _coverage(part: pd.DataFrame) -> str:
    count = int(part.rounds.min())
    if count < 2:
        return "one round has none"
    covered = stats.median([float(k) for k in range(1, count + 1)]).coverage
    return f"with {count} rounds it holds with {100 * covered:.0f} %"


def _capital(text: str) -> str:
    return text[0].upper() + text[1:]
