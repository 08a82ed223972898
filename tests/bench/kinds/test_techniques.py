"""The points of techniques, as judging kinds measure them."""

import numpy as np
import pytest

import hybrid_rt as hrt
from hybrid_rt_bench.measure.screens import Screens, points_of
from support import synthetic


@pytest.mark.parametrize("technique", hrt.TECHNIQUES.values(), ids=hrt.TECHNIQUES)
@pytest.mark.parametrize("which", ["all", "default", "switches", "cheapest"])
def test_points_are_told_apart_and_the_default_is_one(technique, which):
    points = points_of(technique, which)
    labels = [point.label for point in points]
    assert len(set(labels)) == len(labels)
    assert max(map(len, labels)) <= 60
    assert all(point.name == technique.name for point in points)
    assert sum(point.default for point in points) == 1


def test_a_grid_without_the_default_gets_it():
    class Bare(hrt.Paper):
        name = "bare"

        @classmethod
        def _grid(cls, which):
            return [hrt.Point("samples 2", cls(samples=2))]

    assert [point.label for point in points_of(Bare, "all")] == ["default", "samples 2"]


def test_every_point_marches_and_shares_what_it_reads():
    rng = np.random.default_rng(3)
    buffer = synthetic.random_gbuffer(rng, 30, 20)
    rays = synthetic.random_rays(rng, buffer, 100)
    screens = Screens(buffer, 1)
    for technique in hrt.TECHNIQUES.values():
        for point in points_of(technique, "all"):
            screen = screens.of(point.technique)
            assert screen.technique == point.technique
            assert screens.of(point.technique).data is screen.data
            assert len(hrt.march(rays, screen)) == 100
