"""Identity statistics and the smile, learned from landmarks of photographed people.

Build-time only. What is kept are a few hundred numbers about the population; nobody's
own shape.
"""

import numpy as np

from bakery.geometry import camera as cameras
from bakery.geometry import rotation
from bakery.heads.build.control import swap_sides
from bakery.heads.build.makehuman import MODES, refined_flesh
from bakery.heads.place import at_landmarks, moves_between, place, place_head
from bakery.landmarks import FACE, MOUTH_CORNERS, face_size
from bakery.types import EXPRESSION_INDEX, EXPRESSIONS

WIDE = 110  # sliders that people's identity is looked for in
NOISE = 0.01  # outer-eye-corner distances; points of one face are wrong together
DOUBT = 25.0  # how many people the sliders' own statistics count for
PROFILE = 168.0  # degrees, glabella - subnasale - pogonion; the tip of the nose left out
MIDLINE = 0.05  # mm from the plane of symmetry
HELD = 20.0  # weight of the landmarks' mean square move as the front sees it, per mm2


def landmark_matrix(raw, head):
    """Weights csr [468, V] that read a head's landmarks from the control vertices of a Raw."""
    from scipy.sparse import coo_matrix

    matrix, faces, _ = refined_flesh(raw)
    corners = faces[head.landmark_faces[:FACE]]
    rows = np.arange(FACE)[:, None].repeat(3, 1)
    weights = head.landmark_barycentric[:FACE].astype(float)
    pick = coo_matrix(
        (weights.ravel(), (rows.ravel(), corners.ravel())), (FACE, matrix.shape[0])
    ).tocsr()
    return (pick @ matrix).tocsr()


def carry(matrix, values):
    """Apply a matrix [N, V] to values [..., V, 3]: [..., N, 3]."""
    return np.stack([matrix @ v for v in values.reshape(-1, *values.shape[-2:])]).reshape(
        values.shape[:-2] + (matrix.shape[0], 3)
    )


def learn_prior(raw, head, points, sizes, rounds=4):
    """Mean and modes of identity from neutral faces, by expectation and maximisation.

    Args:
        raw: a symmetric Raw with all its sliders; head: HeadModel built of it, with landmarks.
        points: [N, 478, 2] pixels of neutral faces; sizes: [N, 2].

    Yields:
        (mean [K], modes [MODES, K], rms of the neutrals' coefficients in the new modes).
    """
    matrix = landmark_matrix(raw, head)
    base = carry(matrix, raw.mean)
    sliders = carry(matrix, raw.sliders[:WIDE])
    expression = carry(matrix, raw.expression) * 0.25  # neutral faces: hold expressions back
    K = len(sliders)
    mean, covariance = np.zeros(K), np.eye(K)
    for _ in range(rounds):
        root = np.linalg.cholesky(covariance + 1e-9 * np.eye(K))
        modes = np.tensordot(root.T, sliders, 1)
        center = base + np.tensordot(mean, sliders, 1)
        found, spread = [], np.zeros((K, K))
        for face, size in zip(points, sizes):
            view, identity, weights, _ = place(
                center, modes, expression, face[:FACE], tuple(map(int, size)), sigma=NOISE
            )
            found.append(mean + root @ identity)
            shape = center + np.tensordot(identity, modes, 1)
            shape = shape + np.tensordot(weights, expression, 1)
            spread += root @ _posterior(shape, modes, expression, view, face) @ root.T
        found = np.array(found)
        mean = found.sum(0) / (len(found) + DOUBT)
        offsets = found - mean
        covariance = (offsets.T @ offsets + spread + DOUBT * np.eye(K)) / (len(found) + DOUBT)
        values, vectors = _order(covariance, raw)
        rms = np.sqrt(np.mean((offsets @ vectors / np.sqrt(values)) ** 2))
        yield mean, (vectors * np.sqrt(values)).T[:MODES], float(rms)


def learn_rest(head, points, sizes):
    """What expression the neutral faces of people have on average: [E], both sides alike.

    A neutral face should need none, so this much of each shape belongs into the mean head.
    """
    found = [
        place_head(head, face, tuple(map(int, size))).expression
        for face, size in zip(points, sizes)
    ]
    mean = np.mean(found, axis=0)
    mean = (mean + mean[swap_sides()]) / 2
    lasting = [
        name.startswith(("brow", "mouth", "cheekSquint", "eyeSquint", "eyeWide", "noseSneer"))
        and name != "mouthClose"
        for name in EXPRESSIONS
    ]
    return np.where(lasting, mean, 0)


def mean_identity(head, points, sizes):
    """Mean identity coefficients [I] of neutral faces, expressions held back as in `learn_prior`."""
    mean, modes, expression = at_landmarks(head)
    found = [
        place(mean, modes, 0.25 * expression, face[:FACE], tuple(map(int, size)), sigma=NOISE)[1]
        for face, size in zip(points, sizes)
    ]
    return np.mean(found, axis=0)


