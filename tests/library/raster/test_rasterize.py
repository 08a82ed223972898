"""The rasteriser against the naive one, and what it promises."""

import os
import subprocess
import sys
import time

import numpy as np
import pytest

import hybrid_rt as hrt
from hybrid_rt.raster import rasterize as raster_module
from hybrid_rt_scenes import get_scene
from naive import raster as naive
from support.machines import MACHINES, machine

CHANNELS = ("depth", "ddx", "ddy", "prim_id")


def same(gbuffer, other):
    for name in CHANNELS:
        a, b = getattr(gbuffer, name), getattr(other, name)
        assert np.array_equal(a, b), f"{name} differs in {(a != b).sum()} pixels"


def same_as_naive(scene, camera):
    gbuffer = hrt.rasterize(scene, camera)
    wanted = naive.rasterize(scene.vertices, scene.faces, camera)
    for name, want in zip(CHANNELS, wanted, strict=True):
        got = getattr(gbuffer, name)
        assert got.dtype == want.dtype
        assert np.array_equal(got, want), f"{name} differs in {(got != want).sum()} pixels"
    return gbuffer


def soup(rng, n, size, spread=3.0, offset=0.0):
    centre = rng.uniform(-spread, spread, (n, 1, 3)) + offset
    corners = centre + size * rng.normal(size=(n, 3, 3))
    return hrt.Scene.from_arrays(
        corners.reshape(-1, 3).astype(np.float32), np.arange(3 * n, dtype=np.int32).reshape(n, 3)
    )


@pytest.mark.parametrize(
    ("width", "height"), [(1, 1), (1, 37), (37, 1), (2, 2), (33, 31), (64, 32), (65, 70)]
)
@pytest.mark.parametrize("size", [0.02, 0.3, 5.0])
def test_soup_seen_from_outside(width, height, size):
    rng = np.random.default_rng(width * 100 + height)
    camera = hrt.Camera.look_at((0, 0, 6), (0.1, 0.3, 0), width=width, height=height)
    same_as_naive(soup(rng, 20, size), camera)


@pytest.mark.parametrize("seed", range(8))
def test_eye_inside_the_soup(seed):
    """Triangles cross the near plane, lie behind the eye and cover the screen many times over."""
    rng = np.random.default_rng(seed)
    camera = hrt.Camera.look_at(
        (0.1, 0.2, 0.3), rng.normal(size=3), vfov_deg=90, width=40, height=35, near=10.0**-seed
    )
    gbuffer = same_as_naive(soup(rng, 25, 10.0 ** rng.uniform(-1, 1.5)), camera)
    assert gbuffer.depth.max() <= 1.0


@pytest.mark.parametrize("offset", [1e3, 1e5, 1e6])
def test_scene_far_from_the_origin(offset):
    rng = np.random.default_rng(5)
    camera = hrt.Camera.look_at(
        (offset, offset, offset + 6), (offset, offset, offset), width=40, height=30
    )
    gbuffer = same_as_naive(soup(rng, 20, 1.0, offset=offset), camera)
    assert (gbuffer.prim_id >= 0).any()


def test_triangles_beyond_the_guard_band():
    """Millions of pixels wide, with and without crossing the near plane."""
    vertices = np.array(
        [(-1e7, -1, -2), (1e7, -1, -2), (3, 1e7, -9), (-1e6, -1e6, 1e3), (1e6, -2e6, -1e6)], "f4"
    )
    faces = np.array([(0, 1, 2), (3, 4, 2), (2, 4, 0), (1, 3, 0)], "i4")
    camera = hrt.Camera.look_at((0, 0, 0), (0, 0.1, -1), width=70, height=40, near=1e-3)
    gbuffer = same_as_naive(hrt.Scene.from_arrays(vertices, faces), camera)
    assert set(np.unique(gbuffer.prim_id)) - {-1}


def test_slivers_and_triangles_without_area():
    rng = np.random.default_rng(3)
    a = rng.uniform(-3, 3, (40, 3))
    b = rng.uniform(-3, 3, (40, 3))
    c = a + rng.uniform(0, 1, (40, 1)) * (b - a)  # on the edge, up to rounding
    c[:20] += 10.0 ** rng.uniform(-7, -1, (20, 3))
    c[35:] = a[35:]
    scene = hrt.Scene.from_arrays(
        np.stack([a, b, c], axis=1).reshape(-1, 3), np.arange(120).reshape(40, 3)
    )
    camera = hrt.Camera.look_at((0, 1, 5), (0, 0, 0), width=60, height=60)
    gbuffer = same_as_naive(scene, camera)
    assert gbuffer.prim_id.max() < 35
    assert np.isfinite(gbuffer.ddx).all()
    assert np.isfinite(gbuffer.ddy).all()


