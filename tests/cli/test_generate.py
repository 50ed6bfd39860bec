"""`bakery generate`: views, expressions, another photo's fit, wrong options."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from numpy.testing import assert_allclose

from bakery.bake.subject import Sitter
from bakery.errors import InputError
from bakery.formats.image import read_photo
from bakery.formats.livelink import Take
from bakery.formats.record import read_faces
from bakery.geometry import camera as cameras
from bakery.geometry import rotation
from bakery.heads.base import gaze_of
from bakery.show import synthesis as portrayal
from bakery.stages.condition import face_camera
from bakery.types import EXPRESSION_INDEX, Generated


class Unchanged:
    """A generator that changes nothing."""

    name, source_type = "unchanged", "compositeSynthetic"

    def generate(self, subject, conditions, interior_only=False):
        base = conditions.deformed_neutral
        return Generated(base, np.ones_like(base), np.zeros_like(base), np.zeros(base.shape[:2]))


@pytest.fixture(scope="module")
def sitter(portrait, head):
    _, (face,) = read_faces(portrait[1])
    return Sitter(portrait[0], face, head)


def test_another_photos_fit_is_painted_over_that_photo(sitter, portrait):
    """The portrait in its own fit is the portrait again, at its own size."""
    target = portrayal.Target(
        sitter.neutral.fit.expression, sitter.neutral.fit.gaze, sitter.neutral.fit
    )
    picture, face = portrayal.paint(sitter, target, Unchanged(), hair=False)
    photo = read_photo(portrait[0]).encoded
    assert picture.shape == photo.shape and face.shape == photo.shape[:2]
    whole = (face > 0.99)[140:340, 130:270]
    difference = np.abs(picture - photo)[140:340, 130:270][whole]
    # Grain of 0.01 linear, and the texture's 1024 texels.
    assert whole.mean() > 0.5 and np.median(difference) < 0.02


def test_change_is_laid_where_it_was_painted(sitter):
    """A generator that doubles the light in its left half does so in the photo's left half."""

    class Half(Unchanged):
        def generate(self, subject, conditions, interior_only=False):
            made = super().generate(subject, conditions)
            made.ratio[:, :256] = 2.0
            return made

    fit = sitter.neutral.fit
    target = portrayal.Target(fit.expression, fit.gaze, fit)
    plain, half = (portrayal.paint(sitter, target, g, hair=False)[0] for g in (Unchanged(), Half()))
    middle = fit.landmarks_projected[:, 0]
    column = int((middle.min() + middle.max()) / 2)
    face = np.s_[200:300, column - 40 : column - 4], np.s_[200:300, column + 4 : column + 40]
    assert (half[face[0]] - plain[face[0]]).mean() > 0.1
    assert_allclose(half[face[1]], plain[face[1]], atol=1e-3)


def test_a_film_does_not_flicker_as_its_painter_does(sitter, tmp_path):
    """Light that goes back and forth by 4%, on a face that does not move."""

    class Nervous(Unchanged):
        gain = 1.0

        def generate(self, subject, conditions, interior_only=False):
            made = super().generate(subject, conditions)
            self.gain = 2.04 - self.gain
            return replace(made, image=made.image * self.gain, ratio=made.ratio * self.gain)

    take = Take(np.arange(6) / 30, np.zeros((6, 52), np.float32), np.zeros((6, 3)), None)
    portrayal.film(sitter, take, Nervous(), tmp_path / "still.mp4", frames=slice(0, 6))
    clip = cv2.VideoCapture(str(tmp_path / "still.mp4"))
    frames = np.stack([clip.read()[1] for _ in range(6)])[:, 200:300, 220:290]
    assert frames.shape[1:] == (100, 70, 3) and frames.mean() > 60
    light = frames.mean((1, 2, 3))
    assert np.abs(np.diff(light)).max() < 0.006 * light.mean()  # unsteady: 4% / 2.2


