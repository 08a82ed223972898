"""Cameras of every kind, from about the same place."""

from dataclasses import replace

import hybrid_rt as hrt


def of_every_kind(
    eye=(0.1, 0.2, 5.0), target=(0.2, 0.0, -1.0), *, width=24, height=16, near=0.1, far=9.0,
    view_height=5.0, vfov_deg=60.0,
):  # fmt: skip
    """Return cameras by name; the shifts are shares of the screen's size."""
    size = {"width": width, "height": height}
    pinhole = hrt.Camera.look_at(eye, target, vfov_deg=vfov_deg, near=near, **size)
    flat = hrt.Camera.orthographic(eye, target, view_height=view_height, near=near, far=far, **size)
    left = tuple(-x for x in pinhole.right)
    return {
        "pinhole": pinhole,
        "off the middle": replace(pinhole, shift_px=(0.4 * width, -0.7 * height)),
        "beside the view": replace(pinhole, shift_px=(-0.6 * width, 0.1 * height)),
        "wide pixels": replace(pinhole, aspect=0.25),
        "high pixels": replace(pinhole, aspect=6.0, shift_px=(0.2 * width, 0.0)),
        "mirrored": replace(pinhole, right=left, shift_px=(0.1 * width, 0.0)),
        "orthographic": flat,
        "orthographic, shifted": replace(flat, shift_px=(0.3 * width, 0.2 * height), aspect=2.0),
        "orthographic, mirrored": replace(flat, right=left),
        "orthographic, from behind the eye": replace(flat, near=-4.0),
        "orthographic, a slice": replace(flat, near=3.0, far=5.5),
    }


KINDS = tuple(of_every_kind())
