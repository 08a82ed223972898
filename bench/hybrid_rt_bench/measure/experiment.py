"""What experiments of every kind say: their names, the sizes of pictures, scenes."""

from __future__ import annotations

import re
from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field

from hybrid_rt.errors import ArgumentError


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

MOST_ROUNDS = 100_000
MOST_TRIANGLES = 2**27
"""More than any generator makes here, and than fit in memory."""

Rounds = Annotated[int, Field(strict=True, ge=1, le=MOST_ROUNDS)]
Passes = Annotated[int, Field(strict=True, ge=0, le=MOST_ROUNDS)]
"""Of warm-up."""

SelectionRays = Annotated[int, Field(strict=True, ge=1024, le=2**27)]
Seconds = Annotated[float, Field(gt=0, le=86_400)]

Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]*$", max_length=64)]
"""What becomes a part of the name of a folder."""

Text = Annotated[str, Field(min_length=1, max_length=4096, pattern=r"^[^\x00-\x1f\x7f]*$")]
"""A line that can be printed."""

Names = Annotated[list[Text], Field(min_length=1)]


class SceneEntry(BaseModel):
    """One scene of an experiment.

    Attributes
    ----------
    name : str
        A registered scene, or a path to a mesh file.
    row : str
        The row of the paper's tables that it stands beside; empty for none. It is left empty for
        what stands in for the scene.
    stand_in : str, optional
        Built-in scene that takes its place where its files are absent.
    size : int, optional
        Number of triangles asked of a built-in scene that has a size.
    cameras : list of str, optional
        Default: all of them.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: Text
    row: str = ""
    stand_in: Text | None = None
    size: int | None = Field(default=None, strict=True, ge=1, le=MOST_TRIANGLES)
    cameras: Names | None = None


class AnyExperiment(BaseModel):
    """What an experiment of any kind has; each kind has a class of its own.

    Attributes
    ----------
    kind : str
        Which class and which runner an experiment belongs to.
    name, title : str
    quick : bool
        Whether the quick form was asked for.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    schema_version: Literal[1] = Field(default=1, alias="schema")
    kind: str
    name: Name
    title: Text
    quick: bool = False

    def overridden(
        self,
        resolutions: list[Resolution] | None = None,
        rounds: int | None = None,
        techniques: list[str] | None = None,
    ) -> Self:
        """Return the experiment with what the command line changes; None changes nothing.

        Raises
        ------
        ArgumentError
            A number of rounds that no experiment may have.
        """
        if rounds is not None and not 1 <= rounds <= MOST_ROUNDS:
            raise ArgumentError("--rounds", f"an integer, 1 to {MOST_ROUNDS}", str(rounds))
        given = {"resolutions": resolutions, "rounds": rounds, "techniques": techniques}
        return self.model_copy(update={k: v for k, v in given.items() if v is not None})


class SceneExperiment(AnyExperiment):
    """An experiment over the cameras of scenes.

    Attributes
    ----------
    scenes : list of SceneEntry
    cameras : int, optional
        Only the first so many cameras of each scene.
    """

    scenes: list[SceneEntry] = Field(min_length=1)
    cameras: int | None = Field(default=None, strict=True, ge=1)

    def row_of(self, scene: str) -> str:
        """Return the paper's row for a scene given by name on the command line."""
        for entry in self.scenes:
            if scene == entry.name:
                return entry.row
        return ""
