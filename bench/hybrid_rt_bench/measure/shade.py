"""Give surfaces a look: sun, sky, and how far a corner is open, for pictures of bare geometry."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

import hybrid_rt as hrt

F32 = NDArray[np.float32]
U8 = NDArray[np.uint8]

SUN = np.array([0.35, 0.87, 0.34], np.float32) / np.float32(np.linalg.norm([0.35, 0.87, 0.34]))
COOL, WARM = np.array([0.96, 1.0, 1.06], np.float32), np.array([1.0, 0.95, 0.84], np.float32)
X, Y = np.array([1, 0, 0], np.float32), np.array([0, 1, 0], np.float32)
SKY = np.array([0.62, 0.76, 0.93], np.float32)
"""Colour of the background, brighter towards the top."""
EXPOSURE = np.float32(0.8)
"""How much of the light a picture takes."""
PATTERN = 4
"""Occlusion rays differ inside squares of this many pixels, and are averaged over as many."""


def normals(gbuffer: hrt.GBuffer) -> F32:
    """Return the unit normal of each pixel's primitive, turned to the viewer; 0 where none.

    Returns
    -------
    (H, W, 3) float32, world
    """
    return np.nan_to_num(gbuffer.normal, nan=0.0).astype(np.float32)


def shaded(gbuffer: hrt.GBuffer, rays: hrt.Rays, tracer: hrt.EmbreeTracer, samples: int = 8) -> U8:
    """Return the main view, lit by a sun with shadows and by an occluded sky.

    Parameters
    ----------
    gbuffer : GBuffer
    rays : Rays
        Its mirror rays: they start safely off every visible surface.
    tracer : EmbreeTracer
    samples : int
        Occlusion rays a pixel.

    Returns
    -------
    (H, W, 3) uint8, sRGB
    """
    height, width = gbuffer.prim_id.shape
    sky = SKY * np.linspace(1.0, 0.86, height, dtype=np.float32)[:, None, None] + 0.06
    image = np.broadcast_to(sky, (height, width, 3)).copy()
    if len(rays):
        n = normals(gbuffer)
        x, y = rays.pixel[:, 0], rays.pixel[:, 1]
        n_ray = n[y, x]
        lit = np.maximum(n_ray @ SUN, 0) * ~_occluded(
            tracer, rays, np.broadcast_to(SUN, n_ray.shape)
        )
        open_sky = _smoothed(_openness(gbuffer, rays, n_ray, tracer, samples), gbuffer, n)[y, x]
        view = gbuffer.camera.towards(rays.origin.astype(np.float64)).astype(np.float32)
        head = np.abs(np.einsum("ij,ij->i", n_ray, view)) / np.linalg.norm(view, axis=1)
        hemisphere = 0.75 + 0.25 * n_ray[:, 1]
        ambient = (open_sky * (0.56 * hemisphere + 0.18 * head))[:, None]
        sun = (0.66 * lit)[:, None]
        tint = _tints(gbuffer.known_scene.object_id[gbuffer.prim_id[y, x]])
        image[y, x] = tint * (ambient * COOL + sun * WARM)
    return _developed(image)


def reflected_grey(rays: hrt.Rays, hits: hrt.Hits) -> F32:
    """Return how bright what each ray met looks, in 0 to 1, from the ray's side; 1 for a miss."""
    grey = np.ones(len(rays), np.float32)
    met = hits.prim_id >= 0
    n = _facing(hits.n_g[met], -rays.direction[met])
    length = np.linalg.norm(rays.direction[met], axis=1)
    head = np.einsum("ij,ij->i", n, -rays.direction[met]) / np.where(length > 0, length, 1)
    sun = np.maximum(n @ SUN, 0)
    grey[met] = 0.13 + 0.27 * (0.5 + 0.5 * n[:, 1]) + 0.22 * head + 0.22 * sun
    return np.clip(grey, 0, 1)


def reflection(gbuffer: hrt.GBuffer, rays: hrt.Rays, hits: hrt.Hits) -> F32:
    """Return the image of what one ray a pixel meets: lit, tinted by object, with a pattern in it.

    The pattern is fixed in the world, with a wavelength of a hundredth of the scene's diagonal, so
    that an answer on the right surface at the wrong place is seen as well.

    Returns
    -------
    (H, W, 3) float32, sRGB in 0 to 1
        Where no ray starts, an even grey.
    """
    scene = gbuffer.known_scene
    light = np.empty((len(rays), 3), np.float32)
    met = hits.prim_id >= 0
    length = np.linalg.norm(rays.direction, axis=1)
    up = rays.direction[:, 1] / np.where(length > 0, length, 1)
    light[:] = SKY * (0.85 + 0.25 * np.clip(up, 0, 1))[:, None]
    n = _facing(hits.n_g[met], -rays.direction[met])
    point = rays.origin[met] + hits.t[met, None] * rays.direction[met]
    low, high = scene.bounds
    wave = np.sin(point * np.float32(600 / max(float(np.linalg.norm(high - low)), 1e-30)))
    brightness = 0.24 + 0.2 * (0.5 + 0.5 * n[:, 1]) + 0.4 * np.maximum(n @ SUN, 0)
    brightness *= 1 + 0.1 * wave.mean(axis=1)
    light[met] = _tints(scene.object_id[hits.prim_id[met]]) * brightness[:, None]
    image = np.full((*gbuffer.prim_id.shape, 3), 0.5, np.float32)
    image[rays.pixel[:, 1], rays.pixel[:, 0]] = srgb(np.clip(light, 0, 1))
    return image


