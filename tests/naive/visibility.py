"""Judge two answers to the question which triangle a pixel's centre sees, in float64.

The rasteriser may differ from the true outline by its snapping, half a sub-pixel (1/512 pixel) in x
and in y. Embree works in float32: it rounds the ray's direction, subtracts the eye from every
vertex, and its edge and plane equations err by a few units in the last place *of the vertices'
distance from the eye*, which may be much larger than the hit's. Both are bounded here, as a
distance on screen and as a share of the depth; the eye must be representable in float32.
"""

import numpy as np

SNAP = np.sqrt(2.0) / 512
"""How far snapping moves an edge at most, in pixels."""
EMBREE = 8 * 2.0**-24
"""Rounding errors of Embree relative to the vertices' distance: eight half units in the last place
(the direction, the subtraction, and three steps each of two products)."""


def _project(camera, points):
    return (points - np.array(camera.eye)) @ camera.pixel_from_world.T


def _segment_distance(p, a, b):
    ab = b - a
    length = (ab**2).sum(axis=-1)
    t = ((p - a) * ab).sum(axis=-1) / np.where(length > 0, length, 1)
    nearest = a + np.clip(t, 0, 1)[:, None] * ab
    return np.linalg.norm(p - nearest, axis=-1)


class Sight:
    """What one triangle each looks like from the centres of pixels (i, j)."""

    def __init__(self, vertices, faces, camera, prim, pixel):
        eye = np.array(camera.eye)
        centre = pixel + 0.5
        corners = vertices.astype(np.float64)[faces[prim]]  # (N, 3, 3)
        q = _project(camera, corners.reshape(-1, 3)).reshape(-1, 3, 3)
        x = np.concatenate([centre, np.ones((len(centre), 1))], axis=1)
        ray = x @ np.linalg.inv(camera.pixel_from_world).T  # z_view = 1
        n = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        reach = np.linalg.norm(corners - eye, axis=2).max(axis=1)
        with np.errstate(divide="ignore", invalid="ignore"):
            slope = (n * ray).sum(axis=1)
            self.z = (n * (corners[:, 0] - eye)).sum(axis=1) / slope
            # The same point of a plane, seen along a ray that is off by one rounding.
            self.z_error = EMBREE * reach * np.linalg.norm(n, axis=1) / np.abs(slope)
            distance = np.abs(self.z) * np.linalg.norm(ray, axis=1)
            self.tolerance = SNAP + EMBREE * camera.focal_px * np.maximum(reach / distance, 1) * (
                ray**2
            ).sum(axis=1)
        self.inside, self.to_edge = self._outline(q, x, camera.near)
        self.near_edge = self.to_edge <= np.where(np.isnan(self.tolerance), SNAP, self.tolerance)

    @staticmethod
    def _outline(q, x, near):
        sign = np.sign(np.linalg.det(q))
        lines = [np.cross(q[:, k], q[:, (k + 1) % 3]) for k in range(3)]
        with np.errstate(divide="ignore", invalid="ignore"):
            signed = np.stack(
                [sign * (line * x).sum(axis=1) / np.hypot(line[:, 0], line[:, 1]) for line in lines]
            )
            screen = q[:, :, :2] / q[:, :, 2:]
        inside = (signed >= 0).all(axis=0)
        to_segments = np.stack(
            [_segment_distance(x[:, :2], screen[:, k], screen[:, (k + 1) % 3]) for k in range(3)]
        ).min(axis=0)
        # The projection of a triangle that crosses the near plane has no three corners.
        whole = (q[:, :, 2] >= near).all(axis=1)
        return inside, np.where(whole, to_segments, np.abs(np.nanmin(signed, axis=0)))


def unexplained(vertices, faces, camera, ours, theirs):
    """Return the pixels (N, 2) where two images (H, W) of prim_id differ without an excuse.

    Excused is a pixel whose centre lies within the tolerance of an outline of either triangle, and
    one where both triangles are there at the same depth.
    """
    j, i = np.nonzero(ours != theirs)
    pixel = np.stack([i, j], axis=1)
    a, b = ours[j, i], theirs[j, i]
    # The missing triangle of a background pixel never excuses anything.
    sight_a = Sight(vertices, faces, camera, np.maximum(a, 0), pixel)
    sight_b = Sight(vertices, faces, camera, np.maximum(b, 0), pixel)
    edge = (sight_a.near_edge & (a >= 0)) | (sight_b.near_edge & (b >= 0))
    both = sight_a.inside & sight_b.inside & (a >= 0) & (b >= 0)
    level = np.abs(sight_a.z - sight_b.z) <= sight_a.z_error + sight_b.z_error
    return pixel[~(edge | (both & level))]
