"""Say on stderr how far a run is: a bar on a terminal, a line a cell elsewhere."""

from __future__ import annotations

from types import TracebackType

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn


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
            TextColumn("{task.description}"),
            BarColumn(),
            MofNCompleteColumn(),
            TextColumn("{task.fields[unit]}"),
            TimeRemainingColumn(),
            console=console,
            transient=True,
            disable=not console.is_terminal,
        )
        self._task = self._bar.add_task("starting", total=None, unit="rounds")

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

    def total(self, amount: float, unit: str = "rounds") -> None:
        """Set the length of the bar."""
        self._bar.update(self._task, total=amount, unit=unit)

    def doing(self, what: str) -> None:
        """Say what is going on."""
        self._bar.update(self._task, description=what)

    def advance(self, amount: float = 1) -> None:
        """Count what is finished."""
        self._bar.advance(self._task, amount)

    def say(self, text: str, style: str = "") -> None:
        """Print a line that stays."""
        self.console.print(text, style=style or None, highlight=False, markup=False, soft_wrap=True)
