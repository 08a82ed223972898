"""What is being compiled is told as it begins, and about how much is left."""

import io

from rich.console import Console

from hybrid_rt.compiling import Compiling
from hybrid_rt_bench.measure import compiling, progress


def reporter():
    file = io.StringIO()
    return progress.Reporter(Console(file=file, width=200)), file


def test_every_stage_is_told_before_it_begins_and_called_twice():
    told, called = [], []
    stages = {name: lambda name=name: called.append((name, len(told))) for name in "abc"}
    seconds = compiling.first_calls(stages, lambda *stage: told.append(stage))
    assert told == [("a", 1, 3), ("b", 2, 3), ("c", 3, 3)]
    assert called == [("a", 1), ("a", 1), ("b", 2), ("b", 2), ("c", 3), ("c", 3)]
    assert list(seconds) == ["a", "b", "c"]
    assert min(seconds.values()) >= 0


def test_the_first_stage_is_told_and_later_ones_when_it_has_been_quiet(monkeypatch):
    clock = [100.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: clock[0])
    told, file = reporter()
    for index, at in enumerate((100.0, 100.5, 104.0, 104.5), start=1):
        clock[0] = at
        told.stage(f"stage {index}", index, 4)
    lines = file.getvalue().splitlines()
    assert [line.rpartition(": ")[2] for line in lines] == [
        "1 of 4, stage 1", "3 of 4, stage 3, about 4 s left",
    ]  # fmt: skip


def test_each_part_of_the_library_is_told_once():
    told, file = reporter()
    for done, left in ((0, 9.4), (1, 5.0)):
        told.kernel(Compiling("raster.tiles.draw_tiles", "the raster", done, 5, left))
    told.kernel(Compiling("x", "the judge", 0, 3, 4.0))
    lines = file.getvalue().splitlines()
    assert len(lines) == 2
    assert lines[0].startswith("compiling the raster: 0 of 5 functions done, about 9 s left")


def test_the_library_is_silent_while_it_is_told(monkeypatch, capsys):
    from hybrid_rt.kernels import _progress

    heard = []
    with compiling.told(heard.append):
        _progress.begin("some.kernel")
    assert [now.function for now in heard] == ["some.kernel"]
    assert capsys.readouterr().err == ""
    assert _progress._callback is None
