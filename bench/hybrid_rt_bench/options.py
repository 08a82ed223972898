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
    type : type
        What its value is: a list of names with commas between them (`list`), one text (`str`), an
        `int` or a `float`.
    """

    name: str
    help: str
    changes: bool = False
    type: type = list

    @property
    def parameter(self) -> str:
        """Its name in Python."""
        return self.name.replace("-", "_")


SCENES = Option("scenes", "Scenes by name, or paths of meshes or definitions: sponza,my/hall.glb")
CAMERAS = Option("cameras", "Cameras by name, where a scene has them; or files, as in `render`.")
RESOLUTIONS = Option("resolutions", "Picture sizes: 1280x720,1920x1080", changes=True)
ROUNDS = Option("rounds", "Measured rounds of each cell.", changes=True, type=int)
TECHNIQUES = Option("techniques", "Techniques by name (see `list`): paper,slope", changes=True)

FRAME = (
    Option("depth", "Depth buffer of a frame of your own: .npz, .exr or .png", type=str),
    Option("scene", "Its mesh: a file, or a scene by name.", type=str),
    Option("camera", "Its camera: FILE or FILE:NAME, of .toml, .glb or .gltf", type=str),
    Option("kind", "What it holds: standard, reversed, linear or distance", type=str),
    Option("bits", "Bits of its integers that are depth.", type=int),
    Option("far", "Distance of its far plane, world units.", type=float),
    Option("origin", "Where its first row is: top or bottom", type=str),
    Option("background", "What else than the far plane stands for nothing in it.", type=float),
    Option("channel", "Which channel of an .exr is depth.", type=str),
)
"""What says how to read a frame of someone's own; see `hybrid_rt_bench.measure.frames`."""

VIEWS = (SCENES, CAMERAS, RESOLUTIONS, ROUNDS)
"""What kinds that measure views of scenes have."""
