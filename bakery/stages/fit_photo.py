"""The photometric part of the fit: light, albedo and shape from the colours of the skin."""

from dataclasses import dataclass

import numpy as np

from bakery.geometry import camera as cameras
from bakery.geometry import harmonics, rotation
from bakery.stages import fit_landmarks as landmarks
from bakery.stages import fit_points as groups
from bakery.stages.fit_samples import choose_samples, pyramid, sample, visible_samples


@dataclass(frozen=True)
class Appearance:
    """Light and albedo of a fit."""

    light: np.ndarray  # [9, 3]
    albedo: np.ndarray  # [A] standard deviations


def photo_residual(corners, samples, camera, appearance, level):
    """Colours of the samples minus what the model says, and the Jacobian.

    Args:
        corners: [N, 3, 3] mm, head space, the three corners of each sample face.

    Returns:
        residual [N, 3] linear and Jacobian [N, 3, 6 + P + A + 27] float32: rotation, translation,
        shape (identity, expression), albedo, light ([9, 3] row by row).
    """
    turn = rotation.matrix(camera.rotation)
    turned = corners @ turn.T
    center = turned.mean(1)
    inside = center + camera.translation
    pixels = cameras.project_camera(inside, camera)
    pixels = (pixels - [level.left, level.top]) * level.scale
    color = sample(level.image, pixels)
    gradient = sample(level.gradient, pixels).reshape(-1, 2, 3).transpose(0, 2, 1)  # [N, 3, 2]
    first, second = turned[:, 1] - turned[:, 0], turned[:, 2] - turned[:, 0]
    normal = np.cross(first, second)
    length = np.linalg.norm(normal, axis=1)[:, None]
    normal = normal / length

    rows = harmonics.basis(normal)  # [N, 9]
    shade = rows @ appearance.light  # [N, 3]
    albedo = samples.albedo_mean + samples.albedo_modes @ appearance.albedo
    residual = color - albedo * shade

    # The colour's derivative by the sample's place, and the shading's by the unit normal.
    by_place = (gradient * level.scale) @ cameras.projection_jacobian(inside, camera)  # [N, 3, 3]
    by_normal = -albedo[:, :, None] * np.einsum(
        "nki,kc->nci", harmonics.basis_jacobian(normal), appearance.light
    )
    count, unknowns = len(corners), samples.basis.shape[2]
    modes = samples.albedo_modes.shape[2]
    jacobian = np.empty((count, 3, 6 + unknowns + modes + 27), np.float32)
    # A rotation d turns the place by d x p and the normal by d x n.
    jacobian[:, :, :3] = np.cross(center[:, None], by_place) + np.cross(normal[:, None], by_normal)
    jacobian[:, :, 3:6] = by_place
    # n = (a x b) / |a x b|:  q.(da x b) = da.(b x q),  q.(a x db) = db.(q x a), q without its
    # part along n.
    across = (
        by_normal - (by_normal * normal[:, None]).sum(-1, keepdims=True) * normal[:, None]
    ) / (length[..., None])
    by_first = np.cross(second[:, None], across)
    by_second = np.cross(across, first[:, None])
    by_corner = np.stack([-by_first - by_second, by_first, by_second], 2) + by_place[:, :, None] / 3
    by_corner = (by_corner @ turn).reshape(count, 3, 9).astype(np.float32)
    np.matmul(by_corner, samples.basis, out=jacobian[:, :, 6 : 6 + unknowns])
    jacobian[:, :, 6 + unknowns : -27] = -samples.albedo_modes * shade[..., None]
    lit = jacobian[:, :, -27:].reshape(count, 3, 9, 3)
    lit[:] = 0
    for channel in range(3):
        lit[:, channel, :, channel] = -albedo[:, channel, None] * rows
    jacobian[:, :, -27:] = lit.reshape(count, 3, 27)
    return residual, jacobian


def photo_terms(residual, jacobian, trust, weights):
    """Gradient, Hessian and value of w_c E_c: the mean length of the colour difference (IRLS)."""
    length = np.linalg.norm(residual, axis=1)
    total = max(trust.sum(), 1.0)
    weight = weights.photo * trust / (2 * total * np.maximum(length, weights.color_floor))
    root = np.sqrt(weight)[:, None].astype(np.float32)
    flat = (jacobian * root[..., None]).reshape(-1, jacobian.shape[2])
    right = (residual * root).astype(np.float32).ravel()
    value = weights.photo * float((trust * length).sum() / total) / 2
    return flat.T @ right, flat.T @ flat, value


def appearance_prior(appearance, basis, weights):
    """Gradient and Hessian of the prior on albedo and light, [A + 27].

    A light's distance from the basis's own is cheap in brightness and dear in colour, since a
    tint of the light and one of the skin look the same.
    """
    modes = len(appearance.albedo)
    hessian = np.zeros((modes + 27, modes + 27))
    hessian[np.arange(modes), np.arange(modes)] = weights.albedo
    grey = np.full((3, 3), 1 / 3)
    for k in range(9):
        at = slice(modes + 3 * k, modes + 3 * k + 3)
        hessian[at, at] = weights.light * grey + weights.tint * (np.eye(3) - grey)
    here = np.concatenate([appearance.albedo, (appearance.light - basis.light).ravel()])
    return weights.prior * (hessian @ here), weights.prior * hessian


