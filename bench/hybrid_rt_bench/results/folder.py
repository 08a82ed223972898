"""The folder of a run: what is in it, how it is written, how it is read again.

::

    reports/<run-id>/
      run.json          schema version, environment, experiment and its kind, every cell with what
                        became of it
      samples.parquet   every raw sample, warm-up rounds too, of what is timed
      results.parquet   one row a cell and technique: medians, intervals, alpha, errors (also .csv)
      verdicts.parquet  counts of rays by status and verdict, where the kind has them
      pictures/*.npz    the pixels of the figures
      tables.md, figures/*.png and *.svg   rendered from the files above, at any time

Everything is rewritten after every cell, all files together: they change places once all of them
are on the disk. A cell counts once it is listed in ``run.json``, and rows of a cell that is not are
left out when the run is read. So an interruption at any moment leaves the last whole state.
"""

from __future__ import annotations

import contextlib
import datetime
import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np
import pandas as pd

from hybrid_rt.errors import ArgumentError, UnknownNameError
from hybrid_rt_bench.results import files
from hybrid_rt_bench.results.files import ReportsError, write_atomic
from hybrid_rt_bench.results.schema import Schema, SchemaError

SCHEMA_VERSION = 1

TABLES = ("samples", "results", "verdicts")

FILES = (*(f"{table}.parquet" for table in TABLES), "results.csv", "run.json")
"""What is written together; ``run.json`` decides."""

META: dict[str, type] = {
    "id": str, "started": str, "finished": bool, "interrupted": bool, "spec": dict, "notes": list,
    "warnings": list, "cells": list,
}  # fmt: skip
"""What ``run.json`` says of every run, and its type."""

ENVIRONMENT: dict[str, type] = {
    "cpu": str, "threads": int, "os": str, "embree": dict, "packages": dict,
}  # fmt: skip
"""What reports tell of the machine."""

Rows = list[dict[str, Any]]


@dataclass(frozen=True)
class RunData:
    """What a run's folder holds.

    Attributes
    ----------
    folder : Path
    meta : dict
        ``run.json``.
    samples, results, verdicts : DataFrame
        Rows of the measured cells; empty where the run's kind has none.
    """

    folder: Path
    meta: dict[str, Any]
    samples: pd.DataFrame
    results: pd.DataFrame
    verdicts: pd.DataFrame

    @property
    def name(self) -> str:
        """The run's id."""
        return str(self.meta["id"])

    @property
    def kind(self) -> str:
        """The kind of its experiment."""
        return str(self.meta.get("kind", "paper"))


