"""Hair: what of a photo is hair, and the layer over the skin."""

from dataclasses import replace

import numpy as np
import pytest

from bakery.geometry import rotation
from bakery.geometry.color import LUMA
from bakery.geometry.sample import bilinear
from bakery.hair.cards import CardHair
from bakery.hair.layer import HairLayer
from bakery.heads.scalp import BROW, EYE, ear_box, scalp, unrolled
from bakery.stages.atlas import make_atlas, make_view, visibility_of
from bakery.stages.segment import BACKGROUND, HAIR, SKIN, Segmentation
from bakery.stages.texture.growth import before_ears, on_ears
from bakery.stages.texture.hair import Mattes, hair_layer, loose, mattes_of
from bakery.stages.texture.hairtone import from_both, tone_around, tone_of
from bakery.types import Camera

FRONT = Camera(
    2000.0, np.array([256.0, 256.0]), np.zeros(3), np.array([0.0, 20.0, -1500.0]), 512, 512
)
BROWN = np.array([0.1, 0.06, 0.03], np.float32)
GRAY = np.array([0.12, 0.12, 0.12], np.float32)
ALL = np.ones((256, 256), np.float32)


def points_with_eyes(gap=100.0):
    points = np.zeros((478, 2))
    points[33], points[263] = (50.0, 100.0), (50.0 + gap, 100.0)
    return points


def photo_of(labels):
    """Brown hair, light skin and white background, [H, W, 3]."""
    colors = {HAIR: (0.3, 0.2, 0.1), SKIN: (0.8, 0.6, 0.5), BACKGROUND: (0.9, 0.9, 0.9)}
    out = np.zeros(labels.shape + (3,), np.float32)
    for label, color in colors.items():
        out[labels == label] = color
    return out


def test_skin_keeps_clear_of_hair_and_the_strip_takes_the_rest():
    """Seven pixels from hair nothing is taken, thirteen away all is: 100 pixels between the eyes."""
    labels = np.full((40, 60), SKIN, np.uint8)
    labels[:, :10], labels[30:] = HAIR, BACKGROUND
    skin = (labels == SKIN).astype(np.float32)
    mattes = mattes_of(photo_of(labels), Segmentation(labels, skin), points_with_eyes())
    assert mattes.skin[20, 10:16].max() == 0
    assert mattes.skin[20, 24:].min() == 1
    assert (np.diff(mattes.skin[20]) >= 0).all()
    assert (mattes.skin + mattes.hair + mattes.strip)[:24].min() > 0.99, "nothing gapes"
    assert mattes.strip[20, 30:].max() == 0
    assert mattes.strip[30:].max() == 0, "background is not shown as hair"


def test_no_hair_changes_nothing():
    skin = np.random.default_rng(0).random((30, 30)).astype(np.float32)
    mattes = mattes_of(
        np.zeros((30, 30, 3)),
        Segmentation(np.full((30, 30), SKIN, np.uint8), skin),
        points_with_eyes(),
    )
    np.testing.assert_array_equal(mattes.skin, skin)
    assert mattes.hair.max() == 0 and mattes.strip.max() == 0


@pytest.fixture(scope="module")
def seen(head):
    atlas = make_atlas(head, 256).take("skin")
    return atlas, visibility_of(atlas, make_view(head.mean, head, FRONT))


def photo_with_hair_above(row):
    """Brown hair over light skin, and what of it is what."""
    above = (np.arange(512)[:, None] < row) * np.ones((1, 512), bool)
    linear = np.where(above[..., None], BROWN, np.float32(0.5))
    hair = above.astype(np.float32)
    return linear.astype(np.float32), Mattes(1 - hair, hair, *[0 * hair] * 5)