def test_plane_through_the_eye_is_not_seen():
    vertices = np.array([(-1, 0, -1), (1, 0, -1), (0, 0, -9)], "f4")
    scene = hrt.Scene.from_arrays(vertices, [[0, 1, 2]])
    gbuffer = hrt.rasterize(scene, hrt.Camera.look_at((0, 0, 0), (0, 0, -1), width=9, height=9))
    assert (gbuffer.prim_id == -1).all()
    assert (gbuffer.depth == 0).all()


def test_equal_depth_goes_to_the_smallest_prim_id():
    """The same triangle again: rotated, turned round, and with vertices of its own."""
    vertices = np.array([(-1, -1, -3), (2, -1, -4), (0, 1, -5)] * 2, "f4")
    same_ones = [(4, 5, 3), (0, 1, 2), (1, 2, 0), (2, 1, 0), (5, 4, 3)]
    scene = hrt.Scene.from_arrays(vertices, np.array(same_ones, "i4"))
    camera = hrt.Camera.look_at((0, 0, 0), (0, 0, -1), width=80, height=60)
    assert set(np.unique(hrt.rasterize(scene, camera).prim_id)) == {-1, 0}


def sphere(columns=24, rows=16):
    """A closed sphere of radius 1; poles are shared vertices."""
    theta = np.pi * np.arange(1, rows) / rows
    phi = 2 * np.pi * np.arange(columns) / columns
    ring = np.stack(
        [
            np.outer(np.sin(theta), np.cos(phi)),
            np.outer(np.cos(theta), np.ones(columns)),
            np.outer(np.sin(theta), np.sin(phi)),
        ],
        axis=-1,
    ).reshape(-1, 3)
    vertices = np.vstack([ring, [(0, 1, 0), (0, -1, 0)]])
    top, bottom = len(ring), len(ring) + 1
    faces = []
    for i in range(columns):
        k = (i + 1) % columns
        faces.append((top, i, k))
        faces.append((bottom, (rows - 2) * columns + k, (rows - 2) * columns + i))
        for j in range(rows - 2):
            a, b = j * columns + i, j * columns + k
            faces += [(a, a + columns, b), (b, a + columns, b + columns)]
    return vertices.astype(np.float32), np.array(faces, np.int32)


def times_covered(vertices, faces, camera):
    """Render every triangle on its own and count."""
    count = np.zeros((camera.height, camera.width), int)
    for face in faces:
        scene = hrt.Scene.from_arrays(vertices, [face])
        count += hrt.rasterize(scene, camera, threads=1).prim_id == 0
    return count


def test_fan_and_grid_cover_every_pixel_once():
    """Shared vertices on pixel centres and edges along them: the top-left rule at its hardest."""
    n, size = 8, 64
    camera = hrt.Camera.look_at((0, 0, 0), (0, 0, -1), vfov_deg=90, width=size, height=size)
    # At z = -32 one unit is one pixel; the grid's lines go through pixel centres.
    x, y = np.meshgrid(np.linspace(-31.5, 31.5, n + 1), np.linspace(-31.5, 31.5, n + 1))
    grid = np.stack([x, y, np.full_like(x, -32)], axis=-1).reshape(-1, 3)
    faces = []
    for j in range(n):
        for i in range(n):
            a = j * (n + 1) + i
            faces += [(a, a + 1, a + n + 2), (a + n + 2, a, a + n + 1)]
    count = times_covered(grid, faces, camera)
    assert count.max() == 1
    assert count.sum() == 63 * 63  # top and left borders are in, bottom and right ones are out

    angle = 2 * np.pi * np.arange(40) / 40
    rim = np.stack([40 * np.cos(angle), 40 * np.sin(angle), np.full(40, -32.0)], axis=1)
    fan = [(0, 1 + k, 1 + (k + 1) % 40) for k in range(40)]
    count = times_covered(np.vstack([(0.5, 0.5, -32), rim]), fan, camera)
    inside = np.hypot(*np.mgrid[-31.5:32, -31.5:32]) < 39
    assert count.max() == 1
    assert (count[inside] == 1).all()


