"""What can be chosen by name: from the package, from entry points, from a script."""

import subprocess
import sys
from dataclasses import dataclass
from importlib import metadata

import numpy as np
import pytest

import hybrid_rt as hrt
from support import PYTHONPATH


def test_the_techniques_and_tracers_of_the_package_register_themselves():
    assert list(hrt.TECHNIQUES) == ["certified", "dda", "hiz", "linear", "paper", "slope"]
    assert list(hrt.TRACERS) == ["brute", "embree"]
    for name, technique in hrt.TECHNIQUES.items():
        assert technique.name == name
        assert technique.description
        assert technique.reference
        assert technique() == technique()


def test_points_have_labels_of_their_own_and_hold_the_default_once():
    for technique in hrt.TECHNIQUES.values():
        for which in ("all", "default", "switches", "cheapest"):
            points = technique.points(which)
            labels = [point.label for point in points]
            assert len(set(labels)) == len(labels)
            assert sum(point.default for point in points) == 1
        assert len(technique.points("default")) == 1
    with pytest.raises(hrt.ArgumentError, match=r"^which: expected one of 'all'"):
        hrt.Paper.points("some")


@pytest.fixture
def registry():
    return hrt.Registry("fruit", "hybrid_rt.nothing")


class Pear:
    name = "pear"


def test_a_name_is_taken_once(registry):
    assert registry.register(Pear) is Pear
    registry.register(Pear)
    with pytest.raises(hrt.ArgumentError, match="one that is not taken, got 'pear'"):
        registry.register(type("Other", (), {"name": "pear"}))
    again = type("Pear", (), {"name": "pear", "__module__": __name__})
    again.__qualname__ = Pear.__qualname__
    registry.register(again)  # as a cell of a notebook that is run again
    assert registry["pear"] is again


@pytest.mark.parametrize("name", [None, "", "Pear", "a pear", "[red]", "p\0", "1st", "x" * 65, 3])
def test_a_name_is_plain(registry, name):
    with pytest.raises(hrt.ArgumentError, match=r"^name of a fruit: expected lower-case letters"):
        registry.register(type("Odd", (), {"name": name}))


def test_a_name_that_is_not_known_suggests_the_nearest(registry):
    registry.register(Pear)
    with pytest.raises(hrt.UnknownNameError, match="did you mean 'pear'"):
        registry["peer"]
    with pytest.raises(hrt.UnknownNameError, match="did you mean 'paper'"):
        hrt.TECHNIQUES["papr"]


def test_what_is_no_technique_is_not_registered():
    for thing, said in (
        (hrt.Paper(), "a class with a method intersect"),
        (object, "a class with a method intersect"),
        (type("Nameless", (hrt.Technique,), {"name": None}), "with a name"),
    ):
        with pytest.raises(hrt.ArgumentError, match=said):
            hrt.register(thing)

    class Abstract(hrt.Technique):
        name, description = "abstract", "cannot march"

    with pytest.raises(hrt.ArgumentError, match="made without arguments"):
        hrt.register(Abstract)


def test_a_technique_of_ones_own_marches_and_its_answers_are_checked(monkeypatch):
    monkeypatch.setattr(hrt.TECHNIQUES, "_things", dict(hrt.TECHNIQUES._things))

    @hrt.register
    @dataclass(frozen=True)
    class Own(hrt.Technique):
        name, description = "own", "answers every ray with the same triangle"
        prim: int = 0

        def _march(self, rays, screen, any_hit, threads):
            marched = hrt.Marched.unresolved(len(rays))
            marched.resolved[:], marched.prim_id[:], marched.t[:] = True, self.prim, 1.0
            return marched

    scene = hrt.Scene.from_arrays(np.eye(3) - [0, 0, 2], [[0, 1, 2]])
    gbuffer = hrt.rasterize(scene, hrt.Camera.look_at((0, 0, 1), (0, 0, -2), width=8, height=8))
    rays = hrt.Rays.from_arrays(np.zeros((4, 3)), np.ones((4, 3)))
    tracer = hrt.BruteForceTracer(scene)
    result = hrt.trace_hybrid(rays, hrt.prepare(gbuffer, "own"), tracer)
    assert result.resolved.all()
    assert (result.hits.prim_id == 0).all()
    with pytest.raises(hrt.ArgumentError, match=r"what 'own' returns\.prim_id: expected values"):
        hrt.trace_hybrid(rays, hrt.prepare(gbuffer, Own(prim=1)), tracer)


class Entry:
    """An entry point, as a distribution would offer it."""

    dist = None

    def __init__(self, name, load):
        self.name, self.load = name, load


def test_entry_points_are_loaded_when_first_asked_for(registry, monkeypatch):
    loads = []

    def load():
        loads.append(1)
        return Pear

    monkeypatch.setattr(metadata, "entry_points", lambda group: [Entry("pear", load)])
    assert not loads
    assert "pear" in registry
    assert registry.names() == ["pear"]
    assert len(loads) == 1


def test_an_entry_point_that_fails_costs_only_itself(registry, monkeypatch):
    def broken():
        raise ImportError("no module named stone")

    entries = [Entry("plum", broken), Entry("pear", lambda: Pear)]
    monkeypatch.setattr(metadata, "entry_points", lambda group: entries)
    with pytest.warns(UserWarning, match=r"fruit 'plum' cannot be loaded: .*stone"):
        assert list(registry) == ["pear"]
    with pytest.raises(hrt.HybridRTError, match="'plum' cannot be loaded"):
        registry["plum"]


def test_importing_the_library_loads_neither_numba_nor_embree_nor_numpy():
    script = (
        "import sys, hybrid_rt\n"
        "heavy = ('numba', 'embreex', 'trimesh', 'scipy', 'numpy')\n"
        "print([m for m in heavy if m in sys.modules])\n"
        "assert 'trace_hybrid' in dir(hybrid_rt)\n"
        "hybrid_rt.Scene\n"
        "print([m for m in heavy[:4] if m in sys.modules])\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True,
        env={"PYTHONPATH": PYTHONPATH},
    )  # fmt: skip
    assert done.stdout.split("\n")[:2] == ["[]", "[]"]
