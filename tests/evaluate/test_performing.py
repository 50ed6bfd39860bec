"""The performance measured: parts whose right answers are known; the whole takes minutes a pair."""

from types import SimpleNamespace

import numpy as np
import pytest

from bakery.evaluate import performing
from bakery.evaluate.performing import Shown
from bakery.evaluate.transferring import Scores
from bakery.landmarks import FACE, LIPS_OUTER


@pytest.fixture(scope="module")
def points():
    """Landmarks on a circle; the lips on a smaller one, below the middle."""
    angle = np.linspace(0, 2 * np.pi, 478, endpoint=False)
    found = 100 + 60 * np.stack([np.cos(angle), np.sin(angle)], 1)
    turn = np.linspace(0, 2 * np.pi, len(LIPS_OUTER), endpoint=False)
    found[LIPS_OUTER] = [100, 130] + 12 * np.stack([np.cos(turn), np.sin(turn)], 1)
    return found


def test_mouth_and_face_are_compared_where_they_are(points):
    truth = SimpleNamespace(encoded=np.full((200, 200, 3), 0.5), landmarks=points)
    made = truth.encoded.copy()
    made[110:150, 80:120] += 0.1  # the mouth and a little more
    mouth, face = performing._compare(made, truth)
    assert mouth == pytest.approx(20, abs=1e-6)  # -10 log10(0.1^2)
    share = 1600 / (np.pi * 60**2)
    assert face == pytest.approx(20 - 10 * np.log10(share), abs=0.2)
    made[:] = 0.5
    made[:30] = 0  # beside the face nothing counts
    assert performing._compare(made, truth) == (120.0, 120.0)


def test_identity_is_told_from_the_face_alone(points):
    picture = np.full((200, 200, 3), 200, np.uint8)
    other = picture.copy()
    other[:, :20] = 0
    cut = performing._cut(picture, points)
    assert cut.shape == (256, 256, 3) and np.array_equal(cut, performing._cut(other, points))
    assert not cut[:5].any() and (cut[128, 128] == 200).all()
    assert len(points[:FACE]) == FACE


def test_the_summary_says_how_far_delta_is_beaten():
    def row(l1, mouth):
        shown = {
            way: Shown(mouth + k, 30, 0.9, 0.3, 5) for k, way in enumerate(("avatar", "transfer"))
        }
        textures = {
            "transfer": Scores(l1, 0.004, 0.9, 21), "delta": Scores(2 * l1, 0.016, 0.8, 20),
        }  # fmt: skip
        return shown, textures

    told = performing.summary([row(0.02, 24), row(0.04, 26)])
    assert told["pairs"] == 2 and told["shown"]["avatar"]["mouth"] == pytest.approx(25)
    assert told["mouth_over_avatar"] == pytest.approx(1)
    assert told["against_delta"] == pytest.approx({"l1": 0.5, "l2": 0.75, "ssim": 0.1, "mouth": 1})
