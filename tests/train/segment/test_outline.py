"""Outlines before plain backdrops: known people, and backdrops that are none."""

import numpy as np
import pytest

from bakery.synth.portraits import PortraitOptions, random_portraits
from bakery.train.backgrounds import fractal_noise
from bakery.train.segment import outline

BARE = PortraitOptions(scenes=1, glasses=0.0, hats=0.0, hands=0.0, things=0.0, hard=0.0)


def before(person, backdrop):
    """A painted person before a backdrop."""
    share = person.alpha[..., None] / 255
    return np.round(person.image * share + backdrop * (1 - share)).astype(np.uint8)


@pytest.fixture(scope="module")
def person(head):
    return next(random_portraits(head, 3, BARE))


def graded():
    """A studio's backdrop: brighter below, with grain."""
    rows = np.linspace(0, 1, 256)[:, None, None]
    grain = np.random.default_rng(0).normal(size=(256, 256, 3)) * 1.5
    return np.clip(np.array([60, 110, 150]) * (0.8 + 0.4 * rows) + grain, 0, 255)


def test_a_person_before_a_plain_backdrop_is_cut_out(person):
    found = outline.find_outline(before(person, graded()), person.points)
    assert found.sure
    known, truth = found.person != outline.UNSURE, person.alpha > 127
    both = (found.person == outline.PERSON) & truth
    either = ((found.person == outline.PERSON) | truth) & known
    assert both.sum() / either.sum() > 0.97  # what is asked of the network that learns from it


def test_below_the_chin_nobody_knows_where_clothes_match(person):
    found = outline.find_outline(before(person, graded()), person.points, whole=False)
    assert (found.person[-20:] == outline.UNSURE).all()
    assert (found.person[:20] == outline.BACKDROP).all()


def test_clutter_is_not_plain(person):
    rng = np.random.default_rng(1)
    clutter = np.stack([255 * fractal_noise(rng, 256, 0.9) for _ in range(3)], -1)
    assert not outline.find_outline(before(person, clutter), person.points).sure
