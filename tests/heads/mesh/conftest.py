"""The built-in head's own skin as a mesh without shapes, and itself laid over it exactly."""

import numpy as np
import pytest

from bakery.heads.mesh.pose import Seen, shape_of
from bakery.heads.mesh.read import Surface
from bakery.heads.mesh.register import FLESH, Laid


@pytest.fixture(scope="session")
def skin(head):
    """Skin, eye sockets and mouth cavity of the built-in head with its uv: Surface."""
    whole = Surface(head.mean.astype(float), head.faces, head.uv.astype(float), head.uv_faces)
    return whole.take(head.part_faces(*FLESH))


@pytest.fixture(scope="session")
def numbers(head):
    """Vertices of the built-in head that `skin` has, in its order."""
    return np.unique(head.faces[head.part_faces(*FLESH)])


@pytest.fixture(scope="session")
def laid(head):
    """The built-in head on itself."""
    there = np.isin(np.arange(len(head.mean)), head.part_vertices(*FLESH))
    away = np.where(there, 0.0, np.inf)
    return Laid(head, head.mean.astype(float), 1.0, np.eye(3), there, away)


@pytest.fixture(scope="session")
def known():
    """A function (head, scale, turn) -> what `look` would find, if it were never off."""

    def seen(head, scale=1.0, turn=None):
        turn = np.eye(3) if turn is None else turn
        return Seen(scale * shape_of(head) @ turn.T, np.ones(468), "known")

    return seen


@pytest.fixture(scope="session")
def export():
    """A function (path, Surface, with_uv) that writes a surface with trimesh."""
    import trimesh
    from trimesh.visual.texture import TextureVisuals

    def write(path, surface, with_uv=False):
        vertices, faces, visual = surface.vertices, surface.faces, None
        if with_uv:
            keys = np.stack([surface.faces.ravel(), surface.uv_faces.ravel()], 1)
            keys, faces = np.unique(keys, axis=0, return_inverse=True)
            vertices, faces = vertices[keys[:, 0]], faces.reshape(-1, 3)
            visual = TextureVisuals(uv=surface.uv[keys[:, 1]] * [1, -1] + [0, 1])
        trimesh.Trimesh(vertices, faces, process=False, visual=visual).export(path)
        return path

    return write
