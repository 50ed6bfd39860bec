"""A texture from several photos: who fills what, in whose colours."""

import numpy as np

from bakery.bake.views import merged
from bakery.generators.base import Subject
from bakery.stages.texture.complete import INFERRED, MIRRORED, OBSERVED
from bakery.stages.texture.neutral import Prepared

SIZE = 128
LEFT, MIDDLE = slice(0, 32), slice(56, 128)  # columns that the lead never saw, and sees well


def prepared(texture, source, facing):
    subject = Subject(None, None, texture, None, None, None, None)
    hair = np.zeros((SIZE, SIZE, 4), np.float32)
    return Prepared(subject, source.astype(np.uint8), facing.astype(np.float32), hair)


def photos(gain):
    """One skin; the lead saw all but the left quarter, which was filled in flat."""
    rng = np.random.default_rng(0)
    skin = (0.4 + 0.1 * rng.random((SIZE, SIZE, 3))).astype(np.float32)
    sees = np.ones((SIZE, SIZE), np.float32)
    sees[:, LEFT] = 0
    source = np.where(sees > 0, OBSERVED, INFERRED)
    lead = prepared(np.where(sees[..., None] > 0, skin, 0.45).astype(np.float32), source, sees)
    other_sees = np.ones((SIZE, SIZE), np.float32)
    other_sees[:, 96:] = 0
    other = prepared(
        skin * np.float32(gain), np.where(other_sees > 0, OBSERVED, MIRRORED), other_sees
    )
    return skin, lead, other, [sees, 0.98 * other_sees]


def test_unseen_skin_comes_from_the_other_photo_in_the_leads_colours():
    skin, lead, other, sights = photos(gain=[0.7, 0.8, 0.6])
    out = merged(lead, [other], sights)
    inside = np.s_[8:-8, 4:24]  # off the seam and the border of the atlas
    np.testing.assert_allclose(out.subject.texture[inside], skin[inside], rtol=0.03)
    assert np.abs(lead.subject.texture[inside] - skin[inside]).mean() > 0.02  # flat before
    assert (out.source[inside] == OBSERVED).all() and out.facing[inside].min() > 0.9
    # No step at the seam: the mean colour of columns changes no more than in the skin itself.
    columns = out.subject.texture.mean((0, 2))
    assert np.abs(np.diff(columns[2:-2])).max() < 0.03


def test_what_the_lead_sees_well_stays_as_it_is():
    _, lead, other, sights = photos(gain=0.7)
    out = merged(lead, [other], sights)
    np.testing.assert_array_equal(out.subject.texture[:, MIDDLE], lead.subject.texture[:, MIDDLE])
    np.testing.assert_array_equal(out.source[:, MIDDLE], lead.source[:, MIDDLE])


def test_a_photo_that_shares_nothing_with_the_lead_changes_nothing():
    """Without skin that both see nobody knows its colours."""
    _, lead, other, (sees, there) = photos(gain=0.7)
    there = there * (1 - sees)
    out = merged(lead, [other], [sees, there])
    np.testing.assert_array_equal(out.subject.texture, lead.subject.texture)
    assert (out.source == lead.source).all()
