"""The raster and what it shows through cameras of every kind."""

import math
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

import hybrid_rt as hrt
from naive import lists as naive_lists
from naive import raster as naive
from support.cameras import KINDS, of_every_kind
from support.screens import lists_of
from support.soup import random_scene

each = pytest.mark.parametrize("kind", KINDS)


@each
@pytest.mark.parametrize("seed", range(3))
def test_same_as_naive(kind, seed):
    scene = random_scene(np.random.default_rng(seed), 40)
    camera = of_every_kind(width=37, height=29)[kind]
    gbuffer = hrt.rasterize(scene, camera)
    depth, ddx, ddy, prim_id = naive.rasterize(scene.vertices, scene.faces, camera)
    np.testing.assert_array_equal(gbuffer.prim_id, prim_id)
    # The last digit: other formulas for the same planes.
    np.testing.assert_allclose(gbuffer.depth, depth, rtol=2e-7)
    for got, want in ((gbuffer.ddx, ddx), (gbuffer.ddy, ddy)):
        np.testing.assert_allclose(got, want, rtol=2e-7, atol=1e-12)
    assert (prim_id >= 0).any()


@each
def test_depths_are_the_exact_ones_rounded(kind):
    scene = random_scene(np.random.default_rng(7), 12, sliver=0.0)
    camera = of_every_kind(width=41, height=31)[kind]
    gbuffer = hrt.rasterize(scene, camera)
    pixels = np.argwhere(gbuffer.prim_id >= 0)
    checked = 0
    for j, i in pixels[:: max(1, len(pixels) // 60)]:
        face = scene.faces[gbuffer.prim_id[j, i]]
        true = naive.exact_depth(scene.vertices, face, camera, i + 0.5, j + 0.5)
        inside = hrt.project(camera, scene.vertices[face])[:, 2]
        if not inside.min() < true < min(inside.max(), 1):
            continue  # moved to a vertex's depth, as the snapped outline reaches past the true one
        checked += 1
        assert abs(Fraction(float(gbuffer.depth[j, i])) - true) <= Fraction(2.0**-24) * true * 2
    assert checked > 2


@each
def test_what_is_shown_is_where_primary_rays_hit(kind):
    scene = random_scene(np.random.default_rng(3), 60, sliver=0.0)
    camera = of_every_kind(eye=(0.125, 0.25, 5), width=160, height=120)[kind]
    gbuffer = hrt.rasterize(scene, camera)
    rays = hrt.primary_rays(camera)
    hits = hrt.EmbreeTracer(scene).intersect(rays)
    shown = gbuffer.prim_id.ravel()
    # A pixel's centre may lie on an outline, but for rounding.
    same = hits.prim_id == shown
    assert same.mean() > 0.999
    both = same & (shown >= 0)
    points = rays.origin[both] + hits.t[both, None].astype(float) * rays.direction[both]
    position = gbuffer.position.reshape(-1, 3)[both]
    np.testing.assert_allclose(points, position, atol=2e-5)
    seen = hrt.project(camera, position)
    np.testing.assert_allclose(seen[:, 2], gbuffer.depth.ravel()[both], rtol=1e-6, atol=1e-9)
    y, x = np.divmod(np.flatnonzero(both), camera.width)
    np.testing.assert_allclose(seen[:, :2], np.column_stack([x, y]) + 0.5, atol=1e-6)
    _, direction = camera.views(x + 0.5, y + 0.5)
    normal = gbuffer.normal.reshape(-1, 3)[both]
    assert ((normal * direction).sum(axis=1) < 1e-6).all()


@each
def test_mirror_rays_leave_what_is_shown(kind):
    scene = random_scene(np.random.default_rng(5), 60, sliver=0.0)
    camera = of_every_kind(width=96, height=64)[kind]
    gbuffer = hrt.rasterize(scene, camera)
    rays = hrt.mirror_rays(gbuffer)
    x, y = rays.pixel.T
    _, view = camera.views(x + 0.5, y + 0.5)
    view = view / np.linalg.norm(view, axis=1, keepdims=True)
    normal = gbuffer.normal[y, x]
    mirrored = view - 2 * (view * normal).sum(axis=1, keepdims=True) * normal
    np.testing.assert_allclose(rays.direction, mirrored, atol=1e-6)
    off = np.linalg.norm(rays.origin - gbuffer.position[y, x], axis=1)
    steep = np.abs((view * normal).sum(axis=1)) > 0.05
    assert off[steep].max() < 2e-5
    hits = hrt.EmbreeTracer(scene).intersect(rays)
    assert (hits.prim_id != gbuffer.prim_id[y, x]).all()


@pytest.mark.parametrize("parallel", [False, True])
def test_a_view_off_the_middle_is_a_part_of_a_larger_one(parallel):
    scene = random_scene(np.random.default_rng(9), 80)
    large = of_every_kind(width=200, height=150)["orthographic" if parallel else "pinhole"]
    left, top, width, height = 130, 20, 60, 40
    shift = 100 - left - width / 2, 75 - top - height / 2
    part = replace(large, width=width, height=height, shift_px=shift)
    if parallel:
        part = replace(part, view_height=large.view_height * height / 150)
    else:
        degrees = math.degrees(2 * math.atan(height / 2 / large.focal_px))
        part = replace(part, vfov_deg=degrees)
    whole, cut = hrt.rasterize(scene, large), hrt.rasterize(scene, part)
    here = np.s_[top : top + height, left : left + width]
    np.testing.assert_array_equal(cut.prim_id, whole.prim_id[here])
    assert (cut.prim_id >= 0).any()
    # Once rounded to float32.
    np.testing.assert_allclose(cut.depth, whole.depth[here], rtol=1.2e-7)


def test_nothing_is_seen_beyond_the_far_plane():
    # A floor that goes through it: cut where depth is 0, at z_view = 6.
    floor = hrt.Scene.from_arrays(
        np.array([(-9, 0, 0), (9, 0, 0), (9, 0, -20), (-9, 0, -20)], np.float32),
        [(0, 1, 2), (0, 2, 3)],
    )
    camera = hrt.Camera.orthographic(
        (0, 2, 0), (0, 1, -2), view_height=6, width=40, height=60, near=0, far=6
    )
    gbuffer = hrt.rasterize(floor, camera)
    seen = gbuffer.prim_id >= 0
    z = camera.z_view(gbuffer.depth)[seen]
    assert 5.8 < z.max() < 6
    assert gbuffer.depth[seen].min() > 0
    rows = seen.any(axis=1)
    assert 10 < rows.sum() < 60
    assert (seen.all(axis=1) == rows).all()
    beyond = replace(camera, far=0.85)  # the floor begins at a z_view of 0.89
    assert (hrt.rasterize(floor, beyond).prim_id == -1).all()
    # And what lies before the near plane is cut as well.
    near = hrt.rasterize(floor, replace(camera, near=4.0))
    assert near.depth.max() <= 1
    assert 0 < (near.prim_id >= 0).sum() < seen.sum()


@each
@pytest.mark.parametrize("seed", range(3))
def test_lists_leave_out_nothing_that_touches_a_square(kind, seed):
    scene = random_scene(np.random.default_rng(20 + seed), 24)
    camera = of_every_kind(eye=(0.1, 0.2, 2), target=(0.2, 0, -5), width=7, height=5)[kind]
    pixels = [(i, j) for j in range(5) for i in range(7)]
    found = lists_of(scene, camera, (1, 3, 16)[seed])
    wanted = naive_lists.lists(scene.vertices, scene.faces, camera, found.margin_px, pixels)
    touched = 0
    for (i, j), touching in wanted.items():
        ids, nearest = found.prim_id[j, i], found.nearest[j, i]
        bounds = dict(zip(ids.tolist(), nearest.tolist(), strict=True))
        for face, depth in touching.items():
            touched += 1
            assert Fraction(bounds.get(face, float(found.rest[j, i]))) >= depth, (i, j, face)
    assert touched > 0


@each
def test_planes_of_lists_err_by_less_than_they_say(kind):
    rng = np.random.default_rng(31)
    scene = random_scene(rng, 30)
    camera = of_every_kind(width=40, height=30)[kind]
    found = lists_of(scene, camera, 8)
    checked = 0
    for j, i, k in rng.permutation(np.argwhere(found.prim_id >= 0))[:200]:
        face = found.prim_id[j, i, k]
        a, b, c, px, py, error = found.planes[face, :6]
        if not np.isfinite(c):
            continue
        x, y = np.float32(i + rng.random()), np.float32(j + rng.random())
        value = c + a * (x - px) + b * (y - py)
        assert value.dtype == np.float32
        corners = [
            naive_lists.projected(p, camera.arrays.m, camera.eye)
            for p in scene.vertices[scene.faces[face]]
        ]
        true = naive_lists.plane_depth(corners, float(x), float(y))
        assert abs(Fraction(float(value)) - true) < Fraction(float(error))
        checked += 1
    assert checked > 2
