"""What each technique answers on a real view, and how much of that is wrong."""

import numpy as np
import pytest

import hybrid_rt as hrt
from hybrid_rt_scenes import get_scene
from support.screens import through

# The bounds are wide: they tell a technique that works from one that does not. Share of rays
# answered with a hit, and the largest share of those that may lie more than a pixel off.
BOUNDS = {
    "paper": (0.30, 0.50, 0.05),
    "slope": (0.35, 0.55, 0.06),
    "linear": (0.25, 0.65, 0.40),
    "dda": (0.40, 0.80, 0.35),
    "hiz": (0.15, 0.50, 0.20),
}


@pytest.fixture(scope="module")
def counted():
    """Return (rays, hits, hits more than a pixel off, misses, wrong misses) of each technique."""
    spec = get_scene("sponza")
    if (why := spec.missing()) is not None:
        pytest.skip(why)
    scene = spec.load()
    buffer = hrt.rasterize(scene, spec.camera("nave", 480, 270))
    rays = hrt.mirror_rays(buffer)
    truth = hrt.EmbreeTracer(scene).intersect(rays)
    at = rays.origin + np.where(np.isfinite(truth.t), truth.t, 0)[:, None] * rays.direction
    true_pixel = hrt.project(buffer.camera, at)[:, :2] - 0.5
    counts = {}
    print()
    for name in BOUNDS:
        marched = through(rays, buffer, name)
        hit = marched.prim_id >= 0
        near = np.abs(true_pixel - marched.pixel).max(axis=1) <= 1
        wrong = hit & ((truth.prim_id < 0) | ~near)
        miss = marched.resolved & ~hit
        counts[name] = tuple(
            int(n)
            for n in (
                len(rays), hit.sum(), wrong.sum(), miss.sum(), (miss & (truth.prim_id >= 0)).sum()
            )
        )  # fmt: skip
        print("{}: of {} rays {} hits, {} wrong; {} misses, {} wrong".format(name, *counts[name]))
    return counts


@pytest.mark.parametrize("name", BOUNDS)
def test_alpha_and_false_hits_are_within_bounds(counted, name):
    low, high, most_wrong = BOUNDS[name]
    rays, hits, wrong, misses, _ = counted[name]
    assert low < hits / rays < high
    assert wrong / hits < most_wrong
    if name != "hiz":
        assert misses == 0


def test_strict_techniques_err_less_than_those_with_a_thickness(counted):
    rate = {name: wrong / hits for name, (_, hits, wrong, _, _) in counted.items()}
    strict = max(rate["paper"], rate["slope"])
    assert strict < rate["hiz"] < min(rate["dda"], rate["linear"])


def test_slopes_answer_more_rays_than_flat_cells(counted):
    assert counted["slope"][1] > 1.1 * counted["paper"][1]


def test_untraced_background_is_answered_wrongly(counted):
    _, _, _, misses, wrong = counted["hiz"]
    assert misses > 100
    assert wrong > 0
