"""`bakery generate`: views, expressions, another photo's fit, wrong options."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from numpy.testing import assert_allclose

from bakery.errors import InputError
from bakery.formats.image import read_photo
from bakery.formats.livelink import Take
from bakery.geometry import camera as cameras
from bakery.geometry import rotation
from bakery.geometry.fill import enclosed
from bakery.heads.base import PARTS, gaze_of
from bakery.show import synthesis
from bakery.stages.condition import condition, face_camera
from bakery.types import EXPRESSION_INDEX, Generated


class Unchanged:
    """A generator that changes nothing."""

    name, source_type = "unchanged", "compositeSynthetic"

    def generate(self, subject, conditions, interior_only=False):
        base = conditions.deformed_neutral
        return Generated(base, np.ones_like(base), np.zeros_like(base), np.zeros(base.shape[:2]))


def test_another_photos_fit_is_painted_over_that_photo(fitted, portrait):
    """The portrait in its own fit is the portrait again, at its own size."""
    target = synthesis.Target(
        fitted.neutral.fit.expression, fitted.neutral.fit.gaze, fitted.neutral.fit
    )
    picture, face = synthesis.paint(fitted, target, Unchanged(), hair=False)
    photo = read_photo(portrait[0]).encoded
    assert picture.shape == photo.shape and face.shape == photo.shape[:2]
    whole = (face > 0.99)[140:340, 130:270]
    difference = np.abs(picture - photo)[140:340, 130:270][whole]
    # Grain of 0.01 linear, and the texture's 1024 texels.
    assert whole.mean() > 0.5 and np.median(difference) < 0.02


def test_change_is_laid_where_it_was_painted(fitted):
    """A generator that doubles the light in its left half does so in the photo's left half."""

    class Half(Unchanged):
        def generate(self, subject, conditions, interior_only=False):
            made = super().generate(subject, conditions)
            made.ratio[:, :256] = 2.0
            return made

    fit = fitted.neutral.fit
    target = synthesis.Target(fit.expression, fit.gaze, fit)
    plain, half = (synthesis.paint(fitted, target, g, hair=False)[0] for g in (Unchanged(), Half()))
    middle = fit.landmarks_projected[:, 0]
    column = int((middle.min() + middle.max()) / 2)
    face = np.s_[200:300, column - 40 : column - 4], np.s_[200:300, column + 4 : column + 40]
    assert (half[face[0]] - plain[face[0]]).mean() > 0.1
    assert_allclose(half[face[1]], plain[face[1]], atol=1e-3)


def test_a_film_does_not_flicker_as_its_painter_does(fitted, tmp_path):
    """Light that goes back and forth by 4%, on a face that does not move."""

    class Nervous(Unchanged):
        gain = 1.0

        def generate(self, subject, conditions, interior_only=False):
            made = super().generate(subject, conditions)
            self.gain = 2.04 - self.gain
            return replace(made, image=made.image * self.gain, ratio=made.ratio * self.gain)

    take = Take(np.arange(6) / 30, np.zeros((6, 52), np.float32), np.zeros((6, 3)), None)
    synthesis.film(fitted, take, Nervous(), tmp_path / "still.mp4", frames=slice(0, 6))
    clip = cv2.VideoCapture(str(tmp_path / "still.mp4"))
    frames = np.stack([clip.read()[1] for _ in range(6)])[:, 200:300, 220:290]
    assert frames.shape[1:] == (100, 70, 3) and frames.mean() > 60
    light = frames.mean((1, 2, 3))
    assert np.abs(np.diff(light)).max() < 0.006 * light.mean()  # unsteady: 4% / 2.2


def test_a_view_turns_the_head(fitted):
    zero = np.zeros(52, np.float32)
    left, right = (
        synthesis.paint(fitted, synthesis.Target(zero, np.zeros(2), None, (yaw, 0.0)), Unchanged())
        for yaw in (30.0, -30.0)
    )
    assert left[0].shape == (512, 512, 3)
    middle = [np.flatnonzero(face.max(0) > 0).mean() for _, face in (left, right)]
    # Turned to its left, a head shows more of its right side, which is the picture's left.
    assert middle[1] - middle[0] > 10
    assert_allclose(left[0][0, 0], 0.5)  # no head there


def test_a_take_turns_the_head(fitted):
    """To its left, which is the picture's right, up, and to its left shoulder."""
    own, points = fitted.neutral.fit, fitted.head.landmarks(fitted.subject.neutral)
    still = face_camera(own, fitted.head, fitted.subject.neutral)
    rest, aside, above, tilted = (
        cameras.project(points, synthesis.turned(fitted, still, angles))
        for angles in np.vstack([np.zeros(3), 15 * np.eye(3)])
    )
    nose, brow, chin = 1, 10, 152
    assert_allclose(rest, cameras.project(points, still), atol=1e-6)
    assert aside[nose, 0] - rest[nose, 0] > 10 and above[nose, 1] - rest[nose, 1] < -10
    assert (tilted[brow] - tilted[chin] - rest[brow] + rest[chin])[0] > 10


