"""Depth buffers of every kind and format, written as engines do, read back against the raster."""

import dataclasses
import itertools

import numpy as np
import pytest

import hybrid_rt as hrt

KINDS = ("standard", "reversed", "linear", "distance")
FORMATS = (np.float16, np.float32, np.float64, 16, 24, 32)


CAMERAS = {
    "pinhole": hrt.Camera.look_at(
        (0, 0, 5), (0, 0.3, 0), vfov_deg=50, width=96, height=64, near=0.1
    ),
    "off centre, fx unlike fy": hrt.Camera.from_intrinsics(
        [[70, 0, 40], [0, 60, 36], [0, 0, 1]], np.diag([1, -1, -1]), (0, 0.3, 5),
        width=96, height=64, near=0.1,
    ),
    "orthographic": hrt.Camera.orthographic(
        (0, 0, 5), (0, 0.3, 0), view_height=3.5, near=-1, far=9, width=96, height=64
    ),
}  # fmt: skip


def triangles(seed, n):
    """Return triangles of middling size around the origin."""
    rng = np.random.default_rng(seed)
    corners = rng.uniform(-2, 2, (n, 1, 3)) + 0.5 * rng.normal(size=(n, 3, 3))
    return hrt.Scene.from_arrays(corners.reshape(-1, 3), np.arange(3 * n).reshape(n, 3))


def view(name="pinhole"):
    """Return a scene of random triangles with holes between them, and what a camera sees of it."""
    scene = triangles(3, 80)
    camera = CAMERAS[name]
    gbuffer = hrt.rasterize(scene, camera)
    assert 0.3 < (gbuffer.prim_id >= 0).mean() < 1.0
    return scene, camera, gbuffer


def written(gbuffer, kind, form, far=None, origin="top"):
    """Return the depth buffer of an engine: through its projection matrix, then its format."""
    camera = gbuffer.camera
    with np.errstate(divide="ignore"):
        z = camera.near / gbuffer.depth.astype(np.float64)
    empty = gbuffer.depth == 0
    if kind in ("standard", "reversed"):
        n = camera.near
        # The third and fourth rows of OpenGL's matrix, and its window depth.
        a, b = (-1.0, -2.0 * n) if far is None else ((far + n) / (n - far), 2 * far * n / (n - far))
        window = 0.5 + 0.5 * (a * -np.where(empty, n, z) + b) / np.where(empty, n, z)
        window[empty] = 1.0
        values = window if kind == "standard" else 1.0 - window
    else:
        values = np.where(empty, np.inf if far is None else far, z)
        if kind == "distance":
            x, y = np.meshgrid(np.arange(camera.width), np.arange(camera.height))
            place = np.stack([x + 0.5, y + 0.5, np.full(x.shape, 0.5)], axis=2).reshape(-1, 3)
            ray = hrt.unproject(camera, place) - np.array(camera.eye)
            cosine = (ray @ np.array(camera.forward)) / np.linalg.norm(ray, axis=1)
            values = np.where(empty, values, z / cosine.reshape(z.shape))
    if origin == "bottom":
        values = values[::-1]
    if isinstance(form, int):
        whole = np.round(values * (2**form - 1))
        return whole.astype(np.uint16 if form == 16 else np.uint32)
    return values.astype(form)


def arguments(kind, form, far, origin):
    bits = form if isinstance(form, int) else None
    return {"kind": kind, "bits": bits, "far": far, "origin": origin}


CASES = [
    case
    for case in itertools.product(KINDS, FORMATS, (None, 60.0), ("top", "bottom"))
    if not (isinstance(case[1], int) and case[0] in ("linear", "distance"))
]


