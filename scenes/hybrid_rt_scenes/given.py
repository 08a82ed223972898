"""Views that are given as cameras, such as those of a glTF file."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import numpy as np
from pydantic import PrivateAttr

import hybrid_rt as hrt
from hybrid_rt_scenes.spec import CameraSpec


class GivenCamera(CameraSpec):
    """A view given as a camera of whatever kind.

    Attributes
    ----------
    eye, target, up, near
        Of the camera; the target is one unit ahead.
    vfov_deg : float
        Of a pinhole camera, else the default.
    """

    _camera: hrt.Camera = PrivateAttr()

    @classmethod
    def of(cls, camera: hrt.Camera) -> GivenCamera:
        """Return the view of a camera."""
        values: dict[str, Any] = {"eye": camera.eye, "up": camera.up, "near": camera.near}
        values["target"] = tuple((np.array(camera.eye) + np.array(camera.forward)).tolist())
        values["vfov_deg"] = getattr(camera, "vfov_deg", cls.model_fields["vfov_deg"].default)
        view = cls.model_construct(**values)  # an orthographic near plane may be behind the eye
        view._camera = camera
        return view

    def sized(self, width: int, height: int) -> hrt.Camera:
        """Return the camera with `width` by `height` pixels; what the height shows stays."""
        return self._camera.resized(width, height)


def given_cameras(cameras: Mapping[str, hrt.Camera]) -> dict[str, CameraSpec]:
    """Return views of cameras; their names become such as files and command lines can have."""
    found: dict[str, CameraSpec] = {}
    for name, camera in cameras.items():
        plain = re.sub(r"[^A-Za-z0-9_.-]+", "_", name).strip("_.") or "camera"
        unique, number = plain, 2
        while unique in found:
            unique, number = f"{plain}_{number}", number + 1
        found[unique] = GivenCamera.of(camera)
    return found
