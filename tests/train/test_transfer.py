"""Training of the texture transfer: tones, samples, and a run that goes on."""

import json

import numpy as np
import pytest

from bakery.errors import InputError
from bakery.generators import transfer as generators
from bakery.generators.transfer import TransferNetOptions
from bakery.stages.texture.expression import expression_atlas
from bakery.train import transfer
from bakery.train.transfer import data, tones

SIZE = 64


@pytest.fixture(scope="module")
def performers(tmp_path_factory, head):
    from safetensors.numpy import save_file

    folder = tmp_path_factory.mktemp("performers")
    rng = np.random.default_rng(0)
    for number in range(4):
        skin = rng.integers(60, 200, 3)
        textures = np.tile(skin, (3, SIZE, SIZE, 1)).astype(np.uint8)
        textures[1:, 5:20, 10:30] //= 2
        arrays = {"textures": textures, "seen": np.full((3, SIZE, SIZE), 255, np.uint8)}
        about = {"performer": json.dumps({"head": head.name})}
        save_file(arrays, folder / f"performer-{number:05d}.safetensors", about)
    return folder


def test_tones_are_the_modes_that_people_differ_in():
    rng = np.random.default_rng(1)
    skin = np.zeros((32, 32), bool)
    skin[4:28, 4:28] = True
    albedos = 0.3 + rng.normal(size=(40, 1, 1, 1)) * np.array([0.05, 0.02, 0.0])
    albedos = albedos * np.ones((40, 32, 32, 3))
    found = tones.analyse(albedos, np.ones((40, 32, 32)), skin)
    assert found.eigenvalues[0] > 1e3 * found.eigenvalues[1]
    steps = np.array([tones.shift(rng, found, 1.0)[16, 16] for _ in range(400)])
    np.testing.assert_allclose(steps.std(0), [0.05, 0.02, 0.0], rtol=0.3, atol=1e-4)
    assert np.abs(tones.shift(rng, found, 1.0)[~skin]).max() == 0, "mouth and eyes keep their tone"


def test_finer_modes_vary_by_their_eigenvalues():
    modes = np.zeros((2, 1, 1, 3), np.float32)
    modes[0, ..., 0], modes[1, ..., 1] = 2.0, 1.0  # standard deviations: eigenvalues 4 and 1
    found = tones.Tones(modes, np.array([4.0, 1.0]), np.ones((1, 1), np.float32))
    rng = np.random.default_rng(2)
    steps = np.array([tones.shift(rng, found, 1.0)[0, 0] for _ in range(2000)])
    np.testing.assert_allclose(steps.std(0)[:2], [2.0, 0.5], rtol=0.1)


def test_a_mirrored_texture_keeps_its_charts(head):
    atlas = expression_atlas(head, SIZE)
    part = atlas.paint(atlas.part.astype(np.uint8) + 1)
    turned = data.mirrored(part)
    swapped = part.copy()
    left, right = (list(data.PLACES).index(n) for n in ("eye_cap_left", "eye_cap_right"))
    codes = {code: k for k, code in enumerate(np.unique(part[part > 0]))}
    assert len(codes) == 4 and left < right
    swapped[part == max(codes)], swapped[part == sorted(codes)[-2]] = sorted(codes)[-2], max(codes)
    assert (turned != swapped).mean() < 0.03  # rims, by a texel
    texture = np.random.default_rng(3).uniform(size=(SIZE, SIZE, 3))
    np.testing.assert_array_equal(data.mirrored(data.mirrored(texture)), texture)


def test_a_sample_pairs_two_people_in_one_expression(performers):
    people = data.Performers([performers], held_out=0)
    options = transfer.TransferOptions(retoned=0.0, oneself=0.0)
    sample = people.sample(np.random.default_rng(4), options)
    assert {"source", "source_neutral", "target_neutral", "truth", "weight"} <= set(sample)
    assert sample["source"].shape == (SIZE, SIZE, 3)
    assert np.abs(sample["source_neutral"] - sample["target_neutral"]).max() > 0.01
    acted = np.abs(sample["source"] - sample["source_neutral"]).max() > 0
    assert acted == (np.abs(sample["truth"] - sample["target_neutral"]).max() > 0)


def test_a_run_learns_goes_on_and_is_exported(performers, tmp_path):
    options = transfer.TransferOptions(
        steps=2, batch=1, held_out=4, log_every=1, look_every=2, adversarial_from=1,
        network=TransferNetOptions(channels=(8, 8), blocks=0),
    )  # fmt: skip
    run = tmp_path / "run"
    figures = list(transfer.train(run, [performers], options))
    assert [row["step"] for row in figures] == [1, 2]
    assert "judge" not in figures[0] and "judge" in figures[1]
    assert (run / "samples/000002.png").exists() and "held_made" in figures[1]
    more = transfer.TransferOptions(**{**vars(options), "steps": 3})
    assert [row["step"] for row in transfer.train(run, [performers], more)] == [3]
    with pytest.raises(InputError, match="seed"):
        list(
            transfer.train(run, [performers], transfer.TransferOptions(**{**vars(more), "seed": 9}))
        )
    written = transfer.export(run, tmp_path / "weights.safetensors")
    assert written["step"] == 3
    texture = np.full((SIZE, SIZE, 3), 0.5, np.float32)
    made = generators.load(tmp_path / "weights.safetensors")(texture, texture, texture)
    assert np.isfinite(made).all()


def test_performers_must_be_there(tmp_path):
    with pytest.raises(InputError, match="at least 2"):
        data.Performers([tmp_path])
