"""Every public callable of the library: functions, constructors, methods, found and not listed."""

import enum
import inspect
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import hybrid_rt as hrt
from support.fuzz import examples

# Their first argument is a message, or they are called by Python alone.
NOT_CALLED = (enum.Enum, BaseException)


@dataclass(frozen=True)
class Target:
    """A callable under a label such as "Scene.from_arrays"."""

    label: str
    get: Callable[[], Any]

    def parameters(self) -> list[str]:
        """Return the names of its parameters."""
        return list(examples.arguments(self.label, self.get()))


def _bound(name: str, method: str) -> Callable[[], Any]:
    return lambda: getattr(examples.instance(name), method)


def _methods(name: str, cls: type) -> Iterator[Target]:
    for method, static in inspect.getmembers_static(cls):
        inner = getattr(static, "__func__", static)
        ours = str(getattr(inner, "__module__", "")).startswith("hybrid_rt")
        if not ours or (method.startswith("_") and method != "__getitem__"):
            continue
        if isinstance(static, (classmethod, staticmethod)):
            yield Target(f"{name}.{method}", lambda m=method: getattr(cls, m))
        elif inspect.isfunction(static):
            yield Target(f"{name}.{method}", _bound(name, method))


def targets() -> Iterator[Target]:
    """Yield every public callable once."""
    for name in sorted(hrt.__all__):
        thing = getattr(hrt, name)
        if inspect.isclass(thing):
            if issubclass(thing, NOT_CALLED):
                continue
            if not inspect.isabstract(thing) and not getattr(thing, "_is_protocol", False):
                yield Target(name, lambda thing=thing: thing)
                yield from _methods(name, thing)
        elif inspect.isroutine(thing):
            yield Target(name, lambda thing=thing: thing)
        elif type(thing).__module__.startswith("hybrid_rt"):
            yield from _methods(name, type(thing))
