"""Open3D: ``RaycastingScene``, which is Embree's default scene under its own threads."""

from __future__ import annotations

import time
from typing import Any

import numpy as np

import hybrid_rt as hrt
from hybrid_rt_bench.kinds.peers.programs.base import (
    Answers,
    Opened,
    Query,
    View,
    joined,
)


class Open3D(Opened):
    """``RaycastingScene.cast_rays``; it computes u, v and normals as well, and has no t_near."""

    def __init__(self, scene: hrt.Scene, threads: int) -> None:
        # It brings an old TBB, which Numba must not find when it starts its own threads.
        import open3d

        tensor = open3d.core.Tensor.from_numpy
        start = time.perf_counter()
        self._scene = open3d.t.geometry.RaycastingScene(nthreads=threads)
        self._scene.add_triangles(tensor(scene.vertices), tensor(scene.faces.astype(np.uint32)))
        self._scene.cast_rays(tensor(np.ones((1, 6), np.float32)))  # the first call builds
        self.build_seconds = time.perf_counter() - start
        self._tensor, self.threads = tensor, threads

    def load(self, view: View) -> Query:
        """Return the query, its rays as one (N, 6) tensor."""
        rays = self._tensor(joined(view.rays))

        def answers(found: Any) -> Answers:
            # Its mark for a miss is 2**32 - 1.
            prim_id = found["primitive_ids"].numpy().view(np.int32)
            return Answers(found["t_hit"].numpy(), prim_id)

        return Query(lambda: self._scene.cast_rays(rays, nthreads=self.threads), answers)
