"""The application: its commands, and what becomes of errors."""

from __future__ import annotations

import sys

import typer

from hybrid_rt.errors import HybridRTError
from hybrid_rt_bench.cli import compare, importing, info, listing, render, report, run, terminal

app = typer.Typer(
    name="hybrid-rt",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode="markdown",
    pretty_exceptions_enable=False,
    help="""Measure screen-space ray marching in front of an exact tracer.

Every mirror ray of a view is marched through the depth buffer first; what the screen cannot answer
is traced with Embree. This program measures what that saves against tracing every ray with the
strongest Embree, and what it gets wrong.

Begin with `hybrid-rt run paper --quick`, then `hybrid-rt list`.""",
    epilog="""Exit codes: 0 all well, 1 something changed (`compare --fail-on-change`), 2 wrong
usage, 3 some cells failed, nothing could be run, a promise is broken or a file cannot be written or
read, 130 stopped by Ctrl-C. What was finished is always kept.""",
)
run.add_to(app)
app.command()(report.report)
app.command(cls=compare.ManyRuns)(compare.compare)
app.command("list")(listing.list_all)
app.command("import")(importing.import_mesh)
app.command()(info.info)
app.command()(render.render)


def run_app() -> None:
    """Run the command line and end the program with its exit code."""
    with terminal.guarded():
        code = terminal.end_code(_code())
    sys.exit(code)


def _code() -> int:
    """Return the exit code of the command that the command line names."""
    try:
        app(prog_name="hybrid-rt")
    except HybridRTError as error:
        terminal.complain(error)
        return terminal.FAILED if _no_usage(error) else terminal.USAGE
    except (KeyboardInterrupt, EOFError):
        terminal.err().print("stopped", style="yellow")
        return terminal.stop_code()
    except MemoryError as error:
        terminal.complain(f"not enough memory ({error})" if str(error) else "not enough memory")
        return terminal.FAILED
    except SystemExit as end:
        if terminal.signals.came is not None:  # the application makes 130 of any signal
            return terminal.stop_code()
        return end.code if isinstance(end.code, int) else 0
    return 0


def _no_usage(error: HybridRTError) -> bool:
    """Tell whether an error is no mistake in the command line."""
    from hybrid_rt_bench.measure.errors import NothingToRunError
    from hybrid_rt_bench.results.files import ReportsError
    from hybrid_rt_scenes import MissingDataError

    return isinstance(error, NothingToRunError | MissingDataError | ReportsError)
