"""Positions and normals of a G-buffer against projection, planes and Embree."""

import numpy as np
import pytest

import hybrid_rt as hrt


@pytest.fixture(scope="module")
def gbuffer():
    """Return a view of random triangles of both windings far from the origin, with gaps."""
    rng = np.random.default_rng(3)
    corners = rng.uniform(-1, 1, (60, 1, 3)) + 0.6 * rng.normal(size=(60, 3, 3)) + (40, -30, 20)
    scene = hrt.Scene.from_arrays(corners.reshape(-1, 3), np.arange(180).reshape(-1, 3))
    camera = hrt.Camera.look_at((41, -29, 22.5), (40, -30, 20), width=70, height=50)
    gbuffer = hrt.rasterize(scene, camera)
    assert 0.2 < (gbuffer.prim_id >= 0).mean() < 0.95
    return gbuffer


def test_positions_project_to_the_centres_of_their_pixels(gbuffer):
    position = gbuffer.position
    assert position.shape == (50, 70, 3)
    assert position.dtype == np.float64
    y, x = np.nonzero(gbuffer.prim_id >= 0)
    places = hrt.project(gbuffer.camera, position[y, x])
    np.testing.assert_allclose(places[:, 0], x + 0.5, rtol=0, atol=1e-9)
    np.testing.assert_allclose(places[:, 1], y + 0.5, rtol=0, atol=1e-9)
    np.testing.assert_allclose(places[:, 2], gbuffer.depth[y, x], rtol=1e-12)


def test_positions_are_on_their_triangles_planes(gbuffer):
    covered = gbuffer.prim_id >= 0
    a, b, c = np.moveaxis(gbuffer.scene.vertices[gbuffer.scene.faces].astype(float), 1, 0)
    prim = gbuffer.prim_id[covered]
    n = np.cross(b - a, c - a)[prim]
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    view = gbuffer.position[covered] - np.array(gbuffer.camera.eye)
    off = np.abs(((gbuffer.position[covered] - a[prim]) * n).sum(axis=1))
    # Depth is rounded to float32: 2**-24 of the way along the view.
    assert (off <= 2.0**-23 * np.linalg.norm(view, axis=1)).all()


def test_normals_are_those_of_embree_turned_to_the_eye(gbuffer):
    rays = hrt.primary_rays(gbuffer.camera)
    hits = hrt.EmbreeTracer(gbuffer.scene).intersect(rays)
    same = (hits.prim_id == gbuffer.prim_id.ravel()) & (hits.prim_id >= 0)
    assert same.sum() > 0.99 * (gbuffer.prim_id >= 0).sum()
    theirs = hits.n_g[same].astype(float)
    theirs /= np.linalg.norm(theirs, axis=1, keepdims=True)
    facing = np.sign((theirs * rays.direction[same]).sum(axis=1))
    assert set(facing) == {-1, 1}  # both windings are seen
    normal = gbuffer.normal
    assert normal.shape == (50, 70, 3)
    assert normal.dtype == np.float64
    ours = normal.reshape(-1, 3)[same]
    np.testing.assert_allclose(ours, -facing[:, None] * theirs, atol=1e-4)
    np.testing.assert_allclose(np.linalg.norm(ours, axis=1), 1.0, rtol=1e-12)


def test_where_nothing_is_visible_there_is_nan_and_only_there(gbuffer):
    for image in (gbuffer.position, gbuffer.normal):
        np.testing.assert_array_equal(np.isnan(image).all(axis=2), gbuffer.prim_id < 0)
        np.testing.assert_array_equal(np.isnan(image).any(axis=2), gbuffer.prim_id < 0)


def test_a_view_of_nothing_is_nan(gbuffer):
    away = hrt.Camera.look_at((90, 0, 0), (99, 0, 0), width=4, height=3)
    empty = hrt.rasterize(gbuffer.scene, away)
    assert np.isnan(empty.position).all()
    assert np.isnan(empty.normal).all()


def test_tiny_triangles_have_unit_normals():
    corners = 1e-30 * np.array([(-1, -1, -1), (1, -1, -1), (0, 1, -1)], np.float32)
    scene = hrt.Scene.from_arrays(corners, [(0, 1, 2)])
    camera = hrt.Camera.look_at((0, 0, 0), (0, 0, -1), width=9, height=9, near=1e-31)
    gbuffer = hrt.rasterize(scene, camera)
    assert gbuffer.prim_id[4, 4] == 0
    np.testing.assert_allclose(gbuffer.normal[4, 4], (0, 0, 1), atol=1e-12)