def profile_vertices(head):
    """Vertices of the mean head's midline: glabella, subnasale, pogonion.

    The subnasale is where the profile between nose and lip lies deepest: the corner under the nose
    is round and has no one height.
    """
    points = head.landmarks(head.mean)
    skin = head.part_vertices("skin")
    x, y, z = head.mean[skin].T
    middle = (np.abs(x) < MIDLINE) & (z > 0)
    skin, y, z = skin[middle], y[middle], z[middle]
    brow, chin = (np.abs(y - points[k, 1]).argmin() for k in (9, 199))
    line = np.interp(y, [y[chin], y[brow]], [z[chin], z[brow]])
    between = (y < points[164, 1]) & (y > points[0, 1])
    nose = np.where(between, z - line, np.inf).argmin()
    return skin[[brow, nose, chin]]


def profile_shift(head):
    """Identity [I] that gives the mean head a mean profile, which photos from the front do not show.

    The smallest move, in standard deviations of the modes, that makes the angle of glabella,
    subnasale and pogonion PROFILE degrees while the landmarks stay where the front sees them.

    References:
        Legan and Burstone, "Soft tissue cephalometric analysis for orthognathic surgery", Journal
        of Oral Surgery 38, 1980: facial convexity of adults 12 +- 4 degrees, 180 less the angle.
    """
    chosen = profile_vertices(head)
    brow, nose, chin = head.mean[chosen, 1].astype(float)
    stands = profile_weights(head, chosen)
    modes = head.identity_basis[:, chosen, 2].astype(float) @ stands
    # Both legs are steep: the angle lacks as much as the two slopes off that line, in radians.
    wanted = np.radians(180 - PROFILE) / (1 / (brow - nose) + 1 / (nose - chin))
    move = np.linalg.solve(cost_of_moves(head), modes)
    return (wanted - head.mean[chosen, 2] @ stands) / (modes @ move) * move


def profile_weights(head, chosen):
    """Weights [3] of the depths of `profile_vertices`: how far the subnasale stands before the line
    from glabella to pogonion."""
    brow, nose, chin = head.mean[chosen, 1].astype(float)
    share = (brow - nose) / (brow - chin)
    return np.array([share - 1, 1, -share])


def cost_of_moves(head):
    """Matrix [I, I] of a move's squared standard deviations, and of what the front sees of it."""
    _, basis, _ = at_landmarks(head)
    fronts = basis[..., :2].reshape(len(basis), -1)
    cost: np.ndarray = np.eye(len(basis)) + HELD / FACE * fronts @ fronts.T
    return cost


def _order(covariance, raw):
    """Eigenvalues and vectors of a covariance, in the order of how much they move the face."""
    weight = np.where((raw.mean[:, 2] > -40) & (raw.mean[:, 1] > -120), 1.0, 0.15)
    flat = (raw.sliders[: len(covariance)] * np.sqrt(weight)[:, None]).reshape(len(covariance), -1)
    metric = flat @ flat.T
    root = np.linalg.cholesky(covariance)
    strength, turn = np.linalg.eigh(root.T @ metric @ root)
    factors = root @ turn[:, ::-1]  # columns: modes of unit deviation, strongest first
    scale = np.linalg.norm(factors, axis=0)
    sign = np.sign(factors[np.abs(factors).argmax(0), np.arange(len(scale))])
    return scale**2, factors / scale * sign


def _posterior(shape, modes, expression, view, face):
    """Covariance [K, K] of the mode coefficients of one face, pose and expression unknown too."""
    turn = rotation.matrix(view.rotation)
    turned = shape @ turn.T
    there = turned + view.translation
    scale = 1 / (NOISE * face_size(face))
    P = cameras.projection_jacobian(there, view) * scale
    pose = np.concatenate([-np.einsum("nij,njk->nik", P, rotation.skew(turned)), P], -1)
    linear = np.einsum("nij,knj->nik", P, np.concatenate([modes, expression]) @ turn.T)
    J = np.concatenate([pose, linear], -1).reshape(2 * len(shape), -1)
    H = J.T @ J
    H[6:, 6:] += np.diag([1.0] * len(modes) + [2.5**2] * len(expression))
    H[:6, :6] += np.diag(np.full(6, 1e-6))
    return np.linalg.inv(H)[6 : 6 + len(modes), 6 : 6 + len(modes)]


# What else moves in a photographed smile, beside the smile itself.
HELPERS = (
    "jawOpen jawLeft jawRight mouthUpperUpLeft mouthUpperUpRight mouthLowerDownLeft "
    "mouthLowerDownRight mouthLeft mouthRight eyeBlinkLeft eyeBlinkRight eyeSquintLeft "
    "eyeSquintRight eyeWideLeft eyeWideRight browInnerUp browDownLeft browDownRight "
    "browOuterUpLeft browOuterUpRight cheekSquintLeft cheekSquintRight"
).split()
TOOTHY = 0.85  # mean weight that the wide smiles shall have


def smile_moves(raw, matrix, pairs):
    """How the points of people move from neutral to smile, seen from the front, mm.

    Args:
        raw: the prepared Raw; matrix: from `landmark_matrix`.
        pairs: [(neutral points [>= 468, 2], smiling points, size)].

    Returns:
        [N, 468, 2] mm along the head's x and y.
    """
    mean, modes, expression = (
        carry(matrix, values) for values in (raw.mean, raw.sliders, raw.expression)
    )
    found = [
        moves_between(mean, modes, 0.5 * expression, (neutral, size), (smiling, size))[1]
        for neutral, smiling, size in pairs
    ]
    return np.array(found)[..., :2]


