"""What one view shows, pixel by pixel."""

from __future__ import annotations

from dataclasses import dataclass, field

from hybrid_rt._arrays import F32, I32
from hybrid_rt.camera.pinhole import Camera
from hybrid_rt.raster.lists import PrimitiveLists
from hybrid_rt.scene.mesh import Scene


@dataclass(frozen=True, eq=False)
class GBuffer:
    """What the rasteriser writes for one view.

    Attributes
    ----------
    depth : (H, W) float32
        ``near / z_view`` at the pixel's centre, 0 where nothing is visible.
    ddx, ddy : (H, W) float32
        Change of `depth` for one pixel to the right and one pixel down.
    prim_id : (H, W) int32
        Index into ``scene.faces``, -1 where nothing is visible.
    scene : Scene
    camera : Camera
    lists : PrimitiveLists, optional
        What mode "certified" reads, if the rasteriser was asked for it.
    timings : dict of str to float
        Seconds of the stages of `rasterize`: "vertices" (projecting them), "cull" (which faces may
        cover a pixel), "records" (their planes, and the tiles they are put into), "tiles" (drawing
        these and writing the images); with JIT compilation in a first call.
    """

    depth: F32
    ddx: F32
    ddy: F32
    prim_id: I32
    scene: Scene
    camera: Camera
    lists: PrimitiveLists | None = None
    timings: dict[str, float] = field(default_factory=dict)
