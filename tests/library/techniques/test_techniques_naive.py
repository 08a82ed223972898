"""Linear, DDA, Hi-Z and slope-aware marches against their oracles, ray for ray."""

import numpy as np
import pytest

import hybrid_rt as hrt
from naive import slabs, strict
from naive.walk import View
from support import synthetic
from support.screens import through

# The kernels compute in float32 with coordinates of tens of pixels: decisions that hang on less
# than this relative distance may go either way.
MARGIN = 2e-5

CASES = {
    "linear": (
        slabs.linear,
        [
            hrt.Linear(0.5, stride=0.03, refinements=0, max_steps=60),
            hrt.Linear(2.0, stride=0.07, refinements=5, max_steps=300),
            hrt.Linear(0.1, stride=0.01, refinements=2, max_steps=20),
        ],
        ("thickness", "stride", "refinements", "max_steps"),
    ),
    "dda": (
        slabs.dda,
        [
            hrt.PixelDDA(0.5, max_steps=10**6),
            hrt.PixelDDA(3.0, stride=3, jitter=0.37, max_steps=10**6),
            hrt.PixelDDA(0.1, stride=2, jitter=1.0, max_steps=10),
        ],
        ("thickness", "stride", "jitter", "max_steps"),
    ),
    "hiz": (
        strict.hiz,
        [
            hrt.HiZ(0.5, max_steps=10**6),
            hrt.HiZ(5.0, threshold=0.3, border=0.2, trace_background=True, max_steps=10**6),
            hrt.HiZ(0.1, border=0.0, max_steps=10**6),
        ],
        ("thickness", "threshold", "border", "trace_background"),
    ),
    "slope": (strict.slope, [hrt.SlopeAware(samples=1), hrt.SlopeAware(samples=4)], ()),
}


def hard_rays(rng, buffer, n):
    """Return rays along the screen's axes, to and from the eye, from pixel corners and edges."""
    height, width = buffer.depth.shape
    camera = buffer.camera
    start = np.empty((n, 3))
    start[:, 0] = rng.integers(0, width, n) + rng.choice([0.5, 0.25, 0.0], n)
    start[:, 1] = rng.integers(0, height, n) + rng.choice([0.5, 0.25, 0.0], n)
    start[:, 2] = rng.uniform(0.01, 0.3, n)
    origin = hrt.unproject(camera, start)
    axes = np.array([camera.right, camera.up, camera.forward])
    kind = rng.integers(0, 5, n)
    direction = rng.choice([-1.0, 1.0], (n, 1)) * axes[rng.integers(0, 3, n)]
    direction[kind == 3] = (np.array(camera.eye) - origin)[kind == 3]
    direction[kind == 4] = (origin - np.array(camera.eye))[kind == 4] * 1e-3
    return hrt.Rays.from_arrays(origin, direction)


def valley(rng, width, height):
    """Return the view of a few planes that meet in creases, away from the viewer, without steps."""
    x, y = np.meshgrid(np.arange(width) + 0.5 - width / 2, np.arange(height) + 0.5 - height / 2)
    a, b = rng.uniform(-0.8, 0.8, (2, 4)) / max(width, height)
    planes = 0.1 * (1 + a[:, None, None] * x + b[:, None, None] * y)
    lowest = planes.argmin(axis=0)
    return synthetic.gbuffer(planes.min(axis=0), 0.1 * a[lowest], 0.1 * b[lowest], vfov_deg=70)


def aimed_rays(rng, buffer, n):
    """Return rays from points in front of the surfaces to points on them, and beyond."""
    height, width = buffer.depth.shape
    pixel = np.stack([rng.integers(0, width, 2 * n), rng.integers(0, height, 2 * n)], axis=1)
    depth = buffer.depth[pixel[:, 1], pixel[:, 0]]
    depth[:n] *= rng.uniform(1.0, 2.0, n)
    place = pixel + rng.uniform(0.1, 0.9, (2 * n, 2))
    start, end = np.split(hrt.unproject(buffer.camera, np.column_stack([place, depth])), 2)
    return hrt.Rays.from_arrays(start, (end - start) * rng.uniform(0.1, 2.0, (n, 1)))


def compare(oracle, mode, names, buffer, rays):
    """Return how many rays could be compared, and hits among them; all that were agreed."""
    camera = buffer.camera
    view = View(buffer.depth, buffer.ddx, buffer.ddy, camera)
    marched = through(rays, buffer, mode)
    parameters = {name: getattr(mode, name) for name in names}
    compared = hits = 0
    for i in range(len(rays)):
        expected = oracle(
            view, rays.origin[i], rays.direction[i], tuple(int(p) for p in rays.pixel[i]),
            float(rays.t_near[i]), float(rays.t_far[i]), **parameters,
        )  # fmt: skip
        if expected.margin < MARGIN:
            continue
        compared += 1
        hits += expected.pixel[0] >= 0
        where = f"{mode}, ray {i} of a {view.width} by {view.height} view: {expected}"
        assert marched.status[i] == expected.status, where
        assert marched.resolved[i] == expected.resolved, where
        assert tuple(marched.pixel[i]) == expected.pixel, where
        far = np.linalg.norm(rays.origin[i] - camera.eye) / np.linalg.norm(rays.direction[i])
        for got, t in ((marched.t[i], expected.t), (marched.t_free[i], expected.t_free)):
            np.testing.assert_allclose(got, t, rtol=2e-3, atol=1e-5 * far, err_msg=where)
    return np.array([compared, hits])


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("seed", range(3))
def test_agrees_with_the_oracle(name, seed):
    oracle, modes, names = CASES[name]
    rng = np.random.default_rng(seed)
    counts, total = np.zeros(2, int), 0
    for mode in modes:
        for view, shoot in (
            (synthetic.random_gbuffer, synthetic.random_rays),
            (valley, synthetic.random_rays),
            (valley, aimed_rays),
            (valley, aimed_rays),
        ):
            buffer = view(rng, *(int(n) for n in rng.integers(1, 40, 2)))
            rays = shoot(rng, buffer, 60)
            counts += compare(oracle, mode, names, buffer, rays)
            total += len(rays)
    print(f"{name}: {counts[0]} of {total} rays compared, {counts[1]} hits")
    assert counts[0] > 0.6 * total
    assert counts[1] > 0.05 * total


@pytest.mark.parametrize("name", CASES)
def test_agrees_with_the_oracle_on_hard_rays(name):
    oracle, modes, names = CASES[name]
    rng = np.random.default_rng(11)
    counts = np.zeros(2, int)
    for mode in modes:
        for size in ((1, 9), (9, 1), (13, 8), (8, 16)):
            buffer = synthetic.random_gbuffer(rng, *size)
            counts += compare(oracle, mode, names, buffer, hard_rays(rng, buffer, 60))
    total = 240 * len(modes)
    print(f"{name}: {counts[0]} of {total} rays compared, {counts[1]} hits")
    assert counts[0] > 0.15 * total
    assert counts[1] > 0.01 * total
