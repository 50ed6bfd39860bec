"""The texture transfer: what it says before it was trained, what ships, and bad input."""

import hashlib
import re

import numpy as np
import pytest
import torch

from bakery.errors import ModelError
from bakery.generators import transfer

SMALL = transfer.TransferNetOptions(channels=(8, 8), blocks=0)


def textures(seed, size=32):
    return np.random.default_rng(seed).uniform(0.2, 0.8, (size, size, 3)).astype(np.float32)


def test_at_first_the_target_is_shown_with_a_part_of_the_change():
    painter = transfer.TextureTransfer(transfer.TransferNet(SMALL, folded=True))
    rest, own = textures(1), textures(2)
    same = painter(rest, rest, own)
    assert same.shape == (32, 32, 3) and same.dtype == np.float32
    # Nothing acted: nine tenths of each texel are the target's.
    assert np.abs(same - own).mean() < 0.05
    darker = painter(0.6 * rest, rest, own)
    assert darker.mean() < same.mean() - 0.02


def test_the_papers_inputs_are_fewer():
    options = transfer.TransferNetOptions(
        channels=(8, 8), blocks=0, inputs=("source", "target_neutral")
    )
    painter = transfer.TextureTransfer(transfer.TransferNet(options, folded=True))
    assert painter.network.stem.conv.in_channels == 4 * 6
    first = painter(textures(1), textures(2), textures(3))
    np.testing.assert_array_equal(first, painter(textures(1), textures(4), textures(3)))


def test_whole_shares_are_the_pictures_themselves():
    batch = {
        name: torch.full((1, 3, 2, 2), value)
        for name, value in (("source", 0.4), ("source_neutral", 0.5), ("target_neutral", 0.2))
    }
    outputs = torch.zeros(1, transfer.OUTPUTS, 2, 2)
    outputs[:, 3] = 100  # all of the performer's ratio
    outputs[:, 10:] = -100
    wanted = 0.23 * 0.43 / 0.53 - 0.03
    made = transfer.compose(outputs, batch)
    np.testing.assert_allclose(made, wanted, atol=1e-5)
    outputs[:, 10] = 100
    np.testing.assert_allclose(transfer.compose(outputs, batch), 0.4, atol=1e-5)
    outputs[:, 11] = 300
    np.testing.assert_allclose(transfer.compose(outputs, batch), 0.5, atol=1e-5)


def test_textures_must_go_together():
    painter = transfer.TextureTransfer(transfer.TransferNet(SMALL, folded=True))
    with pytest.raises(ValueError, match="source_neutral"):
        painter(textures(1), textures(2, 16), textures(3))
    with pytest.raises(ValueError, match="multiple of 4"):
        painter(textures(1, 30), textures(2, 30), textures(3, 30))


def test_other_files_are_told_apart(tmp_path):
    with pytest.raises(ModelError, match="no weights"):
        transfer.load(tmp_path / "none.safetensors")
    from safetensors.numpy import save_file

    save_file({"a": np.zeros(1, np.float32)}, tmp_path / "other.safetensors")
    with pytest.raises(ModelError, match="holds no texture transfer"):
        transfer.load(tmp_path / "other.safetensors")


def test_what_ships_carries_the_change_and_keeps_the_target():
    card = transfer.WEIGHTS.with_suffix(".md").read_text(encoding="utf-8")
    (digest,) = re.findall(r"SHA-256 ([0-9a-f]{64})", card)
    painter = transfer.load()
    assert digest == painter.sha256 == hashlib.sha256(transfer.WEIGHTS.read_bytes()).hexdigest()
    pale, dark = (np.full((256, 256, 3), level, np.float32) for level in (0.7, 0.35))
    rest = painter(pale, pale, dark)
    assert abs(np.median(rest) - 0.35) < 0.05  # the performer is twice as light
    shaded = pale.copy()
    shaded[40:80, 100:150] *= 0.7
    change = (rest - painter(shaded, pale, dark))[45:75, 105:145]
    assert change.mean() > 0.005  # a flat face is not what it learned: it follows, with caution
