"""Hair styles, clothes and film: each does what its name says, on the mean head."""

from dataclasses import replace

import numpy as np
import pytest

from bakery.synth.chart import chart_of
from bakery.synth.film import develop
from bakery.synth.garment import cloth_inputs, make_garment
from bakery.synth.growth import Field
from bakery.synth.hair import grow_scalp
from bakery.synth.roots import Skull, scalp_mask
from bakery.synth.subject import HAIR_STYLES, LONG_STYLES, random_subject


@pytest.fixture(scope="module")
def chart(head):
    return chart_of(head, 1.2)


@pytest.fixture(scope="module")
def clothes(head, subject):
    return make_garment(head, subject, head.mean)


@pytest.fixture(scope="module")
def grown(head, subject, chart, clothes):
    """A function: style -> strands [S, K, 3] mm, a fiftieth of the full number."""
    kept = {}

    def of(style):
        if style not in kept:
            person = replace(subject, hair=style)
            mask = scalp_mask(chart, person)
            hair = grow_scalp(head, chart, person, mask, head.mean, 0.02, clothes.body)
            kept[style] = hair.points
        return kept[style]

    return of


def ripple(points):
    """How much longer strands below the chin [S, K, 3] are than the chord of each."""
    path = np.linalg.norm(np.diff(points, axis=1), axis=2).sum(1)
    chord = np.linalg.norm(points[:, -1] - points[:, 0], axis=1)
    return np.median(path / np.maximum(chord, 1e-6))


def share_over_forehead(head, points):
    """Share of strands that pass before the middle of the forehead."""
    marks = head.landmarks(head.mean)
    low, high = marks[[105, 334], 1].mean() + 4, marks[10, 1] - 4
    before = (np.abs(points[..., 0]) < 30) & (points[..., 1] > low) & (points[..., 1] < high)
    return (before & (points[..., 2] > marks[10, 2] - 25)).any(1).mean()


@pytest.mark.parametrize("style", ["long", "long_wavy"])
def test_long_hair_ends_below_the_shoulders_and_lies_on_them(head, grown, clothes, style):
    points, chin = grown(style), head.landmarks(head.mean)[152, 1]
    assert (points[:, -1, 1] < chin - 80).mean() > 0.4
    assert (grown("bob")[:, -1, 1] < chin - 80).mean() == 0
    low = points[points[..., 1] < chin - 60]
    height, outward = clothes.body.height(low)
    assert (height < -3).mean() < 0.02  # 3 mm: locks drawn together cut a corner
    np.testing.assert_allclose(np.linalg.norm(outward, axis=1), 1, atol=1e-6)


def test_waves_and_curls_ripple(grown):
    """A wave makes a path longer than a straight fall; a curl longer still."""
    straight, waved, curled = (
        ripple(grown(name)[:, -14:]) for name in ("long", "long_wavy", "curls")
    )
    assert straight < 1.06 and waved > straight + 0.03 and curled > waved


def test_a_fringe_falls_over_the_forehead(head, grown):
    assert share_over_forehead(head, grown("fringe")) > 0.025
    for style in ("bun", "ponytail", "swept_back", "receding"):
        assert share_over_forehead(head, grown(style)) < 0.004


def test_tied_hair_meets_in_one_place(head, chart, grown):
    bun, tail = grown("bun"), grown("ponytail")
    assert (bun[:, -1, 1] > chart.crown + 20).mean() > 0.1  # of the knot, above the head
    assert (grown("pulled_back")[..., 1] > chart.crown + 20).mean() < 0.001
    behind = head.mean[head.part_vertices("skin"), 2].min()
    hangs = (tail[:, -1, 1] < chart.crown - 120) & (tail[:, -1, 2] < behind + 30)
    assert hangs.mean() > 0.2


def test_an_afro_stands_off_the_skull(head, chart, grown):
    skull = Skull(head, chart, head.mean)
    assert np.median(skull.height(grown("afro")[:, -1])[0]) > 30
    assert np.median(skull.height(grown("curly")[:, -1])[0]) < 18


