"""Training pairs of eyes and mouths from single photographs."""

import numpy as np
import pytest

from bakery.errors import InputError
from bakery.formats.record import read_faces
from bakery.heads.base import PARTS
from bakery.landmarks import LIPS_INNER
from bakery.train import interiors

SKIN = PARTS.index("skin")


def test_a_blot_lies_between_the_lips():
    points = np.zeros((478, 2))
    angle = np.linspace(0, 2 * np.pi, len(LIPS_INNER), endpoint=False)
    points[LIPS_INNER] = 32 + 12 * np.stack([np.cos(angle), np.sin(angle)], 1)
    for photo in (np.full((64, 64, 3), 200, np.uint8), np.full((64, 64, 3), 0.8, np.float32)):
        made = interiors.blotted(photo, points)
        changed = (made != photo).any(-1)
        assert made.dtype == photo.dtype and changed[32, 32] and not changed[:18].any()
        assert changed.sum() == pytest.approx(np.pi * 12**2, rel=0.1)
        red = made[32, 32] / photo.max()
        assert red[0] > red[1] and red[0] < 0.5


def test_a_photo_that_cannot_be_used_is_left_out(head, tmp_path, monkeypatch):
    def refuse(*_, **__):
        raise InputError("no face")

    monkeypatch.setattr(interiors, "FittedSubject", refuse)
    monkeypatch.setattr(interiors, "read_photo", lambda path: None)
    points = np.random.default_rng(0).uniform(0, 100, (478, 2))
    made = list(interiors.write_interiors({tmp_path / "a.jpg": points}, head, tmp_path))
    assert made == [(tmp_path / "a.jpg", "no face")] and not list(tmp_path.glob("*.safetensors"))


@pytest.mark.slow
def test_a_painted_portrait(portrait, head, tmp_path):
    """Its eyes count, its closed mouth does not, and it is its own target."""
    from bakery.synth.pairs import Shard

    _, (face,) = read_faces(portrait[1])
    ((_, left_out),) = interiors.write_interiors({portrait[0]: face.points}, head, tmp_path)
    assert left_out is None
    assert not list(interiors.write_interiors({portrait[0]: face.points}, head, tmp_path))
    pair = Shard(tmp_path / "pairs-00000.safetensors")[0]
    counts = pair.face > 128
    low, high = pair.landmarks[:468].min(0), pair.landmarks[:468].max(0)
    rows = np.flatnonzero(counts.any(1))
    middle = (low[1] + high[1]) / 2
    assert 0.001 < counts.mean() < 0.03 and rows.max() < middle  # eyes lie in the upper half
    inside = counts & (pair.part == SKIN)
    assert inside.sum() < counts.sum() / 2
