"""What a user sees and takes away: `repr`s, tables, scenes of trimesh."""

import dataclasses
import subprocess
import sys

import numpy as np
import pytest
import trimesh

import hybrid_rt as hrt


@pytest.fixture
def scene():
    corners = np.array([(-4, 0, -4), (4, 0, -4), (4, 0, 4), (-4, 0, 4)], np.float32)
    return hrt.Scene.from_arrays(corners, [(0, 1, 2), (0, 2, 3)], name="floor")


@pytest.fixture
def gbuffer(scene):
    return hrt.rasterize(scene, hrt.Camera.look_at((0, 2, 3), (0, 0, 0), width=32, height=24))


def test_records_say_what_they_are_in_one_line(scene, gbuffer):
    rays = hrt.mirror_rays(gbuffer)
    covered = 100 * len(rays) / (32 * 24)
    assert repr(scene) == "<Scene 'floor': 2 triangles, 4 vertices>"
    assert repr(gbuffer) == f"<GBuffer of 'floor': 32 x 24 pixels, {covered:.1f} % covered>"
    assert repr(rays) == f"<Rays: {len(rays)} of 'floor', 32 x 24 pixels>"
    assert repr(rays.detached()) == f"<Rays: {len(rays)}>"
    assert repr(gbuffer.camera) == (
        "<Camera at (0 2 3) along (0 -0.5547 -0.8321): 32 x 24 pixels, 60 degrees high, near 0.05>"
    )


def test_answers_count_their_hits(scene, gbuffer):
    rays = hrt.mirror_rays(gbuffer)
    hits = hrt.EmbreeTracer(scene).intersect(hrt.primary_rays(gbuffer.camera))
    assert repr(hits) == f"<Hits of 768 rays: {len(rays)} hit>"
    marched = hrt.march(rays, hrt.prepare(gbuffer, "certified"))
    hit = int((marched.resolved & (marched.prim_id >= 0)).sum())
    miss = int(marched.resolved.sum()) - hit
    assert repr(marched) == (f"<Marched: {len(rays)} rays, {hit} hits and {miss} misses resolved>")


def test_hits_become_a_table_of_their_own(scene):
    rays = hrt.Rays.from_arrays([(1, 3, 0), (9, 3, 0)], [(0, -1, 0)] * 2)
    hits = hrt.EmbreeTracer(scene).intersect(rays)
    table = hits.to_pandas()
    assert list(table) == ["t", "prim_id", "u", "v", "n_g_x", "n_g_y", "n_g_z"]
    assert table["t"].tolist() == [3.0, np.inf]
    assert table["prim_id"].tolist() == hits.prim_id.tolist()
    assert table["prim_id"].dtype == np.int32
    np.testing.assert_array_equal(table[["n_g_x", "n_g_y", "n_g_z"]], hits.n_g)
    table.loc[0, "t"] = 7.0
    assert hits.t[0] == 3.0
    assert len(hrt.Hits.empty(0).to_pandas()) == 0


def test_pandas_comes_with_the_first_table_only():
    program = (
        "import sys, hybrid_rt as hrt; hits = hrt.Hits.empty(3);"
        "before = 'pandas' in sys.modules; hits.to_pandas();"
        "print(before, 'pandas' in sys.modules)"
    )
    ran = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert ran.stdout.split() == ["False", "True"], ran.stderr


def test_a_trimesh_becomes_a_scene():
    box = trimesh.creation.box((1, 2, 3))
    scene = hrt.Scene.from_trimesh(box, name="box")
    assert scene.name == "box"
    np.testing.assert_array_equal(scene.vertices, box.vertices.astype(np.float32))
    np.testing.assert_array_equal(scene.faces, box.faces)


def test_a_scene_of_trimesh_is_placed_by_its_graph_and_its_objects_stay_apart():
    whole = trimesh.Scene()
    box = trimesh.creation.box()
    whole.add_geometry(box)
    whole.add_geometry(box, transform=trimesh.transformations.translation_matrix((5, 0, 0)))
    whole.add_geometry(trimesh.PointCloud([(100.0, 0, 0)]))
    scene = hrt.Scene.from_trimesh(whole)
    assert len(scene) == 24
    np.testing.assert_array_equal(scene.bounds, [(-0.5, -0.5, -0.5), (5.5, 0.5, 0.5)])
    assert len(np.unique(scene.object_id)) == 2


@pytest.mark.parametrize("junk", [None, 3, np.zeros((3, 3)), trimesh.Scene(), {"faces": 1}])
def test_what_is_no_trimesh_is_refused(junk):
    with pytest.raises(hrt.ArgumentError, match="mesh_or_scene"):
        hrt.Scene.from_trimesh(junk)


def test_a_trimesh_with_bad_indices_is_refused():
    bad = dataclasses.make_dataclass("Bad", ["vertices", "faces"])(np.eye(3), [(0, 1, 7)])
    with pytest.raises(hrt.ArgumentError, match="faces"):
        hrt.Scene.from_trimesh(bad)
