"""Registries: how techniques, tracers, kinds of experiment and scenes are found by name.

What can be chosen by name comes from three places: modules of a package of this project, each of
which registers what it defines when it is imported; entry points of installed distributions; and
`Registry.register` in a script. None of them needs a change to a list.
"""

from __future__ import annotations

import importlib
import pkgutil
import re
import warnings
from collections.abc import Iterator, Mapping
from importlib import metadata
from typing import Any, Generic, TypeVar

from hybrid_rt import _check
from hybrid_rt.errors import ArgumentError, HybridRTError, PluginError, UnknownNameError

Thing = TypeVar("Thing")

NAME = re.compile(r"[a-z][a-z0-9_.+-]{0,63}")


class Registry(Mapping[str, Thing], Generic[Thing]):
    """Things by their names, sorted.

    Parameters
    ----------
    what : str
        What they are, for messages: "technique".
    group : str
        The group of entry points that offer such things. An entry point names the thing itself.
    package : str, optional
        The package whose modules register some when they are imported.
    """

    def __init__(self, what: str, group: str, package: str = "") -> None:
        self.what = _check.text("what", what)
        self.group = _check.text("group", group)
        self.package = _check.text("package", package)
        self._things: dict[str, Thing] = {}
        self._broken: dict[str, PluginError] = {}
        self._looked = False

    def register(self, thing: Thing) -> Thing:
        """Add a thing under its attribute `name`, and return it; also as a decorator.

        Raises
        ------
        ArgumentError
            No name, a name that is none, or one that something else has. What was defined in the
            same place before, as by a cell of a notebook that is run again, is replaced.
        """
        self.check(thing)
        name = getattr(thing, "name", None)
        if not isinstance(name, str) or not NAME.fullmatch(name):
            expected = "lower-case letters, digits and any of _ . + -, a letter first"
            raise ArgumentError(f"name of a {self.what}", expected, _check.describe(name))
        before = self._things.get(name)
        if before is not None and before != thing and _place(before) != _place(thing):
            got = f"{name!r}, which {_place(before)} has"
            raise ArgumentError(f"name of a {self.what}", "one that is not taken", got)
        self._things[name] = thing
        return thing

    def check(self, thing: Any) -> None:
        """Raise an ArgumentError unless `thing` can be registered here; for subclasses."""

    def __getitem__(self, name: str) -> Thing:
        self._look()
        if not isinstance(name, str):
            raise ArgumentError(f"name of a {self.what}", "a str", _check.describe(name))
        if name in self._broken:
            raise self._broken[name]
        if name not in self._things:
            raise UnknownNameError(self.what, name, self._things)
        return self._things[name]

    def __iter__(self) -> Iterator[str]:
        self._look()
        return iter(sorted(self._things))

    def __len__(self) -> int:
        self._look()
        return len(self._things)

    def __contains__(self, name: object) -> bool:
        self._look()
        return isinstance(name, str) and name in self._things

    def names(self) -> list[str]:
        """Return all names, sorted."""
        return list(self)

    def _look(self) -> None:
        """Import what registers itself, once, when first asked for anything."""
        if self._looked:
            return
        self._looked = True
        if self.package:
            package = importlib.import_module(self.package)
            for module in pkgutil.iter_modules(package.__path__, f"{self.package}."):
                importlib.import_module(module.name)
        for entry in metadata.entry_points(group=self.group):
            try:
                thing = entry.load()
                if self._things.get(getattr(thing, "name", "")) is not thing:
                    self.register(thing)
            except Exception as error:  # whatever somebody else's module does
                source = f" of {entry.dist.name}" if entry.dist is not None else ""
                reason = str(error) if isinstance(error, HybridRTError) else repr(error)
                broken = PluginError(
                    f"{self.what} {entry.name!r}{source} cannot be loaded: {reason}"
                )
                broken.__cause__ = error
                self._broken[entry.name] = broken
                warnings.warn(str(broken), stacklevel=3)


def _place(thing: Any) -> str:
    """Return where a class is defined, or which object a thing is."""
    if isinstance(thing, type):
        return f"{thing.__module__}.{thing.__qualname__}"
    return f"a {type(thing).__qualname__} at {id(thing):#x}"
