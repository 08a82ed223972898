"""A program that dies at any moment leaves a folder that is read, or refused in one sentence."""

import errno
import os
import subprocess
import sys

import pytest

from hybrid_rt_bench.results import files
from hybrid_rt_bench.results.files import ReportsError
from hybrid_rt_bench.runs import read_run, render_run
from support import PYTHONPATH
from support.bench_rows import paper_cell, paper_run

CAMERAS = ("left", "right")


class Killed(BaseException):
    """The end of the program: nothing that it would do to a disk happens any more."""


class Death:
    """Let the program die when it touches the disk for the `when`-th time.

    A file that is cut short has half of its first bytes, as a buffer that was not flushed.
    """

    def __init__(self, monkeypatch, when):
        self.left, self.dead = when, False
        for name in ("fsync", "replace", "unlink", "mkdir"):
            monkeypatch.setattr(os, name, self.guarded(getattr(os, name)))
        monkeypatch.setattr(files, "open", self.opened, raising=False)

    def guarded(self, call):
        def guard(*arguments, **more):
            self.step()
            return call(*arguments, **more)

        return guard

    def step(self):
        if self.dead:
            raise Killed
        self.left -= 1
        if self.left < 0:
            self.dead = True
            raise Killed

    def opened(self, *arguments, **more):
        self.step()
        return Torn(open(*arguments, **more), self)