def test_falling_hair_covers_the_ears(head, subject, chart, grown):
    rng, skull = np.random.default_rng(0), Skull(head, chart, head.mean)
    mask = scalp_mask(chart, subject)
    low, high = Field(head, chart, subject, mask, head.mean, skull, rng, 50).ear
    points = grown("long").reshape(-1, 3)
    off = np.abs((points - (low + high) / 2) / ((high - low) / 2))[:, 1:].max(1)
    beside = points[(off < 0.5) & (np.abs(points[:, 0]) > low[0])]
    assert len(beside) > 200
    assert (np.abs(beside[:, 0]) < (low[0] + high[0]) / 2).mean() < 0.05


def test_a_receding_hairline_frees_the_temples(chart, subject):
    temple = [40.0, chart.spot(10)[1] + 12]
    column, row = chart.pixels(np.array(temple)).astype(int)
    full = scalp_mask(chart, replace(subject, hair="swept_back"))[row, column]
    assert full > 0.6
    assert scalp_mask(chart, replace(subject, hair="receding"))[row, column] < 0.1


def test_hair_is_the_same_for_a_seed(head, subject, chart, clothes, grown):
    person = replace(subject, hair="curls")
    again = grow_scalp(
        head, chart, person, scalp_mask(chart, person), head.mean, 0.02, clothes.body
    )
    np.testing.assert_array_equal(again.points, grown("curls"))


def test_random_people_wear_every_kind(head):
    seen = {random_subject(np.random.default_rng(k), head).hair for k in range(400)}
    assert seen == set(HAIR_STYLES) and set(LONG_STYLES) < seen


@pytest.mark.parametrize("style", ["bob", "long", "long_wavy"])
def test_falling_hair_leaves_the_face_free(head, grown, style):
    """Hair at the parting went straight down over the face when it took no side."""
    points, marks = grown(style), head.landmarks(head.mean)
    across = (np.abs(points[..., 0]) < 40) & (points[..., 2] > marks[33, 2] - 20)
    over = across & (points[..., 1] < marks[105, 1]) & (points[..., 1] > marks[152, 1])
    assert over.any(1).mean() < 0.004


def test_a_suit_shows_shirt_and_tie(head, subject):
    """Down the middle the tie, beside it the shirt, and the jacket on the shoulders."""
    worn = replace(
        subject, clothes="suit", cloth_color=np.array([0.02, 0.02, 0.3]),
        shirt_color=(0.6, 0.6, 0.6), tie_color=(0.2, 0.01, 0.01),
    )  # fmt: skip
    suit = make_garment(head, worn, head.mean)
    front = suit.vertices[:, 2].max()
    points = np.array([[0, -40.0], [28, -40.0], [150, -90.0]])
    points = np.column_stack([points + [0, suit.throat], [front, front, front - 60]])
    tie, shirt, jacket = cloth_inputs(worn, points, np.zeros(3), suit.throat)[0]
    assert tie[0] > 4 * tie[2] and jacket[2] > 4 * jacket[0]
    assert shirt.min() > 0.3 and np.ptp(shirt) < 0.01
    bare = cloth_inputs(replace(worn, tie_color=None), points, np.zeros(3), suit.throat)[0]
    np.testing.assert_allclose(bare[0], bare[0].mean(), rtol=0.01)  # a shirt is grey all over
    np.testing.assert_allclose(bare[2], jacket)


def test_contrast_keeps_black_middle_and_white():
    rng = np.random.default_rng(0)
    flat = np.array([0.0, 0.05, 0.18, 0.7]).reshape(1, 4, 1) * np.ones((1, 1, 3))
    plain, strong = (
        develop(flat, rng, 0.0, 0.0, None, vignette=0.0, contrast=c)[0, :, 0] for c in (0.0, 0.55)
    )
    assert strong[0] == plain[0] and strong[1] < plain[1] - 0.02 and strong[3] > plain[3] + 0.02
    assert abs(strong[2] - plain[2]) < 0.01