@pytest.mark.parametrize("eye", [(0, 0.1, 4), (0, 0, 1.3)])
def test_closed_mesh_from_outside_is_covered_twice(eye):
    vertices, faces = sphere()
    camera = hrt.Camera.look_at(eye, (0, 0, 0), width=61, height=61, near=0.01)
    assert set(np.unique(times_covered(vertices, faces, camera))) <= {0, 2}


@pytest.mark.parametrize("near", [0.001, 0.5, 0.9])
def test_closed_mesh_from_inside_is_covered_once(near):
    """Edges that are cut by the near plane on both sides of a crack-free mesh stay crack-free."""
    vertices, faces = sphere()
    camera = hrt.Camera.look_at(
        (0.05, 0.02, 0.01), (0.3, 0.9, 0.2), vfov_deg=60, width=47, height=53, near=near
    )
    count = times_covered(vertices, faces, camera)
    if near < 0.5:
        assert (count == 1).all()
    assert count.max() == 1
    whole = hrt.rasterize(hrt.Scene.from_arrays(vertices, faces), camera)
    assert np.array_equal(whole.prim_id >= 0, count == 1)


def test_ground_plane_has_the_closed_form():
    camera = hrt.Camera.look_at((1, 2, 3), (4, 1.2, -7), vfov_deg=55, width=51, height=41, near=0.1)
    ground = np.array([(-900, 0, -900), (900, 0, -900), (900, 0, 900), (-900, 0, 900)], "f4")
    g = hrt.rasterize(hrt.Scene.from_arrays(ground, [(0, 1, 2), (0, 2, 3)]), camera)
    # A ray eye + z r meets y = 0 at z = -eye_y / r_y, so depth = -near r_y / eye_y.
    x = np.arange(51) + 0.5 - 51 / 2
    y = np.arange(41) + 0.5 - 41 / 2
    f = camera.focal_px
    r_y = camera.forward[1] + x * camera.right[1] / f - y[:, None] * camera.up[1] / f
    depth = -camera.near * r_y / 2
    seen = g.prim_id >= 0
    assert seen[depth > 0.1 / 500].all()
    assert not seen[depth < 0].any()
    np.testing.assert_allclose(g.depth[seen], depth[seen], rtol=2e-7)
    np.testing.assert_allclose(g.ddy[seen], camera.near * camera.up[1] / f / 2, rtol=2e-7)
    np.testing.assert_allclose(g.ddx[seen], 0, atol=1e-15)


def test_sphere_is_where_it_should_be():
    vertices, faces = sphere(256, 128)
    camera = hrt.Camera.look_at((0, 0, 4), (0, 0, 0), vfov_deg=40, width=65, height=65, near=0.1)
    g = hrt.rasterize(hrt.Scene.from_arrays(vertices, faces), camera)
    x, y = np.meshgrid(np.arange(65) - 32.0, 32.0 - np.arange(65))
    r = np.stack([x / camera.focal_px, y / camera.focal_px, -np.ones_like(x)], axis=-1)
    a, b, c = (r**2).sum(axis=-1), r[..., 2] * 4, 15.0
    disc = b * b - a * c
    t = (-b - np.sqrt(np.maximum(disc, 0))) / a
    sure = disc > 0.2
    np.testing.assert_allclose(g.depth[sure], 0.1 / t[sure], rtol=5e-4)
    assert (g.prim_id[disc < 0] == -1).all()


def test_depth_is_the_exact_plane_rounded_once():
    rng = np.random.default_rng(11)
    scene = soup(rng, 12, 2.0)
    camera = hrt.Camera.look_at((0, 0, 6), (0, 0, 0), width=48, height=40)
    g = hrt.rasterize(scene, camera)
    near_edge = 0
    seen = np.argwhere(g.prim_id >= 0)
    for j, i in seen:
        face = scene.faces[g.prim_id[j, i]]
        exact = float(naive.exact_depth(scene.vertices, face, camera, i + 0.5, j + 0.5))
        near_edge += g.depth[j, i] != np.float32(exact)
    assert near_edge <= len(seen) * 0.002  # those kept within the range of the vertices


def test_quad_derivatives_are_differences_of_depth():
    rng = np.random.default_rng(2)
    scene = soup(rng, 15, 1.5)
    for width, height in [(20, 16), (21, 17), (1, 5), (5, 1), (1, 1), (2, 3)]:
        camera = hrt.Camera.look_at((0, 0, 6), (0, 0, 0), width=width, height=height)
        plane = hrt.rasterize(scene, camera)
        quad = hrt.rasterize(scene, camera, derivatives="quad")
        assert np.array_equal(plane.depth, quad.depth)
        assert np.array_equal(plane.prim_id, quad.prim_id)
        for j in range(height):
            for i in range(width):
                i0 = max(min(i - i % 2, width - 2), 0)
                j0 = max(min(j - j % 2, height - 2), 0)
                i1, j1 = min(i0 + 1, width - 1), min(j0 + 1, height - 1)
                assert quad.ddx[j, i] == plane.depth[j, i1] - plane.depth[j, i0]
                assert quad.ddy[j, i] == plane.depth[j1, i] - plane.depth[j0, i]


