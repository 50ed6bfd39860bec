"""Training of the close-ups: true points where the crop says, and that it learns."""

import numpy as np
import pytest

from bakery import landmarks as marks
from bakery.detectors import closeups
from bakery.errors import ModelError
from bakery.train.closeups import (
    MARGIN,
    MIRROR,
    WIDE,
    CloseupOptions,
    crops_of,
    export,
    jittered,
    random_face,
    train,
)
from bakery.types import EXPRESSION_INDEX


def spots(count, seed=0):
    """Crops with one bright spot each, and where it is."""
    rng = np.random.default_rng(seed)
    places = rng.uniform(-0.3, 0.3, (count, 1, 2)).astype(np.float32)
    y, x = np.mgrid[:WIDE, :WIDE] + 0.5
    pixels = (places / MARGIN + 0.5) * WIDE
    value = np.exp(-((x - pixels[..., :1]) ** 2 + (y - pixels[..., 1:]) ** 2) / (2 * 4.0**2))
    return (30 + 200 * value).astype(np.uint8), places


def test_jitter_moves_points_with_their_picture():
    crops, places = spots(20)
    out, moved = jittered(np.random.default_rng(1), crops, places)
    v, u = np.mgrid[: closeups.SIDE, : closeups.SIDE] + 0.5
    for crop, place in zip(out.astype(float), moved):
        mass = np.clip(crop - 60, 0, None)
        seen = np.array([(mass * u).sum(), (mass * v).sum()]) / mass.sum()
        np.testing.assert_allclose(seen / closeups.SIDE - 0.5, place[0], atol=0.01)


def test_it_learns_where_a_spot_is(tmp_path):
    crops, places = spots(150)
    options = CloseupOptions(steps=40, batch=8, log_every=20)
    figures = list(train(crops, places, options))
    assert figures[-2]["held_out"] < 0.5 * 0.22  # 0.22: mean distance from the middle
    with pytest.raises(ModelError, match="not finite"):
        list(train(crops, places * np.nan, options))


def test_weights_come_back(tmp_path):
    options = CloseupOptions(steps=1, batch=2)
    made = []
    for count in (closeups.EYE_COUNT, closeups.MOUTH_COUNT):
        points = np.zeros((8, count, 2), np.float32)
        made.append(
            list(train(np.zeros((8, WIDE, WIDE), np.uint8), points, options))[-1]["tensors"]
        )
    export(*made, tmp_path / "w.safetensors")
    eye, mouth = closeups.networks(tmp_path / "w.safetensors")
    assert eye.out.out_features == 2 * closeups.EYE_COUNT and not mouth.training


def test_the_mirror_swaps_the_corners():
    ring = closeups.MOUTH[:20]
    assert ring[0] == marks.MOUTH_CORNERS[0] and ring[MIRROR[0]] == marks.MOUTH_CORNERS[1]
    assert (MIRROR[MIRROR] == np.arange(40)).all()
    assert ring[MIRROR[5]] == ring[5] == 17 and ring[MIRROR[15]] == ring[15] == 0


def test_crops_hold_their_points(head):
    from bakery.geometry import camera as cameras
    from bakery.synth.scene import portrait_camera

    camera = portrait_camera(256, 256)
    points = cameras.project(head.landmarks(head.mean.astype(float)), camera)
    picture = np.full((256, 256, 3), 90, np.uint8)
    eyes, seen, mouth, lips = crops_of(np.random.default_rng(0), picture, points)
    assert eyes.shape == (2, WIDE, WIDE) and mouth.shape == (WIDE, WIDE)
    assert seen.shape == (2, closeups.EYE_COUNT, 2) and np.abs(seen).max() < 0.6
    assert lips.shape == (closeups.MOUTH_COUNT, 2) and np.abs(lips).max() < 0.6
    assert np.abs(seen[0] - seen[1]).max() < 0.06  # the head is symmetric, the right eye mirrored


def test_faces_blink_and_open():
    rng = np.random.default_rng(0)
    rows = np.array([random_face(rng)[0] for _ in range(300)])
    assert rows.min() >= 0 and rows.max() <= 1
    assert (rows[:, EXPRESSION_INDEX["eyeBlinkLeft"]] > 0.8).mean() > 0.1
    assert (rows[:, EXPRESSION_INDEX["jawOpen"]] > 0.4).mean() > 0.05
