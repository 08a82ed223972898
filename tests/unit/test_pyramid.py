"""The depth pyramid against the naive one."""

import numpy as np
import pytest

import hybrid_rt as hrt
from naive import pyramid as naive


def gbuffer_of(depth):
    """Return a G-buffer that holds `depth` and nothing else."""
    scene = hrt.Scene.from_arrays(np.eye(3), [(0, 1, 2)])
    height, width = depth.shape
    camera = hrt.Camera.look_at((0, 0, 3), (0, 0, 0), width=width, height=height)
    zero = np.zeros_like(depth)
    return hrt.GBuffer(depth, zero, zero, np.full(depth.shape, -1, np.int32), scene, camera)


@pytest.mark.parametrize(
    ("width", "height"), [(1, 1), (2, 1), (1, 2), (3, 3), (16, 16), (17, 33), (1, 100), (100, 1)]
)
def test_same_as_naive(width, height):
    depth = np.random.default_rng(0).random((height, width), dtype=np.float32)
    pyramid = hrt.build_depth_pyramid(gbuffer_of(depth))
    levels = naive.pyramid(depth)
    assert len(pyramid) == len(levels)
    assert pyramid.data.dtype == np.float32
    assert len(pyramid.data) == sum(level.size for level in levels)
    for index, level in enumerate(levels):
        assert pyramid.level(index).shape == level.shape
        assert np.array_equal(pyramid.level(index), level)


def test_threads_change_nothing_and_the_input_stays():
    depth = np.random.default_rng(1).random((301, 203), dtype=np.float32)
    before = depth.copy()
    one = hrt.build_depth_pyramid(gbuffer_of(depth), threads=1)
    assert np.array_equal(one.data, hrt.build_depth_pyramid(gbuffer_of(depth)).data)
    assert np.array_equal(depth, before)


def test_bad_arguments_are_named():
    depth = np.zeros((2, 2), np.float32)
    with pytest.raises(hrt.ArgumentError, match="gbuffer: expected a GBuffer"):
        hrt.build_depth_pyramid(depth)
    with pytest.raises(hrt.ArgumentError, match="threads"):
        hrt.build_depth_pyramid(gbuffer_of(depth), threads=-1)
