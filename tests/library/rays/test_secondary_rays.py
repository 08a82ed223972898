"""Glossy, diffuse, ambient-occlusion and shadow rays: directions, limits, densities."""

import math

import numba
import numpy as np
import pytest
from scipy import stats

import hybrid_rt as hrt
from hybrid_rt.kernels._jit import kernel
from hybrid_rt.kernels.secondary.philox import philox
from naive import rays as naive

# All low: what they light lies partly in shadow.
SUN = hrt.DirectionalLight((-1.0, -0.35, 0.5))
LAMP = hrt.PointLight((1.5, 0.6, 0.3))
PANEL = hrt.AreaLight((-3.5, 0.5, -1), (0, 0.4, 2), (1, 0.2, 0))

MAKERS = {
    "glossy": lambda g: hrt.glossy_rays(g, 0.6, seed=3),
    "diffuse": lambda g: hrt.diffuse_rays(g, seed=3),
    "ambient_occlusion": lambda g: hrt.ambient_occlusion_rays(g, 0.5, seed=3),
    "point": lambda g: hrt.shadow_rays(g, LAMP),
    "area": lambda g: hrt.shadow_rays(g, PANEL, seed=3),
    "sun": lambda g: hrt.shadow_rays(g, SUN),
}
PLACES = [(1.0, (0, 0, 0)), (1.0, (1e4, 0, -3e4)), (1e-4, (0, 0, 0)), (1e6, (0, 0, 0))]


def hills(n=24):
    """Return a bumpy square of 2 (n - 1)**2 triangles, 8 wide."""
    x, z = np.meshgrid(np.linspace(-4, 4, n), np.linspace(-4, 4, n), indexing="ij")
    y = 0.4 * np.sin(1.7 * x) * np.cos(1.3 * z)
    i = np.arange(n * n).reshape(n, n)[:-1, :-1].ravel()
    faces = [np.stack([i, i + 1, i + n], axis=1), np.stack([i + 1, i + n + 1, i + n], axis=1)]
    return np.stack([x, y, z], axis=-1).reshape(-1, 3), np.concatenate(faces)


def view(scale=1.0, offset=(0.0, 0.0, 0.0), size=(97, 61)):
    vertices, faces = hills()
    scene = hrt.Scene.from_arrays(vertices * scale + offset, faces)
    eye, target = np.array([0.3, 1.5, 3.5]) * scale + offset, np.array([0.0, 0.1, 0.0]) * scale
    camera = hrt.Camera.look_at(
        eye, target + offset, width=size[0], height=size[1], near=0.01 * scale
    )
    return hrt.rasterize(scene, camera)


@pytest.fixture(scope="module")
def buffer():
    return view()


def normals(buffer, pixel):
    """Return float64 unit normals of the pixels' triangles, turned to the viewer, and the view."""
    scene, camera = buffer.scene, buffer.camera
    prim = buffer.prim_id[pixel[:, 1], pixel[:, 0]]
    a, b, c = (scene.vertices[scene.faces[prim, k]].astype(float) for k in range(3))
    n = np.cross(b - a, c - a)
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    x = (pixel[:, 0] + 0.5 - camera.width / 2) / camera.focal_px
    y = (camera.height / 2 - pixel[:, 1] - 0.5) / camera.focal_px
    d = np.array(camera.forward) + x[:, None] * camera.right + y[:, None] * np.array(camera.up)
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    return np.where((n * d).sum(axis=1, keepdims=True) > 0, -n, n), d


def flat(vfov_deg=60.0, size=64, eye=(0.0, 2.0, 3.0)):
    """Return a view of a floor that fills the picture."""
    floor = np.array([[-500, 0, -500], [500, 0, -500], [500, 0, 500], [-500, 0, 500]], float)
    scene = hrt.Scene.from_arrays(floor, [[0, 1, 2], [0, 2, 3]])
    camera = hrt.Camera.look_at(eye, (0, 0, 0), vfov_deg=vfov_deg, width=size, height=size)
    return hrt.rasterize(scene, camera)


@kernel
def words(c0, c1, c2, c3, k0, k1):
    return philox(c0, c1, c2, c3, k0, k1)


