"""Detail of textures: known gains, known blur."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from bakery.evaluate.generator import detail as generator_detail


def test_amplitude_of_a_wave():
    """A wave above the limit counts with its height, one below does not."""
    x = np.arange(64)
    fine, broad = (np.tile(np.sin(2 * np.pi * f * x), (64, 1)) for f in (1 / 4, 1 / 16))
    one = generator_detail.amplitude(fine)
    assert generator_detail.amplitude(3 * fine) == pytest.approx(3 * one)
    assert generator_detail.amplitude(broad) < 0.01 * one


def test_stretch_of_one_edge():
    rest = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0.0]])
    moved = rest * [1.2, 1, 1]
    assert generator_detail.edge_stretch(rest, moved, np.array([[0, 1, 2]])) == pytest.approx(0.2)


def test_what_happens_to_detail_is_found(bundle, avatar, monkeypatch):
    monkeypatch.setattr(generator_detail, "BLOCK", 16)  # the bundle of the tests is small
    textures = avatar.textures
    same = np.asarray(textures.neutral, np.float32)
    blurred = cv2.GaussianBlur(same, (0, 0), 2.0)
    names = textures.key_names[:2]
    made = replace(
        avatar,
        textures=replace(
            textures, key_names=names, key_weights=textures.key_weights[:2],
            keys=np.stack([1.3 * same, blurred]),
        ),
    )  # fmt: skip
    found = generator_detail.keep(made)
    # A factor is no detail; a blur of two texels leaves little above a period of eight.
    assert found[names[0]]["ratio"] == pytest.approx(1, abs=0.02)
    assert found[names[1]]["ratio"] < 0.5 and found[names[0]]["pieces"] > 0
