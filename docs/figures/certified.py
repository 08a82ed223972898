"""Draw docs/figures/certified: what the lists hold along the path of two rays of `atrium`.

Run from the repository's root: ``python docs/figures/certified.py [FOLDER]``; it writes a PNG and
an SVG, here by default.
"""

import sys
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

import hybrid_rt as hrt
import hybrid_rt_scenes as hrs
from hybrid_rt_bench.report.looks import AMBER, BLUE, ORANGE, PALE
from hybrid_rt_bench.report.style import STYLE, footer, legend, panels, save, title

SIZE = (160, 90)
LENGTH = 4
RESOLVED, STOPPED = BLUE, ORANGE


def path(camera, origin, direction, t_end):
    """Return the pixels of a ray up to t_end, and where it enters each: (x, y, s) rows, depth."""
    t = np.concatenate([[0.0], np.geomspace(1e-3, t_end, 20000)])
    points = origin.astype(float) + t[:, None] * direction.astype(float)
    x, y, depth = hrt.project(camera, points).T
    keep = (x >= 0) & (x < SIZE[0]) & (y >= 0) & (y < SIZE[1]) & (depth > 0)
    x, y, depth = x[keep], y[keep], depth[keep]
    along = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(x), np.diff(y)))])
    # Of each pixel the first and the last point are enough.
    x, y = x.astype(int), y.astype(int)
    changes = (np.diff(x) != 0) | (np.diff(y) != 0)
    ends = np.concatenate([[True], changes]) | np.concatenate([changes, [True]])
    return x[ends], y[ends], along[ends], depth[ends]


def draw(axes, gbuffer, lists, rays, marched, i, reference):
    """Draw one ray's depth over the bounds of the pixels that it crosses."""
    t_hit = float(reference.t[i])
    px, py, along, depth = path(gbuffer.camera, rays.origin[i], rays.direction[i], t_hit * 1.15)
    bounds = lists.nearest[py, px]
    own = rays.pixel[i]
    axes.fill_between(
        along, 0, lists.rest[py, px], color=PALE, lw=0, label="all that is not listed"
    )
    for k in range(LENGTH):
        shown = np.where(bounds[:, k] > 0, bounds[:, k], np.nan)
        axes.plot(along, shown, color=AMBER, alpha=1 - 0.2 * k, lw=1.2,
                  label="bounds of the listed primitives")  # fmt: skip
    resolved = bool(marched.resolved[i])
    colour = RESOLVED if resolved else STOPPED
    ray = "a resolved ray" if resolved else "an unresolved ray"
    axes.plot(along, depth, "-" if resolved else "--", color=colour, lw=2.2, label=ray)
    hit = hrt.project(gbuffer.camera, hits_point(rays, i, t_hit)[None])[0]
    place = along[np.argmin(np.hypot(px + 0.5 - hit[0], py + 0.5 - hit[1]))]
    axes.plot([place], [hit[2]], "o", color="black", ms=7, zorder=5, label="its true hit")
    stop = hrt.project(gbuffer.camera, hits_point(rays, i, float(marched.t_free[i]))[None])[0]
    said = "nothing unlisted reaches the ray before its hit"
    if not resolved:
        said = "what is not listed may be in the way from the dotted line on"
        where = along[np.argmin(np.hypot(px + 0.5 - stop[0], py + 0.5 - stop[1]))]
        axes.axvline(where, color="black", ls=":", lw=1.4, label="where it is handed over")
    title(axes, f"Pixel ({own[0]}, {own[1]}): {said}", 4.45)
    axes.set_xlim(0, along[-1])
    axes.set_ylim(0, 1.1 * max(depth.max(), hit[2]))
    axes.set_xlabel("along the ray on the screen, pixels")


def hits_point(rays, i, t):
    """Return the world point of ray i at t."""
    return rays.origin[i].astype(float) + t * rays.direction[i].astype(float)


def pick(gbuffer, rays, marched, reference, wanted):
    """Return the first ray of a kind whose way on the screen is long enough to be looked at."""
    for i in np.flatnonzero(wanted & np.isfinite(reference.t) & (marched.steps > 12)):
        px, _py, along, _depth = path(
            gbuffer.camera, rays.origin[i], rays.direction[i], float(reference.t[i])
        )
        if len(px) > 40 and 25 < along[-1] < 60:
            return i
    raise SystemExit("no ray to show")


def figure():
    """Return the figure: a ray that the screen resolves beside one that it does not."""
    spec = hrs.get_scene("atrium")
    scene, camera = spec.load(), spec.camera("nave", *SIZE)
    gbuffer = hrt.rasterize(scene, camera)
    rays = hrt.mirror_rays(gbuffer)
    screen = hrt.prepare(gbuffer, hrt.Certified(lists=LENGTH))
    marched = hrt.march(rays, screen)
    reference = hrt.EmbreeTracer(scene, robust=True).intersect(rays)
    with mpl.rc_context(STYLE):
        made = Figure(figsize=(10.4, 4.6))
        axes = panels(made, 2, 2)
        found = {}
        for panel, status in zip(axes, ("HIT", "HIDDEN"), strict=True):
            wanted = marched.status == hrt.MarchStatus[status]
            chosen = pick(gbuffer, rays, marched, reference, wanted)
            draw(panel, gbuffer, screen.data.lists, rays, marched, chosen, reference)
            for handle, label in zip(*panel.get_legend_handles_labels(), strict=True):
                found.setdefault(label, handle)
        axes[0].set_ylabel("depth = near / z: nearer is higher")
        legend(made, list(found.values()), list(found), fontsize=9)
        footer(made, f"Mirror rays of atrium, camera nave, {SIZE[0]}×{SIZE[1]}; lists of "
               f"{LENGTH} primitives per pixel.")  # fmt: skip
    return made


def main():
    """Write the figure."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent
    for written in save(figure(), folder / "certified"):
        print(f"wrote {written.name}")


if __name__ == "__main__":
    main()
