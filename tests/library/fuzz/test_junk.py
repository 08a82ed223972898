"""Junk at every argument of the public API is refused by name: no crash, no bare exception.

``HYBRID_RT_FUZZ`` is the share of all calls that is tried, 1 for all (``make fuzz``), and
``HYBRID_RT_FUZZ_SEED`` chooses which.
"""

import inspect
import os

import pytest

import hybrid_rt as hrt
from support.fuzz import examples
from support.fuzz.run import calls, extremes, fuzz, sample
from support.fuzz.targets import targets

SHARE = float(os.environ.get("HYBRID_RT_FUZZ", "0.5"))
SEED = int(os.environ.get("HYBRID_RT_FUZZ_SEED", "1"))


@pytest.fixture(scope="module")
def ended():
    everything = list(calls())
    return fuzz(everything if SHARE >= 1 else sample(everything, SHARE, SEED))


def test_no_crash_no_hang_no_bare_exception(ended):
    faults = [f"{e.call}: {e.outcome}" for e in ended if e.fault]
    assert not faults, "\n".join([f"{len(faults)} faults in {len(ended)} calls", *faults])


def test_what_is_allowed_and_extreme_is_answered_or_refused():
    tried = fuzz(extremes(range(1000 * SEED, 1000 * SEED + round(400 * SHARE))))
    faults = [f"{e.call}: {e.outcome}" for e in tried if e.fault]
    assert not faults, "\n".join([f"{len(faults)} faults in {len(tried)} calls", *faults])


def test_most_junk_is_refused(ended):
    """An argument that takes whatever comes would pass the test above."""
    refused = sum(e.outcome.startswith("refused") for e in ended)
    assert refused > 0.6 * len(ended)


RESULTS = (
    "Compiling", "HybridResult", "Judged", "MarchWork", "Marched", "Nearest", "OcclusionResult",
    "Rate",
)  # fmt: skip
"""Records that the library makes of what it has found, and nobody hands back to it unchecked."""


def test_an_object_is_refused_wherever_it_stands(ended):
    taken = [e.call for e in ended if e.call.junk == "object" and e.outcome == "accepted"]
    assert not [str(call) for call in taken if call.label not in RESULTS]


def test_every_public_name_is_fuzzed():
    found = {target.label.partition(".")[0] for target in targets()}
    for name in set(hrt.__all__) - found:
        thing = getattr(hrt, name)
        assert not inspect.isroutine(thing), name


def test_valid_arguments_are_accepted():
    """What is replaced by junk is right: otherwise the junk would hardly be looked at."""
    for target in targets():
        if target.label == "Screen":  # only `prepare` makes any
            continue
        function = target.get()
        try:
            function(**examples.arguments(target.label, function))
        except hrt.MeshFileError:
            assert target.label in ("load_scene", "read_mesh")
