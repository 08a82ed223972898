"""What the documents say is there: links, files, commands with their options, Python."""

import re
import shlex
import sys
from pathlib import Path
from urllib.parse import unquote

import pytest

from hybrid_rt_bench import cli
from support import ROOT

PAGES = sorted([*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md"), *ROOT.glob("examples/*.md")])
NAMES = [path.relative_to(ROOT).as_posix() for path in PAGES]


def blocks(path, language):
    text = path.read_text(encoding="utf-8")
    return re.findall(rf"```{language}\n(.*?)```", text, flags=re.DOTALL)


def anchors(path):
    """The names that the headings of a page can be linked by."""
    heads = re.findall(r"^#+ (.*)$", path.read_text(encoding="utf-8"), flags=re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", head.lower()).replace(" ", "-") for head in heads}


@pytest.mark.parametrize("path", PAGES, ids=NAMES)
def test_every_link_leads_somewhere(path):
    for link in re.findall(r"\]\(([^)\s]+)\)", path.read_text(encoding="utf-8")):
        if re.match(r"[a-z]+:", link):
            continue
        place, _, anchor = unquote(link).partition("#")
        target = (path.parent / place).resolve() if place else path
        assert target.exists(), link
        if anchor:
            assert anchor in anchors(target), link


@pytest.mark.parametrize("path", [p for p in PAGES if p.name != "CHANGELOG.md"], ids=str)
def test_every_source_that_is_named_is_there(path):
    text = path.read_text(encoding="utf-8")
    for name in re.findall(r"(?<![\w/.])((?:[\w-]+/)+[\w-]+\.(?:py|toml|md|csv|cff))\b", text):
        if name.split("/")[0] in ("hybrid_rt", "bench", "scenes", "tests", "docs", "examples"):
            assert (ROOT / name).exists(), name


def commands():
    seen = {}
    for path in PAGES:
        for block in blocks(path, "sh"):
            for line in block.replace("\\\n", " ").splitlines():
                words = shlex.split(line, comments=True)
                if words[:1] == ["hybrid-rt"]:
                    seen.setdefault(" ".join(words), words[1:])
    return seen


@pytest.mark.parametrize("words", commands().values(), ids=commands())
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


@pytest.mark.parametrize("target", sorted(set(re.findall(
    r"\bmake ([a-z][a-z-]+)\b(?! a | the | one | up )",
    "\n".join(block for path in PAGES for block in blocks(path, "sh")),
))))  # fmt: skip
def test_every_target_of_make_is_there(target):
    assert re.search(rf"^{target}:", (ROOT / "Makefile").read_text(), flags=re.MULTILINE)


def python_blocks():
    return [
        pytest.param(path, block, id=f"{path.name}-{k}")
        for path in PAGES
        for k, block in enumerate(blocks(path, "python"))
    ]


@pytest.mark.parametrize(("path", "block"), python_blocks())
def test_python_runs_as_it_is_written(path: Path, block: str, tmp_path, monkeypatch, capsys):
    """Each block by itself, in a folder that has what the pages speak of: hall.glb."""
    monkeypatch.chdir(tmp_path)
    import trimesh

    from hybrid_rt_scenes import get_scene

    scene = get_scene("sphere").load()
    trimesh.Trimesh(scene.vertices, scene.faces, process=False).export("hall.glb")
    exec(compile(block, str(path), "exec"), {"__name__": "__main__"})
