"""Frames of a video: what is carried along the surface, and what is not."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from bakery.generators import steady
from bakery.generators.shade import EYES, is_part
from bakery.geometry import camera as cameras
from bakery.geometry import rotation
from bakery.geometry.sample import interpolate
from bakery.heads.base import MOUTH, PARTS
from bakery.heads.file import load_head
from bakery.stages.condition import condition
from bakery.types import EXPRESSION_INDEX, Camera, Generated

SIZE = 192
CAMERA = Camera(
    600.0, np.array([96.0, 96.0]), np.zeros(3), np.array([0.0, 20.0, -600.0]), SIZE, SIZE
)


class Painter:
    """Multiplies the deformed neutral by exp(change), which the test sets."""

    name = source_type = "test"
    change = 0.0

    def generate(self, subject, conditions, interior_only=False):
        base = conditions.deformed_neutral
        ratio = np.exp(np.zeros_like(base) + self.change)
        return Generated(base * ratio, ratio, np.zeros_like(base), np.zeros(base.shape[:2]))


@pytest.fixture(scope="module")
def head():
    return load_head("makehuman")


@pytest.fixture(scope="module")
def drawn(head):
    """Draws the mean head: a grey of 0.4, seen by a camera."""
    texture = np.full((64, 64, 3), 0.4, np.float32)

    def draw(camera=CAMERA, **weights):
        expression = np.zeros(52, np.float32)
        for name, weight in weights.items():
            expression[EXPRESSION_INDEX[name]] = weight
        return condition(head, head.mean, texture, expression, (0.0, 0.0), camera)

    return draw


@pytest.fixture
def play(head):
    """Paints a frame with a change, and says by which factor's log the picture shows it."""
    painter = Painter()
    generator = steady.SteadyGenerator(painter)

    def frame(conditions, change):
        painter.change = change
        made = generator.generate(SimpleNamespace(head=head), conditions)
        assert_allclose(made.image, conditions.deformed_neutral * made.ratio, atol=1e-6)
        return np.log(made.ratio[..., 0])

    return frame


def skin_of(conditions):
    return conditions.part == PARTS.index("skin")


def pattern(head, conditions):
    """A change [H, W, 1] within reach that belongs to the skin, not to the picture."""
    uv = interpolate(conditions.fragments, head.uv[head.uv_faces])
    return 0.04 * np.sin(8 * uv.sum(-1, keepdims=True))


def test_a_still_take_is_the_frame_itself(head, drawn, play):
    seen = drawn(jawOpen=0.4)
    change = pattern(head, seen)
    for _ in range(3):
        assert_allclose(play(seen, change), change[..., 0], atol=1e-5)


def test_a_moving_surface_carries_its_change(head, drawn, play):
    """The head moves by whole pixels, so that nothing is lost by resampling."""
    play(first := drawn(), pattern(head, first))
    seen = drawn(replace(CAMERA, center=CAMERA.center + [7, -3]))
    shown = play(seen, 0.0)
    kept = steady.KEEP * pattern(head, seen)[..., 0]
    skin = skin_of(seen)
    skin[-3:] = False  # rows of throat that have come in at the border
    # Tone is a mean over a millimetre.
    assert (np.abs(shown - kept) < 2e-3)[skin].mean() > 0.98


def test_what_was_hidden_starts_anew(head, drawn, play):
    before = drawn()
    play(before, 0.04)
    turn = rotation.yaw_pitch(35.0, 0.0)
    seen = drawn(replace(CAMERA, rotation=rotation.vector(turn)))
    shown = play(seen, 0.0)
    place = interpolate(seen.fragments, before.vertices[head.faces])
    there = cameras.project(place, CAMERA)
    column, row = np.clip(there.astype(int), 0, SIZE - 1).transpose(2, 0, 1)
    behind = -cameras.to_camera(place, CAMERA)[..., 2] - before.depth[row, column]
    hidden = skin_of(seen) & (behind > 8)  # mm
    assert hidden.sum() > 1000
    # Of pixels that half show both, the nearest one's depth says less than a mean of four.
    assert (np.abs(shown[hidden]) < 1e-6).mean() > 0.98
    front = skin_of(seen) & (np.abs(behind) < 0.2)
    assert np.median(shown[front]) == pytest.approx(steady.KEEP * 0.04, abs=5e-4)  # BLACK


def test_a_step_is_shown_in_its_own_frame_but_for_the_reach(drawn, play):
    seen = drawn(jawOpen=0.6)
    mouth, eyes = is_part(seen.part, *MOUTH), is_part(seen.part, *EYES)
    assert mouth.sum() > 50 and eyes.sum() > 20
    play(seen, 0.0)
    left = [0.5 - play(seen, 0.5) for _ in range(46)]
    assert_allclose(left[0][skin_of(seen)], steady.REACH, atol=1e-5)
    assert_allclose(left[0][mouth], steady.MOUTH_REACH, atol=1e-5)
    assert_allclose(left[0][eyes], 0, atol=1e-6)
    assert np.abs(left[10]).max() < 0.5 * steady.MOUTH_REACH
    assert np.abs(left[45]).max() < 0.05 * steady.MOUTH_REACH


def test_lines_come_with_their_frame(head, drawn, play):
    """Stripes of 1.5 mm, of 4 pixels each, appear: their mean is carried, the stripes are not."""
    seen = drawn(cameras.crop(CAMERA, 48, 48, 256, 256, 8 / 3))
    place = interpolate(seen.fragments, seen.vertices[head.faces])
    lines = np.sin(2 * np.pi * place[..., 1:2] / 1.5)
    front = skin_of(seen) & (seen.normals[..., 2] > 0.9)
    play(seen, 0.0)
    shown = play(seen, 0.05 * lines)[front]
    assert shown.std() > 0.9 * (0.05 * lines[front]).std()


def test_what_goes_to_and_fro_is_calmed(drawn, play):
    seen = drawn()
    shown = [play(seen, 0.02 * (k % 2))[skin_of(seen)].mean() for k in range(40)]
    assert np.abs(np.diff(shown[-10:])).max() < 0.02 * (1 - steady.KEEP) * 1.2
