"""Flattening the skin into one chart: no fold, little stretch, mirror-symmetric, face enlarged.

Build-time only.

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
    "lashes": (0.788, 0.91, 0.1, 0.086),  # the source's, which no avatar shows
    "cards": (0.788, 0.91, 0.204, 0.086),  # those of `heads.lashes`
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


def fill_holes(points, faces, rim):
    """Close every border but the rim with a fan about a new vertex.

    Returns:
        (points [V + H, 3], faces [F + N, 3] with the fans last).
    """
    rim = set(int(v) for v in rim)
    for loop in boundary_loops(faces):
        if loop[0] not in rim:
            loop = np.array(loop)
            hub = np.full(len(loop), len(points))
            points = np.concatenate([points, [points[loop].mean(0)]])
            faces = np.concatenate([faces, np.stack([np.roll(loop, -1), loop, hub], -1)])
    return points, faces


def flatten(body, mesh, rim, rim_uv, density=None, rounds=8, power=0.5):
    """Map a disc of triangles into a convex outline.

    Args:
        body: [V, 3]; mesh: [F, 3], one border only.
        rim: [N] border vertices in order; rim_uv: [N, 2] their places on a convex outline.
        density: [V] wanted texels per length, relative.
        rounds: stretch-minimising rounds.
        power: how far each round corrects.

    Returns:
        uv [V, 2]; positive weights and a convex outline keep every triangle upright.
    """
    from scipy.sparse import coo_matrix, diags
    from scipy.sparse.linalg import spsolve

    weight = np.ones(len(body)) if density is None else np.asarray(density, float)
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
    return best


def relax(points, faces, uv, held, density, fans=0, rounds=25):
    """Take stretch out of a flat map without turning any triangle over.

    Minimises the symmetric Dirichlet energy against `points` enlarged by `density`, by reweighted
    least squares with a line search that stops before the first flip.

    Args:
        points: [V, 3]; faces: [F, 3]; uv: [V, 2] texels, no triangle turned over.
        held: [V, 2] which coordinates stay where they are.
        density: [V] wanted texels per length, relative.
        fans: how many faces, the last ones, only fill holes: they may stretch but not turn over.

    Returns:
        uv [V, 2].

    References:
        Rabinovich et al., "Scalable locally injective mappings", ACM TOG 36(2), 2017.
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.linalg import splu

    e1, e2 = (points[faces[:, k]] - points[faces[:, 0]] for k in (1, 2))
    length = np.linalg.norm(e1, axis=1)
    along = np.einsum("nc,nc->n", e1, e2) / length
    height = np.linalg.norm(np.cross(e1, e2), axis=1) / length
    scale = density[faces].mean(1)
    weight = np.ones(len(faces))
    if fans:  # what fills a hole rests in the shape it starts with
        weight[-fans:] = 0.01
        scale[-fans:] = 0
    d = uv[faces]
    flat = _cross(d[:, 1] - d[:, 0], d[:, 2] - d[:, 0])
    side = np.sign(np.median(flat))
    scale *= np.sqrt(np.abs(flat[scale > 0]).sum() / (scale**2 * length * height).sum())
    length, along, height = length * scale, along * scale, height * scale
    if fans:
        f1, f2 = (d[-fans:, k] - d[-fans:, 0] for k in (1, 2))
        length[-fans:] = np.linalg.norm(f1, axis=1)
        along[-fans:] = (f1 * f2).sum(1) / length[-fans:]
        height[-fans:] = np.abs(flat[-fans:]) / length[-fans:]
    area = weight * length * height
    # Gradient of a function on a triangle in its own frame, mirrored where the chart is.
    G = np.zeros((len(faces), 2, 3))
    G[:, 0, 1] = 1 / length
    G[:, 1, 1], G[:, 1, 2] = -along / (length * height), 1 / height
    G[:, 1] *= side
    G[:, :, 0] = -G.sum(-1)
    F, V = len(faces), len(uv)

    def jacobian(x):
        return np.einsum("fgk,fkc->fcg", G, x[faces])

    def energy(x):
        J = jacobian(x)
        det = J[:, 0, 0] * J[:, 1, 1] - J[:, 0, 1] * J[:, 1, 0]
        if (det <= 0).any():
            return np.inf
        norm = (J**2).sum((1, 2))
        return float(area @ (norm * (1 + 1 / det**2)))

    free = np.flatnonzero(~held.ravel())
    place_of = np.full(2 * V, -1)
    place_of[free] = np.arange(len(free))
    uv = uv.copy()
    now = energy(uv)
    for _ in range(rounds):
        if not np.isfinite(now):
            break
        U, S, Vt = np.linalg.svd(jacobian(uv))
        S = np.maximum(S, 1e-6)
        near = np.abs(S - 1) < 1e-4
        w = np.sqrt(np.where(near, 4.0, (S - S**-3) / np.where(near, 1, S - 1)))
        W = np.einsum("fij,fj,fkj->fik", U, w, U) * np.sqrt(area)[:, None, None]
        R = U @ Vt
        # Rows (f, i, g): sum over c, k of W[f, i, c] G[f, g, k] x[faces[f, k], c].
        values = np.einsum("fic,fgk->figkc", W, G).reshape(F * 4, 6)
        columns = (2 * faces[:, :, None] + np.arange(2)).reshape(F, 1, 6).repeat(4, 1)
        columns = columns.reshape(F * 4, 6)
        target = np.einsum("fic,fcg->fig", W, R).ravel()
        rows = np.arange(F * 4)[:, None].repeat(6, 1)
        A = coo_matrix((values.ravel(), (rows.ravel(), columns.ravel())), (F * 4, 2 * V)).tocsc()
        rest = target - A @ np.where(held.ravel(), uv.ravel(), 0)
        A = A[:, free]
        wanted = uv.ravel().copy()
        wanted[free] = splu((A.T @ A).tocsc()).solve(A.T @ rest)
        step = wanted.reshape(-1, 2) - uv
        share = min(1.0, 0.9 * _first_flip(uv[faces] * [side, 1], step[faces] * [side, 1]))
        while share > 1e-6 and (trial := energy(uv + share * step)) >= now:
            share *= 0.6
        if share <= 1e-6:
            break
        uv, now = uv + share * step, trial
    return uv


