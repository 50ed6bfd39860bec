"""The photometric part of the fit: light, albedo and shape from the colours of the skin."""

from dataclasses import dataclass, replace

import numpy as np

from bakery.geometry import camera as cameras
from bakery.geometry import harmonics, rotation
from bakery.geometry.color import LUMA
from bakery.stages.fit import expressions as groups
from bakery.stages.fit import landmarks
from bakery.stages.fit.samples import choose_samples, pyramid, sample, visible_samples
from bakery.types import Camera

LEAST_SAMPLES = 50  # fewer say nothing about light
DARK = 0.6


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
    """Gradient and Hessian [A + 27] of the prior on albedo and light, and its energy.

    A light's distance from the basis's own is cheap in brightness and dear in colour, since a
    tint of the light and one of the skin look the same.
    """
    modes = len(appearance.albedo)
    hessian = np.zeros((modes + 27, modes + 27))
    hessian[np.arange(modes), np.arange(modes)] = weights.prior * weights.albedo
    grey = np.full((3, 3), 1 / 3)
    for k in range(9):
        at = slice(modes + 3 * k, modes + 3 * k + 3)
        hessian[at, at] = weights.prior * (weights.light * grey + weights.tint * (np.eye(3) - grey))
    here = np.concatenate([appearance.albedo, (appearance.light - basis.light).ravel()])
    return hessian @ here, hessian, float(here @ hessian @ here) / 2


@dataclass(frozen=True)
class State:
    """All unknowns of the fit."""

    camera: Camera
    shape: landmarks.Shape
    appearance: Appearance


@dataclass(frozen=True)
class Photometry:
    """What the photometric stage found."""

    appearance: Appearance
    residual: float  # mean length of the colour difference, linear, over the trusted samples
    samples: int  # how many samples the camera saw
    shadow: float  # share of those on plain skin that are far darker than smooth light makes them
    steps: tuple[int, ...]  # Gauss-Newton steps at each level


class Energy:
    """E = w_c E_c + w_lan E_lan + w_reg E_reg of one photo, with its derivatives."""

    def __init__(self, head, model, points, confidence, anchor, basis, weights):
        self.anchor = anchor
        self.head, self.model, self.basis, self.weights = head, model, basis, weights
        self.seen = landmarks.see(model, points, confidence, weights)

    def look_at(self, level, samples, state):
        """Take a level of the pyramid; how far each sample is seen is settled here."""
        self.level, self.samples = level, samples
        neutral = self.head.neutral(state.shape.identity)
        self.trust = visible_samples(
            self.head, neutral, state.shape.expression, state.camera, samples, level
        )
        # Corners of the sample faces with the identity that is held and only the eyes' look.
        held = state.shape.identity.copy()
        held[: self.model.modes] = 0
        rest = self.head.neutral(held)[samples.corners].astype(np.float64)
        for index in np.setdiff1d(np.flatnonzero(state.shape.expression), groups.FITTED):
            weight = state.shape.expression[index]
            rest += weight * self.head.expression_basis[index][samples.corners]
        self.rest = rest.reshape(len(rest), 9)

    def corners(self, shape):
        """Corners [N, 3, 3] mm of the sample faces."""
        modes = self.model.modes
        unknowns = np.concatenate([shape.identity[:modes], shape.expression[groups.FITTED]])
        moved = self.rest + self.samples.basis @ unknowns.astype(np.float32)
        return moved.reshape(-1, 3, 3)

    def colors(self, state):
        """`photo_residual` of a state."""
        return photo_residual(
            self.corners(state.shape), self.samples, state.camera, state.appearance, self.level
        )

    def terms(self, state):
        """Gradient and Hessian [6 + P + A + 27], the energy, and the colour residual [N, 3]."""
        residual, jacobian = self.colors(state)
        gradient, hessian, energy = photo_terms(residual, jacobian, self.trust, self.weights)
        first = jacobian.shape[2] - 27 - len(state.appearance.albedo)
        parts = [
            landmarks.landmark_terms(
                self.model, state.camera, state.shape, self.seen, self.weights
            ),
            landmarks.prior_terms(self.model, state.shape, self.weights, self.anchor),
            appearance_prior(state.appearance, self.basis, self.weights),
        ]  # fmt: skip
        places = (slice(0, first), slice(0, first), slice(first, None))
        for (part_gradient, part_hessian, part_energy), at in zip(parts, places):
            gradient[at] += part_gradient
            hessian[at, at] += part_hessian
            energy += part_energy
        return gradient, hessian, energy, residual

    def advance(self, state, step):
        """The state after a step of all unknowns."""
        first = 6 + self.samples.basis.shape[2]
        camera, shape = landmarks.advance(self.model, state.camera, state.shape, step)
        return State(camera, shape, moved(state.appearance, step[first:]))