def test_hair_goes_on_around_the_head(head, seen):
    """Hair down to the brows: the back of the head is as brown as the front, the face bare."""
    atlas, visibility = seen
    layer = hair_layer(*photo_with_hair_above(200), head, atlas, visibility)
    points = atlas.at(head.mean)
    texel = layer.reshape(-1, 4)[atlas.index]
    # 6 mm above the nape's hairline: there single hairs thin out.
    back = (points[:, 2] < points[:, 2].min() + 30) & (points[:, 1] > points[:, 1].max() - 84)
    assert texel[back, 3].min() > 0.97
    # Locks lighten and darken; on the whole they keep the colour of what was photographed.
    np.testing.assert_allclose(np.median(texel[back, :3], 0), BROWN, rtol=0.1)
    nose = np.linalg.norm(points - head.landmarks(head.mean)[4], axis=1) < 15
    assert texel[nose].max() == 0
    assert (texel[:, :3] <= texel[:, 3:] + 1e-6).all(), "colour is multiplied by alpha"


def test_a_bald_head_stays_bald(head, seen):
    layer = hair_layer(*photo_with_hair_above(0), head, *seen)
    assert layer.shape == (256, 256, 4) and layer.max() == 0


def test_a_fringe_is_shown_as_it_was_photographed(head, seen):
    """Where the camera looked straight at hair, its own pixels stand."""
    atlas, visibility = seen
    linear, mattes = photo_with_hair_above(190)
    noisy = linear * np.random.default_rng(0).uniform(0.7, 1, (512, 512, 1)).astype(np.float32)
    layer = hair_layer(noisy, mattes, head, atlas, visibility).reshape(-1, 4)[atlas.index]
    straight = (visibility.weight() > 0.95) & (visibility.pixels[:, 1] < 180)
    assert straight.sum() > 200
    np.testing.assert_allclose(
        layer[straight][:, :3], bilinear(noisy, visibility.pixels)[straight], atol=0.01
    )


def test_a_fringe_stays_on_the_forehead_below_cards(head, seen):
    """Cards show what hangs before cheeks; of the forehead the photo knows more."""
    atlas, visibility = seen
    given = *photo_with_hair_above(230), head, atlas, visibility
    whole, below_cards = (
        hair.layer(*given).reshape(-1, 4)[atlas.index] for hair in (HairLayer(), CardHair())
    )
    points, marks = atlas.at(head.mean), head.landmarks(head.mean)
    straight = (visibility.weight() > 0.95) & (np.abs(points[:, 0]) < 30)
    forehead = straight & (points[:, 1] > marks[BROW, 1] + 4) & (whole[:, 3] > 0.9)
    assert forehead.sum() > 200
    np.testing.assert_allclose(below_cards[forehead], whole[forehead], atol=0.02)
    lower = straight & (points[:, 1] < marks[EYE, 1])
    assert below_cards[lower, 3].max() < 0.01


def test_sideburns_stay_on_the_skin_below_cards(head, seen):
    """Before the ears' upper half the layer is whole; on ears and cheeks it is left to the cards."""
    atlas, _ = seen
    where = before_ears(head, atlas).reshape(-1)[atlas.index]
    flat, (front, _, low, high) = unrolled(head)(atlas.at(head.mean)), ear_box(head)
    across, up = flat.T
    assert where[(across < front - 8) & (up > (low + high) / 2 + 10)].min() > 0.99
    assert where[(across > front + 3) | (up < (low + high) / 2 - 16)].max() < 0.01


def test_specks_of_background_in_a_fringe_belong_to_it():
    """A hole of 4 pixels is a mistake; it neither opens the layer nor clears hair around it."""
    labels = np.full((60, 60), HAIR, np.uint8)
    labels[20:22, 20:22] = BACKGROUND
    labels[45:] = BACKGROUND
    mattes = mattes_of(
        photo_of(labels), Segmentation(labels, np.zeros((60, 60), np.float32)), points_with_eyes()
    )
    assert (mattes.hair + mattes.strip)[10:30].min() == 1
    assert mattes.hair[44].max() < 0.1, "but hair at the edge of the background has its light"


