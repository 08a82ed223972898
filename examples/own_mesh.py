"""A mesh of your own becomes a picture with shadows and reflections.

python examples/own_mesh.py [PICTURE [MESH]]    without MESH: a chain on a floor, made by trimesh
"""

import sys

import numpy as np
import trimesh
from PIL import Image
from trimesh.transformations import rotation_matrix

import hybrid_rt as hrt
from hybrid_rt_scenes import automatic_cameras

SUN = hrt.DirectionalLight((-0.5, -0.8, -0.35))
SKY = np.array([0.42, 0.58, 0.8])
PAINT = np.array([[0.55, 0.53, 0.5], [0.8, 0.3, 0.2], [0.85, 0.7, 0.4], [0.25, 0.5, 0.55]])


def chain() -> trimesh.Scene:
    """Return five links above a floor."""
    scene = trimesh.Scene(trimesh.creation.box(bounds=[(-6, -2, -4), (6, -1.9, 4)]))
    for k in range(5):
        link = trimesh.creation.torus(1.2, 0.35, major_sections=192, minor_sections=96)
        link.apply_transform(rotation_matrix(np.pi / 2 * (k % 2) + 0.5, (1, 0, 0)))
        scene.add_geometry(link.apply_translation((1.6 * k - 3.2, 0, 0)))
    return scene


def light(normal: np.ndarray, prim_id: np.ndarray, in_sun: np.ndarray) -> np.ndarray:
    """Return the colour (N, 3) of surfaces by their normals, triangles and whether sun is there."""
    towards = -np.array(SUN.direction) / np.linalg.norm(SUN.direction)
    sun = np.maximum(normal @ towards, 0) * in_sun
    colour = sun[:, None] * [1.0, 0.92, 0.78] + (0.6 + 0.4 * normal[:, 1:2]) * SKY * 0.6
    return colour * PAINT[scene.object_id[prim_id] % len(PAINT)]


output = sys.argv[1] if len(sys.argv) > 1 else "own_mesh.png"
scene = hrt.load_scene(sys.argv[2]) if len(sys.argv) > 2 else hrt.Scene.from_trimesh(chain())
camera = automatic_cameras(scene)["front"].sized(960, 540)
gbuffer, tracer = hrt.rasterize(scene, camera), hrt.EmbreeTracer(scene)

in_sun = np.zeros(gbuffer.depth.shape, bool)
to_sun = hrt.shadow_rays(gbuffer, SUN)  # one for each pixel whose surface faces the sun
in_sun[to_sun.pixel[:, 1], to_sun.pixel[:, 0]] = ~tracer.occluded(to_sun)

rays = hrt.mirror_rays(gbuffer)  # the screen answers what it can, Embree the other rays
result = hrt.trace_hybrid(rays, hrt.prepare(gbuffer, "certified"), tracer)
hit, x, y, mirrored = np.isfinite(result.hits.t), *rays.pixel.T, np.tile(SKY, (len(rays), 1))
normal = result.hits.n_g[hit] / np.linalg.norm(result.hits.n_g[hit], axis=1, keepdims=True)
normal *= -np.sign(np.sum(normal * rays.direction[hit], axis=1, keepdims=True))  # towards the ray
mirrored[hit] = light(normal, result.hits.prim_id[hit], np.ones(hit.sum()))

image = np.broadcast_to(SKY, (*gbuffer.depth.shape, 3)).copy()
direct = light(gbuffer.normal[y, x], gbuffer.prim_id[y, x], in_sun[y, x])
image[y, x] = 0.8 * direct + 0.2 * mirrored
Image.fromarray((255 * np.clip(image, 0, 1) ** (1 / 2.2)).astype(np.uint8)).save(output)
print(f"the screen answers {result.resolved.mean():.0%} of {len(rays)} mirror rays: {output}")
