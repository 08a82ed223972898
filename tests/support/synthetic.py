"""G-buffers and rays made up for tests, without rasterising anything."""

import numpy as np

import hybrid_rt as hrt


def any_scene(faces=1):
    """Return a scene of one triangle, many times, for tests that never look at the geometry."""
    return hrt.Scene.from_arrays(np.eye(3, dtype=np.float32), np.tile([0, 1, 2], (faces, 1)))


def gbuffer(depth, ddx=None, ddy=None, *, vfov_deg=60.0, near=0.1, camera=None):
    """Return a G-buffer of the given depths; prim_id counts the covered pixels."""
    depth = np.ascontiguousarray(depth, np.float32)
    height, width = depth.shape
    zeros = np.zeros_like(depth)
    prim_id = np.where(depth > 0, np.arange(depth.size).reshape(depth.shape), -1).astype(np.int32)
    if camera is None:
        camera = hrt.Camera.look_at(
            (0, 0, 0), (0, 0, -1), vfov_deg=vfov_deg, width=width, height=height, near=near
        )
    return hrt.GBuffer(
        depth,
        zeros if ddx is None else np.ascontiguousarray(ddx, np.float32),
        zeros if ddy is None else np.ascontiguousarray(ddy, np.float32),
        prim_id,
        any_scene(max(1, int(prim_id.max()) + 1)),
        camera,
    )


def random_gbuffer(rng, width, height):
    """Return a G-buffer of tilted patches, steps between them, noise and holes."""
    x, y = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    depth = np.full((height, width), 0.02)
    ddx, ddy = np.zeros_like(depth), np.zeros_like(depth)
    for _ in range(rng.integers(1, 7)):
        x0, x1 = sorted(rng.integers(0, width + 1, 2))
        y0, y1 = sorted(rng.integers(0, height + 1, 2))
        base = rng.uniform(0.005, 0.2)
        a, b = rng.uniform(-0.5, 0.5, 2) * base / max(width, height)
        box = np.s_[y0:y1, x0:x1]
        depth[box] = (base + a * (x - width / 2) + b * (y - height / 2))[box]
        ddx[box], ddy[box] = a, b
    if rng.random() < 0.3:
        depth *= rng.uniform(0.9, 1.1, depth.shape)
    depth[rng.random(depth.shape) < rng.choice([0.0, 0.02, 0.3])] = 0.0
    return gbuffer(depth, ddx, ddy, vfov_deg=float(rng.uniform(20, 110)))


def random_rays(rng, buffer, n):
    """Return rays from visible surfaces and from anywhere, some with limits, in all directions."""
    height, width = buffer.depth.shape
    pixel = np.stack([rng.integers(0, width, n), rng.integers(0, height, n)], axis=1)
    on_surface = (buffer.depth[pixel[:, 1], pixel[:, 0]] > 0) & (rng.random(n) < 0.7)
    start = np.empty((n, 3))
    start[:, :2] = pixel + 0.5
    start[:, 2] = buffer.depth[pixel[:, 1], pixel[:, 0]]
    free = ~on_surface
    start[free, 0] = rng.uniform(-0.05 * width, 1.05 * width, free.sum())
    start[free, 1] = rng.uniform(-0.05 * height, 1.05 * height, free.sum())
    start[free, 2] = rng.uniform(0.001, 1.05, free.sum())
    origin = hrt.unproject(buffer.camera, start)
    direction = rng.normal(size=(n, 3))
    direction[rng.random((n, 3)) < 0.1] = 0.0
    direction[(direction == 0).all(axis=1)] = (1, 0, 0)
    pixel[free] = -1
    distance = np.linalg.norm(origin, axis=1)
    t_near = np.where(rng.random(n) < 0.3, rng.uniform(0, 0.2, n) * distance, 0.0)
    t_far = np.where(rng.random(n) < 0.3, t_near + rng.uniform(0, 3, n) * distance, np.inf)
    return hrt.Rays.from_arrays(origin, direction, pixel, t_near, t_far)
