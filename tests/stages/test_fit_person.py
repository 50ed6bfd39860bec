"""Several photos of one person: one identity and warp, and what each photo adds."""

from dataclasses import replace

import numpy as np
import pytest

from bakery import landmarks as marks
from bakery.bake.options import BuildOptions
from bakery.bake.person import distance, fit_person, leading
from bakery.errors import InputError
from bakery.evaluate import together
from bakery.evaluate.fitting import landmark_error, landmarks_of, similarity
from bakery.geometry import camera as cameras
from bakery.geometry import rotation
from bakery.heads.base import weights
from bakery.heads.file import load_head
from bakery.stages.fit import Face, FitOptions, fit, fit_together, landmark_model
from bakery.stages.fit.landmarks import Weights
from bakery.stages.fit.person import Shot, shared_moves, solve_identity
from bakery.stages.fit.warp import residual_offsets
from bakery.types import Camera, Photo

SIZE = 800
BY_POINTS = FitOptions(photometric=False)
BAKING = BuildOptions(fit=BY_POINTS)
SMILE = {"mouthSmileLeft": 0.6, "mouthSmileRight": 0.6, "jawOpen": 0.1}


@pytest.fixture(scope="module")
def head():
    return load_head("makehuman")


def neutral_of(head, seed, bend=0.6):
    """A person whom the model holds but for some `bend` mm."""
    rng = np.random.default_rng(seed)
    identity = rng.normal(size=30) * 0.8
    offsets = residual_offsets(head, rng.normal(size=(marks.FACE, 3)) * bend)
    return head.neutral(identity, offsets)


def face(head, neutral, expression=(), yaw=0.0, name="", shade=0.5):
    """A photo of a person by its landmarks alone."""
    turn = rotation.vector(rotation.yaw_pitch(yaw, 0))
    camera = Camera(1.8 * SIZE, np.full(2, SIZE / 2), turn, np.array([0, 10, -600.0]), SIZE, SIZE)
    shape = head.vertices(neutral, weights(dict(expression)))
    points = cameras.project(head.landmarks(shape).astype(np.float64), camera)
    picture = Photo(np.full((SIZE, SIZE, 3), shade, np.float32), name)
    return Face(picture, landmarks_of(points))


def test_identity_and_warp_are_shared_and_the_rest_is_not(head):
    neutral = neutral_of(head, 0)
    faces = [face(head, neutral), face(head, neutral, SMILE, yaw=20)]
    first, second = fit_together(faces, head, BY_POINTS)
    np.testing.assert_array_equal(first.identity, second.identity)
    np.testing.assert_array_equal(first.residual, second.residual)
    turns = [fit.diagnostics["yaw"] for fit in (first, second)]
    np.testing.assert_allclose(turns, [0, 20], atol=2)
    assert second.expression.sum() > first.expression.sum() + 0.4  # of 1.2, shrunk by the prior
    for found, one in zip((first, second), faces):
        # Percent; alone 0.1. 0.49 before lips of smiles went back in depth: what is shrunk of a smile shows
        # in a turned head then, too (0.503).
        assert landmark_error(found, one.landmarks.points)["all"] < 0.52


def surface_error(head, found, neutral):
    """Rms mm of the skin inside the landmarks, after the best similarity."""
    a = head.landmarks(head.neutral(found.identity, residual_offsets(head, found.residual)))
    b = head.landmarks(neutral)
    a, b = (x[: marks.FACE].astype(np.float64) for x in (a, b))
    scale, turn, shift = similarity(a, b)
    return np.sqrt(((scale * a @ turn.T + shift - b) ** 2).sum(1).mean())


def test_two_sides_of_a_person_say_more_than_one(head):
    alone, both = [], []
    for seed in range(3):
        neutral = neutral_of(head, seed)
        faces = [face(head, neutral, yaw=yaw) for yaw in (-30, 30)]
        alone += [
            surface_error(head, fit(one.photo, one.landmarks, head, BY_POINTS), neutral)
            for one in faces
        ]
        both.append(surface_error(head, fit_together(faces, head, BY_POINTS)[0], neutral))
    assert np.mean(both) < 0.8 * np.mean(alone)