class Torn:
    """A file that is written to until the program dies."""

    def __init__(self, file, death):
        self.file, self.death, self.begun = file, death, False

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.file.close()

    def __getattr__(self, name):
        return getattr(self.file, name)

    def write(self, content):
        if self.begun:
            return self.file.write(content)
        self.begun = True
        try:
            self.death.step()
        except Killed:
            self.file.write(bytes(content)[: len(content) // 2])
            raise
        return self.file.write(content)


def write_all(folder):
    with paper_run(folder) as writer:
        for camera in CAMERAS:
            writer.add_cell(*paper_cell(camera))
        writer.finish()
    return writer.folder


def deaths(tmp_path, monkeypatch):
    """Yield the folder after the death at each moment, and the cells that had landed by then."""
    when = 0
    while True:
        out, landed = tmp_path / str(when), []
        with monkeypatch.context() as patch:
            death = Death(patch, when)
            try:
                with paper_run(out) as writer:
                    for camera in CAMERAS:
                        writer.add_cell(*paper_cell(camera))
                        landed.append(camera)
                    writer.finish()
            except Killed:
                pass
        if not death.dead:
            assert 90 < when < 200, "a write was not seen, or seen twice"
            return
        yield out, landed
        when += 1


@pytest.mark.slow
def test_no_moment_of_death_leaves_a_run_that_cannot_be_told(tmp_path, monkeypatch):
    refused = shown = 0
    for number, (out, landed) in enumerate(deaths(tmp_path, monkeypatch)):
        folders = list(out.glob("*")) if out.exists() else []
        if not folders or not (folders[0] / "run.json").exists():
            assert not landed
            continue
        run = whole_run(folders[0])
        if run is None:
            assert not landed
            refused += 1
            continue
        shown += 1
        cameras = list(run.results.camera)
        # The one that was being written may have landed, and is then whole.
        assert cameras in (landed, list(CAMERAS[: len(landed) + 1]))
        assert set(run.samples.camera) == set(run.verdicts.camera) == set(cameras)
        assert not list(folders[0].rglob(".*")), "a temporary file was left"
        if number % 29 == 0:
            assert render_run(run)[0]
    assert refused > 10
    assert shown > 40


def whole_run(folder):
    """Return a run, or None for one that says in a sentence that it has no cell."""
    try:
        return read_run(folder)
    except ReportsError as error:
        told = str(error)
    assert "no cell was finished" in told
    return None


ROUNDS = (2, 3, 4)
"""Of one cell, which is kept again with each round more."""


def write_growing(out):
    with paper_run(out) as writer:
        for rounds in ROUNDS:
            cell, *rows = paper_cell("left", rounds)
            writer.add_cell({**cell, "kept_rounds": rounds}, *rows)
            yield rounds
        writer.finish()


@pytest.mark.slow
def test_a_cell_that_grows_has_as_many_rounds_in_every_file(tmp_path, monkeypatch):
    """Whenever the program dies, samples, results and run.json are of one round."""
    when, seen = 0, set()
    while True:
        out, landed = tmp_path / str(when), 0
        with monkeypatch.context() as patch:
            death = Death(patch, when)
            try:
                for rounds in write_growing(out):
                    landed = rounds
            except Killed:
                pass
        if not death.dead:
            break
        when += 1
        folders = list(out.glob("*")) if out.exists() else []
        there = bool(folders) and (folders[0] / "run.json").exists()
        run = whole_run(folders[0]) if there else None
        if run is None:
            assert not landed
            continue
        (cell,) = run.meta["cells"]
        kept = cell["kept_rounds"]
        assert kept in (landed, *(r for r in ROUNDS if r == landed + 1 or not landed))
        assert set(run.results.rounds) == {kept}
        assert run.samples["round"].nunique() == kept
        assert not list(run.folder.rglob(".*"))
        seen.add(kept)
    assert seen == set(ROUNDS)
    assert 60 < when < 250, "a write was not seen, or seen twice"


def test_a_failure_between_two_places_is_made_good_by_the_next_write(tmp_path, monkeypatch):
    """The disk refuses to rename for a while, after it was decided that the new files count."""
    replace, left = os.replace, [2]

    def refusing(*arguments):
        left[0] -= 1
        if left[0] < 0:
            raise OSError(errno.EIO, os.strerror(errno.EIO))
        return replace(*arguments)

    def written(number):
        return {n: lambda f: f.write(b"%d" % number) for n in ("a", "b", "last")}

    files.write_together(tmp_path, written(1))
    monkeypatch.setattr(os, "replace", refusing)
    with pytest.raises(ReportsError):
        files.write_together(tmp_path, written(2))
    monkeypatch.undo()
    assert [(tmp_path / n).read_bytes() for n in ("a", "b", "last")] == [b"2", b"1", b"1"]
    files.sweep(tmp_path, ("a", "b", "last"))
    assert [(tmp_path / n).read_bytes() for n in ("a", "b", "last")] == [b"2"] * 3
    files.write_together(tmp_path, written(3))
    assert [(tmp_path / n).read_bytes() for n in ("a", "b", "last")] == [b"3"] * 3
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a", "b", "last"]


def test_rows_of_a_cell_that_is_not_listed_are_left_out(tmp_path):
    folder = write_all(tmp_path / "a")
    writer = paper_run(tmp_path / "b")
    writer.add_cell(*paper_cell("left"))
    for name in ("results", "samples", "verdicts"):
        (writer.folder / f"{name}.parquet").write_bytes((folder / f"{name}.parquet").read_bytes())
    run = read_run(writer.folder)
    assert list(run.results.camera) == ["left"]
    assert set(run.samples.camera) == {"left"}


def add_cells(writer):
    for number in range(20):
        writer.add_cell(*paper_cell(f"c{number}"))


@pytest.mark.parametrize("when", range(0, 40, 5))
def test_a_disk_that_is_full_at_any_moment_is_an_error_of_ours(tmp_path, monkeypatch, when):
    calls = []

    def full(call):
        def guard(*arguments, **more):
            calls.append(1)
            if len(calls) > when:
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
            return call(*arguments, **more)

        return guard

    writer = paper_run(tmp_path)
    writer.add_cell(*paper_cell("left"))
    for name in ("fsync", "replace"):
        monkeypatch.setattr(os, name, full(getattr(os, name)))
    with pytest.raises(ReportsError, match="No space left on device"):
        add_cells(writer)
    monkeypatch.undo()
    files.release(writer._held)
    run = read_run(writer.folder)
    assert run.results.camera.iloc[0] == "left"
    assert not list(writer.folder.rglob(".*"))


def test_a_folder_that_is_being_written_is_not_swept(tmp_path):
    writer = paper_run(tmp_path)
    writer.add_cell(*paper_cell("left"))
    part = writer.folder / ".results.parquet.part"
    part.write_text("half")
    read_run(writer.folder)
    assert part.exists()
    with writer:
        pass
    read_run(writer.folder)
    assert not part.exists()


def test_files_are_flushed_before_they_get_their_names(tmp_path, monkeypatch):
    told = []
    for name in ("fsync", "replace"):
        call = getattr(os, name)
        monkeypatch.setattr(
            os, name, lambda *a, call=call, name=name: (told.append(name), call(*a))[1]
        )
    files.write_bytes(tmp_path / "x", b"content")
    assert told == ["fsync", "replace", "fsync"]


@pytest.mark.slow
def test_a_killed_process_leaves_a_whole_run(tmp_path):
    script = (
        "import os, signal, sys; sys.path.insert(0, 'tests')\n"
        "from support.bench_rows import paper_cell, paper_run\n"
        f"writer = paper_run(__import__('pathlib').Path({str(tmp_path)!r}))\n"
        "for k in range(10_000):\n"
        "    writer.add_cell(*paper_cell(f'c{k}'))\n"
        "    print(k, flush=True)\n"
    )
    started = subprocess.Popen(
        [sys.executable, "-c", script], stdout=subprocess.PIPE, text=True,
        env=os.environ | {"PYTHONPATH": PYTHONPATH},
    )  # fmt: skip
    for line in started.stdout:
        if line.strip() == "7":
            break
    started.kill()
    started.wait()
    started.stdout.close()
    run = read_run(next(tmp_path.glob("*")))
    assert len(run.results) >= 8
    assert not list(run.folder.rglob(".*"))
