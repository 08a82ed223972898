"""Hard cases that are hard by the camera, the image, the depth format or the scale of the scene."""

from __future__ import annotations

from functools import partial

import numpy as np

import hybrid_rt as hrt
from hybrid_rt_scenes.hard.case import BuiltCase, DepthFormat, HardCase
from hybrid_rt_scenes.hard.stage import (
    HEIGHT,
    WIDTH,
    case,
    front,
    joined,
    mirrors,
    room,
    room_parts,
    scattered,
    scene_of,
    sphere_directions,
    starts,
    straight,
)
from hybrid_rt_scenes.primitives import Part, boxes, quad


def _moved_room(scale: float, offset: float) -> BuiltCase:
    # The room scaled, then moved by three numbers that float32 does not hold exactly.
    shift = offset * np.array([1.0, 0.37, -0.713])
    parts = [Part(p.vertices * scale + shift, p.faces) for p in room_parts()]
    scene = scene_of(*parts)
    eye = np.float32(np.array([0.3, 1.3, 3.9]) * scale + shift).astype(np.float64)
    target = np.array([-0.1, 0.8, -2.0]) * scale + shift
    camera = hrt.Camera.look_at(eye, target, width=WIDTH, height=HEIGHT, near=0.05 * scale)
    return case(scene, camera, joined(mirrors(scene, camera, 700), scattered(scene, camera, 500)))


def _field_of_view(degrees: float) -> BuiltCase:
    scene = room()
    if degrees < 30:  # from far enough that the narrow view holds the room, without its front wall
        scene = scene_of(*room_parts()[:3])
        distance = 2.0 / np.tan(np.radians(degrees) / 2)
        camera = hrt.Camera.look_at(
            (0.05 * distance, 0.1 * distance, distance), (0, 0.8, -1), vfov_deg=degrees,
            width=WIDTH, height=HEIGHT, near=0.01 * distance,
        )  # fmt: skip
    else:
        camera = front(vfov_deg=degrees)
    return case(scene, camera, joined(mirrors(scene, camera, 700), scattered(scene, camera, 400)))


def _image(width: int, height: int) -> BuiltCase:
    # One row of 2 degrees: at 60 nearly all of a hundred columns would look sideways.
    scene, camera = room(), front(width, height, vfov_deg=2 if height < width else 60)
    some = starts(scene, camera)
    many = some.take(np.arange(400) % len(some))
    d = sphere_directions(np.random.default_rng(41), len(many))
    return case(scene, camera, joined(some.towards(some.mirror), many.towards(d)))


def _odd_pyramid(width: int, height: int) -> BuiltCase:
    scene, camera = room(), front(width, height)
    return case(scene, camera, joined(mirrors(scene, camera, 700), scattered(scene, camera, 500)))


def _quad_derivatives() -> BuiltCase:
    n = 9
    x = np.linspace(-2.2, 2.0, n)
    low = np.stack([x, 0.1 + 0 * x, np.linspace(-2.5, 1.0, n)], axis=1)
    scene = scene_of(*room_parts(), boxes(low, low + np.array([0.2, 1.4, 0.2])))
    camera = front()
    rays = joined(mirrors(scene, camera, 1000), scattered(scene, camera, 700))
    return case(scene, camera, rays, derivatives="quad")


def _far() -> BuiltCase:
    # A plain of 2e5 units with blocks from 10 to 1e5 away, and a near plane at 0.05.
    distance = 10.0 ** np.arange(1, 5.5, 0.5)
    sign = np.where(np.arange(len(distance)) % 2, 1, -1)
    low = np.stack([0.3 * sign * distance, 0 * distance, -distance], axis=1)
    blocks = boxes(low, low + distance[:, None] * [0.2, 0.3, -0.05])
    plain = quad([-1e5, 0, 10], [2e5, 0, 0], [0, 0, -2e5])
    scene = scene_of(plain, blocks)
    camera = straight(eye=(0, 1.5, 3.5), near=0.05)
    some = starts(scene, camera, 900)
    rng = np.random.default_rng(40)
    pick = rng.integers(0, len(distance), len(some))
    target = low[pick] + distance[pick, None] * rng.uniform(0, 0.3, (len(some), 3))
    return case(scene, camera, joined(some.aimed(target), some.towards(some.mirror)))


