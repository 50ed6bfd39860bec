"""The segmentation network: shapes, folding, outlines of points, bad weights."""

import cv2
import numpy as np
import pytest
import torch

from bakery import landmarks as marks
from bakery.detectors import portrait, segmenter
from bakery.detectors.blocks import fold
from bakery.errors import ModelError
from bakery.heads.file import load_head


@pytest.fixture(scope="module")
def points():
    """Points of the mean head as they lie in its crop, upright, a little below the middle."""
    head = load_head("makehuman")
    flat = head.landmarks(head.mean)[:, :2] * [1, -1]
    flat = flat - (flat.min(0) + flat.max(0)) / 2
    flat = flat / np.ptp(flat, axis=0).max() + [0, portrait.UP]
    return (flat / portrait.MARGIN + 0.5) * portrait.SIDE


def test_folded_network_answers_the_same():
    torch.manual_seed(0)
    network = segmenter.SegmentNet()
    for module in network.modules():
        if isinstance(module, torch.nn.BatchNorm2d):
            torch.nn.init.uniform_(module.weight, 0.5, 1.5)
            module.running_mean.normal_(0, 0.1)
            module.running_var.uniform_(0.5, 2)
    folded = segmenter.SegmentNet(folded=True)
    folded.load_state_dict(fold(network.eval()))
    x = torch.rand(1, 7, 64, 64)
    with torch.inference_mode():
        for one, other in zip(network(x), folded(x)):
            torch.testing.assert_close(one, other, atol=1e-4, rtol=1e-3)
    logits, shadow = folded(x)
    assert logits.shape == (1, len(portrait.CLASSES), 64, 64) and shadow.shape == (1, 64, 64)


def test_the_network_is_small():
    values = sum(p.numel() for p in segmenter.SegmentNet(folded=True).parameters())
    assert values * 2 < 4e6  # bytes in half precision


def test_outlines_are_the_polygons(points):
    drawn = segmenter.outlines(torch.from_numpy(np.float32(points))[None])[0].numpy()
    truth = np.zeros((portrait.SIDE, portrait.SIDE), np.uint8)
    cv2.fillPoly(truth, [np.round((points[marks.OVAL] - 0.5) * 16).astype(np.int32)], 1, shift=4)
    # Half the resolution: a pixel either side of the edge may differ.
    assert np.abs(drawn[0] - truth).mean() < 2.5 * 2 * np.pi / 4 / portrait.SIDE
    assert drawn[0, 128, 128] == 1 and drawn[0, 2, 2] == 0
    eyes = np.round(points[[468, 473]]).astype(int)
    assert (drawn[1][eyes[:, 1], eyes[:, 0]] > 0.5).all()
    assert set(np.round(np.unique(drawn[3]), 2)) >= {0.0, 0.5}


def test_the_crop_shows_the_face_upright_below_the_middle(points):
    turn = np.array([[0.9, -0.4], [0.4, 0.9]])
    moved = points @ turn.T * 2.5 + [300, -20]
    matrix = portrait.crop_matrix(moved)
    np.testing.assert_allclose(moved @ matrix[:, :2].T + matrix[:, 2], points, atol=0.01)


def test_take_keeps_a_picture_under_the_identity():
    picture = np.random.default_rng(0).integers(0, 256, (32, 32, 3), np.uint8)
    same = segmenter.take(picture, np.eye(2, 3), 32)
    np.testing.assert_array_equal(same, picture)


def test_segment_gives_shares_of_a_photo(points):
    network = segmenter.SegmentNet(folded=True).eval()
    image = np.full((300, 256, 3), 128, np.uint8)
    shares, shadow, matrix = segmenter.segment(network, image, points)
    np.testing.assert_allclose(shares.sum(0), 1, atol=1e-4)
    assert 0 <= shadow.min() and shadow.max() <= 1 and matrix.shape == (2, 3)


def test_other_weights_are_refused(tmp_path):
    path = tmp_path / "other.safetensors"
    with pytest.raises(ModelError, match="no weights"):
        segmenter.load(path)
    path.write_bytes(b"nonsense")
    with pytest.raises(ModelError, match="no weights"):
        segmenter.load(path)
