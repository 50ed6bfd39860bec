"""Residuals and Jacobians against finite differences, and the priors."""

import numpy as np
import pytest

from bakery import landmarks as marks
from bakery.geometry import rotation
from bakery.heads.file import load_head
from bakery.stages.fit import expressions as groups
from bakery.stages.fit import landmarks as fit_landmarks
from bakery.stages.fit import photometric as fit_photo
from bakery.stages.fit import samples as fit_samples
from bakery.stages.fit.albedo import load_albedo
from bakery.stages.fit.landmarks import LandmarkModel, Shape, Weights
from bakery.types import EXPRESSIONS, Camera, Photo


@pytest.fixture(scope="module")
def head():
    return load_head("makehuman")


@pytest.fixture(scope="module")
def model(head):
    return LandmarkModel(head, 10)


@pytest.fixture
def camera():
    turn = rotation.vector(rotation.yaw_pitch(12, -7))
    return Camera(900.0, np.array([250.0, 260.0]), turn, np.array([3.0, 20, -620]), 500, 520)


@pytest.fixture
def shape(head):
    rng = np.random.default_rng(1)
    expression = np.zeros(len(EXPRESSIONS))
    expression[groups.FITTED] = rng.uniform(0.1, 0.3, len(groups.FITTED))
    return Shape(rng.normal(size=len(head.identity_basis)), expression)


def numeric(function, model, camera, shape, count, step=1e-4):
    """Central differences by every unknown of `fit_landmarks.advance`."""
    columns = []
    for index in range(count):
        move = np.zeros(count)
        move[index] = step
        up = function(*fit_landmarks.advance(model, camera, shape, move))
        down = function(*fit_landmarks.advance(model, camera, shape, -move))
        columns.append((up - down) / (2 * step))
    return np.stack(columns, -1)


def test_landmark_jacobian(model, camera, shape):
    points = np.zeros((marks.FACE, 2))
    _, jacobian = fit_landmarks.landmark_residual(model, camera, shape, points)

    def residual(camera, shape):
        return fit_landmarks.landmark_residual(model, camera, shape, points)[0]

    expected = numeric(residual, model, camera, shape, jacobian.shape[2])
    np.testing.assert_allclose(jacobian, expected, atol=1e-4 * np.abs(expected).max())


def test_prior_gradient(model, camera, shape):
    gradient, hessian, _ = fit_landmarks.prior_terms(model, shape, Weights())

    def energy(camera, shape):
        return np.array(fit_landmarks.prior_terms(model, shape, Weights())[2])

    expected = numeric(energy, model, camera, shape, len(gradient))
    np.testing.assert_allclose(gradient, expected, atol=1e-9)
    np.testing.assert_allclose(hessian, hessian.T)


def plane_level():
    """A picture whose colours change evenly, so that its gradient is exact everywhere."""
    y, x = np.mgrid[:520, :500] + 0.5
    slopes = np.array([[1e-3, 2e-4], [-4e-4, 8e-4], [3e-4, -5e-4]])
    image = np.stack([0.4 + s[0] * x + s[1] * y for s in slopes], -1).astype(np.float32)
    gradient = np.tile(slopes.T.ravel().astype(np.float32), (520, 500, 1))
    return fit_samples.Level(image, gradient, np.ones((520, 500), np.float32), 0.0, 0.0, 1.0)


def test_photo_jacobian(head, model, camera, shape):
    basis = load_albedo()
    samples = fit_samples.choose_samples(head, model.modes, basis, 60)
    light = basis.light + np.random.default_rng(0).normal(size=(9, 3)) * 0.05
    look = fit_photo.Appearance(light, np.full(len(basis.modes), 0.2))
    level = plane_level()
    rest = head.mean[samples.corners].reshape(-1, 9).astype(np.float64)

    def corners(shape):
        unknowns = np.concatenate([shape.identity[: model.modes], shape.expression[groups.FITTED]])
        return (rest + samples.basis.astype(np.float64) @ unknowns).reshape(-1, 3, 3)

    def residual(camera, shape, look=look):
        return fit_photo.photo_residual(corners(shape), samples, camera, look, level)[0]

    _, jacobian = fit_photo.photo_residual(corners(shape), samples, camera, look, level)
    first = 6 + samples.basis.shape[2]
    expected = numeric(residual, model, camera, shape, first, step=1e-3)
    scale = np.abs(expected).max((0, 1))
    # Pictures are float32 (differences of 1e-7 over a step of 2e-3) and so are the bases.
    allowed = 0.01 * scale + 1.5e-4
    assert (np.abs(jacobian[:, :, :first] - expected).max((0, 1)) < allowed).all()

    for index in range(first, jacobian.shape[2]):
        move = np.zeros(jacobian.shape[2] - first)
        move[index - first] = 1e-2
        change = residual(camera, shape, fit_photo.moved(look, move)) - residual(camera, shape)
        np.testing.assert_allclose(jacobian[:, :, index], change / 1e-2, atol=2e-4)


def test_appearance_prior_is_dearer_in_colour_than_in_brightness():
    basis = load_albedo()
    none = np.zeros(len(basis.modes))

    def cost(change):
        light = basis.light + np.asarray(change)
        return fit_photo.appearance_prior(fit_photo.Appearance(light, none), basis, Weights())[2]

    assert cost([0.1, 0.1, 0.1]) < cost([0.1, 0, -0.1]) / 5


def test_sampling_a_plane_is_exact():
    level = plane_level()
    points = np.random.default_rng(2).uniform(5, 480, (50, 2))
    expected = 0.4 + points @ [1e-3, 2e-4]
    np.testing.assert_allclose(fit_samples.sample(level.image, points)[:, 0], expected, atol=1e-6)


def test_samples_are_in_front_and_spread(head, model, camera, shape):
    basis = load_albedo()
    few = fit_samples.choose_samples(head, model.modes, basis, 200)
    assert 100 < len(few.corners) <= 200
    centers = head.mean[few.corners].mean(1)
    assert np.abs(centers[:, 0].mean()) < 5 and centers[:, 2].min() > -75
    blocked = fit_samples.Level(
        *[getattr(plane_level(), name) for name in ("image", "gradient")],
        np.zeros((520, 500), np.float32), 0.0, 0.0, 1.0,
    )  # fmt: skip
    seen = fit_samples.visible_samples(
        head, head.mean, np.zeros(len(EXPRESSIONS)), camera, few, plane_level()
    )
    assert seen.mean() > 0.5
    hidden = fit_samples.visible_samples(
        head, head.mean, np.zeros(len(EXPRESSIONS)), camera, few, blocked
    )
    assert not hidden.any()


def test_pyramid_scales():
    rng = np.random.default_rng(0)
    photo = Photo(rng.uniform(size=(400, 300, 3)).astype(np.float32), "")
    points = np.zeros((478, 2))
    points[:] = [150, 200]
    points[33], points[263] = [100, 200], [200, 200]
    levels = fit_samples.pyramid(photo, points, None, (25, 50))
    assert [round(level.scale, 2) for level in levels] == [0.25, 0.5]
