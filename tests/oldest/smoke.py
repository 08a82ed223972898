"""Each part of the project once, where it stands on its dependencies. Run by ``oldest.py``."""

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import trimesh

import hybrid_rt as hrt

BIN = Path(sys.executable).parent


def check_meshes(folder):
    """Read every kind of mesh file, and refuse one that points out of its folder."""
    ball = trimesh.creation.icosphere(subdivisions=2)
    for kind in ("obj", "ply", "glb", "stl"):
        ball.export(folder / f"ball.{kind}")
    (folder / "ascii.stl").write_text(trimesh.exchange.stl.export_stl_ascii(ball))
    (folder / "ascii.ply").write_bytes(trimesh.exchange.ply.export_ply(ball, encoding="ascii"))
    for name, data in trimesh.exchange.gltf.export_gltf(trimesh.Scene(ball)).items():
        (folder / name).write_bytes(data)
    np.savez(folder / "ball.npz", vertices=ball.vertices, faces=ball.faces)
    names = ("obj", "ply", "glb", "stl", "npz")
    for name in (*(f"ball.{kind}" for kind in names), "ascii.stl", "ascii.ply", "model.gltf"):
        assert len(hrt.load_scene(folder / name)) == len(ball.faces), name
    corners = ["0 0", "4 0", "4 1", "1 1", "1 4", "0 4"]
    lines = [f"v {corner} 0" for corner in corners] + ["f 2 3 4 5 6 1"]
    (folder / "concave.obj").write_text("\n".join(lines))
    assert len(hrt.load_scene(folder / "concave.obj")) == 4
    outside = folder / "outside.bin"
    outside.write_bytes(bytes(36))
    inner = folder / "inner"
    inner.mkdir()
    for uri in ("../outside.bin", str(outside)):
        view = {"buffer": 0, "byteLength": 36}
        accessor = {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}
        (inner / "a.gltf").write_text(
            json.dumps(
                {
                    "asset": {"version": "2.0"},
                    "buffers": [{"byteLength": 36, "uri": uri}],
                    "bufferViews": [view],
                    "accessors": [accessor],
                    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
                    "nodes": [{"mesh": 0}],
                    "scenes": [{"nodes": [0]}],
                    "scene": 0,
                }
            )
        )
        try:
            hrt.load_scene(inner / "a.gltf")
        except hrt.MeshFileError:
            continue
        raise AssertionError(f"{uri} was read")


def check_rays():
    """Rasterize, march with every technique, trace and judge."""
    ball = trimesh.creation.icosphere(subdivisions=3)
    floor = trimesh.creation.box(
        (6, 0.1, 6), trimesh.transformations.translation_matrix((0, -1, 0))
    )
    both = trimesh.util.concatenate([ball, floor])
    scene = hrt.Scene.from_arrays(both.vertices, both.faces)
    camera = hrt.Camera.look_at((0, 2, 5), (0, 0, 0), width=64, height=48)
    gbuffer = hrt.rasterize(scene, camera)
    rays = hrt.mirror_rays(gbuffer)
    tracer = hrt.EmbreeTracer(scene)
    hits = tracer.intersect(rays)
    for name in hrt.TECHNIQUES:
        screen = hrt.prepare(gbuffer, name)
        assert hrt.march(rays, screen).resolved.any(), name
        result = hrt.trace_hybrid(rays, screen, tracer)
        judged = hrt.judge(
            rays, result.hits, result.resolved, hits, scene, camera, pixel=result.pixel
        )
        if hrt.TECHNIQUES[name].certified:
            assert (result.hits.prim_id == hits.prim_id).all(), name
        assert len(judged) == len(rays)


def command(*words):
    """Run the command line as installed."""
    subprocess.run([BIN / "hybrid-rt", *words], check=True, stdout=subprocess.DEVNULL)


def main():
    """Run all, or with --quick what compiles nothing."""
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        check_meshes(folder)
        command("--help")
        command("run", "--help")
        command("list")
        if "--quick" not in sys.argv[1:]:
            check_rays()
            command(
                "run", "paper", "--quick", "--scenes", "sphere", "--cameras", "front",
                "--resolutions", "160x90", "--rounds", "2", "--out", str(folder / "runs"),
            )  # fmt: skip
            (run,) = (folder / "runs").iterdir()
            command("report", str(run))
            os.environ["HYBRID_RT_DATA"] = str(folder / "data")
            command("import", str(folder / "ball.obj"))
            command("list")
    print("the oldest dependencies do")


if __name__ == "__main__":
    main()