def learn_smile(moves, helpers, mirror, wide, rounds=12, noise=0.7, doubt=0.3):
    """The one symmetric move that explains people's smiles best beside what helps it.

    Args:
        moves: [N, 468, 2] mm; helpers: [H, 468, 2] mm; mirror: [468] the point on the other side.
        wide: [N] bool, the smiles that show teeth.

    Returns:
        (smile [468, 2] mm at weight 1, weights [N], helper weights [N, H], rms of the rest mm).
    """
    smile = moves[wide].mean(0) / TOOTHY
    H = helpers.reshape(len(helpers), -1)
    for _ in range(rounds):
        smile = (smile + smile[mirror] * [-1, 1]) / 2
        basis = np.concatenate([smile.reshape(1, -1), H])
        prior = np.diag([0.0] + [(noise / doubt) ** 2 * 20] * len(H))
        solved = np.linalg.solve(basis @ basis.T + prior, basis @ moves.reshape(len(moves), -1).T).T
        solved = np.clip(solved, 0, 1.5)
        weights, other = solved[:, 0], solved[:, 1:]
        rest = moves - np.tensordot(other, helpers, 1)
        smile = np.tensordot(weights, rest, 1) / (weights**2).sum()
        scale = weights[wide].mean() / TOOTHY
        smile, weights = smile * scale, weights / scale
    rest = rest - weights[:, None, None] * smile
    return smile, weights, other, float(np.sqrt((rest**2).sum(-1).mean()))


def smile_amounts(moves, smile):
    """How much of a smile people's corners of the mouth show: [N], 1 as far as the smile's go.

    Args:
        moves: [N, 468, 2] mm, from `smile_moves`; smile: [468, 2] mm at weight 1.
    """
    corners = smile[MOUTH_CORNERS]
    return np.tensordot(moves[:, MOUTH_CORNERS], corners, 2) / (corners**2).sum()


def smile_field(raw, matrix, smile):
    """Spread a smile of the points over the control mesh, keeping the detail of the old shape.

    Args:
        raw: the prepared Raw; matrix: from `landmark_matrix`; smile: [468, 2] mm.

    Returns:
        [V, 3] mm, both sides at weight 1.
    """
    old = sum(raw.expression[EXPRESSION_INDEX["mouthSmile" + side]] for side in ("Left", "Right"))
    points, before = matrix @ raw.mean, matrix @ old
    # The jaw does not rise in a smile: what lies under the lower lip fades out toward the chin.
    lip, chin = points[17, 1], points[152, 1]
    target = smile * np.clip((points[:, 1] - chin) / (lip - chin), 0, 1)[:, None]
    share = float((target * before[:, :2]).sum() / (before[:, :2] ** 2).sum())
    quads = flesh_quads(raw)
    normal = matrix @ _normals(raw.mean, quads)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    outward = share * (before * normal).sum(1)
    facing = np.maximum(normal[:, 2], 0.45)
    depth = np.clip((outward - (target * normal[:, :2]).sum(1)) / facing, -6, 6)
    goal = np.concatenate([target, depth[:, None]], 1)
    guess = share * old
    out = guess + spread(raw, matrix, goal - matrix @ guess)
    out[np.setdiff1d(np.arange(len(out)), quads)] = 0
    return out


def spread(raw, matrix, goal, stiffness=0.5, anchor=2e-3):
    """Spread displacements of points smoothly over the flesh of the control mesh: [V, D], 0 elsewhere.

    Args:
        raw: the prepared Raw; matrix: [N, V] reads the points from its vertices; goal: [N, D] mm.
    """
    from scipy.sparse import coo_matrix, diags, identity
    from scipy.sparse.linalg import spsolve

    quads, V = flesh_quads(raw), len(raw.mean)
    sides = np.stack([quads, np.roll(quads, -1, axis=1)], -1).reshape(-1, 2)
    a = coo_matrix((np.ones(len(sides)), (sides[:, 0], sides[:, 1])), (V, V))
    a = ((a + a.T) > 0).astype(float).tocsr()
    degree = np.asarray(a.sum(1)).ravel()
    smooth = diags(1 / np.maximum(degree, 1)) @ a - identity(V)
    system = matrix.T @ matrix + stiffness * smooth.T @ smooth + anchor * identity(V)
    out: np.ndarray = spsolve(system.tocsc(), matrix.T @ goal).reshape(V, -1)
    return out


def flesh_quads(raw):
    """The quads of a Raw that expressions stretch: skin, cavity of the mouth, eye sockets."""
    return raw.quads[np.isin(raw.parts, ["skin", "mouth_cavity", "eye_socket"])]


def _normals(points, quads):
    """Unit vertex normals [V, 3] of a quad mesh."""
    from bakery.geometry.mesh import vertex_normals
    from bakery.heads.build.control import triangles_of

    return vertex_normals(points, triangles_of(quads))
