"""Other programs that trace the same rays or draw the same pictures: see `PEERS`."""

from __future__ import annotations

from hybrid_rt.errors import UnknownNameError
from hybrid_rt_bench.kinds.peers.programs import mitsuba_ray, open3d_ray, opengl, ours, trimesh_ray
from hybrid_rt_bench.kinds.peers.programs.base import Peer
from hybrid_rt_bench.report.table import Table

EMBREE, RASTER = "embree", "raster"
"""What the others are timed against: the strongest Embree for rays, our raster for pictures."""

PEERS = {
    peer.name: peer
    for peer in (
        Peer(EMBREE, "The strongest path of ours through Embree", ("embreex",), ours.Embree),
        Peer(
            "hybrid", "Our march, technique certified, then the strongest Embree", (),
            ours.Hybrid, alone=False,
        ),
        Peer("embreex", "EmbreeScene.run as it is, one thread", ("embreex",), ours.EmbreexRun),
        Peer(
            "embreex-threads", "The same call in chunks on our threads", ("embreex",),
            ours.EmbreexThreads,
        ),
        Peer("open3d", "RaycastingScene.cast_rays", ("open3d",), open3d_ray.Open3D),
        Peer(
            "mitsuba", "Scene.ray_intersect_preliminary, llvm_ad_rgb", ("mitsuba", "drjit"),
            mitsuba_ray.Mitsuba,
        ),
        Peer(
            "trimesh", "ray_pyembree, intersects_location, first hits", ("trimesh", "embreex"),
            trimesh_ray.TrimeshLocation,
        ),
        Peer(
            "trimesh-first", "ray_pyembree, intersects_first: no distances", ("trimesh", "embreex"),
            trimesh_ray.TrimeshFirst,
        ),
        Peer(
            "trimesh-rtree", "ray_triangle, intersects_location, first hits", ("trimesh", "rtree"),
            trimesh_ray.TrimeshRtree, sampled=True,
        ),
        Peer(
            RASTER, "hybrid_rt.rasterize: depth, its derivatives, primitives", (),
            ours.Raster, raster=True, alone=False,
        ),
        Peer(
            "llvmpipe", "Mesa's OpenGL on the processor, by moderngl and EGL", ("moderngl",),
            opengl.Llvmpipe, raster=True,
        ),
    )
}  # fmt: skip
"""Every peer by name, and what is ours beside them."""


def get_peer(name: str) -> Peer:
    """Return a registered peer.

    Raises
    ------
    UnknownNameError
        No such peer; with the nearest known one.
    """
    if name not in PEERS:
        raise UnknownNameError("peer", name, PEERS)
    return PEERS[name]


def listing() -> list[Table]:
    """Return the table of programs for ``hybrid-rt list``."""
    rows = [[peer.name, peer.version, peer.description] for peer in PEERS.values()]
    return [Table("Programs for `run peers`", ["peer", "version", "what is called"], rows)]
