"""The depth planes of triangles in float32 against exact rational arithmetic."""

from fractions import Fraction

import numpy as np

import hybrid_rt as hrt
from hybrid_rt.kernels.raster.lists_planes import (
    DEPTH,
    ERROR,
    REFERENCE_X,
    REFERENCE_Y,
    SLOPE_X,
    SLOPE_Y,
)
from hybrid_rt.kernels.techniques.certified import scalar as kernels
from naive import lists as naive
from support.compiled import from_python
from support.screens import lists_of
from support.soup import random_scene

F = np.float32
U = 2.0**-24

apart = from_python(kernels.apart)


def planes_case(seed):
    """Return (rng, lists, projected triangles, places); a place is (face, x, y) in float32.

    Triangles of all sizes, slivers, some that cross the near plane, some seen nearly edge-on. The
    places lie in grown pixels that the triangle touches.
    """
    rng = np.random.default_rng(seed)
    scene = random_scene(rng, 14)
    camera = hrt.Camera.look_at(
        (0.1, 0.2, 3), (0.2, 0, -1), vfov_deg=(80, 20)[seed % 2], width=(19, 640)[seed % 3 == 1],
        height=13, near=0.1,
    )  # fmt: skip
    corners = scene.vertices[scene.faces].astype(float)
    eye = np.array(camera.eye)
    for k in range(4):  # the third corner in the plane of the eye and the others, but for a little
        a, b = corners[k, 0], corners[k, 1]
        tilt = 10.0 ** -(k + 1) * rng.normal(size=3)
        corners[k, 2] = a + 0.5 * (b - a) + 0.3 * (a - eye) + tilt
    scene = hrt.Scene.from_arrays(corners.reshape(-1, 3), scene.faces)
    lists = lists_of(scene, camera, 14)
    matrix, q = camera.arrays.m, {}
    for face in range(len(scene)):
        q[face] = [
            naive.projected(p, matrix, camera.eye) for p in scene.vertices[scene.faces[face]]
        ]
    rows, columns, _ = np.nonzero(lists.prim_id >= 0)
    faces = lists.prim_id[lists.prim_id >= 0]
    places = []
    for k in rng.permutation(len(faces))[:400]:
        at = rng.choice([0.0, 1.0, rng.random()], 2) + rng.uniform(-1, 1, 2) * lists.margin_px
        x, y = F(columns[k] + at[0]), F(rows[k] + at[1])
        if np.isfinite(lists.planes[faces[k], DEPTH]):
            places.append((int(faces[k]), x, y))
    return rng, lists, q, places


def places_of(seeds):
    """Return what is known of each place in the cases of some seeds."""
    for seed in seeds:
        rng, lists, q, places = planes_case(seed)
        for face, x, y in places:
            yield rng, lists, q[face], face, x, y


def test_a_plane_errs_by_less_than_it_says():
    places, largest = 0, 0.0
    for rng, lists, corners, face, x, y in places_of(range(10)):
        places += 1
        row = lists.planes[face]
        a, b, c = row[SLOPE_X], row[SLOPE_Y], row[DEPTH]
        found = c + a * (x - row[REFERENCE_X]) + b * (y - row[REFERENCE_Y])
        assert found.dtype == np.float32
        off = rng.choice([-0.5, 0.5, 0.0], 2) * lists.margin_px
        true_x, true_y = (
            Fraction(float(v)) + Fraction(o) for v, o in zip((x, y), off, strict=True)
        )
        true = naive.plane_depth(corners, true_x, true_y)
        error = abs(Fraction(float(found)) - true)
        assert error < Fraction(float(row[ERROR])), (face, x, y)
        largest = max(largest, float(error) / float(row[ERROR]))
    assert places > 500
    assert largest > 0.05  # and what it says is not out of all proportion


def test_a_ray_is_never_apart_from_a_plane_that_it_meets():
    met = parted = 0
    for rng, lists, corners, face, x, y in places_of(range(100, 110)):
        row = lists.planes[face]
        # A stretch of a ray, from s to s_exit inside of the pixel, and where in it it meets the
        # plane. The true ray is beside the walked one by a quarter of the margin.
        sx, sy = F(rng.uniform(-1, 1)), F(rng.uniform(-1, 1))
        length = F(rng.choice([0.0, 1e-3, 0.1]))
        s = F(rng.uniform(0, 5))
        s_exit = s + length
        sigma = Fraction(float(rng.choice([s, s_exit])))
        x0, y0 = F(x - sx * s), F(y - sy * s)
        off = rng.choice([-0.25, 0.25], 2) * lists.margin_px
        true_x = Fraction(float(x0)) + Fraction(float(sx)) * sigma + Fraction(off[0])
        true_y = Fraction(float(y0)) + Fraction(float(sy)) * sigma + Fraction(off[1])
        depth = naive.plane_depth(corners, true_x, true_y)
        if not 0 < depth <= 1:
            continue
        sz = F(rng.choice([0.0, rng.uniform(-0.1, 0.1)]) * float(depth))
        z_error = F(kernels.HIGH_ULPS * U * 2 * float(depth))
        for share in (0.2, 0.4, 0.7):  # how much lower the ray is taken for than it is
            z0 = F(float(depth) - float(sz) * float(sigma) - share * float(z_error))
            line = z0, sx, sy, sz, z_error
            walked = Fraction(float(z0)) + Fraction(float(sz)) * sigma
            assert 0 < depth - walked < Fraction(float(z_error))
            met += 1
            assert not apart(lists.planes, face, s, s_exit, x0, y0, *line), (face, x, y)
        # Well before the plane, and well behind it.
        reach = abs(row[SLOPE_X]) + abs(row[SLOPE_Y]) + abs(sz)
        clear = F(2) * (row[ERROR] + z_error) + length * reach
        for z in (z0 + clear, z0 - clear):
            parted += apart(lists.planes, face, s, s_exit, x0, y0, z, sx, sy, sz, z_error)
    assert met > 2000
    assert parted > met / 4  # of up to two thirds
