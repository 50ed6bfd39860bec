"""A mesh from a file: OBJ, PLY, GLB or glTF, checked before anything is made of it."""

import logging
import warnings
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from bakery.errors import InputError
from bakery.geometry.mesh import face_normals
from bakery.heads.mesh.claims import check_claims, without_pictures

log = logging.getLogger(__name__)
KINDS = (".obj", ".ply", ".glb", ".gltf")
LARGEST_FILE = 400 * 2**20  # bytes; an OBJ of 2 million faces has about 200 MiB
MOST_FACES = 2_000_000
LEAST_FACES = 500  # a head with fewer has no lids and lips
FLAT = 1e-10  # share of the size squared: a face with less area is a line or a point


@dataclass(frozen=True)
class Surface:
    """Triangles as they stand in a file, in its own unit and axes."""

    vertices: np.ndarray  # [V, 3] float64
    faces: np.ndarray  # [F, 3] int, counter-clockwise seen from outside
    uv: np.ndarray | None = None  # [U, 2] origin top left
    uv_faces: np.ndarray | None = None  # [F, 3] int into uv

    def take(self, kept):
        """The surface of some faces alone; vertices and uv that none of them uses go."""
        used, faces = np.unique(self.faces[kept], return_inverse=True)
        out = replace(self, vertices=self.vertices[used], faces=faces.reshape(-1, 3))
        if self.uv is None:
            return out
        used, faces = np.unique(self.uv_faces[kept], return_inverse=True)
        return replace(out, uv=self.uv[used], uv_faces=faces.reshape(-1, 3))


def read_surface(path):
    """Read the triangles of a mesh file; vertices that the file keeps twice along a seam are one.

    Args:
        path: .obj, .ply, .glb or .gltf; a scene of several meshes is taken as one.

    Returns:
        Surface.

    Raises:
        InputError: not such a file; damaged; no, too few or too many faces; numbers that are not finite.
    """
    vertices, faces, uv = _load(Path(path))
    if not len(faces):
        raise InputError(f"{path}: holds no faces; a mesh of triangles or quads is needed")
    if len(faces) > MOST_FACES:
        raise InputError(
            f"{path}: {len(faces):,} triangles, at most {MOST_FACES:,} are taken; decimate it first"
        )
    if faces.min() < 0 or faces.max() >= len(vertices):
        raise InputError(f"{path}: faces name vertices that are not there; export the mesh again")
    if not np.isfinite(vertices[faces]).all():
        raise InputError(f"{path}: has coordinates that are not finite; export the mesh again")
    used, small = np.unique(faces, return_inverse=True)
    vertices, faces = vertices[used], small.reshape(-1, 3)
    uv = None if uv is None or not np.isfinite(uv[used]).all() else uv[used]
    size = np.ptp(vertices, axis=0).max()
    if not 1e-6 < size < 1e9:
        raise InputError(f"{path}: {size:.3g} units large; a head in m, cm or mm is needed")
    # Far from the origin or in a tiny unit, products of coordinates would lose their digits.
    middle = (vertices.min(0) + vertices.max(0)) / 2
    area = np.linalg.norm(face_normals((vertices - middle) / size, faces), axis=1)
    welded = weld(vertices, faces)
    kept = (area > FLAT) & (welded != np.roll(welded, 1, axis=1)).all(1)
    if dropped := int((~kept).sum()):
        log.info("%s: %d faces without area left out", path, dropped)
    if kept.sum() < LEAST_FACES:
        raise InputError(
            f"{path}: {int(kept.sum())} triangles with an area, a head needs {LEAST_FACES} or more"
        )
    return Surface(vertices, welded, uv, None if uv is None else faces).take(kept)


