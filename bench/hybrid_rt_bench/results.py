"""The folder of a run: what is in it, how it is written, how it is read again.

::

    reports/<run-id>/
      run.json          schema version, environment, experiment and its kind, every cell with what
                        became of it
      samples.parquet   every raw sample, warm-up rounds too, of what is timed
      results.parquet   one row a cell and technique: medians, intervals, alpha, errors (also .csv)
      verdicts.parquet  counts of rays by status and verdict, where the kind has them
      pictures/*.npz    the pixels of the figures
      tables.md, figures/*.png   rendered from the files above, at any time

Everything is rewritten after every cell, to a temporary file that then takes the name of the old
one: an interruption at any moment leaves the last whole state.
"""

from __future__ import annotations

import contextlib
import datetime
import json
import os
import signal
import tempfile
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from hybrid_rt.errors import ArgumentError, HybridRTError, UnknownNameError

SCHEMA_VERSION = 1

STAGES: dict[str, str] = {
    "raster": "raster",
    "pyramid": "depth pyramid",
    "rays": "mirror rays",
    "embree_primary": "Embree, primary rays",
    "embree": "Embree, mirror rays",
    "march": "march",
    "compaction": "compaction",
    "fallback": "fallback",
    "merge": "merge",
}
"""Every timed stage in the order of the pipeline, and what reports call it."""

HYBRID_STAGES = ("march", "compaction", "fallback", "merge")
"""The stages whose sum is the time of the hybrid."""

PEER_TIMES = (
    "ms", "ms_low", "ms_high", "cores", "ratio", "ratio_low", "ratio_high",
)  # fmt: skip
"""Columns for the timings of a peer; NaN where it was not timed."""

PIXEL_CLASSES = {"background": 0, "right": 1, "unresolved": 2, "wrong": 3}
"""What the pixels of a stored picture say."""

MAP_CLASSES = {
    "background": 0,
    "right": 1,
    "unresolved": 2,
    "false_hit": 3,
    "false_miss": 4,
    "wrong_primitive": 5,
}
"""What the pixels of an error map say."""

CELL_KEYS = ("scene", "camera", "width", "height")
"""What tells the cells of a run apart, unless its kind has keys of its own."""


Rows = list[dict[str, Any]]


class ReportsError(HybridRTError):
    """The folder of a run cannot be made, written or read."""


