"""Run an experiment of kind "frame": one depth buffer, with its mesh or without."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import hybrid_rt as hrt
import hybrid_rt_scenes as hrs
from hybrid_rt.errors import ArgumentError
from hybrid_rt_bench.kinds.frame.cell import count
from hybrid_rt_bench.kinds.frame.columns import SCHEMA
from hybrid_rt_bench.kinds.frame.spec import FrameExperiment
from hybrid_rt_bench.measure.errors import CellError
from hybrid_rt_bench.measure.experiment import Resolution
from hybrid_rt_bench.measure.frames import Frame, read_frame
from hybrid_rt_bench.measure.lifecycle import Outcome, Request, Session, carry_out, cell_keys
from hybrid_rt_bench.measure.loaded import LoadedScene, prepare
from hybrid_rt_bench.measure.plan import Plan, find_scene
from hybrid_rt_bench.measure.screens import Screens
from hybrid_rt_bench.measure.workloads import MESHLESS, Workload, get_workload

PICTURED = "mirror"
"""The workload whose maps are kept: one ray a pixel."""


@dataclass(frozen=True, eq=False)
class Task:
    """What is to be counted.

    Attributes
    ----------
    frame : Frame
    gbuffer : GBuffer
        What it shows.
    spec, loaded : optional
        The mesh, and the tracers over it; None for a frame alone.
    techniques : list of Technique
    workloads : list of Workload
    """

    frame: Frame
    gbuffer: hrt.GBuffer
    spec: hrs.SceneSpec | None
    loaded: LoadedScene | None
    techniques: list[hrt.Technique]
    workloads: list[Workload]


def run_frame(experiment: FrameExperiment, request: Request) -> Outcome:
    """Count what the screen answers in a frame and write the run's folder.

    Raises
    ------
    ArgumentError, UnknownNameError
        No depth buffer, one that cannot be read or does not fit its camera and mesh, a technique or
        a workload that is not known.
    """
    picks: dict[str, Any] = dict(request.picks)
    path, scene = picks.pop("depth", None), picks.pop("scene", None)
    if path is None:
        raise ArgumentError("--depth", "a depth buffer, an .npz, .exr or .png", "none")
    techniques = [hrt.TECHNIQUES[name]() for name in experiment.techniques]
    workloads = [get_workload(name) for name in experiment.workloads]
    plan = Plan()
    if scene is None:
        techniques, workloads = _without_mesh(techniques, workloads, plan)
    request.reporter.doing("reading the depth buffer")
    frame = read_frame(path, **picks)
    spec = None if scene is None else find_scene(scene)
    loaded = None if spec is None else prepare(spec.load(), request.workers)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # pixels unlike the mesh are told of below
        gbuffer = frame.gbuffer(None if loaded is None else loaded.reference)
    task = Task(frame, gbuffer, spec, loaded, techniques, workloads)
    return carry_out(
        experiment,
        request,
        plan,
        SCHEMA,
        stages=dict,  # nothing is timed
        measure_all=lambda session: _measure(session, task, Path(path).name),
    )


def _without_mesh(
    techniques: list[hrt.Technique], workloads: list[Workload], plan: Plan
) -> tuple[list[hrt.Technique], list[Workload]]:
    """Return what needs no mesh, and say what is left out."""
    left = [w.name for w in workloads if w.name not in MESHLESS]
    proving = [t.name for t in techniques if t.certified]
    plan.notes.append(
        "There is no mesh (--scene), so nobody can tell which answers are right: alpha and "
        "statuses only."
        + (f" Left out, since they need it: {', '.join(proving + left)}." if proving + left else "")
    )
    kept = [t for t in techniques if not t.certified], [w for w in workloads if w.name in MESHLESS]
    if not all(kept):
        raise ArgumentError("--scene", "a mesh, which all that was asked for needs", "none")
    return kept


def _measure(session: Session, task: Task, file: str) -> None:
    frame, gbuffer = task.frame, task.gbuffer
    session.reporter.total(len(task.techniques) * len(task.workloads), "techniques")
    session.writer.meta["frame"] = about = _about(frame, gbuffer, file)
    if about["unmatched"]:
        session.warn(
            f"{about['unmatched']} of {gbuffer.depth.size} pixels of the depth buffer are not as "
            "in the mesh: no ray starts there, and an answer there counts as the mesh says"
        )
    screens = Screens(gbuffer, session.threads)
    size = Resolution(width=frame.camera.width, height=frame.camera.height)
    for workload in task.workloads:
        keys = {**cell_keys(frame.name, "own", size), "workload": workload.name}

        def measure(workload: Workload = workload, keys: dict[str, Any] = keys) -> bool:
            _measure_cell(session, task, screens, workload, keys)
            return True

        session.measured(keys, measure, lambda: None)


def _measure_cell(
    session: Session, task: Task, screens: Screens, workload: Workload, keys: dict[str, Any]
) -> None:
    rays = workload.make(task.spec, screens.gbuffer, 0)
    if len(rays) == 0:
        raise CellError(f"{keys['scene']}, {workload.name}: no ray starts in the frame")
    rows, verdicts = [], []
    picture: dict[str, Any] = {"grey": _grey(screens.gbuffer)}
    for technique in task.techniques:
        session.reporter.doing(f"{keys['scene']}, {workload.name}, {technique.name}")
        counted = count(screens, rays, workload, technique, task.loaded)
        rows.append(counted.row)
        verdicts += counted.verdicts
        picture |= {f"{name}_{technique.name}": image for name, image in counted.maps.items()}
        session.reporter.advance()
    kept = picture if workload.name == PICTURED else None
    session.writer.add_cell(dict(keys), [], rows, verdicts, kept)


def _grey(gbuffer: hrt.GBuffer) -> np.typing.NDArray[np.uint8]:
    """Return how squarely each surface faces the viewer, in greys; white where there is none."""
    position, normal = gbuffer.position, gbuffer.normal
    y, x = np.nonzero(gbuffer.prim_id >= 0)
    view = gbuffer.camera.towards(position[y, x])
    head = np.abs(np.einsum("ij,ij->i", normal[y, x], view)) / np.linalg.norm(view, axis=1)
    grey = np.full(gbuffer.depth.shape, 255, np.uint8)
    grey[y, x] = np.round(60 + 180 * np.nan_to_num(head)).astype(np.uint8)
    return grey


def _about(frame: Frame, gbuffer: hrt.GBuffer, file: str) -> dict[str, Any]:
    """Return what is to be known of the frame."""
    covered = gbuffer.prim_id >= 0
    off = gbuffer.uncertainty
    doubtful = covered & (off > 0) if off is not None else np.zeros_like(covered)
    relative = off[doubtful] / gbuffer.depth[doubtful] if off is not None else np.empty(0)
    said = {k: v for k, v in frame.reading.items() if isinstance(v, str | int | float)}
    return {
        "file": file,
        "reading": {k: repr(v) if v != v else v for k, v in said.items()},
        "camera": repr(frame.camera),
        "dtype": str(frame.depth.dtype),
        "mesh": None if gbuffer.scene is None else gbuffer.scene.name,
        "covered": float(covered.mean()),
        "unmatched": 0 if gbuffer.matched is None else int((~gbuffer.matched).sum()),
        "uncertain": int(doubtful.sum()),
        "uncertainty": float(np.median(relative)) if len(relative) else 0.0,
    }
