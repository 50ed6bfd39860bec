"""Findings: a good portrait gives none, each fault gives its own."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from bakery.geometry import camera as cameras
from bakery.geometry import rotation
from bakery.heads.base import weights
from bakery.heads.file import load_head
from bakery.landmarks import EYES as LIDS
from bakery.landmarks import MOUTH_CORNERS
from bakery.stages.assess import assess
from bakery.stages.segment import EYES, GLASSES, HAIR, HIDDEN, SKIN, Segmentation
from bakery.types import Camera, Fit, Landmarks, Photo

SIZE = 500


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
    smile = weights({"mouthSmileLeft": 0.5, "mouthSmileRight": 0.5})
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
    parts = replace(parts, labels=labels)
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
