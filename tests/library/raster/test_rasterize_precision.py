"""One test for each way in which a rasteriser's numbers can go wrong."""

import numpy as np
import pytest

import hybrid_rt as hrt
from naive import raster as naive


def check_against_naive(scene, camera):
    g = hrt.rasterize(scene, camera)
    wanted = naive.rasterize(scene.vertices, scene.faces, camera)
    for got, want in zip((g.depth, g.ddx, g.ddy, g.prim_id), wanted, strict=True):
        assert np.array_equal(got, want)
    return g


@pytest.mark.parametrize("offset", [0.0, 1e4, 1e6])
def test_depth_far_from_the_origin_is_rounded_once(offset):
    """World minus eye in float32 would leave 0.06 units of noise at 1e6."""
    corners = np.array([(-4, -3, -5), (5, -2, -7), (0, 6, -9)], np.float64) + offset
    scene = hrt.Scene.from_arrays(corners.astype(np.float32), [(0, 1, 2)])
    eye = (offset, offset, offset)
    camera = hrt.Camera.look_at(eye, (offset, offset, offset - 1), width=33, height=27)
    g = hrt.rasterize(scene, camera)
    seen = np.argwhere(g.prim_id == 0)
    assert len(seen) > 50
    for j, i in seen:
        exact = naive.exact_depth(scene.vertices, (0, 1, 2), camera, i + 0.5, j + 0.5)
        assert abs(g.depth[j, i] / float(exact) - 1) <= 2.0**-24


def test_surfaces_a_few_ulp_apart_are_ordered():
    """Two walls 100 units away, 2e-4 apart: interpolated float32 depths would fight."""
    wall = np.array([(-90, -70, 0), (90, -70, 0), (90, 70, 0), (-90, 70, 0)], np.float64)
    back, front = wall - np.array([0, 0, 100]), wall - np.array([0, 0, 99.9998])
    scene = hrt.Scene.from_arrays(
        np.vstack([back, front]), [(0, 1, 2), (0, 2, 3), (4, 5, 6), (4, 6, 7)]
    )
    camera = hrt.Camera.look_at((0, 0, 0), (0.3, 0.2, -1), width=97, height=71, vfov_deg=50)
    assert set(np.unique(hrt.rasterize(scene, camera).prim_id)) <= {-1, 2, 3}


@pytest.mark.parametrize("tilt", [1e-2, 1e-4, 1e-6, 0.0])
def test_wall_seen_edge_on_stays_within_its_depths(tilt):
    """The plane of a wall through the eye, almost, is steeper than any pixel can follow."""
    corners = [(-tilt, -1, -1), (tilt, -1, -9), (tilt, 1, -9), (-tilt, 1, -1)]
    scene = hrt.Scene.from_arrays(np.array(corners), [(0, 1, 2), (0, 2, 3)])
    # An odd width puts the middle of a pixel in the wall's way.
    camera = hrt.Camera.look_at((0, 0, 0), (0, 0, -1), width=41, height=31, near=0.05)
    g = check_against_naive(scene, camera)
    seen = g.prim_id >= 0
    assert (g.depth[seen] >= np.float32(0.05 / 9)).all()
    assert (g.depth[seen] <= np.float32(0.05)).all()
    assert np.isfinite(g.ddx).all()
    assert np.isfinite(g.ddy).all()


@pytest.mark.parametrize(("width", "height"), [(32768, 1), (1, 32768)])
def test_longest_images(width, height):
    scene = hrt.Scene.from_arrays(
        np.array([(-3e4, -2, -3), (3e4, -1, -2), (0, 3e4, -2), (0, -3e4, -4)]),
        [(0, 1, 2), (1, 0, 3)],
    )
    camera = hrt.Camera.look_at((0, 0, 0), (0, 0, -1), vfov_deg=90, width=width, height=height)
    assert (check_against_naive(scene, camera).prim_id >= 0).any()


@pytest.mark.parametrize("scale", [1e-30, 1e-12, 1e12, 1e30])
def test_units_do_not_matter(scale):
    """Nothing in the raster has an absolute size: any power of two gives the same image."""
    scale = 2.0 ** np.round(np.log2(scale))
    rng = np.random.default_rng(8)
    corners = rng.uniform(-2, 2, (60, 3)).astype(np.float32)
    faces = np.arange(60).reshape(20, 3)
    images = []
    for s in (1.0, scale):
        camera = hrt.Camera.look_at((0, 0, 3 * s), (0, 0, 0), width=40, height=30, near=0.0625 * s)
        scene = hrt.Scene.from_arrays((corners * s).astype(np.float32), faces)
        images.append(hrt.rasterize(scene, camera))
    assert (images[0].prim_id >= 0).any()
    for name in ("depth", "ddx", "ddy", "prim_id"):
        assert np.array_equal(getattr(images[0], name), getattr(images[1], name))


def test_depth_too_small_for_float32_is_background():
    scene = hrt.Scene.from_arrays(
        np.array([(-1e30, -1e30, -1e30), (1e30, -1e30, -1e30), (0, 1e30, -1e30)]), [(0, 1, 2)]
    )
    camera = hrt.Camera.look_at((0, 0, 0), (0, 0, -1), width=9, height=9, near=1e-20)
    g = hrt.rasterize(scene, camera)
    assert (g.depth == 0).all()
    assert (g.prim_id == -1).all()
