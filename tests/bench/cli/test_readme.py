"""What the README and the page of the library show comes out as they say."""

import re

import pytest

from support import ROOT


def printed(page, capsys):
    (example,) = re.findall(r"```python\n(.*?)```", (ROOT / page).read_text(), flags=re.DOTALL)
    exec(compile(example, page, "exec"), {})
    return capsys.readouterr().out.splitlines()


@pytest.mark.slow
def test_the_ten_lines(capsys):
    said = printed("README.md", capsys)
    answered = re.fullmatch(r"the screen answers (\d+)% of (\d+) rays", said[0])
    assert 40 < int(answered[1]) < 80
    assert int(answered[2]) > 700_000
    assert said[1].startswith("the first five hit triangles [")


@pytest.mark.slow
def test_the_example_of_the_library(capsys):
    said = dict(line.rsplit(maxsplit=1) for line in printed("docs/library.md", capsys))
    assert 0.1 < float(said["alpha"]) < 0.6
    assert float(said["same primitive"]) > 0.8
    assert float(said["certified alpha"]) > float(said["alpha"])
    assert float(said["differs"]) < 10
    ends = ("HIT", "MISS", "OFFSCREEN", "HIDDEN", "NEAR", "EXHAUSTED", "INVALID")
    assert sum(float(said[end]) for end in ends) == pytest.approx(1, abs=0.005)
