"""The depth pyramid at any size."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

import hybrid_rt as hrt
from support import synthetic


@settings(deadline=None, max_examples=60)
@given(width=st.integers(1, 90), height=st.integers(1, 90), seed=st.integers(0, 2**32 - 1))
def test_a_cell_is_the_nearest_of_its_children(width, height, seed):
    rng = np.random.default_rng(seed)
    depth = rng.random((height, width), dtype=np.float32) * (rng.random((height, width)) < 0.7)
    depth = depth.astype(np.float32)
    pyramid = hrt.build_depth_pyramid(synthetic.gbuffer(depth, depth, depth))
    assert np.array_equal(pyramid.level(0), depth)
    for index in range(1, len(pyramid)):
        below, level = pyramid.level(index - 1), pyramid.level(index)
        h, w = below.shape
        assert level.shape == (-(-h // 2), -(-w // 2))
        padded = np.full((2 * level.shape[0], 2 * level.shape[1]), -1, np.float32)
        padded[:h, :w] = below
        children = padded.reshape(level.shape[0], 2, level.shape[1], 2)
        assert np.array_equal(level, children.max(axis=(1, 3)))
    assert pyramid.level(len(pyramid) - 1).shape == (1, 1)
