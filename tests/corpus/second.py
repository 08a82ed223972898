"""Read one mesh file by another reader, in a process of its own.

Run ``python second.py READER FILE``: prints triangles, area and bounds as JSON, or an error.
Nothing of the project is imported here. Readers written in C++ may end the process: so be it.
"""

import json
import sys
import warnings

import numpy as np


def by_trimesh(path):
    """Return world triangles as trimesh reads them."""
    import trimesh

    scene = trimesh.load_scene(path, process=False, skip_materials=True)
    parts = []
    for node in scene.graph.nodes_geometry:
        matrix, name = scene.graph[node]
        geometry = scene.geometry[name]
        if isinstance(geometry, trimesh.Trimesh):
            world = np.asarray(geometry.vertices, float) @ matrix[:3, :3].T + matrix[:3, 3]
            parts.append(world[geometry.faces])
    return np.concatenate(parts)


def by_assimp(path):
    """Return world triangles as Open Asset Import Library reads them."""
    import assimp_py as assimp

    flags = assimp.Process_Triangulate | assimp.Process_SortByPType
    scene = assimp.import_file(path, flags | assimp.Process_PreTransformVertices)
    parts = []
    for mesh in scene.meshes:
        if mesh.num_faces * 3 == mesh.num_indices:
            vertices = np.asarray(mesh.vertices, float).reshape(-1, 3)
            parts.append(vertices[np.asarray(mesh.indices, np.int64).reshape(-1, 3)])
    return np.concatenate(parts)


def by_meshio(path):
    """Return triangles as meshio reads them; polygons are out."""
    import meshio

    mesh = meshio.read(path)
    faces = [np.asarray(block.data) for block in mesh.cells if block.type == "triangle"]
    faces += [np.asarray(b.data)[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3) for b in mesh.cells
              if b.type == "quad"]  # fmt: skip
    others = {block.type for block in mesh.cells} - {"triangle", "quad", "line", "vertex"}
    if others:
        raise ValueError(f"it has {others}")
    return np.asarray(mesh.points, float)[:, :3][np.concatenate(faces)]


READERS = {"trimesh": by_trimesh, "assimp": by_assimp, "meshio": by_meshio}


def measured(triangles):
    """Return what is compared."""
    triangles = np.asarray(triangles, np.float32).astype(float)
    cross = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    low, high = triangles.min(axis=(0, 1)), triangles.max(axis=(0, 1))
    area = float(np.linalg.norm(cross, axis=1).sum() / 2)
    return {"triangles": len(triangles), "area": area, "bounds": [*low.tolist(), *high.tolist()]}


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    try:
        found = measured(READERS[sys.argv[1]](sys.argv[2]))
    except Exception as error:
        found = {"error": f"{type(error).__name__}: {error}"[:200]}
    print(json.dumps(found))
