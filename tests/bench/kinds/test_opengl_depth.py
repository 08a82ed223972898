"""The depth buffers of another rasteriser, Mesa's llvmpipe, against our own: the same alpha.

As the peers, it needs `pip install '.[peers]'` and Mesa's EGL, and says so where they are missing.
"""

import numpy as np
import pytest

import hybrid_rt as hrt
import hybrid_rt_scenes as hrs
from support import opengl

WITHIN = 0.005
"""Of all rays: by how much alpha may differ."""


@pytest.fixture(scope="module")
def _gl():
    try:
        context, _ = opengl.opened()
    except Exception as error:
        pytest.skip(f"no OpenGL 4.5 through moderngl and EGL here: {error!r}")
    context.release()


def alphas(gbuffer):
    """Return alpha of each technique that takes a G-buffer."""
    rays = hrt.mirror_rays(gbuffer)
    names = [n for n in hrt.TECHNIQUES if gbuffer.scene is not None or n != "certified"]
    return {n: float(hrt.march(rays, hrt.prepare(gbuffer, n)).resolved.mean()) for n in names}


def seen(name):
    spec = hrs.get_scene(name)
    scene, camera = spec.load(), spec.camera(next(iter(spec.cameras)), 320, 180)
    drawn = hrt.rasterize(scene, camera)
    return scene, camera, drawn, alphas(drawn)


@pytest.fixture(scope="module", params=["cornell", "atrium"])
def view(request):
    return seen(request.param)


def read(view, kind, form, far, **options):
    scene, camera, _, _ = view
    dump = opengl.depth_buffer(scene, camera, kind, form, far)
    bits = None if form == "float32" else form
    return hrt.GBuffer.from_arrays(
        camera, dump, kind=kind, bits=bits, far=far, origin="bottom", **options
    )


@pytest.mark.usefixtures("_gl")
@pytest.mark.parametrize("far", [None, 200.0])
@pytest.mark.parametrize("form", ["float32", 24, 16])
@pytest.mark.parametrize("kind", ["standard", "reversed"])
def test_mesa_and_ours_have_the_same_alpha(view, kind, form, far):
    scene, _, drawn, ours = view
    found = read(view, kind, form, far, scene=scene)
    np.testing.assert_array_equal(found.prim_id >= 0, drawn.prim_id >= 0)
    assert (found.prim_id == drawn.prim_id).mean() > 0.999
    assert found.matched.mean() > 0.997
    theirs = alphas(found)
    apart = {name: theirs[name] - ours[name] for name in ours}
    print(f"{scene.name}, {kind}, {form}, far {far}: apart {apart}")
    assert set(apart) == set(hrt.TECHNIQUES)
    assert max(map(abs, apart.values())) < WITHIN


@pytest.mark.usefixtures("_gl")
@pytest.mark.parametrize("form", ["float32", 24])
@pytest.mark.parametrize("kind", ["standard", "reversed"])
def test_without_the_mesh_a_scene_of_large_surfaces_has_the_same_alpha(kind, form):
    view = seen("cornell")
    apart = {n: a - view[3][n] for n, a in alphas(read(view, kind, form, 200.0)).items()}
    print(f"alone, {kind}, {form}: apart {apart}")
    assert set(apart) == set(hrt.TECHNIQUES) - {"certified"}
    assert max(map(abs, apart.values())) < WITHIN