def test_the_mask_is_the_face_alone(fitted):
    """Of what is seen from the side, nothing of throat, ears and scalp; it fades towards them."""
    head, neutral = fitted.head, fitted.subject.neutral
    target = synthesis.Target(np.zeros(52, np.float32), np.zeros(2), None, (30.0, 0.0))
    _, face = synthesis.paint(fitted, target, Unchanged(), hair=False)
    camera = face_camera(fitted.neutral.fit, head, neutral, 30.0)
    seen = condition(head, neutral, fitted.subject.texture, target.expression, (0, 0), camera)
    marks = head.landmarks(head.mean)[:468]
    far = np.linalg.norm(head.mean[:, None] - marks[None], axis=2).min(1) > 40  # mm
    beyond = far[head.faces[seen.fragments.face]].all(-1) & (seen.part == PARTS.index("skin"))
    beyond = cv2.erode(beyond.astype(np.uint8), np.ones((5, 5))) > 0
    assert beyond.mean() > 0.02 and face[beyond].max() == 0
    assert not enclosed(face < 0.98).any(), "no holes"
    soft = (face > 0.1) & (face < 0.9)
    assert face.max() == 1 and soft.sum() > 1000
    assert 0.2 < face.mean() < 0.6


def aside(points):
    """Where nose, forehead and chin [x, y] lie of a head in a picture, over its width and height."""
    ears, ends = points[[234, 454]], points[[10, 152]]
    across, down = np.ptp(ears[:, 0]), np.ptp(ends[:, 1])
    nose = (points[1] - np.array([ears[:, 0].mean(), ears[:, 1].mean()])) / [across, down]
    return nose[0], nose[1], (ends[0, 0] - ends[1, 0]) / across


def test_a_take_turns_the_head_as_its_signs_say(fitted):
    """Yaw to the subject's left is the picture's right, pitch is up, roll to its left shoulder."""
    head, neutral = fitted.head, fitted.subject.neutral
    still = face_camera(fitted.neutral.fit, head, neutral)

    def seen(*angles):
        camera = synthesis.turned(fitted, still, angles)
        return aside(cameras.project(head.landmarks(neutral), camera))

    rest = seen(0.0, 0.0, 0.0)
    assert seen(25.0, 0.0, 0.0)[0] > rest[0] + 0.1 > seen(-25.0, 0.0, 0.0)[0] + 0.2
    assert seen(0.0, 20.0, 0.0)[1] < rest[1] - 0.05 < seen(0.0, -20.0, 0.0)[1] - 0.1
    assert seen(0.0, 0.0, 15.0)[2] > rest[2] + 0.1 > seen(0.0, 0.0, -15.0)[2] + 0.2
    # `bakery animate` turns the same head by the same numbers the same way.
    turn = rotation.matrix(synthesis.turned(fitted, still, (20.0, -10.0, 7.0)).rotation)
    found = rotation.angles_of(rotation.matrix(still.rotation).T @ turn)
    assert_allclose(found, [20, -10, 7], atol=1e-6)


def test_gaze_follows_the_weights_unless_it_is_given():
    weights = "eyeLookInLeft=1,eyeLookOutRight=1"
    row = np.zeros(52, np.float32)
    row[[EXPRESSION_INDEX[n] for n in ("eyeLookInLeft", "eyeLookOutRight")]] = 1
    assert_allclose(synthesis.parse(weights).gaze, gaze_of(row).mean(0))
    assert_allclose(synthesis.parse(weights, gaze="10,-5").gaze, [10, -5])


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
        synthesis.parse(**options)


def test_a_view_is_as_it_is_asked_for():
    assert synthesis.parse(yaw=20.0, pitch=-5.0).view == (20.0, -5.0)


def test_the_command(bakery, portrait, tmp_path):
    photo, marks = portrait
    out, mask = tmp_path / "out.png", tmp_path / "mask.png"
    ask = ["generate", photo, "--landmarks", marks, "-o", out, "--mask", mask, "--yaw", "20"]
    ask += ["--preset", "small"]
    done = bakery(*ask, "--weights", "jawOpen=0.6")
    assert done.returncode == 0, done.stderr
    assert f"wrote {out}\nwrote {mask}\n" in done.stderr
    picture, face = read_photo(out).encoded, read_photo(mask).encoded
    assert picture.shape == face.shape == (512, 512, 3)
    assert 0.1 < face.mean() < 0.8
    again = bakery(*ask)
    assert again.returncode == 1 and "--overwrite" in again.stderr
