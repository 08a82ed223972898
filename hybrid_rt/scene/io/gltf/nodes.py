"""The nodes of a glTF file: which are shown, and where they stand."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from hybrid_rt.scene.io.gltf.tree import At
from hybrid_rt.scene.io.words import F64

_UNIT = 1e-2  # how far from 1 the length of a rotation may be: what 8 bits round it by


class Nodes:
    """The trees that the nodes of a file form, checked: every node has one parent at most.

    Parameters
    ----------
    tree : At
    """

    def __init__(self, tree: At) -> None:
        self.nodes = tree.all("nodes")
        self._tree = tree
        self._parent = [-1] * len(self.nodes)
        self._children: list[list[int]] = []
        self._world: dict[int, F64] = {}
        for k, node in enumerate(self.nodes):
            self._children.append([child.index(self.nodes) for child in node.all("children")])
            for child in self._children[-1]:
                if self._parent[child] >= 0:
                    raise node.fault(f"its child {child} is a child of {self._parent[child]} too")
                self._parent[child] = k
        self._check_for_cycles()

    def _check_for_cycles(self) -> None:
        ends = [False] * len(self.nodes)
        for k in range(len(self.nodes)):
            path, at = [], k
            while at >= 0 and not ends[at]:
                path.append(at)
                ends[at] = True
                at = self._parent[at]
            if at >= 0 and at in path:
                raise self.nodes[at].fault("a cycle: the node is below itself")

    def shown(self) -> Iterator[int]:
        """Yield the nodes of the default scene, each before its children, in the file's order.

        The default scene is the one that the file names, else its first; a file without scenes is
        shown whole. What KHR_node_visibility hides is left out.
        """
        scenes = self._tree.all("scenes")
        if scenes:
            named = self._tree.get("scene")
            scene = scenes[0 if named is None else named.index(scenes)]
            roots = [root.index(self.nodes) for root in scene.all("nodes")]
            for root in roots:
                if self._parent[root] >= 0:
                    raise scene.fault(f"node {root} is below node {self._parent[root]}, no root")
            if len(set(roots)) < len(roots):
                raise scene.fault("a node is listed twice")
        else:
            roots = [k for k, parent in enumerate(self._parent) if parent < 0]
        waiting = roots[::-1]
        while waiting:
            k = waiting.pop()
            hidden = self.nodes[k].extension("KHR_node_visibility")
            visible = None if hidden is None else hidden.get("visible")
            if visible is not None and not visible.flag():
                continue
            yield k
            waiting.extend(self._children[k][::-1])

    def world(self, k: int) -> F64:
        """Return the (4, 4) float64 matrix from a node to the world."""
        path = []
        while k >= 0 and k not in self._world:
            path.append(k)
            k = self._parent[k]
        matrix: F64 = self._world[k] if k >= 0 else np.eye(4)
        for below in reversed(path):
            matrix = matrix @ _local(self.nodes[below])
            self._world[below] = matrix
        return matrix


def _local(node: At) -> F64:
    given = node.get("matrix")
    parts = {key: node.get(key) for key in ("translation", "rotation", "scale")}
    if given is not None:
        matrix: F64 = np.array(given.numbers(16)).reshape(4, 4).T
        if any(part is not None for part in parts.values()):
            raise node.fault("a matrix beside translation, rotation or scale")
        if (matrix[3] != (0, 0, 0, 1)).any():
            raise given.fault("not affine: its last row is not 0 0 0 1")
        return matrix
    move, turn, size = parts.values()
    local: F64 = compose(
        np.array([[0.0, 0, 0] if move is None else move.numbers(3)]),
        np.array([[0.0, 0, 0, 1] if turn is None else turn.numbers(4)]),
        np.array([[1.0, 1, 1] if size is None else size.numbers(3)]),
        node,
    )[0]
    return local


def compose(move: F64, turn: F64, size: F64, place: At) -> F64:
    """Return (N, 4, 4) matrices of translations, rotations (x, y, z, w) and scales."""
    length = np.linalg.norm(turn, axis=1)
    bad = ~(np.abs(length - 1) <= _UNIT)
    if bad.any():
        raise place.fault(f"a rotation of length {length[np.argmax(bad)]:g}, expected 1")
    x, y, z, w = (turn / length[:, None]).T
    matrix: F64 = np.zeros((len(move), 4, 4))
    matrix[:, 0, 0] = 1 - 2 * (y * y + z * z)
    matrix[:, 0, 1] = 2 * (x * y - z * w)
    matrix[:, 0, 2] = 2 * (x * z + y * w)
    matrix[:, 1, 0] = 2 * (x * y + z * w)
    matrix[:, 1, 1] = 1 - 2 * (x * x + z * z)
    matrix[:, 1, 2] = 2 * (y * z - x * w)
    matrix[:, 2, 0] = 2 * (x * z - y * w)
    matrix[:, 2, 1] = 2 * (y * z + x * w)
    matrix[:, 2, 2] = 1 - 2 * (x * x + y * y)
    matrix[:, :3, :3] *= size[:, None, :]
    matrix[:, :3, 3] = move
    matrix[:, 3, 3] = 1
    return matrix