@dataclass(frozen=True)
class RunData:
    """What a run's folder holds.

    Attributes
    ----------
    folder : Path
    meta : dict
        ``run.json``.
    samples, results, verdicts : DataFrame
        Empty where the run's kind has none.
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
    """Write a run, cell by cell; `keys` tell its cells apart."""

    def __init__(
        self, folder: Path, meta: dict[str, Any], keys: tuple[str, ...] = CELL_KEYS
    ) -> None:
        self.folder, self.keys = folder, keys
        self.meta: dict[str, Any] = {
            "schema_version": SCHEMA_VERSION,
            "id": folder.name,
            "finished": False,
            "interrupted": False,
            **meta,
            "cells": [],
        }
        self._samples: list[dict[str, Any]] = []
        self._results: list[dict[str, Any]] = []
        self._verdicts: list[dict[str, Any]] = []

    def add_cell(
        self,
        cell: dict[str, Any],
        samples: list[dict[str, Any]],
        results: list[dict[str, Any]],
        verdicts: list[dict[str, Any]],
        picture: dict[str, Any] | None = None,
    ) -> None:
        """Keep a finished cell and write everything so far.

        Parameters
        ----------
        cell : dict
            The run's keys and whatever else is to be known of the cell.
        samples, results, verdicts : list of dict
            Rows; the cell's keys are added here.
        picture : dict of array, optional
            Pixels for the figure of the cell.
        """
        keys = {key: cell[key] for key in self.keys}
        with _uninterrupted():
            if picture is not None:
                name = f"pictures/{cell['scene']}-{cell['camera']}.npz"
                with _disk_errors(self.folder / name):
                    (self.folder / "pictures").mkdir(exist_ok=True)
                write_atomic(self.folder / name, lambda f: np.savez_compressed(f, **picture))
                cell = {**cell, "picture": name}
            self._samples += [{**keys, **row} for row in samples]
            self._results += [{**keys, **row} for row in results]
            self._verdicts += [{**keys, **row} for row in verdicts]
            self.meta["cells"].append({**cell, "state": "measured"})
            self.flush()

    def renew_cell(
        self, cell: dict[str, Any], samples: list[dict[str, Any]], results: list[dict[str, Any]]
    ) -> None:
        """Keep a cell of which more has been measured, in place of what was kept of it before.

        Rows stay where the cell's first ones were.
        """

        def renewed(kept: Rows, new: Rows) -> Rows:
            mine = [all(row[key] == cell[key] for key in self.keys) for row in kept]
            at = mine.index(True) if True in mine else len(kept)
            others = [row for row, old in zip(kept, mine, strict=True) if not old]
            return others[:at] + new + others[at:]

        keys = {key: cell[key] for key in self.keys}
        with _uninterrupted():
            self._samples = renewed(self._samples, [{**keys, **row} for row in samples])
            self._results = renewed(self._results, [{**keys, **row} for row in results])
            self.meta["cells"] = renewed(self.meta["cells"], [{**cell, "state": "measured"}])
            self.flush()

    def fail_cell(self, cell: dict[str, Any], error: str) -> None:
        """Keep that a cell failed, and why."""
        with _uninterrupted():
            self.meta["cells"].append({**cell, "state": "failed", "error": error})
            self.flush()

    def finish(self, *, interrupted: bool = False) -> None:
        """Write the last state of the run."""
        self.meta["finished"] = not interrupted
        self.meta["interrupted"] = interrupted
        self.meta["ended"] = timestamp()
        with _uninterrupted():
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
        """Write all files of the run."""
        for name, rows in (
            ("samples", self._samples),
            ("results", self._results),
            ("verdicts", self._verdicts),
        ):
            if rows:
                frame = pd.DataFrame(rows)
                write_atomic(self.folder / f"{name}.parquet", frame.to_parquet)
                if name == "results":
                    write_bytes(self.folder / "results.csv", frame.to_csv(index=False).encode())
        text = json.dumps(self.meta, indent=1, allow_nan=False, default=_plain)
        write_bytes(self.folder / "run.json", text.encode())


def create_run(
    out: Path, experiment: str, meta: dict[str, Any], keys: tuple[str, ...] = CELL_KEYS
) -> RunWriter:
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
        writer = RunWriter(folder, {"experiment": experiment, "started": timestamp(), **meta}, keys)
        writer.flush()
    except (OSError, ReportsError) as error:
        raise ArgumentError("out", "a directory that can be written to", _reason(error)) from error
    return writer


def load_run(run: str | Path, out: Path = Path("reports")) -> RunData:
    """Return the run in a folder, given as a path or as an id inside `out`.

    Raises
    ------
    UnknownNameError
        No such folder; with the nearest run in `out`.
    ReportsError
        A folder without a finished cell, damaged, or of another schema version.
    """
    folder = Path(run)
    if not (folder / "run.json").is_file():
        folder = out / str(run)
    if not (folder / "run.json").is_file():
        raise UnknownNameError("run", str(run), run_names(out))
    try:
        meta = json.loads((folder / "run.json").read_text(encoding="utf-8"))
        version = meta["schema_version"]
        if version != SCHEMA_VERSION:
            raise ReportsError(
                f"{folder}: written with schema version {version}, this program reads "
                f"{SCHEMA_VERSION}; render it with the version that wrote it"
            )
        if not (folder / "results.parquet").is_file():
            raise ReportsError(f"{folder}: no cell was finished, there is nothing to report")
        paths = [folder / f"{name}.parquet" for name in ("samples", "results", "verdicts")]
        frames = [pd.read_parquet(p) if p.is_file() else pd.DataFrame() for p in paths]
    except (OSError, ValueError, KeyError) as error:
        raise ReportsError(f"{folder}: not a readable run ({_reason(error)})") from error
    return RunData(folder, meta, *frames)


def run_names(out: Path) -> list[str]:
    """Return the ids of the runs in a directory, oldest first."""
    return sorted(path.parent.name for path in out.glob("*/run.json"))


def timestamp() -> str:
    """Return now, in local time with its offset."""
    return datetime.datetime.now().astimezone().isoformat(timespec="seconds")


def write_atomic(path: Path, write: Callable[[Any], Any]) -> None:
    """Let `write` fill a binary file that then takes the place of `path`.

    Raises
    ------
    ReportsError
        The disk is full, or the folder cannot be written to.
    """
    with _disk_errors(path):
        handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
        try:
            with os.fdopen(handle, "wb") as file:
                write(file)
            os.chmod(temporary, 0o644)
            os.replace(temporary, path)
        except BaseException:
            with contextlib.suppress(OSError):
                os.unlink(temporary)
            raise


def write_bytes(path: Path, content: bytes) -> None:
    """Write `content` as `write_atomic` does."""
    write_atomic(path, lambda file: file.write(content))


@contextlib.contextmanager
def _uninterrupted() -> Iterator[None]:
    """Hold back Ctrl-C until what is inside is whole."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    came: list[int] = []
    before = signal.signal(signal.SIGINT, lambda number, _: came.append(number))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
    if came:
        raise KeyboardInterrupt


@contextlib.contextmanager
def _disk_errors(path: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise ReportsError(f"{path}: cannot be written ({_reason(error)})") from error


def _unique(out: Path, name: str) -> Path:
    for number in range(1, 1000):
        folder = out / (name if number == 1 else f"{name}-{number}")
        with contextlib.suppress(FileExistsError):
            folder.mkdir()
            return folder
    raise ReportsError(f"{out}: a thousand runs named {name}")


def _reason(error: BaseException) -> str:
    if isinstance(error, OSError) and error.strerror:
        return f"{error.strerror}: {error.filename}" if error.filename else error.strerror
    return str(error)


def _plain(value: Any) -> Any:
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, Path):
        return str(value)
    raise TypeError(f"not for JSON: {type(value).__name__}")