def test_background_between_strands_is_not_hair():
    """White pixels labelled as hair, near the white background; the same far from it is a highlight."""
    labels = np.full((80, 60), HAIR, np.uint8)
    labels[:20] = BACKGROUND
    photo = photo_of(labels)
    photo[28:32, 20:24] = photo[70:74, 20:24] = 0.9
    mattes = mattes_of(
        photo, Segmentation(labels, np.zeros((80, 60), np.float32)), points_with_eyes()
    )
    assert mattes.hair[28:32, 20:24].max() == 0 and mattes.hair[30, 40] == 1
    assert mattes.hair[70:74, 20:24].min() == 1


def test_hair_that_does_not_reach_the_scalp_is_left_out():
    here, growth = np.zeros((2, 60, 60), np.float32)
    here[5:15, 5:15] = here[30:40, 30:50] = 1.0
    growth[30:60, 45:60] = 1.0  # the second patch reaches it
    lost = loose(here, growth)
    assert lost[5:15, 5:15].all() and not lost[30:40, 30:50].any()


def test_no_hair_grows_on_ears(head, seen):
    atlas, visibility = seen
    layer = hair_layer(*photo_with_hair_above(230), head, atlas, visibility)
    ears = (on_ears(head, atlas) > 0) & (visibility.weight(80, 60) == 0)
    assert ears.sum() > 100 and layer.reshape(-1, 4)[atlas.index][ears, 3].max() < 0.05