class RunWriter:
    """Write a run, cell by cell; it holds the folder until it is closed.

    Parameters
    ----------
    folder : Path
    schema : Schema
        The columns of its rows, and what tells its cells apart.
    meta : dict
        What ``run.json`` says from the start.
    """

    def __init__(self, folder: Path, schema: Schema, meta: dict[str, Any]) -> None:
        self.folder, self.schema = folder, schema
        self.meta: dict[str, Any] = {
            "schema_version": SCHEMA_VERSION,
            "id": folder.name,
            "finished": False,
            "interrupted": False,
            **meta,
            "cells": [],
        }
        self._rows: dict[str, Rows] = {table: [] for table in TABLES}
        self._held = files.hold(folder)

    def __enter__(self) -> RunWriter:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        value: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        files.release(self._held)
        self._held = None

    def add_cell(
        self,
        cell: dict[str, Any],
        samples: Rows,
        results: Rows,
        verdicts: Rows,
        picture: dict[str, Any] | None = None,
    ) -> None:
        """Keep a finished cell and write everything so far.

        A cell that was kept before, of which more has been measured, is replaced; its rows stay
        where the first ones were.

        Parameters
        ----------
        cell : dict
            The run's keys and whatever else is to be known of the cell.
        samples, results, verdicts : list of dict
            Rows; the cell's keys are added here.
        picture : dict of array, optional
            Pixels for the figure of the cell.

        Raises
        ------
        SchemaError
            A row that is not as the schema says.
        ReportsError
            The folder can no longer be written to.
        """
        keys = {key: cell[key] for key in self.schema.key_names}
        given = zip(TABLES, (samples, results, verdicts), strict=True)
        rows = {table: [{**keys, **row} for row in some] for table, some in given}
        self.schema.check_row("cell", cell, closed=False)
        for table, some in rows.items():
            for row in some:
                self.schema.check_row(table, row)
        with files.uninterrupted():
            if picture is not None:
                name = f"pictures/{cell['scene']}-{cell['camera']}.npz"
                with files.disk_errors(self.folder / name):
                    (self.folder / "pictures").mkdir(exist_ok=True)
                write_atomic(self.folder / name, lambda f: np.savez_compressed(f, **picture))
                cell = {**cell, "picture": name}
            for table in TABLES:
                self._rows[table] = self._renewed(self._rows[table], keys, rows[table])
            kept = {**cell, "state": "measured"}
            self.meta["cells"] = self._renewed(self.meta["cells"], keys, [kept])
            self.flush()

    def fail_cell(self, cell: dict[str, Any], error: str) -> None:
        """Keep that a cell failed, and why."""
        with files.uninterrupted():
            self.meta["cells"].append({**cell, "state": "failed", "error": error})
            self.flush()

    def finish(self, *, interrupted: bool = False) -> None:
        """Write the last state of the run."""
        self.meta["finished"] = not interrupted
        self.meta["interrupted"] = interrupted
        self.meta["ended"] = timestamp()
        with files.uninterrupted():
            self.flush()

    @property
    def measured(self) -> int:
        """Number of cells kept."""
        return sum(cell["state"] == "measured" for cell in self.meta["cells"])

    @property
    def failed(self) -> list[dict[str, Any]]:
        """The cells that failed."""
        return [cell for cell in self.meta["cells"] if cell["state"] == "failed"]

    def flush(self) -> None:
        """Write all files of the run together, the one that lists its cells last."""
        writes: dict[str, Callable[[Any], Any]] = {}
        for table, rows in self._rows.items():
            if rows:
                frame = pd.DataFrame(rows)
                writes[f"{table}.parquet"] = frame.to_parquet
                if table == "results":
                    writes["results.csv"] = _writer(frame.to_csv(index=False))
        text = json.dumps(self.meta, indent=1, allow_nan=False, default=_plain)
        writes[FILES[-1]] = _writer(text)
        files.write_together(self.folder, writes)

    def _renewed(self, kept: Rows, keys: dict[str, Any], new: Rows) -> Rows:
        mine = [all(row.get(key) == keys[key] for key in keys) for row in kept]
        at = mine.index(True) if True in mine else len(kept)
        others = [row for row, old in zip(kept, mine, strict=True) if not old]
        return others[:at] + new + others[at:]


def create_run(out: Path, experiment: str, schema: Schema, meta: dict[str, Any]) -> RunWriter:
    """Return a writer for a new folder ``<date>-<time>-<experiment>`` in `out`.

    Raises
    ------
    ArgumentError
        `out` cannot be made, or not be written to.
    """
    stamp = datetime.datetime.now().strftime("%Y%m%d-%H%M%S")
    try:
        out.mkdir(parents=True, exist_ok=True)
        folder = _unique(out, f"{stamp}-{experiment}")
        about = {"experiment": experiment, "started": timestamp(), **meta}
        writer = RunWriter(folder, schema, about)
        writer.flush()
        files.sync_folder(out)
    except (OSError, ValueError, ReportsError) as error:
        said = files.reason(error)
        raise ArgumentError("out", "a directory that can be written to", said) from error
    return writer


def load_run(
    run: str | Path, out: Path = Path("reports"), *, schema_of: Callable[[str], Schema]
) -> RunData:
    """Return the run in a folder, given as a path or as an id inside `out`.

    Parameters
    ----------
    run : str or Path
    out : Path
    schema_of : callable
        Returns the schema of a kind by its name.

    Raises
    ------
    UnknownNameError
        No such folder; with the nearest run in `out`.
    ReportsError
        A folder without a finished cell, damaged, or of another schema version.
    """
    folder = _folder(run, out)
    files.sweep(folder, FILES)
    try:
        meta = json.loads((folder / "run.json").read_text(encoding="utf-8"))
        _check_version(folder, meta)
        measured = [cell for cell in meta["cells"] if cell.get("state") == "measured"]
        if not measured:
            raise ReportsError(f"{folder}: no cell was finished, there is nothing to report")
        schema = schema_of(str(meta.get("kind", "paper")))
        _check_meta(meta, schema)
        for cell in measured:
            schema.check_row("cell", cell, closed=False)
        frames = {table: _read(folder / f"{table}.parquet") for table in TABLES}
        frames = {table: _whole(frames[table], table, schema, measured) for table in TABLES}
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        said = f"{type(error).__name__}: {files.reason(error)}"
        raise ReportsError(f"{folder}: not a readable run ({said})") from error
    except (SchemaError, UnknownNameError) as error:
        raise ReportsError(f"{folder}: not a readable run ({error})") from error
    return RunData(folder, meta, **frames)


