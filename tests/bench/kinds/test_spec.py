import pytest

import hybrid_rt as hrt
from hybrid_rt_bench.experiments import experiment_names, load_experiment, parse_experiment
from hybrid_rt_bench.measure.experiment import Resolution
from hybrid_rt_bench.registry import kinds

GOOD = """
schema = 1
name = "x"
title = "X"
techniques = ["paper"]
resolutions = ["64x48"]
picture = "64x48"
rounds = 3
[[scenes]]
name = "sphere"
[quick]
rounds = 1
"""


@pytest.mark.parametrize("name", experiment_names())
@pytest.mark.parametrize("quick", [False, True])
def test_every_experiment_of_the_package_is_whole(name, quick):
    experiment = load_experiment(name, quick=quick)
    assert experiment.name == name
    assert experiment.quick is quick
    if experiment.kind == "paper":
        assert experiment.picture in experiment.resolutions
    for technique in getattr(experiment, "techniques", None) or []:
        assert technique in hrt.TECHNIQUES


def test_the_paper_is_measured_at_its_own_resolutions_and_scenes():
    experiment = load_experiment("paper")
    sizes = [str(r) for r in experiment.resolutions]
    assert sizes == ["1280x720", "1920x1080", "2560x1440", "3840x2160"]
    assert [scene.row for scene in experiment.scenes] == ["Sphere", "Sponza", "Bistro"]
    assert experiment.row_of("sponza") == "Sponza"
    quick = load_experiment("paper", quick=True)  # of built-in scenes
    assert [quick.row_of(name) for name in ("sponza", "bistro", "sphere")] == [
        "Sponza",
        "Bistro",
        "",
    ]
    assert experiment.row_of("atrium") == ""  # which stands in for Sponza, and is not the paper's
    assert experiment.row_of("kitchen") == ""


def test_quick_lays_its_table_over_the_rest():
    full, quick = (parse_experiment(GOOD, source="x.toml", quick=q) for q in (False, True))
    assert (full.rounds, quick.rounds) == (3, 1)
    assert full.scenes == quick.scenes


@pytest.mark.parametrize("name", kinds.names())
def test_every_part_of_a_kind_is_found(name):
    kind = kinds[name]
    assert kind.spec_class().model_fields["kind"].default == name
    assert kind.columns().key_names
    parts = [kind.runner(), kind.table_maker(), *kind.figure_makers()]
    assert all(callable(part) for part in parts)
    assert kind.experiments()
    assert all(column.meaning for columns in kind.columns().tables.values()
               for column in columns.values())  # fmt: skip
    changes = {option.parameter for option in kind.options if option.changes}
    assert changes <= {"resolutions", "rounds", "techniques"}


@pytest.mark.parametrize("name", kinds.names())
def test_what_is_compared_of_a_kind_are_columns_of_its_schema(name):
    compared, schema = kinds[name].compared(), kinds[name].columns()
    results = {**schema.tables["results"], **schema.tables["cell"]}
    assert set(compared.exact) | set(compared.names) <= set(results) | {"threads"}
    assert set(compared.cell) <= set(results)
    assert {column for column, _ in compared.loose} <= set(results)
    samples = schema.tables["samples"]
    assert bool(compared.timings) == bool(samples)
    if samples:
        assert set(compared.names) <= set(samples)
    assert sum(not timing.baseline for timing in compared.timings) in (0, 1, 2)
    for timing in compared.timings:
        assert timing.amount in {"", *results}
        assert timing.baseline_amount in {"", *samples}
        if not compared.stage:
            assert {*timing.columns, timing.baseline} <= {"", *samples}
    # Whatever is counted is held to be the same, or is known not to be.
    counted = {c.name for c in schema.results if c.type is int} - {*compared.names, *compared.cell}
    settings = {"rounds", "timed_rays", "threads"}
    memory = {"peak_bytes", "program_bytes", "scene_bytes"}
    made_of_work = {c for c in counted if c.endswith(("_gathered", "_places"))}
    assert counted - set(compared.exact) <= settings | memory | made_of_work


def test_an_unknown_kind_is_answered_with_the_nearest():
    with pytest.raises(hrt.UnknownNameError, match="did you mean 'paper'"):
        parse_experiment('kind = "papre"\n' + GOOD, source="x.toml")


