"""Experiments as TOML files say them: what is measured, apart from how.

An experiment is a product of scenes, cameras and resolutions, for each of which every technique is
measured. The definitions lie in the package's ``experiments`` folder; a path to another TOML file
works as well.
"""

from __future__ import annotations

import re
import tomllib
from importlib import resources
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError

from hybrid_rt.errors import ArgumentError, UnknownNameError

SCHEMA = 1


class Resolution(BaseModel):
    """A picture's size in pixels, written ``1280x720``."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    width: int = Field(ge=1, le=32768)
    height: int = Field(ge=1, le=32768)

    @classmethod
    def parse(cls, argument: str, text: str) -> Resolution:
        """Return the resolution that `text` says.

        Raises
        ------
        ArgumentError
            Anything but ``WIDTHxHEIGHT`` with both in 1 to 32768.
        """
        match = re.fullmatch(r"\s*(\d{1,6})\s*[xX×]\s*(\d{1,6})\s*", text)
        if match:
            width, height = int(match[1]), int(match[2])
            if 1 <= width <= 32768 and 1 <= height <= 32768:
                return cls(width=width, height=height)
        raise ArgumentError(
            argument, "WIDTHxHEIGHT in pixels, each 1 to 32768, such as 1280x720", repr(text)
        )

    def __str__(self) -> str:
        return f"{self.width}x{self.height}"


def _resolution(value: Any) -> Any:
    return Resolution.parse("resolution", value) if isinstance(value, str) else value


ResolutionText = Annotated[Resolution, BeforeValidator(_resolution)]


class SceneEntry(BaseModel):
    """One scene of an experiment.

    Attributes
    ----------
    name : str
        A registered scene, or a path to a mesh file.
    row : str
        The row of the paper's tables that it stands beside; empty for none.
    stand_in : str, optional
        Built-in scene that takes its place where its files are absent.
    size : int, optional
        Number of triangles asked of a built-in scene that has a size.
    cameras : list of str, optional
        Default: all of them.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: str = Field(min_length=1)
    row: str = ""
    stand_in: str | None = None
    size: int | None = Field(default=None, ge=1)
    cameras: list[str] | None = Field(default=None, min_length=1)


class Settings(BaseModel):
    """What of an experiment ``--quick`` may change."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    scenes: list[SceneEntry] = Field(min_length=1)
    resolutions: list[ResolutionText] = Field(min_length=1)
    picture: ResolutionText
    rounds: int = Field(ge=1)
    warmup: int = Field(default=1, ge=0)
    cameras: int | None = Field(default=None, ge=1)
    derivatives: Literal["plane", "quad"] = "plane"
    selection_rays: int = Field(default=131072, ge=1024)


class Experiment(Settings):
    """A whole experiment.

    Attributes
    ----------
    name, title : str
    techniques : list of str
        Names registered in `hybrid_rt_bench.techniques`.
    scenes, resolutions, picture, rounds, warmup, cameras, derivatives, selection_rays
        As the comments in ``experiments/paper.toml`` say. `cameras` limits the number of cameras a
        scene.
    quick : bool
        Whether the quick form was asked for.
    """

    schema_version: Literal[1] = Field(default=1, alias="schema")
    name: str
    title: str
    techniques: list[str] = Field(min_length=1)
    quick: bool = False

    def row_of(self, scene: str) -> str:
        """Return the paper's row for a scene given by name on the command line."""
        for entry in self.scenes:
            if scene in (entry.name, entry.stand_in):
                return entry.row
        return ""


def experiment_names() -> list[str]:
    """Return the names of the experiments that come with the package."""
    folder = resources.files("hybrid_rt_bench") / "experiments"
    return sorted(f.name[:-5] for f in folder.iterdir() if f.name.endswith(".toml"))


def load_experiment(name: str, *, quick: bool = False) -> Experiment:
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


def parse_experiment(text: str, *, source: str, quick: bool = False) -> Experiment:
    """Return the experiment that a TOML text says; `source` names it in messages."""
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ArgumentError(source, "a TOML document", str(error)) from error
    quick_table = data.pop("quick", None)
    full = _validate(Experiment, data, source)
    if not quick:
        if quick_table is not None:  # a mistake in it is reported at once, not by the next --quick
            _validate(Experiment, {**data, **quick_table}, source)
        return full
    if quick_table is None:
        raise ArgumentError("--quick", f"a [quick] table in {source}", "none")
    merged = _validate(Experiment, {**data, **quick_table}, source)
    return merged.model_copy(update={"quick": True})


def _validate(model: type[Experiment], data: dict[str, Any], source: str) -> Experiment:
    try:
        return model.model_validate(data)
    except ValidationError as error:
        # A misspelt key is both unknown and missing; the former says more.
        first = min(error.errors(), key=lambda e: e["type"] != "extra_forbidden")
        where = ".".join(str(part) for part in first["loc"])
        if first["type"] == "extra_forbidden":
            keys = _keys(first["loc"])
            raise UnknownNameError(f"key in {source}", str(first["loc"][-1]), keys) from None
        if first["type"] == "missing":
            raise ArgumentError(f"{source}: {where}", "a value", "none") from None
        cause = first.get("ctx", {}).get("error")
        if isinstance(cause, ArgumentError):
            raise ArgumentError(f"{source}: {where}", cause.expected, cause.got) from None
        message = first["msg"][0].lower() + first["msg"][1:]
        raise ArgumentError(f"{source}: {where}", message, repr(first["input"])) from None


def _keys(location: tuple[int | str, ...]) -> list[str]:
    """Return the keys known in the table where a key was refused."""
    if location[0] == "scenes" and len(location) > 1:
        return sorted(SceneEntry.model_fields)
    fields = Experiment.model_fields
    return sorted({field.alias or name for name, field in fields.items()} | {"quick"})