def _load(path):
    """Vertices [V, 3], faces [F, 3] and uv [V, 2] or None (origin top left) of a file."""
    import trimesh

    if path.suffix.lower() not in KINDS:
        raise InputError(f"{path}: no {', '.join(kind[1:] for kind in KINDS)}; convert it to one")
    if not path.is_file():
        raise InputError(f"{path}: no such file")
    if path.stat().st_size > LARGEST_FILE:
        raise InputError(
            f"{path}: {path.stat().st_size / 2**20:.0f} MiB, at most "
            f"{LARGEST_FILE / 2**20:.0f} are read; decimate the mesh first"
        )
    try:
        check_claims(path, MOST_FACES, LARGEST_FILE)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of overflow: what comes out is looked at
            if (kind := path.suffix.lower()) in (".glb", ".gltf"):
                beside = trimesh.resolvers.FilePathResolver(str(path))
                with without_pictures(path) as file:
                    scene = trimesh.load_scene(
                        file, file_type=kind[1:], resolver=beside, process=False
                    )
            else:
                scene = trimesh.load_scene(str(path), process=False, skip_materials=True)
            meshes = [m for m in scene.dump() if isinstance(m, trimesh.Trimesh) and len(m.faces)]
            vertices = [np.asarray(m.vertices, np.float64).reshape(-1, 3) for m in meshes]
            faces = [np.asarray(m.faces, np.int64).reshape(-1, 3) for m in meshes]
            uvs = [getattr(m.visual, "uv", None) for m in meshes]
    except InputError:
        raise
    except Exception as error:  # trimesh lets through whatever its readers stumble over
        what = " ".join(str(error).split())[:120] or type(error).__name__
        raise InputError(f"{path}: not a readable mesh ({what}); export it again") from error
    if not meshes:
        return np.zeros((0, 3)), np.zeros((0, 3), int), None
    start = np.cumsum([0] + [len(v) for v in vertices])
    uv = None
    if all(u is not None and len(u) == len(v) for u, v in zip(uvs, vertices)):
        uv = np.concatenate([np.asarray(u, np.float64)[:, :2] for u in uvs]) * [1, -1] + [0, 1]
    return np.concatenate(vertices), np.concatenate([f + n for f, n in zip(faces, start)]), uv


def weld(vertices, faces):
    """Faces [F, 3] in which the vertices that a seam of uv or normals keeps twice are one.

    Only what meets along two borders that run against each other is joined: a lash that stands on a
    lid at the same place stays apart from it.
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    place = np.unique(vertices, axis=0, return_inverse=True)[1].ravel()
    V = len(vertices)
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]).astype(np.int64)
    forth, back = edges[:, 0] * V + edges[:, 1], edges[:, 1] * V + edges[:, 0]
    border = edges[~np.isin(forth, back)]
    a, b = place[border].T.astype(np.int64)
    forth, back = a * V + b, b * V + a
    # A place that several borders run through says nothing about which of them belong together.
    key, first, count = np.unique(forth, return_index=True, return_counts=True)
    key, first = key[count == 1], first[count == 1]
    at = np.minimum(np.searchsorted(key, back), max(len(key) - 1, 0))
    met = np.flatnonzero(key[at] == back) if len(key) else np.zeros(0, int)
    met = met[np.isin(forth[met], key)]
    other = border[first[at[met]]]
    pairs = np.concatenate([
        np.stack([border[met, 0], other[:, 1]], 1), np.stack([border[met, 1], other[:, 0]], 1)
    ])  # fmt: skip
    graph = coo_matrix((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), (V, V))
    label = connected_components(graph, directed=False)[1]
    lowest = np.full(label.max() + 1, V)
    np.minimum.at(lowest, label, np.arange(V))
    return lowest[label][faces]


def pieces(faces):
    """Number of the connected piece that each face [F] belongs to, the largest piece first."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    edges = np.concatenate([faces[:, :2], faces[:, 1:]])
    V = int(faces.max()) + 1
    graph = coo_matrix((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), (V, V))
    label = connected_components(graph, directed=False)[1][faces[:, 0]]
    _, label, count = np.unique(label, return_inverse=True, return_counts=True)
    rank = np.empty(len(count), int)
    rank[np.argsort(-count, kind="stable")] = np.arange(len(count))
    return rank[label]


def simplified(surface, most):
    """A surface of at most `most` triangles; one that is thinned out loses its uv.

    Returns:
        Surface: the one given if it is small enough.
    """
    if len(surface.faces) <= most:
        return surface
    import fast_simplification

    low = surface.vertices.min(0)
    size = np.ptp(surface.vertices, axis=0).max()  # it works in single precision
    points, faces = fast_simplification.simplify(
        ((surface.vertices - low) / size).astype(np.float32),
        surface.faces.astype(np.int32),
        target_count=most,
    )
    return Surface(points.astype(np.float64) * size + low, faces.astype(np.int64))
