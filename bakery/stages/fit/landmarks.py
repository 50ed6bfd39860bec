"""The landmark part of the fit: pose, identity and expression from points alone."""

from dataclasses import dataclass, replace

import cv2
import numpy as np

from bakery import landmarks as marks
from bakery.errors import FitError
from bakery.geometry import camera as cameras
from bakery.geometry import rotation
from bakery.geometry.solve import minimize_partly_bounded
from bakery.settings import Settings, setting
from bakery.stages.fit import expressions as groups
from bakery.stages.fit import sideways
from bakery.stages.fit.lips import LOWER, UPPER, lip_rows, seam_offsets
from bakery.types import Camera

LEAST_POINTS = 12  # landmarks to place a head by
WEIGHT = (0, 1e4)  # range of a weight that may be nothing
SURE = (1e-3, 1e4)  # and of one without which the solution is not unique


@dataclass(frozen=True)
class Weights(Settings):
    """The energy of Saito sec. 3 and what this project adds to its regulariser.

    Landmark distances are measured in outer-eye-corner distances and colours as linear 0..1, which
    makes the paper's weights balance: 1% at every landmark costs as much as 40 units of prior.
    """

    # The paper has a weight of 1 on colours, which pulls real skin off its landmarks
    # (docs/log-fit.md).
    photo: float = setting(0.3, "of the colours", *WEIGHT)
    landmark: float = setting(10.0, "of the landmarks", *SURE)
    prior: float = setting(2.5e-5, "of everything below that says so", 1e-9, 1)
    identity: float = setting(10.0, "prior per squared deviation of an identity mode", *SURE)
    expression: float = setting(4.0, "prior per squared expression weight", *SURE)
    # Small weights stay exactly 0, and clear ones hardly shrink.
    sparse: float = setting(8.0, "prior per expression weight", *WEIGHT)
    concave: float = setting(0.2, "weight at which the cost `sparse` has halved", 1e-3, 1e3)
    twins: float = setting(20.0, "prior per squared difference of left and right", *WEIGHT)
    contour: float = setting(0.3, "of contour landmarks across the contour", *WEIGHT)
    slide: float = setting(0.03, "of contour landmarks along it", *WEIGHT)
    lips: float = setting(4.0, "of landmarks of the lips, over that of others", *SURE)
    opening: float = setting(6.0, "of the lips' opening, beside their points", *WEIGHT)
    width: float = setting(3.0, "of the mouth's width, beside its corners", *WEIGHT)
    rest: float = setting(
        30.0, "prior per squared mm by which identity opens the lips at rest", *WEIGHT
    )
    # What it is for: `sideways`. The share was found on portraits (docs/log-fit.md).
    sideways: float = setting(
        0.17, "share of how far landmarks on plain skin lie to a side that is believed", 0, 1
    )
    outlier: float = setting(
        0.03, "Huber threshold of landmarks", 1e-4, 10, unit="outer-eye-corner distances"
    )
    anchor: float = setting(
        100.0, "prior per squared change of a weight from what the landmarks alone said", *WEIGHT
    )
    albedo: float = setting(1.0, "prior per squared deviation of an albedo mode", *SURE)
    light: float = setting(
        4.0, "prior per squared change of the light's grey from the basis's own", *SURE
    )
    tint: float = setting(60.0, "prior per squared change of the light's colour", *SURE)
    color_floor: float = setting(
        0.01, "linear difference of colours below which it counts as a square", 1e-5, 1
    )


@dataclass(frozen=True)
class Shape:
    """What the fit solves for, apart from the camera."""

    identity: np.ndarray  # [I]
    expression: np.ndarray  # [E]


class LandmarkModel:
    """The rows of a head model that its landmarks need, ready for many solves."""

    def __init__(self, head, modes):
        vertices = head.landmark_vertices[: marks.FACE]  # [468, 3]
        weight = head.landmark_barycentric[: marks.FACE].astype(np.float64)

        def pick(basis):  # [.., V, 3] -> [.., 468, 3]
            return np.einsum("...lkc,lk->...lc", basis[..., vertices, :], weight)

        self.mean = pick(head.mean)
        self.rest = self.mean  # of the head model itself, whoever is fitted
        identity, expression = pick(head.identity_basis[:modes]), pick(head.expression_basis)
        columns = np.concatenate([identity, expression[groups.FITTED]])
        self.columns = np.ascontiguousarray(columns.transpose(1, 2, 0))  # [468, 3, I + E']
        self.modes = len(identity)
        self.twin = sideways.twins(head)
        self.opens = (identity[:, UPPER, 1] - identity[:, LOWER, 1]).T  # [9, I] mm, of the lips
        self.identity = identity.reshape(self.modes, -1)  # [I, 468 * 3]
        self.expression = expression.reshape(len(expression), -1)  # [E, 468 * 3]

    def points(self, shape):
        """Landmarks [468, 3] mm of a shape, eyes as the eyeLook* weights move the lids."""
        moved = shape.identity[: self.modes] @ self.identity + shape.expression @ self.expression
        return self.mean + moved.reshape(-1, 3)


