"""Photographs in folders, and the training pairs made of them."""

import shutil
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.testing import assert_allclose

from bakery.errors import InputError
from bakery.formats.record import read_faces
from bakery.generators.channels import NONE
from bakery.heads.base import PARTS
from bakery.synth.pairs import Shard
from bakery.train import folders, real_pairs

SKIN = PARTS.index("skin")


@pytest.mark.parametrize(
    "name, found",
    [
        ("set/001_neutral.jpg", ("001", "neutral")),
        ("set/001_smiling-2.jpg", ("001", "smiling-2")),
        ("set/anna/neutral.png", ("anna", "neutral")),
        ("set/anna/surprised.png", ("anna", "surprised")),
        ("CFD/CFD-WF-001-003-N.jpg", ("WF-001", "neutral")),
        ("CFD/CFD-WF-001-009-HO.jpg", ("WF-001", "happy open")),
        ("Rafd090_01_Caucasian_female_neutral_frontal.jpg", ("01", "neutral")),
        ("Rafd045_01_Caucasian_female_happy_left.jpg", ("01", "happy left 045")),
        ("Rafd180_01_Caucasian_female_happy_left.jpg", None),  # a profile
    ],
)
def test_names_of_known_data_sets(name, found):
    assert folders.name_of(Path(name)) == found


def test_people_need_a_neutral_and_another(tmp_path):
    for name in ("a_neutral", "a_happy", "a_sad", "b_neutral", "c_happy", "c_sad"):
        (tmp_path / f"{name}.jpg").touch()
    (person,) = folders.people(tmp_path)
    assert person.name == "a" and person.neutral.name == "a_neutral.jpg"
    assert [expression for expression, _ in person.others] == ["happy", "sad"]


def test_a_folder_of_nobody(tmp_path):
    (tmp_path / "b_neutral.jpg").touch()
    with pytest.raises(InputError, match="SUBJECT_neutral.jpg"):
        folders.people(tmp_path)


def face_of(value):
    """A rough face on black, its mask and parts."""
    rng = np.random.default_rng(3)
    texture = cv2.GaussianBlur(rng.normal(0, 60, (128, 128, 1)), (0, 0), 1.5)[..., None]
    picture = np.clip(value + texture, 1, 255) * np.array([1.0, 0.8, 0.7])
    face = np.zeros((128, 128), np.uint8)
    face[16:112, 16:112] = 255
    part = np.where(face > 0, SKIN, 255).astype(np.uint8)
    return (picture * (face[..., None] > 0)).astype(np.uint8), face, part


def test_exposure_and_white_balance_are_taken_off():
    deformed, face, part = face_of(120.0)
    linear = real_pairs.to_linear(deformed / 255.0)
    drifted = real_pairs.encode(linear * [1.2, 1.0, 0.85])
    mended = real_pairs.without_drift(drifted, deformed, face, part)
    # Both pictures are bytes, so the gain is known to a level or two.
    assert np.abs(mended.astype(int) - deformed).max() <= 3


def test_a_fold_is_no_drift():
    """What changes in a fifth of the face stays: the median does not see it."""
    deformed, face, part = face_of(120.0)
    target = deformed.copy()
    target[80:100] = (target[80:100] * 0.7).astype(np.uint8)
    assert_allclose(real_pairs.without_drift(target, deformed, face, part), target, atol=2)


def test_registration_takes_a_small_shift_off():
    deformed, face, part = face_of(120.0)
    shifted = np.roll(deformed, 2, axis=1)
    mended = real_pairs.registered(shifted, deformed, face, part)
    inner = np.s_[40:88, 40:88]
    before = np.abs(shifted[inner].astype(int) - deformed[inner]).mean()
    after = np.abs(mended[inner].astype(int) - deformed[inner]).mean()
    assert after < 0.35 * before


def test_registration_leaves_what_is_in_place():
    deformed, face, part = face_of(120.0)
    mended = real_pairs.registered(deformed, deformed, face, part)
    assert np.abs(mended[24:104, 24:104].astype(int) - deformed[24:104, 24:104]).mean() < 1.5


@pytest.fixture(scope="module")
def shard(portrait, head, tmp_path_factory):
    """The painted portrait as its own other expression, as a shard."""
    folder = tmp_path_factory.mktemp("people")
    for name in ("a_neutral.png", "a_other.png"):
        shutil.copy(portrait[0], folder / name)
    _, (face,) = read_faces(portrait[1])
    output = folder / "pairs"
    output.mkdir()
    people = folders.people(folder)
    made = list(real_pairs.write_pairs(people, lambda path: face, head, output))
    assert [(person.name, error) for person, error in made] == [("a", None)]
    return Shard(output / "pairs-00000.safetensors")


@pytest.mark.slow
def test_a_photo_paired_with_itself(shard):
    assert len(shard) == 2 and shard.about["person"] == "a"
    for pair in (shard[0], shard[1]):
        inside = (pair.face > 250) & (pair.part == SKIN)
        assert inside.mean() > 0.15
        difference = np.abs(pair.target.astype(int) - pair.deformed)[inside]
        # Unwrapped and drawn again, through a texture of 1024 texels: a few levels.
        assert difference.mean() < 4
        low, high = pair.landmarks.min(0), pair.landmarks.max(0)
        assert_allclose(high[1] - low[1], 0.78 * 512, rtol=0.01)
        # Nothing is left of the background, but for what sampling spreads beside an edge.
        beside = cv2.erode((pair.part == NONE).astype(np.uint8), np.ones((19, 19))) > 0
        assert beside.mean() > 0.05 and pair.photo[beside].max() <= 2


def test_a_bad_photo_leaves_its_person_out(head, tmp_path, portrait):
    photos = tmp_path / "photos"
    photos.mkdir()
    shutil.copy(portrait[0], photos / "a_neutral.png")
    (photos / "a_happy.png").write_bytes(b"no picture")

    def refuse(path):
        raise InputError(f"{path}: no face found")

    ((person, error),) = real_pairs.write_pairs(folders.people(photos), refuse, head, tmp_path)
    assert person.name == "a" and "no face found" in str(error)
    assert not list(tmp_path.glob("*.safetensors"))