@pytest.mark.parametrize(
    ("counter", "key", "expected"),
    [  # the known answers published with the generator (Random123, philox4x32 with 10 rounds)
        ((0,) * 4, (0,) * 2, (0x6627E8D5, 0xE169C58D, 0xBC57AC4C, 0x9B00DBD8)),
        ((2**32 - 1,) * 4, (2**32 - 1,) * 2, (0x408F276D, 0x41C83B0E, 0xA20BC7C6, 0x6D5451FD)),
        (
            (0x243F6A88, 0x85A308D3, 0x13198A2E, 0x03707344),
            (0xA4093822, 0x299F31D0),
            (0xD16CFE09, 0x94FDCCEB, 0x5001E420, 0x24126EA1),
        ),
    ],
)
def test_random_words_are_those_of_philox(counter, key, expected):
    assert tuple(naive.philox(counter, key)) == expected
    assert words(*counter, *key) == expected


@pytest.mark.parametrize("kind", MAKERS)
def test_common_parts_are_those_of_the_mirror_rays(buffer, kind):
    rays, mirror = MAKERS[kind](buffer), hrt.mirror_rays(buffer)
    order = {tuple(p): i for i, p in enumerate(mirror.pixel)}
    index = np.array([order[tuple(p)] for p in rays.pixel])
    assert 0.2 * len(mirror) < len(rays) <= len(mirror)
    assert (np.diff(index) > 0).all()  # the same order
    np.testing.assert_array_equal(rays.origin, mirror.origin[index])
    np.testing.assert_allclose(np.linalg.norm(rays.direction.astype(float), axis=1), 1, atol=2e-7)
    # one bound of the distance, over the ray's own cosine
    n, _ = normals(buffer, rays.pixel)
    own = np.abs((n * rays.direction).sum(axis=1))
    other = np.abs((n * mirror.direction[index]).sum(axis=1))
    ordinary = (rays.t_near < 0.9 * rays.t_far) & (own > 1e-4) & (other > 1e-4)
    assert ordinary.mean() > 0.9
    np.testing.assert_allclose(
        (rays.t_near * own)[ordinary], (mirror.t_near[index] * other)[ordinary], rtol=2e-3
    )


@pytest.mark.parametrize("kind", MAKERS)
@pytest.mark.parametrize(("scale", "offset"), PLACES)
def test_no_ray_goes_below_its_surface_or_hits_it(kind, scale, offset):
    buffer = view(scale, offset, size=(160, 100))
    lamp = hrt.PointLight(np.array(LAMP.position) * scale + offset)
    panel = hrt.AreaLight(
        np.array(PANEL.corner) * scale + offset,
        np.array(PANEL.edge_u) * scale,
        np.array(PANEL.edge_v) * scale,
    )
    rays = {
        **MAKERS,
        "ambient_occlusion": lambda g: hrt.ambient_occlusion_rays(g, 0.5 * scale, seed=3),
        "point": lambda g: hrt.shadow_rays(g, lamp),
        "area": lambda g: hrt.shadow_rays(g, panel, seed=3),
    }[kind](buffer)
    assert len(rays) > 1000
    n, _ = normals(buffer, rays.pixel)
    assert ((n * rays.direction).sum(axis=1) > -1e-15).all()
    own = buffer.prim_id[rays.pixel[:, 1], rays.pixel[:, 0]]
    assert (rays.t_near > 0).all()
    assert (rays.t_near <= rays.t_far).all()
    for robust in (False, True):
        hits = hrt.EmbreeTracer(buffer.scene, robust=robust).intersect(rays)
        assert (hits.prim_id >= 0).sum() > 10
        assert (hits.prim_id == own).sum() == 0


def test_directions_are_those_of_the_oracle(buffer):
    covered = np.argwhere(buffer.prim_id >= 0)[:, ::-1]
    n, view = normals(buffer, covered)
    seed = 2**40 + 17
    glossy = hrt.glossy_rays(buffer, 0.7, seed)
    diffuse = hrt.diffuse_rays(buffer, seed)
    occlusion = hrt.ambient_occlusion_rays(buffer, 0.25, seed)
    got_glossy = {tuple(p): d for p, d in zip(glossy.pixel, glossy.direction, strict=True)}
    got_diffuse = {tuple(p): d for p, d in zip(diffuse.pixel, diffuse.direction, strict=True)}
    assert len(got_diffuse) == len(covered)
    dropped = 0
    for i in range(0, len(covered), 11):
        pixel = tuple(covered[i])
        u = naive.uniforms(int(pixel[0]), int(pixel[1]), seed)
        np.testing.assert_allclose(got_diffuse[pixel], naive.cosine(n[i], *u), atol=1e-7)
        expected = naive.glossy(view[i], n[i], 0.49, *u)
        if expected @ n[i] < 1e-6:
            dropped += 1
            assert pixel not in got_glossy
        else:
            np.testing.assert_allclose(got_glossy[pixel], expected, atol=2e-7)
    assert dropped > 5
    np.testing.assert_array_equal(occlusion.direction, diffuse.direction)
    assert (occlusion.t_far == 0.25).all()
    assert np.isinf(diffuse.t_far).all()
    assert np.isinf(glossy.t_far).all()


