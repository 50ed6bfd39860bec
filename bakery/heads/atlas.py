"""Flattening the skin into one chart: no fold, little stretch, mirror-symmetric, face enlarged.

Build-time only: needs scipy.

References:
    Floater, "Mean value coordinates", CAGD 20(1), 2003.
    Yoshizawa, Belyaev, Seidel, "A fast and simple stretch-minimizing mesh parameterization",
    Shape Modeling International 2004.
"""

import numpy as np

from bakery.geometry.mesh import boundary_loops, face_normals, scatter_add

# Where things lie in the atlas: [left, top, width, height]; gutters are 4 texels of 1024.
GUTTER = 4 / 1024
SKIN_BOX = (0.004, 0.004, 0.992, 0.772)
BOXES = {
    "mouth_sheet": (0.004, 0.784, 0.2, 0.12),
    "eye_cap_left": (0.33, 0.784, 0.12, 0.12),
    "eye_cap_right": (0.208, 0.784, 0.12, 0.12),
    "eye_left": (0.58, 0.784, 0.12, 0.12),
    "eye_right": (0.456, 0.784, 0.12, 0.12),
    "tongue": (0.706, 0.784, 0.14, 0.12),
    "mouth_cavity": (0.85, 0.784, 0.146, 0.12),
    "teeth_upper": (0.004, 0.91, 0.3, 0.042),
    "teeth_lower": (0.004, 0.956, 0.3, 0.04),
    "gums_upper": (0.308, 0.91, 0.3, 0.042),
    "gums_lower": (0.308, 0.956, 0.3, 0.04),
    "socket_left": (0.7, 0.91, 0.084, 0.086),
    "socket_right": (0.612, 0.91, 0.084, 0.086),
    "lashes": (0.788, 0.91, 0.1, 0.086),
    "tear": (0.892, 0.91, 0.1, 0.086),
}


def mean_value_weights(points, faces):
    """Positive weights of each directed edge: (from [N], to [N], weight [N])."""
    rows, columns, values = [], [], []
    corners = points[faces]
    for k in range(3):
        a, b, c = (corners[:, (k + n) % 3] for n in range(3))
        ab, ac = b - a, c - a
        lab, lac = np.linalg.norm(ab, axis=1), np.linalg.norm(ac, axis=1)
        cosine = np.einsum("nc,nc->n", ab, ac) / np.maximum(lab * lac, 1e-20)
        half = np.tan(np.arccos(np.clip(cosine, -0.999, 0.999)) / 2)
        i, j, m = (faces[:, (k + n) % 3] for n in range(3))
        rows += [i, i]
        columns += [j, m]
        values += [half / np.maximum(lab, 1e-9), half / np.maximum(lac, 1e-9)]
    return np.concatenate(rows), np.concatenate(columns), np.concatenate(values)


def stretch(points, faces, uv, density):
    """How much the map stretches around each vertex [V], relative to the wanted density."""
    p, q = points[faces], uv[faces]
    d1, d2 = q[:, 1] - q[:, 0], q[:, 2] - q[:, 0]
    area = d1[:, 0] * d2[:, 1] - d1[:, 1] * d2[:, 0]
    area = np.where(np.abs(area) < 1e-14, 1e-14, area)
    e1, e2 = p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]
    Ss = (e1 * d2[:, 1:2] - e2 * d1[:, 1:2]) / area[:, None]
    St = (e2 * d1[:, :1] - e1 * d2[:, :1]) / area[:, None]
    L2 = np.sqrt(((Ss**2).sum(1) + (St**2).sum(1)) / 2) * density[faces].mean(1)
    weight = np.linalg.norm(face_normals(points, faces), axis=1)
    total = sum(
        scatter_add(np.stack([weight * L2**2, weight], 1), faces[:, k], len(points))
        for k in range(3)
    )
    return np.sqrt(total[:, 0] / np.maximum(total[:, 1], 1e-20))


