"""Where hair beside and before the face lies, what holds it, and the look of hair that nobody saw."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from bakery.geometry import camera as cameras
from bakery.geometry.color import LUMA, to_linear
from bakery.geometry.raster import rasterize
from bakery.geometry.sample import bilinear
from bakery.heads.file import load_head
from bakery.stages.hair import atlas, chart
from bakery.stages.hair.chart import COLUMNS, DOME, ROWS
from bakery.stages.hair.directions import flow, photographed
from bakery.stages.hair.mesh import CAP, OVER, cap_height, cap_surface, ribbons
from bakery.stages.hair.painter import DIFFERS, EVENED, SLANT, UNTOLD, Painter
from bakery.stages.hair.portrait import before_face, look
from bakery.stages.hair.presence import ENDS, SLIT, _hanging, _held, _lobes, _slits
from bakery.stages.hair.shell import in_the_air, make_shell
from bakery.stages.hair.strands import KNOTS, grow
from bakery.stages.segment import BACKGROUND, HAIR, HIDDEN, SKIN, Segmentation
from bakery.types import EXPRESSIONS, Camera, Fit

SIDE = 400
COLORS = {SKIN: (0.8, 0.6, 0.5), HAIR: (0.25, 0.15, 0.1), BACKGROUND: (0.55, 0.6, 0.65)}


@pytest.fixture(scope="module")
def head():
    return load_head()


@pytest.fixture(scope="module")
def curtains(head):
    """A portrait of hair that hangs beside the face and hides its edges, and its shell."""
    camera = Camera(
        1000.0, np.array([200.0, 190.0]), np.zeros(3), np.array([0, 0, -1100.0]), SIDE, SIDE
    )
    zero = np.zeros
    fit = Fit(
        "makehuman", camera, zero(1), zero(len(EXPRESSIONS)), zero(2), zero((9, 3)), zero(1),
        zero((468, 3)), zero((478, 2)),
    )  # fmt: skip
    points = cameras.to_camera(head.mean, camera)
    faces = head.faces[head.part_faces("skin")]
    pixels = cameras.project_camera(points, camera)
    skin = rasterize(pixels, -points[:, 2], faces, (SIDE, SIDE)).face >= 0
    disk = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (45, 45))
    around = cv2.dilate(skin.astype(np.uint8), disk) > 0
    y, x = np.mgrid[:SIDE, :SIDE] + 0.5
    free = ((x - 200) / 58) ** 2 + ((y - 215) / 90) ** 2 < 1
    free |= (np.abs(x - 200) < 50) & (y > 215)
    labels = np.where(skin, SKIN, BACKGROUND).astype(np.uint8)
    labels[around & ~free & (y < 285)] = HAIR
    picture = np.zeros((SIDE, SIDE, 3), np.float32)
    for label, color in COLORS.items():
        picture[labels == label] = color
    segmentation = Segmentation(labels, (labels == SKIN).astype(np.float32))
    portrait = look(picture, segmentation, fit, head, head.mean)
    return portrait, make_shell(portrait, head, head.mean)


def test_hair_beside_the_face_stands_no_farther_forward_than_it_begins(curtains):
    """Seen from the front it may be anywhere along the line of sight; farther back it hides no face."""
    portrait, shell = curtains
    cells, before = chart.grid(), np.cos(chart.azimuth()) > 0
    skin = shell.chart.place(cells, shell.chart.skull)
    hidden = bilinear(portrait.hair, portrait.pixels(skin)[0]) > 0.5
    there = shell.there > 0.5
    points = shell.surface(cells, 1.0)
    found = 0
    for row in range(DOME + 4, DOME + 14):
        begins = skin[row, hidden[row] & before, 2]
        hangs = points[row, there[row] & before, 2]
        if len(begins) and len(hangs):
            assert hangs.max() < begins.max() + 12  # mm: 4, and the step between two cells
            found += 1
    assert found > 5


def test_the_outline_is_still_reached(curtains):
    """What is kept back still reaches as far to the sides."""
    portrait, shell = curtains
    pixels, _ = portrait.pixels(shell.surface(chart.grid(), 1.0))
    level = portrait.pixels(np.array([0, 0.0, -60]))[0][1]
    row = (np.abs(pixels[..., 1] - level) < 6) & (shell.there > 0.5)
    wide = np.ptp(pixels[..., 0][row]) / portrait.scale
    assert abs(wide - np.ptp(np.flatnonzero(portrait.solid[int(level)])) / portrait.scale) < 10


def test_nothing_hangs_before_the_face_from_nothing():
    turn = chart.azimuth()
    there = np.zeros((ROWS, COLUMNS))
    front, side = COLUMNS // 2 + 4, COLUMNS // 2 + 22  # 17 and 84 degrees
    there[: DOME + 2, [front, side]] = 1
    there[DOME + 3 : DOME + 6, [front, side]] = 1  # one row is missing
    there[DOME + 10 : DOME + 16, [front, side]] = 1  # four are
    out = _hanging(there, turn)
    assert out[DOME + 3 : DOME + 6, front].all(), "held over one row"
    assert not out[DOME + 10 :, front].any()
    np.testing.assert_array_equal(out[:, side], there[:, side])
    there[:, front - 4 : front + 5] = 1
    there[DOME + 3 : DOME + 6, front - 1 : front + 2] = 0  # a gap in a sheet of hair
    np.testing.assert_array_equal(_hanging(there, turn), there)


def test_hair_that_covers_an_ear_in_part_covers_its_lobe(head):
    found = chart.make_chart(head, head.mean)
    ear = found.ears - found.skull > 3
    ear[chart.DOME + 24 :] = False  # shoulders
    rows = np.flatnonzero(ear.any(1))
    lobe = rows[-1] - 2
    there = np.zeros(ear.shape)
    assert _lobes(there, found).max() == 0
    there[:lobe] = 1
    lobes = _lobes(there, found)
    assert lobes[ear & (there == 0)].min() == 1
    assert lobes[rows[-1] + ENDS + 1 :].max() == 0 and lobes[: rows[0]].max() == 0
    there[: rows[-1] + ENDS + 1] = 1
    assert _lobes(there, found).max() == 0


def test_hair_over_an_ear_hangs_without_slits_and_ends_where_it_did():
    there = np.zeros((20, COLUMNS))
    there[:15, 60:] = 1
    there[:10, 57 : 60 + 2] = 1
    there[4:15, 62 : 62 + SLIT - 2] = 0  # beside a lock that ends five rows higher
    there[:, 0:40] = 0.3  # the face, wider than any slit
    out = np.maximum(there, _slits(there))
    assert (out[:10, 57:] == 1).all()
    np.testing.assert_array_equal(out[10:15, :62], there[10:15, :62])
    np.testing.assert_array_equal(out[15:], there[15:])
    np.testing.assert_array_equal(out[:, :57], there[:, :57])


def test_small_holes_are_filled_and_large_ones_are_not():
    there = np.zeros((ROWS, COLUMNS))
    there[:60] = 1
    there[30:33, 10:13] = 0  # 9 cells
    there[20:30, 40:50] = 0  # as a bald spot or an ear
    out = _held(there)
    assert out[30:33, 10:13].all()
    assert not out[20:30, 40:50].any() and not out[60:].any()


def test_the_cap_reaches_the_hairline_where_it_is_not_seen(curtains):
    portrait, shell = curtains
    unseen, seen = (
        (cap_surface(replace(shell, seen=np.full_like(shell.seen, share)), portrait)[1] > 0).sum()
        for share in (0.0, 1.0)
    )
    assert unseen > seen


def test_hair_on_the_skin_rises_from_its_line_at_a_slant(curtains):
    _, shell = curtains
    inside = chart.distance_inside(shell.there > 0.5)
    near = (inside > 0) & (inside < 6) & (np.arange(ROWS)[:, None] < DOME)
    assert (shell.radius - shell.base)[near].max() < 12


def test_what_hides_the_face_is_hair_where_it_hangs_from_it_and_looks_like_it():
    labels = np.full((120, 200), SKIN, np.uint8)
    labels[:30] = HAIR
    regions = labels.copy()
    picture = np.where((labels == HAIR)[..., None], COLORS[HAIR], COLORS[SKIN]).astype(np.float32)
    fringe, hand, loose = np.s_[30:60, 10:50], np.s_[30:60, 80:120], np.s_[80:110, 150:190]
    for where in (fringe, hand, loose):
        regions[where] = HIDDEN
    picture[fringe] = picture[loose] = COLORS[HAIR]
    out = before_face(picture, labels == HAIR, labels, regions, 1.0)
    assert out[:30].all() and out[fringe].all()
    assert not out[hand].any() and not out[loose].any()
    labels[hand] = HAIR  # what the labels call hair is hair in any colour
    assert before_face(picture, labels == HAIR, labels, regions, 1.0)[hand].all()
    none = np.zeros_like(labels, bool)
    assert not before_face(picture, none, regions, regions, 1.0).any()


def test_the_cap_lies_close_below_thick_hair():
    thick = np.array([2.0, 5.0, 20.0, 30.0, 80.0])
    below = thick * (1 - cap_height(thick))
    np.testing.assert_allclose(below[2:4], 1.5)
    assert cap_height(np.array(0.0)) == CAP[0] and cap_height(np.array(1e3)) == CAP[1]


def test_unseen_hair_is_lit_from_above(curtains):
    portrait, shell = curtains
    painter = Painter(portrait, shell, flow(portrait, shell, *photographed(portrait))[0])
    back = np.array([[2.0, 4.0], [2.0, 14.0], [2.0, 26.0]])  # crown, ring of gloss, below it
    light = painter._light(back, np.zeros(3))
    assert light[1] > light[2] + 0.1 and np.abs(light).max() < 0.4
    # The ring is higher or lower on a lock, by its brightness.
    rows = np.stack([np.full(60, 2.0), np.linspace(6, 26, 60)], -1)
    rings = [painter._light(rows, np.full(60, lock)).argmax() for lock in (-0.3, 0.0, 0.3)]
    assert rings[0] < rings[1] < rings[2]


def test_a_shaded_rim_does_not_colour_all_of_a_side(curtains):
    portrait, shell = curtains
    ways, _ = flow(portrait, shell, *photographed(portrait))
    shaded = portrait.color.copy()
    shaded[:, int(0.65 * shaded.shape[1]) :] *= 0.05
    painter = Painter(replace(portrait, color=shaded), shell, ways)
    bright = painter.tone.mean(-1)[shell.there > 0.5]
    assert bright.max() - bright.min() < 2 * DIFFERS[0] + 0.05


def test_a_side_that_is_hardly_seen_looks_as_the_other_one(curtains):
    """With its streaks; where that is not seen either, hair is made up."""
    portrait, shell = curtains
    painter = Painter(portrait, shell, flow(portrait, shell, *photographed(portrait))[0])
    streaked = (
        portrait.color * np.where(np.arange(len(portrait.color)) % 6 < 3, 0.7, 1.3)[:, None, None]
    )
    painter.portrait = replace(portrait, color=streaked.astype(np.float32))
    painter.shows = painter.shows.copy()
    painter.shows[:, : chart.COLUMNS // 2] = 0  # the right side is not seen
    rows, columns = np.nonzero((shell.there > 0.9) & (shell.seen > 0.5))
    chosen = columns > chart.COLUMNS // 2 + 2
    cells = np.stack([columns[chosen] + 0.5, rows[chosen] + 0.5], -1)
    own, shown, _ = painter.color(shell.surface(cells, 1.0), cells, np.zeros(len(cells)))
    there = chart.mirrored(cells)
    points = shell.chart.mirrored(shell.surface(cells, 1.0))
    other, none, _ = painter.color(points, there, np.zeros(len(cells)))
    well = shown > 0.99
    assert well.sum() > 20 and none[well].max() == 0
    np.testing.assert_allclose(
        other[well], own[well], rtol=0.05
    )  # tones of both sides are about alike
    painter.shows[:] = 0
    plain, _, _ = painter.color(points, there, np.zeros(len(cells)))
    assert np.log(plain[well, 0]).std() < 0.6 * np.log(own[well, 0]).std()


def test_hair_of_untold_shape_has_its_colours_where_the_photo_sees_it_squarely(curtains):
    """A side turned away has the other one's shape; its highlights were lost with its own."""
    portrait, shell = curtains
    painter = Painter(portrait, shell, flow(portrait, shell, *photographed(portrait))[0])
    rows, columns = np.nonzero((shell.there > 0.9) & (shell.seen > 0.5))
    cells = np.stack([columns + 0.5, rows + 0.5], -1)
    slant = np.abs(painter.cosine[rows, columns])
    both = []
    for told in (1.0, 0.0):
        painter.carving = np.full_like(painter.carving, told)
        both.append(painter.color(shell.surface(cells, 1.0), cells, np.zeros(len(cells)))[1])
    before, shown = both
    square, aside = slant > SLANT[1] + UNTOLD, slant < SLANT[0] + UNTOLD
    assert (before[square] > 0.99).sum() > 20 and (before[aside] > 0.3).sum() > 5
    np.testing.assert_allclose(shown[square], before[square])
    assert shown[aside].max() == 0


