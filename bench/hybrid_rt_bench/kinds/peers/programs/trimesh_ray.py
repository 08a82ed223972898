"""trimesh: its ray queries over embreex, and those over an R-tree."""

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
    answers_of,
)


class _Trimesh(Opened):
    """A mesh of trimesh that keeps its faces as they are; one thread, there is no other way."""

    def __init__(self, scene: hrt.Scene, threads: int) -> None:
        import trimesh

        intersector = self._intersector()
        start = time.perf_counter()
        mesh = trimesh.Trimesh(scene.vertices, scene.faces, process=False, validate=False)
        self.ray = intersector(mesh)
        self._first(scene.vertices[:1].astype(np.float64))
        self.build_seconds = time.perf_counter() - start

    def _intersector(self) -> Any:
        from trimesh.ray.ray_pyembree import RayMeshIntersector

        return RayMeshIntersector

    def _first(self, point: Any) -> None:
        """Ask about one ray, for which everything is built."""
        self.ray.intersects_location(point, np.ones((1, 3)), multiple_hits=False)


class TrimeshLocation(_Trimesh):
    """``intersects_location(multiple_hits=False)``: triangles and where they are met."""

    def load(self, view: View) -> Query:
        """Return the query, its rays in float64 as trimesh computes."""
        origin = view.rays.origin.astype(np.float64)
        direction = view.rays.direction.astype(np.float64)

        def answers(found: Any) -> Answers:
            place, ray, triangle = (np.asarray(part) for part in found)
            place, d = place.reshape(-1, 3), direction[ray]  # of no hits, it is of shape (0,)
            t = ((place - origin[ray]) * d).sum(axis=1) / (d * d).sum(axis=1)
            return answers_of(len(origin), ray, t, triangle)

        def run() -> Any:
            return self.ray.intersects_location(origin, direction, multiple_hits=False)

        return Query(run, answers)


class TrimeshFirst(_Trimesh):
    """``intersects_first``: triangles alone, trimesh's shortest way."""

    def load(self, view: View) -> Query:
        """Return the query; it says no distances."""
        rays = view.rays

        def answers(triangle: Any) -> Answers:
            return Answers(np.full(len(rays), np.nan), triangle)

        return Query(lambda: self.ray.intersects_first(rays.origin, rays.direction), answers)

    def _first(self, point: Any) -> None:
        self.ray.intersects_first(point, np.ones((1, 3)))


class TrimeshRtree(TrimeshLocation):
    """The queries that trimesh falls back to without Embree: an R-tree, then all in NumPy."""

    def _intersector(self) -> Any:
        import rtree  # noqa: F401  trimesh would say so at the first ray only
        from trimesh.ray.ray_triangle import RayMeshIntersector

        return RayMeshIntersector