def test_roughness_zero_is_a_mirror(buffer):
    mirror, glossy = hrt.mirror_rays(buffer), hrt.glossy_rays(buffer, 0.0)
    assert len(glossy) == len(mirror)
    np.testing.assert_allclose(glossy.direction, mirror.direction, atol=2e-7)


def test_a_narrow_lobe_lies_about_the_mirror_direction(buffer):
    mirror = hrt.mirror_rays(buffer)
    spread = []
    for roughness in (0.05, 0.2, 0.5):
        rays = hrt.glossy_rays(buffer, roughness)
        kept = np.isin(mirror.pixel @ (1, 4096), rays.pixel @ (1, 4096))
        spread.append(np.median((mirror.direction[kept] * rays.direction).sum(axis=1)))
    assert 1 > spread[0] > spread[1] > spread[2] > 0


def test_diffuse_rays_have_the_density_of_the_cosine():
    buffer = flat()
    d = np.concatenate([hrt.diffuse_rays(buffer, seed).direction for seed in range(10)])
    cos, angle = d[:, 1].astype(float), np.arctan2(d[:, 2], d[:, 0])
    assert cos.mean() == pytest.approx(2 / 3, abs=4 * math.sqrt(1 / 18 / len(d)))
    # cos**2 and the angle are even and independent
    counts, _, _ = np.histogram2d(cos**2, angle, [12, 16], [[0, 1], [-np.pi, np.pi]])
    assert stats.chisquare(counts.ravel()).pvalue > 1e-3


@pytest.mark.parametrize(
    ("roughness", "eye"), [(0.4, (0, 2, 1)), (0.6, (0, 1, 3)), (0.9, (1, 1, 1)), (1.0, (0, 0.3, 2))]
)
def test_glossy_rays_have_the_density_of_visible_ggx_normals(roughness, eye):
    # A view so narrow that all its rays come from one direction.
    buffer = flat(vfov_deg=0.01, eye=eye)
    alpha = roughness**2
    towards = np.array(eye, float) / np.linalg.norm(eye)
    v = towards[[0, 2, 1]]  # the floor's normal becomes z
    samples = 20 * buffer.prim_id.size
    d = np.concatenate([hrt.glossy_rays(buffer, roughness, s).direction for s in range(20)])
    m = d[:, [0, 2, 1]] + v
    m /= np.linalg.norm(m, axis=1, keepdims=True)
    # Bins that are even in the tangent of the slope's angle and in azimuth; expected counts by a
    # midpoint rule of 24 by 24 points a bin, over normals that reflect upwards.
    rings, sectors, fine = 10, 12, 24
    r = (np.arange(rings * fine) + 0.5) / (rings * fine)
    phi = (np.arange(sectors * fine) + 0.5) / (sectors * fine) * 2 * np.pi - np.pi
    theta = (np.pi / 2) * r
    t, p = np.meshgrid(theta, phi, indexing="ij")
    grid = np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)], axis=-1)
    density = naive.visible_normal_density(v, grid, alpha) * np.sin(t)
    cell = (np.pi / 2) / (rings * fine) * 2 * np.pi / (sectors * fine)
    assert density.sum() * cell == pytest.approx(1, abs=2e-3)
    upwards = 2 * (grid @ v) * grid[..., 2] - v[2] > 0
    mass = (density * upwards * cell).reshape(rings, fine, sectors, fine).sum(axis=(1, 3))
    angle = np.arccos(np.clip(m[:, 2], -1, 1)), np.arctan2(m[:, 1], m[:, 0])
    counts, _, _ = np.histogram2d(*angle, [rings, sectors], [[0, np.pi / 2], [-np.pi, np.pi]])
    expected = np.append(mass.ravel(), 1 - mass.sum()) * samples
    observed = np.append(counts.ravel(), samples - len(d))  # the last: dropped
    small = expected < 8
    expected = np.append(expected[~small], expected[small].sum() + 1e-9)
    observed = np.append(observed[~small], observed[small].sum())
    # 2e-3 of the expected counts bounds the error of the integration
    statistic = ((observed - expected) ** 2 / (expected + (2e-3 * expected) ** 2)).sum()
    assert stats.chi2.sf(statistic, len(expected) - 1) > 1e-3


