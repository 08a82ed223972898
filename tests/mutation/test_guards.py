"""A sample of the guards of the certified proof, taken away; ``make mutation`` takes all."""

import importlib.util
from pathlib import Path

import pytest

from support import ROOT

SPEC = importlib.util.spec_from_file_location("guards", Path(__file__).with_name("guards.py"))
guards = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(guards)

SAMPLE = ("no margin", "what falls out of a list forgotten", "skipped rays taken for free")


@pytest.mark.parametrize("mutant", guards.MUTANTS, ids=lambda mutant: mutant.name)
def test_each_guard_is_where_it_is_taken_away(mutant):
    assert (ROOT / mutant.file).read_text().count(mutant.old) == 1
    assert (ROOT / mutant.tests).is_file()


@pytest.mark.slow
@pytest.mark.parametrize("name", SAMPLE)
def test_a_test_fails_without_it(name):
    (mutant,) = (m for m in guards.MUTANTS if m.name == name)
    assert guards.killed(mutant)
