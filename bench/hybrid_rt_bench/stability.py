"""Run an experiment of kind "stability": the hard set over techniques and tracers."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numba

import hybrid_rt as hrt
from hybrid_rt_bench import env
from hybrid_rt_bench.progress import Reporter
from hybrid_rt_bench.results import ReportsError, create_run
from hybrid_rt_bench.run import Outcome, reason_of
from hybrid_rt_bench.spec_stability import StabilityExperiment
from hybrid_rt_bench.techniques import TECHNIQUES, Technique, get_technique
from hybrid_rt_scenes.hard_cases import (
    BuiltCase,
    CaseResult,
    get_hard_case,
    grade,
    hard_case_names,
)

CASE_KEYS = ("case",)

Answers = hrt.Marched | hrt.Hits


@dataclasses.dataclass(frozen=True)
class Entrant:
    """A technique or a tracer.

    Attributes
    ----------
    name : str
    exact : bool
        Whether it is held to exact answers.
    answer : callable
        Returns its answers to the rays of a case.
    """

    name: str
    exact: bool
    answer: Callable[[BuiltCase], Answers]


def run_stability(
    experiment: StabilityExperiment,
    *,
    reporter: Reporter,
    cases: Sequence[str] | None = None,
    threads: int | None = None,
    out: Path = Path("reports"),
    command: Sequence[str] = (),
) -> Outcome:
    """Run every entrant over every case and write the run's folder.

    Parameters
    ----------
    experiment : StabilityExperiment
    reporter : Reporter
    cases : sequence of str, optional
        In place of the experiment's.
    threads, out, command
        As in `hybrid_rt_bench.run.run_experiment`.

    Returns
    -------
    Outcome
        `broken` names the cases that a promised technique fails. One that raises an error fails the
        case; the others go on.

    Raises
    ------
    UnknownNameError, ArgumentError
        Before anything is run.
    ReportsError
        The folder can no longer be written to.
    """
    threads = env.checked_threads(threads)
    named = cases or experiment.cases or hard_case_names()
    chosen = [get_hard_case(name) for name in dict.fromkeys(named)]
    techniques = [get_technique(name) for name in experiment.techniques or TECHNIQUES]
    competing = _entrants(experiment, techniques, threads)
    writer = create_run(
        out,
        experiment.name,
        {
            "kind": experiment.kind,
            "command": list(command),
            "spec": experiment.model_dump(mode="json", by_alias=True),
            "notes": [],
            "warnings": [],
        },
        CASE_KEYS,
    )
    numba.set_num_threads(threads)
    reporter.total(len(chosen), "cases")
    failed_by: dict[str, list[str]] = {}
    interrupted = False
    try:
        for number, case in enumerate(chosen):
            reporter.doing(case.name)
            cell: dict[str, Any] = {"case": case.name, "what_goes_wrong": case.what_goes_wrong}
            try:
                built = case.build()
                cell |= {"rays": len(built.rays), "triangles": len(built.scene)}
                hits = int((built.truth.prim_id >= 0).sum())
                cell |= {"hits": hits, "ambiguous": int(built.truth.ambiguous.sum())}
                rows = [_row(entrant, built) for entrant in competing]
            except ReportsError:
                raise
            except Exception as error:  # a case that cannot be built must not cost the others
                reporter.say(f"failed: {case.name}: {reason_of(error)}", "bold red")
                writer.fail_cell(cell, reason_of(error))
                continue
            if number == 0:  # not before a parallel kernel has run
                writer.meta["environment"] = env.describe(threads)
            for row in rows:
                if row["state"] != "pass":
                    failed_by.setdefault(row["technique"], []).append(case.name)
                if row["error"]:
                    text = f"{row['technique']} raised an error on {case.name}: {row['error']}"
                    writer.meta["warnings"].append(text)
                    reporter.say(f"warning: {text}", "yellow")
            writer.add_cell(cell, [], rows, [])
            reporter.advance()
    except KeyboardInterrupt:
        interrupted = True
    writer.finish(interrupted=interrupted)
    broken = tuple(
        f"{name} fails {len(failed_by[name])} of {writer.measured} hard cases: "
        + ", ".join(failed_by[name])
        for name in experiment.promised
        if name in failed_by
    )
    return Outcome(writer.folder, writer.measured, len(writer.failed), interrupted, broken)


def _entrants(
    experiment: StabilityExperiment, techniques: list[Technique], threads: int
) -> list[Entrant]:
    def marching(technique: Technique) -> Callable[[BuiltCase], Answers]:
        def answer(case: BuiltCase) -> Answers:
            mode = technique.mode
            if case.max_steps is not None and hasattr(mode, "max_steps"):
                mode = dataclasses.replace(mode, max_steps=case.max_steps)
            pyramid = hrt.build_depth_pyramid(case.gbuffer, threads=threads)
            return hrt.march(case.rays, case.gbuffer, pyramid, mode, threads=threads)

        return answer

    def tracing(robust: bool) -> Callable[[BuiltCase], Answers]:
        path = "packet" if hrt.packet_available() is None else "run"

        def answer(case: BuiltCase) -> Answers:
            tracer = hrt.EmbreeTracer(case.scene, robust=robust, path=path, threads=threads)
            return tracer.intersect(case.rays)

        return answer

    marchers = [Entrant(t.name, t.name in experiment.promised, marching(t)) for t in techniques]
    return marchers + [
        Entrant(name, True, tracing(name == "embree robust")) for name in experiment.tracers
    ]


def _row(entrant: Entrant, case: BuiltCase) -> dict[str, Any]:
    """Return what an entrant's answers to a case are worth, as a row of the results."""
    try:
        result = grade(case, entrant.answer(case), exact=entrant.exact)
    except Exception as error:  # a technique that raises fails its case and no other
        result = CaseResult.nothing(case.name, len(case.rays), exact=entrant.exact)
        return _columns(entrant, result, "error", reason_of(error))
    return _columns(entrant, result, "pass" if result.passed else "fail", "")


def _columns(entrant: Entrant, result: CaseResult, state: str, error: str) -> dict[str, Any]:
    counts = dataclasses.asdict(result)
    del counts["case"], counts["first"]
    return {
        "technique": entrant.name,
        "state": state,
        **counts,
        "wrong": result.wrong,
        "first": json.dumps(result.first),
        "error": error,
    }
