"""The one family of exceptions that this project raises on purpose."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


class HybridRTError(Exception):
    """Base of every error raised on purpose by hybrid_rt, its scenes and its bench."""


class ArgumentError(HybridRTError, ValueError):
    """An argument that cannot be used.

    Parameters
    ----------
    argument : str
        Name of the argument, as the caller spells it.
    expected : str
        What would have been accepted.
    got : str
        What came.
    """

    def __init__(self, argument: str, expected: str, got: str) -> None:
        self.argument = argument
        self.expected = expected
        self.got = got
        super().__init__(f"{argument}: expected {expected}, got {got}")


class MeshFileError(HybridRTError):
    """A mesh file that is absent, unreadable, truncated or holds no triangles."""


class EmbreeError(HybridRTError, RuntimeError):
    """Embree cannot be reached, or reported an error."""


class PluginError(HybridRTError):
    """Something that an installed distribution offers cannot be loaded."""


class UnknownNameError(HybridRTError, KeyError):
    """A name that is not known, with the nearest known one as a suggestion.

    Parameters
    ----------
    kind : str
        What the name should name: "scene", "camera", "key of sponza.toml".
    name : str
        The name that came.
    known : iterable of str
        All names that would have been accepted.
    """

    def __init__(self, kind: str, name: str, known: Iterable[str]) -> None:
        self.kind = kind
        self.name = name
        self.known = sorted(known)
        near = difflib.get_close_matches(name, self.known, n=1, cutoff=0.5)
        hint = f"; did you mean {near[0]!r}?" if near else ""
        listed = ", ".join(self.known) if self.known else "none"
        super().__init__(f"unknown {kind} {name!r}{hint} (known: {listed})")

    def __str__(self) -> str:
        # KeyError would print the repr of the message.
        return str(self.args[0])
