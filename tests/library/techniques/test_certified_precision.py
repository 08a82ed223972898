"""Where float32 would be wrong without the margins of the certified march."""

from fractions import Fraction

import numpy as np
import pytest

import hybrid_rt as hrt
from hybrid_rt.kernels.techniques.certified import scalar as kernels
from support.compiled import from_python
from support.screens import lists_of, through

S = hrt.MarchStatus


@pytest.fixture(params=["vectors", "one by one"], autouse=True)
def kernel(request, monkeypatch):
    """Run every test with either kernel."""
    if request.param == "one by one":
        monkeypatch.setattr("hybrid_rt.techniques.certified._countable", lambda *_: False)


F = np.float32

start_depth, depth_at = map(from_python, (kernels.start_depth, kernels.depth_at))


def test_a_ray_that_float32_puts_into_the_next_row_meets_the_wires_of_its_own():
    # y is about 9000 pixels, where float32 has steps of 2**-10; the ray runs a third of that above
    # the border of two rows and is walked in the row below. Every wire is higher than the border.
    width, height = 64, 16384
    camera = hrt.Camera.look_at(
        (0, 0, 0), (0, 0, -1), vfov_deg=90, width=width, height=height, near=0.5
    )
    f = camera.focal_px
    corners = [(0.0035, -9, -0.5), (0.0035, 9, -0.5), (0.0035, 0, -9.0)]  # ends every ray
    origins = []
    for row in range(8701, 9216, 5):
        y = F(-(row - height / 2) / f)
        ulp = np.spacing(abs(y))
        above = [F(y + k * ulp) for k in range(1, 9)]
        y = next((v for v in above if -4.5e-4 < height / 2 - f * float(v) - row < -2.5e-4), None)
        if y is None:
            continue
        low, high = np.nextafter(y, F(-9)), np.nextafter(y, F(9))
        assert height / 2 - f * float(low) < row
        deep = np.spacing(F(1))
        corners += [(0.001, low, -1 + deep), (0.001, low, -1 - deep), (0.001, high, -1)]
        origins.append((-0.0035, y, -1.0))
    assert len(origins) > 50
    points = np.array(corners, np.float32)
    scene = hrt.Scene.from_arrays(points, np.arange(len(points)).reshape(-1, 3))
    gbuffer = hrt.rasterize(scene, camera)
    rays = hrt.Rays.from_arrays(origins, np.tile((1.0, 0, 0), (len(origins), 1)))
    marched = through(rays, gbuffer, hrt.Certified(lists=2))
    assert (marched.status == S.HIT).all()
    assert (marched.prim_id == 1 + np.arange(len(rays))).all()


def test_the_depth_of_the_walk_is_never_nearer_than_the_ray():
    rng = np.random.default_rng(0)
    tight = 0
    for _ in range(3000):
        depth = float(rng.uniform(1e-3, 1))
        far = depth * float(rng.choice([0.0, rng.uniform(0, 2), 1 + rng.uniform(-1e-6, 1e-6)]))
        scale = float(10 ** rng.uniform(-3, 3))
        end = float(rng.uniform(0.5, 8000))
        s_end = end / scale
        dz = (far - depth) / s_end
        z0, sz = start_depth(depth, dz, s_end), F(dz / scale)
        s = F(rng.uniform(0, end))
        walked = depth_at(z0, sz, s)
        true = Fraction(depth) + Fraction(dz) * Fraction(float(s)) / Fraction(scale)
        assert Fraction(float(walked)) <= true
        tight += true - Fraction(float(walked)) < Fraction(max(depth, far)) * 16 / 2**24
    assert tight == 3000


def test_bounds_are_rounded_up():
    # A wall that faces the camera: its depth is 0.1 / z, which float32 seldom holds.
    camera = hrt.Camera.look_at((0, 0, 0), (0, 0, -1), vfov_deg=90, width=4, height=4, near=0.1)
    down = 0
    for k in range(200):
        z = F(1.0 + k * 0.037)
        points = np.array([(-99, -99, -z), (99, -99, -z), (0, 99, -z)], np.float32)
        lists = lists_of(hrt.Scene.from_arrays(points, [[0, 1, 2]]), camera, 1)
        true = Fraction(0.1) / Fraction(float(z))
        assert Fraction(float(lists.nearest[2, 2, 0])) >= true
        down += F(float(true)) < true
    assert down > 50  # rounded to nearest they would be too far


def test_a_ray_and_the_plane_that_it_starts_on():
    # Mirror rays of a tilted plane leave it; its neighbours in the same plane must not stop them.
    camera = hrt.Camera.look_at((0, 2, 5), (0, 0, 0), width=64, height=48, near=0.1)
    x, z = np.meshgrid(np.linspace(-6, 6, 13), np.linspace(-6, 4, 11))
    y = 0.1 * x + 0.05 * z
    points = np.stack([x, y, z], axis=-1).reshape(-1, 3)
    quads = [(j * 13 + i, j * 13 + i + 1, (j + 1) * 13 + i, (j + 1) * 13 + i + 1)
             for j in range(10) for i in range(12)]  # fmt: skip
    faces = [t for a, b, c, d in quads for t in ((a, b, c), (b, d, c))]
    scene = hrt.Scene.from_arrays(points, faces)
    gbuffer = hrt.rasterize(scene, camera)
    rays = hrt.mirror_rays(gbuffer)
    marched = through(rays, gbuffer, hrt.Certified(lists=4))
    assert not (marched.status == S.HIT).any()
    assert (marched.status == S.MISS).mean() > 0.8
