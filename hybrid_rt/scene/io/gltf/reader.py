"""The geometry of glTF 2.0 files.

A thin reader of our own. trimesh loses sparse accessors, skins, morph weights, meshes below
cameras and required extensions; pygltflib and gltflib give the JSON and leave all of that to
others. What the specification says of geometry is little, and each part has a module here.

Read: .gltf and .glb, buffers inside of the file, beside it and in data: uris; all accessors
(sparse, interleaved, normalised, without a buffer view); triangles, strips and fans; the default
scene with all transforms; meshes, morphed by their weights, skinned in the pose of the nodes;
KHR_mesh_quantization, EXT_mesh_gpu_instancing, KHR_node_visibility, and with the extras ``draco``
and ``meshopt`` KHR_draco_mesh_compression and EXT_meshopt_compression. Left out: points and lines.
Not played: animations. Refused: other extensions that a file requires.

Each primitive of each instance is an object. A mirrored instance keeps the order of its corners.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from hybrid_rt.scene.io.fault import Budget, FormatError
from hybrid_rt.scene.io.gltf.accessors import Arrays
from hybrid_rt.scene.io.gltf.container import open_file
from hybrid_rt.scene.io.gltf.nodes import Nodes, compose
from hybrid_rt.scene.io.gltf.primitives import Shape, read_mesh
from hybrid_rt.scene.io.gltf.skin import posed
from hybrid_rt.scene.io.gltf.tree import At
from hybrid_rt.scene.io.parts import Triangles
from hybrid_rt.scene.io.words import F64

_INSTANCING = "EXT_mesh_gpu_instancing"


def read(path: Path, data: bytes, budget: Budget) -> Triangles:
    """Return the triangles of the default scene of a glTF file."""
    tree, binary = open_file(path, data)
    arrays = Arrays(path, tree, binary, budget)
    nodes = Nodes(tree)
    meshes, skins = tree.all("meshes"), tree.all("skins")
    shapes: dict[tuple[int, str, bool], Shape] = {}
    vertices, faces, counts = [], [], []
    skipped: set[str] = set()
    start = 0
    for k in nodes.shown():
        node = nodes.nodes[k]
        mesh, skin, weights = (node.get(key) for key in ("mesh", "skin", "weights"))
        if mesh is None:
            continue
        key = (mesh.index(meshes), "" if weights is None else node.place, skin is not None)
        if key not in shapes:
            shapes[key] = read_mesh(arrays, meshes[key[0]], weights, skin is not None)
        shape = shapes[key]
        skipped |= shape.skipped
        for world in _placed(arrays, nodes, k, shape, None if skin is None else (skin, skins)):
            budget.spend(world.nbytes + shape.faces.nbytes, node.place)
            vertices.append(world)
            faces.append(shape.faces + start)
            counts.extend(shape.counts)
            start += len(world)
    words = " and ".join(sorted(skipped))
    if sum(counts) == 0:
        raise FormatError(f"no triangles in its default scene{f', only {words}' if words else ''}")
    occupied = [n for n in counts if n]
    object_id = np.repeat(np.arange(len(occupied)), occupied)
    return Triangles(np.concatenate(vertices), np.concatenate(faces), object_id, skipped=words)


def _placed(
    arrays: Arrays, nodes: Nodes, k: int, shape: Shape, skinned: tuple[At, list[At]] | None
) -> list[F64]:
    """Return the vertices of each instance that a node makes of its mesh, world."""
    node = nodes.nodes[k]
    many = node.extension(_INSTANCING)
    if len(shape.faces) == 0:
        return []
    if skinned is not None:
        skin, skins = skinned
        if many is not None:
            raise many.fault("instances of a skinned mesh cannot be read")
        return [posed(arrays, nodes, skins[skin.index(skins)], shape)]
    matrices = nodes.world(k)[None]
    if many is not None:
        matrices = matrices @ _instances(arrays, many)
    return [shape.vertices @ m[:3, :3].T + m[:3, 3] for m in matrices]


def _instances(arrays: Arrays, many: At) -> F64:
    """Return the (N, 4, 4) matrices of EXT_mesh_gpu_instancing."""
    attributes = many.need("attributes")
    parts = []
    for name, kind in (("TRANSLATION", "VEC3"), ("ROTATION", "VEC4"), ("SCALE", "VEC3")):
        place = attributes.get(name)
        parts.append(None if place is None else arrays.floats(place, kind))
    lengths = {arrays.count(attributes.need(name)) for name in attributes.keys()}  # noqa: SIM118
    if len(lengths) != 1:
        raise attributes.fault("expected attributes of one count")
    n = lengths.pop()
    move, turn, size = parts
    return compose(
        np.zeros((n, 3)) if move is None else move,
        np.tile([0.0, 0, 0, 1], (n, 1)) if turn is None else turn,
        np.ones((n, 3)) if size is None else size,
        many,
    )
