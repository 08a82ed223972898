"""Mirror rays: where they start, where they go, and that they leave their own surface."""

from fractions import Fraction

import numpy as np
import pytest

import hybrid_rt as hrt


def bumpy_floor(n=24, size=4.0, seed=0):
    """Return a floor of 2 (n - 1)^2 triangles with hills."""
    rng = np.random.default_rng(seed)
    x, z = np.meshgrid(np.linspace(-size, size, n), np.linspace(-size, size, n), indexing="ij")
    y = 0.3 * np.sin(2.1 * x) * np.cos(1.7 * z) + 0.02 * rng.normal(size=x.shape)
    vertices = np.stack([x, y, z], axis=-1).reshape(-1, 3)
    i = np.arange(n * (n - 1)).reshape(n - 1, n)[:, :-1].ravel()
    faces = np.concatenate(
        [np.stack([i, i + 1, i + n], axis=1), np.stack([i + 1, i + n + 1, i + n], axis=1)]
    )
    return vertices, faces


def view(scene, scale=1.0, offset=(0.0, 0.0, 0.0), size=(97, 61)):
    eye = np.array([0.3, 1.5, 3.5]) * scale + offset
    target = np.array([0.0, 0.1, 0.0]) * scale + offset
    camera = hrt.Camera.look_at(
        eye, target, vfov_deg=60, width=size[0], height=size[1], near=0.01 * scale
    )
    return hrt.rasterize(scene, camera)


