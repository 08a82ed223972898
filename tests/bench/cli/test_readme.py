"""What the README shows runs as it is written."""

import re
import shlex
import sys

import pytest

from hybrid_rt_bench import cli
from support import ROOT

TEXT = (ROOT / "README.md").read_text()


def blocks(language):
    return re.findall(rf"```{language}\n(.*?)```", TEXT, flags=re.DOTALL)


def test_the_library_example(capsys):
    (example,) = blocks("python")
    exec(compile(example, "README.md", "exec"), {})
    printed = dict(line.rsplit(maxsplit=1) for line in capsys.readouterr().out.splitlines())
    assert 0.1 < float(printed["alpha"]) < 0.6
    assert float(printed["same primitive"]) > 0.8
    assert float(printed["certified alpha"]) > float(printed["alpha"])
    assert float(printed["differs"]) < 10
    ends = ("HIT", "MISS", "OFFSCREEN", "HIDDEN", "NEAR", "EXHAUSTED", "INVALID")
    assert sum(float(printed[end]) for end in ends) == pytest.approx(1, abs=0.005)


def commands():
    for block in blocks("sh"):
        for line in block.splitlines():
            words = shlex.split(line, comments=True)
            if words[:1] == ["hybrid-rt"]:
                yield words[1:]


@pytest.mark.parametrize("words", list(commands()), ids=" ".join)
def test_every_command_is_known_with_its_options(words, monkeypatch, capsys):
    """Every command and option named is one that --help lists; what they do is tested elsewhere."""
    names = [w for w in words if not w.startswith("-")][:1]
    monkeypatch.setenv("COLUMNS", "200")
    monkeypatch.setattr(sys, "argv", ["hybrid-rt", *names, "--help"])
    with pytest.raises(SystemExit) as stopped:
        cli.main()
    assert stopped.value.code == 0
    shown = capsys.readouterr().out
    for option in (w for w in words if w.startswith("-")):
        assert re.search(rf"(?<![\w-]){option}(?![\w-])", shown), f"{option} is not in the help"