def test_batches_change_nothing(monkeypatch):
    """Small batches by faces, and batches cut in halves because they have too many entries."""
    rng = np.random.default_rng(9)
    scene = soup(rng, 300, 2.0)
    camera = hrt.Camera.look_at((0, 0, 3), (0, 0, 0), width=130, height=99)
    whole = hrt.rasterize(scene, camera)
    monkeypatch.setattr(raster_module, "BATCH_FACES", 37)
    same(hrt.rasterize(scene, camera), whole)
    monkeypatch.setattr(raster_module, "BATCH_FACES", 300)
    monkeypatch.setattr(raster_module, "BATCH_ENTRIES", 40)
    same(hrt.rasterize(scene, camera), whole)


def test_threads_change_nothing_and_inputs_stay():
    rng = np.random.default_rng(4)
    scene = soup(rng, 500, 1.0)
    camera = hrt.Camera.look_at((0, 0, 3), (0, 0, 0), width=200, height=99)
    before = scene.vertices.copy(), scene.faces.copy()
    same(hrt.rasterize(scene, camera, threads=1), hrt.rasterize(scene, camera))
    assert np.array_equal(scene.vertices, before[0])
    assert np.array_equal(scene.faces, before[1])


PROGRAM = """
import sys
import numpy as np
from library.raster.test_rasterize import CHANNELS, everywhere

gbuffer = everywhere()
np.savez(sys.argv[1], **{name: getattr(gbuffer, name) for name in CHANNELS})
"""


def everywhere():
    """Return what is seen from amidst triangles that are large, small and behind the eye."""
    rng = np.random.default_rng(7)
    parts = [soup(rng, n, size) for n, size in ((6, 2.0), (400, 0.1), (4000, 0.02))]
    scene = hrt.Scene.from_arrays(
        np.concatenate([part.vertices for part in parts]),
        np.arange(3 * 4406, dtype=np.int32).reshape(-1, 3),
    )
    camera = hrt.Camera.look_at((0, 0, 4), (0.1, 0.2, 0), width=150, height=99)
    return hrt.rasterize(scene, camera)


@pytest.mark.slow
@pytest.mark.parametrize("name", MACHINES)
def test_the_same_on_another_machine(name, tmp_path):
    env, _ = machine(name)
    env["PYTHONPATH"] = os.pathsep.join(sys.path)
    path = tmp_path / "gbuffer.npz"
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, str(path)],
        env=env, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    gbuffer = everywhere()
    shown = np.histogram(gbuffer.prim_id, [-1, 0, 6, 406, 4406])[0]
    assert (shown > 100).all()
    with np.load(path) as other:
        for channel in CHANNELS:
            assert np.array_equal(getattr(gbuffer, channel), other[channel]), channel


@pytest.mark.parametrize(
    ("change", "argument"),
    [
        ({"scene": "sponza"}, "scene"),
        ({"camera": None}, "camera"),
        ({"derivatives": "gpu"}, "derivatives"),
        ({"threads": 0}, "threads"),
        ({"threads": 100_000}, "threads"),
        ({"threads": 1.5}, "threads"),
    ],
)
def test_bad_arguments_are_named(change, argument):
    good = {
        "scene": soup(np.random.default_rng(0), 1, 1.0),
        "camera": hrt.Camera.look_at((0, 0, 3), (0, 0, 0), width=4, height=4),
    }
    with pytest.raises(hrt.ArgumentError) as error:
        hrt.rasterize(**(good | change))
    assert error.value.argument == argument


def test_the_stages_are_timed():
    spec = get_scene("cornell")
    camera = spec.camera(next(iter(spec.cameras)), 32, 24)
    scene = spec.load()
    hrt.rasterize(scene, camera, threads=1)
    before = time.perf_counter()
    timings = hrt.rasterize(scene, camera, threads=1).timings
    took = time.perf_counter() - before
    assert list(timings) == ["vertices", "cull", "records", "tiles"]
    assert min(timings.values()) > 0
    assert sum(timings.values()) <= took
