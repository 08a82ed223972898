"""Render docs/results/, the findings in README and the tables in docs.

Everything comes from the runs that are committed in docs/results/NAME: each gets its tables.md and
figures/, docs/results/README.md says what there is, README.md gets its three findings, and pages of
docs get the tables that they ask for, between lines like these:

    <!-- table of paper: Table 1. March (SSRM), mean time -->
    <!-- end of table -->
"""

import re
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from hybrid_rt.judging.rate import Rate
from hybrid_rt_bench.report.scenes import scene_name
from hybrid_rt_bench.report.table import Table
from hybrid_rt_bench.results.folder import RunData
from hybrid_rt_bench.runs import read_run, render_run
from reference_runs import RESULTS, ROOT, RUNS

README = ROOT / "README.md"
BEGIN, END = "<!-- findings: written by `make results` -->\n", "<!-- end of findings -->\n"

DOCS = ROOT / "docs"
TABLE = re.compile(r"(<!-- table of (\w+): (.*?) -->\n)(.*?)(<!-- end of table -->\n)", re.DOTALL)
"""What asks for a table: the run, the title, what was there before."""

THICKNESS = ("linear", "dda", "hiz")
"""Techniques that guess how thick surfaces are."""


def committed(results: Path = RESULTS) -> dict[str, RunData]:
    """Return the runs that are there, in the order of `RUNS`."""
    found = {name: results / name for name in RUNS if (results / name / "run.json").is_file()}
    return {name: read_run(folder) for name, folder in found.items()}


def findings(runs: dict[str, RunData], docs: str) -> str:
    """Return the three findings in Markdown; `docs` is the way to the folder docs."""
    wrong, certain, pays = (
        make(_named(runs[name])) if name in runs else ""
        for make, name in ((_wrong, "error"), (_certain, "error"), (_pays, "hybrid"))
    )
    return "\n".join(
        [
            "1. **What does it get wrong?** A march that guesses how thick surfaces are is wrong "
            f"often, one that answers strictly seldom.{wrong} [What was counted]({docs}"
            "certified.md#what-was-counted).",
            "2. **Can it be made to get nothing wrong?** Yes, by lists of the triangles that touch "
            "each pixel, in place of depth alone; and more rays are answered than by the paper's "
            f"march.{certain} [Why certified answers are right]({docs}certified.md).",
            f"3. **When does it pay?** {pays or 'Not yet beside the packets of Embree on a CPU.'} "
            "[What a march costs, and what it could cost at most]"
            f"({docs}performance.md).",
            "",
        ]
    )


def index(runs: dict[str, RunData]) -> str:
    """Return the page docs/results/README.md."""
    lines = [
        "# Results",
        "",
        "Made by `make results` from the files of runs that are committed here, one folder each: "
        "`run.json`, `results.parquet`, `samples.parquet` and `verdicts.parquet` as measured, "
        "without pixels; `tables.md` and `figures/` rendered from them. A test renders all of them "
        "again and compares.",
        "",
        "## Findings",
        "",
        findings(runs, "../"),
        "## Runs",
        "",
        "| run | command | made |",
        "|---|---|---|",
    ]
    for name, words in RUNS.items():
        made = f"[tables]({name}/tables.md): {_made(runs[name])}" if name in runs else "not yet"
        lines.append(f"| {name} | `hybrid-rt {words}` | {made} |")
    lines += [
        "",
        "`make reference-runs` makes all of them, in about half an hour on two cores that do "
        "nothing else; `python bench/reference_runs.py NAME` makes one. They need the scenes "
        "sponza, bistro and nori_sphere ([scenes](../scenes.md)). Then `make results`.",
        "",
        "[certified.md](../certified.md) and [performance.md](../performance.md) show tables of "
        "these runs, put there by `make results`.",
        "",
        "[corpus.md](corpus.md) compares the readers of mesh files with others, by `make corpus`.",
        "",
    ]
    return "\n".join(lines)


def with_findings(text: str, runs: dict[str, RunData]) -> str:
    """Return the text of README with the findings in their place."""
    before, rest = text.split(BEGIN)
    _, after = rest.split(END)
    return before + BEGIN + findings(runs, "docs/") + END + after


def with_tables(text: str, tables: dict[str, list[Table]]) -> str:
    """Return the text of a page with its tables in their places; `tables` are those of each run.

    A run that is not committed leaves its tables out. Raise if a run has no table of that title.
    """

    def placed(found: re.Match[str]) -> str:
        begin, name, title, _, end = found.groups()
        if name not in tables:
            return begin + end
        for table in tables[name]:
            if table.title == title:
                words = f"*`hybrid-rt {RUNS[name]}`, [all its tables](results/{name}/tables.md).*"
                _, _, body = table.markdown().partition("\n\n")
                return f"{begin}\n{body}\n{words}\n\n{end}"
        titles = "; ".join(table.title for table in tables[name])
        raise ValueError(f"run {name} has no table {title!r}, but {titles}")

    return TABLE.sub(placed, text)


