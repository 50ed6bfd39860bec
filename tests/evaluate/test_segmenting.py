"""How the segmentation is measured: overlaps with known answers, the summary."""

import numpy as np

from bakery.detectors import portrait
from bakery.evaluate import segmenting

SQUARE = (len(portrait.CLASSES),) * 2


def test_overlaps_of_known_answers():
    truth = np.array([[0, 0, 1, 1], [11, 12, 12, 255]])
    answer = np.array([[0, 1, 1, 1], [12, 11, 12, 5]])
    found = segmenting.overlaps(segmenting.confusion(truth, answer, SQUARE))
    assert found["background"] == 0.5 and found["skin"] == round(2 / 3, 4)
    assert found["frame"] == 0 and found["lens"] == round(1 / 3, 4)
    assert found["glasses"] == 1.0  # frame and lens may be taken for each other
    assert found["eyes"] is None  # not there, and the unsure pixel is left out


def test_a_right_answer_overlaps_wholly():
    labels = np.random.default_rng(0).integers(0, len(portrait.CLASSES), (40, 40))
    found = segmenting.overlaps(segmenting.confusion(labels, labels, SQUARE))
    assert all(value == 1 for value in found.values())


def test_summary_counts_glasses_and_leaves_out_unknown_outlines():
    photos = [
        {"photo": "a", "outline": 0.9, "glasses": 0.2, "worn": True},
        {"photo": "b", "outline": None, "glasses": 0.0, "worn": True},
        {"photo": "c", "outline": 1.0, "glasses": 0.1, "worn": False},
        {"photo": "d", "outline": 0.95, "glasses": 0.0, "worn": False},
    ]
    skins = [{"photo": "x", "masked": 0.01}, {"photo": "y", "masked": 0.03}]
    found = segmenting.summary(photos, skins)
    assert found["glasses_found"] == 0.5 and found["glasses_falsely_found"] == 0.5
    assert found["outlines"] == 3 and found["left_out"] == ["b"]
    assert found["outline"] == 0.95 and found["outline_worst"] == 0.9
    assert found["skin_masked"] == 0.02 and found["skin_masked_worst"] == 0.03
