"""Streams that end, encodings that lack signs, signals: the program goes on, or ends in order."""

import io
import json
import os
import signal
import subprocess
import sys
import time

import pytest

from hybrid_rt_bench import cli
from hybrid_rt_bench.cli import terminal
from support import PYTHONPATH, ROOT

POSIX = pytest.mark.skipif(os.name != "posix", reason="shells and signals of POSIX")
RUN = [
    "run",
    "paper",
    "--threads",
    "1",
    "--scenes",
    "sphere",
    "--cameras",
    "front",
    "--resolutions",
    "96x54",
    "--rounds",
    "1",
]


def environment(**more):
    return {**os.environ, "PYTHONPATH": PYTHONPATH, "COLUMNS": "100", **more}


def shell(line, **more):
    """Return what became of a command line in a shell; ``$RT`` is the program."""
    program = f"{sys.executable} -m hybrid_rt_bench"
    return subprocess.run(
        ["bash", "-c", line], capture_output=True, text=True, timeout=300, cwd=ROOT, check=False,
        env=environment(RT=program, **more),
    )  # fmt: skip


@POSIX
@pytest.mark.parametrize("words", ["list", "run --help"])
def test_a_reader_that_leaves_ends_it_without_a_word(words):
    done = shell(f"$RT {words} | head -1; exit ${{PIPESTATUS[0]}}")
    assert done.returncode in (0, 128 + signal.SIGPIPE)
    assert done.stderr == ""


@POSIX
def test_a_full_disk_behind_stdout_is_told():
    done = shell("$RT list > /dev/full")
    assert done.returncode == terminal.FAILED
    assert "stdout cannot be written to (No space left on device)" in done.stderr
    assert "Traceback" not in done.stderr


@POSIX
@pytest.mark.slow
@pytest.mark.parametrize("closed", [">&-", "2>&-", ">&- 2>&-", "<&- >&- 2>&-"])
def test_streams_that_are_closed_are_no_harm(closed, tmp_path):
    done = shell(f"$RT {' '.join(RUN)} --out {tmp_path} {closed}")
    assert done.returncode == 0, done.stderr
    assert "Traceback" not in done.stderr
    (meta,) = tmp_path.glob("*/run.json")
    assert json.loads(meta.read_text())["finished"]
    assert (meta.parent / "tables.md").exists()


@POSIX
@pytest.mark.slow
def test_a_run_whose_output_goes_nowhere_keeps_its_results(tmp_path):
    done = shell(f"$RT {' '.join(RUN)} --out {tmp_path} > /dev/full 2>/dev/full")
    assert done.returncode == terminal.FAILED
    (meta,) = tmp_path.glob("*/run.json")
    assert json.loads(meta.read_text())["finished"]
    assert (meta.parent / "tables.md").exists()


@POSIX
@pytest.mark.slow
def test_ascii_is_enough_and_brackets_are_brackets(tmp_path):
    out = tmp_path / "x[" / "red]y"
    done = shell(f"$RT {' '.join(RUN)} --out '{out}'", PYTHONIOENCODING="ascii", LC_ALL="C")
    assert done.returncode == 0, done.stderr
    assert "Table 1." in done.stdout
    assert "x[/red]y" in done.stdout.replace("\n", "")
    assert done.stdout.isascii()
    listed = shell("$RT list", PYTHONIOENCODING="ascii")
    assert listed.returncode == 0
    refused = shell(
        "$RT run '[/red]'; $RT report '[/red]'; $RT '[/red]'; $RT render '[/b]' -o x.png"
    )
    assert "Traceback" not in refused.stderr
    assert refused.stderr.count("[/red]") >= 3


@pytest.mark.parametrize(
    ("columns", "width"),
    [("60", 60), ("300", 300), (" 80 ", 80), ("", 160), ("0", 160), ("-5", 160), ("wide", 160),
     ("9" * 40, 160), ("²³", 160), (None, 160)],
)  # fmt: skip
def test_the_width_that_is_asked_for_is_kept_where_there_is_no_terminal(
    monkeypatch, columns, width
):
    monkeypatch.delenv("COLUMNS", raising=False)
    if columns is not None:
        monkeypatch.setenv("COLUMNS", columns)
    monkeypatch.setattr(sys, "stdout", io.StringIO())
    assert terminal.out().width == width