def _made(run: RunData) -> str:
    machine = run.meta["environment"]
    cells = sum(cell["state"] == "measured" for cell in run.meta["cells"])
    commit = str(machine.get("git") or "unknown")[:12]
    day = str(run.meta["started"])[:10]
    return f"{day}, {machine['cpu']}, {machine['threads']} threads, commit {commit}, {cells} cells"


def _named(run: RunData) -> pd.DataFrame:
    """Return the results of a run, its scenes called as its tables call them."""
    return run.results.assign(scene=[scene_name(run, str(name)) for name in run.results.scene])


def _wrong(results: pd.DataFrame) -> str:
    """Say which share of all mirror rays techniques answer wrongly, by their defaults."""
    rows = results[(results.workload == "mirror") & results.default & results.timed]
    share = {
        technique: 100 * (group.false_hit + group.false_miss).sum() / group.rays.sum()
        for technique, group in rows.groupby("technique")
    }
    guessed = sorted(share[name] for name in THICKNESS)
    rays = int(rows[rows.technique == "paper"].rays.sum())
    return (
        f" Of {rays:,} mirror rays in {_views(rows)}, the former answer {guessed[0]:.2g} to "
        f"{guessed[-1]:.2g} % with a hit or miss that is not there, the paper's march "
        f"{share['paper']:.2g} %: shares of all mirror rays, each technique with its default "
        "parameters."
    )


def _certain(results: pd.DataFrame) -> str:
    """Say how many certified answers are wrong, and how many rays have one."""
    rows = results[results.default]
    certified = rows[rows.technique == "certified"]
    wrong = int(certified[["false_hit", "false_miss", "wrong_primitive"]].to_numpy().sum())
    rate = Rate.of(wrong, int(certified.resolved.sum()))
    mirror = rows[rows.workload == "mirror"].groupby("technique")[["resolved", "rays"]].sum()
    alpha = 100 * mirror.resolved / mirror.rays
    kinds = certified.workload.nunique()
    return (
        f" {wrong or 'None'} of {rate.total:,} certified answers to {kinds} kinds of rays in "
        f"{_views(certified)} is wrong (at most {rate.high:.1e} of them at 95 %), and "
        f"{alpha['certified']:.0f} % of all mirror rays have one; the paper's march answers "
        f"{alpha['paper']:.0f} %."
    )


def _pays(results: pd.DataFrame) -> str:
    """Say the speed-up of the certified hybrid by scene, and its ceiling."""
    rows = results[(results.technique == "certified") & results.timed]
    free = rows.embree_ms / (rows.hybrid_ms - rows.march_ms)
    rows = rows.assign(free=free)
    best = rows.groupby(["scene", "point"])[["speedup", "free"]].agg(_geometric_mean).reset_index()
    best = best.loc[best.groupby("scene").speedup.idxmax()]
    by_default = rows[rows.default].groupby("scene")[["speedup", "free"]].agg(_geometric_mean)
    listed = ", ".join(f"{scene} {value:.2f}" for scene, value in by_default.speedup.items())
    fastest = ", ".join(f"{row.scene} {row.speedup:.2f}" for row in best.itertuples())
    ceiling = ", ".join(f"{scene} {value:.2f}" for scene, value in by_default.free.items())
    wins = [row.scene for row in best.itertuples() if row.speedup > 1]
    verdict = f"Here on {_words(wins)}" if wins else "On none of these scenes"
    size = f"{rows.width.iloc[0]}x{rows.height.iloc[0]}"
    return (
        f"{verdict}: at {size} the speed-up of the certified hybrid over the strongest Embree is "
        f"{listed} by default and {fastest} at its fastest; if the march took no time, it would be "
        f"{ceiling} by default."
    )


def _geometric_mean(values: pd.Series) -> float:
    return float(np.exp(np.log(values).mean()))


def _views(rows: pd.DataFrame) -> str:
    views = rows[["scene", "camera"]].drop_duplicates()
    return f"{len(views)} view{'s' * (len(views) != 1)} of {_words(views.scene.unique())}"


def _words(names: Iterable[Any]) -> str:
    *most, last = map(str, names)
    return f"{', '.join(most)} and {last}" if most else last


def main() -> None:
    """Write everything, and say what."""
    runs = committed()
    tables = {}
    for name, run in runs.items():
        for path in (run.folder / "figures").glob("**/*.*"):
            path.unlink()
        tables[name], written = render_run(run)
        print(f"{name}: {len(written)} files")
    for page in sorted(DOCS.glob("*.md")):
        text = page.read_text(encoding="utf-8")
        page.write_text(with_tables(text, tables), encoding="utf-8")
    (RESULTS / "README.md").write_text(index(runs), encoding="utf-8")
    text = README.read_text(encoding="utf-8")
    README.write_text(with_findings(text, runs), encoding="utf-8")
    missing = [name for name in RUNS if name not in runs]
    if missing:
        print(f"not measured yet: {', '.join(missing)}; see docs/results/README.md")


if __name__ == "__main__":
    sys.exit(main())
