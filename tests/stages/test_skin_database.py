"""What hidden skin most likely looks like: correlations in windows, tones, and their blends."""

import hashlib
import json
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from bakery.errors import ModelError
from bakery.landmarks import OVAL
from bakery.stages.atlas import make_atlas, uv_polygon
from bakery.stages.texture import correlations as windowed
from bakery.stages.texture import database as skins
from bakery.stages.texture.tone import likely_tone

SIZE = 256


@pytest.fixture(scope="module")
def windows(head):
    return windowed.windows_of(head, make_atlas(head, SIZE).take("skin"))


@pytest.fixture(scope="module")
def shipped():
    return skins.load_database()


def gray(values):
    return np.repeat(np.exp(values)[..., None], 3, 2).astype(np.float32)


def everywhere():
    return np.ones((SIZE, SIZE), np.float32)


def test_plain_skin_has_no_correlations(windows):
    found = windowed.correlations(gray(np.full((SIZE, SIZE), -1.0)), everywhere(), windows)
    assert_allclose(found.gram, 0, atol=1e-10)
    assert found.known.max() == 1


def test_stripes_lie_along_one_direction_in_their_octave(windows):
    """A wave of 24 texels of DENSITY along u: the coarsest octave, no change along v."""
    period = 24 * SIZE / windowed.DENSITY
    wave = 0.1 * np.sin(2 * np.pi * np.arange(SIZE) / period)
    found = windowed.correlations(gray(np.tile(wave - 1, (SIZE, 1))), everywhere(), windows)
    diagonal = np.diagonal(found.gram, axis1=1, axis2=2)[found.known == 1].mean(0)
    along_u = diagonal[2 :: windowed.KINDS] + diagonal[3 :: windowed.KINDS]
    along_v = diagonal[4 :: windowed.KINDS] + diagonal[5 :: windowed.KINDS]
    assert along_v.max() < 1e-6 * along_u.max()
    energy = found.energy()[found.known == 1].mean(0)
    # A band of Gaussians passes a part of a wave's mean square; finer ones next to nothing.
    assert 0.1 * 0.1**2 / 2 < energy.max() < 0.1**2 / 2
    assert energy.argmax() == 3 and energy[0] < 1e-3 * energy.max()


def test_what_is_hidden_is_not_known(windows):
    seen = everywhere()
    seen[:, : SIZE // 2] = 0
    noise = np.random.default_rng(0).normal(-1, 0.05, (SIZE, SIZE))
    found = windowed.correlations(gray(noise), seen, windows)
    grid = found.known.reshape(windowed.WINDOWS, windowed.WINDOWS)
    assert (
        grid[:, :8].max() == 0 and grid[8, 14] > 0.95
    )  # less the filters' reach at the charts' borders
    assert (found.gram[found.known == 0][:, 0, 0] == 0).mean() > 0.9


def test_mirrored_correlations_are_those_of_the_mirrored_picture(windows):
    noise = np.random.default_rng(1).normal(size=(SIZE, SIZE)).cumsum(1) * 0.01 - 1
    one = windowed.correlations(gray(noise), everywhere(), windows)
    other = windowed.correlations(np.ascontiguousarray(gray(noise)[:, ::-1]), everywhere(), windows)
    turned = skins.mirrored(one.gram)
    assert_allclose(skins.mirrored(turned), one.gram)
    # The built-in head and its chart are symmetric up to the windows' borders.
    both = (one.known == 1) & (other.known == 1)
    a, b = (np.diagonal(x[both], axis1=1, axis2=2) for x in (turned, other.gram))
    assert np.median(np.abs(np.log((a + 1e-7) / (b + 1e-7)))) < 0.15


def test_convex_weights():
    rng = np.random.default_rng(2)
    entries = rng.random((5, 40))
    found = skins.convex_weights(entries, 0.3 * entries[1] + 0.7 * entries[4])
    assert_allclose(found, [0, 0.3, 0, 0, 0.7], atol=1e-3)
    beyond = skins.convex_weights(entries, 3 * entries[2])
    assert beyond.min() >= 0 and beyond.sum() == pytest.approx(1)


def test_a_known_skin_is_found_again(shipped):
    """An entry of the database, half hidden, in another contrast."""
    entry, contrast = 3, 0.05
    hidden = np.arange(windowed.WINDOWS**2) // windowed.WINDOWS > 11
    known = shipped.known[entry].astype(np.float32)
    gram = contrast**2 * shipped.gram[entry]
    partial = windowed.Correlations(gram * ~hidden[:, None, None], known * ~hidden)
    found = skins.blended(partial, shipped)
    there = hidden & (known > 0) & (found.known > 0)
    truth = windowed.Correlations(gram, known).energy()[there]
    ratio = found.energy()[there] / truth
    assert there.sum() > 30
    assert 0.85 < np.median(ratio) < 1.15


def test_a_tone_of_the_basis_is_found_again(head, shipped):
    level = np.log([0.3, 0.2, 0.15])
    size = shipped.tone.shape[0]
    flat = replace(shipped, tone_modes=np.zeros((1, size, size, 3), np.float32))
    nothing = np.zeros((SIZE, SIZE), np.float32)
    blank = np.full((SIZE, SIZE, 3), 0.3, np.float32)
    atlas = make_atlas(head, SIZE).take("skin")
    mean = likely_tone(blank, nothing, head, atlas, flat)
    strong = replace(flat, tone=shipped.tone + 1.5 * shipped.tone_modes[0])
    truth = likely_tone(blank, nothing, head, atlas, strong) / 0.3 * np.exp(level)
    seen = everywhere()
    seen[: SIZE // 2] = 0
    found = likely_tone(truth.astype(np.float32), seen, head, atlas, shipped)
    face = (uv_polygon(head, OVAL, 0.7, SIZE) > 0) & (seen == 0)
    before = np.abs(np.log(mean / 0.3 * np.exp(level) / truth))[face].mean()
    # The ridge shrinks what a half of one face says by a third.
    assert np.abs(np.log(found / truth))[face].mean() < 0.75 * before


def test_a_missing_or_damaged_database(tmp_path):
    path = tmp_path / "skin.safetensors"
    for content in (None, b"nothing"):
        if content:
            path.write_bytes(content)
        with pytest.raises(ModelError, match="--complete mirror") as told:
            skins.load_database(path)
        assert "\n" not in str(told.value)


def test_the_card_is_of_this_file():
    card = json.loads(skins.FILE.with_suffix(".json").read_text(encoding="utf-8"))
    assert card["sha256"] == hashlib.sha256(skins.FILE.read_bytes()).hexdigest()
    assert card["metrics"]["mouth"] < 0.4 and card["metrics"]["forehead"] < 0.35
    assert skins.FILE.stat().st_size < 16 * 2**20
