"""Polygons of every shape become triangles of the same surface, or are refused."""

import numpy as np
import pytest

import hybrid_rt as hrt
from hybrid_rt.scene.io.fault import FormatError
from hybrid_rt.scene.io.polygons import triangulate
from support.meshfiles import area, refused


def write(path, points, *polygons):
    """Write an .obj."""
    text = "".join("v {:.17g} {:.17g} {:.17g}\n".format(*p) for p in points)
    text += "".join("f " + " ".join(str(k + 1) for k in polygon) + "\n" for polygon in polygons)
    path.write_text(text)
    return path


def lifted(flat, seed=0):
    """Return points of a plane as points in space, turned at random."""
    turn = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
    return np.column_stack([np.asarray(flat, float), np.zeros(len(flat))]) @ turn


def shoelace(flat):
    """Return the area of a polygon of the plane."""
    x, y = np.asarray(flat, float).T
    return abs(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))) / 2


L = [(0, 0), (4, 0), (4, 1), (1, 1), (1, 4), (0, 4)]
ARROW = [(0, 0), (2, 1), (0, 2), (1, 1)]
COMB = [(0, 0), (7, 0), (7, 3), (6, 3), (6, 1), (5, 1), (5, 3), (4, 3), (4, 1), (3, 1), (3, 3),
        (2, 3), (2, 1), (1, 1), (1, 3), (0, 3)]  # fmt: skip
STAR = [(np.cos(a) * r, np.sin(a) * r)
        for a, r in zip(np.arange(10) * np.pi / 5, [3, 1] * 5, strict=True)]  # fmt: skip
SPIRAL = [(0, 0), (9, 0), (9, 9), (1, 9), (1, 3), (6, 3), (6, 6), (4, 6), (4, 5), (5, 5), (5, 4),
          (2, 4), (2, 8), (8, 8), (8, 1), (0, 1)]  # fmt: skip
HOLED = [(0, 0), (4, 0), (4, 4), (0, 4), (0, 0), (1, 1), (1, 3), (3, 3), (3, 1), (1, 1)]
MIDPOINTS = [(0, 0), (1, 0), (2, 0), (2, 1), (2, 2), (1, 2), (0, 2), (0, 1)]
REGULAR = [(np.cos(a), np.sin(a)) for a in np.arange(60) * np.pi / 30]
SHAPES = {
    "L": L, "arrow": ARROW, "comb": COMB, "star": STAR, "spiral": SPIRAL, "holed": HOLED,
    "midpoints": MIDPOINTS, "regular": REGULAR,
}  # fmt: skip


@pytest.mark.parametrize("backwards", [False, True])
@pytest.mark.parametrize("name", list(SHAPES))
def test_the_area_is_that_of_the_polygon_from_whichever_corner(tmp_path, name, backwards):
    flat = SHAPES[name][::-1] if backwards else SHAPES[name]
    for first in range(min(len(flat), 16)):
        points = lifted(flat, first)
        order = np.roll(np.arange(len(flat)), -first)
        mesh = hrt.read_mesh(write(tmp_path / "m.obj", points, order))
        assert area(mesh) == pytest.approx(shoelace(flat), rel=1e-5)
        normals = np.cross(
            *(mesh.vertices[mesh.faces[:, k]] - mesh.vertices[mesh.faces[:, 0]] for k in (1, 2))
        )
        newell = np.cross(points, np.roll(points, -1, axis=0)).sum(axis=0)
        assert (normals @ newell >= -1e-3).all()
        assert (mesh.polygon_id == 0).all()


def test_no_ray_meets_a_triangle_outside_of_the_polygon(tmp_path):
    from matplotlib.path import Path

    x, y = np.random.default_rng(2).uniform(-0.5, 9.5, (2, 3000))
    for flat in (L, COMB, SPIRAL, ARROW):
        points = np.column_stack([np.asarray(flat, float), np.zeros(len(flat))])
        mesh = hrt.read_mesh(write(tmp_path / "m.obj", points, range(len(flat))))
        inside = Path(flat).contains_points(np.column_stack([x, y]))
        hit = np.zeros(len(x), int)
        for a, b, c in mesh.vertices[mesh.faces].astype(float):
            sides = [(q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0])
                     for p, q in ((a, b), (b, c), (c, a))]  # fmt: skip
            hit += np.all(np.array(sides) > 0, axis=0) | np.all(np.array(sides) < 0, axis=0)
        np.testing.assert_array_equal(hit, inside)


def test_quads_are_cut_at_the_first_corner_unless_that_leaves_them(tmp_path):
    square = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
    mesh = hrt.read_mesh(write(tmp_path / "m.obj", square, range(4)))
    assert mesh.faces.tolist() == [[0, 1, 2], [0, 2, 3]]
    arrow = [(*p, 0) for p in ARROW]
    assert len(hrt.read_mesh(write(tmp_path / "m.obj", arrow, range(4)))) == 2
    mesh = hrt.read_mesh(write(tmp_path / "m.obj", arrow, [2, 3, 0, 1]))
    assert area(mesh) == 1.0


