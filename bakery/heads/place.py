"""Fitting a head to landmarks alone: pose, identity and expression, linear in the last two."""

from dataclasses import dataclass, replace

import cv2
import numpy as np

from bakery.geometry import camera as cameras
from bakery.geometry import rotation
from bakery.landmarks import FACE, face_size
from bakery.types import Camera

FOCAL = 2.0  # image widths; cannot be seen from the points of one face
SIGMA = 0.005  # outer-eye-corner distances: how far a point may miss
# Points that a smile leaves alone: forehead, bridge of the nose, temples, eye corners.
STILL = np.array(
    [10, 338, 297, 332, 284, 251, 109, 67, 103, 54, 21, 151, 9, 8, 168, 6, 197, 33, 133, 263, 362]
    + [127, 356, 162, 389]
)


@dataclass(frozen=True)
class Placed:
    """A head fitted to one set of points."""

    camera: Camera
    identity: np.ndarray  # [I]
    expression: np.ndarray  # [E]
    error: np.ndarray  # [468] distances, in outer-eye-corner distances


def first_pose(shape, points, size):
    """A camera that puts 3D points [N, 3] near pixels [N, 2] of an image (width, height)."""
    focal = FOCAL * max(size)
    matrix = np.array([[focal, 0, size[0] / 2], [0, focal, size[1] / 2], [0, 0, 1]], float)
    turn = np.diag([1.0, -1.0, -1.0])  # OpenCV looks along +z with y down
    _, rvec, tvec = cv2.solvePnP(
        np.ascontiguousarray(shape, float),
        np.ascontiguousarray(points, float),
        matrix,
        None,
        flags=cv2.SOLVEPNP_SQPNP,
    )
    return Camera(
        focal,
        np.array([size[0] / 2, size[1] / 2]),
        rotation.vector(turn @ rotation.matrix(rvec)),
        turn @ tvec[:, 0],
        *size,
    )


def place(mean, identity, expression, points, size, modes=None, sigma=SIGMA, steps=10):
    """Fit pose, identity and expression to points by damped Gauss-Newton with bounds.

    Args:
        mean: [N, 3] mm the points on the mean head; identity: [I, N, 3]; expression: [E, N, 3].
        points: [N, 2] pixels; size: (width, height).
        modes: how many identity modes to use; 0 expressions are used when `expression` is None.

    Returns:
        (Camera, identity [I], expression [E], distances [N] pixels).
    """
    M = len(identity) if modes is None else modes
    basis = identity[:M] if expression is None else np.concatenate([identity[:M], expression])
    E = len(basis) - M
    view = first_pose(mean, points, size)
    scale = 1 / (sigma * np.linalg.norm(points.max(0) - points.min(0)) * 0.5)
    x = np.zeros(len(basis))
    prior = np.concatenate([np.ones(M), np.full(E, 2.5)])
    for _ in range(steps):
        shape = mean + np.tensordot(x, basis, 1)
        turn = rotation.matrix(view.rotation)
        turned = shape @ turn.T
        there = turned + view.translation
        residual = (cameras.project_camera(there, view) - points) * scale
        P = cameras.projection_jacobian(there, view) * scale
        pose = np.concatenate([-np.einsum("nij,njk->nik", P, rotation.skew(turned)), P], -1)
        linear = np.einsum("nij,knj->nik", P, basis @ turn.T)
        J = np.concatenate([pose, linear], -1).reshape(-1, 6 + len(x))
        H, g = J.T @ J, J.T @ residual.ravel()
        H[np.arange(6), np.arange(6)] *= 1 + 1e-6
        rows = 6 + np.arange(len(x))
        H[rows, rows] += prior**2
        g[rows] += prior**2 * x
        # Weights that would leave 0..1 are held at the bound and the rest solved again.
        delta, free = np.zeros(len(H)), np.ones(len(H), bool)
        for _ in range(8):
            held = ~free
            delta[free] = np.linalg.solve(
                H[np.ix_(free, free)], -g[free] - H[np.ix_(free, held)] @ delta[held]
            )
            wanted = x + delta[6:]
            bounded = np.concatenate([wanted[:M], np.clip(wanted[M:], 0, 1)])
            out = np.concatenate([np.zeros(6, bool), np.abs(bounded - wanted) > 1e-9]) & free
            if not out.any():
                break
            delta[6:] = np.where(out[6:], bounded - x, delta[6:])
            free &= ~out
        x = np.concatenate([(x + delta[6:])[:M], np.clip((x + delta[6:])[M:], 0, 1)])
        view = replace(
            view,
            rotation=rotation.vector(rotation.matrix(delta[:3]) @ turn),
            translation=view.translation + delta[3:6],
        )
    shape = mean + np.tensordot(x, basis, 1)
    miss = np.linalg.norm(cameras.project(shape, view) - points, axis=1)
    full = np.zeros(len(identity))
    full[:M] = x[:M]
    return view, full, x[M:], miss


def place_head(head, points, size, sigma=SIGMA):
    """Fit a head that has landmarks to 468 points [>= 468, 2] pixels: Placed."""
    points = np.asarray(points, float)[:FACE, :2]
    view, identity, expression, miss = place(*at_landmarks(head), points, size, sigma=sigma)
    return Placed(view, identity, expression, miss / face_size(points))


def at_landmarks(head):
    """Mean [468, 3], identity [I, 468, 3] and expression [E, 468, 3] of a head at its landmarks, mm."""
    near, weights = head.landmark_vertices[:FACE], head.landmark_barycentric[:FACE]
    return tuple(
        np.einsum("...lkc,lk->...lc", values[..., near, :], weights).astype(float)
        for values in (head.mean, head.identity_basis, head.expression_basis)
    )


def moves_between(mean, identity, expression, rest, moved):
    """How the points of a person move from one photo to another, in the plane that the front sees.

    The person is fitted to the first photo, and placed in the second by what a smile leaves alone.

    Args:
        mean, identity, expression: as for `place`, of the 468 points.
        rest, moved: (points [>= 468, 2] pixels, (width, height)) of each photo.

    Returns:
        (points [468, 3] mm of the first photo on the head, how they move [468, 3] mm).
    """
    (first, size), (second, other) = rest, moved
    size, other = tuple(map(int, size)), tuple(map(int, other))
    view, coefficients, weights, _ = place(mean, identity, expression, first[:FACE], size)
    shape = mean + np.tensordot(coefficients, identity, 1) + np.tensordot(weights, expression, 1)
    shape = shape + offsets_from(shape, view, first[:FACE])
    none = np.zeros((0, len(STILL), 3))
    turned = place(shape[STILL], none, None, second[STILL], other)[0]
    return shape, offsets_from(shape, turned, second[:FACE])


def offsets_from(shape, view, points):
    """How points [N, 3] mm move in the picture's plane to be seen at pixels [N, 2]: [N, 3] mm."""
    pixels = points - cameras.project(shape, view)
    depth = -cameras.to_camera(shape, view)[:, 2]
    flat = np.stack([pixels[:, 0], -pixels[:, 1], 0 * depth], -1) * (depth / view.focal)[:, None]
    return flat @ rotation.matrix(view.rotation)
