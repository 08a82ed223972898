"""A scene made ready to be measured, with the tracers over it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import hybrid_rt as hrt
from hybrid_rt_bench.measure import strongest


@dataclass(frozen=True, eq=False)
class LoadedScene:
    """A scene with the tracers over it.

    Attributes
    ----------
    scene : Scene
    candidates : list of Candidate
        What competes for the strongest Embree.
    reference : EmbreeTracer
        In robust mode, for the judge and for pictures.
    truth : Truth
        For the judge.
    build_seconds : dict of float
        By mode.
    """

    scene: hrt.Scene
    candidates: list[strongest.Candidate]
    reference: hrt.EmbreeTracer
    truth: hrt.Truth
    build_seconds: dict[str, float]


def prepare(scene: hrt.Scene, threads: int) -> LoadedScene:
    """Build the acceleration structures of both modes."""
    path = native_path()
    robust, default = (
        hrt.EmbreeTracer(scene, threads=threads, path=path, robust=mode) for mode in (True, False)
    )
    seconds = {"robust": robust.build_seconds, "default": default.build_seconds}
    truth = hrt.Truth(scene, threads=threads)
    return LoadedScene(scene, strongest.candidates(robust, default), robust, truth, seconds)


def native_path() -> Literal["packet", "run"]:
    """Return the path through Embree that copies nothing, if this machine has it."""
    return "packet" if hrt.embree_problem() is None else "run"