def _stored_depth(depth_format: DepthFormat) -> BuiltCase:
    # Blocks on a long floor, seen with a near plane so close that coarse depth runs out.
    z = -np.geomspace(0.5, 30, 9)
    low = np.stack([0.35 * z * np.where(np.arange(9) % 2, 1, -1), 0 * z, z], axis=1)
    size = np.stack([-0.25 * z, -0.4 * z, -0.02 * z], axis=1)
    floor = quad([-30, 0, 4], [60, 0, 0], [0, 0, -44])
    scene = scene_of(floor, boxes(low, low + size))
    camera = front(near=0.002)
    rays = joined(mirrors(scene, camera, 900), scattered(scene, camera, 600))
    return case(scene, camera, rays, depth_format=depth_format)


CASES = (
    *(
        HardCase(f"fov_{degrees}", what, partial(_field_of_view, degrees))
        for degrees, what in (
            (1, "At 1 degree all depths are alike, and everything stands within 3 % of 1 / z."),
            (10, "At 10 degrees the eye stands far off and a ray crosses few pixels."),
            (120, "At 120 degrees pixels at the border see ten times the depth of the middle."),
            (170, "At 170 degrees a pixel in the middle spans 20 degrees and the projection of a "
                  "short ray is thousands of pixels long."),
        )
    ),
    HardCase("image_1x1", "One pixel: the pyramid has one level and every ray leaves at once.",
             lambda: _image(1, 1)),
    HardCase("image_1xn", "An image one pixel wide has no second column for derivatives.",
             lambda: _image(1, 64)),
    HardCase("image_nx1", "An image one pixel high has no second row, and every coarse cell is "
             "half outside.", lambda: _image(96, 1)),
    HardCase("odd_pyramid", "At odd sizes the last cell of a level holds one pixel more or less "
             "than floor division has.", lambda: _odd_pyramid(67, 45)),
    HardCase("odd_pyramid_prime", "A size that is odd at every level forgets the last row and "
             "column again and again.", lambda: _odd_pyramid(127, 31)),
    HardCase("quad_derivatives", "Differences over 2x2 pixels mix two surfaces at an outline: "
             "planes of surfaces that are not there.", _quad_derivatives),
    HardCase("depth_unorm16", "16 bits of depth put far surfaces onto common steps, and what lies "
             "beyond the last one into the background.", lambda: _stored_depth("unorm16")),
    HardCase("depth_unorm24", "24 bits of depth cannot order what is far from a close near plane.",
             lambda: _stored_depth("unorm24")),
    HardCase("depth_standard_z", "1 - depth in float32 keeps 24 bits at best, where reversed depth "
             "keeps 24 bits at any distance.", lambda: _stored_depth("standard_z")),
    HardCase("far_distance", "Hits 1e5 units away: t, depth and the plane's derivatives span six "
             "orders.", _far),
    HardCase("offset_1e3", "1e3 from the origin an ulp of a coordinate is 6e-5 units.",
             lambda: _moved_room(1.0, 1e3)),
    HardCase("offset_1e6", "1e6 from the origin an ulp of a coordinate is 0.06 units: the room is "
             "made of steps.", lambda: _moved_room(1.0, 1e6)),
    HardCase("scaled_1e-4", "A room of 1e-4 units: an absolute epsilon is larger than it.",
             lambda: _moved_room(1e-4, 0.0)),
    HardCase("scaled_1e6", "A room of 1e6 units: an absolute epsilon is below the rounding.",
             lambda: _moved_room(1e6, 0.0)),
)  # fmt: skip
