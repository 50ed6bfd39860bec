"""Close-ups: where they are cut, the mirror, and that they mend what the first look misses."""

import json
from pathlib import Path

import numpy as np
import pytest
import torch

from bakery import landmarks as marks
from bakery.detectors import closeups, frames
from bakery.errors import ModelError

EYE = closeups.SIDES["eye"]
SAMPLES = Path(__file__).resolve().parents[2] / "samples"


def sample(name):
    """A painted portrait [H, W, 3] uint8 and its true points [478, 2]."""
    from bakery.formats.image import read_photo

    picture = (read_photo(SAMPLES / f"{name}.jpg").encoded * 255 + 0.5).astype(np.uint8)
    table = json.loads((SAMPLES / f"{name}.json").read_text())
    return picture, np.array(table["faces"][0]["points"])


def errors_of(points, share):
    """What the points network says when it is as far off as a share of the eye distance."""
    return np.full(len(points), share * marks.face_size(points))


def test_a_sure_look_at_the_whole_face_counts_more():
    picture, points = sample("anna")
    wrong = points + 0.03 * marks.face_size(points)
    sure, _ = closeups.look_closer(picture, wrong, errors_of(points, 1e-4), looks=1)
    unsure, _ = closeups.look_closer(picture, wrong, errors_of(points, 1.0), looks=1)
    near = [np.linalg.norm(found - points, axis=1)[marks.LIPS].mean() for found in (sure, unsure)]
    assert near[1] < 0.5 * near[0]


def test_answers_do_not_depend_on_the_number_of_threads():
    """Shared by two threads, a layer of the mouth's network sums up in another order."""
    picture, points = sample("anna")
    before = torch.get_num_threads()
    answers = []
    for count in (1, 2, 4):
        torch.set_num_threads(count)
        answers.append(closeups.look_closer(picture, points, errors_of(points, 0.05))[0].tobytes())
        assert torch.get_num_threads() == count
    torch.set_num_threads(before)
    assert len(set(answers)) == 1


def test_right_eyes_are_seen_in_the_mirror():
    """Mirroring the face about its middle swaps the crops' points and nothing else."""
    _, points = sample("anna")
    left, right = closeups.eye_frames(points)
    lids = [
        frames.apply_affine(closeups.matrix_of(frame, EYE, mirrored), points[rows])
        for frame, mirrored, rows in zip((left, right), (False, True), marks.EYES)
    ]
    outer = [part[0] for part in lids]  # both rings begin at the outer corner
    assert outer[0][0] > 40 and outer[1][0] > 40
    assert np.abs(lids[0] - lids[1]).mean() < 3  # pixels of 64: people are nearly symmetric
    flat = closeups.matrix_of(left, EYE, True)
    there = frames.apply_affine(frames.invert_affine(flat), np.array([[10.0, 20.0]]))
    np.testing.assert_allclose(frames.apply_affine(flat, there), [[10, 20]], atol=1e-9)


@pytest.mark.parametrize("scale", [0.1, 0.5, 1.0])
def test_a_crop_shows_what_the_matrix_says(scale):
    """A bright spot comes out where its position is mapped, in small and large pictures."""
    side = int(640 * scale)
    y, x = np.mgrid[:side, :side] + 0.5
    spot = np.array([0.55, 0.45]) * side
    value = 255 * np.exp(-((x - spot[0]) ** 2 + (y - spot[1]) ** 2) / (2 * (0.02 * side) ** 2))
    picture = np.repeat(value.astype(np.uint8)[..., None], 3, 2)
    frame = frames.FaceFrame(np.array([0.5, 0.5]) * side, 0.4 * side, 0.2)
    matrix = closeups.matrix_of(frame, EYE, True)
    crop = closeups.take(picture, matrix, EYE).astype(float).mean(-1)
    v, u = np.mgrid[:EYE, :EYE] + 0.5
    seen = np.array([(crop * u).sum(), (crop * v).sum()]) / crop.sum()
    np.testing.assert_allclose(seen, frames.apply_affine(matrix, spot[None])[0], atol=0.6)


@pytest.mark.parametrize("name", ["anna", "bela", "chidi", "dalia", "emil", "fumiko"])
def test_lips_and_lids_that_are_off_are_mended(name):
    """Lids half closed and lips pressed together by mistake come back to where they are."""
    picture, points = sample(name)
    wrong = points.copy()
    for upper, lower in zip(marks.LIDS_UPPER, marks.LIDS_LOWER):
        wrong[upper] += 0.5 * (points[lower] - points[upper])
    wrong[marks.LIPS, 1] += 0.04 * marks.face_size(points)
    mended, doubt = closeups.look_closer(picture, wrong, errors_of(wrong, 0.1))
    unit = marks.face_size(points)
    rings = np.concatenate([marks.EYE_LEFT, marks.EYE_RIGHT])

    def error(found, rows):
        return np.linalg.norm(found[rows] - points[rows], axis=1).mean() / unit

    assert error(mended, marks.LIPS) < 0.03 and error(wrong, marks.LIPS) > 0.039
    assert error(mended, rings) < 0.025
    others = np.setdiff1d(np.arange(468), closeups.seen_close())
    np.testing.assert_array_equal(mended[others], wrong[others])
    assert (doubt <= errors_of(wrong, 0.1)).all()


def test_missing_or_damaged_weights(tmp_path):
    with pytest.raises(ModelError, match="no such weights"):
        closeups.networks(tmp_path / "nothing.safetensors")
    (tmp_path / "bad.safetensors").write_bytes(b"12345678 no tensors")
    with pytest.raises(ModelError, match="damaged weights"):
        closeups.networks(tmp_path / "bad.safetensors")


@pytest.mark.parametrize("name", ["anna", "chidi"])
def test_a_mouth_that_lies_far_off_is_found(name):
    """Lips and chin believed on the neck, a quarter of the face too low, come back by several looks."""
    picture, points = sample(name)
    wrong, unit = points.copy(), marks.face_size(points)
    wrong[np.union1d(marks.LIPS, marks.CHIN), 1] += 0.25 * unit
    mended, doubt = closeups.look_closer(picture, wrong, errors_of(wrong, 0.1))
    found = np.linalg.norm(mended[marks.LIPS] - points[marks.LIPS], axis=1).mean() / unit
    assert found < 0.03
