"""Directions of secondary rays one by one, and the densities that random ones must have."""

from __future__ import annotations

import math

import numpy as np


def philox(counter, key):
    """Return the four words of Philox4x32-10, with whole numbers of any size."""
    c, k = list(counter), list(key)
    for _ in range(10):
        high0, low0 = divmod(0xD2511F53 * c[0], 2**32)
        high1, low1 = divmod(0xCD9E8D57 * c[2], 2**32)
        c = [high1 ^ c[1] ^ k[0], low1, high0 ^ c[3] ^ k[1], low0]
        k = [(k[0] + 0x9E3779B9) % 2**32, (k[1] + 0xBB67AE85) % 2**32]
    return c


def uniforms(x, y, seed):
    """Return the two numbers of pixel (x, y)."""
    words = philox((x, y, 0, 0), (seed % 2**32, seed // 2**32))
    return (words[0] + 0.5) / 2**32, (words[1] + 0.5) / 2**32


def frame(n):
    """Return two tangents of the unit vector n (Duff et al. 2017)."""
    sign = math.copysign(1, n[2])
    a = -1 / (sign + n[2])
    b = n[0] * n[1] * a
    return (
        np.array([1 + sign * n[0] ** 2 * a, sign * b, -sign * n[0]]),
        np.array([b, sign + n[1] ** 2 * a, -n[1]]),
    )


def unit(v):
    return np.asarray(v) / np.linalg.norm(v)


def cosine(n, u1, u2):
    """Return the direction about n that two numbers stand for."""
    s, t = frame(n)
    r, angle = math.sqrt(u1), 2 * math.pi * u2
    return r * math.cos(angle) * s + r * math.sin(angle) * t + math.sqrt(1 - u1) * n


def glossy(view, n, alpha, u1, u2):
    """Return the reflection of `view` (it comes to the surface) at a visible GGX normal.

    Heitz 2018, listing 1, letter by letter.
    """
    s, t = frame(n)
    ve = np.array([-view @ s, -view @ t, -view @ n])
    vh = unit([alpha * ve[0], alpha * ve[1], ve[2]])
    square = vh[0] ** 2 + vh[1] ** 2
    t1 = np.array([-vh[1], vh[0], 0]) / math.sqrt(square) if square > 0 else np.array([1.0, 0, 0])
    t2 = np.cross(vh, t1)
    r, phi = math.sqrt(u1), 2 * math.pi * u2
    p1, p2 = r * math.cos(phi), r * math.sin(phi)
    weight = 0.5 * (1 + vh[2])
    p2 = (1 - weight) * math.sqrt(1 - p1 * p1) + weight * p2
    nh = p1 * t1 + p2 * t2 + math.sqrt(max(0, 1 - p1 * p1 - p2 * p2)) * vh
    ne = unit([alpha * nh[0], alpha * nh[1], max(0, nh[2])])
    m = ne[0] * s + ne[1] * t + ne[2] * n
    return view - 2 * (view @ m) * m


def visible_normal_density(v, m, alpha):
    """Return D_v(m) of GGX for unit vectors about +z, v (3,) and m (..., 3); it integrates to 1."""
    cos = m[..., 2]
    d = alpha**2 / (np.pi * (1 + cos**2 * (alpha**2 - 1)) ** 2)
    tan2 = (1 - v[2] ** 2) / v[2] ** 2
    masking = 2 / (1 + math.sqrt(1 + alpha**2 * tan2))
    return masking * np.maximum(m @ v, 0) * d / v[2]
