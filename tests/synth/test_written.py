"""Samples and training folders, likeness, traits."""

import json
from pathlib import Path

import numpy as np
import pytest

from bakery.errors import InputError
from bakery.geometry.camera import project
from bakery.synth import samples, training
from bakery.synth.likeness import PROPORTIONS, _measure, identity_of
from bakery.synth.skin import skin_color
from bakery.synth.subject import random_subject

SMALL = training.TrainingOptions(size=96, detail=0.8, share=0.03, quality=0.1, supersample=1)


def test_training_pictures_go_on_and_repeat(head, tmp_path):
    first = list(training.write(head, tmp_path, 2, 3, SMALL))
    assert [p.name for p in first] == ["000000.jpg", "000001.jpg"]
    assert list(training.write(head, tmp_path, 2, 3, SMALL)) == []
    before = first[1].read_bytes()
    first[1].unlink()
    assert list(training.write(head, tmp_path, 2, 3, SMALL)) == first[1:]
    assert first[1].read_bytes() == before
    table = json.loads((tmp_path / "000001.json").read_text())
    assert table["image"] == {"width": 96, "height": 96}
    assert np.array(table["faces"][0]["points"]).shape == (478, 2)


def test_no_pictures_is_an_error(head, tmp_path):
    with pytest.raises(InputError, match="at least 1"):
        next(training.write(head, tmp_path, 0))


def test_unknown_sample_is_an_error(head, tmp_path):
    with pytest.raises(InputError, match="known: anna"):
        next(samples.write(head, tmp_path, ["nobody"]))
    assert list(tmp_path.iterdir()) == []


def test_likeness_moves_toward_the_wish(head):
    """A wider nose is wider, and one coefficient never runs away."""
    wide = identity_of(head, {"nose_width": 5.0}, freedom=0.0)
    measure = dict(zip(PROPORTIONS, _measure(head.landmarks(head.neutral(wide)))))
    mean = dict(zip(PROPORTIONS, _measure(head.landmarks(head.mean))))
    assert 2.5 < measure["nose_width"] - mean["nose_width"] < 6
    assert abs(measure["face_width"] - mean["face_width"]) < 2.5
    assert np.abs(wide).max() <= 2.2


def test_pigments_absorb(head):
    """More melanin is darker, more blood redder: ratios follow from the absorption alone."""
    pale, dark = skin_color([0.3, 2.5], [1.0, 1.0])
    assert (dark < 0.5 * pale).all()
    calm, flushed = skin_color([0.3, 0.3], [0.6, 1.6])
    assert flushed[0] / flushed[1] > 1.2 * calm[0] / calm[1]


def test_subjects_repeat(head):
    one, two = (random_subject(np.random.default_rng(5), head) for _ in range(2))
    np.testing.assert_array_equal(one.identity, two.identity)
    assert one.hair == two.hair and one.age == two.age


def test_committed_samples_are_those_of_the_command(head):
    """Their landmarks, found again without painting, are those written beside the pictures."""
    folder = Path(__file__).parents[2] / "samples"
    people = samples.people(head)
    assert sorted(people) == sorted(path.stem for path in folder.glob("*.jpg"))
    for name, (subject, scene) in people.items():
        table = json.loads((folder / f"{name}.json").read_text())
        posed = head.vertices(head.neutral(subject.identity), scene.expression, scene.gaze)
        want = project(head.landmarks(posed), scene.camera)
        points = table["faces"][0]["points"]
        np.testing.assert_allclose(points, want, atol=0.01)  # written to a thousandth
