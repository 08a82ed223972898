"""The real scenes, where they are: they load, and their cameras show something."""

from __future__ import annotations

import numpy as np
import pytest
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

from hybrid_rt_scenes import get_scene, scene_names

TRIANGLES = {
    "bistro": 1_591_998,
    "conference": 331_179,
    "kitchen": 1_443_517,
    "nori_sphere": 1_154,
    "sponza": 262_267,
}


def test_the_table_above_names_all_real_scenes():
    assert sorted(TRIANGLES) == [n for n in scene_names() if not get_scene(n).builtin]


@pytest.mark.parametrize("name", sorted(TRIANGLES))
def test_a_real_scene_loads_and_its_cameras_show_it(name):
    spec = get_scene(name)
    said = spec.missing()
    if said is not None:
        pytest.skip(said)
    scene = spec.load()
    assert len(scene) == TRIANGLES[name]
    embree = EmbreeScene()
    TriangleMesh(embree, scene.vertices, scene.faces)
    for camera in spec.cameras:
        view = spec.camera(camera, 64, 36)
        x, y = np.meshgrid(np.arange(64) + 0.5, np.arange(36) + 0.5)
        across = ((x - 32) / view.focal_px).ravel()[:, None]
        down = ((18 - y) / view.focal_px).ravel()[:, None]
        rays = np.array(view.forward) + across * view.right + down * np.array(view.up)
        eyes = np.tile(np.array(view.eye, np.float32), (len(rays), 1))
        found = embree.run(eyes, rays.astype(np.float32), output=True)
        hit = found["primID"] >= 0
        assert hit.mean() > 0.6, camera
        # t along an unnormalised ray is the distance along the view: nothing visible is cut
        assert found["tfar"].min() > view.near, camera
        assert len(np.unique(found["primID"])) > 100, camera
