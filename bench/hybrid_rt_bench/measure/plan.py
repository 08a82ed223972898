"""Decide which scenes and cameras a run measures, before anything is loaded or traced."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import hybrid_rt as hrt
import hybrid_rt_scenes as hrs
from hybrid_rt_bench.measure import viewpoints
from hybrid_rt_bench.measure.errors import NothingToRunError
from hybrid_rt_bench.measure.experiment import SceneEntry, SceneExperiment


@dataclass(frozen=True)
class PlannedScene:
    """A scene that will be measured.

    Attributes
    ----------
    spec : SceneSpec
    row : str
        The row of the paper's tables that it stands beside; empty for one that stands in.
    cameras : tuple of str
    size : int or None
        Triangles asked of a built-in scene.
    """

    spec: hrs.SceneSpec
    row: str
    cameras: tuple[str, ...]
    size: int | None

    @property
    def name(self) -> str:
        """What results call it: the scene's name, and its size where one was asked for."""
        return self.spec.name if self.size is None else f"{self.spec.name} {size_text(self.size)}"


def size_text(size: int) -> str:
    """Return a number of triangles, > 0, as it is written: a power of two as 2^n."""
    return f"2^{size.bit_length() - 1}" if size & (size - 1) == 0 else str(size)


@dataclass
class Plan:
    """What will be measured, and what was to be said about it.

    Attributes
    ----------
    scenes : list of PlannedScene
    notes : list of str
        Missing scenes, stand-ins, scenes without the cameras asked for.
    unreadable : list of (str, str)
        Mesh files that exist and cannot be read, with the reason.
    """

    scenes: list[PlannedScene] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    unreadable: list[tuple[str, str]] = field(default_factory=list)


def make_plan(
    experiment: SceneExperiment,
    scenes: Sequence[str] | None = None,
    cameras: Sequence[str] | None = None,
) -> Plan:
    """Return what to measure.

    Parameters
    ----------
    experiment : SceneExperiment
    scenes : sequence of str, optional
        Names, or paths of mesh files or definitions, in place of the experiment's scenes.
    cameras : sequence of str, optional
        Names; every scene takes those that it has. Or files of cameras, ``FILE`` or ``FILE:NAME``:
        every scene takes those. Default: all (the first few in quick form).

    Raises
    ------
    UnknownNameError
        A scene, or a camera that none of the scenes has; with the nearest known name.
    MeshFileError
        A path where there is no file.
    NothingToRunError
        Every scene is missing.
    """
    plan = Plan()
    cameras, given = _given_cameras(cameras)
    for entry in _entries(experiment, scenes):
        try:
            spec = _available(entry, plan, allow_stand_in=scenes is None)
        except hrt.MeshFileError as error:
            if not Path(entry.name).is_file():
                raise
            plan.unreadable.append((entry.name, str(error)))
            continue
        if spec is not None:
            if given:
                spec = _with_cameras(spec, given)
            names = _camera_names(entry, spec, experiment, cameras)
            # What stands in for a scene of the paper is not to be held against the paper.
            row = entry.row if spec.name == entry.name else ""
            planned = PlannedScene(spec, row, names, entry.size)
            if planned.name in [scene.name for scene in plan.scenes]:  # it stands in for two
                plan.notes.append(f"scene {planned.name!r} is measured only once")
            else:
                plan.scenes.append(planned)
    if cameras is not None:
        _check_cameras(plan, cameras)
    if not plan.scenes and not plan.unreadable:
        raise NothingToRunError("nothing left to run\n" + "\n".join(plan.notes))
    return plan


def find_scene(name: str) -> hrs.SceneSpec:
    """Return a scene by its registered name, or from the path of a mesh file or a definition."""
    if name not in hrs.scene_names() and ("/" in name or Path(name).suffix or Path(name).is_file()):
        return hrs.scene_from_path(name)
    return hrs.get_scene(name)


def _given_cameras(
    cameras: Sequence[str] | None,
) -> tuple[list[str] | None, dict[str, hrs.CameraSpec]]:
    """Return names of cameras, and the views of those that come from files, by these names."""
    if cameras is None:
        return None, {}
    found: dict[str, hrt.Camera] = {}
    names: list[str] = []
    for text in cameras:
        if not viewpoints.is_file(text):
            names.append(text)
            continue
        for name, camera in viewpoints.cameras_in("--cameras", text).items():
            if name in found:
                raise hrt.ArgumentError("--cameras", "cameras of different names", repr(name))
            found[name] = camera
    given = hrs.given_cameras(found)
    return [*names, *given], given


def _with_cameras(spec: hrs.SceneSpec, given: dict[str, hrs.CameraSpec]) -> hrs.SceneSpec:
    """Return a scene with more cameras; one of the same name gives way."""
    return spec.model_copy(update={"cameras": {**spec.cameras, **given}})


def _entries(experiment: SceneExperiment, scenes: Sequence[str] | None) -> list[SceneEntry]:
    if scenes is None:
        return experiment.scenes
    found = []
    for name in dict.fromkeys(scenes):
        known = [entry for entry in experiment.scenes if entry.name == name]
        found += known or [SceneEntry(name=name, row=experiment.row_of(name))]
    return found


def _available(entry: SceneEntry, plan: Plan, *, allow_stand_in: bool) -> hrs.SceneSpec | None:
    spec = find_scene(entry.name)
    missing = spec.missing()
    if missing is None:
        return spec
    if allow_stand_in and entry.stand_in is not None:
        plan.notes.append(f"{missing} The built-in scene {entry.stand_in!r} stands in for it.")
        return hrs.get_scene(entry.stand_in)
    plan.notes.append(missing)
    return None


def _camera_names(
    entry: SceneEntry,
    spec: hrs.SceneSpec,
    experiment: SceneExperiment,
    cameras: Sequence[str] | None,
) -> tuple[str, ...]:
    if cameras is not None:
        return tuple(name for name in dict.fromkeys(cameras) if name in spec.cameras)
    if entry.cameras is not None and spec.name == entry.name:
        for name in entry.cameras:
            spec.camera(name, 1, 1)  # refuses an unknown one, with a suggestion
        return tuple(entry.cameras)
    return tuple(spec.cameras)[: experiment.cameras]


def _check_cameras(plan: Plan, cameras: Sequence[str]) -> None:
    known = {name for scene in plan.scenes for name in scene.spec.cameras}
    for name in cameras:
        if name not in known and plan.scenes:
            raise hrt.UnknownNameError("camera", name, known)
    for scene in plan.scenes:
        if not scene.cameras:
            has = ", ".join(scene.spec.cameras)
            plan.notes.append(
                f"scene {scene.spec.name!r} is left out: it has none of the cameras asked for "
                f"(it has {has})"
            )
    plan.scenes = [scene for scene in plan.scenes if scene.cameras]
