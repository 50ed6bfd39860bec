"""Shards of training pairs: what is written comes back."""

import numpy as np
import pytest

from bakery.errors import InputError
from bakery.synth.pairs import PLANES, PaintedPair, Shard, iterate, write_shard
from bakery.synth.sheet import contact_sheet

S = 32


def made_up(subject, k):
    """A pair of smooth pictures and random channels; the photo belongs to the subject."""
    rng = np.random.default_rng([subject, k])
    ramp = np.linspace(0, 200, S).astype(np.uint8)
    own = np.full((S, S, 3), 40 + 50 * subject, np.uint8)
    return PaintedPair(
        photo=own,
        photo_face=own[..., 0],
        target=np.stack([np.tile(ramp, (S, 1))] * 3, -1),
        deformed=np.stack([np.tile(ramp[:, None], (1, S))] * 3, -1),
        normals=rng.integers(-127, 128, (S, S, 3)).astype(np.int8),
        depth=rng.integers(0, 256, (S, S)).astype(np.uint8),
        gaze=rng.integers(0, 256, (S, S, 2)).astype(np.uint8),
        part=rng.integers(0, 10, (S, S)).astype(np.uint8),
        face=rng.integers(0, 256, (S, S)).astype(np.uint8),
        strain=rng.integers(0, 256, (S, S, 2)).astype(np.uint8),
        folds=rng.integers(0, 256, (S, S, 2)).astype(np.uint8),
        landmarks=rng.random((478, 2)).astype(np.float32),
        expression=rng.random(52).astype(np.float32),
        gaze_angles=rng.random(2).astype(np.float32),
        yaw=12.5,
        pitch=-3.0,
        subject=subject,
        head="toy",
    )


def test_pairs_come_back(tmp_path):
    pairs = [made_up(subject, k) for subject in (0, 1) for k in range(3)]
    write_shard(tmp_path / "pairs-00000.safetensors", pairs)
    back = list(iterate(tmp_path))
    assert len(back) == 6
    for one, other in zip(pairs, back):
        for name in (*PLANES, "landmarks", "expression", "gaze_angles"):
            np.testing.assert_array_equal(getattr(one, name), getattr(other, name), err_msg=name)
        assert (other.yaw, other.pitch, other.subject, other.head) == (12.5, -3, one.subject, "toy")


def test_same_pairs_give_the_same_bytes(tmp_path):
    for name in ("a", "b"):
        write_shard(tmp_path / name, [made_up(0, 0)])
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()


def test_no_shard_is_an_error(tmp_path):
    with pytest.raises(InputError, match="holds no shards"):
        list(iterate(tmp_path))
    broken = tmp_path / "pairs-00000.safetensors"
    broken.write_bytes(b"nothing of the kind")
    with pytest.raises(InputError, match="no shard of pairs"):
        Shard(broken)


def test_other_version_is_an_error(tmp_path):
    path = tmp_path / "pairs-00000.safetensors"
    write_shard(path, [made_up(0, 0)], {"version": "0"})
    with pytest.raises(InputError, match="version 0"):
        Shard(path)


def test_contact_sheet_takes_subjects_in_turn(tmp_path):
    pairs = [made_up(subject, k) for subject in range(3) for k in range(4)]
    write_shard(tmp_path / "pairs-00000.safetensors", pairs)
    sheet = contact_sheet(tmp_path, 6)
    assert sheet.shape == (S, 8 * S, 3)
    assert (sheet[:, 6 * S :] == 0).all() and sheet[:, : 6 * S].any()
    whole = contact_sheet(tmp_path, 2, whole=True)
    assert whole.shape == (S, 2 * 3 * S, 3)
    # The photo tells the subjects apart: two pictures show two of them.
    assert abs(int(whole[0, 0, 0]) - int(whole[0, 3 * S, 0])) > 40
