"""The list of public meshes is whole, and made anew where the collections are at hand."""

import csv
import os
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).resolve().parent


@pytest.fixture
def corpus(monkeypatch):
    """Return the script that makes the list."""
    monkeypatch.syspath_prepend(HERE)
    sys.modules.pop("corpus", None)
    import corpus

    return corpus


def listed(corpus):
    """Return the rows of the list."""
    with corpus.RESULTS.open(newline="") as file:
        return list(csv.DictReader(file))


def test_nothing_differs_and_refusals_say_why(corpus):
    made = listed(corpus)
    assert len({row["collection"] for row in made}) >= 2
    assert {row["verdict"] for row in made} <= {"agrees", "explained", "refused"}
    assert all(row["by"] for row in made if row["verdict"] == "agrees")
    assert all(row["reason"] for row in made if row["against"] or row["verdict"] != "agrees")
    assert not [row for row in made if "no check foresaw" in row["reason"]]
    assert corpus.SUMMARY.read_text() == corpus.summary(made)


def test_measurements_that_differ_are_told_apart(corpus):
    base = {"triangles": 2, "area": 4.0, "bounds": [0, 0, 0, 2, 2, 0]}
    assert corpus.same(base, {**base, "area": 4.00001})
    for change in ({"triangles": 3}, {"area": 4.01}, {"bounds": [0, 0, 0, 2, 2.001, 0]}):
        assert not corpus.same(base, {**base, **change})
    assert not corpus.same(base, {"error": "it died"})


@pytest.mark.slow
@pytest.mark.skipif(
    "HYBRID_RT_CORPUS" not in os.environ, reason="HYBRID_RT_CORPUS names no 'NAME=FOLDER ...'"
)
def test_the_collections_give_the_list(corpus):
    for package in ("assimp_py", "meshio", "DracoPy", "meshoptimizer"):
        pytest.importorskip(package)
    words = os.environ["HYBRID_RT_CORPUS"].split()
    collections = {name: Path(folder) for name, _, folder in (w.partition("=") for w in words)}
    wanted = [row for row in listed(corpus) if row["collection"] in collections]
    found = [{key: str(value) for key, value in row.items()} for row in corpus.rows(collections)]
    assert found == wanted
