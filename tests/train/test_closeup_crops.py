"""Crops of painted people: their points lie where the crop says, and faces do what is hard to see."""

import numpy as np
import pytest

from bakery import landmarks as marks
from bakery.detectors import closeups
from bakery.train.closeups import crops as closeup_crops
from bakery.train.closeups.crops import WIDE, jittered, random_face, random_view
from bakery.types import EXPRESSION_INDEX


def test_jitter_moves_points_with_their_picture(spots):
    crops, places = spots(20)
    out, moved = jittered(np.random.default_rng(1), crops, places)
    v, u = np.mgrid[: closeups.SIDE, : closeups.SIDE] + 0.5
    for crop, place in zip(out.astype(float), moved):
        mass = np.clip(crop - 60, 0, None)
        seen = np.array([(mass * u).sum(), (mass * v).sum()]) / mass.sum()
        np.testing.assert_allclose(seen / closeups.SIDE - 0.5, place[0], atol=0.01)


def test_crops_hold_their_points(head):
    from bakery.geometry import camera as cameras
    from bakery.synth.scene import portrait_camera

    camera = portrait_camera(256, 256)
    points = cameras.project(head.landmarks(head.mean.astype(float)), camera)
    picture = np.full((256, 256, 3), 90, np.uint8)
    # Believed points may be far off, and differently for each eye: many looks are averaged.
    table = closeup_crops.table_of(np.random.default_rng(0), [(picture, points)], 40)
    assert table["eyes"].shape == (80, WIDE, WIDE) and table["eyes"].dtype == np.uint8
    assert table["mouths"].shape == (40, WIDE, WIDE)
    eyes, lips = table["eye_points"], table["mouth_points"]
    assert eyes.shape == (80, 478, 2) and lips.shape == (40, 478, 2) and lips.dtype == np.float32
    (left, right), (mouth,) = closeup_crops.rows_seen(head)
    assert np.abs(np.median(lips, 0)[mouth]).max() < 0.55
    left, right = np.median(eyes[::2], 0)[left], np.median(eyes[1::2], 0)[right]
    assert np.abs(left).max() < 0.55
    assert np.abs(left - right).max() < 0.06  # the head is symmetric, the right eye mirrored


def test_rows_hold_all_of_lids_brows_and_lips(head):
    (left, right), (mouth,) = closeup_crops.rows_seen(head)
    assert set(marks.EYE_LEFT) | set(marks.BROW_LEFT) | {marks.LEFT_IRIS.start} <= set(left)
    assert set(marks.EYE_RIGHT) | set(marks.BROW_RIGHT) | {marks.RIGHT_IRIS.start} <= set(right)
    assert set(marks.LIPS) | set(marks.NOSE_BASE) <= set(mouth)
    where = dict(zip(left, right))
    assert [where[row] for row in marks.EYE_LEFT] == list(marks.EYE_RIGHT)
    mirror = closeup_crops.mirrored_rows(head, mouth)
    assert (mirror[mirror] == np.arange(len(mouth))).all()
    assert mouth[mirror[list(mouth).index(61)]] == 291 and mouth[mirror[list(mouth).index(0)]] == 0


def test_features_are_believed_off_as_a_whole(head):
    from bakery.geometry import camera as cameras
    from bakery.synth.scene import portrait_camera

    points = cameras.project(head.landmarks(head.mean.astype(float)), portrait_camera(256, 256))
    rng = np.random.default_rng(0)
    moved = [closeup_crops.believed(rng, points) - points for _ in range(200)]
    away = np.array([move[marks.LIPS].mean(0) for move in moved]) / marks.face_size(points)
    assert 0.015 < away.std() < 0.05 and np.abs(away.mean(0)).max() < 0.01
    assert np.abs(away).max() < 0.12


@pytest.mark.parametrize("painter", ["quick", "careful"])
def test_painted_people_come_with_their_points(head, painter):
    """Every frame is another one, and its points are in it or just beside it."""
    from bakery.synth.quick import make_stage

    rng = np.random.default_rng(4)
    if painter == "quick":
        found = list(closeup_crops.quick_frames(rng, make_stage(head, 128), [], 3))
    else:
        small = closeup_crops.TrainingOptions(size=96, supersample=1)
        found = list(closeup_crops.careful_frames(rng, head, 2, small))
    for picture, points in found:
        assert picture.dtype == np.uint8 and picture.shape[0] == picture.shape[1]
        assert points.shape == (478, 2) and picture.std() > 3
        side = len(picture)
        inside = (points > -0.2 * side) & (points < 1.2 * side)
        assert inside.all()
    first, second = (points for _, points in found[:2])
    assert np.abs(first - second).max() > 3  # another view, another expression


def test_faces_blink_open_and_press_their_lips():
    rng = np.random.default_rng(0)
    rows = np.array([random_face(rng)[0] for _ in range(400)])
    assert rows.min() >= 0 and rows.max() <= 1
    assert (rows[:, EXPRESSION_INDEX["eyeBlinkLeft"]] > 0.8).mean() > 0.1
    assert (rows[:, EXPRESSION_INDEX["jawOpen"]] > 0.4).mean() > 0.05
    for name in ("mouthPressLeft", "mouthRollLower", "mouthPucker", "mouthClose"):
        assert (rows[:, EXPRESSION_INDEX[name]] > 0.2).mean() > 0.02


def test_views_reach_far_to_both_sides():
    rng = np.random.default_rng(0)
    yaw, pitch, roll = np.array([random_view(rng) for _ in range(500)]).T
    assert yaw.min() < -38 and yaw.max() > 38 and np.abs(yaw).max() <= 42
    assert np.abs(pitch).max() <= 42 and np.abs(roll).max() <= 42
    assert (np.abs(yaw) < 15).mean() > 0.4