@pytest.mark.parametrize(("kind", "form", "far", "origin"), CASES)
def test_depth_comes_back_within_the_step_that_is_said(kind, form, far, origin):
    _, camera, drawn = view()
    dump = written(drawn, kind, form, far, origin)
    found = hrt.GBuffer.from_arrays(camera, dump, **arguments(kind, form, far, origin))
    # What a few bits hold at the far plane's value is nothing, in the dump itself.
    nothing = {"standard": 1.0, "reversed": 0.0}.get(kind, far or np.inf)
    held = dump / (2**form - 1) if isinstance(form, int) else dump
    empty = (held if origin == "top" else held[::-1]) == nothing
    np.testing.assert_array_equal(found.depth == 0, empty)
    np.testing.assert_array_equal(found.prim_id, np.where(empty, -1, 0))
    off = np.abs(found.depth.astype(float) - drawn.depth)[~empty]
    said = found.uncertainty[~empty]
    assert (said > 0).all()
    # Ours are rounded to float32, at both ends; the sums above to float64.
    assert (off <= said * (1 + 1e-6) + 2.0**-23 * drawn.depth[~empty] + 1e-15).all()
    if form in (np.float16, 16, 24):  # it says no more than it must
        assert (off > 0.5 * said).mean() > 0.2


@pytest.mark.parametrize("form", [np.float32, 24, 16])
@pytest.mark.parametrize("kind", ["standard", "reversed", "linear"])
def test_an_orthographic_buffer_is_linear_between_its_planes(kind, form):
    scene, camera, drawn = view("orthographic")
    n, f = camera.near, camera.far
    z = np.where(drawn.depth > 0, f - drawn.depth.astype(float) * (f - n), f)
    share = (z - n) / (f - n)
    values = {"standard": share, "reversed": 1 - share, "linear": z}[kind]
    bits = None
    if kind != "linear" and isinstance(form, int):
        values, bits = np.round(values * (2**form - 1)).astype(np.uint32), form
    else:
        values = values.astype(np.float32)
    alone = hrt.GBuffer.from_arrays(camera, values, kind=kind, bits=bits)
    off = np.abs(alone.depth - drawn.depth)
    assert (off <= alone.uncertainty * 1.001 + 2.0**-23).all()
    found = hrt.GBuffer.from_arrays(camera, values, kind=kind, bits=bits, scene=scene)
    assert (found.prim_id == drawn.prim_id).mean() > 0.99
    assert found.matched.all()
    rays, theirs = hrt.mirror_rays(alone), hrt.mirror_rays(drawn)
    assert np.median((rays.direction * theirs.direction).sum(axis=1)) > 0.999


def test_an_orthographic_view_has_its_own_far_plane_and_no_distance_from_an_eye():
    _, camera, drawn = view("orthographic")
    with pytest.raises(hrt.ArgumentError, match="far: expected None, or that of the camera, 9"):
        hrt.GBuffer.from_arrays(camera, drawn.depth, kind="reversed", far=8.0)
    with pytest.raises(hrt.ArgumentError, match="kind: expected another kind"):
        hrt.GBuffer.from_arrays(camera, drawn.depth, kind="distance")
    found = hrt.GBuffer.from_arrays(camera, drawn.depth, kind="reversed", far=9.0)
    np.testing.assert_array_equal(found.depth, drawn.depth)


@pytest.mark.parametrize("kind", KINDS)
def test_off_the_middle_and_of_odd_pixels(kind):
    scene, camera, drawn = view("off centre, fx unlike fy")
    dump = written(drawn, kind, np.float32)
    found = hrt.GBuffer.from_arrays(camera, dump, kind=kind, scene=scene)
    np.testing.assert_array_equal(found.prim_id, drawn.prim_id)
    assert found.matched.all()
    alone = hrt.GBuffer.from_arrays(camera, dump, kind=kind)
    np.testing.assert_allclose(alone.depth, drawn.depth, rtol=0, atol=1e-6)
    np.testing.assert_allclose(
        np.nanmedian((alone.normal * drawn.normal).sum(axis=2)), 1.0, atol=1e-4
    )


