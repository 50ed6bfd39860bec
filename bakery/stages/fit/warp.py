"""A smooth warp of the head that carries its landmarks where the photo shows them."""

from dataclasses import dataclass

import numba
import numpy as np

from bakery import landmarks as marks
from bakery.geometry import mesh
from bakery.heads.base import HeadModel
from bakery.memo import once_per_object
from bakery.types import EXPRESSION_INDEX

REACH = 22.0  # mm, length scale of the displacement field; three of them away it is nearly gone
FINE = 7.0  # mm, a second, shorter scale, so that lids and lips can follow their own landmarks
FINE_SHARE = 0.15  # of the variance that the short scale has
FOLDS_FROM = 0.5  # sum of weights from which a face of skin is watched for folding
SLIVER = 0.03  # mm2; smaller faces, as deep in the corner of the mouth, may turn over unseen
ROWS = 256  # of a covariance that are worked out together
NOISE = 0.02  # share of the variance at a landmark of full confidence


def kernel(a, b):
    """Covariance [A, B] of the displacement between points [A, D] and [B, D] mm.

    A sum of two Matern-3/2 kernels: once differentiable, so no crease, and fading with distance.
    Computed in the precision of `a`: single is six times faster and good to 0.03 mm.
    """
    b = b.astype(a.dtype)
    square = (a**2).sum(1)[:, None] + (b**2).sum(1)[None] - 2 * a @ b.T
    distance = np.sqrt(np.maximum(square, 0))

    found = np.empty_like(distance)
    for low in range(0, len(distance), ROWS):  # in place, and little enough to stay in the cache
        part = slice(low, low + ROWS)
        near = _matern(distance[part], FINE)
        near *= FINE_SHARE
        wide = _matern(distance[part], REACH)
        wide *= 1 - FINE_SHARE
        np.add(wide, near, out=found[part])
    return found


def _matern(distance, scale):
    """The Matern-3/2 kernel of one scale, (1 + r) exp(-r)."""
    ratio = distance * (3**0.5 / scale)
    fade = np.exp(-ratio)
    ratio += 1
    ratio *= fade
    return ratio


def opened(head):
    """Vertices [V, 3] mm of the mean head with mouth and eyes wide open.

    Distances measured there keep the lips, and the lids, apart: what opens counts as distance, so
    that a warp of one lip leaves the other alone (a closed mouth would be welded).
    """
    out = head.mean.astype(np.float64)
    for name in ("jawOpen", "eyeWideLeft", "eyeWideRight"):
        out = out + head.expression_basis[EXPRESSION_INDEX[name]]
    return out


def smooth_residual(head, seen, confidence):
    """The smooth field at the landmarks that explains their displacements best.

    Args:
        seen: [468, 3] mm, head space, displacement each landmark asks for.
        confidence: [468] 0..1; 0 leaves a landmark to its neighbours.

    Returns:
        [468, 3] mm.
    """
    prior = warp_weights(head).prior
    noise = NOISE / np.clip(confidence, 1e-3, 1) ** 2
    return prior @ np.linalg.solve(prior + np.diag(noise), seen)


def residual_offsets(
    head: HeadModel, residual: np.ndarray, identity: np.ndarray | None = None
) -> np.ndarray:
    """Displacement of every vertex that moves the landmarks of the neutral head by `residual`.

    Teeth, gums and tongue move rigidly, the upper ones with the base of the nose, the lower ones
    with the chin; eyeballs and their caps move with the middle of their lids; the mouth sheet spans
    the moved lips. Far from the face nothing moves.

    Args:
        head: HeadModel.
        residual: [468, 3] mm, head space (`Fit.residual`).
        identity: not used; the weights depend on the mean head alone, so that they can be kept.

    Returns:
        offsets [V, 3] float32 mm, for `HeadModel.neutral`.
    """
    offsets = np.zeros(head.mean.shape, np.float32)
    residual = np.asarray(residual, np.float32)
    if residual.any():
        weights = warp_weights(head)
        offsets[weights.rows] = weights.matrix @ residual
    return offsets


@dataclass(frozen=True)
class WarpWeights:
    """How the landmarks of one head move its vertices."""

    rows: np.ndarray  # [R] the vertices that move
    matrix: np.ndarray  # [R, 468] float32, weight of each landmark
    prior: np.ndarray  # [468, 468] covariance of the landmarks
    skin: np.ndarray  # [S] the vertices of skin that could fold
    skin_matrix: np.ndarray  # [S, 468] float32, their weights
    faces: np.ndarray  # [F', 3] the faces of skin that could fold, into `skin`


