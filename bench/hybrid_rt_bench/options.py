"""Options of ``hybrid-rt run``: a kind says which of them, or which of its own, it has."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Option:
    """An option of the command line.

    Attributes
    ----------
    name : str
        Without its dashes.
    help : str
    changes : bool
        Whether its value changes the experiment (`AnyExperiment.overridden`); else the kind's
        runner is given it.
    number : bool
        Whether it is an integer, and not a list of names with commas between them.
    """

    name: str
    help: str
    changes: bool = False
    number: bool = False

    @property
    def parameter(self) -> str:
        """Its name in Python."""
        return self.name.replace("-", "_")


SCENES = Option("scenes", "Scenes by name, or paths of meshes or definitions: sponza,my/hall.glb")
CAMERAS = Option("cameras", "Cameras by name, where a scene has them; or files, as in `render`.")
RESOLUTIONS = Option("resolutions", "Picture sizes: 1280x720,1920x1080", changes=True)
ROUNDS = Option("rounds", "Measured rounds of each cell.", changes=True, number=True)
TECHNIQUES = Option("techniques", "Techniques by name (see `list`): paper,slope", changes=True)

VIEWS = (SCENES, CAMERAS, RESOLUTIONS, ROUNDS)
"""What kinds that measure views of scenes have."""