def test_a_hairline_seen_at_a_slant_is_no_comb(head, seen):
    """Labels beside the face have teeth, three rows each: the layer has a line without any."""
    atlas, visibility = seen
    linear, mattes = photo_with_hair_above(0)
    pixels, points = visibility.pixels, atlas.at(head.mean)
    there = (visibility.visible > 0.5) & (points[:, 1] > 20) & (points[:, 1] < 50)
    rim = pixels[there, 0].max()
    column, row = np.arange(512)[None], np.arange(512)[:, None]
    beside = (column > rim - 14 + 6 * (row // 3 % 2)) & (row < 300)
    mattes.hair[:], mattes.skin[:] = beside, ~beside
    linear[beside] = BROWN
    alpha = hair_layer(linear, mattes, head, atlas, visibility)[..., 3].reshape(-1)[atlas.index]
    teeth = there & (pixels[:, 0] > rim - 16) & (pixels[:, 0] < rim - 6)
    odd = pixels[:, 1] // 3 % 2 == 1
    means = [alpha[teeth & rows].mean() for rows in (odd, ~odd)]
    assert abs(means[0] - means[1]) < 0.1  # as the labels have it, 0.45
    assert 0.3 < np.mean(means) < 0.7


def test_hair_that_is_made_up_has_no_skins_colour(head, seen):
    """The rim of a bald top is labelled hair, in the colour of skin; brown hair grows at the sides."""
    atlas, visibility = seen
    linear, mattes = photo_with_hair_above(200)
    linear[:, 216:296] = 0.5
    layer = hair_layer(linear, mattes, head, atlas, visibility)
    points = atlas.at(head.mean)
    back = points[:, 2] < points[:, 2].min() + 30
    texel = layer.reshape(-1, 4)[atlas.index][back & (points[:, 1] > points[:, 1].max() - 90)]
    color = texel[:, :3] / np.maximum(texel[:, 3:], 1e-3)
    np.testing.assert_allclose(np.median(color, 0), BROWN, rtol=0.25)  # locks differ


def test_a_side_seen_at_a_slant_has_the_colours_of_the_other(head):
    """Of a head turned by 40 degrees the far temple, where skin shows, is as brown as the near one."""
    turn = rotation.vector(rotation.matrix(np.array([0, np.radians(40.0), 0])))
    camera = Camera(2000.0, np.array([256.0, 256.0]), turn, np.array([0, 20.0, -1500.0]), 512, 512)
    atlas = make_atlas(head, 256).take("skin")
    visibility = visibility_of(atlas, make_view(head.mean, head, camera))
    linear, mattes = photo_with_hair_above(230)
    across = visibility.pixels[visibility.visible > 0.5][:, 0]
    growth = atlas.at(scalp(head)[:, None])[:, 0]
    points = atlas.at(head.mean)
    temple = (growth > 0.9) & (points[:, 1] > 20) & (points[:, 1] < 60) & (points[:, 2] > -110)
    sides = [temple & (sign * points[:, 0] > 50) for sign in (-1, 1)]
    far, near = sorted(sides, key=lambda side: visibility.cosine[side].mean())
    rim = np.median(visibility.pixels[far][:, 0]) < np.median(across)
    edge = slice(None, int(across.min()) + 40) if rim else slice(int(across.max()) - 40, None)
    linear[:, edge] = 0.5
    mattes.hair[:, edge], mattes.skin[:, edge] = 0, 1
    texel = hair_layer(linear, mattes, head, atlas, visibility).reshape(-1, 4)[atlas.index]
    assert texel[near, 3].mean() > 0.9
    assert texel[far, 3].mean() > 0.9
    color = texel[far, :3] / np.maximum(texel[far, 3:], 1e-3)
    np.testing.assert_allclose(np.median(color, 0), BROWN, rtol=0.3)


@pytest.mark.parametrize("row", [165, 180])
def test_a_crack_between_hair_and_skin_grows_no_hair(head, seen, row):
    """Occluders and shadows leave cracks in what the labels tell; made up, they are a dark line."""
    atlas, visibility = seen
    linear, mattes = photo_with_hair_above(row)
    whole = hair_layer(linear, mattes, head, atlas, visibility)
    for matte in (mattes.hair, mattes.strip, mattes.skin):
        matte[row : row + 2] = 0
    cracked = hair_layer(linear, mattes, head, atlas, visibility)
    more = (cracked - whole)[..., 3].reshape(-1)[atlas.index]
    below = (visibility.visible > 0.5) & (visibility.pixels[:, 1] > row)
    assert more[below].max() < 0.05


def made_of(photo, seen, local=0 * ALL[..., None], near=0 * ALL):
    """Colours [256, 256, 3] made up from a band of hair seen in one colour, in a photo of hair above skin."""
    nothing = np.zeros((64, 64), np.float32)
    mattes = replace(Mattes(*[nothing] * 7), hair=nothing.copy(), skin=nothing.copy())
    mattes.hair[:40], mattes.skin[40:] = 1, 1
    color, sure = np.full((256, 256, 3), seen, np.float32), np.zeros((256, 256), np.float32)
    sure[20:60, 64:192] = 1
    return np.exp(tone_of(color, sure, ALL, photo, mattes.hair, mattes.skin, local, near))


def test_made_up_hair_at_a_slant_is_as_the_hair_around_its_pixel():
    """Grey temples below a dark top: the hairline beside them is no dark line."""
    local = np.broadcast_to(np.log(GRAY), (256, 256, 3)).astype(np.float32)
    photo = np.full((64, 64, 3), 0.5, np.float32)
    photo[:40] = BROWN
    made, far = (made_of(photo, BROWN, local, near * ALL) for near in (1, 0))
    level = np.float32([GRAY @ LUMA, BROWN @ LUMA])
    assert made[128, 128] @ LUMA == pytest.approx(level[0], rel=0.1)
    assert far[128, 128] @ LUMA == pytest.approx(level[1], rel=0.1)
    tint = np.log(np.stack([made[128, 128], far[128, 128]]))
    assert np.ptp(tint[0]) < np.ptp(tint[1]), "nearer to grey, as far as hair of one head differs"


def test_the_tone_around_a_pixel_is_that_of_the_hair_nearby():
    """Of the left half's hair and the right half's, not of the skin between them."""
    linear, hair = np.full((100, 200, 3), 0.5, np.float32), np.zeros((100, 200), np.float32)
    linear[:, :80], linear[:, 120:] = BROWN, GRAY
    hair[:, :80] = hair[:, 120:] = 1
    tone, near = tone_around(linear, hair)
    np.testing.assert_allclose(np.exp(tone[50, [70, 130]]), [BROWN, GRAY], rtol=0.05)
    assert near[50, [20, 82, 180]].min() > 0.8 and near[50, 100] < 0.05
    assert tone_around(linear, 0 * hair)[1].max() == 0


def test_a_highlight_does_not_colour_the_back():
    """Hair is seen where a lamp shines on it; far from there it is as dull as at its sides."""
    dull, shine = np.array([0.03, 0.02, 0.02], np.float32), np.float32(0.3)
    photo = np.full((64, 64, 3), (0.08, 0.05, 0.04), np.float32)
    photo[:20], photo[20:40] = shine, dull
    made = made_of(photo, shine)
    np.testing.assert_allclose(made[120:], np.broadcast_to(dull, (136, 256, 3)), rtol=0.05)
    assert made[50, 128].min() > 0.2  # and beside it there is no edge
    assert np.abs(np.diff(np.log(made[:, 128, 1]))).max() < 0.25


def test_what_is_hardly_sure_makes_no_colour_of_its_own():
    """Interpolated growth is -1e-7 in places; divided by, it gave colours of 1e4 at a hairline."""
    rng = np.random.default_rng(0)
    values = rng.uniform(-3, -1, (64, 64, 3)).astype(np.float32)
    sure = np.zeros((64, 64), np.float32)
    sure[20:30, 5:9], sure[40:50, 20:40] = 0.4, -1.2e-7
    sure[45, 30] = 1e-6
    found = from_both(values, sure, np.zeros((64, 64), np.float32))
    assert found.min() > -3.01 and found.max() < -0.99


def test_a_hairline_where_skin_shines_through_does_not_colour_the_back():
    """Seen is a band of thin hair above one of dense hair; far from both the dense one's colour holds."""
    skin, hair = np.array([0.5, 0.2, 0.13], np.float32), np.array([0.1, 0.06, 0.04], np.float32)
    nothing = np.zeros((64, 64), np.float32)
    photo = np.where(np.arange(64)[:, None, None] < 32, hair, skin).astype(np.float32)
    mattes = Mattes(*[nothing] * 7)
    mattes = replace(mattes, hair=(photo[..., 0] < 0.2) * 1.0, skin=(photo[..., 0] > 0.2) * 1.0)
    color = np.broadcast_to(hair, (256, 256, 3)).copy()
    color[20:40] = (skin + hair) / 2  # a thin hairline
    sure = np.zeros((256, 256), np.float32)
    sure[20:60, 64:192] = 1
    made = np.exp(tone_of(color, sure, ALL, photo, mattes.hair, mattes.skin, color, 0 * ALL))
    np.testing.assert_allclose(made[200:], np.broadcast_to(hair, (56, 256, 3)), rtol=0.02)
    np.testing.assert_allclose(made[55, 128], hair, rtol=0.05)


def test_a_shaded_rim_does_not_colour_a_side():
    """A tenth of the hair lies in the dark: what continues it is about as light as the rest."""
    dark, light = (
        np.array([0.01, 0.008, 0.006], np.float32),
        np.array([0.1, 0.08, 0.06], np.float32),
    )
    photo = np.full((64, 64, 3), (0.5, 0.35, 0.3), np.float32)
    photo[:36], photo[36:40] = light, dark
    made = made_of(photo, dark)
    assert (made @ LUMA).min() > np.exp(-0.55) * (light @ LUMA)


def test_grey_hairs_among_dark_ones_are_no_highlights(seen):
    """Every other hair is grey: what is made up is as light as both together, not as the dark ones."""
    dark, grey = np.full(3, 0.02, np.float32), np.full(3, 0.2, np.float32)
    photo = np.full((64, 64, 3), (0.5, 0.35, 0.3), np.float32)
    photo[:40:2], photo[1:40:2] = dark, grey
    made = made_of(photo, (dark + grey) / 2)
    assert np.abs(np.log(made[200:] / ((dark + grey) / 2))).max() < 0.5
