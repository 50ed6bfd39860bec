"""The uv of an imported skin: its own where it can be used, else a new one by xatlas.

xatlas alone cuts a head into a hundred charts and the face into forty of them, and a lid that is cut
cannot be painted. So it is handed the built-in head's layout, carried over, as the charts to begin
with: it keeps what is valid of it, unwraps what is not, and packs everything.
"""

import logging

import numpy as np

from bakery.geometry.mesh import boundary_loops, face_normals
from bakery.geometry.raster import rasterize
from bakery.heads.build import flatten
from bakery.heads.build.charts import face_density
from bakery.heads.mesh.read import pieces

log = logging.getLogger(__name__)
SIZE = 1024  # texels a side in which layouts are judged and packed
PADDING = 4  # texels of these between charts
OVERLAP = 0.02  # share of the layout that may lie twice
EMPTY = 0.02  # share of the skin that may have no area in the layout
ONE_CHART = 0.99  # share of the landmarks that must lie in one chart
LEAST = 40_000  # texels of SIZE x SIZE between the landmarks
SEAM = 0.3  # of the layout's width: a face that is wider lies across the seam behind the head
THERE = 0.3  # trust of a place on the laid head; below, its layout is no use
RELAXED = 10  # rounds in which a chart without turned faces loses its stretch
RINGS = (1, 2, 3, 4, 6, 8, 10)  # of vertices around a turned face that are laid out anew
MOST = 1e6  # mm; xatlas does not come back from coordinates beyond measure


def _areas(uv, uv_faces):
    """Signed area [F] of each face in the layout."""
    a, b, c = uv[uv_faces].transpose(1, 0, 2)
    d, e = b - a, c - a
    return (d[:, 0] * e[:, 1] - d[:, 1] * e[:, 0]) / 2


def unusable(surface, marked):
    """Why the uv of a surface cannot be used, in words for people; None if it can.

    Args:
        surface: Surface with or without uv; marked: [468] faces that landmarks lie on.
    """
    if surface.uv is None:
        return "the mesh has no uv"
    uv = surface.uv
    if uv.min() < -1e-3 or uv.max() > 1 + 1e-3:
        return f"its uv reaches from {uv.min():.2f} to {uv.max():.2f}, outside 0..1"
    area = np.abs(_areas(uv, surface.uv_faces))
    space = np.linalg.norm(face_normals(surface.vertices, surface.faces), axis=1)
    lost = space[area < 1e-10].sum() / space.sum()
    if lost > EMPTY:
        return f"{100 * lost:.0f}% of the skin has no area in its uv"
    seen = rasterize(uv * SIZE, None, surface.uv_faces, (SIZE, SIZE)).face >= 0
    twice = 1 - seen.sum() / max(area.sum() * SIZE**2, 1)
    if twice > OVERLAP:
        return f"{100 * twice:.0f}% of its uv lies on itself"
    chart = pieces(surface.uv_faces)[marked]
    if np.bincount(chart).max() < ONE_CHART * len(marked):
        return "its uv cuts the face into several charts"
    texels = np.ptp(uv[surface.uv_faces[marked]].reshape(-1, 2), axis=0).prod() * SIZE**2
    if texels < LEAST:
        return f"its uv has {texels:.0f} texels of {SIZE} x {SIZE} for the face, {LEAST} are needed"
    return None


