"""The charts of skin, mouth cavity and eye sockets. Build-time only."""

import numpy as np

from bakery.geometry.mesh import boundary_loops
from bakery.heads.build import flatten
from bakery.heads.build.control import mirror_of


def skin_chart(mean, faces):
    """uv [U, 2] and uv_faces of the skin: cut up the back of the neck to the crown."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import dijkstra

    loops = boundary_loops(faces)
    neck = min(loops, key=lambda loop: mean[loop, 1].mean())
    middle = np.abs(mean[:, 0]) < 1e-6
    edges = np.unique(np.sort(np.concatenate([faces[:, :2], faces[:, 1:]]), axis=1), axis=0)
    edges = edges[middle[edges].all(1)]
    V = len(mean)
    length = np.linalg.norm(mean[edges[:, 0]] - mean[edges[:, 1]], axis=1)
    graph = coo_matrix((length, (edges[:, 0], edges[:, 1])), (V, V)).tocsr()
    nape = min((v for v in neck if middle[v]), key=lambda v: mean[v, 2])
    used = np.unique(faces)
    used = used[middle[used]]
    crown = used[mean[used, 1].argmax()]
    before = dijkstra(graph, directed=False, indices=nape, return_predecessors=True)[1]
    path = [int(crown)]
    while path[-1] != nape:
        path.append(int(before[path[-1]]))
    cut = path[1:]  # crown stays one vertex
    # Faces on the subject's right of the cut get copies of its vertices.
    centroid = mean[faces].mean(1)
    copy = {v: V + k for k, v in enumerate(cut)}
    uv_faces = faces.copy()
    for v, w in copy.items():
        rows, columns = np.nonzero(uv_faces == v)
        right = centroid[rows, 0] < 0
        uv_faces[rows[right], columns[right]] = w
    points = np.concatenate([mean, mean[cut]])
    rim = next(loop for loop in boundary_loops(uv_faces) if crown in loop)
    front = max((v for v in neck if middle[v]), key=lambda v: mean[v, 2])
    start, end = rim.index(crown), rim.index(front)
    first_half = np.roll(rim, -start)[: (end - start) % len(rim)]
    if points[first_half, 0].mean() < 0:
        rim = rim[::-1]
    # The subject's left is on the right of the chart, as in a portrait: it keeps the old vertices.
    box = np.array([1024 * flatten.SKIN_BOX[2], 1024 * flatten.SKIN_BOX[3]])
    rim, rim_uv = flatten.rectangle_rim(points, rim, crown, nape, front, box)
    compact, uv_small = np.unique(uv_faces, return_inverse=True)
    uv_small = uv_small.reshape(-1, 3)
    number = np.full(len(points), -1)
    number[compact] = np.arange(len(compact))
    body, mesh = flatten.fill_holes(points[compact], uv_small, number[rim])
    density = face_density(body)
    uv = flatten.flatten(body, mesh, number[rim], rim_uv * box, density)
    held = np.zeros((len(body), 2), bool)
    held[number[rim]] = (rim_uv == 0) | (rim_uv == 1)
    uv = flatten.relax(body, mesh, uv, held, density, len(mesh) - len(uv_small))[: len(compact)]
    uv /= box
    copies = {w: v for v, w in copy.items()}
    source = np.array([copies.get(int(v), int(v)) for v in compact])
    other = mirror_of(mean[used_all := np.unique(faces)])
    twin = {int(a): int(used_all[b]) for a, b in zip(used_all, other)}
    flip = np.empty(len(compact), int)
    for k, v in enumerate(compact):
        mirrored = twin[int(source[k])]
        if v >= V or (v in copy):
            mirrored = copy[mirrored] if v in copy else mirrored
        flip[k] = number[mirrored]
    uv = (uv + np.stack([1 - uv[flip, 0], uv[flip, 1]], -1)) / 2
    return uv, uv_small


def face_density(points):
    """Texels per length wanted on the skin: full on the face, less on scalp, ears and neck."""
    x, y, z = points.T
    front = np.clip((z + 75) / 60, 0, 1)
    up = np.clip((130 - y) / 60, 0, 1) * np.clip((y + 145) / 40, 0, 1)
    side = np.clip((92 - np.abs(x)) / 22, 0, 1)
    face = front * up * side
    return 0.3 + 0.7 * face * face * (3 - 2 * face)


def chart_of_disc(points, faces):
    """uv of an open pocket (mouth cavity, eye socket): its rim on a circle."""
    used, small = np.unique(faces, return_inverse=True)
    small = small.reshape(-1, 3)
    rim = np.array(max(boundary_loops(small), key=len))
    step = np.linalg.norm(points[used][np.roll(rim, -1)] - points[used][rim], axis=1)
    turn = np.concatenate([[0], np.cumsum(step)[:-1]]) / step.sum() * 2 * np.pi
    circle = np.stack([np.cos(turn), np.sin(turn)], -1)
    uv = flatten.flatten(points[used], small, rim, circle, rounds=6)
    area = uv[small]
    d1, d2 = area[:, 1] - area[:, 0], area[:, 2] - area[:, 0]
    if (d1[:, 0] * d2[:, 1] - d1[:, 1] * d2[:, 0]).sum() > 0:
        uv[:, 0] *= -1
    return (uv + 1) / 2, small
