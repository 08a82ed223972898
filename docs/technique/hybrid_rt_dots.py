"""A technique of one's own: look at a few points of each ray, and guess a thickness."""

from dataclasses import dataclass

import numpy as np

import hybrid_rt as hrt


@dataclass(frozen=True)
class Dots(hrt.Technique):
    """Project points of the ray; the first that lies just behind a visible surface is the hit."""

    name = "dots"
    description = "A few points of the ray against the depth buffer, in NumPy"

    samples: int = 24
    thickness: float = 0.1  # how far behind a surface a hit may lie, as a share of its distance

    @classmethod
    def _grid(cls, which):
        counts = (8, 24, 96) if which == "all" else (24,)
        return [hrt.Point(f"{n} points", cls(samples=n)) for n in counts]

    def _march(self, rays, screen, any_hit, threads):
        marched, buffer = hrt.Marched.unresolved(len(rays)), screen.gbuffer
        length = np.linalg.norm(rays.direction.astype(float), axis=1)
        open_ = np.flatnonzero(np.isfinite(length) & (length > 0))
        for step in np.geomspace(1e-3, 1.0, self.samples) * screen.scene.diagonal:
            t = rays.t_near[open_] + step / length[open_]
            x, y, depth = hrt.project(
                screen.camera, rays.origin[open_] + t[:, None] * rays.direction[open_]
            ).T
            height, width = buffer.depth.shape
            ahead = (depth > 0) & (depth <= 1) & (t <= rays.t_far[open_])
            seen = ahead & (x >= 0) & (x < width) & (y >= 0) & (y < height)
            open_, t, depth = open_[seen], t[seen], depth[seen]  # others leave the screen
            i, j = x[seen].astype(int), y[seen].astype(int)
            behind = buffer.depth[j, i] / depth - 1  # > 0: farther away than what is seen there
            hit = (behind > 0) & (behind < self.thickness)
            marched.steps[open_] += 1
            marched.t_free[open_[behind <= 0]] = t[behind <= 0]
            answered = open_[hit]
            marched.status[answered], marched.resolved[answered] = hrt.MarchStatus.HIT, True
            marched.pixel[answered] = np.stack([i, j], axis=1)[hit]
            marched.prim_id[answered], marched.t[answered] = buffer.prim_id[j, i][hit], t[hit]
            open_ = open_[behind <= 0]  # a ray that is far behind a surface is hidden
        return marched