def start_camera(model, points, confidence, focal, width, height):
    """Place the mean head by perspective-n-point.

    Raises:
        FitError: too few landmarks, or no pose puts the head in front of the camera.
    """
    center = np.array([width / 2, height / 2])
    used = confidence[: marks.FACE] > 0
    used[marks.OVAL] &= used.sum() < 60  # the contour slides; without others it must serve
    if used.sum() < LEAST_POINTS:
        raise FitError(
            f"{used.sum()} landmarks have a confidence above 0, at least {LEAST_POINTS} are needed; "
            "check the landmark file"
        )
    intrinsic = np.array([[focal, 0, center[0]], [0, focal, center[1]], [0, 0, 1.0]])
    found, vector, translation = cv2.solvePnP(
        model.mean[used], points[: marks.FACE][used], intrinsic, None, flags=cv2.SOLVEPNP_SQPNP
    )
    flip = np.diag([1.0, -1.0, -1.0])  # OpenCV looks along +z with y down
    if not found or translation[2, 0] <= 0:
        raise FitError("the landmarks fit no head in front of a camera; check the landmark file")
    return Camera(
        focal=float(focal),
        center=center,
        rotation=rotation.vector(flip @ rotation.matrix(vector)),
        translation=flip @ translation[:, 0],
        width=int(width),
        height=int(height),
    )


def contour_weights(points, weights):
    """Square-root weight matrices [468, 2, 2] of the landmarks: the contour may slide."""
    out = np.tile(np.eye(2), (marks.FACE, 1, 1))
    oval = points[marks.OVAL]
    tangent = np.roll(oval, -1, 0) - np.roll(oval, 1, 0)
    tangent /= np.maximum(np.linalg.norm(tangent, axis=1, keepdims=True), 1e-9)
    normal = np.stack([-tangent[:, 1], tangent[:, 0]], 1)
    out[marks.OVAL] = np.sqrt(weights.contour) * np.einsum("ni,nj->nij", normal, normal)
    out[marks.OVAL] += np.sqrt(weights.slide) * np.einsum("ni,nj->nij", tangent, tangent)
    return out


@dataclass(frozen=True)
class Seen:
    """The points of one photo, ready for many steps."""

    points: np.ndarray  # [468, 2] pixels
    confidence: np.ndarray  # [468] 0..1
    root: np.ndarray  # [468, 2, 2] square-root weights: the contour may slide, lips count more
    seam: np.ndarray  # [468, 3] mm, see `lips.seam_offsets`
    aside: np.ndarray  # [2] unit vector from the right eye to the left
    size: float  # outer-eye-corner distance, pixels


def see(model, points, confidence, weights):
    """Seen of points [L, 2] pixels with their confidence [L] 0..1."""
    points, confidence = points[: marks.FACE], confidence[: marks.FACE]
    root = contour_weights(points, weights) * np.sqrt(confidence)[:, None, None]
    # The mean is over points as they are: heavier lips must not make brows lighter.
    root *= np.sqrt(2 * weights.landmark / (root**2).sum())
    root[marks.LIPS] *= np.sqrt(weights.lips)
    seam = seam_offsets(model.rest, points)
    right, left = points[marks.EYE_CORNERS]
    size = float(marks.face_size(points))
    return Seen(points, confidence, root, seam, (left - right) / max(size, 1e-9), size)


def landmark_residual(model, camera, shape, points, seam=0.0):
    """Distances of the projected landmarks from where they were seen, and their Jacobian.

    Args:
        points: [468, 2] pixels.
        seam: [468, 3] mm, how far from the landmarks these are seen.

    Returns:
        residual [468, 2] pixels and Jacobian [468, 2, 6 + I + E']: rotation (left-multiplied, head
        to camera), translation, identity, the expressions `fit_points.FITTED`.
    """
    turn = rotation.matrix(camera.rotation)
    turned = (model.points(shape) + seam) @ turn.T
    inside = turned + camera.translation
    by_point = cameras.projection_jacobian(inside, camera)  # [468, 2, 3]
    jacobian = np.empty((marks.FACE, 2, 6 + model.columns.shape[2]))
    jacobian[:, :, :3] = -by_point @ rotation.skew(turned)
    jacobian[:, :, 3:6] = by_point
    np.matmul(by_point @ turn, model.columns, out=jacobian[:, :, 6:])
    return cameras.project_camera(inside, camera) - points, jacobian