@once_per_object
def warp_weights(head):
    """WarpWeights of a head."""
    vertices = opened(head)
    corners = head.landmark_vertices[: marks.FACE]
    weight = head.landmark_barycentric[: marks.FACE].astype(np.float64)
    points = np.einsum("lkc,lk->lc", vertices[corners], weight)
    prior = kernel(points, points)
    field = kernel(vertices.astype(np.float32), points)  # [V, 468]

    def at_landmarks(matrix):
        return np.einsum("lkn,lk->ln", matrix[corners], weight)

    # Landmarks lie inside faces, whose corners the field moves: solve for what they do move.
    # The small ridge bounds the weights where two landmarks nearly coincide.
    carried = at_landmarks(field)
    carried = (carried + carried.T) / 2
    matrix = field @ np.linalg.inv(carried + 1e-3 * np.eye(marks.FACE)).astype(np.float32)
    for part, anchors in (
        ("teeth_upper gums_upper", marks.NOSE_BASE),
        ("teeth_lower gums_lower tongue", marks.CHIN),
        ("eye_left eye_cap_left", marks.EYE_LEFT),
        ("eye_right eye_cap_right", marks.EYE_RIGHT),
    ):
        rigid = head.part_vertices(*part.split())
        matrix[rigid] = 0
        matrix[np.ix_(rigid, np.asarray(anchors))] = 1 / len(anchors)
    matrix = _span_sheet(head, matrix)
    matrix = matrix.astype(np.float32)
    strength = np.abs(matrix).sum(1)
    rows = np.flatnonzero(strength > 1e-2)
    faces = head.faces[head.part_faces("skin")]
    faces = faces[(strength[faces] > FOLDS_FROM).any(1)]
    area = np.linalg.norm(mesh.face_normals(head.mean, faces), axis=1) / 2
    faces = faces[area > SLIVER]
    skin, faces = np.unique(faces, return_inverse=True)
    return WarpWeights(rows, matrix[rows], prior, skin, matrix[skin], faces.reshape(-1, 3))


def _span_sheet(head, matrix):
    """Let the inside of the mouth sheet follow its rim: harmonic on its own edges."""
    faces = head.faces[head.part_faces("mouth_sheet")]
    if not len(faces):
        return matrix
    inside = np.unique(faces)
    rim = np.unique(np.concatenate(mesh.boundary_loops(faces)))
    inside = np.setdiff1d(inside, rim)
    place = np.full(len(matrix), -1)
    place[inside] = np.arange(len(inside))
    system = np.zeros((len(inside), len(inside)))
    right = np.zeros((len(inside), matrix.shape[1]))
    for a, b in mesh.edges(faces):
        for here, there in ((a, b), (b, a)):
            if place[here] < 0:
                continue
            system[place[here], place[here]] += 1
            if place[there] < 0:
                right[place[here]] += matrix[there]
            else:
                system[place[here], place[there]] -= 1
    matrix[inside] = np.linalg.solve(system, right)
    return matrix


def unfolded_residual(head, reference, seen, confidence, rounds=8):
    """The smoothed residual, smoothed more around every face of skin that it would fold.

    Args:
        reference: [V, 3] mm, the neutral shape before the warp.
        seen: [468, 3] mm, displacement each landmark asks for.
        confidence: [468] 0..1.
        rounds: at most; what still folds then is left to a residual of zero nearby.

    Returns:
        [468, 3] mm.
    """
    weights = warp_weights(head)
    trust = np.array(confidence, np.float64)
    landmarks = head.landmarks(reference)[: marks.FACE].astype(np.float32)
    before = reference[weights.skin].astype(np.float32)
    for turn in range(rounds):
        residual = smooth_residual(head, seen, trust)
        after = before + weights.skin_matrix @ residual.astype(np.float32)
        bad = folded(after, weights.faces, before)
        if not len(bad):
            break
        centers = before[weights.faces[bad]].mean(1)
        square = ((landmarks[:, None] - centers[None]) ** 2).sum(-1).min(1)
        near = 1 / (1 + square / (4.0 + 3.0 * turn) ** 2)  # 1 at the fold, half 4 mm away
        trust *= 1 - 0.8 * near
    return residual


def folded(vertices, faces, reference, cosine=0.1):
    """Indices of faces [N] whose normal turned away from where it pointed before the warp.

    Args:
        vertices, reference: [V, 3] after and before.
        cosine: largest cosine between the two normals that still counts as folded.
    """
    return np.flatnonzero(_cosines(vertices, reference, faces) <= cosine)


@numba.njit(cache=True, nogil=True)
def _normal(shape, a, b, c):
    ux, uy, uz = shape[b, 0] - shape[a, 0], shape[b, 1] - shape[a, 1], shape[b, 2] - shape[a, 2]
    vx, vy, vz = shape[c, 0] - shape[a, 0], shape[c, 1] - shape[a, 1], shape[c, 2] - shape[a, 2]
    return uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx


@numba.njit(cache=True, nogil=True)
def _cosines(after, before, faces):
    """Cosine [F] between the normals of each face on two shapes; 1 where a face has no area."""
    out = np.ones(len(faces), after.dtype)
    for f in range(len(faces)):
        a, b, c = faces[f]
        ax, ay, az = _normal(after, a, b, c)
        bx, by, bz = _normal(before, a, b, c)
        length = np.sqrt((ax * ax + ay * ay + az * az) * (bx * bx + by * by + bz * bz))
        if length > 0:
            out[f] = (ax * bx + ay * by + az * bz) / length
    return out
