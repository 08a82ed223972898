"""The rasteriser sees what Embree's primary rays see."""

import numpy as np
import pytest
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

import hybrid_rt as hrt
from naive import visibility
from support import DATA

VIEWS = {
    "sponza": [
        ((-10, 1.5, 0), (5, 3, 0), 60),
        ((0, 6, 0), (8, 1, 2), 60),
        ((8, 1.5, -3), (-5, 2, 1), 60),
    ],
    "bistro_exterior": [
        ((5, 1.8, 0), (-10, 4, -8), 70),
        ((4, 1.8, -60), (-10, 4, -40), 60),
    ],
}


def view(eye, target, vfov_deg, width, height):
    """Return a camera whose eye float32 can hold, as Embree's rays start there."""
    eye = np.array(eye, np.float32).astype(np.float64)
    return hrt.Camera.look_at(
        eye, target, vfov_deg=vfov_deg, width=width, height=height, near=0.001
    )


def embree_of(scene):
    embree = EmbreeScene(robust=True)
    TriangleMesh(embree, scene.vertices, scene.faces)
    return embree


def primary_rays(embree, camera):
    """Return prim_id (H, W) of rays through the pixels' centres, with z_view of one."""
    shape = (camera.height, camera.width)
    j, i = np.mgrid[: shape[0], : shape[1]]
    x = np.stack([i + 0.5, j + 0.5, np.ones(shape)], axis=-1).reshape(-1, 3)
    direction = (x @ np.linalg.inv(camera.pixel_from_world).T).astype(np.float32)
    origin = np.tile(np.array(camera.eye, np.float32), (len(x), 1))
    hits = embree.run(origin, direction, output=True)
    return hits["primID"].astype(np.int32).reshape(shape)


def compare(scene, embree, camera):
    """Return the share of different pixels, after checking that each is explained."""
    ours = hrt.rasterize(scene, camera).prim_id
    theirs = primary_rays(embree, camera)
    left = visibility.unexplained(scene.vertices, scene.faces, camera, ours, theirs)
    cases = [(i, j, int(ours[j, i]), int(theirs[j, i])) for i, j in left[:10].tolist()]
    assert len(left) == 0, f"{len(left)} unexplained, (x, y, ours, Embree's): {cases}"
    return (ours != theirs).mean()


@pytest.mark.parametrize("name", VIEWS)
def test_real_scene(name):
    path = DATA / f"{name}.npz"
    if not path.is_file():
        pytest.skip(
            f"no real scene: {path.name} is neither in HYBRID_RT_DATA nor in ../shared/scenes"
        )
    scene = hrt.load_scene(path)
    embree = embree_of(scene)
    for eye, target, vfov_deg in VIEWS[name]:
        camera = view(eye, target, vfov_deg, 961, 541)
        assert compare(scene, embree, camera) < 2e-3


@pytest.mark.parametrize("seed", range(4))
def test_soup_of_triangles(seed):
    rng = np.random.default_rng(seed)
    corners = rng.uniform(-3, 3, (400, 1, 3)) + 10.0 ** rng.uniform(-2, 0.5) * rng.normal(
        size=(400, 3, 3)
    )
    scene = hrt.Scene.from_arrays(corners.reshape(-1, 3), np.arange(1200).reshape(-1, 3))
    eye = (0, 0, 7) if seed % 2 else (0.1, 0.2, 0.3)
    compare(scene, embree_of(scene), view(eye, (0.2, -0.3, -1), 75, 321, 243))


def test_the_judge_excuses_no_wrong_answer():
    """A judge that lets everything pass would make the tests above worthless."""
    rng = np.random.default_rng(1)
    corners = rng.uniform(-3, 3, (200, 1, 3)) + rng.normal(size=(200, 3, 3))
    scene = hrt.Scene.from_arrays(corners.reshape(-1, 3), np.arange(600).reshape(-1, 3))
    camera = view((0, 0, 7), (0, 0, 0), 60, 200, 200)
    ours = hrt.rasterize(scene, camera).prim_id
    seen = np.unique(ours[ours >= 0])
    wrong = np.where(ours >= 0, rng.choice(seen, ours.shape), ours).astype(np.int32)
    hole = np.full_like(ours, -1)
    for bad in (wrong, hole):
        left = visibility.unexplained(scene.vertices, scene.faces, camera, ours, bad)
        assert len(left) > 0.97 * (ours != bad).sum()
