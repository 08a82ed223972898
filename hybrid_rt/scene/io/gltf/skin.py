"""Skins of a glTF file, in the pose that the file's nodes have."""

from __future__ import annotations

import numpy as np

from hybrid_rt.scene.io.gltf.accessors import Arrays
from hybrid_rt.scene.io.gltf.nodes import Nodes
from hybrid_rt.scene.io.gltf.primitives import Shape
from hybrid_rt.scene.io.gltf.tree import At
from hybrid_rt.scene.io.words import F64

_ONE = 0.05  # how far from 1 the weights of a vertex may sum; they are scaled to 1
_BLOCK = 1 << 16


def posed(arrays: Arrays, nodes: Nodes, skin: At, shape: Shape) -> F64:
    """Return the vertices of a skinned mesh, world; its own node's transform has no part in it."""
    joints = skin.need("joints").items()
    matrices = np.stack([nodes.world(joint.index(nodes.nodes)) for joint in joints])
    inverse = skin.get("inverseBindMatrices")
    if inverse is not None:
        binds = arrays.floats(inverse, "MAT4").reshape(-1, 4, 4).swapaxes(1, 2)
        if len(binds) < len(joints):
            raise inverse.fault(f"{len(binds)} matrices of {len(joints)} joints")
        matrices = matrices @ binds[: len(joints)]
    if not np.allclose(matrices[:, 3], (0, 0, 0, 1), rtol=0, atol=1e-5):
        raise skin.fault("inverseBindMatrices that are not affine")
    assert shape.joints is not None
    assert shape.weights is not None
    which = np.where(shape.weights == 0, 0, shape.joints)
    if which.size and not 0 <= which.min() <= which.max() < len(joints):
        raise skin.fault(f"a vertex is moved by joint {which.max()} of {len(joints)}")
    total = shape.weights.sum(axis=1)
    bad = ~((np.abs(total - 1) <= _ONE) & (shape.weights >= 0).all(axis=1))
    if bad.any():
        k = int(np.argmax(bad))
        raise skin.fault(f"weights of a vertex sum to {total[k]:g}, expected 1")
    weights = shape.weights / total[:, None]
    out = np.empty_like(shape.vertices)
    for begin in range(0, len(out), _BLOCK):
        some = slice(begin, begin + _BLOCK)
        blend = np.einsum("vk,vkij->vij", weights[some], matrices[which[some], :3])
        out[some] = np.einsum("vij,vj->vi", blend[..., :3], shape.vertices[some]) + blend[..., 3]
    return out
