"""Findings: a good portrait gives none, each fault gives its own."""

import re
from dataclasses import fields, replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from bakery.formats.image import read_photo
from bakery.geometry import camera as cameras
from bakery.geometry import rotation
from bakery.heads.base import weights
from bakery.heads.file import load_head
from bakery.landmarks import EYES as LIDS
from bakery.landmarks import MOUTH_CORNERS
from bakery.stages.assess import IN_MIRROR, LINES, Limits, assess
from bakery.stages.detect import detect_faces
from bakery.stages.segment import EYES, GLASSES, HAIR, HAT, HIDDEN, SKIN, Segmentation
from bakery.types import Camera, Fit, Landmarks, Photo

SIZE = 500
SAMPLES = Path(__file__).resolve().parents[2] / "samples"


@pytest.fixture(scope="module")
def good():
    """Landmarks of the default head, grainy skin all over: photo, landmarks, fit, segmentation."""
    head = load_head()
    camera = Camera(
        1000.0, np.array([250.0, 250.0]), np.zeros(3), np.array([0, 0, -600.0]), SIZE, SIZE
    )
    expression = weights({"eyeWideLeft": 0.6, "eyeWideRight": 0.6})
    points = cameras.project(head.landmarks(head.vertices(head.mean, expression)), camera)
    points[14] = points[13]  # the mouth of the mean head is not quite closed
    low, high = points.min(0), points.max(0)
    face = Landmarks(np.concatenate([low, high - low]), 1.0, points, np.ones(478))
    grain = np.random.default_rng(0).normal(0, 0.05, (SIZE, SIZE, 1))
    photo = Photo(np.clip(0.5 + grain * [1.0, 1.0, 1.0], 0, 1).astype(np.float32), "0" * 64)
    fit = Fit(
        "makehuman", camera, np.zeros(1), np.zeros(52), np.zeros(2), np.zeros((9, 3)), np.zeros(0),
        np.zeros((468, 3)), points,
    )  # fmt: skip
    labels = np.full((SIZE, SIZE), SKIN, np.uint8)
    return photo, face, fit, Segmentation(labels, np.ones((SIZE, SIZE), np.float32))


def codes(*portrait):
    return [finding.code for finding in assess(*portrait)]


def test_a_good_portrait_has_no_findings(good):
    assert codes(*good) == []


def test_expression(good):
    photo, face, fit, parts = good
    smile = weights({"mouthSmileLeft": 0.3, "mouthSmileRight": 0.3})
    fit = replace(fit, expression=smile)
    assert codes(photo, face, fit, parts) == [], "a narrow mouth hardly smiles"
    wide = face.points.copy()
    middle = wide[MOUTH_CORNERS].mean(0)
    wide[MOUTH_CORNERS] += (wide[MOUTH_CORNERS] - middle) * 0.3
    assert codes(photo, replace(face, points=wide), fit, parts) == ["expression"]


def test_view(good):
    photo, face, fit, parts = good
    for yaw, pitch, code in ((30, 0, "yaw"), (-30, 0, "yaw"), (0, 25, "pitch")):
        turned = replace(fit.camera, rotation=rotation.vector(rotation.yaw_pitch(yaw, pitch)))
        (found,) = assess(photo, face, replace(fit, camera=turned), parts)
        assert found.code == code
        np.testing.assert_allclose(found.value, abs(yaw + pitch), atol=1e-3)


def test_eyes_and_mouth(good):
    photo, face, fit, parts = good
    shut = face.points.copy()
    for upper, lower in ((159, 145), (158, 153), (386, 374), (385, 380)):
        shut[upper] = shut[lower]
    assert codes(photo, replace(face, points=shut), fit, parts) == ["closed_eyes"]
    talking = face.points.copy()
    talking[14] += [0, 0.2 * np.linalg.norm(talking[61] - talking[291])]
    assert "open_mouth" in codes(photo, replace(face, points=talking), fit, parts)


