"""What a hard case is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np

import hybrid_rt as hrt
from hybrid_rt.kernels.arrays import F32
from hybrid_rt_scenes.hard.truth import Truth, truth

DepthFormat = Literal["float32", "unorm16", "unorm24", "standard_z"]


@dataclass(frozen=True, eq=False)
class BuiltCase:
    """A hard case with everything that it takes to run a technique on it.

    Attributes
    ----------
    name : str
    scene : Scene
    camera : Camera
    rays : Rays
        With the pixel they start in where they start on the surface visible there.
    derivatives : {"plane", "quad"}
        Where the derivatives of the G-buffer come from.
    depth_format : str
        What the depth buffer can hold: "float32", reversed; "unorm16" and "unorm24", reversed, in
        steps of 1 / (2**bits - 1); "standard_z", a float32 that stores 1 - depth.
    max_steps : int, optional
        The step budget to give a technique that has one.
    """

    name: str
    scene: hrt.Scene
    camera: hrt.Camera
    rays: hrt.Rays
    derivatives: Literal["plane", "quad"] = "plane"
    depth_format: DepthFormat = "float32"
    max_steps: int | None = None

    @cached_property
    def truth(self) -> Truth:
        """What is true of every ray, by exact arithmetic."""
        return truth(self.scene, self.rays)

    @cached_property
    def gbuffer(self) -> hrt.GBuffer:
        """The view, its depth kept in the case's format."""
        drawn = hrt.rasterize(self.scene, self.camera, derivatives=self.derivatives)
        depth = stored(drawn.depth, self.depth_format)
        # What the format rounds to nothing is not seen.
        return replace(drawn, depth=depth, prim_id=np.where(depth > 0, drawn.prim_id, -1))


@dataclass(frozen=True)
class HardCase:
    """A named scene with rays on which screen-space tracers go wrong.

    Attributes
    ----------
    name : str
    what_goes_wrong : str
        One sentence.
    builder : callable
        Returns the scene, camera and rays; the same on every call.
    """

    name: str
    what_goes_wrong: str
    builder: Callable[[], BuiltCase]

    def build(self) -> BuiltCase:
        """Return the case with its scene, camera and rays."""
        return replace(self.builder(), name=self.name)


def stored(depth: F32, depth_format: DepthFormat) -> F32:
    """Return what a depth buffer of that format gives back for reversed depths (H, W)."""
    if depth_format == "float32":
        return depth
    if depth_format == "standard_z":
        return np.asarray(np.float32(1) - (np.float32(1) - depth))
    steps = 2 ** int(depth_format.removeprefix("unorm")) - 1
    return np.asarray(np.round(depth.astype(np.float64) * steps) / steps, np.float32)