def test_a_bald_top_that_shines_does_not_tell_the_colour_of_the_back(curtains):
    portrait, shell = curtains
    painter = Painter(portrait, shell, flow(portrait, shell, *photographed(portrait))[0])
    skin, dark = (np.log(to_linear(np.array(COLORS[label]))) for label in (SKIN, HAIR))
    sides = np.zeros((ROWS, COLUMNS), bool)
    sides[DOME:, np.cos(chart.azimuth()) < 0] = True
    weight = sides.astype(np.float32)
    weight[: DOME // 4] = 1
    painter.look = np.where(sides[..., None], dark, skin).astype(np.float32), weight
    painter.cosine = np.where(sides, 0.2, 1.0)
    np.testing.assert_allclose(painter._middle(), dark, atol=1e-5)
    painter.portrait = replace(portrait, skin=np.zeros_like(portrait.skin))
    np.testing.assert_allclose(painter._middle(), skin, atol=0.15)  # sides at a slant weigh little


def test_hair_at_a_slant_is_not_darker_than_what_is_seen_squarely(curtains):
    """Sides at 0.2 of the light, as a lamp in front leaves them: of 1.6 of log 0.6 are taken at most."""
    portrait, shell = curtains
    painter = Painter(portrait, shell, flow(portrait, shell, *photographed(portrait))[0])
    values, weight = painter.look
    slant = 1 - np.clip((painter.cosine - 0.3) / 0.4, 0, 1)
    painter.look = (values + np.log(0.2) * slant[..., None]).astype(np.float32), weight
    painter.middle = painter._middle()
    even = painter._even() @ LUMA
    shaded = (weight > 0.5) & (slant == 1) & (painter.near > 0.5)
    assert shaded.sum() > 20 and even[shaded].min() > 0.3
    assert np.abs(even[(weight > 0.5) & (painter.cosine > 0.95)]).max() < 0.05


def test_the_cap_closes_hair_beside_the_face(curtains):
    """Cards alone leave holes and rags there; before the forehead they hang without a cap."""
    portrait, shell = curtains
    _, inner = cap_surface(shell, portrait)
    away = np.degrees(np.abs(chart.azimuth()))
    rows = slice(DOME, DOME + 12)
    beside = (shell.there > 0.9) & (shell.growth < 0.35) & (away > 58) & (away < 80)
    assert beside[rows].sum() > 20
    assert (inner[rows][beside[rows]] > 0).mean() > 0.95


def test_patches_at_a_slant_have_the_tone_of_the_hair_around(curtains):
    """A highlight on the rim of a side is a white patch from there; before the camera it stays."""
    portrait, shell = curtains
    ways, _ = flow(portrait, shell, *photographed(portrait))
    pixels, _ = portrait.pixels(shell.surface(chart.grid(), 1.0))
    left = np.abs(pixels[..., 0] - 292) < 400  # all that is seen of hair
    lit = portrait.color.copy()
    height = int(0.42 * len(lit))
    lit[height : height + 14] *= 3.0
    plain, bright = (
        Painter(replace(portrait, color=color), shell, ways) for color in (portrait.color, lit)
    )
    cells = chart.grid().reshape(-1, 2)
    cosine = np.abs(plain._cosine(shell.surface(cells, 1.0), cells)).reshape(ROWS, COLUMNS)
    seen = left & (plain.look[1] > 0.5) & (shell.there > 0.9)
    rise = (bright.look[0] - plain.look[0]).mean(-1)
    kept = rise + (bright.even - plain.even).mean(-1)
    most, least = EVENED
    slanted, square = (seen & where & (rise > 0.6) for where in (cosine < least, cosine > most))
    assert slanted.sum() > 5 and square.sum() > 5
    assert kept[slanted].max() < 0.6 * rise[slanted].max()
    np.testing.assert_allclose(kept[square], rise[square], atol=1e-6)


def test_what_is_continued_has_strands_of_its_own(curtains):
    """Where the colours of the photo are drawn out or continued, made-up strands lie over them."""
    portrait, shell = curtains
    ways, _ = flow(portrait, shell, *photographed(portrait))
    cells = chart.grid().reshape(-1, 2)
    points = shell.surface(cells, 1.0)
    streak = np.random.default_rng(0).normal(size=len(points))

    def strands(sharp):
        painter = Painter(replace(portrait, sharp=sharp * np.ones_like(portrait.hair)), shell, ways)
        with_, without = (painter.color(points, cells, s)[0] for s in (streak, 0 * streak))
        shown = painter.color(points, cells, streak)[1] > 0.95
        square = shown & (np.abs(painter._cosine(points, cells)) > 0.85)
        slant = shown & (np.abs(painter._cosine(points, cells)) < 0.6)
        off = np.abs(np.log(with_ / without)).mean(-1)
        assert square.sum() > 5 and slant.sum() > 5
        return off[square].mean(), off[slant].mean(), painter.energy * np.abs(streak).mean()

    square, slant, whole = strands(1.0)
    assert square < 0.1 * whole < slant
    assert strands(0.0)[0] == pytest.approx(whole, rel=0.5)


def test_the_photo_fades_out_where_it_ends_to_show_hair(curtains):
    """Its colours end in no border; beside skin that it shows, they go on to the hairline."""
    portrait, shell = curtains
    painter = Painter(portrait, shell, flow(portrait, shell, *photographed(portrait))[0])
    back = np.cos(chart.azimuth()) < -0.2
    assert painter.shows[:DOME, back].max() == 0
    assert painter.shows.max() > 0.95
    # In 5 mm: 1.5 of a smoothstep over half the range, and 0.25 of a blur of 8 mm.
    assert np.abs(np.diff(painter.shows, axis=0)).max() < 0.75


def test_wisps_stand_far_out_on_the_outline_alone(curtains):
    """There the photo cuts them; elsewhere nothing does, and the backdrop would look through."""
    portrait, shell = curtains
    wisps = grow(shell, flow(portrait, shell, *photographed(portrait))[0], 400, 9.0, 60.0)
    camera = portrait.camera
    beside = replace(camera, rotation=np.array([0, np.pi / 2, 0]))
    front, side = (ribbons(shell, wisps, one)[0].mean(2) for one in (camera, beside))
    cells, _ = shell.chart.cell(front)
    outward = front - shell.chart.center
    outward[..., 1] *= cells[..., 1] < DOME
    square, outline = (np.abs(cameras.facing(front, outward, one)) for one in (camera, beside))
    thick = shell.chart.take(shell.radius - shell.base, cells)
    there = (np.arange(KNOTS) > KNOTS // 2) & (thick > 9.5) & (square > 0.4) & (outline < 0.05)
    assert there.sum() > 5
    farther = np.linalg.norm(side - front, axis=-1)[there]
    # The two edges of a wisp face a little away from its middle.
    np.testing.assert_allclose(farther, OVER[1] - OVER[0], atol=0.15)


def test_what_is_cut_off_hanging_hair_takes_its_tip_too(curtains, monkeypatch):
    portrait, shell = curtains
    ways = flow(portrait, shell, *photographed(portrait))[0]
    wisps = grow(shell, ways, 120, 9.0, 60.0)
    edges, cells = ribbons(shell, wisps, portrait.camera)
    monkeypatch.setattr(atlas, "strand_alpha", lambda card, *_: np.ones(len(card), np.float32))
    layout = atlas.pack(wisps.width, wisps.length, 256)
    texture, *rest = (np.zeros((256, 256, n), np.float32) for n in (4, 2, 1, 1))
    atlas.paint_cards(
        Painter(portrait, shell, ways), layout, edges, cells, np.ones(len(wisps.hem)), wisps,
        texture, rest[0], rest[1][..., 0], rest[2][..., 0],
    )  # fmt: skip
    hangs = wisps.hem | (
        shell.chart.take(in_the_air(shell).astype(float), wisps.cells[:, -1]) > 0.5
    )
    assert hangs.any() and not hangs.all()
    for n in np.flatnonzero(hangs):
        rows = slice(layout.top[n], layout.top[n] + layout.height[n])
        card = texture[rows, layout.left[n] : layout.left[n] + layout.width[n], 3]
        assert (np.diff(card, axis=0) <= 1e-6).all()