@pytest.mark.parametrize("label, code", [(HAIR, "hair"), (GLASSES, "glasses"), (HIDDEN, "hidden")])
def test_what_covers_the_face(good, label, code):
    photo, face, fit, parts = good
    labels = parts.labels.copy()
    rows = slice(int(face.points[[70, 300], 1].min()), int(face.points[195, 1]))
    labels[rows] = label
    assert code in codes(photo, face, fit, Segmentation(labels, parts.skin))


def test_hair_that_is_partly_unknown(good):
    """A hat of the eyes' distance squared; hair at half a side of the picture. A speck is neither."""
    photo, face, fit, parts = good
    for label, code, rows, columns in (
        (HAT, "hat", slice(0, 100), slice(100, 300)),
        (HAIR, "hair_cut", slice(450, 500), slice(0, 40)),
    ):
        labels = parts.labels.copy()
        labels[rows, columns] = label
        assert code in codes(photo, face, fit, Segmentation(labels, parts.skin))
        labels = parts.labels.copy()
        labels[2:7, 2:7] = label
        assert code not in codes(photo, face, fit, Segmentation(labels, parts.skin))


def test_unsure_landmarks_of_one_part(good):
    photo, face, fit, parts = good
    low = face.confidence.copy()
    low[face.points[:, 1] > face.points[2, 1]] *= 0.7
    assert codes(photo, replace(face, confidence=low), fit, parts) == ["covered"]
    even = replace(face, confidence=np.full(478, 0.6))
    assert codes(photo, even, fit, parts) == [], "all alike is no part"


def test_hard_light(good):
    photo, face, fit, parts = good
    fit = replace(fit, diagnostics={"shadow_share": 0.05})
    assert codes(photo, face, fit, parts) == ["cast_shadow"]


def test_dark_eyes(good):
    photo, face, fit, parts = good
    labels = parts.labels.copy()
    for lids in LIDS:
        cv2.fillPoly(labels, [face.points[lids].astype(np.int32)], EYES)
    parts = Segmentation(labels, parts.skin)
    assert codes(photo, face, fit, parts) == []
    assert codes(replace(photo, encoded=photo.encoded * 0.4), face, fit, parts) == ["dark"]


def test_small(good):
    photo, face, fit, parts = good
    half = replace(photo, encoded=photo.encoded[::2, ::2].copy())
    parts = Segmentation(parts.labels[::2, ::2].copy(), parts.skin[::2, ::2].copy())
    assert codes(half, replace(face, points=face.points / 2), fit, parts) == ["small"]


