"""Training of the close-ups: a run that paints once, people held out, and that it learns."""

import numpy as np
import pytest
import torch

from bakery.detectors import closeups
from bakery.errors import InputError, ModelError
from bakery.train import closeups as training
from bakery.train.closeups import CloseupOptions, export, train
from bakery.train.closeups import crops as closeup_crops
from bakery.train.closeups.crops import WIDE


def test_it_learns_where_a_spot_is(spots):
    crops, places = spots(150)
    options = CloseupOptions(steps=40, batch=8, log_every=20)
    held = {"other": spots(20, 1)}
    figures = list(train(crops, places, options, held))
    assert figures[-2]["held_out_other"] < 0.5 * 0.22  # 0.22: mean distance from the middle
    with pytest.raises(ModelError, match="not finite"):
        list(train(crops, places * np.nan, options))


def test_weights_come_back(tmp_path):
    options = CloseupOptions(steps=1, batch=2)
    made = []
    for rows in ([[5, 6, 473], [7, 8, 468]], [[0, 13]]):
        points = np.zeros((8, len(rows[0]), 2), np.float32)
        tensors = list(train(np.zeros((8, WIDE, WIDE), np.uint8), points, options))[-1]["tensors"]
        made.append(tensors | {"rows": torch.tensor(rows)})
    export(*made, tmp_path / "w.safetensors")
    eye, mouth = closeups.networks(tmp_path / "w.safetensors")
    assert eye.rows.tolist() == [[5, 6, 473], [7, 8, 468]] and mouth.rows.tolist() == [[0, 13]]
    assert eye.network.out.out_features == 6 and not mouth.network.training


def test_a_run_paints_once_and_holds_people_out(head, tmp_path, monkeypatch):
    """Each person is painted once; every `held`-th is measured only."""
    painted = []

    def frames(rng, *given):
        painted.append(given)
        picture = np.full((64, 64, 3), rng.integers(255), np.uint8)
        yield picture, head.landmarks(head.mean)[:, :2] * [0.3, -0.3] + 32

    for name in ("quick_frames", "careful_frames"):
        monkeypatch.setattr(training.crops_of_people, name, frames)
    monkeypatch.setattr(training, "make_stage", lambda head, texels: None)
    options = CloseupOptions(quick=4, careful=2, copies=3, held=2)
    training.collect(tmp_path, head, None, None, None, options)
    assert len(painted) == 6
    training.collect(tmp_path, head, None, None, None, options)
    assert len(painted) == 6
    eye_rows, mouth_rows = closeup_crops.rows_seen(head)
    (crops, points), held = training.read_crops(tmp_path, "mouth", mouth_rows, options)
    assert crops.shape == (9, WIDE, WIDE) and points.shape == (9, mouth_rows.shape[1], 2)
    assert {kind: len(some[0]) for kind, some in held.items()} == {"quick": 6, "careful": 3}
    eyes, points = training.read_crops(tmp_path, "eye", eye_rows, options)[0]
    assert len(eyes) == len(points) == 18
    left, right = np.median(points[::2], 0), np.median(points[1::2], 0)
    assert np.abs(left - right).max() < 0.1  # the same places in the right eye's mirror image
    with pytest.raises(InputError, match="other seed"):
        training.collect(tmp_path, head, None, None, None, CloseupOptions(copies=3, seed=1))


def test_photographs_of_one_person_stay_together(shared):
    people = training.sitters(shared / "portraits/london/train", shared / "portraits/dense478.npz")
    assert len(people) == 62 and all(len(pictures) == 2 for pictures in people.values())
    picture, points = people[0][0]
    assert points.shape == (478, 2) and (points > 0).all() and (points < picture.shape[1::-1]).all()


def test_photos_need_their_points(bakery, tmp_path):
    made = ["--run", tmp_path / "run", "-o", tmp_path / "w.safetensors"]
    done = bakery("train", "closeups", "--photos", tmp_path, *made)
    assert done.returncode == 2 and "--dense" in done.stderr
    (tmp_path / "w.safetensors").touch()
    done = bakery("train", "closeups", *made)
    assert done.returncode == 1 and "--overwrite" in done.stderr
