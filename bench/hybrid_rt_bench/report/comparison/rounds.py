"""The measured rounds of a run, each time beside the baseline of its round."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
import pandas as pd

from hybrid_rt_bench.results.compared import Compared, Timing
from hybrid_rt_bench.results.effects import deviation, middle
from hybrid_rt_bench.results.files import ReportsError
from hybrid_rt_bench.results.folder import RunData
from hybrid_rt_bench.results.schema import Schema

MEASURES = ["timing", "round", "seconds", "baseline", "per"]
"""The columns of `rounds_of` besides those that name a row."""


def identity(compared: Compared, schema: Schema) -> list[str]:
    """Return the columns that say which cell a row is of."""
    return list(compared.cell or schema.key_names)


def rounds_of(run: RunData, compared: Compared, schema: Schema) -> pd.DataFrame:
    """Return one row for each time of each measured round.

    Returns
    -------
    DataFrame
        The columns of `identity`, the kind's names (empty or 0 where a timing has none),
        ``timing``, ``round``, ``seconds`` and ``baseline``: the seconds of the strongest tracer in
        the same round, NaN for a time that is a baseline itself. ``per``: by what their ratio is
        multiplied, where they did not do the same amount of work.

    Raises
    ------
    ReportsError
        Seconds that are not positive and finite.
    """
    names = list(compared.names)
    columns = [*identity(compared, schema), *names, *MEASURES]
    if run.samples.empty or not compared.timings:
        return pd.DataFrame(columns=columns)
    wide = _with_results(_wide(run, compared, schema), run, compared, schema)
    parts = [_timed(wide, timing, compared, schema) for timing in compared.timings]
    found = pd.concat([part[columns] for part in parts if len(part)], ignore_index=True)
    for column in ("seconds", "baseline"):
        values = found[column].dropna()
        if not (np.isfinite(values) & (values > 0)).all():
            raise ReportsError(f"{run.folder}: samples.parquet has times that are not positive")
    return found


def _wide(run: RunData, compared: Compared, schema: Schema) -> pd.DataFrame:
    """Return the measured samples with a column for each stage."""
    frame = run.samples
    if "phase" in frame:
        frame = frame[frame.phase == "measured"]
    if not compared.stage:
        return frame.reset_index(drop=True)
    index = [*schema.key_names, *compared.names, "round"]
    if frame.duplicated([*index, compared.stage]).any():
        raise ReportsError(f"{run.folder}: samples.parquet has a stage twice in one round")
    wide = frame.pivot(index=index, columns=compared.stage, values="seconds").reset_index()
    # The baseline of a round stands in a row of its own, which belongs to no technique.
    for name in {timing.baseline for timing in compared.timings} & set(wide.columns):
        keys = [*schema.key_names, "round"]
        beside = wide.loc[wide[name].notna(), [*keys, name]]
        wide = wide.drop(columns=name).merge(beside, on=keys, how="left", validate="m:1")
    return wide


def _with_results(
    wide: pd.DataFrame, run: RunData, compared: Compared, schema: Schema
) -> pd.DataFrame:
    """Return the samples with those columns of the results that name their cells, and amounts."""
    keys = list(schema.key_names)
    place = [name for name in compared.cell if name not in wide]
    if place:
        cells = run.results[[*keys, *place]].drop_duplicates()
        wide = wide.merge(cells, on=keys, how="left", validate="m:1")
    amounts = list({t.amount for t in compared.timings if t.amount and t.amount not in wide})
    if amounts:
        rows = run.results[[*keys, *compared.names, *amounts]]
        wide = wide.merge(rows, on=[*keys, *compared.names], how="left", validate="m:1")
    return wide


def _timed(wide: pd.DataFrame, timing: Timing, compared: Compared, schema: Schema) -> pd.DataFrame:
    if not _has(wide, [*timing.columns, *filter(None, [timing.baseline])]):
        return pd.DataFrame()
    seconds = wide[list(timing.columns)].sum(axis=1, skipna=False)
    kept = wide.assign(timing=timing.name, seconds=seconds, baseline=np.nan, per=1.0)
    if timing.baseline:
        kept["baseline"] = wide[timing.baseline]
        if timing.baseline_amount:
            kept["per"] *= wide[timing.baseline_amount]
    if timing.amount:
        kept["per"] /= wide[timing.amount]
    kept = kept[kept.seconds.notna() & (kept.baseline.notna() | (not timing.baseline))]
    if timing.of is not None:
        for name in compared.names:
            if name not in timing.of:
                kept[name] = "" if schema.tables["samples"][name].type is str else 0
    if not timing.baseline:  # of the cell: the same stage may stand in several rows
        place = [*identity(compared, schema), *compared.names]
        kept = kept.drop_duplicates([*place, "round", "seconds"])
    return kept


def _has(frame: pd.DataFrame, columns: Iterable[str]) -> bool:
    return set(columns) <= set(frame.columns)


def middles(rounds: pd.DataFrame, place: Sequence[str]) -> pd.DataFrame:
    """Return, for each time of a run, the middle of its rounds.

    Parameters
    ----------
    rounds : DataFrame
        As `rounds_of` returns them.
    place : sequence of str
        The columns that name a row, ``timing`` among them.

    Returns
    -------
    DataFrame
        Indexed by `place`: ``level``, the logarithm of the time over its baseline (of the seconds
        where there is none); ``variance``, of that middle; ``seconds``, the median; ``baseline``,
        the logarithm of its median, and ``scatter``, the deviation of that from round to round, NaN
        where there is none; ``shorter``, the fastest round of either.
    """
    rows = []
    for key, part in rounds.groupby(list(place), sort=False):
        seconds, baseline = part.seconds.to_numpy(), part.baseline.to_numpy()
        raw = bool(np.isnan(baseline).any())
        level, variance = middle(seconds, np.ones(len(seconds)) if raw else baseline / part.per)
        beside = np.log(baseline)  # all NaN where there is none
        found = (float(np.median(seconds)), float(np.median(beside)), deviation(beside))
        shorter = float(np.fmin(seconds.min(), np.exp(beside.min())))
        rows.append((*key, level, variance, *found, shorter))
    columns = [*place, "level", "variance", "seconds", "baseline", "scatter", "shorter"]
    return pd.DataFrame(rows, columns=columns).set_index(list(place))