def test_shadow_and_blur(good):
    photo, face, fit, parts = good
    dark = photo.encoded.copy()
    dark[:, : SIZE // 2] *= 0.5
    (found,) = [
        f for f in assess(replace(photo, encoded=dark), face, fit, parts) if f.code == "shadow"
    ]
    assert 1.8 < found.value < 3  # half the sRGB value is 2.2 stops
    soft = cv2.GaussianBlur(photo.encoded, (0, 0), 4)
    soft += np.linspace(-0.1, 0.1, SIZE, dtype=np.float32)[:, None, None]
    assert codes(replace(photo, encoded=soft), face, fit, parts) == ["blur"]


def test_landmarks_of_another_photo(good):
    """Given ones are held against those that the detector sees, of whichever face is nearest."""
    photo, face, fit, parts = good
    far = replace(face, points=face.points + [200, 0])
    assert "landmarks" not in codes(*good) and codes(photo, face, fit, parts) == []

    def found(given, *seen):
        return [f.code for f in assess(photo, given, fit, parts, seen=seen)]

    assert found(face, face) == found(face, far, face) == []
    assert found(face, far) == ["landmarks"]
    eyes = float(np.linalg.norm(face.points[33] - face.points[263]))
    near = replace(face, points=face.points + [0.04 * eyes, 0])
    assert found(face, near) == [], "detectors and people differ by so much"
    further = replace(face, points=face.points + [0.07 * eyes, 0])
    assert found(face, further) == ["landmarks"]


def test_mirrored_landmarks(good):
    """Coordinates that were mirrored alone, and what is detected in the mirrored photo."""
    photo, face, fit, parts = good
    aside = face.points + [30.0, 0.0]
    seen = (replace(face, points=aside),)
    flipped = aside * [-1, 1] + [SIZE, 0]
    swapped = flipped.copy()
    swapped[LINES] = flipped[IN_MIRROR]
    for given in (flipped, swapped):
        found = assess(photo, replace(face, points=given), fit, parts, seen=seen)
        assert [f.code for f in found if f.code in ("landmarks", "mirrored")] == ["mirrored"]
    assert codes(photo, replace(face, points=flipped), fit, parts) == []


def test_sides_change_in_a_mirror():
    """LINES of the default head, mirrored, lie on IN_MIRROR."""
    head = load_head()
    points = head.landmarks(head.mean)
    apart = points[LINES] * [-1, 1, 1] - points[IN_MIRROR]
    assert np.abs(apart).max() < 0.5  # mm
    assert sorted(LINES) == sorted(IN_MIRROR) and (LINES != IN_MIRROR).mean() > 0.9


def test_few_colours(good):
    photo, face, fit, parts = good
    for bands in (1, 3):  # of one colour each
        rows = np.linspace(0, bands, SIZE, endpoint=False).astype(int) / 8 + 0.4
        drawn = np.broadcast_to(rows[:, None, None], photo.encoded.shape).astype(np.float32)
        assert "flat" in codes(replace(photo, encoded=drawn), face, fit, parts)
    assert codes(replace(photo, encoded=photo.encoded * 0.5), face, fit, parts) == []


@pytest.fixture(scope="module")
def anna():
    """A painted portrait as it is found: photo, landmarks."""
    photo = read_photo(SAMPLES / "anna.jpg")
    return photo, detect_faces(photo.encoded)[0]


def _plain(fit, shape):
    return fit, Segmentation(np.full(shape, SKIN, np.uint8), np.ones(shape, np.float32))


def test_a_cartoon_of_a_portrait(anna, good):
    photo, face = anna
    assert "flat" not in codes(photo, face, *_plain(good[2], photo.encoded.shape[:2]))
    small = (photo.encoded * 255).astype(np.uint8)
    cells = cv2.kmeans(small.reshape(-1, 3)[::37].astype(np.float32), 8, None, (3, 10, 1), 1, 2)[2]
    nearest = np.abs(small.reshape(-1, 1, 3) - cells[None]).sum(-1).argmin(1)
    drawn = cells[nearest].reshape(small.shape).astype(np.float32) / 255
    drawn = replace(photo, encoded=cv2.medianBlur(drawn, 5))
    assert "flat" in codes(drawn, face, *_plain(good[2], drawn.encoded.shape[:2]))


@pytest.mark.parametrize("side", ["left", "right", "top", "bottom"])
def test_a_face_that_is_cut(anna, good, side):
    """A tenth of the face is outside: it is said so, and nothing is said to be before it."""
    photo, face = anna
    low, high = face.points.min(0), face.points.max(0)
    width, height = high - low
    rows, columns = {
        "left": (np.s_[:], np.s_[int(low[0] + width / 10) :]),
        "right": (np.s_[:], np.s_[: int(high[0] - width / 10)]),
        "top": (np.s_[int(low[1] + height / 10) :], np.s_[:]),
        "bottom": (np.s_[: int(high[1] - height / 10)], np.s_[:]),
    }[side]
    cut = replace(photo, encoded=np.ascontiguousarray(photo.encoded[rows, columns]))
    (face,) = detect_faces(cut.encoded)
    found = codes(cut, face, *_plain(good[2], cut.encoded.shape[:2]))
    assert "cut" in found and "covered" not in found


def test_every_warning_is_explained():
    """docs/photos.md names each code with its limit."""
    text = (SAMPLES.parent / "docs" / "photos.md").read_text(encoding="utf-8")
    found = dict(
        re.findall(r"^\| \*\*(\w+)\*\* \| (?:above|below) ([\d.]+) \|", text, re.MULTILINE)
    )
    limits = {field.name: getattr(Limits(), field.name) for field in fields(Limits)}
    assert {code: float(limit) for code, limit in found.items()} == limits
