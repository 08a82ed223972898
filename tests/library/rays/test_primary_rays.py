"""Primary rays: through every pixel's centre, and seeing what the raster sees."""

import numpy as np
import pytest

import hybrid_rt as hrt


def floor():
    """Return a floor of two triangles at y = 0."""
    corners = np.array([(-4, 0, -4), (4, 0, -4), (4, 0, 4), (-4, 0, 4)], np.float32)
    return hrt.Scene.from_arrays(corners, np.array([(0, 1, 2), (0, 2, 3)], np.int32))


def pixels_of(camera, rays):
    """Return the (N, 2) pixels through whose centres the rays go."""
    places = hrt.project(camera, np.array(camera.eye) + 5.0 * rays.direction)[:, :2]
    np.testing.assert_allclose(places % 1, 0.5, atol=1e-3)
    return places.astype(int)


@pytest.mark.parametrize("order", ["rows", "tiles"])
@pytest.mark.parametrize(("width", "height"), [(1, 1), (7, 3), (64, 33)])
def test_primary_rays_go_once_through_the_centre_of_every_pixel(width, height, order):
    camera = hrt.Camera.look_at((1, 2, 3), (0, 0.5, -1), width=width, height=height)
    rays = hrt.primary_rays(camera, order=order)
    assert len(rays) == width * height
    pixels = {(x, y) for x, y in pixels_of(camera, rays)}
    assert pixels == {(x, y) for x in range(width) for y in range(height)}
    assert (rays.pixel == -1).all()


def test_rows_go_from_left_to_right_and_down():
    camera = hrt.Camera.look_at((1, 2, 3), (0, 0.5, -1), width=5, height=4)
    y, x = np.mgrid[:4, :5]
    expected = np.stack([x.ravel(), y.ravel()], axis=1)
    np.testing.assert_array_equal(pixels_of(camera, hrt.primary_rays(camera)), expected)


def test_tiles_stay_together():
    camera = hrt.Camera.look_at((1, 2, 3), (0, 0.5, -1), width=64, height=40)
    pixels = pixels_of(camera, hrt.primary_rays(camera, order="tiles"))
    assert pixels[:4].tolist() == [[0, 0], [1, 0], [0, 1], [1, 1]]
    assert pixels[: 32 * 32].max() == 31


def test_primary_rays_see_what_the_raster_sees_and_have_z_view_for_t():
    camera = hrt.Camera.look_at((0, 2, 3), (0, 0, 0), width=32, height=24, near=0.1)
    rays = hrt.primary_rays(camera)
    hits = hrt.EmbreeTracer(floor()).intersect(rays)
    gbuffer = hrt.rasterize(floor(), camera)
    np.testing.assert_array_equal(hits.prim_id >= 0, gbuffer.prim_id.ravel() >= 0)
    np.testing.assert_allclose(camera.near / hits.t, gbuffer.depth.ravel(), rtol=1e-5)
    assert (rays.t_near == np.float32(camera.near)).all()
    assert np.isinf(rays.t_far).all()


@pytest.mark.parametrize(
    ("camera", "order", "argument"),
    [(None, "rows", "camera"), (hrt.Camera.look_at((0, 1, 2), (0, 0, 0)), "morton", "order")],
)
def test_primary_rays_refuse(camera, order, argument):
    with pytest.raises(hrt.ArgumentError, match=argument):
        hrt.primary_rays(camera, order=order)
