"""Experiments as TOML files say them: what is measured, apart from how.

The definitions lie in the package's ``experiments`` folder; a path to another TOML file works as
well. A file's ``kind`` says which class its other keys belong to. An experiment of kind "paper" is
a product of scenes, cameras and resolutions, for each of which every technique is timed.
"""

from __future__ import annotations

import tomllib
from importlib import resources
from pathlib import Path
from typing import Any, ClassVar, Literal, Self, get_args

from pydantic import BaseModel, Field, ValidationError

from hybrid_rt.errors import ArgumentError, UnknownNameError
from hybrid_rt_bench.error_spec import ErrorExperiment
from hybrid_rt_bench.spec_base import (
    AnyExperiment,
    Resolution,
    ResolutionText,
    SceneEntry,
    SceneExperiment,
)
from hybrid_rt_bench.spec_peers import PeersExperiment
from hybrid_rt_bench.spec_roofline import RooflineExperiment
from hybrid_rt_bench.spec_scaling import ScalingExperiment
from hybrid_rt_bench.spec_stability import StabilityExperiment

__all__ = [
    "KINDS",
    "AnyExperiment",
    "Experiment",
    "Resolution",
    "SceneEntry",
    "experiment_names",
    "load_experiment",
    "parse_experiment",
]


class Experiment(SceneExperiment):
    """An experiment of kind "paper".

    Attributes
    ----------
    techniques : list of str
        Names registered in `hybrid_rt_bench.techniques`.
    scenes, resolutions, picture, rounds, warmup, cameras, derivatives, selection_rays
        As the comments in ``experiments/paper.toml`` say. `cameras` limits the number of cameras a
        scene.
    """

    options: ClassVar[frozenset[str]] = frozenset({"scenes", "cameras", "resolutions", "rounds"})

    kind: Literal["paper"] = "paper"
    techniques: list[str] = Field(min_length=1)
    resolutions: list[ResolutionText] = Field(min_length=1)
    picture: ResolutionText
    rounds: int = Field(ge=1)
    warmup: int = Field(default=1, ge=0)
    derivatives: Literal["plane", "quad"] = "plane"
    selection_rays: int = Field(default=131072, ge=1024)

    def overridden(self, resolutions: list[Resolution] | None, rounds: int | None) -> Self:
        """Return the experiment with what the command line changes; None changes nothing."""
        changed = super().overridden(resolutions, rounds)
        if resolutions is None or self.picture in resolutions:
            return changed
        # The figure is made at the middle one of the sizes measured.
        order = sorted(resolutions, key=lambda r: r.width * r.height)
        return changed.model_copy(update={"picture": order[len(order) // 2]})


KINDS: dict[str, type[AnyExperiment]] = {
    "paper": Experiment,
    "error": ErrorExperiment,
    "stability": StabilityExperiment,
    "scaling": ScalingExperiment,
    "peers": PeersExperiment,
    "roofline": RooflineExperiment,
}
"""The class of each kind of experiment."""


def experiment_names() -> list[str]:
    """Return the names of the experiments that come with the package."""
    folder = resources.files("hybrid_rt_bench") / "experiments"
    return sorted(f.name[:-5] for f in folder.iterdir() if f.name.endswith(".toml"))


def load_experiment(name: str, *, quick: bool = False) -> AnyExperiment:
    """Return the experiment of that name, or in the TOML file of that path.

    Parameters
    ----------
    name : str
    quick : bool
        Lay the file's ``[quick]`` table over the rest.

    Raises
    ------
    UnknownNameError
        An experiment, or a key in the file, that is not known; with the nearest known one.
    ArgumentError
        A file that is no TOML, a value out of range, no ``[quick]`` table where one is needed.
    """
    if name.endswith(".toml") or "/" in name:
        path = Path(name)
        if not path.is_file():
            raise ArgumentError("experiment", "an existing TOML file", repr(name))
        text = path.read_text(encoding="utf-8")
    elif name in experiment_names():
        text = (resources.files("hybrid_rt_bench") / "experiments" / f"{name}.toml").read_text()
    else:
        raise UnknownNameError("experiment", name, experiment_names())
    return parse_experiment(text, source=Path(name).name, quick=quick)


def parse_experiment(text: str, *, source: str, quick: bool = False) -> AnyExperiment:
    """Return the experiment that a TOML text says; `source` names it in messages."""
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ArgumentError(source, "a TOML document", str(error)) from error
    quick_table = data.pop("quick", None)
    kind = data.get("kind", "paper")
    if kind not in KINDS:
        raise UnknownNameError(f"kind in {source}", str(kind), KINDS)
    model = KINDS[kind]
    full = _validate(model, data, source)
    if not quick:
        if quick_table is not None:  # a mistake in it is reported at once, not by the next --quick
            _validate(model, {**data, **quick_table}, source)
        return full
    if quick_table is None:
        raise ArgumentError("--quick", f"a [quick] table in {source}", "none")
    merged = _validate(model, {**data, **quick_table}, source)
    return merged.model_copy(update={"quick": True})


def _validate(model: type[AnyExperiment], data: dict[str, Any], source: str) -> AnyExperiment:
    try:
        return model.model_validate(data)
    except ValidationError as error:
        # A misspelt key is both unknown and missing; the former says more.
        first = min(error.errors(), key=lambda e: e["type"] != "extra_forbidden")
        where = ".".join(str(part) for part in first["loc"])
        if first["type"] == "extra_forbidden":
            keys = _keys(model, first["loc"])
            raise UnknownNameError(f"key in {source}", str(first["loc"][-1]), keys) from None
        if first["type"] == "missing":
            raise ArgumentError(f"{source}: {where}", "a value", "none") from None
        cause = first.get("ctx", {}).get("error")
        if isinstance(cause, ArgumentError):
            raise ArgumentError(f"{source}: {where}", cause.expected, cause.got) from None
        message = first["msg"][0].lower() + first["msg"][1:]
        raise ArgumentError(f"{source}: {where}", message, repr(first["input"])) from None


def _keys(model: type[BaseModel], location: tuple[int | str, ...]) -> list[str]:
    """Return the keys known in the table where a key was refused."""
    top = True
    for part in location[:-1]:
        if part in model.model_fields:
            annotation = model.model_fields[str(part)].annotation
            for inner in get_args(annotation) or (annotation,):
                if isinstance(inner, type) and issubclass(inner, BaseModel):
                    model, top = inner, False
    names = {field.alias or name for name, field in model.model_fields.items()}
    return sorted(names | {"quick"} if top else names)
