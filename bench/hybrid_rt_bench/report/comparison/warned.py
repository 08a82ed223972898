"""What is to be known before a comparison is believed: of the machines, programs and runs."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from hybrid_rt_bench.report.comparison.rounds import identity
from hybrid_rt_bench.results.compared import Compared
from hybrid_rt_bench.results.folder import RunData
from hybrid_rt_bench.results.schema import Schema

MACHINE = {
    "cpu": "processor", "cores": "number of cores", "logical_cores": "number of usable cores",
    "memory_bytes": "memory", "os": "operating system", "threads": "number of threads",
}  # fmt: skip
"""What makes a machine, in ``run.json``, and what it is called."""

PROGRAM = {
    "hybrid_rt": "hybrid-rt", "python": "Python", "packet_path": "Embree's packet calls",
    "keeps_freed_memory": "whether freed memory is kept",
}  # fmt: skip

DIRTY = " with changes"
"""What ``git`` in ``run.json`` ends with, where the checkout was not as its commit."""

NOT_COMPARED = ("title", "schema", "name")
"""What experiments may differ in."""

Runs = Sequence[RunData]


def foreign(before: Runs, after: Runs) -> list[str]:
    """Return a sentence for each thing that makes the machines of the runs differ."""
    return _differing(before, after, MACHINE, lambda run: run.meta["environment"])


def warnings(before: Runs, after: Runs) -> list[str]:
    """Return a sentence for all else: programs, experiments, and what runs say of themselves."""
    found = _differing(before, after, PROGRAM, lambda run: run.meta["environment"])
    for part, said in (("packages", ""), ("embree", "Embree's ")):
        every = [run.meta["environment"][part] for run in (*before, *after)]
        names = dict.fromkeys(name for values in every for name in values)
        words = {name: f"{said}{name}" for name in names}
        found += _differing(before, after, words, lambda run, p=part: run.meta["environment"][p])
    found += _differing(before, after, {"git": "commit"}, _commit)
    settings = dict.fromkeys(k for run in (*before, *after) for k in run.meta["spec"])
    words = {k: f"{k!r} of the experiment" for k in settings if k not in NOT_COMPARED}
    found += _differing(before, after, words, lambda run: run.meta["spec"])
    twice = {run.folder.resolve() for run in before} & {run.folder.resolve() for run in after}
    found += [f"{folder.name} stands on both sides." for folder in sorted(twice)]
    for run in _each(before, after):
        found += [f"{run.name}: {text}" for text in _own(run)]
    return found


def chosen(
    before: Runs, after: Runs, compared: Compared, schema: Schema
) -> dict[tuple[Any, ...], bool]:
    """Return, by cell, whether all runs chose the same while running, such as a path of Embree."""
    cell, keys = identity(compared, schema), list(schema.key_names)
    found: dict[tuple[Any, ...], list[Any]] = {}
    for run in (*before, *after):
        details = {tuple(c[k] for k in keys): c for c in run.meta["cells"]}
        columns = [name for name in compared.chosen if name in run.results]
        rows = run.results[list(dict.fromkeys([*keys, *cell, *columns]))].drop_duplicates()
        for row in rows.to_dict("records"):
            known = details.get(tuple(row[k] for k in keys), {})
            values = tuple(row.get(name, known.get(name)) for name in compared.chosen)
            found.setdefault(tuple(row[name] for name in cell), []).append(values)
    return {place: len(set(values)) == 1 for place, values in found.items()}


def _own(run: RunData) -> Iterable[str]:
    """Yield what a run says of itself."""
    if not run.meta["finished"]:
        yield "not finished; only some of its cells are here."
    failed = sum(cell.get("state") == "failed" for cell in run.meta["cells"])
    if failed:
        yield f"{failed} of its cells failed."
    if str(run.meta["environment"].get("git") or "").endswith(DIRTY):
        yield "made from a checkout with changes that are in no commit."
    yield from run.meta["warnings"]


def _commit(run: RunData) -> dict[str, Any]:
    git = run.meta["environment"].get("git")
    return {"git": str(git).removesuffix(DIRTY)[:12] if git else None}


def _each(before: Runs, after: Runs) -> list[RunData]:
    return list({run.folder.resolve(): run for run in (*before, *after)}.values())


def _differing(before: Runs, after: Runs, words: dict[str, str], of: Any) -> list[str]:
    """Return a sentence for each key whose values are not one and the same."""
    found = []
    for key, word in words.items():
        values = [_distinct(of(run).get(key) for run in side) for side in (before, after)]
        if len(_distinct([*values[0], *values[1]])) > 1:
            was, now = (" or ".join(map(_said, some)) for some in values)
            found.append(f"The runs differ in {word}: {was} before, {now} after.")
    return found


def _distinct(values: Iterable[Any]) -> list[Any]:
    found: list[Any] = []
    for value in values:
        if value not in found:
            found.append(value)
    return found


def _said(value: Any) -> str:
    text = "unknown" if value is None else str(value)
    return text if len(text) <= 60 else text[:57] + "..."