@POSIX
@pytest.mark.parametrize("columns", [70, 110])
def test_a_list_that_goes_into_a_file_is_as_wide_as_columns_says(columns):
    done = shell("$RT list", COLUMNS=str(columns))
    boxes = [line for line in done.stdout.splitlines() if line.startswith(("┏", "│", "└"))]
    assert boxes
    assert max(map(len, boxes)) <= columns


def test_signs_that_an_encoding_lacks_have_plain_ones(tmp_path):
    path = tmp_path / "x"
    with path.open("w", encoding="ascii") as file:
        import codecs

        codecs.register_error("hybrid-rt", terminal._plain)
        file.reconfigure(errors="hybrid-rt")
        print("– 2×3 µs ☃", file=file)
    assert path.read_text() == "- 2x3 us ?\n"


def started(*arguments, **more):
    return subprocess.Popen(
        [sys.executable, "-m", "hybrid_rt_bench", *map(str, arguments)], cwd=ROOT, text=True,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=environment(), **more,
    )  # fmt: skip


@POSIX
@pytest.mark.slow
@pytest.mark.parametrize(("number", "code"), [(signal.SIGTERM, 143), (signal.SIGINT, 130)])
def test_a_signal_keeps_what_is_finished(tmp_path, number, code):
    process = started(
        "run", "paper", "--threads", "1", "--scenes", "sphere", "--cameras", "front,low",
        "--resolutions", "96x54,1280x720", "--rounds", 60, "--out", tmp_path,
    )  # fmt: skip
    for line in process.stderr:
        if line.startswith("sphere, front, 96x54"):
            break
    time.sleep(0.3)
    process.send_signal(number)
    _, rest = process.communicate(timeout=120)
    assert process.returncode == code, rest
    assert "stopped: 1 finished cell" in rest
    assert "Traceback" not in rest
    (meta,) = tmp_path.glob("*/run.json")
    assert json.loads(meta.read_text())["interrupted"]
    assert "not finished" in (meta.parent / "tables.md").read_text()


@POSIX
@pytest.mark.parametrize("delay", [0.05, 0.12, 0.2, 0.4, 0.8, 1.4])
def test_ctrl_c_while_it_starts_is_no_traceback(tmp_path, delay):
    process = started("run", "paper", "--quick", "--out", tmp_path)
    time.sleep(delay)
    process.send_signal(signal.SIGINT)
    _, rest = process.communicate(timeout=60)
    # Before its first line runs, Python itself ends by the signal, and may say so.
    if process.returncode == 130:
        assert "Traceback" not in rest
    else:
        assert process.returncode in (-signal.SIGINT, 1)
        assert "hybrid_rt_bench" not in rest.replace(str(ROOT), "")


@POSIX
@pytest.mark.slow
def test_something_is_said_at_once(tmp_path):
    process = started(*RUN, "--out", tmp_path)
    begun = time.monotonic()
    first = process.stderr.readline()
    took = time.monotonic() - begun
    process.kill()
    process.communicate()
    assert "loading" in first
    assert took < 3


def invoked(monkeypatch, capsys, *arguments):
    monkeypatch.setattr(sys, "argv", ["hybrid-rt", *map(str, arguments)])
    with pytest.raises(SystemExit) as stopped:
        cli.main()
    return stopped.value.code, capsys.readouterr().err


def test_a_picture_that_does_not_fit_is_refused_before_it_is_made(monkeypatch, capsys, tmp_path):
    path = tmp_path / "x.png"
    code, said = invoked(
        monkeypatch, capsys, "render", "sphere", "--size", "32768x32768", "-o", path
    )
    if code == 0:
        pytest.skip("this machine has the memory for it")
    assert code == terminal.USAGE
    assert "size: expected a picture that fits in memory" in said
    assert "which takes about" in said
    assert not path.exists()


@pytest.mark.parametrize("asked", ["2^99", "2^10..2^40", "999999999999"])
def test_triangles_beyond_all_machines_are_refused_at_once(monkeypatch, capsys, tmp_path, asked):
    code, said = invoked(
        monkeypatch, capsys, "run", "scaling", "--triangles", asked, "--out", tmp_path
    )
    assert code == terminal.USAGE
    assert "--triangles: expected at most" in said
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("rounds", ["100000000000000000000", "-1"])
def test_rounds_without_end_are_refused(monkeypatch, capsys, tmp_path, rounds):
    code, said = invoked(monkeypatch, capsys, "run", "paper", "--rounds", rounds, "--out", tmp_path)
    assert code == terminal.USAGE
    assert "--rounds: expected" in said
    assert not list(tmp_path.iterdir())
