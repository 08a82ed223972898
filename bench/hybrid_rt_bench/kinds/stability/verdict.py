"""What a run of kind "stability" comes to."""

from __future__ import annotations

import pandas as pd

from hybrid_rt.judging.rate import Rate
from hybrid_rt_bench.kinds.stability.tables import entrants
from hybrid_rt_bench.report.table import number, rate_words
from hybrid_rt_bench.report.words import MOST_NAMED, counted, listed, named
from hybrid_rt_bench.results.folder import RunData


def verdict(run: RunData) -> str:
    """Return who passes every case, who fails most of them, and how often each is wrong."""
    every = entrants(run)
    rows = {name: run.results[run.results.technique == name] for name in every}
    failed = {name: int((part.state != "pass").sum()) for name, part in rows.items()}
    cases = run.results.case.nunique()
    clean = [name for name in every if not failed[name]]
    whole = f"{counted(len(every), 'entrant')} (techniques and tracers) on"
    said = [f"Of {whole} {counted(cases, 'hard case')}, {_passing(clean, len(every))}."]
    said += [f"{_wrong(name, rows[name])}." for name in clean[:MOST_NAMED]]
    losers = sorted((name for name in every if failed[name]), key=lambda name: -failed[name])
    if losers:
        parts = [f"{name} {failed[name]}" for name in losers[: 2 * MOST_NAMED]]
        more = len(losers) - len(parts)
        said.append(
            f"The others fail, by number of cases: {listed(parts)}"
            + (f", and {more} more fewer. " if more else ". ")
            + f"{_wrong(losers[0], rows[losers[0]])}."
        )
    broken = [name for name in every if (rows[name].state == "error").any()]
    if broken:
        said.append(f"An error was raised by {listed(broken)}.")
    return " ".join(said)


def _passing(clean: list[str], total: int) -> str:
    if not clean:
        return "none passes every case"
    if len(clean) == total:
        return "all pass every case" if total > 1 else f"{clean[0]} passes every case"
    return f"{named(clean, 'entrant')} alone pass{'es' if len(clean) == 1 else ''} every case"


def _wrong(name: str, rows: pd.DataFrame) -> str:
    rays, resolved = int(rows.rays.sum()), int((rows.rays - rows.unresolved).sum())
    if not resolved:
        return f"Entrant {name} resolves none of {rays:,} rays"
    rate = Rate.of(min(int(rows.wrong.sum()), resolved), resolved)
    return (
        f"Entrant {name} resolves {number(100 * resolved / rays)} % of {rays:,} rays and, of those "
        f"resolved, is wrong on {rate_words(rate)}"
    )
