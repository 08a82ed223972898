"""See how many mirror rays the depth buffer of your own engine answers.

An engine hands over its camera and what its depth attachment holds: 24 bits of standard Z, bottom
row first. Here a few lines of NumPy play the engine. hybrid_rt marches through it without a mesh.

python examples/own_depth_buffer.py [PICTURE]
"""

import sys

import numpy as np
from PIL import Image

import hybrid_rt as hrt

NEAR, FAR, WIDTH, HEIGHT = 0.1, 60.0, 960, 540


def engine(camera: hrt.Camera) -> np.ndarray:
    """Return the engine's depth attachment, (H, W) uint32: balls on a floor before a wall."""
    x, y = np.meshgrid(np.arange(WIDTH) + 0.5, np.arange(HEIGHT) + 0.5)
    view = hrt.unproject(camera, np.stack([x, y, np.full_like(x, 0.01)], axis=-1).reshape(-1, 3))
    eye = np.array(camera.eye)
    ahead = (view - eye) / ((view - eye) @ np.array(camera.forward))[:, None]  # z is 1 along these
    z = np.full(len(view), FAR)
    for normal, offset in (((0, 1, 0), 0.0), ((0, 0, 1), -6.0)):
        with np.errstate(divide="ignore"):
            at = (offset - eye @ normal) / (ahead @ np.array(normal, float))
        z = np.where((at > NEAR) & (at < z), at, z)
    for centre, radius in (((-2.2, 1, -2), 1.0), ((0.2, 1.5, -3.5), 1.5), ((2.4, 0.7, -1), 0.7)):
        a, b = np.sum(ahead**2, axis=1), ahead @ (eye - centre)
        below = b**2 - a * (np.sum((eye - centre) ** 2) - radius**2)
        at = (-b - np.sqrt(np.maximum(below, 0))) / a
        z = np.where((below > 0) & (at > NEAR) & (at < z), at, z)
    standard = FAR / (FAR - NEAR) * (1 - NEAR / z)
    return np.round(standard * (2**24 - 1)).astype(np.uint32).reshape(HEIGHT, WIDTH)[::-1]


size = {"width": WIDTH, "height": HEIGHT}
camera = hrt.Camera.look_at((0.6, 2.0, 5.0), (0, 0.7, -2), vfov_deg=50, near=NEAR, **size)
stored = {"kind": "standard", "bits": 24, "far": FAR, "origin": "bottom"}
gbuffer = hrt.GBuffer.from_arrays(camera, engine(camera), **stored)
rays = hrt.mirror_rays(gbuffer)  # they start on the tilted pixels of the buffer
print(gbuffer)
for name in ("paper", "slope", "linear"):
    marched = hrt.march(rays, hrt.prepare(gbuffer, name))
    print(f"{name:8} answers {marched.resolved.mean():.1%} of {len(rays)} mirror rays")

marched = hrt.march(rays, hrt.prepare(gbuffer, "slope"))
sun = np.array([0.5, 0.7, 0.5]) / np.linalg.norm([0.5, 0.7, 0.5])
lit = 0.25 + 0.75 * np.clip(np.nan_to_num(gbuffer.normal) @ sun, 0, 1)
image = lit[..., None] * [0.8, 0.78, 0.75]
x, y = rays.pixel.T
i, j = np.maximum(marched.pixel, 0).T
found = np.where(marched.resolved[:, None], image[j, i], [0.75, 0.45, 0.1])  # orange: ask a tracer
image[y, x] = 0.6 * image[y, x] + 0.4 * found
output = sys.argv[1] if len(sys.argv) > 1 else "own_depth_buffer.png"
Image.fromarray((255 * np.clip(image, 0, 1) ** (1 / 2.2)).astype(np.uint8)).save(output)