def _openness(
    gbuffer: hrt.GBuffer, rays: hrt.Rays, n: F32, tracer: hrt.EmbreeTracer, samples: int
) -> F32:
    """Return, for each pixel, the share of the hemisphere that is open within a short distance."""
    height, width = gbuffer.prim_id.shape
    x, y = rays.pixel[:, 0], rays.pixel[:, 1]
    low, high = gbuffer.known_scene.bounds
    reach = 0.08 * float(np.linalg.norm(high - low))
    side = np.where(np.abs(n[:, :1]) < 0.9, X, Y)
    tangent = np.cross(n, side)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    bitangent = np.cross(n, tangent)
    cell = (x % PATTERN) + PATTERN * (y % PATTERN)
    total = np.zeros(len(rays), np.float32)
    for sample in range(samples):
        # An additive recurrence (the plastic number's) fills the square evenly from any start.
        index = (cell * samples + sample + 1).astype(np.float64)
        u, v = (index * 0.7548776662466927) % 1.0, (index * 0.5698402909980532) % 1.0
        radius, angle = np.sqrt(u), 2 * np.pi * v
        a, b, c = radius * np.cos(angle), radius * np.sin(angle), np.sqrt(1 - u)
        direction = a[:, None] * tangent + b[:, None] * bitangent + c[:, None] * n
        total += ~_occluded(tracer, rays, direction.astype(np.float32), reach)
    out = np.zeros((height, width), np.float32)
    out[y, x] = total / samples
    return out


def _occluded(
    tracer: hrt.EmbreeTracer, rays: hrt.Rays, direction: NDArray[np.float32], reach: float = np.inf
) -> NDArray[np.bool_]:
    t_far = np.full(len(rays), reach, np.float32)
    d = np.ascontiguousarray(direction, np.float32)
    return tracer.occluded(hrt.Rays(rays.origin, d, rays.pixel, rays.t_near, t_far))


def _smoothed(values: F32, gbuffer: hrt.GBuffer, n: F32) -> F32:
    """Return the mean of each pixel's square, over pixels of the same surface."""
    total, weight = np.zeros_like(values), np.zeros_like(values)
    before = (PATTERN - 1) // 2
    padded = [
        np.pad(a, [(PATTERN, PATTERN)] * 2 + [(0, 0)] * (a.ndim - 2))
        for a in (values, gbuffer.depth, n)
    ]
    height, width = values.shape
    for dy in range(-before, PATTERN - before):
        for dx in range(-before, PATTERN - before):
            s = np.s_[PATTERN + dy : PATTERN + dy + height, PATTERN + dx : PATTERN + dx + width]
            value, depth, normal = (a[s] for a in padded)
            plane = gbuffer.depth + dx * gbuffer.ddx + dy * gbuffer.ddy
            same = (np.einsum("ijk,ijk->ij", n, normal) > 0.9) & (
                np.abs(depth - plane) <= 0.02 * gbuffer.depth
            )
            total += value * same
            weight += same
    return np.asarray(np.divide(total, weight, out=values.copy(), where=weight > 0))


def _facing(n: F32, towards: F32) -> F32:
    """Return `n` of unit length, on the side of `towards`."""
    length = np.linalg.norm(n, axis=1, keepdims=True)
    sign = np.where(np.einsum("ij,ij->i", n, towards) < 0, -1, 1)
    return np.asarray(n * (sign[:, None] / np.where(length > 0, length, 1)), np.float32)


def _tints(object_id: NDArray[np.int32]) -> F32:
    """Return a quiet colour for each object, so that neighbours tell apart."""
    hue = (object_id * 0.6180339887498949) % 1.0
    lightness = 0.80 + 0.08 * ((object_id * 0.7548776662466927) % 1.0)
    angle = 2 * np.pi * (hue[:, None] + np.array([0.0, 1 / 3, 2 / 3]))
    return np.asarray(lightness[:, None] * (1 + 0.05 * np.cos(angle)), np.float32)


def srgb(linear: F32) -> F32:
    """Return light as sRGB says it, by the curve of IEC 61966-2-1 in its two pieces.

    Parameters
    ----------
    linear : array of float32, 0 to 1

    Returns
    -------
    array of float32, 0 to 1
    """
    curve = 1.055 * np.maximum(linear, 0.0031308) ** (1 / 2.4) - 0.055
    return np.asarray(np.where(linear <= 0.0031308, 12.92 * linear, curve), np.float32)


def _developed(linear: F32) -> U8:
    """Return light of any strength as bytes in sRGB."""
    x = EXPOSURE * np.clip(linear, 0, None)
    x = x / (1 + 0.25 * x)  # rolls off what the sun overexposes
    return np.asarray(np.round(255 * srgb(np.clip(x, 0, 1))), np.uint8)
