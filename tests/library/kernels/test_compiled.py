"""Compiled code on disk, and what is said while there is none."""

import importlib
import shutil

import pytest

import hybrid_rt as hrt
from hybrid_rt.kernels import _progress
from support.scripts import PYRAMID, ROOT, run

HITS = (
    PYRAMID
    + """
assert pyramid() == right()
print(sum(kernels.build.kernel.stats.cache_hits.values()))
"""
)


def hits(*where, **settings):
    """Run a script; return how many kernels it has found compiled, after a look at its answer."""
    code, output, errors = run(HITS, *where, **settings)
    assert code == 0, errors
    return int(output), errors


@pytest.fixture(scope="module")
def compiled(tmp_path_factory):
    """Return a folder that holds the compiled code of `HITS`."""
    folder = tmp_path_factory.mktemp("compiled")
    assert hits(folder) == (0, "")
    return folder


def files(folder):
    found = sorted(folder.rglob("*.code"))
    assert [path.name.split("-")[0] for path in found] == [
        "raster.pyramid.build", "raster.pyramid.finish",
    ]  # fmt: skip
    return found


def test_the_next_process_finds_it(compiled):
    assert hits(compiled) == (1, "")


def overwrite(path):
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 0xFF
    path.write_bytes(content)


@pytest.mark.parametrize(
    "damage",
    [
        lambda path: path.write_bytes(path.read_bytes()[:-100]),
        lambda path: path.write_bytes(b""),
        lambda path: path.write_bytes(b"\x80" * 5000),
        overwrite,
    ],
    ids=["truncated", "empty", "other", "one byte"],
)
def test_damaged_files_are_compiled_anew(compiled, tmp_path, damage):
    shutil.copytree(compiled, tmp_path, dirs_exist_ok=True)
    for path in files(tmp_path):
        damage(path)
    assert hits(tmp_path) == (0, "")
    assert hits(tmp_path) == (1, "")


@pytest.fixture
def package(tmp_path):
    """Return a folder with a copy of the library."""
    ignored = shutil.ignore_patterns("__pycache__")
    shutil.copytree(ROOT / "hybrid_rt", tmp_path / "package" / "hybrid_rt", ignore=ignored)
    return tmp_path / "package"


def test_a_change_in_any_kernel_compiles_anew(package, tmp_path):
    """Numba's own cache looks at the file of the called function alone."""
    cache = tmp_path / "cache"
    assert hits(cache, package=package) == (0, "")
    assert hits(cache, package=package) == (1, "")
    old = files(cache)
    with (package / "hybrid_rt/kernels/_queue.py").open("a") as source:
        source.write("\n# A line more.\n")
    assert hits(cache, package=package) == (0, "")
    assert not set(old) & set(files(cache)), "what is out of date is left"


def test_where_nothing_can_be_written(package):
    (package / "hybrid_rt/__pycache__").write_text("in the way")
    nowhere = {"HOME": "/dev/null/home", "XDG_CACHE_HOME": "/dev/null/cache"}
    found, errors = hits(None, package=package, PYTHONDONTWRITEBYTECODE="1", **nowhere)
    assert found == 0
    assert errors.count("RuntimeWarning") == 1
    assert "Set NUMBA_CACHE_DIR" in errors
    found, errors = hits("/dev/null/set", package=package)
    assert (found, errors.count("Set NUMBA_CACHE_DIR")) == (0, 1)


def test_the_user_s_folder_serves_a_package_that_cannot_be_written(package, tmp_path):
    (package / "hybrid_rt/__pycache__").write_text("in the way")
    home = {"XDG_CACHE_HOME": str(tmp_path / "home")}
    assert hits(None, package=package, **home) == (0, "")
    assert hits(None, package=package, **home) == (1, "")


@pytest.fixture
def fresh(monkeypatch):
    """Have nothing compiled yet, as far as is known."""
    monkeypatch.setattr(_progress, "_done", set())
    monkeypatch.setattr(_progress, "_announced", set())
    monkeypatch.delenv(_progress.SWITCH, raising=False)


def test_a_stage_is_announced_once(fresh, capsys):
    for name in ("raster.cull.cull_and_count", "raster.records.fill_bins"):
        _progress.begin(name)
        _progress.end(name)
    _progress.begin("raster.pyramid.build")  # too short to speak of
    _progress.begin("a.plugin.of.somebody")
    line, rest = capsys.readouterr().err.split("\n")
    assert line.startswith("hybrid_rt: compiling the raster: 5 of 5 functions, about ")
    assert rest == ""


def test_the_environment_silences(fresh, capsys, monkeypatch):
    monkeypatch.setenv(_progress.SWITCH, "0")
    _progress.begin("raster.cull.cull_and_count")
    assert capsys.readouterr().err == ""


def test_a_callback_is_told_of_every_function(fresh, capsys):
    told = []
    hrt.on_compile(told.append)
    try:
        for name in ("lists.fill_lists", "lists_bins.fill_bins"):
            _progress.begin(f"raster.{name}")
            _progress.end(f"raster.{name}")
    finally:
        hrt.on_compile(None)
    assert capsys.readouterr().err == ""
    first, second = told
    assert (first.stage, first.done, first.total) == ("lists of primitives", 0, 4)
    assert (second.function, second.done) == ("raster.lists_bins.fill_bins", 1)
    assert second.seconds_left < first.seconds_left


def test_the_functions_of_the_stages_exist():
    for names in _progress.STAGES.values():
        for name in names:
            module, function = name.rsplit(".", 1)
            found = getattr(importlib.import_module(f"hybrid_rt.kernels.{module}"), function)
            assert hasattr(getattr(found, "kernel", found), "signatures"), name