def prior_terms(model, shape, weights, anchor=None):
    """Gradient [6 + I + E'] and Hessian of the regulariser at a shape, and its energy.

    That is `prior` times (identity |a|^2 + expression |w|^2 + twins |left - right|^2) / 2
    + sparse concave sum(log(1 + w / concave)). All terms of the fit are halved, so that gradients carry no twos. `anchor` [E]
    holds expressions near given ones: low-frequency albedo would explain a brow by lifting it.
    """
    first, count = 6 + model.modes, len(groups.FITTED)
    size = first + count
    hessian = np.zeros((size, size))
    diagonal = np.concatenate(
        [np.zeros(6), np.full(model.modes, weights.identity), np.full(count, weights.expression)]
    )
    hessian[np.diag_indices(size)] = diagonal
    hessian[6:first, 6:first] += weights.rest / len(UPPER) * model.opens.T @ model.opens
    for a, b in groups.TWINS:
        a, b = a + first, b + first
        hessian[a, a] += weights.twins
        hessian[b, b] += weights.twins
        hessian[a, b] -= weights.twins
        hessian[b, a] -= weights.twins
    here = np.concatenate(
        [np.zeros(6), shape.identity[: model.modes], shape.expression[groups.FITTED]]
    )
    gradient = hessian @ here
    energy = here @ gradient / 2
    cost = weights.sparse * groups.RELUCTANCE
    saturated = 1 + here[first:] / weights.concave
    gradient[first:] += cost / saturated
    energy += weights.concave * cost @ np.log(saturated)
    if anchor is not None:
        change = here[first:] - anchor[groups.FITTED]
        gradient[first:] += weights.anchor * change
        hessian[np.arange(first, size), np.arange(first, size)] += weights.anchor
        energy += weights.anchor * (change @ change) / 2
    hessian[3:6, 3:6] += 1e-9 * np.eye(3)
    return weights.prior * gradient, weights.prior * hessian, weights.prior * float(energy)


def landmark_terms(model, camera, shape, seen, weights):
    """Gradient and Gauss-Newton Hessian of w_lan E_lan, and the energy itself.

    Args:
        seen: Seen.
    """
    residual, jacobian = landmark_residual(model, camera, shape, seen.points, seen.seam)
    lip_residual, lip_jacobian = lip_rows(residual, jacobian, seen, weights)
    residual, jacobian = (
        sideways.believed(each, model.twin, weights.sideways, seen.aside)
        for each in (residual, jacobian)
    )
    root = seen.root / seen.size
    length = np.linalg.norm(residual, axis=1) / seen.size
    huber = np.sqrt(np.minimum(1, weights.outlier / np.maximum(length, 1e-12)))  # IRLS
    root = root * huber[:, None, None]
    residual = np.matmul(root, residual[:, :, None]).ravel()
    jacobian = np.matmul(root, jacobian).reshape(len(residual), -1)
    residual = np.concatenate([residual, lip_residual])
    jacobian = np.concatenate([jacobian, lip_jacobian])
    return jacobian.T @ residual, jacobian.T @ jacobian, float(residual @ residual) / 2


def advance(model, camera, shape, step):
    """Camera and shape after a step [6 + I + E' (+ more)] of the unknowns."""
    turn = rotation.matrix(step[:3]) @ rotation.matrix(camera.rotation)
    camera = replace(
        camera, rotation=rotation.vector(turn), translation=camera.translation + step[3:6]
    )
    first = 6 + model.modes
    identity = shape.identity.copy()
    identity[: model.modes] += step[6:first]
    expression = shape.expression.copy()
    expression[groups.FITTED] += step[first : first + len(groups.FITTED)]
    expression[groups.FITTED] = np.clip(expression[groups.FITTED], 0, 1)
    return camera, Shape(identity, expression)


def bounded_step(model, shape, gradient, hessian, rivals=groups.RIVALS):
    """One Gauss-Newton step that keeps expressions in 0..1 and antagonists (`rivals`) apart."""
    first, count = 6 + model.modes, len(groups.FITTED)
    here = shape.expression[groups.FITTED]
    return minimize_partly_bounded(
        hessian, gradient, np.arange(first, first + count), -here, 1 - here, rivals
    )


def fit_points(model, camera, shape, points, confidence, weights, steps=8, rivals=groups.RIVALS):
    """Gauss-Newton on landmarks and prior.

    Args:
        model: LandmarkModel.
        camera, shape: first guess.
        points: [L, 2] pixels; confidence: [L] 0..1.
        steps: at most; stops when no landmark moves by more than 0.01% of the face.
        rivals: pairs of places in `fit_points.FITTED` that exclude each other.

    Returns:
        camera, shape.
    """
    seen = see(model, points, confidence, weights)
    before = None
    for _ in range(steps):
        g, h, _ = landmark_terms(model, camera, shape, seen, weights)
        prior_g, prior_h, _ = prior_terms(model, shape, weights)
        step = bounded_step(model, shape, g + prior_g, h + prior_h, rivals)
        camera, shape = advance(model, camera, shape, step)
        after = cameras.project(model.points(shape), camera)
        if before is not None and np.abs(after - before).max() < 1e-4 * seen.size:
            break
        before = after
    return camera, shape
