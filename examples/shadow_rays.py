"""Shadow rays through the screen first, and what came of them as tables of pandas.

python examples/shadow_rays.py [PICTURE]
"""

import sys

import numpy as np
import pandas as pd
from PIL import Image

import hybrid_rt as hrt
from hybrid_rt_scenes import get_scene

place = get_scene("atrium")
scene = place.load(size=2**16)
camera = place.camera("nave", 960, 540)
gbuffer, tracer = hrt.rasterize(scene, camera), hrt.EmbreeTracer(scene)
screen = hrt.prepare(gbuffer, "certified")
lights = place.lights_of(scene)

tables, image = [], np.full((*gbuffer.depth.shape, 3), 0.05)
for name, light, colour in (
    ("sun", lights.directional_light, (0.8, 0.7, 0.5)),
    ("point", lights.point_light, (0.2, 0.3, 0.5)),
    ("area", lights.area_light, (0.4, 0.2, 0.2)),
):
    rays = hrt.shadow_rays(gbuffer, light)  # one for each pixel whose surface faces the light
    result = hrt.occluded_hybrid(rays, screen, tracer)
    assert (result.occluded == tracer.occluded(rays)).mean() > 0.999  # Embree alone says the same
    x, y = rays.pixel.T
    table = pd.DataFrame(
        {
            "light": name,
            "shadowed": result.occluded,
            "by the screen": result.resolved,
            "status": [hrt.MarchStatus(s).name.lower() for s in result.status],
            "object": scene.object_id[gbuffer.prim_id[y, x]],
        }
    )
    tables.append(table)
    towards = rays.direction / np.linalg.norm(rays.direction, axis=1, keepdims=True)
    facing = np.einsum("ij,ij->i", gbuffer.normal[y, x], towards)
    image[y, x] += np.where(result.occluded, 0, facing)[:, None] * colour

rays = pd.concat(tables)
with pd.option_context("display.float_format", "{:.1%}".format):
    print("Shares of the shadow rays of each light\n")
    print(rays.groupby("light")[["shadowed", "by the screen"]].mean(), "\n")
    print("How their marches ended\n")
    print(pd.crosstab(rays["light"], rays["status"], normalize="index"), "\n")
    print("The five objects most in shadow, of those with 1000 rays\n")
    objects = rays.groupby("object")["shadowed"].agg(["size", "mean"])
    print(objects[objects["size"] >= 1000].nlargest(5, "mean"))
output = sys.argv[1] if len(sys.argv) > 1 else "shadow_rays.png"
Image.fromarray((255 * np.clip(image, 0, 1) ** (1 / 2.2)).astype(np.uint8)).save(output)
print(f"\nwrote {output}")