def run_names(out: Path) -> list[str]:
    """Return the ids of the runs in a directory, oldest first."""
    return sorted(path.parent.name for path in out.glob("*/run.json"))


def timestamp() -> str:
    """Return now, in local time with its offset."""
    return datetime.datetime.now().astimezone().isoformat(timespec="seconds")


def _folder(run: str | Path, out: Path) -> Path:
    for folder in (Path(run), out / str(run)):
        with contextlib.suppress(OSError, ValueError):  # a name that cannot be one
            if (folder / "run.json").is_file():
                return folder
    raise UnknownNameError("run", str(run), run_names(out))


def _check_version(folder: Path, meta: Any) -> None:
    if not isinstance(meta, dict) or "schema_version" not in meta:
        raise ValueError("run.json is no object with a 'schema_version'")
    if meta["schema_version"] != SCHEMA_VERSION:
        raise ReportsError(
            f"{folder}: written with schema version {meta['schema_version']}, this program reads "
            f"{SCHEMA_VERSION}; render it with the version that wrote it"
        )
    if not isinstance(meta.get("cells"), list):
        raise ValueError("run.json has no list of 'cells'")


def _check_meta(meta: dict[str, Any], schema: Schema) -> None:
    """Raise unless ``run.json`` says what reports tell of a run."""
    for of, known in ((meta, META), (meta.get("environment"), ENVIRONMENT)):
        if not isinstance(of, dict):
            raise ValueError("run.json has no object 'environment'")
        for key, kind in known.items():
            if not isinstance(of.get(key), kind):
                raise ValueError(f"run.json: {key!r} is to be {kind.__name__}, not {of.get(key)!r}")
    if not isinstance(meta["spec"].get("title"), str):
        raise ValueError("run.json: 'spec' has no 'title'")
    schema.check_row("meta", meta, closed=False)


def _read(path: Path) -> pd.DataFrame:
    return pd.read_parquet(path) if path.is_file() else pd.DataFrame()


def _whole(frame: pd.DataFrame, table: str, schema: Schema, measured: Rows) -> pd.DataFrame:
    """Return the rows of the measured cells, all of which have some.

    Raises
    ------
    SchemaError
        Columns that are not those of the kind.
    ValueError
        Results of a cell are missing.
    """
    if not schema.tables[table]:
        return pd.DataFrame()
    if frame.empty and table != "results":
        return pd.DataFrame(columns=list(schema.tables[table]))
    schema.check_frame(table, frame)
    names = list(schema.key_names)
    listed = {tuple(cell[name] for name in names) for cell in measured}
    found = list(zip(*(frame[name].tolist() for name in names), strict=True))
    if table == "results" and not listed <= set(found):
        lost = ", ".join(str(part) for part in min(listed - set(found), key=str))
        raise ValueError(f"results.parquet holds nothing of the cell {lost}")
    kept = [key in listed for key in found]
    return frame if all(kept) else frame[kept].reset_index(drop=True)


def _unique(out: Path, name: str) -> Path:
    for number in range(1, 1000):
        folder = out / (name if number == 1 else f"{name}-{number}")
        with contextlib.suppress(FileExistsError):
            folder.mkdir()
            return folder
    raise ReportsError(f"{out}: a thousand runs named {name}")


def _writer(text: str) -> Callable[[Any], Any]:
    content = text.encode()
    return lambda file: file.write(content)


def _plain(value: Any) -> Any:
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, Path):
        return str(value)
    raise TypeError(f"not for JSON: {type(value).__name__}")