def test_seeds_are_independent(buffer):
    a, b = (hrt.diffuse_rays(flat(), seed).direction.astype(float) for seed in (0, 1))
    for axis in (0, 2):
        assert abs(np.corrcoef(a[:, axis], b[:, axis])[0, 1]) < 4 / math.sqrt(len(a))
    # and so are neighbours of one seed
    assert abs(np.corrcoef(a[1:, 0], a[:-1, 0])[0, 1]) < 4 / math.sqrt(len(a))


@pytest.mark.parametrize("kind", MAKERS)
def test_the_same_bits_for_any_number_of_threads(buffer, kind):
    before = numba.get_num_threads()
    answers = []
    try:
        for threads in (1, before):
            numba.set_num_threads(threads)
            answers.append(MAKERS[kind](buffer))
    finally:
        numba.set_num_threads(before)
    for name in ("origin", "direction", "pixel", "t_near", "t_far"):
        np.testing.assert_array_equal(getattr(answers[0], name), getattr(answers[1], name))


def test_shadow_rays_to_a_lamp_end_just_before_it(buffer):
    rays = hrt.shadow_rays(buffer, LAMP)
    end = rays.origin + rays.t_far[:, None].astype(float) * rays.direction
    left = np.linalg.norm(np.array(LAMP.position) - end, axis=1)
    whole = np.linalg.norm(np.array(LAMP.position) - rays.origin, axis=1)
    assert (rays.t_far < whole).all()
    assert (left < 5e-6 * (whole + 3)).all()


def test_shadow_rays_to_a_panel_end_on_it_and_all_over(buffer):
    parts = [hrt.shadow_rays(buffer, PANEL, seed) for seed in range(4)]
    end = np.concatenate([r.origin + r.t_far[:, None].astype(float) * r.direction for r in parts])
    frame = np.stack([PANEL.edge_u, PANEL.edge_v, np.cross(PANEL.edge_u, PANEL.edge_v)], axis=1)
    u, v, h = np.linalg.solve(frame, (end - PANEL.corner).T)
    assert np.abs(h).max() < 1e-5
    assert (np.abs(np.stack([u, v]) - 0.5) < 0.5 + 1e-5).all()
    counts, _, _ = np.histogram2d(u, v, 5, [[0, 1], [0, 1]])
    assert counts.min() > 0.6 * counts.mean()  # not even: few pixels face the lowest points


def test_shadow_rays_to_the_sun_are_parallel_and_endless(buffer):
    rays = hrt.shadow_rays(buffer, SUN)
    towards = -np.array(SUN.direction) / np.linalg.norm(SUN.direction)
    np.testing.assert_array_equal(
        rays.direction, np.tile(towards.astype(np.float32), (len(rays), 1))
    )
    assert np.isinf(rays.t_far).all()


@pytest.mark.parametrize("light", [LAMP, SUN])
def test_pixels_that_face_away_from_the_light_have_no_ray(buffer, light):
    covered = np.argwhere(buffer.prim_id >= 0)[:, ::-1]
    n, _ = normals(buffer, covered)
    if isinstance(light, hrt.PointLight):
        z = buffer.camera.near / buffer.depth[covered[:, 1], covered[:, 0]]
        px = np.column_stack([covered + 0.5, buffer.camera.near / z])
        towards = np.array(light.position) - hrt.unproject(buffer.camera, px)
    else:
        towards = np.tile(-np.array(light.direction), (len(n), 1))
    cos = (n * towards).sum(axis=1)
    have = {tuple(p) for p in hrt.shadow_rays(buffer, light).pixel}
    clear = np.abs(cos) > 1e-5
    assert 10 < (cos[clear] < 0).sum() < clear.sum() - 10
    for pixel, c in zip(covered[clear], cos[clear], strict=True):
        assert (tuple(pixel) in have) == (c > 0)


