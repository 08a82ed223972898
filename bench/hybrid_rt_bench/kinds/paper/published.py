"""The paper's own numbers, to stand beside ours.

R. M. Pikulsky, "Ray Tracing Algorithm Based on Screen Space Ray Marching", Visnyk VNTU 2025, no. 2,
pp. 132-137, DOI 10.31649/1997-9266-2025-179-2-132-137. RTX 2080 Super; milliseconds.
"""

from __future__ import annotations

RESOLUTIONS = ("1280x720", "1920x1080", "2560x1440", "3840x2160")

MACHINE = "RTX 2080 Super"

ROWS = {"nori_sphere": "Sphere", "sponza": "Sponza", "bistro": "Bistro"}
"""What the paper's tables call those of its scenes that are here, by their names here."""

TRIANGLES = {"Sphere": "1000", "Sponza": "2^18", "Bistro": "2^20"}
"""How many triangles the scenes of the paper have, about."""

ALPHA = 0.31
"""Mean share of resolved rays."""

SSRM_MS = dict(zip(RESOLUTIONS, (0.212, 0.503, 0.937, 2.205), strict=True))
"""Table 1."""

RT_MS = {
    "Sphere": dict(zip(RESOLUTIONS, (0.91, 1.76, 2.78, 5.49), strict=True)),
    "Sponza": dict(zip(RESOLUTIONS, (2.76, 5.59, 10.24, 23.79), strict=True)),
    "Bistro": dict(zip(RESOLUTIONS, (7.65, 9.63, 25.11, 52.81), strict=True)),
}
"""Table 2."""

SPEEDUP = {
    "Sphere": dict(zip(RESOLUTIONS, (1.083, 1.025, 0.96, 0.901), strict=True)),
    "Sponza": dict(zip(RESOLUTIONS, (1.304, 1.282, 1.273, 1.271), strict=True)),
    "Bistro": dict(zip(RESOLUTIONS, (1.393, 1.347, 1.372, 1.363), strict=True)),
}
"""Table 3, estimated."""