def test_a_photo_counts_once_however_often_it_is_given(head):
    model = landmark_model(head, 40)
    points = face(head, neutral_of(head, 1), SMILE).landmarks.points
    shot = Shot(points, np.ones(478), 1.8 * SIZE, SIZE, SIZE)
    one = solve_identity(model, [shot], Weights())
    np.testing.assert_allclose(one, solve_identity(model, [shot] * 3, Weights()), atol=1e-6)


def looking(yaw):
    turn = rotation.vector(rotation.yaw_pitch(yaw, 0))
    return Camera(900.0, np.zeros(2), turn, np.array([0, 0, -600.0]), 500, 500)


def test_two_sides_find_a_known_move_and_one_keeps_its_depth():
    true = np.random.default_rng(2).normal(size=(marks.FACE, 3))
    still, sure = np.zeros(marks.FACE), np.ones(478)

    def found(*yaws):
        placed = [looking(yaw) for yaw in yaws]
        sights = [rotation.matrix(camera.rotation)[2] for camera in placed]
        wanted = [true - np.outer(true @ sight, sight) for sight in sights]
        count = len(yaws)
        return shared_moves(wanted, [still] * count, [sure] * count, placed)

    np.testing.assert_allclose(found(0), true * [1, 1, 0], atol=1e-6)
    wide = found(-60, 60)
    np.testing.assert_allclose(wide[:, :2], true[:, :2], atol=1e-6)
    np.testing.assert_allclose(wide[:, 2], true[:, 2] * 6 / 7, atol=1e-3)  # 2 * 4 * 3/4 against 1
    assert np.abs(found(-2, 2)[:, 2]).max() < 0.1  # nearly one side: depth would be noise


def test_what_an_expression_moved_far_is_believed_less():
    still, moved = np.zeros(marks.FACE), np.full(marks.FACE, 6.0)
    wanted = [np.zeros((marks.FACE, 3)), np.tile([1.0, 0, 0], (marks.FACE, 1))]
    sure = [np.ones(478)] * 2
    even = shared_moves(wanted, [still, still], sure, [looking(0)] * 2)
    np.testing.assert_allclose(even[:, 0], 0.5)
    bent = shared_moves(wanted, [still, moved], sure, [looking(0)] * 2)
    np.testing.assert_allclose(bent[:, 0], 1 / 11)  # 4 against 1 / (0.25 + 1.5 ** 2) = 0.4


def test_one_photo_twice_is_refused(head):
    one = face(head, neutral_of(head, 0), name="same")
    with pytest.raises(InputError, match="a.jpg and b.jpg: the same photo twice"):
        fit_person(["a.jpg", "b.jpg"], [one, one], head, BAKING)


def test_two_people_are_told_of(head, caplog):
    first = face(head, neutral_of(head, 0), name="1")
    second = face(head, neutral_of(head, 0), SMILE, yaw=10, name="2")
    # 0.033 apart. Bends drawn at random move plain skin to a side too, which is not believed.
    other = face(head, neutral_of(head, 8, bend=3), name="3")
    fits = fit_person(["a.jpg", "b.jpg"], [first, second], head, BAKING)
    assert not caplog.records and fits[0].head_sha256 == head.digest
    fit_person(["a.jpg", "c.jpg"], [first, other], head, BAKING)
    assert "a.jpg and c.jpg: their heads differ" in caplog.text
    assert distance(head, fits[0], fits[1]) == 0


def test_the_frontal_neutral_photo_leads(head):
    neutral = neutral_of(head, 3)
    faces = [
        face(head, neutral, yaw=35),
        face(head, neutral, SMILE),
        face(head, neutral),
    ]
    fits = fit_together(faces, head, BY_POINTS)
    assert leading(fits) == 2 and leading(fits[::-1]) == 0
    blurred = replace(fits[2], diagnostics=fits[2].diagnostics | {"sharpness": 0.0, "yaw": 30.0})
    assert leading([fits[0], fits[1], blurred]) != 2


def test_the_measure_of_a_second_photo(head):
    neutral = neutral_of(head, 4)
    faces = face(head, neutral), face(head, neutral, SMILE, yaw=15)
    found = together.measure(*faces, head)
    assert max(found["first_both"], found["second_both"]) < found["alone"]
    assert found["held_both"] < found["held_one"]
    hidden = together.without(faces[0]).landmarks.confidence
    assert not hidden[together.HELD].any() and hidden.sum() == 478 - len(together.HELD)