def test_unknown_experiment_is_answered_with_the_nearest():
    with pytest.raises(hrt.UnknownNameError, match="did you mean 'paper'"):
        load_experiment("papre")


@pytest.mark.parametrize(
    ("old", "new", "nearest"),
    [
        ("rounds = 3", "runds = 3", "rounds"),
        ('name = "sphere"', 'name = "sphere"\ncamera = ["a"]', "cameras"),
        ("[quick]\nrounds", "[quick]\nresolution", "resolutions"),
    ],
)
def test_unknown_key_is_answered_with_the_nearest(old, new, nearest):
    with pytest.raises(hrt.UnknownNameError, match=rf"x\.toml.*did you mean '{nearest}'"):
        parse_experiment(GOOD.replace(old, new), source="x.toml")


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("rounds = 3", "rounds = 0", r"x\.toml: rounds: expected .*greater than or equal to 1.*0"),
        ('"64x48"]', '"64 by 48"]', r"resolutions.0: expected WIDTHxHEIGHT.*'64 by 48'"),
        ('title = "X"\n', "", r"x\.toml: title: expected a value, got none"),
        ("schema = 1", "schema = 2", r"x\.toml: schema"),
        ("rounds = 3", "rounds = [", r"x\.toml: expected a TOML document"),
    ],
)
def test_bad_value_is_named_with_what_was_expected(old, new, said):
    with pytest.raises(hrt.ArgumentError, match=said):
        parse_experiment(GOOD.replace(old, new, 1), source="x.toml")


def test_quick_without_a_quick_table_is_refused():
    with pytest.raises(hrt.ArgumentError, match="quick"):
        parse_experiment(GOOD.split("[quick]")[0], source="x.toml", quick=True)


@pytest.mark.parametrize("text", ["", "0x5", "5x0", "12", "axb", "-1x5", "99999x1", "1.5x2"])
def test_resolution_refuses(text):
    with pytest.raises(hrt.ArgumentError, match="WIDTHxHEIGHT"):
        Resolution.parse("--size", text)


def test_resolution_reads_what_it_writes():
    assert str(Resolution.parse("--size", " 1920X1080 ")) == "1920x1080"


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("[quick]\nrounds = 1", "", "quick: expected a table, got 3"),
        ('name = "x"', 'name = "x"\nkind = ["paper"]', "kind: expected the name of a kind"),
        ('name = "x"', 'name = "a\\u0000b"', "name: expected"),
        ('name = "x"', 'name = "../x"', "name: expected"),
        ('name = "x"', 'name = ""', "name: expected"),
        ('title = "X"', 'title = "X\\nY"', "title: expected"),
        ('name = "sphere"', 'name = "sph\\u0000ere"', "scenes.0.name: expected"),
        ("rounds = 3", "rounds = 1e20", "rounds: expected"),
        ("rounds = 3", "rounds = 100000000000000000000", "rounds: expected"),
        ("rounds = 3", "rounds = true", "rounds: expected"),
        ("rounds = 3", "rounds = nan", "rounds: expected"),
        ("rounds = 3", "rounds = 3\nwarmup = 1e9", "warmup: expected"),
        ("rounds = 3", "rounds = 3\nselection_rays = 1e30", "selection_rays: expected"),
        ("[[scenes]]", "scenes = " + "[" * 5000 + "]" * 5000 + "\n[[other]]", "expected"),
        ("rounds = 1\n", 'rounds = 1\nkind = "error"\n', "quick.kind: expected 'paper'"),
    ],
)
def test_junk_is_refused_by_name(old, new, said):
    text = GOOD.replace(old, new)
    if not new:
        text = "quick = 3\n" + text
    with pytest.raises(hrt.HybridRTError, match=said):
        parse_experiment(text, source="x.toml")


@pytest.mark.parametrize("name", ["a\0b.toml", "x/" * 3000 + "y.toml", "/", "/dev/null/x.toml"])
def test_a_path_that_cannot_be_one_is_refused(name):
    with pytest.raises(hrt.ArgumentError, match="experiment"):
        load_experiment(name)


def test_a_file_that_is_no_text_or_too_long_is_refused(tmp_path):
    path = tmp_path / "x.toml"
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(hrt.ArgumentError, match="readable TOML"):
        load_experiment(str(path))
    path.write_bytes(b"#" * 2**21)
    with pytest.raises(hrt.ArgumentError, match="at most"):
        load_experiment(str(path))
