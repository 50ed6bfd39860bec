"""Painted portraits: every class where it belongs, the same again from the same seed."""

from dataclasses import replace

import numpy as np
import pytest

from bakery.detectors import portrait
from bakery.errors import InputError
from bakery.landmarks import CHIN, face_size
from bakery.synth import portrait_shards
from bakery.synth.portraits import PortraitOptions, labels_of, random_portraits

BARE = PortraitOptions(scenes=1, glasses=0.0, hats=0.0, hands=0.0, things=0.0, hard=0.0)


@pytest.fixture(scope="module")
def plain(head):
    return next(random_portraits(head, 3, BARE))


def test_every_pixel_has_a_class_and_points_lie_on_the_face(plain):
    assert plain.label.max() < len(portrait.CLASSES)
    column, row = np.round(plain.points[4]).astype(int)  # the tip of the nose
    assert plain.label[row, column] == portrait.SKIN
    body = plain.label != portrait.BACKGROUND
    np.testing.assert_array_equal(body[plain.alpha > 200], True)
    assert (plain.alpha[body] > 0).all() and plain.alpha[0, 0] == 0
    for name in ("SKIN", "BROWS", "LIPS", "CLOTH"):
        assert (plain.label == getattr(portrait, name)).sum() > 30, name
    assert (plain.label >= portrait.FRAME).sum() == 0
    assert plain.shadow.max() == 0  # soft light casts no hard shadow
    below = plain.points[CHIN, 1].max() + 0.5 * face_size(plain.points)
    rows = np.flatnonzero((plain.label == portrait.CLOTH).any(1))
    assert np.median(rows) > below


@pytest.mark.parametrize(
    "share, wanted",
    [
        ("glasses", "LENS"),
        pytest.param("hats", "HAT", marks=pytest.mark.slow),
        ("hands", "THING"),
        ("things", "THING"),
    ],
)
def test_what_is_worn_and_held_is_labelled(head, share, wanted):
    one = next(random_portraits(head, 5, replace(BARE, **{share: 1.0})))
    assert (one.label == getattr(portrait, wanted)).sum() > 60
    if share == "glasses":
        assert (one.label == portrait.FRAME).sum() > 20


def test_hard_light_casts_shadows(head):
    one = next(random_portraits(head, 8, replace(BARE, hard=1.0)))
    assert (one.shadow == 1).sum() > 30
    assert (one.shadow[one.label == portrait.BACKGROUND] == 0).all()


def test_the_largest_share_is_the_class():
    names = ("skin", "eyes", "mouth", "hair", "clothes", "background", "beard", "lips", "ears")
    masks = {name: np.zeros((4, 4), np.float32) for name in (*names, "neck", "brows", "prop thing")}
    masks["skin"][:] = 1
    masks["skin"][0], masks["background"][0] = 0.3, 0.7
    masks["skin"][1], masks["lips"][1] = 0.9, 0.8
    masks["skin"][3], masks["prop thing"][3] = 0.0, 1.0
    lens = np.zeros((4, 4), np.float32)
    lens[2] = 1
    wanted = [portrait.BACKGROUND, portrait.LIPS, portrait.LENS, portrait.THING]
    np.testing.assert_array_equal(labels_of(masks, lens), np.repeat(wanted, 4).reshape(4, 4))


def test_shards_go_on_and_hold_the_same(tmp_path, monkeypatch, head):
    monkeypatch.setattr(portrait_shards, "PEOPLE", 1)
    written = list(portrait_shards.write("makehuman", tmp_path, 1, seed=3, options=BARE))
    assert len(written) == 1
    assert not list(portrait_shards.write("makehuman", tmp_path, 1, seed=3, options=BARE))
    table = portrait_shards.read(tmp_path)
    again = next(random_portraits(head, (3, 0), BARE))
    for name in portrait_shards.ARRAYS:
        np.testing.assert_array_equal(table[name][0], getattr(again, name))


def test_shards_say_what_is_wrong(tmp_path):
    with pytest.raises(InputError, match="at least 1"):
        next(portrait_shards.write("makehuman", tmp_path, 0))
    with pytest.raises(InputError, match="no painted portraits"):
        portrait_shards.read(tmp_path)
