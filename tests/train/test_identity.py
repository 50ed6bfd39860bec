"""Identity features: verification by known answers, a training that learns, weights that load."""

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
import torch

from bakery.detectors.file import FileDetector
from bakery.errors import InputError, ModelError
from bakery.evaluate.metrics import face_crop, hull_mask, warp_pixels
from bakery.formats.image import read_photo
from bakery.generators.identity import IdentityNet, features_of, load_features, verify
from bakery.synth.pairs import PaintedPair, write_shard
from bakery.train import identity

S = 64
SAMPLES = Path(__file__).resolve().parents[2] / "samples"


def unit(angles):
    return np.stack([np.cos(np.radians(angles)), np.sin(np.radians(angles))], 1)


def test_verification_known_answers():
    # Two people at 0 and 90 degrees, seen 10 degrees off: every own pair is nearer than any other.
    found = verify(unit([0, 90]), ["a", "b"], unit([10, 80]), ["a", "b"])
    assert found.auc == 1 and found.equal_error == 0
    np.testing.assert_allclose(found.same, np.cos(np.radians(10)))
    # Everybody the same: a coin's toss.
    same = verify(unit([5, 5, 5, 5]), [0, 0, 1, 1])
    assert same.auc == 0.5
    # One own pair of two exceeds both others, the other own pair none.
    half = verify(unit([0, 90]), ["a", "b"], unit([0, 0]), ["a", "b"])
    assert half.auc == pytest.approx((2 + 1) / 4, abs=0.26)


def stranger(subject, k):
    """A pair whose person is a colour and the place of a bar; light and expression differ."""
    rng = np.random.default_rng([subject, 7])
    color, row = rng.integers(60, 220, 3), int(rng.integers(8, 50))
    own = np.full((S, S, 3), color, np.uint8)
    own[row : row + 8] = 255 - color
    target = np.clip(own * (0.8 + 0.1 * k), 0, 255).astype(np.uint8)
    target[54:60, 20 + 8 * k : 30 + 8 * k] = 20
    plane, even = np.zeros((S, S), np.uint8), np.full((S, S, 2), 128, np.uint8)
    return PaintedPair(
        photo=own, photo_face=plane + 255, target=target, deformed=own,
        normals=np.zeros((S, S, 3), np.int8), depth=plane, gaze=np.zeros((S, S, 2), np.uint8),
        part=plane, face=plane + 255, strain=even, folds=even, landmarks=np.zeros((478, 2), np.float32),
        expression=np.zeros(52, np.float32), gaze_angles=np.zeros(2, np.float32),
        yaw=0.0, pitch=0.0, subject=subject, head="toy",
    )  # fmt: skip


@pytest.fixture(scope="module")
def shards(tmp_path_factory):
    folder = tmp_path_factory.mktemp("pairs")
    pairs = [stranger(subject, k) for subject in range(24) for k in range(3)]
    write_shard(folder / "pairs-00000.safetensors", pairs)
    return folder


@pytest.mark.slow
def test_training_learns_and_goes_on(shards, tmp_path):
    torch.manual_seed(0)
    torch.set_num_threads(1)  # threads that wait for each other take minutes on a busy machine
    options = identity.IdentityOptions(steps=12, batch=12)
    people = identity.People([shards])
    assert len(people.rows) == 21 and len(people.held) == 3
    before = identity.held_out(IdentityNet(), people)
    first = list(identity.train(tmp_path / "run", people, options))
    assert first[-1]["step"] == 12
    assert first[-1]["auc"] > max(0.9, before["auc"] - 0.05)
    again = list(identity.train(tmp_path / "run", people, replace(options, steps=14)))
    assert [row["step"] for row in again] == [14]
    figures = identity.export(tmp_path / "run", tmp_path / "identity.safetensors")
    assert figures["step"] == 14 and figures["bytes"] < 16e6
    network = load_features(tmp_path / "identity.safetensors")
    features = features_of(network, people.pictures[:4])
    np.testing.assert_allclose(np.linalg.norm(features, axis=1), 1, atol=1e-5)
    # Any size of the same picture gives nearly the same features.
    large = people.pictures[:4].repeat(2, 1).repeat(2, 2)
    assert ((features * features_of(network, large)).sum(1) > 0.98).all()


def test_too_few_people_is_an_error(tmp_path):
    write_shard(tmp_path / "pairs-00000.safetensors", [stranger(0, 0)])
    with pytest.raises(InputError, match="at least 16 are needed"):
        identity.People([tmp_path])


def test_bad_weights_are_an_error(tmp_path):
    with pytest.raises(ModelError, match="bakery train identity"):
        load_features(tmp_path / "none.safetensors")


def test_shipped_weights_know_the_samples_again():
    """The six painted portraits of samples/, darkened, blurred and shifted, are still themselves."""
    network = load_features()
    own, changed = [], []
    for path in sorted(SAMPLES.glob("*.jpg")):
        picture = read_photo(path).encoded
        points = FileDetector(path.with_suffix(".json")).detect(picture)[0].points
        affine = face_crop(points, 256)
        inside = hull_mask(points @ affine[:, :2].T + affine[:, 2], 256, 256)
        frame = warp_pixels(picture, affine, 256) * inside[..., None]
        own.append(frame)
        changed.append(np.roll(cv2.GaussianBlur(frame**1.3 * 0.9, (0, 0), 1.5), 4, 1))
    first, second = (
        features_of(network, (np.clip(np.stack(rows), 0, 1) * 255).astype(np.uint8))
        for rows in (own, changed)
    )
    assert len(first) == 6
    assert ((first @ second.T).argmax(1) == np.arange(6)).all()
