"""The conservative lists: against exact rational arithmetic, and what they may not leave out."""

from fractions import Fraction

import numpy as np
import pytest

import hybrid_rt as hrt
from naive import lists as naive
from support.screens import lists_of
from support.soup import random_scene


def assert_conservative(scene, camera, length, pixels):
    found = lists_of(scene, camera, length)
    wanted = naive.lists(scene.vertices, scene.faces, camera, found.margin_px, pixels)
    for (i, j), touching in wanted.items():
        ids = found.prim_id[j, i]
        bounds = dict(zip(ids.tolist(), found.nearest[j, i].tolist(), strict=True))
        for face, depth in touching.items():
            bound = bounds[face] if face in bounds else float(found.rest[j, i])
            assert Fraction(bound) >= depth, (i, j, face)
    return found, wanted


def all_pixels(camera):
    return [(i, j) for j in range(camera.height) for i in range(camera.width)]


@pytest.mark.parametrize("seed", range(9))
def test_nothing_that_touches_a_square_is_left_out(seed):
    length = (1, 3, 16)[seed % 3]
    rng = np.random.default_rng(seed)
    scene = random_scene(rng, 14)
    camera = hrt.Camera.look_at(
        (0.1, 0.2, 0), (0.2, 0, -1), vfov_deg=80, width=7, height=5, near=0.1
    )
    assert_conservative(scene, camera, length, all_pixels(camera))


def test_a_long_list_holds_little_more_than_what_touches():
    extra = total = 0
    slack = []
    for seed in range(6):
        rng = np.random.default_rng(100 + seed)
        scene = random_scene(rng, 10, sliver=0.0)
        camera = hrt.Camera.look_at((0, 0, 6), (0, 0, 0), width=9, height=7, near=0.1)
        found, wanted = assert_conservative(scene, camera, 16, all_pixels(camera))
        assert (found.rest == 0).all()
        for (i, j), touching in wanted.items():
            listed = [int(p) for p in found.prim_id[j, i] if p >= 0]
            assert sorted(set(listed)) == sorted(listed)
            extra += len(set(listed) - set(touching))
            total += len(touching)
            for face, bound in zip(listed, found.nearest[j, i], strict=False):
                if face in touching:
                    slack.append(float(bound) / float(touching[face]))
    # A square may touch none of a triangle and yet lie inside of all three edges and of the box.
    assert total > 200
    assert extra < 0.05 * total
    assert np.median(slack) < 1 + 1e-6


def test_descending_and_padded():
    rng = np.random.default_rng(5)
    scene = random_scene(rng, 150)
    camera = hrt.Camera.look_at((0, 0, 5), (0, 0, 0), width=40, height=30, near=0.1)
    found = lists_of(scene, camera, 4)
    assert found.length == 4
    assert found.nbytes == 40 * 30 * (8 * 4 + 4) + 150 * 32
    assert (np.diff(found.nearest, axis=2) <= 0).all()
    assert ((found.prim_id < 0) == (found.nearest == 0)).all()
    assert (found.rest <= found.nearest[:, :, 3]).all()
    assert (found.rest > 0).any()


def test_the_first_bound_is_never_behind_the_visible_surface():
    rng = np.random.default_rng(6)
    scene = random_scene(rng, 60)
    camera = hrt.Camera.look_at((0, 0, 5), (0, 0, 0), width=64, height=48, near=0.1)
    gbuffer = hrt.rasterize(scene, camera)
    assert (lists_of(scene, camera, 2).nearest[:, :, 0] >= gbuffer.depth).all()


def test_a_triangle_that_misses_every_centre_is_listed():
    camera = hrt.Camera.look_at((0, 0, 0), (0, 0, -1), vfov_deg=90, width=8, height=8, near=0.1)
    # x_px = 4 + 4 x / z: a speck inside of pixel (5, 4), beside its centre.
    corners = np.array([(1.1, -0.6, -4), (1.12, -0.6, -4), (1.1, -0.62, -4)])
    scene = hrt.Scene.from_arrays(corners, [[0, 1, 2]])
    assert (hrt.rasterize(scene, camera).prim_id == -1).all()
    assert np.argwhere(lists_of(scene, camera, 1).prim_id[:, :, 0] == 0).tolist() == [[4, 5]]


def test_a_triangle_across_the_near_plane_is_listed_as_near_as_it_comes():
    camera = hrt.Camera.look_at((0, 0, 0), (0, 0, -1), vfov_deg=90, width=8, height=8, near=0.1)
    floor = np.array([(-50.0, -0.05, 50), (50, -0.05, 50), (0, -0.05, -100)])
    found = lists_of(hrt.Scene.from_arrays(floor, [[0, 1, 2]]), camera, 1)
    # y_px = 4 + 4 * 0.05 / z: the floor is seen from row 4 (far) to y = 6 (at the near plane).
    assert found.prim_id[5, 3, 0] == 0
    assert found.nearest[5, 3, 0] == pytest.approx(1.0, rel=1e-5)
    assert found.prim_id[7, 3, 0] == -1