def test_a_surface_that_holds_the_light_does_not_shadow_it():
    """Without a margin of the distance half of these rays hit the panel that they end on."""
    floor = np.array([[-5, 0, -5], [5, 0, -5], [5, 0, 5], [-5, 0, 5]], float)
    panel = np.array([[-1, 3.3, -1], [1, 3.3, -1], [1, 3.3, 1], [-1, 3.3, 1]], float)
    faces = [[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]]
    for offset in ((0, 0, 0), (1e3, -2e3, 3e3)):
        scene = hrt.Scene.from_arrays(np.concatenate([floor, panel]) + offset, faces)
        corner = scene.vertices[4].astype(float)
        light = hrt.AreaLight(corner, scene.vertices[5] - corner, scene.vertices[7] - corner)
        eye = np.array([0, 2.5, 4]) + offset
        camera = hrt.Camera.look_at(eye, offset, width=80, height=60)
        buffer = hrt.rasterize(scene, camera)
        rays = hrt.shadow_rays(buffer, light, seed=1)
        low = buffer.prim_id[rays.pixel[:, 1], rays.pixel[:, 0]] < 2
        assert low.sum() > 1000
        assert not hrt.EmbreeTracer(scene).occluded(rays.take(low)).any()
        assert not hrt.BruteForceTracer(scene).occluded(rays.take(low)).any()


def test_a_lamp_on_the_surface_it_lights_leaves_no_broken_ray():
    buffer = flat()
    for light in (hrt.PointLight((0, 0, 0)), hrt.AreaLight((-1, 0, -1), (2, 0, 0), (0, 0, 2))):
        rays = hrt.shadow_rays(buffer, light)
        assert np.isfinite(rays.direction).all()
        assert (rays.t_near <= rays.t_far).all()
    at_eye = hrt.shadow_rays(buffer, hrt.PointLight(hrt.mirror_rays(buffer).origin[7]))
    assert np.isfinite(at_eye.direction).all()


def test_a_radius_below_the_error_of_the_origin_leaves_an_empty_interval(buffer):
    rays = hrt.ambient_occlusion_rays(buffer, 1e-12)
    np.testing.assert_array_equal(rays.t_near, rays.t_far)
    assert not hrt.EmbreeTracer(buffer.scene).occluded(rays).any()


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda g: hrt.glossy_rays(g, 1.5), r"roughness: expected a number from 0 to 1, got 1\.5"),
        (lambda g: hrt.glossy_rays(g, -0.1), "roughness: expected a number from 0 to 1"),
        (
            lambda g: hrt.glossy_rays(g, math.nan),
            "roughness: expected a number from 0 to 1, got nan",
        ),
        (
            lambda g: hrt.glossy_rays(g, "0.5"),
            "roughness: expected a number from 0 to 1, got '0.5'",
        ),
        (lambda g: hrt.glossy_rays(None, 0.5), "gbuffer: expected a GBuffer, got None"),
        (lambda g: hrt.diffuse_rays(g, -1), "seed: expected an integer >= 0"),
        (lambda g: hrt.diffuse_rays(g, 2**63), "seed: expected .* <= 9223372036854775807"),
        (lambda g: hrt.diffuse_rays(g, 0.5), "seed: expected an integer"),
        (lambda g: hrt.ambient_occlusion_rays(g, 0.0), "radius: expected a finite number > 0"),
        (lambda g: hrt.ambient_occlusion_rays(g, math.inf), "radius: expected a finite number"),
        (lambda g: hrt.ambient_occlusion_rays(g, 1e60), "radius: expected a length within float32"),
        (lambda g: hrt.ambient_occlusion_rays(g, 1e-60), "radius: expected a length within"),
        (lambda g: hrt.shadow_rays(g, (0, 1, 0)), r"light: expected a PointLight, .* got \(0, 1"),
        (lambda g: hrt.shadow_rays(g, PANEL, -3), "seed: expected an integer >= 0"),
        (lambda g: hrt.PointLight((0, 1)), "position: expected three finite numbers"),
        (lambda g: hrt.PointLight((0, 1, math.nan)), "position: expected three finite numbers"),
        (lambda g: hrt.AreaLight((0, 0, 0), (1, 0, 0), (2, 0, 0)), "edge_v: .*not parallel"),
        (lambda g: hrt.AreaLight((0, 0, 0), (1, 0), (2, 0, 0)), "edge_u: expected three"),
        (lambda g: hrt.DirectionalLight((0, 0, 0)), "direction: expected a direction of finite"),
    ],
)
def test_bad_input_is_named(buffer, call, message):
    with pytest.raises(hrt.ArgumentError, match="^" + message):
        call(buffer)


def test_an_empty_view_has_no_rays():
    vertices, faces = hills()
    camera = hrt.Camera.look_at((0, 5, 0), (0, 9, 1), width=20, height=10)
    empty = hrt.rasterize(hrt.Scene.from_arrays(vertices, faces), camera)
    for make in MAKERS.values():
        assert len(make(empty)) == 0