def _cross(a, b):
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def _first_flip(corners, step):
    """The smallest share of a step [F, 3, 2] at which a triangle [F, 3, 2] has no area left."""
    e1, e2 = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    s1, s2 = step[:, 1] - step[:, 0], step[:, 2] - step[:, 0]
    a, b, c = _cross(s1, s2), _cross(e1, s2) + _cross(s1, e2), _cross(e1, e2)
    with np.errstate(all="ignore"):
        root = np.sqrt(np.where(b * b - 4 * a * c >= 0, b * b - 4 * a * c, np.nan))
        q = -(b + np.copysign(root, b)) / 2
        shares = np.concatenate([q / a, c / q, np.where(a == 0, -c / b, np.nan)])
    shares = shares[np.isfinite(shares) & (shares > 0)]
    return float(shares.min()) if len(shares) else np.inf


def rectangle_rim(points, rim, start, corner, middle, shape):
    """Spread a closed border over the unit square, mirror-symmetric.

    Args:
        points: [V, 3]; rim: [N] border vertices in order, clockwise in the chart.
        start, corner, middle: vertices of the rim that go to the middle of the top edge, the lower
            right corner and the middle of the bottom edge.
        shape: (width, height) that the square will be stretched to.

    Returns:
        (rim [N] from `start` on, uv [N, 2]).
    """
    rim = list(rim)
    rim = np.roll(rim, -rim.index(start))
    order = rim.tolist()
    steps = np.linalg.norm(points[np.roll(rim, -1)] - points[rim], axis=1)
    along = np.concatenate([[0], np.cumsum(steps)])
    low, end = order.index(corner), order.index(middle)
    turn = along[low] * shape[0] / 2 / (shape[0] / 2 + shape[1])
    top = int(np.abs(along[: low + 1] - turn).argmin())
    far = len(rim) - top  # the mirror images of the corners
    stops = [0, top, low, end, len(rim) - low, far, len(rim)]
    way = np.array([[0.5, 0], [1, 0], [1, 1], [0.5, 1], [0, 1], [0, 0], [0.5, 0]])
    uv = np.zeros((len(rim), 2))
    for k in range(6):
        here = slice(stops[k], stops[k + 1])
        share = (along[here] - along[stops[k]]) / (along[stops[k + 1]] - along[stops[k]])
        uv[here] = way[k] + share[:, None] * (way[k + 1] - way[k])
    return rim, uv


def fit_box(uv):
    """Scale uv [U, 2] to fill 0..1 on both axes."""
    low, high = uv.min(0), uv.max(0)
    return (uv - low) / np.maximum(high - low, 1e-12)
