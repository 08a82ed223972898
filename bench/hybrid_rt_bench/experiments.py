"""Experiments as TOML files say them: what is measured, apart from how.

The files lie in the folders of the kinds; a path to another TOML file works as well. A file's
``kind`` says which class its other keys belong to.
"""

from __future__ import annotations

import tomllib
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any, get_args

from pydantic import BaseModel, ValidationError

from hybrid_rt.errors import ArgumentError, UnknownNameError
from hybrid_rt_bench.measure.experiment import AnyExperiment
from hybrid_rt_bench.registry import kinds
from hybrid_rt_bench.results.files import reason

MOST_BYTES = 2**20
"""No experiment is longer than this."""


def experiments() -> dict[str, Traversable]:
    """Return the TOML files that come with the kinds, by the name of the experiment."""
    found = [item for kind in kinds.values() for item in kind.experiments().items()]
    return dict(sorted(found, key=lambda item: item[0]))


def experiment_names() -> list[str]:
    """Return the names of the experiments that come with the kinds."""
    return list(experiments())


def load_experiment(name: str, *, quick: bool = False) -> AnyExperiment:
    """Return the experiment of that name, or in the TOML file of that path.

    Parameters
    ----------
    name : str
    quick : bool
        Lay the file's ``[quick]`` table over the other keys.

    Raises
    ------
    UnknownNameError
        An experiment, a kind, or a key in the file, that is not known; with the nearest known one.
    ArgumentError
        A file that is no TOML, a value out of range, no ``[quick]`` table where one is needed.
    """
    if name.endswith(".toml") or "/" in name:
        return parse_experiment(_read(name), source=Path(name).name, quick=quick)
    known = experiments()
    if name not in known:
        raise UnknownNameError("experiment", name, known)
    return parse_experiment(known[name].read_text(encoding="utf-8"), source=name, quick=quick)


def parse_experiment(text: str, *, source: str, quick: bool = False) -> AnyExperiment:
    """Return the experiment that a TOML text says; `source` names it in messages."""
    try:
        data = tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError, ValueError) as error:
        said = "nested too deeply" if isinstance(error, RecursionError) else str(error)
        raise ArgumentError(source, "a TOML document", said) from None
    quick_table = data.pop("quick", None)
    if quick_table is not None and not isinstance(quick_table, dict):
        raise ArgumentError(f"{source}: quick", "a table", repr(quick_table))
    kind = data.get("kind", "paper")
    if not isinstance(kind, str):
        raise ArgumentError(f"{source}: kind", "the name of a kind", repr(kind))
    if kind not in kinds:
        raise UnknownNameError(f"kind in {source}", kind, kinds)
    if quick_table is not None and quick_table.get("kind", kind) != kind:
        raise ArgumentError(f"{source}: quick.kind", f"{kind!r}", repr(quick_table["kind"]))
    model = kinds[kind].spec_class()
    full = _validate(model, data, source)
    if not quick:
        if quick_table is not None:  # a mistake in it is reported at once, not by the next --quick
            _validate(model, {**data, **quick_table}, source)
        return full
    if quick_table is None:
        raise ArgumentError("--quick", f"a [quick] table in {source}", "none")
    merged = _validate(model, {**data, **quick_table}, source)
    return merged.model_copy(update={"quick": True})


def _read(name: str) -> str:
    try:
        path = Path(name)
        if not path.is_file():
            raise ArgumentError("experiment", "an existing TOML file", repr(name))
        with path.open("rb") as file:
            content = file.read(MOST_BYTES + 1)
        if len(content) > MOST_BYTES:
            raise ArgumentError(name, f"a TOML document of at most {MOST_BYTES} bytes", "more")
        return content.decode("utf-8")
    except (OSError, ValueError) as error:  # a name with a NUL, bytes that are no text
        raise ArgumentError("experiment", "a readable TOML file", reason(error)) from None


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
        raise ArgumentError(f"{source}: {where}", message, _short(first["input"])) from None
    except RecursionError:
        raise ArgumentError(source, "tables nested less deeply", "more") from None


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


def _short(value: Any) -> str:
    """Return a value in a form that is no longer than a line."""
    text = repr(value)
    return text if len(text) <= 80 else text[:77] + "..."
