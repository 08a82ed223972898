"""What the columns of results mean: one place for what every kind's rows hold.

A kind has a `Schema` in its own folder, made of the columns here and of its own. Rows are held
against it when they are added to a run, and the files of a run when they are read again.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

from hybrid_rt.errors import HybridRTError

if TYPE_CHECKING:
    import pandas as pd

Better = Literal["lower", "higher", ""]


class SchemaError(HybridRTError):
    """A row or a table that is not what its kind says."""


@dataclass(frozen=True)
class Column:
    """One column of results.

    Attributes
    ----------
    name : str
    meaning : str
        A plain sentence, without its full stop.
    unit : str
        Empty for a name, a count or a share.
    better : {"lower", "higher", ""}
        In which direction a change is an improvement.
    type : type
        float, int, bool, str, or dict and list in cells. A float may be NaN where it does not
        apply.
    optional : bool
        Whether rows may go without it.
    """

    name: str
    meaning: str
    unit: str = ""
    better: Better = ""
    type: type = float
    optional: bool = False

    def fits(self, value: Any) -> bool:
        """Tell whether a value may stand in this column."""
        if self.type is bool:
            return isinstance(value, bool) or type(value).__name__ == "bool"
        if isinstance(value, bool):
            return False
        if self.type is float:
            return _is_number(value)
        if self.type is int:
            return _is_number(value) and math.isfinite(value) and value == int(value)
        return isinstance(value, self.type)

    def fits_dtype(self, dtype: Any) -> bool:
        """Tell whether a column of a frame with this dtype can be this one."""
        kinds = {float: "fiu", int: "iu", bool: "b"}.get(self.type)
        return dtype.kind in kinds if kinds else dtype.kind in "OUT" or dtype.name in ("str",)


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) or (hasattr(value, "dtype") and value.dtype.kind in "fiu")


def count(name: str, meaning: str, **more: Any) -> Column:
    """Return a column of whole numbers."""
    return Column(name, meaning, type=int, **more)


def text(name: str, meaning: str, **more: Any) -> Column:
    """Return a column of text."""
    return Column(name, meaning, type=str, **more)


def flag(name: str, meaning: str, **more: Any) -> Column:
    """Return a column of yes and no."""
    return Column(name, meaning, type=bool, **more)


def estimate(name: str, meaning: str, unit: str = "", better: Better = "") -> list[Column]:
    """Return the columns of a value with its interval."""
    return [
        Column(name, meaning, unit, better),
        Column(f"{name}_low", f"Lower end of the interval of {name}", unit),
        Column(f"{name}_high", f"Upper end of the interval of {name}", unit),
    ]


def rate(name: str, meaning: str, better: Better = "lower") -> list[Column]:
    """Return the columns of a share of rays: its count, its value and its interval."""
    return [
        count(f"{name}_count", f"Number of rays: {meaning}", better=better),
        Column(f"{name}_rate", f"Share of rays: {meaning}", better=better),
        Column(f"{name}_low", f"Lower end of the 95 % interval of {name}_rate"),
        Column(f"{name}_high", f"Upper end of the 95 % interval of {name}_rate"),
    ]


VIEW = (
    text("scene", "Name of the scene, with its size where one was asked for"),
    text("camera", "Name of the camera"),
    count("width", "Width of the picture", unit="pixels"),
    count("height", "Height of the picture", unit="pixels"),
)
"""The keys of a cell that is one view."""

HYBRID_STAGES = ("march", "compaction", "fallback", "merge")
"""The stages whose sum is the time of the hybrid."""


@dataclass(frozen=True)
class Schema:
    """The columns of a kind's files.

    Attributes
    ----------
    keys : tuple of Column
        What tells cells apart; first in every row.
    results : tuple of Column
        Of ``results.parquet``: a row a cell and technique, or as the kind has it.
    samples : tuple of Column
        Of ``samples.parquet``: every raw sample. None for a kind without times.
    verdicts : tuple of Column
        Of ``verdicts.parquet``.
    cell : tuple of Column
        What ``run.json`` says of a measured cell besides its keys.
    meta : tuple of Column
        What ``run.json`` says of the run besides what all runs say.
    """

    keys: tuple[Column, ...]
    results: tuple[Column, ...]
    samples: tuple[Column, ...] = ()
    verdicts: tuple[Column, ...] = ()
    cell: tuple[Column, ...] = ()
    meta: tuple[Column, ...] = ()
    tables: Mapping[str, dict[str, Column]] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        tables = {}
        for name in ("samples", "results", "verdicts", "cell"):
            columns = getattr(self, name)
            every = (*self.keys, *columns) if columns or name == "cell" else ()
            tables[name] = {column.name: column for column in every}
            if len(tables[name]) != len(every):
                raise SchemaError(f"{name}: two columns of one name")
        tables["meta"] = {column.name: column for column in self.meta}
        object.__setattr__(self, "tables", tables)

    @property
    def key_names(self) -> tuple[str, ...]:
        """The names of `keys`."""
        return tuple(column.name for column in self.keys)

    def check_row(self, table: str, row: Mapping[str, Any], *, closed: bool = True) -> None:
        """Raise unless a row has the columns of a table, with values that fit.

        Raises
        ------
        SchemaError
            A column that is missing, or unknown (where the row is `closed`), or of another type.
        """
        known = self.tables[table]
        for name, column in known.items():
            if name not in row:
                if not column.optional:
                    raise SchemaError(f"{table}: no column {name!r} ({column.meaning})")
            elif not column.fits(row[name]):
                raise SchemaError(
                    f"{table}: {name!r} is to be {column.type.__name__}, not {row[name]!r}"
                )
        if closed:
            _no_others(table, row, known)

    def check_frame(self, table: str, frame: pd.DataFrame) -> None:
        """Raise unless a frame read from a file has the columns of a table.

        Raises
        ------
        SchemaError
            As `check_row`.
        """
        known = self.tables[table]
        for name, column in known.items():
            if name not in frame:
                if not column.optional:
                    raise SchemaError(f"{table}: no column {name!r} ({column.meaning})")
            elif len(frame) and not column.fits_dtype(frame[name].dtype):
                raise SchemaError(
                    f"{table}: {name!r} is to be {column.type.__name__}, not {frame[name].dtype}"
                )
        _no_others(table, frame.columns, known)


def _no_others(table: str, names: Iterable[Any], known: Mapping[str, Column]) -> None:
    unknown = [str(name) for name in names if name not in known]
    if unknown:
        raise SchemaError(f"{table}: unknown column {unknown[0]!r}; the kind's schema has none")
