"""The rasteriser on anything that hypothesis can think of."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

import hybrid_rt as hrt
from naive import raster as naive

# Whole and half numbers put vertices on pixel centres, edges and each other.
COORDINATE = st.one_of(
    st.integers(-6, 6).map(float),
    st.integers(-12, 12).map(lambda n: n / 2),
    st.floats(-1e4, 1e4, width=32),
)
POINT = st.tuples(COORDINATE, COORDINATE, COORDINATE)


@settings(deadline=None, max_examples=60)
@given(
    vertices=st.lists(POINT, min_size=3, max_size=9),
    picks=st.lists(st.tuples(*[st.integers(0, 100)] * 3), min_size=1, max_size=6),
    width=st.integers(1, 20),
    height=st.integers(1, 20),
    near=st.sampled_from([1e-4, 0.05, 1.0]),
)
def test_same_as_naive(vertices, picks, width, height, near):
    scene = hrt.Scene.from_arrays(np.array(vertices), np.array(picks) % len(vertices))
    camera = hrt.Camera.look_at(
        (0, 0, 0), (0, 0, -1), vfov_deg=90, width=width, height=height, near=near
    )
    g = hrt.rasterize(scene, camera)
    wanted = naive.rasterize(scene.vertices, scene.faces, camera)
    for got, want in zip((g.depth, g.ddx, g.ddy, g.prim_id), wanted, strict=True):
        assert np.array_equal(got, want)
