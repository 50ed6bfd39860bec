"""Training pairs of eyes and mouths from single photographs."""

from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from bakery.errors import InputError
from bakery.formats.record import read_faces
from bakery.generators.channels import BLOT
from bakery.heads.base import PARTS
from bakery.landmarks import LIPS_INNER
from bakery.train import interiors

SKIN = PARTS.index("skin")


def test_a_mouth_has_the_tone_of_the_photo_and_the_edges_of_the_geometry():
    side = 512
    part = np.full((side, side), SKIN, np.uint8)
    teeth = np.s_[230:282, 200:312]
    part[teeth] = PARTS.index("teeth_upper")
    deformed = np.full((side, side, 3), 180, np.uint8)
    deformed[230:282, 256:258] = 60  # the gap between two teeth
    normals = np.zeros((side, side, 3), np.int8)
    normals[..., 2] = 127
    pair = SimpleNamespace(
        part=part, deformed=deformed, normals=normals, depth=np.full((side, side), 200, np.uint8)
    )
    photo = np.full((side, side, 3), 120, np.uint8)
    photo[:, :256] = 90  # darker to one side; its teeth have no gap
    made = interiors.with_edges(photo, pair)
    np.testing.assert_array_equal(made[part == SKIN], photo[part == SKIN])
    row = made[256, 200:312, 0].astype(int)
    # Away from gap and step the tone is the photo's.
    assert abs(row[20:40] - 90).max() <= 3 and abs(row[75:95] - 120).max() <= 3
    assert row[56:58].max() < 0.8 * row[40:50].min(), "the gap stays"


def test_a_photo_that_cannot_be_used_is_left_out(head, tmp_path, monkeypatch):
    def refuse(*_, **__):
        raise InputError("no face")

    picture = tmp_path / "a.png"
    cv2.imwrite(str(picture), np.full((120, 120, 3), 90, np.uint8))
    monkeypatch.setattr(interiors, "FittedSubject", refuse)
    points = np.random.default_rng(0).uniform(0, 100, (478, 2))
    made = list(interiors.write_interiors({picture: points}, head, tmp_path))
    assert made == [(picture, "no face")] and not list(tmp_path.glob("*.safetensors"))


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


@pytest.mark.slow
def test_a_mouth_that_is_hidden_from_the_bake_stays_its_target(portrait, head, tmp_path):
    """The first open mouth is blotted for the fit; what is to be painted is the photo's all the same."""
    from bakery.synth.pairs import Shard

    _, (face,) = read_faces(portrait[1])
    points = face.points.copy()
    points[LIPS_INNER[1:10], 1] += 0.2 * np.ptp(points[LIPS_INNER, 0])  # as if its lips were open
    ((_, left_out),) = interiors.write_interiors({portrait[0]: points}, head, tmp_path)
    assert left_out is None
    pair = Shard(tmp_path / "pairs-00000.safetensors")[0]
    x, y = pair.landmarks[[13, 14]].mean(0).astype(int)
    assert pair.target[y, x].min() > BLOT.max()
