"""The oracles share nothing with what they judge."""

import ast

import pytest

from support import ROOT

PACKAGES = {"hybrid_rt", "hybrid_rt_bench", "hybrid_rt_scenes"}


def imported(path):
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield node.module or ""


@pytest.mark.parametrize(
    "path", sorted((ROOT / "tests" / "naive").glob("*.py")), ids=lambda p: p.stem
)
def test_oracles_import_nothing_of_the_project(path):
    assert not {name for name in imported(path) if name.split(".")[0] in PACKAGES}
