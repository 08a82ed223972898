"""The truth of random tiny meshes is, to the last bit, that of exact rational arithmetic."""

import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

import hybrid_rt as hrt
from naive import judge as naive

lattice = st.integers(-3, 3)
thirds = st.integers(-9, 9).map(lambda k: float(np.float32(k / 3)))
numbers = st.one_of(lattice, thirds, st.sampled_from([-0.0, 1e-40, -1e-45, 1e6, 1e6 + 1 / 16]))
points = st.tuples(numbers, numbers, numbers)
limits = st.sampled_from([0.0, 0.25, 1.0, 2.0, 3.0])


@st.composite
def meshes(draw):
    """Some triangles over a few points, so that vertices, edges and whole triangles are shared."""
    vertices = draw(st.lists(points, min_size=3, max_size=7))
    index = st.integers(0, len(vertices) - 1)
    faces = draw(st.lists(st.tuples(index, index, index), min_size=1, max_size=6))
    return hrt.Scene.from_arrays(np.array(vertices), np.array(faces))


@st.composite
def rays_at(draw, scene):
    """Rays at vertices, at points of edges, along edges, and anywhere; most of them with limits."""
    corners = scene.vertices[scene.faces].astype(float)
    origins, directions, near, far = [], [], [], []
    for _ in range(draw(st.integers(1, 8))):
        a, b, c = corners[draw(st.integers(0, len(corners) - 1))]
        s = draw(st.sampled_from([0.0, 0.5, 0.25, 1 / 3]))
        target = draw(st.sampled_from([a, b, a + s * (b - a), (a + b + c) / 3]))
        origin = draw(st.one_of(points.map(np.array), st.sampled_from([a, c])))
        direction = draw(st.one_of(st.just(target - origin), points.map(np.array)))
        origins.append(origin)
        directions.append(direction)
        near.append(draw(limits))
        far.append(draw(st.one_of(limits, st.just(math.inf))))
    return hrt.Rays.from_arrays(np.array(origins), np.array(directions), None, near, far)


def is_edge_on(direction, triangle):
    """Whether a ray runs in the plane of a triangle, as far as float64 can tell.

    It then grazes over a stretch, and of that stretch float64 and exact arithmetic may take
    different points.
    """
    a, b, c = triangle.astype(float)
    d = direction.astype(float)
    n = np.cross(b - a, c - a)
    return abs(n @ d) <= 1e-9 * np.linalg.norm(b - a) * np.linalg.norm(c - a) * np.linalg.norm(d)


@settings(max_examples=150, deadline=None)
@given(st.data())
def test_nearest_is_exact(data):
    scene = data.draw(meshes())
    rays = data.draw(rays_at(scene))
    found = hrt.Truth(scene, threads=1).nearest(rays)
    triangles = scene.vertices[scene.faces]
    for i in range(len(rays)):
        if not rays.direction[i].any():
            assert found.prim_id[i] == -1
            continue
        prim, t, _, grazed = naive.nearest(
            rays.origin[i], rays.direction[i], rays.t_near[i], rays.t_far[i], triangles
        )
        assert found.prim_id[i] == prim
        if prim >= 0:
            assert abs(naive.Fraction(found.t[i]) - t) <= naive.Fraction(found.t_error[i])
            assert found.t_error[i] <= 2.0**-30 * abs(found.t[i])
        # How far a graze reaches is decided in float64: it may differ by rounding, not by more.
        if any(is_edge_on(rays.direction[i], triangle) for triangle in triangles):
            continue
        if grazed is not None and np.isfinite(found.t_grazed[i]):
            assert found.t_grazed[i] <= float(grazed) * (1 + 1e-6) + 1e-6