def moved(appearance, step):
    """Appearance after a step [A + 27]."""
    return Appearance(appearance.light + step[-27:].reshape(9, 3), appearance.albedo + step[:-27])


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
    energy = Energy(head, model, points, confidence, shape.expression, basis, options.weights)
    start = Appearance(basis.light.astype(np.float64), np.zeros(len(basis.modes)))
    state = State(camera, shape, start)
    taken, residual, last = [], None, None
    levels = pyramid(photo, points, skin, options.level_widths)
    for level, steps, count in zip(levels, options.level_steps, options.level_samples):
        samples = choose_samples(head, model.modes, basis, count)
        energy.look_at(level, samples, state)
        if energy.trust.sum() < LEAST_SAMPLES:
            if last:  # what was found is of the level before
                energy.look_at(*last, state)
            break
        last = level, samples
        if not taken:
            state = start_appearance(energy, state)
        state, residual, used = descend(energy, state, steps, options.level_tolerance)
        taken.append(used)
    if residual is None:
        return camera, shape, Photometry(start, 0.0, 0, 0.0, ())
    total = max(energy.trust.sum(), 1.0)
    found = Photometry(
        appearance=state.appearance,
        residual=float((energy.trust * np.linalg.norm(residual, axis=1)).sum() / total),
        samples=int((energy.trust > 0.5).sum()),
        shadow=dark_share(energy, state, residual),
        steps=tuple(taken),
    )
    return state.camera, state.shape, found


def descend(energy, state, steps, tolerance):
    """Gauss-Newton until a step saves less than `tolerance` of the energy.

    Returns:
        state, its colour residual [N, 3], steps taken.
    """
    gradient, hessian, value, residual = energy.terms(state)
    for used in range(steps):
        step = landmarks.bounded_step(energy.model, state.shape, gradient, hessian)
        trial = energy.advance(state, step)
        gradient, hessian, after, trial_residual = energy.terms(trial)
        if after > value:
            return state, residual, used
        saved, value = value - after, after
        state, residual = trial, trial_residual
        if saved < tolerance * value:
            break
    return state, residual, used + 1


def start_appearance(energy, state, rounds=4):
    """Light and albedo from the colours alone, the shape held."""
    first = 6 + energy.samples.basis.shape[2]
    for _ in range(rounds):
        residual, jacobian = energy.colors(state)
        by_look = np.ascontiguousarray(jacobian[:, :, first:])
        g, h, _ = photo_terms(residual, by_look, energy.trust, energy.weights)
        prior_g, prior_h, _ = appearance_prior(state.appearance, energy.basis, energy.weights)
        step = np.linalg.solve(h + prior_h, -(g + prior_g))
        state = replace(state, appearance=moved(state.appearance, step))
    return state


def light_of(head, model, camera, shape, photo, points, basis, options):
    """The light [9, 3] of a picture in which the head is known to stand; shape and camera are held.

    Args:
        camera, shape: of the picture; photo: Photo; points: [L, 2] pixels; as in `fit_photo`.
    """
    weights, sure = options.weights, np.ones(len(points))
    energy = Energy(head, model, points, sure, shape.expression, basis, weights)
    state = State(camera, shape, Appearance(basis.light.astype(float), np.zeros(len(basis.modes))))
    level = pyramid(photo, points, None, options.level_widths)[0]
    energy.look_at(level, choose_samples(head, model.modes, basis, options.level_samples[0]), state)
    if energy.trust.sum() < LEAST_SAMPLES:
        return state.appearance.light
    return start_appearance(energy, state).appearance.light


def dark_share(energy, state, residual):
    """Share of the seen plain skin whose colour is below DARK of what smooth light gives it."""
    turned = energy.corners(state.shape) @ rotation.matrix(state.camera.rotation).T
    pixels = cameras.project_camera(turned.mean(1) + state.camera.translation, state.camera)
    level = energy.level
    color = sample(level.image, (pixels - [level.left, level.top]) * level.scale)
    expected = (color - residual) @ LUMA
    dark = color @ LUMA < DARK * np.maximum(expected, 1e-3)
    trust = energy.trust * energy.samples.plain
    return float((trust * dark).sum() / max(trust.sum(), 1.0))