def flatten(points, faces, rim, rim_uv, density=None, rounds=8, power=0.5):
    """Map a disc of triangles into a convex outline.

    Args:
        points: [V, 3].
        faces: [F, 3]; holes other than the rim are filled for the solve.
        rim: [N] border vertices in order; rim_uv: [N, 2] their places on a convex outline.
        density: [V] wanted texels per length, relative.
        rounds: stretch-minimising rounds.
        power: how far each round corrects.

    Returns:
        uv [V, 2]; positive weights and a convex outline keep every triangle upright.
    """
    from scipy.sparse import coo_matrix, diags
    from scipy.sparse.linalg import spsolve

    density = np.ones(len(points)) if density is None else np.asarray(density, float)
    rim_set = set(int(v) for v in rim)
    filled, body, weight = [faces], points, density
    for loop in boundary_loops(faces):
        if loop[0] not in rim_set:
            loop, hub = np.array(loop), len(body)
            body = np.concatenate([body, [body[loop].mean(0)]])
            weight = np.append(weight, weight[loop].mean())
            filled.append(np.stack([np.roll(loop, -1), loop, np.full(len(loop), hub)], -1))
    mesh = np.concatenate(filled)
    rows, columns, values = mean_value_weights(body, mesh)
    V = len(body)
    inner = np.setdiff1d(np.arange(V), rim)
    uv = np.zeros((V, 2))
    uv[rim] = rim_uv
    surface = np.linalg.norm(face_normals(body, mesh), axis=1)
    share = sum(np.bincount(mesh[:, k], surface, V) for k in range(3)) * weight**2
    best, best_score = None, np.inf
    for _ in range(rounds + 1):
        L = coo_matrix((values, (rows, columns)), (V, V)).tocsr()
        L = diags(np.asarray(L.sum(1)).ravel()) - L
        uv[inner] = spsolve(L[inner][:, inner].tocsc(), -(L[inner][:, rim] @ uv[rim]))
        sigma = stretch(body, mesh, uv, weight)
        middle = np.median(sigma)
        sigma = np.clip(sigma / middle, 1 / 20, 20)  # a sliver at the rim must not steer all
        spread = np.log(sigma)
        score = float(share @ (spread - share @ spread / share.sum()) ** 2 / share.sum())
        if score < best_score:
            best, best_score = uv.copy(), score
        values = values / sigma[columns] ** power
    return best[: len(points)]


def rectangle_rim(points, rim, start, middle, corners=0.5):
    """Spread a closed border over the unit square, mirror-symmetric.

    Args:
        rim: [N] border vertices in order; `start` (an index into rim) goes to the middle of the
            top edge, `middle` to the middle of the bottom edge.
    """
    rim = np.roll(np.asarray(rim), -start)
    middle = (middle - start) % len(rim)
    steps = np.linalg.norm(points[np.roll(rim, -1)] - points[rim], axis=1)
    along = np.concatenate([[0], np.cumsum(steps)])
    share = np.where(
        np.arange(len(rim)) <= middle,
        along[:-1] / along[middle] / 2,
        0.5 + (along[:-1] - along[middle]) / (along[-1] - along[middle]) / 2,
    )
    way = np.array([[0.5, 0], [1, 0], [1, 1], [0.5, 1], [0, 1], [0, 0], [0.5, 0]])
    legs = np.concatenate([[0], np.cumsum([0.5, 1, 0.5, 0.5, 1, 0.5])]) / 4
    # A border vertex on each corner keeps the outline square.
    for corner in legs[[1, 2, 4, 5]]:
        share[np.abs(share - corner).argmin()] = corner
    uv = np.stack([np.interp(share, legs, way[:, k]) for k in range(2)], -1)
    return rim, uv


def fit_box(uv):
    """Scale uv [U, 2] to fill 0..1 on both axes."""
    low, high = uv.min(0), uv.max(0)
    return (uv - low) / np.maximum(high - low, 1e-12)