@dataclass(frozen=True)
class Photometry:
    """What the photometric stage found."""

    appearance: Appearance
    residual: float  # mean length of the colour difference, linear, over the trusted samples
    samples: int  # how many samples the camera saw
    steps: tuple[int, ...]  # Gauss-Newton steps at each level


def fit_photo(head, model, camera, shape, photo, points, confidence, skin, basis, options):
    """Refine pose and shape, and find light and albedo, on the image pyramid.

    Args:
        head: HeadModel; model: its LandmarkModel.
        camera, shape: from the landmark stage.
        photo: Photo; points: [L, 2] pixels; confidence: [L]; skin: [H, W] 0..1 or None.
        basis: AlbedoBasis.
        options: FitOptions.

    Returns:
        camera, shape, Photometry.
    """
    weights = options.weights
    size = groups.face_size(points)
    points = points[: groups.FACE]
    root = landmarks.contour_weights(points, weights)
    root = root * np.sqrt(confidence[: groups.FACE])[:, None, None]
    appearance = Appearance(basis.light.astype(np.float64), np.zeros(len(basis.modes)))
    taken, value, seen = [], 0.0, 0
    levels = pyramid(photo, points, skin, options.level_widths)
    for level, steps, count in zip(levels, options.level_steps, options.level_samples):
        samples = choose_samples(head, model, basis, count)
        neutral = head.neutral(shape.identity)
        trust = visible_samples(head, neutral, shape.expression, camera, samples, level)
        if trust.sum() < 50:  # too little skin in sight to say anything about light
            break
        rest = resting_corners(head, shape, samples)
        if not taken:
            appearance = start_appearance(
                appearance, corners_of(rest, shape, model, samples), samples, camera, level, trust,
                basis, weights,
            )  # fmt: skip
        before, used, last = np.inf, 0, None
        while used < steps:
            corners = corners_of(rest, shape, model, samples)
            residual, jacobian = photo_residual(corners, samples, camera, appearance, level)
            g, h, energy = photo_terms(residual, jacobian, trust, weights)
            value, seen = 2 * energy / weights.photo, int((trust > 0.5).sum())
            energy += add_rest(
                g, h, model, camera, shape, appearance, points, root, size, basis, weights
            )
            if energy > before:
                camera, shape, appearance = last
            if energy > before * (1 - options.level_tolerance):
                break
            before, used, last = energy, used + 1, (camera, shape, appearance)
            move = landmarks.bounded_step(model, shape, g, h)
            camera, shape = landmarks.advance(model, camera, shape, move)
            at = 6 + samples.basis.shape[2]
            appearance = Appearance(
                appearance.light + move[-27:].reshape(9, 3), appearance.albedo + move[at:-27]
            )
        taken.append(used)
    return camera, shape, Photometry(appearance, value, seen, tuple(taken))


def add_rest(
    gradient, hessian, model, camera, shape, appearance, points, root, size, basis, weights
):
    """Add the landmark term and the priors to the photometric ones, in place.

    Returns:
        their energy.
    """
    g, h, energy = landmarks.landmark_terms(model, camera, shape, points, root, size, weights)
    prior_g, prior_h = landmarks.prior_terms(model, shape, weights)
    first = len(g)
    gradient[:first] += g + prior_g
    hessian[:first, :first] += h + prior_h
    light_g, light_h = appearance_prior(appearance, basis, weights)
    gradient[first:] += light_g
    hessian[first:, first:] += light_h
    # The priors are quadratic but for the linear cost of expressions.
    here = shape.identity[: model.modes]
    energy += weights.prior * weights.identity * float(here @ here) / 2
    energy += weights.prior * weights.albedo * float(appearance.albedo @ appearance.albedo) / 2
    return energy


def resting_corners(head, shape, samples):
    """Corners [N, 9] mm of the sample faces with the mean identity and only the eyes' look."""
    out = head.mean[samples.corners].astype(np.float64)
    for index in np.flatnonzero(shape.expression):
        if index not in groups.FITTED:
            out += shape.expression[index] * head.expression_basis[index][samples.corners]
    return out.reshape(len(out), 9)


def corners_of(rest, shape, model, samples):
    """Corners [N, 3, 3] mm of the sample faces."""
    unknowns = np.concatenate([shape.identity[: model.modes], shape.expression[groups.FITTED]])
    moved = rest + samples.basis @ unknowns.astype(np.float32)
    return moved.reshape(-1, 3, 3)


def start_appearance(appearance, corners, samples, camera, level, trust, basis, weights):
    """Light and albedo from the colours alone, the shape held."""
    first = 6 + samples.basis.shape[2]
    for _ in range(4):
        residual, jacobian = photo_residual(corners, samples, camera, appearance, level)
        g, h, _ = photo_terms(
            residual, np.ascontiguousarray(jacobian[:, :, first:]), trust, weights
        )
        prior_g, prior_h = appearance_prior(appearance, basis, weights)
        move = np.linalg.solve(h + prior_h, -(g + prior_g))
        appearance = Appearance(
            appearance.light + move[-27:].reshape(9, 3), appearance.albedo + move[:-27]
        )
    return appearance
