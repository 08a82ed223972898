"""Damaged folders of runs: a table, or one sentence of ours, and never anything else."""

import copy
import json
import random
import shutil

import pandas as pd
import pytest

import hybrid_rt as hrt
from hybrid_rt_bench import runs
from hybrid_rt_bench.registry import Kind
from hybrid_rt_bench.results.files import ReportsError
from hybrid_rt_bench.results.schema import SchemaError
from hybrid_rt_bench.runs import compare_runs, read_run, render_run
from support.bench_rows import paper_cell, paper_run

PARQUET = ("samples.parquet", "results.parquet", "verdicts.parquet")
JUNK = (None, 3, -1, 1e300, "", "x[/red]y", [], {}, [[]], {"a": 1}, True, float("nan"))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    with paper_run(tmp_path_factory.mktemp("run")) as writer:
        for camera in ("left", "right"):
            writer.add_cell(*paper_cell(camera))
        writer.finish()
    return writer.folder


@pytest.fixture
def without_figures(monkeypatch):
    monkeypatch.setattr(Kind, "figure_makers", lambda self: [])


def places(value, path=()):
    """Yield the path of everything in a JSON value."""
    yield path
    if isinstance(value, dict | list):
        for key, part in value.items() if isinstance(value, dict) else enumerate(value):
            yield from places(part, (*path, key))


def damaged_json(rng, meta):
    """Return ``run.json`` with something taken out of it, or something else in its place."""
    found = copy.deepcopy(meta)
    path = rng.choice([p for p in places(meta) if p])
    place = found
    for key in path[:-1]:
        place = place[key]
    if rng.random() < 0.5:
        del place[path[-1]]
    else:
        place[path[-1]] = rng.choice(JUNK)
    return json.dumps(found).encode()


def damage(rng, folder):
    """Damage one file of a folder, and return what was done."""
    name = rng.choice(
        ["run.json"] * 6 + [f"{t}.parquet" for t in ("samples", "results", "verdicts")]
    )
    path = folder / name
    content = path.read_bytes()
    way = rng.choice(["cut", "remove", "noise", "column", "cast"])
    if name == "run.json" and way in ("column", "cast", "noise"):
        path.write_bytes(damaged_json(rng, json.loads(content)))
    elif way == "remove":
        path.unlink()
    elif way == "cut":
        path.write_bytes(content[: rng.randrange(len(content))])
    elif way == "noise":
        at = rng.randrange(len(content))
        path.write_bytes(content[:at] + rng.randbytes(8) + content[at + 8 :])
    else:
        frame = pd.read_parquet(path)
        column = rng.choice(list(frame))
        if way == "column":
            frame = frame.drop(columns=column)
        else:
            frame[column] = [rng.choice(["a", "b"])] * len(frame)
        frame.to_parquet(path)
    return name, way


@pytest.mark.slow
def test_no_damage_gives_anything_but_a_table_or_a_sentence(folder, tmp_path, without_figures):
    whole, refused = read_run(folder), 0
    for number in range(300):
        rng = random.Random(number)
        copied = tmp_path / str(number)
        shutil.copytree(folder, copied)
        done = damage(rng, copied)
        told = told_of(whole, copied)
        assert told is None or told.strip(), done
        refused += told is not None
        shutil.rmtree(copied)
    assert refused > 100
    assert refused < 290


def told_of(whole, folder):
    """Return what is said of a folder, None if its tables are made."""
    try:
        run = read_run(folder)
        render_run(run)
        compare_runs([whole], [run])
    except hrt.HybridRTError as error:
        return str(error)
    return None


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda f: (f / "results.parquet").unlink(), "results: no column 'scene'"),
        (lambda f: (f / "run.json").write_text("[]"), "no object"),
        (lambda f: (f / "run.json").write_text("[" * 100_000), "not a readable run"),
        (lambda f: (f / "run.json").write_bytes(b"\xff\xfe"), "not a readable run"),
        (lambda f: (f / "results.parquet").write_bytes(b"PAR1"), "not a readable run"),
        (lambda f: without_column(f, "march_ms"), "no column 'march_ms'"),
        (lambda f: with_column(f, "speed"), "unknown column 'speed'"),
    ],
)
def test_what_is_wrong_is_named(folder, tmp_path, change, said):
    copied = tmp_path / "run"
    shutil.copytree(folder, copied)
    change(copied)
    with pytest.raises(ReportsError, match=said):
        read_run(copied)


def without_column(folder, name):
    path = folder / "results.parquet"
    pd.read_parquet(path).drop(columns=name).to_parquet(path)


def with_column(folder, name):
    path = folder / "results.parquet"
    pd.read_parquet(path).assign(**{name: 1.0}).to_parquet(path)


def test_a_picture_that_is_lost_is_told(folder, tmp_path):
    copied = tmp_path / "run"
    shutil.copytree(folder, copied)
    (copied / "pictures" / "hall-left.npz").unlink()
    with pytest.raises(ReportsError, match=r"hall-left\.npz"):
        render_run(read_run(copied))


def test_a_run_of_a_kind_that_is_gone_is_refused(folder, tmp_path):
    copied = tmp_path / "run"
    shutil.copytree(folder, copied)
    meta = json.loads((copied / "run.json").read_text())
    (copied / "run.json").write_text(json.dumps({**meta, "kind": "papre"}))
    with pytest.raises(ReportsError, match="did you mean 'paper'"):
        runs.read_run(copied)


@pytest.mark.parametrize("name", ["a\0b", "x" * 5000, "..", ""])
def test_a_name_that_is_no_run_is_refused(name, tmp_path):
    with pytest.raises(hrt.UnknownNameError):
        read_run(name, tmp_path)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"speed": 1.0}, "unknown column 'speed'"),
        ({"rays": 1.5}, "'rays' is to be int, not 1.5"),
        ({"technique": None}, "'technique' is to be str, not None"),
        ({"alpha": "much"}, "'alpha' is to be float"),
    ],
)
def test_a_row_that_is_not_as_the_schema_says_is_refused(tmp_path, change, said):
    cell, samples, (row,), verdicts, _ = paper_cell("left")
    with paper_run(tmp_path) as writer:
        with pytest.raises(SchemaError, match=said):
            writer.add_cell(cell, samples, [{**row, **change}], verdicts)
        row.pop("march_ms")
        with pytest.raises(SchemaError, match="no column 'march_ms'"):
            writer.add_cell(cell, samples, [row], verdicts)
        assert not writer.measured