def test_the_far_plane_of_the_camera_counts_where_none_is_said():
    _, camera, drawn = view()
    dump = written(drawn, "standard", np.float32, 60.0)
    said = hrt.GBuffer.from_arrays(camera, dump, far=60.0)
    known = hrt.GBuffer.from_arrays(dataclasses.replace(camera, far=60.0), dump)
    np.testing.assert_array_equal(known.depth, said.depth)


@pytest.mark.parametrize(("kind", "form"), [(k, f) for k, f, _, o in CASES[::4]])
def test_the_mesh_gives_back_what_the_raster_saw(kind, form):
    scene, camera, drawn = view()
    dump = written(drawn, kind, form, 60.0, "bottom")
    found = hrt.GBuffer.from_arrays(
        camera, dump, scene=scene, **arguments(kind, form, 60.0, "bottom")
    )
    same = found.prim_id == drawn.prim_id
    # Only where several triangles are within the step of a coarse buffer may another be named.
    assert same.mean() == 1.0 or form in (np.float16, 16)
    assert same.mean() > 0.99
    assert found.matched.all()
    assert not found.uncertainty.any()
    for name in ("depth", "ddx", "ddy"):
        np.testing.assert_array_equal(getattr(found, name)[same], getattr(drawn, name)[same])


@pytest.mark.parametrize("form", [np.float32, 24, 16])
def test_a_plane_has_its_own_derivatives_up_to_its_silhouette(form):
    corners = [(-2, -1, -5), (2, -1, -3), (2, 1, -3), (-2, 1, -5)]
    wall = [(-9, -9, -30), (9, -9, -30), (9, 9, -30), (-9, 9, -30)]
    faces = [(0, 1, 2), (0, 2, 3), (4, 5, 6), (4, 6, 7)]
    scene = hrt.Scene.from_arrays(np.array(corners + wall, float), faces)
    camera = hrt.Camera.look_at((0, 0, 0), (0, 0, -1), vfov_deg=60, width=120, height=80, near=0.1)
    drawn = hrt.rasterize(scene, camera)
    assert len(set(drawn.prim_id.ravel().tolist())) >= 4
    dump = written(drawn, "standard", form, 100.0)
    found = hrt.GBuffer.from_arrays(camera, dump, **arguments("standard", form, 100.0, "top"))
    surface = np.where(drawn.prim_id >= 0, drawn.prim_id // 2, -1)
    for name, axis in (("ddx", 1), ("ddy", 0)):
        off = np.abs(getattr(found, name) - getattr(drawn, name))
        # Both ends of a one-sided difference are off by half a step, and float32 rounds.
        told = off <= 2.01 * found.uncertainty.max() + 1e-9
        alone = np.ones(surface.shape, bool)
        for side in (-1, 1):
            next_, second = (np.roll(surface, side * k, axis) for k in (1, 2))
            alone &= (next_ != surface) | (second != surface)
        assert (told | alone).all()
        assert alone.mean() < 0.02
        # Where three of a surface are not in line, no plane runs into the depths.
        assert np.abs(getattr(found, name)).max() <= 2 * np.abs(getattr(drawn, name)).max()
    # In the middle the step is averaged out over 16 pixels.
    middle = np.abs(found.ddx - drawn.ddx)[30:50, 50:70]
    assert middle.max() <= 2.01 * found.uncertainty.max() / 16 + 1e-9
    normals = (found.normal * drawn.normal).sum(axis=2)
    assert np.nanmin(normals) > (0.5 if form == 16 else 0.99)


def test_what_lies_alone_has_no_slope():
    camera = hrt.Camera.look_at((0, 0, 0), (0, 0, -1), width=5, height=3, near=0.1)
    depth = np.full((3, 5), np.inf, np.float32)
    depth[1, 2] = 7.0
    found = hrt.GBuffer.from_arrays(camera, depth, kind="linear")
    assert found.ddx[1, 2] == 0
    assert found.ddy[1, 2] == 0
    assert (found.prim_id >= 0).sum() == 1
    np.testing.assert_allclose(found.normal[1, 2], (0, 0, 1), atol=1e-6)
    np.testing.assert_allclose(found.position[1, 2, 2], -7.0, rtol=1e-6)


def test_rays_and_marches_do_without_a_mesh_what_needs_no_triangles():
    scene, camera, drawn = view()
    dump = written(drawn, "reversed", np.float32)
    alone = hrt.GBuffer.from_arrays(camera, dump, kind="reversed")
    assert alone.scene is None
    rays = hrt.mirror_rays(alone)
    assert rays.scene is None
    assert len(rays) == (alone.prim_id >= 0).sum()
    theirs = hrt.mirror_rays(drawn)
    np.testing.assert_array_equal(rays.pixel, theirs.pixel)
    aligned = (rays.direction * theirs.direction).sum(axis=1)
    assert np.median(aligned) > 0.9999
    for name in ("paper", "slope", "linear", "dda", "hiz"):
        marched = hrt.march(rays, hrt.prepare(alone, name))
        there = hrt.march(theirs, hrt.prepare(drawn, name))
        assert set(marched.prim_id[marched.resolved].tolist()) <= {-1, 0}
        assert abs(marched.resolved.mean() - there.resolved.mean()) < 0.05
    for refused in (
        lambda: hrt.prepare(alone, "certified"),
        lambda: hrt.prepare(alone, "paper").scene,
        lambda: hrt.trace_hybrid(rays, hrt.prepare(alone, "paper"), hrt.EmbreeTracer(scene)),
        lambda: hrt.occluded_hybrid(rays, hrt.prepare(alone, "paper"), hrt.EmbreeTracer(scene)),
    ):
        with pytest.raises(hrt.ArgumentError, match=r"GBuffer\.from_arrays\(\.\.\., scene="):
            refused()
    assert "a depth buffer alone" in repr(alone)
    assert "within" in repr(alone)
    assert "a depth buffer alone" in repr(hrt.prepare(alone, "paper"))


def test_what_the_mesh_lacks_is_counted_said_and_marked():
    scene, camera, drawn = view()
    dump = written(drawn, "linear", np.float32)
    box = np.s_[20:30, 40:60]
    dump[box] = 0.5  # something that is not in the mesh
    with pytest.warns(UserWarning, match=r"disagree in 3\.\d % of all pixels"):
        found = hrt.GBuffer.from_arrays(camera, dump, kind="linear", scene=scene)
    expected = np.ones(drawn.depth.shape, bool)
    expected[box] = False
    np.testing.assert_array_equal(found.matched, expected)
    np.testing.assert_allclose(found.depth[box], 0.1 / 0.5, rtol=1e-6)
    assert (found.uncertainty[box] > 0).all()
    assert (found.prim_id[box] >= 0).all()
    assert "200 pixels (3.3 %) not as in the scene" in repr(found)
    rays = hrt.mirror_rays(found)
    assert not (~expected)[rays.pixel[:, 1], rays.pixel[:, 0]].any()
    tracer = hrt.EmbreeTracer(scene)
    for name in hrt.TECHNIQUES:
        hits = hrt.trace_hybrid(rays, hrt.prepare(found, name), tracer).hits
        assert hits.prim_id.max() < len(scene)


def test_a_tracer_finds_what_the_mesh_has_behind_something():
    """As behind glass, or through the holes of leaves, which engines leave out of their depth."""
    scene, camera, drawn = view()
    pane = np.array([(-9, -9, 3), (9, -9, 3), (9, 9, 3), (-9, 9, 3)], float)
    n = len(scene.vertices)
    whole = hrt.Scene.from_arrays(
        np.vstack([scene.vertices, pane]),
        np.vstack([scene.faces, [(n, n + 1, n + 2), (n, n + 2, n + 3)]]),
    )
    dump = written(drawn, "standard", 24)
    options = arguments("standard", 24, None, "top")
    with pytest.raises(hrt.ArgumentError, match="depth: expected the depth buffer of scene"):
        hrt.GBuffer.from_arrays(camera, dump, scene=whole, **options)
    tracer = hrt.EmbreeTracer(whole)
    with pytest.warns(UserWarning, match="disagree"):  # the pane where the dump shows nothing
        found = hrt.GBuffer.from_arrays(camera, dump, tracer=tracer, **options)
    covered = drawn.prim_id >= 0
    assert (found.prim_id == drawn.prim_id)[covered].mean() > 0.995
    np.testing.assert_array_equal(found.matched[20:44, 20:76], covered[20:44, 20:76])


def test_background_can_be_another_value_or_a_mask():
    _, camera, drawn = view()
    dump = written(drawn, "linear", np.float32)
    empty = drawn.depth == 0
    expected = hrt.GBuffer.from_arrays(camera, dump, kind="linear")
    for value in (0.0, -1.0, np.nan):
        changed = np.where(empty, np.float32(value), dump)
        for background in (value, empty):
            found = hrt.GBuffer.from_arrays(camera, changed, kind="linear", background=background)
            np.testing.assert_array_equal(found.depth, expected.depth)


def bad(changes, **options):
    """Return arguments of a call that is wrong in one way."""
    _, camera, drawn = view()
    form = options.pop("form", np.float32)
    dump = written(drawn, options.get("kind", "linear"), form, options.get("far"))
    y, x = np.argwhere(drawn.depth > 0)[-1]
    return camera, changes(dump, (int(y), int(x))), options, f"column {x}, row {y}"


def put(value):
    def change(dump, place):
        dump = dump.copy()
        dump[place] = value
        return dump

    return change


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("value", [np.nan, -0.25, -np.inf])
def test_values_that_are_no_depth_are_named_with_their_pixel(kind, value):
    camera, dump, options, where = bad(put(value), kind=kind)
    with pytest.raises(hrt.ArgumentError) as caught:
        hrt.GBuffer.from_arrays(camera, dump, **options)
    assert f"got {np.float32(value)} at {where}" in str(caught.value)
    assert "(1 such pixels)" in str(caught.value)


@pytest.mark.parametrize(
    ("change", "options", "argument", "words"),
    [
        (put(1.5), {"kind": "standard"}, "depth", "from 0 to 1"),
        (put(60.1), {"kind": "linear", "far": 60.0}, "depth", "the far plane 60"),
        (put(0.09), {"kind": "linear"}, "depth", "the near plane 0.1"),
        (lambda d, p: d[:-1], {"kind": "linear"}, "depth", "shape (64, 96)"),
        (lambda d, p: d[..., None], {"kind": "linear"}, "depth", "shape (64, 96)"),
        (lambda d, p: d.tolist(), {"kind": "linear"}, "depth", "a NumPy array"),
        (lambda d, p: d.astype(np.int32), {"kind": "standard"}, "depth", "uint16 or uint32"),
        (lambda d, p: d > 1, {"kind": "standard"}, "depth", "uint16 or uint32"),
        (lambda d, p: d.astype(complex), {"kind": "standard"}, "depth", "uint16 or uint32"),
        (lambda d, p: np.ones(d.shape, np.uint16), {"kind": "linear"}, "depth", "floats"),
        (lambda d, p: d, {"kind": "inverse"}, "kind", "one of 'standard'"),
        (lambda d, p: d, {"kind": "linear", "origin": "left"}, "origin", "one of 'top'"),
        (lambda d, p: d, {"kind": "linear", "bits": 24}, "bits", "None for floats"),
        (lambda d, p: d, {"kind": "standard", "form": 24}, "bits", "24 or 32 for uint32"),
        (lambda d, p: d, {"kind": "standard", "form": 24, "bits": 33}, "bits", "<= 32"),
        (lambda d, p: d << 8, {"kind": "standard", "form": 24, "bits": 24}, "depth", "stencil"),
        (lambda d, p: d, {"kind": "linear", "far": 0.1}, "far", "> 0.1"),
        (lambda d, p: d, {"kind": "linear", "far": np.nan}, "far", "a finite number"),
        (lambda d, p: np.full_like(d, np.inf), {"kind": "linear"}, "depth", "background alone"),
        (lambda d, p: np.ones_like(d), {"kind": "standard"}, "depth", "background alone"),
        (lambda d, p: d, {"kind": "linear", "background": "0"}, "background", "a number"),
        (lambda d, p: d, {"kind": "linear", "background": np.ones(3, bool)}, "background", "shape"),
        (lambda d, p: d, {"kind": "linear", "scene": "s"}, "scene", "a Scene"),
        (lambda d, p: d, {"kind": "linear", "tracer": "t"}, "tracer", "a tracer"),
    ],
)
def test_what_cannot_be_a_depth_buffer_is_refused_by_name(change, options, argument, words):
    camera, dump, options, _ = bad(change, **options)
    with pytest.raises(hrt.ArgumentError) as caught:
        hrt.GBuffer.from_arrays(camera, dump, **options)
    assert caught.value.argument == argument
    assert words in str(caught.value)


@pytest.mark.parametrize("form", [np.float32, 24])
@pytest.mark.parametrize(("kind", "said"), [("standard", "reversed"), ("reversed", "standard")])
def test_the_other_kind_is_noticed_and_named(kind, said, form):
    # From a near plane well before all surfaces: a view as engines have them.
    _, camera, drawn = view()
    dump = written(drawn, kind, form)
    with pytest.raises(hrt.ArgumentError, match=f"is it kind '{kind}'"):
        hrt.GBuffer.from_arrays(camera, dump, **arguments(said, form, None, "top"))


@pytest.mark.parametrize("name", ["width", "upside down", "near", "tracer"])
def test_a_buffer_of_another_view_is_refused_by_the_mesh(name):
    scene, camera, drawn = view()
    dump = written(drawn, "linear", np.float32)
    options, words = {"scene": scene}, "the camera decide"
    if name == "width":
        camera = hrt.Camera.look_at((0, 0, -4), (0, 0, 0), width=96, height=64, near=0.1)
    elif name == "upside down":
        dump, words = dump[::-1].copy(), 'origin="bottom"'
    elif name == "near":
        dump = dump * np.float32(1.5)
    else:
        other = triangles(9, 10)
        options["tracer"], words = hrt.EmbreeTracer(other), "another scene"
    with pytest.raises(hrt.ArgumentError, match=words):
        hrt.GBuffer.from_arrays(camera, dump, kind="linear", **options)


def test_integers_of_any_byte_order_and_stride_are_the_same_buffer():
    _, camera, drawn = view()
    dump = written(drawn, "standard", 24, 60.0)
    options = arguments("standard", 24, 60.0, "top")
    expected = hrt.GBuffer.from_arrays(camera, dump, **options)
    wide = np.zeros((64, 192), np.uint32)
    wide[:, ::2] = dump
    for other in (dump.astype(">u4"), wide[:, ::2], np.asfortranarray(dump)):
        found = hrt.GBuffer.from_arrays(camera, other, **options)
        np.testing.assert_array_equal(found.depth, expected.depth)


@pytest.mark.parametrize(
    ("field", "value"),
    [("uncertainty", -1.0), ("uncertainty", np.nan), ("uncertainty", np.zeros(3)), ("matched", 1)],
)
def test_what_is_said_of_doubts_is_checked(field, value):
    scene, camera, drawn = view()
    image = value if isinstance(value, np.ndarray) else np.full(drawn.depth.shape, value)
    with pytest.raises(hrt.ArgumentError) as caught:
        hrt.GBuffer(
            drawn.depth, drawn.ddx, drawn.ddy, drawn.prim_id, scene, camera, **{field: image}
        )
    assert caught.value.argument == field
