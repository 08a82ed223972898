"""The script that draws a figure of the docs."""

import runpy
import sys

import pytest

from support import ROOT
from support.geometry import check


@pytest.mark.slow
def test_the_figure_of_the_lists_is_drawn(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["certified.py", str(tmp_path)])
    script = runpy.run_path(str(ROOT / "docs" / "figures" / "certified.py"), run_name="__main__")
    assert capsys.readouterr().out == "wrote certified.png\nwrote certified.svg\n"
    check(script["figure"]())
    kept = (ROOT / "docs" / "figures" / "certified.svg").read_text()
    drawn = (tmp_path / "certified.svg").read_text()
    assert kept.count("<path") == drawn.count("<path")
