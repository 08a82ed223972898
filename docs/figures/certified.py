"""Draw docs/figures/certified.png: what the lists hold along the path of one ray of `atrium`.

Run from the repository's root: ``python docs/figures/certified.py``.
"""

from pathlib import Path

import matplotlib
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt

import hybrid_rt as hrt
import hybrid_rt_scenes as hrs

SIZE = (160, 90)
LENGTH = 4
ANSWERED, STOPPED = "#1b7837", "#b2182b"


def path(camera, origin, direction, t_end):
    """Return the pixels of a ray up to t_end, and where it enters each: (x, y, s) rows, depth."""
    t = np.concatenate([[0.0], np.geomspace(1e-3, t_end, 20000)])
    points = origin.astype(float) + t[:, None] * direction.astype(float)
    x, y, depth = hrt.project(camera, points).T
    keep = (x >= 0) & (x < SIZE[0]) & (y >= 0) & (y < SIZE[1]) & (depth > 0)
    x, y, depth = x[keep], y[keep], depth[keep]
    along = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(x), np.diff(y)))])
    return x.astype(int), y.astype(int), along, depth


def draw(axes, gbuffer, rays, marched, i, reference):
    """Draw one ray's depth over the bounds of the pixels that it crosses."""
    lists = gbuffer.lists
    t_hit = float(reference.t[i])
    px, py, along, depth = path(gbuffer.camera, rays.origin[i], rays.direction[i], t_hit * 1.15)
    bounds = lists.nearest[py, px]
    own = rays.pixel[i]
    axes.fill_between(
        along, 0, lists.rest[py, px], color="0.75", lw=0, label="everything that is not listed"
    )
    for k in range(LENGTH):
        shown = np.where(bounds[:, k] > 0, bounds[:, k], np.nan)
        axes.plot(
            along,
            shown,
            color=plt.cm.Blues(0.95 - 0.18 * k),
            lw=1.2,
            label="bounds of the listed primitives" if k == 0 else None,
        )
    colour = ANSWERED if marched.resolved[i] else STOPPED
    axes.plot(along, depth, color=colour, lw=2, label="the ray")
    hit = hrt.project(gbuffer.camera, hits_point(rays, i, t_hit)[None])[0]
    place = along[np.argmin(np.hypot(px + 0.5 - hit[0], py + 0.5 - hit[1]))]
    axes.plot([place], [hit[2]], "o", color=colour, ms=7, zorder=5, ls="", label="its true hit")
    stop = hrt.project(gbuffer.camera, hits_point(rays, i, float(marched.t_free[i]))[None])[0]
    said = (
        "answered: nothing unlisted reaches the ray before its hit"
        if marched.resolved[i]
        else "handed over at the dotted line: what is not listed may be in the way"
    )
    axes.set_title(f"pixel ({own[0]}, {own[1]}), {said}", fontsize=9, loc="left")
    if not marched.resolved[i]:
        where = along[np.argmin(np.hypot(px + 0.5 - stop[0], py + 0.5 - stop[1]))]
        axes.axvline(where, color=colour, ls=":", lw=1)
    axes.set_xlim(0, along[-1])
    axes.set_ylim(0, 1.25 * max(depth.max(), hit[2]))
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
        if len(px) > 100 and 25 < along[-1] < 60:
            return i
    raise SystemExit("no ray to show")


def main():
    """Write the figure."""
    spec = hrs.get_scene("atrium")
    scene, camera = spec.load(), spec.camera("nave", *SIZE)
    gbuffer = hrt.rasterize(scene, camera, lists=LENGTH)
    pyramid = hrt.build_depth_pyramid(gbuffer, conservative=True)
    rays = hrt.mirror_rays(gbuffer)
    marched = hrt.march(rays, gbuffer, pyramid, "certified")
    reference = hrt.EmbreeTracer(scene, robust=True).intersect(rays)
    figure, axes = plt.subplots(1, 2, figsize=(11, 4.2), layout="constrained")
    for panel, wanted in zip(
        axes,
        (marched.status == hrt.MarchStatus.HIT, marched.status == hrt.MarchStatus.HIDDEN),
        strict=True,
    ):
        draw(
            panel,
            gbuffer,
            rays,
            marched,
            pick(gbuffer, rays, marched, reference, wanted),
            reference,
        )
    axes[0].set_ylabel("depth = near / z, nearer is higher")
    axes[0].legend(loc="upper right", fontsize=8, frameon=False)
    target = Path(__file__).with_suffix(".png")
    figure.savefig(target, dpi=120)
    print(f"wrote docs/figures/{target.name}")


if __name__ == "__main__":
    main()