def test_one_ray_for_each_covered_pixel_in_tile_order():
    vertices, faces = bumpy_floor()
    buffer = view(hrt.Scene.from_arrays(vertices, faces), size=(75, 50))
    rays = hrt.mirror_rays(buffer)
    x, y = rays.pixel.T
    covered = np.zeros_like(buffer.prim_id, bool)
    covered[y, x] = True
    np.testing.assert_array_equal(covered, buffer.prim_id >= 0)
    assert len(rays) == covered.sum() > 0
    tile = (y // 32) * 3 + x // 32
    assert (np.diff(tile) >= 0).all()
    step = np.abs(np.diff(rays.pixel, axis=0)).max(axis=1)
    assert np.median(step) == 1


def test_a_mirror_on_the_floor_turns_the_view_upwards():
    floor = np.array([[-50, 0, -50], [50, 0, -50], [50, 0, 50], [-50, 0, 50]], float)
    scene = hrt.Scene.from_arrays(floor, [[0, 1, 2], [0, 2, 3]])
    camera = hrt.Camera.look_at((0, 2, 5), (0, 0, 0), width=33, height=17, near=0.1)
    rays = hrt.mirror_rays(hrt.rasterize(scene, camera))
    pixel = np.concatenate([rays.pixel + 0.5, np.full((len(rays), 1), 0.1)], axis=1)
    seen = hrt.unproject(camera, pixel) - np.array(camera.eye)
    seen /= np.linalg.norm(seen, axis=1, keepdims=True)
    np.testing.assert_allclose(rays.direction, seen * (1, -1, 1), atol=1e-6)
    np.testing.assert_allclose(rays.origin[:, 1], 0, atol=1e-6)
    back = hrt.project(camera, rays.origin)
    np.testing.assert_allclose(back[:, :2], rays.pixel + 0.5, atol=1e-3)
    np.testing.assert_allclose(np.linalg.norm(rays.direction, axis=1), 1, atol=1e-6)


def height_over_plane(scene, prim, origin):
    """Return dot(n, o - a) / |n| exactly rounded once, n being the unnormalised normal."""
    a, b, c = ([Fraction(float(x)) for x in scene.vertices[k]] for k in scene.faces[prim])
    o = [Fraction(float(x)) for x in origin]
    e1, e2 = [q - p for p, q in zip(a, b, strict=True)], [q - p for p, q in zip(a, c, strict=True)]
    n = [
        e1[1] * e2[2] - e1[2] * e2[1],
        e1[2] * e2[0] - e1[0] * e2[2],
        e1[0] * e2[1] - e1[1] * e2[0],
    ]
    height = sum(n[k] * (o[k] - a[k]) for k in range(3))
    return float(height) / float(sum(x * x for x in n)) ** 0.5, [float(x) for x in n]


PLACES = [
    (1.0, (0, 0, 0)),
    (1.0, (1e3, -1e3, 1e3)),
    (1.0, (1e4, 0, -3e4)),
    (1e-4, (0, 0, 0)),
    (1e6, (0, 0, 0)),
]


@pytest.mark.parametrize(("scale", "offset"), PLACES)
def test_origins_lie_on_the_side_they_leave_to(scale, offset):
    vertices, faces = bumpy_floor()
    scene = hrt.Scene.from_arrays(vertices * scale + offset, faces)
    buffer = view(scene, scale, offset)
    rays = hrt.mirror_rays(buffer)
    biggest = np.abs(rays.origin).max()
    for i in range(0, len(rays), max(1, len(rays) // 500)):
        x, y = rays.pixel[i]
        height, normal = height_over_plane(scene, buffer.prim_id[y, x], rays.origin[i])
        side = np.sign(np.dot(normal, rays.direction[i].astype(float)))
        assert height * side > 0
        assert abs(height) <= 6 * 2.0**-23 * biggest  # a few ulps of the coordinates, no more


@pytest.mark.parametrize("robust", [False, True])
@pytest.mark.parametrize(("scale", "offset"), PLACES)
def test_no_ray_hits_the_triangle_it_starts_on(scale, offset, robust):
    vertices, faces = bumpy_floor(60)
    scene = hrt.Scene.from_arrays(vertices * scale + offset, faces)
    buffer = view(scene, scale, offset, size=(400, 240))
    rays = hrt.mirror_rays(buffer)
    own = buffer.prim_id[rays.pixel[:, 1], rays.pixel[:, 0]]
    hits = hrt.EmbreeTracer(scene, robust=robust).intersect(rays)
    assert (hits.prim_id >= 0).sum() > 0.01 * len(rays)
    assert (hits.prim_id == own).sum() == 0


def test_t_near_is_small_beside_the_triangle():
    vertices, faces = bumpy_floor()
    buffer = view(hrt.Scene.from_arrays(vertices, faces))
    rays = hrt.mirror_rays(buffer)
    edge = 8 / 23
    assert (rays.t_near > 0).all()
    assert np.median(rays.t_near) < 1e-5 * edge
    assert np.isinf(rays.t_far).all()


def test_an_empty_view_has_no_rays():
    vertices, faces = bumpy_floor()
    camera = hrt.Camera.look_at((0, 5, 0), (0, 9, 1), width=20, height=10)
    rays = hrt.mirror_rays(hrt.rasterize(hrt.Scene.from_arrays(vertices, faces), camera))
    assert len(rays) == 0


@pytest.mark.parametrize(
    ("kwargs", "message"),
    [
        ({"origin": np.zeros((2, 2))}, r"origin: expected an array of shape \(N, 3\)"),
        ({"origin": np.zeros((2, 3), complex)}, "origin: .* got .*complex128"),
        ({"origin": [["a", "b", "c"]]}, "origin: "),
        ({"direction": np.zeros((1, 3))}, "direction: expected 2 rows, as many as origin, got 1"),
        ({"pixel": np.zeros((2, 2))}, "pixel: expected .* dtype int32, got .* float64"),
        ({"t_near": [-1.0, 0.0]}, "t_near: expected values >= 0"),
        ({"t_near": [np.nan, 0.0]}, "t_near: expected values >= 0"),
        ({"t_far": [np.nan, 0.0]}, "t_far: expected values that are not NaN"),
        ({"t_far": [1.0]}, "t_far: expected 2 rows"),
    ],
)
def test_bad_rays(kwargs, message):
    arguments = {"origin": np.zeros((2, 3)), "direction": np.ones((2, 3))} | kwargs
    with pytest.raises(hrt.ArgumentError, match="^" + message):
        hrt.Rays.from_arrays(**arguments)