def test_a_corner_that_rounding_may_put_on_either_side_of_the_near_plane_loses_nothing():
    camera = hrt.Camera.look_at((0, 0, 0), (0, 0, -1), vfov_deg=90, width=8, height=8, near=1.0)
    close = 1 - 2.0**-20  # where the lists put the near plane; a float32
    corners = np.array([(-1.0, -1, -2), (1, -1, -2), (0, 0.5, -close)])
    found = lists_of(hrt.Scene.from_arrays(corners, [[0, 1, 2]]), camera, 1)
    assert found.prim_id[4, 4, 0] == 0
    assert found.prim_id[5, 3, 0] == 0


def test_a_plane_through_the_eye_is_bounded_by_its_box():
    camera = hrt.Camera.look_at((0, 0, 0), (0, 0, -1), vfov_deg=90, width=8, height=8, near=0.1)
    edge_on = np.array([(-1.0, 0, -2), (1, 0, -2), (0, 0, -4)])
    found = lists_of(hrt.Scene.from_arrays(edge_on, [[0, 1, 2]]), camera, 1)
    rows = np.flatnonzero((found.prim_id[:, :, 0] == 0).any(axis=1))
    assert rows.tolist() == [3, 4]
    assert found.nearest.max() == pytest.approx(0.05, rel=1e-5)


def test_threads_and_batches_change_nothing(monkeypatch):
    from hybrid_rt import _threads
    from hybrid_rt.raster import lists as module

    rng = np.random.default_rng(8)
    scene = random_scene(rng, 300)
    camera = hrt.Camera.look_at((0, 0, 5), (0, 0, 0), width=100, height=70, near=0.1)
    one = lists_of(scene, camera, 3, threads=1)
    monkeypatch.setattr(module, "BATCH_FACES", 37)
    many = lists_of(scene, camera, 3, threads=_threads.available())
    monkeypatch.setattr(module, "BATCH_ENTRIES", 200)
    split = lists_of(scene, camera, 3)
    for name in ("prim_id", "nearest", "rest"):
        assert np.array_equal(getattr(one, name), getattr(many, name))
        assert np.array_equal(getattr(one, name), getattr(split, name))


def crowded(seed=9, n=900):
    """Return a scene with some forty triangles in front of each other, and a camera."""
    rng = np.random.default_rng(seed)
    scene = random_scene(rng, n)
    camera = hrt.Camera.look_at((0, 0, 5), (0, 0, 0), width=77, height=45, near=0.1)
    return scene, camera


@pytest.mark.parametrize("length", [1, 3, 7, 8, 20])
def test_a_shorter_list_is_the_beginning_of_a_longer_one(length):
    scene, camera = crowded()
    short = lists_of(scene, camera, length)
    long = lists_of(scene, camera, 64)
    assert (long.nearest[:, :, length] > 0).mean() > 0.3
    assert np.array_equal(short.prim_id, long.prim_id[:, :, :length])
    assert np.array_equal(short.nearest, long.nearest[:, :, :length])
    assert np.array_equal(short.rest, long.nearest[:, :, length])


def test_the_order_of_the_faces_changes_nothing():
    scene, camera = crowded()
    order = np.random.default_rng(1).permutation(len(scene.faces))
    shuffled = hrt.Scene.from_arrays(scene.vertices, scene.faces[order])
    one = lists_of(scene, camera, 8)
    other = lists_of(shuffled, camera, 8)
    assert np.array_equal(one.nearest, other.nearest)
    assert np.array_equal(one.rest, other.rest)
    # The numbers may differ where bounds are equal.
    ties = (np.diff(one.nearest, axis=2) == 0).any(axis=2) | (one.nearest[:, :, 7] == one.rest)
    assert ties.mean() < 0.6
    renumbered = np.where(other.prim_id < 0, -1, order[other.prim_id])
    assert np.array_equal(renumbered[~ties], one.prim_id[~ties])


def test_of_equal_bounds_the_smaller_number_comes_first(monkeypatch):
    from hybrid_rt.raster import lists as module

    scene, camera = crowded(n=60)
    thrice = hrt.Scene.from_arrays(scene.vertices, np.tile(scene.faces, (3, 1)))
    for batch in (1 << 21, 50):
        monkeypatch.setattr(module, "BATCH_FACES", batch)
        found = lists_of(thrice, camera, 5)
        equal = (np.diff(found.nearest, axis=2) == 0) & (found.prim_id[:, :, 1:] >= 0)
        assert equal.mean() > 0.1
        assert (np.diff(found.prim_id, axis=2)[equal] > 0).all()
        # Of three equal ones the first is in a list if any is.
        listed = [set(ids[ids >= 0]) for ids in found.prim_id.reshape(-1, 5)]
        assert all(i % 60 in ids and (i < 120 or i - 60 in ids) for ids in listed for i in ids)


def test_a_triangle_with_two_equal_corners_is_nothing():
    camera = hrt.Camera.look_at((0, 0, 5), (0, 0, 0), width=16, height=16, near=0.1)
    corners = np.array([(-1.0, 0, 0), (1, 0, 0), (1, 0, 0)])
    for faces in ([0, 1, 2], [0, 1, 1], [1, 1, 1]):
        found = lists_of(hrt.Scene.from_arrays(corners, [faces]), camera, 1)
        assert (found.prim_id == -1).all()
