"""Kinds of experiments, each in a folder of its own that registers itself here.

The rest of the program asks this registry and names no kind. A kind comes from a folder of
`hybrid_rt_bench.kinds`, from an entry point of the group ``hybrid_rt.experiments``, or from
`register` in a script.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hybrid_rt.errors import ArgumentError
from hybrid_rt.registry import Registry
from hybrid_rt_bench.options import Option

if TYPE_CHECKING:
    from hybrid_rt_bench.measure.experiment import AnyExperiment
    from hybrid_rt_bench.measure.lifecycle import Outcome
    from hybrid_rt_bench.report.table import Table
    from hybrid_rt_bench.results.compared import Compared
    from hybrid_rt_bench.results.folder import RunData
    from hybrid_rt_bench.results.schema import Schema


@dataclass(frozen=True)
class Kind:
    """A kind of experiment.

    Everything but plain data may be given as text, ``".module:name"`` of a module in `package` or
    ``"module:name"`` of another; it is then imported when it is first needed, so that a list of
    kinds costs nothing.

    Attributes
    ----------
    name : str
        What ``kind`` says in its TOML files.
    package : str
        The package whose TOML files are experiments.
    spec : type
        A class of `AnyExperiment`.
    run : callable
        Takes the experiment and, by name, `reporter`, `threads`, `out`, `command` and those of its
        options that do not change the experiment; returns an `Outcome`.
    schema : Schema
        The columns of its results.
    tables : callable
        Returns the tables of a run, in the order of reading.
    verdict : callable
        Returns what a reader of the run takes home: sentences of one paragraph, with the numbers
        and their intervals. It takes any run that has a measured cell.
    figures : sequence of callable
        Each writes pictures of a run into a folder and returns their paths.
    options : sequence of Option
    compare : Compared, optional
        Which of its columns are counted, timed and the baseline, so that its runs can be compared.
    listing : callable, optional
        Returns tables for ``hybrid-rt list``.
    frames : str
        The experiment that takes the place of its own where ``--depth`` names a frame; empty for a
        kind that has no such.
    """

    name: str
    package: str
    spec: Any
    run: Any
    schema: Any
    tables: Any
    verdict: Any
    figures: Sequence[Any] = ()
    options: Sequence[Option] = ()
    compare: Any = None
    listing: Any = None
    frames: str = ""

    def spec_class(self) -> type[AnyExperiment]:
        """Return the class of its experiments."""
        found: type[AnyExperiment] = self._found(self.spec)
        return found

    def runner(self) -> Callable[..., Outcome]:
        """Return what measures an experiment."""
        found: Callable[..., Outcome] = self._found(self.run)
        return found

    def columns(self) -> Schema:
        """Return the columns of its results."""
        found: Schema = self._found(self.schema)
        return found

    def table_maker(self) -> Callable[[RunData], list[Table]]:
        """Return what makes the tables."""
        found: Callable[[RunData], list[Table]] = self._found(self.tables)
        return found

    def verdict_maker(self) -> Callable[[RunData], str]:
        """Return what says what a run comes to."""
        found: Callable[[RunData], str] = self._found(self.verdict)
        return found

    def figure_makers(self) -> list[Callable[[RunData, Path], list[Path]]]:
        """Return what makes the figures."""
        return [self._found(figure) for figure in self.figures]

    def compared(self) -> Compared | None:
        """Return what of its results is compared between runs."""
        found: Compared | None = self._found(self.compare)
        return found

    def listed(self) -> list[Table]:
        """Return what ``hybrid-rt list`` shows of it."""
        listing = self._found(self.listing)
        return [] if listing is None else listing()

    def experiments(self) -> dict[str, Traversable]:
        """Return the TOML files that come with it, by the name of the experiment."""
        files = (file for file in resources.files(self.package).iterdir())
        return {f.name[:-5]: f for f in files if f.name.endswith(".toml")}

    def _found(self, part: Any) -> Any:
        if not isinstance(part, str):
            return part
        module, _, name = part.partition(":")
        return getattr(importlib.import_module(module, self.package), name)


class _Kinds(Registry[Kind]):
    def check(self, thing: Any) -> None:
        if not isinstance(thing, Kind):
            raise ArgumentError("kind", "a Kind", repr(thing))


kinds: Registry[Kind] = _Kinds("kind", "hybrid_rt.experiments", "hybrid_rt_bench.kinds")
"""Every kind of experiment."""

register = kinds.register
