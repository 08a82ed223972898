"""The depth pyramid against the naive one."""

import numpy as np
import pytest

import hybrid_rt as hrt
from naive import pyramid as naive
from support import synthetic


@pytest.mark.parametrize(
    ("width", "height"), [(1, 1), (2, 1), (1, 2), (3, 3), (16, 16), (17, 33), (1, 100), (100, 1)]
)
def test_same_as_naive(width, height):
    depth = np.random.default_rng(0).random((height, width), dtype=np.float32)
    pyramid = hrt.build_depth_pyramid(synthetic.gbuffer(depth))
    levels = naive.pyramid(depth)
    assert len(pyramid) == len(levels)
    assert pyramid.data.dtype == np.float32
    for index, level in enumerate(levels):
        assert pyramid.level(index).shape == level.shape
        assert np.array_equal(pyramid.level(index), level)


@pytest.mark.parametrize(
    ("width", "height"), [(1, 1), (2, 1), (1, 100), (16, 16), (17, 33), (24, 16), (100, 7)]
)
@pytest.mark.parametrize("build", [hrt.build_depth_pyramid, hrt.build_slope_pyramid])
def test_levels_lie_where_the_closed_form_says_and_apart(width, height, build):
    depth = np.random.default_rng(0).random((height, width), dtype=np.float32) + np.float32(0.1)
    pyramid = build(synthetic.gbuffer(depth))
    a, b = (int(np.ceil(np.log2(n))) for n in (width, height))
    owners = np.zeros(len(pyramid.data), int)
    for index in range(len(pyramid)):
        h, w = pyramid.level(index).shape[:2]
        columns, rows = max(a - index, 0), max(b - index, 0)
        y, x = np.mgrid[:h, :w]
        if index <= min(a, b):
            places = 2 ** (a + b - 2 * index) + (y << (a - index)) + x
        else:
            places = 2 ** (columns + rows) + (y << columns) + x
        np.testing.assert_array_equal(pyramid.data[places], pyramid.level(index))
        np.add.at(owners, places, 1)
    assert owners.max() == 1
    assert pyramid.level(len(pyramid) - 1).shape[:2] == (1, 1)


def test_threads_change_nothing_and_the_input_stays():
    depth = np.random.default_rng(1).random((301, 203), dtype=np.float32)
    before = depth.copy()
    one = hrt.build_depth_pyramid(synthetic.gbuffer(depth), threads=1)
    all_ = hrt.build_depth_pyramid(synthetic.gbuffer(depth))
    for index in range(len(one)):
        assert np.array_equal(one.level(index), all_.level(index))
    assert np.array_equal(depth, before)


def test_bad_arguments_are_named():
    depth = np.zeros((2, 2), np.float32)
    with pytest.raises(hrt.ArgumentError, match="gbuffer: expected a GBuffer"):
        hrt.build_depth_pyramid(depth)
    with pytest.raises(hrt.ArgumentError, match="threads"):
        hrt.build_depth_pyramid(synthetic.gbuffer(depth), threads=-1)
