"""Say on stderr how far a run is: a bar on a terminal, a line a cell elsewhere."""

from __future__ import annotations

import time
from types import TracebackType
from typing import TYPE_CHECKING

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

if TYPE_CHECKING:
    from hybrid_rt.compiling import Compiling

QUIET = 2.0
"""Seconds between two lines about compilation, at least."""


class Reporter:
    """Progress of a run on a console.

    Parameters
    ----------
    console : Console
        Of stderr.
    """

    def __init__(self, console: Console) -> None:
        self.console = console
        self._bar = Progress(
            TextColumn("{task.description}", markup=False),
            BarColumn(),
            MofNCompleteColumn(),
            TextColumn("{task.fields[unit]}", markup=False),
            TimeRemainingColumn(),
            console=console,
            transient=True,
            disable=not console.is_terminal,
        )
        self._task = self._bar.add_task("starting", total=None, unit="rounds")
        self._compiling, self._said = 0.0, 0.0
        self._told: set[str] = set()

    def __enter__(self) -> Reporter:
        self._bar.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        value: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._bar.stop()

    def begin(self, what: str) -> None:
        """Say what is going on before anything can be counted, off a terminal too."""
        self.doing(what)
        if not self.console.is_terminal:
            self.say(what)

    def total(self, amount: float, unit: str = "rounds") -> None:
        """Set the length of the bar."""
        self._bar.update(self._task, total=amount, completed=0, unit=unit)

    def doing(self, what: str) -> None:
        """Say what is going on."""
        self._bar.update(self._task, description=what)

    def advance(self, amount: float = 1) -> None:
        """Count what is finished."""
        self._bar.advance(self._task, amount)

    def counted(self, amount: float) -> Share:
        """Return a share of the bar that is counted one by one."""
        return Share(self, amount)

    def stage(self, name: str, index: int, total: int) -> None:
        """Say that stage `index` of `total` begins to be compiled, and about how much is left.

        Off a terminal the first one is told, and others where the last line was a while ago.
        """
        now = time.monotonic()
        if index == 1:
            self._compiling = now
        left = ""
        if index > 1 and now - self._compiling > QUIET:
            seconds = (now - self._compiling) / (index - 1) * (total - index + 1)
            left = f", about {seconds:.0f} s left"
        text = f"compiling, or loading what was compiled: {index} of {total}, {name}{left}"
        self._bar.update(
            self._task, description=text, total=total, completed=index - 1, unit="stages"
        )
        if not self.console.is_terminal and (index == 1 or now - self._said > QUIET):
            self.say(text)
            self._said = now

    def kernel(self, now: Compiling) -> None:
        """Say which part of the library is compiled just now, as `hybrid_rt.compiling` tells it.

        Off a terminal each part is told once.
        """
        text = (
            f"compiling {now.stage}: {now.done} of {now.total} functions done, about "
            f"{now.seconds_left:.0f} s left of it, once on this machine"
        )
        self.doing(text)
        if not self.console.is_terminal and now.stage not in self._told:
            self._told.add(now.stage)
            self.say(text)
            self._said = time.monotonic()

    def say(self, text: str, style: str = "") -> None:
        """Print a line that stays."""
        self.console.print(text, style=style or None, highlight=False, markup=False, soft_wrap=True)


class Share:
    """A part of a bar, whatever becomes of what it stands for."""

    def __init__(self, reporter: Reporter, amount: float) -> None:
        self._reporter, self._left = reporter, amount

    def one(self, amount: float = 1) -> None:
        """Count some of it as finished."""
        self._left -= amount
        self._reporter.advance(amount)

    def rest(self) -> None:
        """Count all that is left of it as finished."""
        self.one(self._left)