def carried(vertices, faces, part, pairs, laid):
    """The built-in head's layout on another surface: uv [F, 3, 2], 0 where it makes no sense.

    Args:
        vertices: [V, 3] mm; faces: [F, 3]; part: [F] names of parts; pairs: Pairs; laid: Laid.
    """
    head = laid.head
    at = head.uv[head.uv_faces[pairs.vertex_face]].astype(float)
    uv = np.einsum("vkc,vk->vc", at, pairs.barycentric)[faces]  # [F, 3, 2]
    # A face stays on its side of the cut behind the head and in the chart of its part, even where
    # one of its corners was found beyond.
    own = head.uv[head.uv_faces[pairs.face]].astype(float)  # [F, 3, 2] of the face it stands for
    side = own.mean(1)[:, 0] > 0.5
    across = np.ptp(uv[..., 0], axis=1) > SEAM
    wrong = across[:, None] & ((uv[..., 0] > 0.5) != side[:, None])
    wrong |= head.face_part[pairs.vertex_face[faces]] != head.face_part[pairs.face][:, None]
    rows, corners = np.nonzero(wrong)
    if len(rows):
        beyond = _extrapolated(vertices[faces[rows, corners]], laid, pairs.face[rows], own[rows])
        kind = 2 * head.face_part[pairs.face[rows]].astype(int) + side[rows]
        key = 64 * faces[rows, corners] + kind
        _, index = np.unique(key, return_inverse=True)
        count = np.bincount(index)
        mean = np.stack([np.bincount(index, beyond[:, k]) / count for k in range(2)], -1)
        uv[rows, corners] = mean[index]
    uv[_beyond(faces, (pairs.trust[faces] < THERE).all(1))] = 0
    return np.clip(uv, -0.2, 1.2)


def _beyond(faces, lost):
    """Which of the lost faces [F] bool lie at the end of the surface, not amid what is known."""
    out = np.zeros(len(faces), bool)
    if not lost.any():
        return out
    edge = np.zeros(faces.max() + 1, bool)
    for loop in boundary_loops(faces):
        edge[loop] = True
    rows = np.flatnonzero(lost)
    label = pieces(faces[rows])
    ends = np.unique(label[edge[faces[rows]].any(1)])
    out[rows] = np.isin(label, ends)
    return out


def _extrapolated(points, laid, faces, own):
    """uv [N, 2] of points [N, 3] by the affine map of one face each, own [N, 3, 2] its uv."""
    a, b, c = laid.vertices[laid.head.faces[faces]].transpose(1, 0, 2)
    edges = np.stack([b - a, c - a], -1)  # [N, 3, 2]
    along = np.einsum("nkc,nc->nk", np.linalg.pinv(edges), points - a)
    steps = own[:, 1:] - own[:, :1]
    return own[:, 0] + np.einsum("nk,nkc->nc", along, steps)


def unfolded(uv, points, faces, density):
    """A layout without turned faces and with little stretch.

    Around each turned face it is drawn anew between what is right; then stretch is taken out of all.

    Args:
        uv: [U, 2]; points: [U, 3] mm; faces: [F, 3] into both, one piece; most turn the right way.
        density: [U] wanted texels per length, relative.

    Returns:
        (uv [U, 2], [F] bool faces that are right: a few at the rim may not be).

    References:
        Floater, "Mean value coordinates", CAGD 20(1), 2003: with positive weights a region inside
        a convex outline does not fold.
    """
    from scipy.sparse import coo_matrix, diags
    from scipy.sparse.linalg import spsolve

    way = np.sign(_areas(uv, faces).sum())
    kept = np.ones(len(faces), bool)
    for _ in range(3):  # faces that turn at the rim can only go
        rim = max(boundary_loops(faces[kept]), key=lambda loop: np.ptp(uv[loop], axis=0).sum())
        at_rim = np.isin(faces, rim).sum(1) > 1
        kept &= ~(at_rim & (_areas(uv, faces) * way <= 0))
    kept[kept] = pieces(faces[kept]) == 0
    used, mesh = np.unique(faces[kept], return_inverse=True)
    own, plane = mesh.reshape(-1, 3), uv[used]
    rim = max(boundary_loops(own), key=lambda loop: np.ptp(plane[loop], axis=0).sum())
    body, mesh = flatten.fill_holes(points[used], own, rim)  # lids and lips keep their openings
    fans = mesh[len(own) :]
    hubs = [plane[fans[fans[:, 2] == hub, 0]].mean(0) for hub in range(len(plane), len(body))]
    plane = np.concatenate([plane, np.reshape(hubs, (-1, 2))])
    rows, columns, weights = flatten.mean_value_weights(body, mesh)
    W = coo_matrix((weights, (rows, columns)), (len(body),) * 2).tocsr()
    L = (diags(np.asarray(W.sum(1)).ravel()) - W).tocsr()
    held = np.zeros(len(body), bool)
    held[rim] = True
    for rings in RINGS:
        bad = _areas(plane, mesh) * way <= 0
        if not bad.any():
            break
        free = np.zeros(len(body), bool)
        free[mesh[bad]] = True
        for _ in range(rings):
            free = free | (W @ free > 0)
        free &= ~held
        rest = -(L[free][:, ~free] @ plane[~free])
        plane[free] = spsolve(L[free][:, free].tocsc(), rest).reshape(-1, 2)
    if (_areas(plane, mesh) * way > 0).all():
        wanted = np.concatenate([density[used], np.ones(len(hubs))])
        both = np.repeat(held[:, None], 2, 1)
        plane = flatten.relax(body, mesh, plane, both, wanted, len(fans), RELAXED)
    out = uv.copy()
    out[used] = plane[: len(used)]
    return out, kept & (_areas(out, faces) * way > 0)