def test_a_bent_quad_is_cut_as_others_are(tmp_path):
    bent = [(0, 0, 0), (1, 0, 0.5), (1, 1, 0), (0, 1, 0.5)]
    mesh = hrt.read_mesh(write(tmp_path / "m.obj", bent, range(4)))
    assert mesh.faces.tolist() == [[0, 1, 2], [0, 2, 3]]


@pytest.mark.parametrize("polygon", [[0, 1, 1, 2], [0, 0, 1, 2], [0, 1, 2, 2], [0, 1, 2, 0]])
def test_repeated_corners_give_triangles_without_area(tmp_path, polygon):
    corner = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]
    mesh = hrt.read_mesh(write(tmp_path / "m.obj", corner, polygon))
    assert len(mesh) == 2
    assert area(mesh) == 0.5


def test_polygons_without_area_stay_without(tmp_path):
    line = [(k, 2 * k, 3 * k) for k in (0, 3, 1, 2)]
    assert area(hrt.read_mesh(write(tmp_path / "m.obj", line, range(4)))) == 0
    point = [(1, 1, 1)] * 5
    assert len(hrt.read_mesh(write(tmp_path / "m.obj", point, range(5)))) == 3


CROSSING = {
    "bow tie": [(0, 0), (1, 1), (1, 0), (0, 1)],
    "lopsided bow tie": [(0, 0), (2, 1), (2, 0), (0, 2)],
    "pentagram": [(np.cos(a), np.sin(a)) for a in np.arange(5) * np.pi * 4 / 5],
    "twice around": [(np.cos(a), np.sin(a)) for a in np.arange(12) * np.pi / 3 + 0.01],
    "twice around the same": [(0, 0), (1, 0), (1, 1), (0, 1)] * 2,
    "loop": [(0, 0), (4, 0), (4, 4), (1, -1), (0, 4)],
}


@pytest.mark.parametrize("name", list(CROSSING))
def test_polygons_that_cross_themselves_are_refused_with_their_line(tmp_path, name):
    points = lifted(CROSSING[name])
    n = len(points)
    refused(
        write(tmp_path / "m.obj", points, range(3), range(n)), f"line {n + 2}: a polygon of {n}"
    )


def test_a_polygon_that_is_bent_too_far_is_refused(tmp_path):
    # mikedh/trimesh models/polygonfaces.obj, of which three readers make three surfaces
    points = [(-5, 0, 5), (5, 0, 5), (5, 0, -5), (-5, 0, -5), (0, 5, -5)]
    refused(write(tmp_path / "m.obj", points, range(5)), "line 6: a polygon of 5", "far from plane")
    slightly = [(*p, 0.01 * k) for k, p in enumerate(L)]
    assert area(hrt.read_mesh(write(tmp_path / "m.obj", slightly, range(6)))) > 7


def test_concave_polygons_far_from_the_origin(tmp_path):
    for shift in (1e4, 1e6):
        points = np.column_stack([np.asarray(L, float), np.zeros(6)])
        points += np.array([shift, -shift, shift])
        for first in range(6):
            mesh = hrt.read_mesh(write(tmp_path / "m.obj", points, np.roll(range(6), first)))
            assert area(mesh) == 7.0


def test_many_polygons_of_many_lengths_keep_their_order():
    rng = np.random.default_rng(8)
    rims, counts, areas = [], [], []
    vertices = []
    for k in range(3000):
        n = int(rng.integers(3, 9))
        angle = np.sort(rng.uniform(0, 2 * np.pi, n))
        radius = rng.uniform(0.5, 2, n) if k % 2 else np.ones(n)
        flat = np.column_stack([np.cos(angle) * radius, np.sin(angle) * radius])
        if np.diff(angle, append=angle[0] + 2 * np.pi).max() > 3:
            flat = np.array(L, float)  # the centre is outside, so the rim may cross itself
            n = 6
        rims.append(np.arange(n) + len(vertices))
        vertices += lifted(flat, k).tolist()
        counts.append(n)
        areas.append(shoelace(flat))
    faces, polygon = triangulate(
        np.array(vertices), np.concatenate(rims), np.array(counts), lambda k: f"polygon {k}"
    )
    t = np.array(vertices)[faces]
    found = np.linalg.norm(np.cross(t[:, 1] - t[:, 0], t[:, 2] - t[:, 0]), axis=1) / 2
    assert (np.diff(polygon) >= 0).all()
    np.testing.assert_allclose(np.bincount(polygon, found), areas, rtol=1e-9)


def test_coordinates_beyond_float32_are_refused_before_anything_overflows():
    points = np.array([[0, 0, 0], [1e300, 0, 0], [1e300, 1e300, 0], [0, 1, 0]])
    with pytest.raises(FormatError, match="beyond float32"):
        triangulate(points, np.arange(4), np.array([4]), str)
