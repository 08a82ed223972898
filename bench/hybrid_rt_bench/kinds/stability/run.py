"""Run an experiment of kind "stability": the hard set over techniques and tracers."""

from __future__ import annotations

import dataclasses
import functools
import json
from collections.abc import Callable
from typing import Any

import hybrid_rt as hrt
from hybrid_rt import TECHNIQUES
from hybrid_rt_bench.kinds.stability.columns import SCHEMA
from hybrid_rt_bench.kinds.stability.spec import StabilityExperiment
from hybrid_rt_bench.measure import compiling
from hybrid_rt_bench.measure.errors import reason_of
from hybrid_rt_bench.measure.lifecycle import Outcome, Request, Session, carry_out
from hybrid_rt_bench.measure.loaded import native_path
from hybrid_rt_bench.measure.plan import Plan
from hybrid_rt_scenes.hard_cases import (
    BuiltCase,
    CaseResult,
    HardCase,
    get_hard_case,
    grade,
    hard_case_names,
)

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


def run_stability(experiment: StabilityExperiment, request: Request) -> Outcome:
    """Run every entrant over every case and write the run's folder.

    `broken` of the outcome names the cases that a promised technique fails. One that raises an
    error fails the case; the others go on.
    """
    threads = request.workers
    named = request.picks.get("cases") or experiment.cases or hard_case_names()
    chosen = [get_hard_case(name) for name in dict.fromkeys(named)]
    techniques = [TECHNIQUES[name]() for name in experiment.techniques or TECHNIQUES]
    entrants = _entrants(experiment, techniques, threads)
    failed_by: dict[str, list[str]] = {}
    outcome = carry_out(
        experiment,
        request,
        Plan(),
        SCHEMA,
        stages=lambda: stages_to_compile(entrants),
        measure_all=lambda session: _measure_all(session, chosen, entrants, failed_by),
    )
    broken = tuple(
        f"{name} fails {len(failed_by[name])} of {outcome.measured} hard cases: "
        + ", ".join(failed_by[name])
        for name in experiment.promised
        if name in failed_by
    )
    return dataclasses.replace(outcome, broken=broken)


def _measure_all(
    session: Session,
    chosen: list[HardCase],
    entrants: list[Entrant],
    failed_by: dict[str, list[str]],
) -> None:
    session.reporter.total(len(chosen), "cases")
    for case in chosen:
        session.reporter.doing(case.name)
        keys = {"case": case.name}
        found = session.measured(keys, lambda: _measure(case, entrants), lambda: None)  # noqa: B023
        session.reporter.advance()
        if found is None:
            continue
        cell, rows = found
        for row in rows:
            if row["state"] != "pass":
                failed_by.setdefault(row["technique"], []).append(case.name)
            if row["error"]:
                session.warn(f"{row['technique']} raised an error on {case.name}: {row['error']}")
        session.writer.add_cell({**keys, **cell}, [], rows, [])


def _measure(case: HardCase, entrants: list[Entrant]) -> tuple[dict[str, Any], list[Any]]:
    built = case.build()
    cell = {
        "what_goes_wrong": case.what_goes_wrong,
        "rays": len(built.rays),
        "triangles": len(built.scene),
        "hits": int((built.truth.prim_id >= 0).sum()),
        "ambiguous": int(built.truth.ambiguous.sum()),
    }
    return cell, [_row(entrant, built) for entrant in entrants]


def stages_to_compile(entrants: list[Entrant]) -> compiling.Stages:
    """Return what is to be compiled: every entrant, on the first case."""
    build = functools.cache(get_hard_case(hard_case_names()[0]).build)
    return {
        "raster": build,
        **{entrant.name: functools.partial(_row, entrant, build()) for entrant in entrants},
    }


def _entrants(
    experiment: StabilityExperiment, techniques: list[hrt.Technique], threads: int
) -> list[Entrant]:
    def marching(technique: hrt.Technique) -> Callable[[BuiltCase], Answers]:
        def answer(case: BuiltCase) -> Answers:
            steps = {} if case.max_steps is None else {"max_steps": case.max_steps}
            changed = technique
            if hasattr(technique, "max_steps"):
                changed = dataclasses.replace(technique, **steps)
            screen = changed.prepare(case.gbuffer, threads=threads)
            return hrt.march(case.rays, screen, threads=threads)

        return answer

    def tracing(robust: bool) -> Callable[[BuiltCase], Answers]:
        def answer(case: BuiltCase) -> Answers:
            tracer = hrt.EmbreeTracer(
                case.scene, robust=robust, path=native_path(), threads=threads
            )
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
