"""Secondary rays from a G-buffer.

All of them are made alike. There is at most one ray for each covered pixel, ordered by tiles of 32
by 32 pixels (row by row) and in Morton order inside a tile, so that neighbours in the array are
neighbours on the screen. `pixel` is the pixel that a ray starts from. `direction` has unit length,
so t is in world units.

A ray starts on the float64 point where the view through the pixel's centre meets the plane of the
visible triangle, moved along the normal by the error bound of rounding that point to float32 and
rounded outwards (`OffsetRayOrigin` in M. Pharr, W. Jakob and G. Humphreys, "Physically Based
Rendering", 4th ed., section 6.8.6). The normal is the triangle's geometric one, turned to the
viewer. `t_near` bounds the distance at which a float32 intersector can still report the triangle
that the ray starts on, and is never larger than `t_far`. Neither is an absolute epsilon: both scale
with the coordinates. Where the raster clamped the depth of a sliver seen edge-on, which is rare,
the ray starts at the stored depth, which may lie behind the plane: such a ray may meet its own
triangle. Of a depth buffer whose triangles are not known (`GBuffer.from_arrays`), it starts on the
plane of its pixel in the same way; where buffer and scene disagree, no ray starts.

No ray but a mirror ray of a surface seen exactly edge-on leaves below the surface or along it. A
sample that would is left out; there is no ray for its pixel then.

Random rays are a function of the pixel and the seed alone (Philox4x32-10): the same bits come out
for any number of threads. With one seed all workloads draw from the same numbers; rays of different
seeds are independent of each other.
"""

from __future__ import annotations

import math

import numpy as np

from hybrid_rt import _check
from hybrid_rt.errors import ArgumentError
from hybrid_rt.kernels.arrays import RayArrays
from hybrid_rt.kernels.secondary import surface as kernels
from hybrid_rt.raster.gbuffer import GBuffer
from hybrid_rt.rays.rays import Rays
from hybrid_rt.scene.lights import AreaLight, DirectionalLight, Light, PointLight

LARGEST_SEED = 2**63 - 1


def mirror_rays(gbuffer: GBuffer) -> Rays:
    """Return the mirror ray of every covered pixel.

    Parameters
    ----------
    gbuffer : GBuffer

    Returns
    -------
    Rays
        N rays, N being the number of covered pixels. Order, origins and `t_near` are those of all
        secondary rays, see the module; `t_far` is infinite.
    """
    return _surface_rays(gbuffer, kernels.MIRROR)


def glossy_rays(gbuffer: GBuffer, roughness: float, seed: int = 0) -> Rays:
    """Return a ray for each covered pixel, reflected at a random microfacet of a GGX surface.

    Parameters
    ----------
    gbuffer : GBuffer
    roughness : float
        Perceptual roughness from 0 to 1, as in glTF and most engines: the alpha of the GGX
        distribution is its square. 0 gives mirror rays.
    seed : int
        0 to 2**63 - 1.

    Returns
    -------
    Rays
        N rays; order, origins and `t_near` are those of all secondary rays, see the module;
        `t_far` is infinite. Pixels whose microfacet reflects the view into the surface have no ray.

    Raises
    ------
    ArgumentError
        A roughness or a seed out of range.

    Notes
    -----
    Normals are drawn from the distribution of those visible to the viewer. A reflection into the
    surface carries no light where microfacets scatter once, which is why it is left out: to average
    over rays, divide by all samples and not by those that are left.

    References
    ----------
    E. Heitz, "Sampling the GGX distribution of visible normals", Journal of Computer Graphics
    Techniques 7 (4), 2018.
    """
    value = _check.fraction("roughness", roughness)
    return _surface_rays(gbuffer, kernels.GLOSSY, alpha=value * value, seed=seed)


def diffuse_rays(gbuffer: GBuffer, seed: int = 0) -> Rays:
    """Return a ray for each covered pixel in a random direction, by the cosine with the normal.

    Parameters
    ----------
    gbuffer : GBuffer
    seed : int
        0 to 2**63 - 1.

    Returns
    -------
    Rays
        N rays, N being the number of covered pixels. Order, origins and `t_near` are those of all
        secondary rays, see the module; `t_far` is infinite.

    Raises
    ------
    ArgumentError
        A seed out of range.
    """
    return _surface_rays(gbuffer, kernels.COSINE, reach=math.inf, seed=seed)


