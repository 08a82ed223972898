"""Scenes with answers in closed form: a floor before a wall, stairs, a ball on a floor."""

import numpy as np
import pytest

import hybrid_rt as hrt
from support.screens import through


class Rectangles:
    """Axis-aligned rectangles: meshes of two triangles each, and their exact first hits."""

    def __init__(self, boxes):
        self.boxes = np.array(boxes, float)  # (n, 2, 3): two corners that share one coordinate

    def scene(self):
        vertices, faces = [], []
        for low, high in self.boxes:
            axis = int(np.argmin(np.abs(high - low)))
            u, v = (k for k in range(3) if k != axis)
            corners = np.tile(low, (4, 1))
            corners[1:3, u] = high[u]
            corners[2:4, v] = high[v]
            faces += [np.array([[0, 1, 2], [0, 2, 3]]) + 4 * len(vertices)]
            vertices.append(corners)
        return hrt.Scene.from_arrays(np.concatenate(vertices), np.concatenate(faces))

    def first_hit(self, rays):
        """Return (t, rectangle), infinity and -1 for none."""
        o, d = rays.origin.astype(float), rays.direction.astype(float)
        best, which = np.full(len(o), np.inf), np.full(len(o), -1)
        for index, (low, high) in enumerate(self.boxes):
            axis = int(np.argmin(np.abs(high - low)))
            with np.errstate(divide="ignore", invalid="ignore"):
                t = (low[axis] - o[:, axis]) / d[:, axis]
                p = o + t[:, None] * d
            inside = (t >= rays.t_near) & (t < best)
            for k in range(3):
                if k != axis:
                    inside &= (p[:, k] >= low[k]) & (p[:, k] <= high[k])
            best[inside], which[inside] = t[inside], index
        return best, which


def stairs(steps=9, rise=0.25, depth=0.5):
    """Return steps that rise away from the viewer, 8 units wide."""
    boxes = []
    for k in range(steps):
        boxes.append([(-4, k * rise, -(k + 1) * depth), (4, k * rise, -k * depth)])
        boxes.append([(-4, k * rise, -(k + 1) * depth), (4, (k + 1) * rise, -(k + 1) * depth)])
    return Rectangles(boxes)


def corner():
    """Return a floor and the wall behind it."""
    return Rectangles([[(-9, 0, -5), (9, 0, 4)], [(-9, 0, -5), (9, 7, -5)]])


PLACES = {
    "corner": (corner(), (0.3, 1.6, 3.5), (0, 1.0, -5)),
    "stairs": (stairs(), (0.4, 2.9, 3.0), (0, 0.8, -2.5)),
}


@pytest.fixture(params=PLACES)
def view(request):
    place, eye, target = PLACES[request.param]
    camera = hrt.Camera.look_at(eye, target, width=320, height=200, near=0.05)
    scene = place.scene()
    return place, scene, hrt.rasterize(scene, camera)


def test_the_raster_shows_the_rectangle_that_is_nearest(view):
    place, _, buffer = view
    y, x = np.mgrid[0:200, 0:320]
    ends = np.column_stack([x.ravel() + 0.5, y.ravel() + 0.5, np.full(x.size, buffer.camera.near)])
    eye = np.array(buffer.camera.eye)
    towards = hrt.unproject(buffer.camera, ends) - eye  # z_view is 1, so t is z_view
    rays = hrt.Rays.from_arrays(np.tile(eye, (x.size, 1)), towards)
    t, which = place.first_hit(rays)
    seen = buffer.prim_id.ravel()
    same = np.where(seen >= 0, seen // 2, -1) == which
    assert same.mean() > 0.999  # float32 rays through pixels on an edge may go to either side
    hit = same & (which >= 0)
    np.testing.assert_allclose(buffer.depth.ravel()[hit], buffer.camera.near / t[hit], rtol=1e-5)


def test_mirror_rays_end_where_the_closed_form_says(view):
    place, scene, buffer = view
    rays = hrt.mirror_rays(buffer)
    t, which = place.first_hit(rays)
    for tracer in (hrt.BruteForceTracer(scene), hrt.EmbreeTracer(scene)):
        hits = tracer.intersect(rays)
        same = np.where(hits.prim_id >= 0, hits.prim_id // 2, -1) == which
        assert same.mean() > 0.9999
        hit = same & (which >= 0)
        assert hit.mean() > 0.2
        np.testing.assert_allclose(hits.t[hit], t[hit], rtol=1e-5)


def test_answers_of_the_march_are_those_of_the_closed_form(view):
    place, _, buffer = view
    rays = hrt.mirror_rays(buffer)
    t, which = place.first_hit(rays)
    marched = through(rays, buffer)
    hit = marched.resolved
    assert hit.mean() > 0.1
    right = marched.prim_id // 2 == which
    assert right[hit].mean() > 0.98  # free space is proven at the centres of pixels only
    np.testing.assert_allclose(marched.t[hit & right], t[hit & right], rtol=2e-3)


def test_a_ball_on_a_floor_is_reflected_where_the_quadratic_says():
    def ball(n=96):
        u, v = np.meshgrid(np.linspace(0, 2 * np.pi, n), np.linspace(0, np.pi, n), indexing="ij")
        p = np.stack([np.cos(u) * np.sin(v), np.cos(v), np.sin(u) * np.sin(v)], axis=-1)
        i = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
        faces = np.concatenate(
            [np.stack([i, i + 1, i + n], axis=1), np.stack([i + 1, i + n + 1, i + n], axis=1)]
        )
        return hrt.Mesh.from_arrays(p.reshape(-1, 3) + np.array([0, 1, 0]), faces)

    floor = Rectangles([[(-20, 0, -20), (20, 0, 20)]]).scene()
    floor = hrt.Mesh.from_arrays(floor.vertices, floor.faces)
    scene = hrt.Scene.from_meshes([floor, ball()])
    camera = hrt.Camera.look_at((0.5, 1.4, 5.0), (0, 0.6, 0), width=320, height=200, near=0.05)
    buffer = hrt.rasterize(scene, camera)
    rays = hrt.mirror_rays(buffer)
    rays = rays.take(buffer.prim_id[rays.pixel[:, 1], rays.pixel[:, 0]] < 2)  # those off the floor
    o, d = rays.origin.astype(float) - (0, 1, 0), rays.direction.astype(float)
    a, b, c = (d * d).sum(axis=1), (o * d).sum(axis=1), (o * o).sum(axis=1) - 1
    with np.errstate(invalid="ignore"):
        t = (-b - np.sqrt(b * b - a * c)) / a
    marched = through(rays, buffer)
    on_ball = marched.resolved & (marched.prim_id >= 2)
    assert on_ball.sum() > 1000
    # The ball's facets lie up to 0.0011 inside the sphere, which a slanting ray sees enlarged.
    finite = np.isfinite(t[on_ball])
    assert finite.mean() > 0.95
    assert np.median(np.abs(marched.t - t)[on_ball][finite]) < 0.005
    hits = hrt.EmbreeTracer(scene).intersect(rays)
    met = np.isfinite(t) & (t > 0)
    both = met & (hits.prim_id >= 2)
    assert np.median(np.abs(hits.t - t)[both]) < 0.002
    assert ((hits.prim_id >= 2) == met).mean() > 0.995
