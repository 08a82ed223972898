"""What a run of kind "peers" comes to."""

from __future__ import annotations

import pandas as pd

from hybrid_rt.judging.rate import Rate
from hybrid_rt_bench.kinds.peers import tables
from hybrid_rt_bench.report.table import DASH, number, rate_words
from hybrid_rt_bench.report.words import MOST_NAMED, counted, listed
from hybrid_rt_bench.results.folder import RunData

STRONGEST = "embree"
"""The peer that others are held against."""


def verdict(run: RunData) -> str:
    """Return how far each program is from the strongest Embree, how far they agree, who failed."""
    traced = tables.ok(tables.traced(run))
    mirror = traced[traced.workload == "mirror"]
    said = [f"Of the same rays on this machine ({tables.views_text(run)}):"]
    said.append(_rates(run, mirror) or "no peer traced mirror rays.")
    said.append(_agreement(traced))
    said.append(_raster(run))
    lost = [
        str(name)
        for name, rows in run.results.groupby("technique", sort=False)
        if (rows.state != "ok").all()
    ]
    if lost:
        ran = run.results.technique.nunique() - len(lost)
        which = f" ({listed(lost)})" if len(lost) <= 2 * MOST_NAMED else ""
        said.append(f"{counted(ran, 'program')} ran, {len(lost)} did not{which}.")
    return " ".join(text for text in said if text)


def _rates(run: RunData, mirror: pd.DataFrame) -> str:
    found = {str(name): rows for name, rows in mirror.groupby("technique", sort=False)}
    rates = {name: tables.rate(rows) for name, rows in found.items()}
    if not rates:
        return ""
    text = ""
    if STRONGEST in rates:
        text = (
            f"the strongest Embree traces {number(rates.pop(STRONGEST))} M mirror rays per second"
        )
    order = sorted(rates, key=lambda name: -rates[name])
    ratios = {name: tables.ratio(run, found[name]) for name in order}
    order = [name for name in order if ratios[name] != DASH]
    parts = [f"{name} {ratios[name]}" for name in order[: 2 * MOST_NAMED]]
    if not parts:
        return f"{text}." if text else ""
    lead = f"{text}; " if text else ""
    more = f" ({len(order) - len(parts)} slower ones left out)" if len(parts) < len(order) else ""
    return f"{lead}the time of the others, over its time: {listed(parts)}{more}."


def _agreement(traced: pd.DataFrame) -> str:
    """Return whose answers differ the most from those of robust Embree."""
    rates = {
        str(name): Rate.of(int(rows.different.sum()), int(rows.rays.sum()))
        for name, rows in traced.groupby("technique", sort=False)
        if name != STRONGEST and rows.different.notna().all()
    }
    if not rates:
        return ""
    name = max(rates, key=lambda peer: rates[peer].value)
    rate = rates[name]
    if not rate.count:
        return f"All of them give the primitives of robust Embree for all of {rate.total:,} rays."
    return (
        "The primitives differ from those of robust Embree the most with "
        f"{name}: {rate_words(rate)}."
    )


def _raster(run: RunData) -> str:
    drawn = tables.ok(tables.drawn(run))
    ratios = {
        str(name): tables.ratio(run, rows)
        for name, rows in drawn.groupby("technique", sort=False)
        if name != tables.RASTER
    }
    parts = [f"{name} {ratio}" for name, ratio in ratios.items() if ratio != DASH]
    return (
        f"Drawing the same picture takes, over the time of our raster: {listed(parts)}."
        if parts
        else ""
    )
