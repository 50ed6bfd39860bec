"""The skin database is learned: averages, tones, and the file that they are kept in."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from bakery.stages.texture import correlations as windowed
from bakery.stages.texture import database as skins
from bakery.train import correlations, skin, tone
from bakery.train.regions import REGIONS

PEOPLE = 16  # of each kind more than an average takes


@pytest.fixture(scope="module")
def found():
    """People of two kinds: rough above and smooth below, or the other way round."""
    rng = np.random.default_rng(0)
    rows = np.arange(windowed.WINDOWS**2) // windowed.WINDOWS < 10
    out = []
    for person in range(PEOPLE):
        rough = rows if person % 2 else ~rows
        energy = np.where(rough, 0.04, 0.01) * rng.uniform(0.9, 1.1, len(rows))
        gram = energy[:, None, None] * np.eye(windowed.FEATURES)
        known = np.ones(len(rows), np.float32)
        out.append(windowed.Correlations(gram.astype(np.float32), known))
    return out


def test_entries_are_averages_of_people_who_are_alike(found):
    options = correlations.CorrelationOptions(entries=4, people=3)
    entries = correlations.learn(found, options)
    assert entries.shape == (4, windowed.WINDOWS**2, windowed.FEATURES, windowed.FEATURES)
    diagonal = entries[:, :, 0, 0].reshape(4, 2, -1).mean(2)
    ratio = diagonal[:, 0] / diagonal[:, 1]
    assert np.isclose(ratio, 4, rtol=0.1).any() and np.isclose(ratio, 0.25, rtol=0.1).any()
    assert (np.isclose(ratio, 4, rtol=0.1) | np.isclose(ratio, 0.25, rtol=0.1)).all()
    lone = [np.abs(entries[0] - one.gram / one.gram[:, 0, 0].mean()).max() for one in found]
    assert min(lone) > 1e-3, "an entry is a person"


def test_tones_of_rank_one_are_found():
    rng = np.random.default_rng(1)
    size = 24
    mode = rng.normal(size=(size, size, 3))
    mode = (mode + mode[:, ::-1]) / 2
    amounts = rng.normal(size=12)
    tones = -1 + amounts[:, None, None, None] * 0.1 * mode
    trusts = np.ones((12, size, size))
    trusts[:4, :6] = 0
    mean, modes = tone.learn(tones, trusts, tone.ToneOptions(size=size, modes=2))
    assert modes.shape == (2, size, size, 3)
    cosine = (modes[0] * mode).sum() / np.linalg.norm(modes[0]) / np.linalg.norm(mode)
    assert abs(cosine) > 0.95
    assert np.linalg.norm(modes[1]) < 0.3 * np.linalg.norm(modes[0])
    assert np.abs(mean).max() < 0.5


def test_what_is_written_is_read_again(tmp_path, found):
    entries = correlations.learn(found, correlations.CorrelationOptions(entries=3, people=2))
    entries[:, :40] = 0  # windows that nobody shows
    rng = np.random.default_rng(2)
    made = skins.database_of(
        entries, rng.normal(size=(8, 8, 3)), rng.normal(size=(2, 8, 8, 3)).astype(np.float32)
    )
    path = tmp_path / "skin.safetensors"
    skin.save(made, path)
    read = skins.load_database(path)
    assert_allclose(read.gram, made.gram, rtol=2e-3, atol=1e-4)
    assert np.array_equal(read.known, made.known) and not read.known[:, :40].any()
    assert_allclose(read.tone, made.tone, rtol=2e-3, atol=1e-4)
    assert_allclose(read.tone_modes, made.tone_modes, atol=np.abs(made.tone_modes).max() / 250)
    card = skin.model_card(made, {"mouth": 0.3}, path, "abc")
    assert card["entries"] == 3 and card["tones"] == 2 and len(card["sha256"]) == 64


def test_hidden_windows_lie_in_their_region(head):
    grids = {
        name: skin.hidden_windows(name, head).reshape(windowed.WINDOWS, windowed.WINDOWS)
        for name in REGIONS
    }
    rows = {name: np.flatnonzero(grid.any(1)).mean() for name, grid in grids.items()}
    assert rows["forehead"] < 6 < 11 < rows["mouth"]
    assert not (grids["forehead"] & grids["mouth"]).any()


def test_left_out_people_are_predicted_by_those_who_are_alike(head, found):
    blank = np.zeros((2, 2, 3), np.float32)
    seen = [skin.Seen(one, blank, blank[..., 0]) for one in found]
    errors = skin.left_out_error(seen, head)
    assert errors["mouth"] < 0.3, "the kind of a face is told by its other half"