def test_a_view_turns_the_head(sitter):
    zero = np.zeros(52, np.float32)
    left, right = (
        portrayal.paint(sitter, portrayal.Target(zero, np.zeros(2), None, (yaw, 0.0)), Unchanged())
        for yaw in (30.0, -30.0)
    )
    assert left[0].shape == (512, 512, 3)
    middle = [np.flatnonzero(face.max(0) > 0).mean() for _, face in (left, right)]
    # Turned to its left, a head shows more of its right side, which is the picture's left.
    assert middle[1] - middle[0] > 10
    assert_allclose(left[0][0, 0], 0.5)  # no head there


def aside(points):
    """Where nose, forehead and chin [x, y] lie of a head in a picture, over its width and height."""
    ears, ends = points[[234, 454]], points[[10, 152]]
    across, down = np.ptp(ears[:, 0]), np.ptp(ends[:, 1])
    nose = (points[1] - np.array([ears[:, 0].mean(), ears[:, 1].mean()])) / [across, down]
    return nose[0], nose[1], (ends[0, 0] - ends[1, 0]) / across


def test_a_take_turns_the_head_as_its_signs_say(sitter):
    """Yaw to the subject's left is the picture's right, pitch is up, roll to its left shoulder."""
    head, neutral = sitter.head, sitter.subject.neutral
    still = face_camera(sitter.neutral.fit, head, neutral)

    def seen(*angles):
        camera = portrayal.turned(sitter, still, angles)
        return aside(cameras.project(head.landmarks(neutral), camera))

    rest = seen(0.0, 0.0, 0.0)
    assert seen(25.0, 0.0, 0.0)[0] > rest[0] + 0.1 > seen(-25.0, 0.0, 0.0)[0] + 0.2
    assert seen(0.0, 20.0, 0.0)[1] < rest[1] - 0.05 < seen(0.0, -20.0, 0.0)[1] - 0.1
    assert seen(0.0, 0.0, 15.0)[2] > rest[2] + 0.1 > seen(0.0, 0.0, -15.0)[2] + 0.2
    # `bakery animate` turns the same head by the same numbers the same way.
    turn = rotation.matrix(portrayal.turned(sitter, still, (20.0, -10.0, 7.0)).rotation)
    found = rotation.angles_of(rotation.matrix(still.rotation).T @ turn)
    assert_allclose(found, [20, -10, 7], atol=1e-6)


def test_gaze_follows_the_weights_unless_it_is_given():
    weights = "eyeLookInLeft=1,eyeLookOutRight=1"
    row = np.zeros(52, np.float32)
    row[[EXPRESSION_INDEX[n] for n in ("eyeLookInLeft", "eyeLookOutRight")]] = 1
    assert_allclose(portrayal.parse(weights).gaze, gaze_of(row).mean(0))
    assert_allclose(portrayal.parse(weights, gaze="10,-5").gaze, [10, -5])


@pytest.mark.parametrize(
    "options, message",
    [
        ({"weights": "smile=1"}, "no shape 'smile'"),
        ({"yaw": 80.0}, "at most 60"),
        ({"fitted": "fit.json", "yaw": 10.0}, "brings its own view"),
        ({"gaze": "ten"}, "YAW,PITCH"),
    ],
)
def test_wrong_options(options, message):
    with pytest.raises(InputError, match=message):
        portrayal.parse(**options)


def test_the_command(bakery, portrait, tmp_path):
    photo, marks = portrait
    out, mask = tmp_path / "out.png", tmp_path / "mask.png"
    ask = ["generate", photo, "--landmarks", marks, "-o", out, "--mask", mask, "--yaw", "20"]
    done = bakery(*ask, "--weights", "jawOpen=0.6")
    assert done.returncode == 0, done.stderr
    picture, face = read_photo(out).encoded, read_photo(mask).encoded
    assert picture.shape == face.shape == (512, 512, 3)
    assert 0.1 < face.mean() < 0.8
    again = bakery(*ask)
    assert again.returncode == 1 and "--overwrite" in again.stderr
