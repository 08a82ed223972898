"""What tests of mesh files have in common."""

import numpy as np
import pytest

import hybrid_rt as hrt


def area(mesh):
    """Return the area of a mesh."""
    t = mesh.vertices[mesh.faces].astype(float)
    return np.linalg.norm(np.cross(t[:, 1] - t[:, 0], t[:, 2] - t[:, 0]), axis=1).sum() / 2


def triangles(mesh):
    """Return the corners of a mesh as lists."""
    return mesh.vertices[mesh.faces].tolist()


def refused(path, *words):
    """Check that a file is refused by a reader that knows why, with some words."""
    with pytest.raises(hrt.MeshFileError) as caught:
        hrt.read_mesh(path)
    text = str(caught.value)
    assert path.name in text
    assert "no check foresaw" not in text, text
    for word in words:
        assert word in text, text
