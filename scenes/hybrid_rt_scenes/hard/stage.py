"""Places and rays that the hard cases are made of."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

import hybrid_rt as hrt
from hybrid_rt.kernels.arrays import F32, F64, I32
from hybrid_rt_scenes.hard.case import BuiltCase
from hybrid_rt_scenes.primitives import Part, boxes, join, quad

WIDTH, HEIGHT = 64, 48


def scene_of(*parts: Part) -> hrt.Scene:
    """Return a scene of parts, rounded to float32."""
    whole = join(parts)
    return hrt.Scene.from_arrays(
        whole.vertices.astype(np.float32), whole.faces.astype(np.int32), name="hard case"
    )


def triangles(*corners: Any) -> Part:
    """Return loose triangles from (3, 3) corners each."""
    points = np.asarray(corners, np.float64).reshape(-1, 3)
    return Part(points, np.arange(len(points)).reshape(-1, 3))


def room_parts() -> list[Part]:
    """Return a floor, a back wall, boxes, a post, a floating slab, and a wall behind the camera.

    From `front` one sees sky above the back wall; behind the boxes and beside the image there is
    geometry that no pixel shows.
    """
    low = [[-1.5, 0, -2], [0.6, 0, -1.5], [-0.1, 0, -0.5], [-0.8, 1.6, -2.5], [-0.9, 0, -3.4]]
    high = [[-0.5, 1.2, -1], [1.2, 2, -0.9], [-0.05, 1.5, -0.45], [0.8, 1.7, -1.5], [-0.4, 0.9, -3]]
    return [
        quad([-4, 0, 4], [8, 0, 0], [0, 0, -8]),
        quad([-4, 0, -4], [8, 0, 0], [0, 2.5, 0]),
        boxes(low, high),
        quad([-2, 0, 6], [4, 0, 0], [0, 3, 0]),
    ]


def room() -> hrt.Scene:
    """Return the scene of `room_parts`."""
    return scene_of(*room_parts())


def front(
    width: int = WIDTH, height: int = HEIGHT, *, vfov_deg: float = 60.0, near: float = 0.05
) -> hrt.Pinhole:
    """Return a camera that looks into the room, at no special angle."""
    return hrt.Camera.look_at(
        (0.3, 1.3, 3.9), (-0.1, 0.8, -2), vfov_deg=vfov_deg, width=width, height=height, near=near
    )


def straight(
    width: int = WIDTH, height: int = HEIGHT, *, eye: Any = (0, 1, 3.5), near: float = 0.0625
) -> hrt.Pinhole:
    """Return a camera along -Z at 90 degrees: 1 unit is height / 2 pixels at a distance of 1."""
    eye3 = np.asarray(eye, np.float64)
    return hrt.Camera.look_at(
        eye3, eye3 - np.array([0, 0, 1]), vfov_deg=90, width=width, height=height, near=near
    )


@dataclass(frozen=True, eq=False)
class Starts:
    """Points on visible surfaces, moved off them as `hybrid_rt.mirror_rays` moves them.

    Attributes
    ----------
    origin : (N, 3) float32
    mirror, view, normal : (N, 3) float64
        Unit length; the normal is turned to the viewer.
    pixel : (N, 2) int32
    t_near : (N,) float32
        For directions of unit length that leave the surface as steeply as the mirror ray.
    """

    origin: F32
    mirror: F64
    view: F64
    normal: F64
    pixel: I32
    t_near: F32

    def __len__(self) -> int:
        return len(self.origin)

    def take(self, index: NDArray[Any]) -> Starts:
        """Return some of them."""
        return Starts(
            self.origin[index],
            self.mirror[index],
            self.view[index],
            self.normal[index],
            self.pixel[index],
            self.t_near[index],
        )

    def towards(self, direction: ArrayLike) -> hrt.Rays:
        """Return rays of directions (N, 3) or (3,); those that would enter the surface are turned.

        `t_near` grows as the ray grazes, as a tracer's error in t does, up to 20 times.
        """
        d = np.broadcast_to(np.asarray(direction, np.float64), self.origin.shape)
        cosine = (d * self.normal).sum(axis=1)
        d = np.where(cosine[:, None] < 0, -d, d)
        steep = np.abs(cosine) / np.linalg.norm(d, axis=1)
        mirror = np.abs((self.mirror * self.normal).sum(axis=1))
        growth = np.clip(mirror / np.maximum(steep, 1e-9), 1.0, 20.0)
        t_near = self.t_near * growth / np.linalg.norm(d, axis=1)
        return hrt.Rays.from_arrays(
            self.origin, d.astype(np.float32), self.pixel, t_near.astype(np.float32)
        )

    def aimed(self, targets: ArrayLike) -> hrt.Rays:
        """Return rays to target points (N, 3), which they reach at t = 1, whatever is in between.

        Those whose surface faces away from the target are left out.
        """
        d = np.broadcast_to(np.asarray(targets, np.float64), self.origin.shape) - self.origin
        kept = np.flatnonzero((d * self.normal).sum(axis=1) > 0)
        return self.take(kept).towards(d[kept])


def starts(scene: hrt.Scene, camera: hrt.Camera, n: int | None = None, seed: int = 0) -> Starts:
    """Return `n` random visible points, at most one a pixel; default: all of them."""
    rays = hrt.mirror_rays(hrt.rasterize(scene, camera))
    if n is not None and n < len(rays):
        rays = rays.take(np.sort(np.random.default_rng(seed).choice(len(rays), n, replace=False)))
    centre = np.concatenate([rays.pixel + 0.5, np.full((len(rays), 1), camera.near)], axis=1)
    view = hrt.unproject(camera, centre) - np.array(camera.eye)
    view /= np.linalg.norm(view, axis=1, keepdims=True)
    mirror = rays.direction.astype(np.float64)
    normal = mirror - view
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-30)
    return Starts(rays.origin, mirror, view, normal, rays.pixel, rays.t_near)


def joined(*rays: hrt.Rays) -> hrt.Rays:
    """Return all rays in one."""
    return hrt.Rays(
        np.concatenate([r.origin for r in rays]),
        np.concatenate([r.direction for r in rays]),
        np.concatenate([r.pixel for r in rays]),
        np.concatenate([r.t_near for r in rays]),
        np.concatenate([r.t_far for r in rays]),
    )


def mirrors(scene: hrt.Scene, camera: hrt.Camera, n: int | None = None, seed: int = 0) -> hrt.Rays:
    """Return mirror rays of `n` random visible points."""
    some = starts(scene, camera, n, seed)
    return some.towards(some.mirror)


def sphere_directions(rng: np.random.Generator, n: int) -> F64:
    """Return (n, 3) unit vectors, uniform."""
    d = rng.normal(size=(n, 3))
    return np.asarray(d / np.linalg.norm(d, axis=1, keepdims=True))


def scattered(
    scene: hrt.Scene, camera: hrt.Camera, n: int | None = None, seed: int = 0
) -> hrt.Rays:
    """Return rays in random directions off `n` random visible points."""
    some = starts(scene, camera, n, seed)
    return some.towards(sphere_directions(np.random.default_rng(seed + 1), len(some)))


def aimed(origin: ArrayLike, target: ArrayLike) -> hrt.Rays:
    """Return rays from points to points, (N, 3) or (3,), which they reach at t = 1."""
    o, p = np.broadcast_arrays(
        np.asarray(origin, np.float32).reshape(-1, 3), np.asarray(target, np.float64)
    )
    return hrt.Rays.from_arrays(o.copy(), (p - o).astype(np.float32))


def on_screen(camera: hrt.Camera, x: ArrayLike, y: ArrayLike, z_view: ArrayLike) -> F64:
    """Return the world points (N, 3) at places on the screen, z_view away."""
    x, y, z = np.broadcast_arrays(*(np.asarray(k, np.float64) for k in (x, y, z_view)))
    points = np.stack([x.ravel(), y.ravel(), camera.near / z.ravel()], axis=1)
    return hrt.unproject(camera, points)


def case(scene: hrt.Scene, camera: hrt.Camera, rays: hrt.Rays, **more: Any) -> BuiltCase:
    """Return a built case, to be named by its registry entry."""
    return BuiltCase("", scene, camera, rays, **more)