def ambient_occlusion_rays(gbuffer: GBuffer, radius: float, seed: int = 0) -> Rays:
    """Return the rays of `diffuse_rays`, ended at a distance.

    Parameters
    ----------
    gbuffer : GBuffer
    radius : float
        `t_far` of every ray, > 0, world units.
    seed : int
        0 to 2**63 - 1.

    Returns
    -------
    Rays
        N rays, N being the number of covered pixels. Order, origins and `t_near` are those of all
        secondary rays, see the module. The share of them that is not occluded estimates how
        far a surface is open, weighted by the cosine.

    Raises
    ------
    ArgumentError
        A radius or a seed out of range.
    """
    reach = _check.float32_length("radius", radius)
    return _surface_rays(gbuffer, kernels.COSINE, reach=reach, seed=seed)


def shadow_rays(gbuffer: GBuffer, light: Light, seed: int = 0) -> Rays:
    """Return the ray from each covered pixel to a light, where the surface faces it.

    Parameters
    ----------
    gbuffer : GBuffer
    light : PointLight, AreaLight or DirectionalLight
        Of an area light each pixel takes a random point.
    seed : int
        0 to 2**63 - 1; only an area light needs it.

    Returns
    -------
    Rays
        N rays; order, origins and `t_near` are those of all secondary rays, see the module.
        `t_far` ends before the light by the rounding error of the distance, so that a surface
        which holds the light does not shadow it unless it is seen at grazing incidence from the
        ray; it is infinite for a directional light. Pixels with the light behind or in their own
        plane have no ray: the surface shadows itself.

    Raises
    ------
    ArgumentError
        Not a light, or a seed out of range.
    """
    match light:
        case PointLight(position):
            return _surface_rays(gbuffer, kernels.POINT, light=position + (0.0,) * 6)
        case AreaLight(corner, edge_u, edge_v):
            return _surface_rays(gbuffer, kernels.POINT, light=corner + edge_u + edge_v, seed=seed)
        case DirectionalLight(direction):
            length = math.hypot(*direction)
            x, y, z = (-component / length for component in direction)
            return _surface_rays(gbuffer, kernels.DIRECTION, light=(x, y, z) + (0.0,) * 6)
        case _:
            expected = "a PointLight, an AreaLight or a DirectionalLight"
            raise ArgumentError("light", expected, _check.describe(light))


def _surface_rays(
    gbuffer: GBuffer,
    kind: int,
    *,
    alpha: float = 0.0,
    reach: float = 0.0,
    light: tuple[float, ...] = (0.0,) * 9,
    seed: int = 0,
) -> Rays:
    """Return the rays of one kind; its parameters are those of the kernel `surface_rays`."""
    _check.instance("gbuffer", gbuffer, GBuffer)
    camera = gbuffer.camera
    prim_id, vertices, faces = gbuffer.leaving
    tiles_x = -(-camera.width // kernels.TILE)
    tiles_y = -(-camera.height // kernels.TILE)
    counts = np.empty(tiles_x * tiles_y, np.int64)
    kernels.count_covered(prim_id, tiles_x, counts)
    starts = np.cumsum(counts) - counts
    n = int(counts.sum())
    out = RayArrays(
        np.empty((n, 3), np.float32),
        np.empty((n, 3), np.float32),
        np.empty((n, 2), np.int32),
        np.empty(n, np.float32),
        np.empty(n, np.float32),
    )
    kept = np.empty(n, np.bool_)
    kernels.surface_rays(
        kind,
        alpha,
        reach,
        np.array(light),
        _check.integer("seed", seed, least=0, most=LARGEST_SEED),
        prim_id,
        gbuffer.arrays.depth,
        vertices,
        faces,
        camera.sight,
        tiles_x,
        starts,
        *out,
        kept,
    )
    rays = Rays._made(out, scene=gbuffer.scene, camera=camera)
    return rays if kept.all() else rays.take(kept)
