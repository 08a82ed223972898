"""A writer of small glTF files that shares nothing with the reader."""

import base64
import json
import struct

import numpy as np

TYPES = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}
KINDS = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}
SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], "<f4")
HALVES = np.array([0, 1, 2, 0, 2, 3], "<u2")


class Gltf:
    """A file in the making: `tree` may be changed at will before it is written."""

    def __init__(self):
        self.blob = b""
        self.tree = {
            "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": []}], "nodes": [],
            "meshes": [], "accessors": [], "bufferViews": [],
        }  # fmt: skip

    def add(self, kind, **item):
        """Append to one of the tree's arrays; return its index."""
        self.tree.setdefault(kind, []).append(item)
        return len(self.tree[kind]) - 1

    def view(self, data, **more):
        """Append bytes, at a multiple of four."""
        self.blob += b"\0" * (-len(self.blob) % 4)
        begin = len(self.blob)
        self.blob += bytes(data)
        return self.add("bufferViews", buffer=0, byteOffset=begin, byteLength=len(data), **more)

    def accessor(self, array, **more):
        """Append an array (N,) or (N, width)."""
        array = np.asarray(array)
        rows = array.reshape(len(array), -1)
        return self.add(
            "accessors", bufferView=self.view(array.tobytes()), count=len(array),
            componentType=TYPES[array.dtype.str[1:]], type=KINDS[rows.shape[1]], **more,
        )  # fmt: skip

    def mesh(self, positions=SQUARE, indices=HALVES, attributes=None, **more):
        """Append a mesh of one primitive; arrays become accessors."""
        named = {"POSITION": positions, **(attributes or {})}
        named = {k: v if isinstance(v, int) else self.accessor(v) for k, v in named.items()}
        primitive = {"attributes": named, **more}
        if indices is not None:
            primitive["indices"] = self.accessor(indices)
        return self.add("meshes", primitives=[primitive])

    def node(self, root=True, **node):
        """Append a node, to the scene too if it is a root."""
        k = self.add("nodes", **node)
        if root:
            self.tree["scenes"][0]["nodes"].append(k)
        return k

    def primitive(self, mesh=0):
        """Return the first primitive of a mesh."""
        return self.tree["meshes"][mesh]["primitives"][0]

    def write(self, path):
        """Write .glb, or .gltf with a data: uri."""
        tree = dict(self.tree)
        if path.suffix == ".gltf":
            uri = "data:application/octet-stream;base64," + base64.b64encode(self.blob).decode()
            if self.blob:
                tree.setdefault("buffers", [{"byteLength": len(self.blob), "uri": uri}])
            path.write_text(json.dumps(tree))
            return path
        if self.blob:
            tree.setdefault("buffers", [{"byteLength": len(self.blob)}])
        text = json.dumps(tree).encode()
        text += b" " * (-len(text) % 4)
        blob = self.blob + b"\0" * (-len(self.blob) % 4)
        chunks = struct.pack("<I4s", len(text), b"JSON") + text
        if blob:
            chunks += struct.pack("<I4s", len(blob), b"BIN\0") + blob
        path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks)
        return path