def unwrap(corners, hint=None):
    """Lay triangles out with xatlas.

    Args:
        corners: [F, 3, 3] mm; corners at the same place are one vertex.
        hint: [F, 3, 2] uv to keep where it is valid, 0 where there is none.

    Returns:
        (uv [U, 2] 0..1 filling the square, uv_faces [F, 3], number of charts).
    """
    import xatlas

    if not np.abs(corners).max() < MOST:
        raise ValueError(f"coordinates up to {np.abs(corners).max():.3g}; xatlas would not end")
    charts, packing = xatlas.ChartOptions(), xatlas.PackOptions()
    packing.resolution, packing.padding = SIZE, PADDING
    packing.rotate_charts = packing.rotate_charts_to_axis = hint is None
    charts.use_input_mesh_uvs = hint is not None
    flat = corners.reshape(-1, 3).astype(np.float32)
    keys, uvs = flat, None
    if hint is not None:
        keys = np.concatenate([flat, hint.reshape(-1, 2).astype(np.float32)], 1)
    unique, index = np.unique(keys, axis=0, return_inverse=True)
    faces, points = index.reshape(-1, 3), np.ascontiguousarray(unique[:, :3])
    if hint is not None:
        valid = np.flatnonzero(np.abs(hint).sum((1, 2)) > 0)
        hint, label = np.zeros_like(hint), pieces(faces[valid])
        for chart in range(label.max() + 1):
            rows = valid[label == chart]
            used, mesh = np.unique(faces[rows], return_inverse=True)
            mesh = mesh.reshape(-1, 3)
            plane = unique[used, 3:].astype(np.float64)
            plane, right = unfolded(
                plane, points[used].astype(float), mesh, face_density(points[used])
            )
            hint[rows[right]] = plane[mesh[right]]
        keys = np.concatenate([flat, hint.reshape(-1, 2).astype(np.float32)], 1)
        unique, index = np.unique(keys, axis=0, return_inverse=True)
        faces, points = index.reshape(-1, 3), np.ascontiguousarray(unique[:, :3])
        uvs = np.ascontiguousarray(unique[:, 3:])
    layout = xatlas.Atlas()
    layout.add_mesh(points, np.ascontiguousarray(faces, np.uint32), uvs=uvs)
    layout.generate(charts, packing)
    _, uv_faces, uv = layout.get_mesh(0)
    uv = np.asarray(uv, np.float64)
    low, high = uv.min(0), uv.max(0)
    uv = (uv - low) / np.maximum(high - low, 1e-9)
    return uv, np.asarray(uv_faces, np.int64), layout.chart_count
