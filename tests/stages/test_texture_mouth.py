"""Choosing mouth poses."""

from types import SimpleNamespace

import numpy as np
import pytest

from bakery.generators.interior import FRAME_SCALE
from bakery.geometry import camera as cameras
from bakery.stages.texture.mouth import (
    LIPS,
    candidate_poses,
    crop_camera,
    ranging,
    smiling,
    spread,
    talking,
)
from bakery.types import EXPRESSION_INDEX, Camera


def test_spread_takes_the_ends_of_a_line_first():
    points = np.linspace(0, 1, 101)[:, None]
    assert spread(points, 3).tolist() == [0, 100, 50]


def test_spread_is_even():
    """On a square, farthest-point choice keeps every two points apart by nearly the same."""
    points = np.random.default_rng(0).random((4000, 2))
    chosen = points[spread(points, 60)]
    distance = np.linalg.norm(chosen[:, None] - chosen[None], axis=2) + 9 * np.eye(60)
    nearest = distance.min(1)
    # Greedy choice is a 2-approximation of the best spacing (Gonzalez 1985).
    assert nearest.max() / nearest.min() < 2.05


@pytest.mark.parametrize("kind", [talking, smiling, ranging])
def test_candidates_are_weights_and_begin_with_rest(kind):
    poses = candidate_poses(np.random.default_rng(0), kind, 200)
    assert poses.min() >= 0 and poses.max() <= 1
    assert not poses[0].any() and poses[1:].any(1).mean() > 0.85  # the silent viseme is at rest
    assert (poses[:, EXPRESSION_INDEX["browInnerUp"]] == 0).all()


@pytest.mark.parametrize("distance", [500, 700, 1000])
def test_the_crop_holds_what_lips_reach_and_fills_the_network(head, distance):
    marks = cameras.project(
        head.landmarks(head.mean),
        camera := Camera(
            1.75 * distance, np.full(2, 256.0), np.zeros(3), np.array([0, 0, -distance]), 512, 512
        ),
    )
    crop = crop_camera(SimpleNamespace(head=head, neutral=head.mean), camera)
    assert crop.width == crop.height
    side = crop.width / (cameras.pixels_per_mm(crop) / (FRAME_SCALE * 512))
    assert side == pytest.approx(32 * round(side / 32), abs=0.7)  # the crop has whole pixels
    lips = marks[LIPS]
    middle, width = lips.mean(0), np.ptp(lips[:, 0])
    reach = middle + width * np.array([[-0.72, -0.33], [0.72, 1.01]])
    scale = crop.focal / camera.focal
    corner = camera.center - crop.center / scale
    low, high = (reach - corner) * scale
    assert low.min() > 0 and high.max() < crop.width
