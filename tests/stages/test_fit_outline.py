"""Ears, skull and neck from labels: people whose outline is known come back."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from bakery.bake.fitting import fitted_neutral, outlined
from bakery.bake.options import BuildOptions
from bakery.bake.subject import FittedSubject
from bakery.cli.options import build_options
from bakery.formats import record
from bakery.formats.portraits import landmarks_of
from bakery.geometry import camera as cameras
from bakery.geometry import rotation
from bakery.geometry.raster import rasterize
from bakery.heads.outline import NAMES, SHARED, outline_basis, outline_offsets
from bakery.stages.fit import Face
from bakery.stages.fit.outline import STUBBLE, Seen, fit_outline, population
from bakery.stages.segment import BACKGROUND, CLOTHES, EARS, HAIR, LABELS, NECK, SKIN
from bakery.types import Camera, Fit, Photo

SIZE = 500
KNOWN = {
    "skull_width": 6.0, "skull_height": -5.0, "neck_width": 13.0, "neck_taper": -1.0,
    "shoulder_drop": 18.0, "ear_size_left": 13.0, "ear_size_right": 12.0, "ear_out_left": 8.0,
    "ear_out_right": 7.0, "ear_drop_left": 2.0, "ear_drop_right": 2.0,
}  # fmt: skip
OWN_EARS = [k for k, name in enumerate(NAMES) if name not in SHARED]


def coefficients(head, named):
    out = population(head)[0].copy()
    for name, value in named.items():
        out[NAMES.index(name)] = value
    return out


def person(head, outline, yaw=0.0, seed=2):
    """The Seen of a bald person with a known outline, its labels drawn by what each face is."""
    rng = np.random.default_rng(seed)
    turn = rotation.vector(rotation.yaw_pitch(yaw, 3.0))
    camera = Camera(
        1.8 * SIZE, np.array([SIZE / 2, 0.45 * SIZE]), turn, np.array([0, 0, -700.0]), SIZE, SIZE
    )
    identity = rng.normal(size=20) * 0.5
    shape = head.neutral(identity)
    pixels, depth = projected(shape + outline_offsets(head, outline), camera)
    skin = head.faces[head.part_faces("skin", "eye_left", "eye_right")]
    seen = rasterize(pixels, depth, skin, (SIZE, SIZE))
    middle = head.mean[skin].mean(1)
    kinds = np.where(middle[:, 1] < -108, NECK, SKIN)
    kinds[outline_basis(head).ear[skin].mean(1) > 0.5] = EARS
    labels = np.where(seen.face >= 0, kinds[seen.face], BACKGROUND).astype(np.uint8)
    points = cameras.project(head.landmarks(shape).astype(np.float64), camera)
    fit = Fit(
        head.name, camera, identity, np.zeros(52), np.zeros(2), np.zeros((9, 3)), np.zeros(0),
        np.zeros((468, 3)), points,
    )  # fmt: skip
    return Seen(fit, shape, labels, points)


def projected(shape, camera):
    inside = cameras.to_camera(shape.astype(np.float64), camera)
    return cameras.project_camera(inside, camera), -inside[:, 2]


@pytest.mark.parametrize("yaw", [0.0, 20.0])
def test_a_known_person_comes_back(head, yaw):
    truth = coefficients(head, KNOWN)
    found = fit_outline(head, [person(head, truth, yaw)])
    wrong = outline_offsets(head, found) - outline_offsets(head, truth)
    start = outline_offsets(head, population(head)[0]) - outline_offsets(head, truth)
    places = head.mean
    ear = outline_basis(head).ear > 0.9
    neck = (np.abs(places[:, 1] + 120) < 12) & (places[:, 2] > -110) & (np.abs(places[:, 0]) > 40)
    crown = places[:, 1] > 85
    across = rotation.matrix(rotation.vector(rotation.yaw_pitch(yaw, 3.0)))[:2].T
    for where, within in ((ear, 1.6), (neck, 2.0), (crown, 2.5)):
        left = np.abs(wrong[where] @ across).mean()  # mm as the photo sees it
        assert left < within
        assert left < 0.6 * np.abs(start[where] @ across).mean()


def test_the_drawn_outline_lies_on_the_labels(head):
    seen = person(head, coefficients(head, KNOWN))
    pixels, depth = projected(
        seen.shape + outline_offsets(head, fit_outline(head, [seen])), seen.fit.camera
    )
    skin = head.faces[head.part_faces("skin")]
    drawn = rasterize(pixels, depth, skin, (SIZE, SIZE)).face >= 0
    there = seen.labels != BACKGROUND
    assert (drawn & there).sum() / (drawn | there).sum() > 0.975


@pytest.mark.parametrize("high, rises", [(0, True), (16, False)])
def test_the_skull_fills_cropped_hair_and_no_other(head, high, rises):
    """Hair `high` mm above a tall skull: cropped, it ends where the skull does, else who knows."""
    seen = person(head, coefficients(head, {"skull_height": 7.0, "skull_width": 6.0}))
    rows, _ = np.indices(seen.labels.shape)
    above = rows < seen.points[10, 1]  # the landmark in the middle of the hairline
    grown = cv2.dilate(
        (above & (seen.labels != BACKGROUND)).astype(np.uint8),
        cv2.getStructuringElement(cv2.MORPH_ELLIPSE, [2 * round(1.29 * high) + 1] * 2),
    )
    hair = (grown > 0) & (above | (seen.labels == BACKGROUND)) & (rows < seen.points[10, 1] + 9)
    found = fit_outline(
        head, [replace(seen, labels=np.where(hair, HAIR, seen.labels).astype(np.uint8))]
    )
    height, expected = (part[NAMES.index("skull_height")] for part in (found, population(head)[0]))
    if rises:
        assert height == pytest.approx(7.0 - STUBBLE, abs=1.5)
    else:
        assert abs(height - expected) < 1.0


def test_ears_under_hair_are_those_of_the_average(head):
    seen = person(head, coefficients(head, {"ear_size_left": 16.0, "ear_size_right": 16.0}))
    rows, columns = np.indices(seen.labels.shape)
    hair = np.abs(columns - SIZE / 2) > 0.9 * np.abs(seen.points[[234, 454], 0] - SIZE / 2).mean()
    labels = np.where(hair & (rows < seen.points[152, 1]), HAIR, seen.labels).astype(np.uint8)
    found = fit_outline(head, [replace(seen, labels=labels)])
    np.testing.assert_allclose(found[OWN_EARS], population(head)[0][OWN_EARS], atol=0.5)


def test_a_hidden_ear_follows_the_other(head):
    seen = person(head, coefficients(head, {"ear_out_left": 12.0, "ear_out_right": 12.0}))
    right = np.arange(SIZE) < SIZE / 2  # of the picture's left half: the subject's right
    labels = np.where(right & (seen.labels == EARS), HAIR, seen.labels).astype(np.uint8)
    labels[:, : int(seen.points[234, 0])] = HAIR
    found = fit_outline(head, [replace(seen, labels=labels)])
    here, there, mean = (
        values[[NAMES.index("ear_out_left"), NAMES.index("ear_out_right")]]
        for values in (found, found, population(head)[0])
    )
    assert here[0] > mean[0] + 4
    assert there[1] > mean[1] + 0.7 * (here[0] - mean[0])


def test_a_monster_stays_within_the_bounds(head):
    low, high = population(head)[2:]
    for monster in (2 * high, 2 * low):
        found = fit_outline(head, [person(head, monster)])
        assert (found >= low).all() and (found <= high).all()


@pytest.mark.parametrize("kind", ["noise", "background", "skin", "hair", "clothes", "tiny", "away"])
def test_any_labels_give_some_person(head, kind):
    seen = person(head, population(head)[0])
    labels, points = seen.labels, seen.points
    if kind == "noise":
        labels = np.random.default_rng(0).integers(0, len(LABELS), labels.shape).astype(np.uint8)
    elif kind == "tiny":
        labels = labels[:30, :30]
    elif kind == "away":
        labels = np.roll(labels, 200, 1)
    else:
        names = {"background": BACKGROUND, "skin": SKIN, "hair": HAIR, "clothes": CLOTHES}
        labels = np.full_like(labels, names[kind])
    if kind == "tiny":  # a photo that ends before the face does
        points = points - points.min(0)
    found = fit_outline(head, [replace(seen, labels=labels, points=points)])
    mean, _, low, high = population(head)
    assert np.isfinite(found).all() and (found >= low).all() and (found <= high).all()
    if kind == "clothes":  # nothing is seen: the average
        np.testing.assert_allclose(found, mean, atol=1e-6)


def test_two_photos_say_more_than_one(head):
    """The photo from the side sees the back of the head, which the front one does not."""
    truth = coefficients(head, {"skull_depth": 10.0, "ear_out_left": 10.0, "ear_out_right": 10.0})
    front, side = person(head, truth), person(head, truth, 60.0)
    depth = NAMES.index("skull_depth")
    alone, both = (fit_outline(head, seen)[depth] for seen in ([front], [front, side]))
    assert abs(alone) < 2
    assert both > 6


def test_another_head_is_taken_as_it_is(head):
    other = replace(head, name="other")
    mean, covariance, low, high = population(other)
    assert not mean.any()
    assert (low < 0).all() and (high > 0).all()
    np.testing.assert_array_equal(covariance, population(head)[1])


def test_it_is_quick(head):
    import time

    seen = person(head, population(head)[0])
    fit_outline(head, [seen])  # the basis is kept
    begin = time.process_time()
    fit_outline(head, [seen])
    assert time.process_time() - begin < 1.0  # a busy machine; 0.1 s otherwise


def test_one_outline_for_all_photos(head):
    truth = coefficients(head, KNOWN)
    seen = [person(head, truth), person(head, truth, 20.0)]
    picture = Photo(np.zeros((SIZE, SIZE, 3), np.float32), "")
    faces = [Face(picture, landmarks_of(one.points), labels=one.labels) for one in seen]
    fits = outlined(head, [one.fit for one in seen], faces, BuildOptions())
    assert fits[0].outline is fits[1].outline
    np.testing.assert_allclose(fits[0].outline, fit_outline(head, seen))
    off = outlined(head, [seen[0].fit], faces[:1], build_options("default", ("fit.outline=false",)))
    assert not off[0].outline.any()
    assert not outlined(head, [seen[0].fit], [replace(faces[0], labels=None)], BuildOptions())[
        0
    ].outline.any()


def test_no_outline_leaves_every_byte(head):
    fit = person(head, population(head)[0]).fit
    for none in (np.zeros(0), np.zeros(len(NAMES))):
        same = fitted_neutral(head, replace(fit, outline=none))
        assert same.tobytes() == head.neutral(fit.identity, np.zeros_like(head.mean)).tobytes()
        assert "outline" not in record.fit_to_table(replace(fit, outline=none))


def test_a_fit_is_read_back_with_its_outline_or_without(head):
    fit = replace(person(head, population(head)[0]).fit, outline=coefficients(head, KNOWN))
    table = record.fit_to_table(fit)
    np.testing.assert_allclose(record.fit_from_table("fit", table).outline, fit.outline, atol=1e-6)
    del table["outline"]
    assert record.fit_from_table("fit", table).outline.shape == (0,)
    moved = fitted_neutral(head, fit) - fitted_neutral(head, replace(fit, outline=np.zeros(0)))
    np.testing.assert_allclose(moved, outline_offsets(head, fit.outline), atol=1e-4)


def test_a_fit_with_an_impossible_outline_is_refused(head):
    from bakery.errors import InputError

    table = record.fit_to_table(person(head, population(head)[0]).fit)
    for wrong in ([1e6], "wide", [[1.0]], [float("nan")]):
        with pytest.raises(InputError, match="bakery fit"):
            record.fit_from_table("fit", table | {"outline": wrong})


def test_own_ears_stay_when_others_drive(head):
    """Another photo's fit brings its expression, not its ears."""
    fit = person(head, population(head)[0]).fit
    mine = replace(fit, outline=coefficients(head, KNOWN))
    subject = FittedSubject.__new__(FittedSubject)
    subject.model = head
    subject.neutral = type("Observed", (), {"fit": mine})()
    assert subject.own_shape(fit).tobytes() == fitted_neutral(head, mine).tobytes()
