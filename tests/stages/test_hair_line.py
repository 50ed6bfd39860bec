"""Hairlines: smooth, alike on both sides where one side is not seen, and not cut where nobody looks."""

import cv2
import numpy as np
import pytest

from bakery.geometry import camera as cameras
from bakery.geometry import rotation
from bakery.geometry.raster import rasterize
from bakery.heads.file import load_head
from bakery.heads.scalp import scalp
from bakery.stages.hair import chart
from bakery.stages.hair.chart import DOME, ROWS
from bakery.stages.hair.pattern import strand_alpha
from bakery.stages.hair.portrait import at, look
from bakery.stages.hair.presence import alike, ears_under, trusted, weighed
from bakery.stages.hair.shell import SLACK, make_shell
from bakery.stages.segment import BACKGROUND, HAIR, SKIN, Segmentation
from bakery.types import EXPRESSIONS, Camera, Fit

SIDE = 400
COLORS = {SKIN: (0.8, 0.6, 0.5), HAIR: (0.2, 0.12, 0.08), BACKGROUND: (0.55, 0.6, 0.65)}


@pytest.fixture(scope="module")
def head():
    return load_head()


def seen_by(yaw=0.0):
    """A Fit whose camera sees the head turned by `yaw` degrees to its left."""
    turn = rotation.matrix(np.array([0, np.radians(yaw), 0]))
    camera = Camera(
        1000.0, np.array([200.0, 190.0]), rotation.vector(turn), np.array([0, 0, -1100.0]),
        SIDE, SIDE,
    )  # fmt: skip
    zero = np.zeros
    return Fit(
        "makehuman", camera, zero(1), zero(len(EXPRESSIONS)), zero(2), zero((9, 3)), zero(1),
        zero((468, 3)), zero((478, 2)),
    )  # fmt: skip


def cropped(head, fit, thick=6):
    """Labels [H, W] of short hair: the scalp as the camera sees it, and so many pixels around it."""
    seen = cameras.to_camera(head.mean, fit.camera)
    faces = head.faces[head.part_faces("skin")]
    drawn = rasterize(
        cameras.project_camera(seen, fit.camera), -seen[:, 2], faces, (SIDE, SIDE), cull=True
    )
    share = scalp(head)[faces].mean(1)
    hair = (drawn.face >= 0) & (share[drawn.face] > 0.5)
    labels = np.where(drawn.face >= 0, SKIN, BACKGROUND).astype(np.uint8)
    labels[hair] = HAIR
    disk = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * thick + 1,) * 2)
    around = cv2.dilate(hair.astype(np.uint8), disk) > 0
    labels[around & (labels == BACKGROUND)] = HAIR
    return labels


def shell_of(labels, head, fit):
    picture = np.array([COLORS.get(k, (0, 0, 0)) for k in range(256)], np.float32)[labels]
    segmentation = Segmentation(labels, (labels == SKIN).astype(np.float32))
    portrait = look(picture, segmentation, fit, head, head.mean)
    return make_shell(portrait, head, head.mean), portrait


@pytest.fixture(scope="module")
def plain(head):
    fit = seen_by()
    return shell_of(cropped(head, fit), head, fit)


def length(there):
    """Of the border [cells] between hair and none, above the jaw."""
    found, _ = cv2.findContours(
        (cv2.resize(there.astype(np.float32), None, fx=4, fy=4) > 0.5)[: 4 * (DOME + 10)]
        .astype(np.uint8), cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE,
    )  # fmt: skip
    return sum(cv2.arcLength(line, True) for line in found) / 4


def test_a_side_that_is_seen_badly_has_the_hair_of_the_other():
    cosine = np.zeros((1, 8))
    cosine[0, :4], cosine[0, 4:] = 0.2, 0.9
    told, nothing = np.ones((1, 8)), np.zeros((1, 8))
    hair = np.array([[0, 0, 0, 0, 1.0, 1, 1, 0]])
    own, other = trusted(cosine, told)
    share = weighed(own, other, hair, nothing, lambda grid: grid)
    np.testing.assert_array_equal(share > 0.5, [[0, 1, 1, 1, 1, 1, 1, 0]])
    assert own[0, :4].max() < 0.2 and own[0, 4:].min() == 1


def test_both_sides_that_are_seen_keep_their_own():
    hair = np.array([[0, 0, 1.0, 0]])
    own, other = trusted(np.ones((1, 4)), np.ones((1, 4)))
    share = weighed(own, other, hair, 1 - hair, lambda grid: grid)
    np.testing.assert_array_equal(share > 0.5, hair > 0.5)
    assert own.min() == 1


def test_what_nobody_sees_is_usual():
    usual = np.array([[0, 1.0, 1, 0]])
    own, other = trusted(np.zeros((1, 4)), np.zeros((1, 4)))
    share = weighed(own, other, 1 - usual, usual, lambda grid: grid)
    np.testing.assert_allclose(share, usual)


def test_the_near_side_tells_of_what_hangs_on_the_far_one():
    hairy = np.zeros((ROWS, 2))
    hairy[:, 1] = 1
    straight, turned = alike(hairy, 0.0), alike(hairy, np.radians(25))
    assert straight[: DOME + 10].all() and not straight[DOME + 10 :, 0].any()
    assert turned.all()
    assert not alike(hairy, np.radians(-25))[DOME + 10 :, 0].any(), "the near side is bare"
    both = (True, True)
    assert ears_under((True, False), both, np.radians(25)) == (False, False)
    assert ears_under((True, False), both, 0.0) == (True, False)
    assert ears_under(both, (False, True), np.radians(25)) == (True, True)


def test_an_ear_with_no_hair_beside_its_lobe_is_only_turned_away():
    assert ears_under((True, False), (False, False), np.radians(8)) == (False, False)
    assert ears_under((True, False), (True, False), np.radians(8)) == (True, False)


def test_a_frayed_mask_gives_a_smooth_hairline(plain, head):
    """Teeth of 5 mm in the labels, a row in two, add less than a tenth to the line."""
    fit = seen_by()
    labels = cropped(head, fit)
    hair = (labels == HAIR).astype(np.uint8)
    inner, outer = (how(hair, np.ones((9, 9), np.uint8)) for how in (cv2.erode, cv2.dilate))
    teeth = ((np.arange(SIDE) // 5) % 2 == 0)[:, None]
    frayed = np.where(teeth, outer, inner)
    within = labels != BACKGROUND
    labels = np.where(within, np.where(frayed, HAIR, SKIN), labels).astype(np.uint8)
    found, _ = shell_of(labels, head, fit)
    assert length(found.there) < 1.1 * length(plain[0].there)


def test_the_far_side_of_a_turned_head_has_the_near_sides_hair(head):
    """Its rim is labelled as skin: a shell without it would be shaved on that side."""
    fit = seen_by(25.0)
    labels = cropped(head, fit)
    columns = np.arange(SIDE)[None]
    rows = np.flatnonzero((labels != BACKGROUND).any(1))
    edges = np.array([np.flatnonzero(row != BACKGROUND)[[0, -1]] for row in labels[rows]])
    points = cameras.project(np.array([[-60.0, 20, 0], [60, 20, 0]]), fit.camera)
    camera = cameras.position(fit.camera)
    far = 0 if camera[0] > 0 else 1  # the subject's right, or left
    aside = np.sign(points[far, 0] - points[1 - far, 0])
    edge = edges[:, 0] if aside < 0 else edges[:, 1]
    rim = np.zeros(labels.shape, bool)
    rim[rows] = np.abs(columns - edge[:, None]) < 14
    rim &= np.arange(SIDE)[:, None] > rows[0] + 45
    assert (labels[rim] == HAIR).sum() > 100
    shell, _ = shell_of(np.where(rim & (labels == HAIR), SKIN, labels), head, fit)
    turn = np.degrees(chart.azimuth())
    level = slice(DOME - 8, DOME - 3)
    side = (turn > 75) & (turn < 110)
    near, away = (shell.there[level][:, ::s][:, side] for s in ((1, -1) if far == 0 else (-1, 1)))
    assert near.mean() > 0.9
    assert away.mean() > 0.9


def test_no_hair_stands_before_the_backdrop(head):
    """Thick hair with a dent of 20 mm beside the brows: the shell has it too."""
    fit = seen_by()
    labels, close = (cropped(head, fit, thick) for thick in (18, 2))
    labels[150:172] = close[150:172]
    shell, portrait = shell_of(labels, head, fit)
    pixels, _ = portrait.pixels(shell.surface(chart.grid(), 1.0))
    size = 2 * int(2 * SLACK * portrait.scale + 2) + 1  # the shell is smooth: twice the slack
    clear = cv2.erode(portrait.behind.astype(np.uint8), np.ones((size, size), np.uint8)) > 0
    skin, _ = portrait.pixels(shell.surface(chart.grid(), 0.0))
    before = at(clear, pixels) & ~at(portrait.behind, skin) & (shell.there > 0.5)
    assert before.sum() < 0.01 * (shell.there > 0.5).sum()


def test_short_hair_lies_on_the_neck_and_gets_shorter(head):
    fit = seen_by()
    shell, _ = shell_of(cropped(head, fit, 14), head, fit)
    back = np.abs(chart.azimuth()) > np.radians(150)
    low = slice(DOME + 8, DOME + 14)
    off = (shell.radius - shell.chart.ears)[:, back]
    assert off[low].max() < 10 and off[low].min() > -1  # mm, and none of it under the skin
    assert off[DOME - 4].mean() > off[low].mean() + 2
    assert shell.below < 20


def tip(length, hem, across, ragged):
    """mm from the root of the tip of a strand of a card."""
    t = np.linspace(0, 1, 481)
    s, across, ragged = (np.full(t.shape, x) for x in (0.5, across, ragged))
    alpha = strand_alpha(
        np.zeros(t.shape, int), s, across, t, ragged, np.ones(t.shape), np.full(t.shape, length),
        np.full(t.shape, hem),
    )  # fmt: skip
    return t[np.flatnonzero(alpha > 0.25)[-1]] * length


def test_tips_of_short_wisps_end_together():
    """A comb of 14 mm teeth hung from short hair; long hair keeps its wispy ends."""
    short, long = (tip(x, False, 10.0, 0.0) - tip(x, False, 10.0, 1.0) for x in (48.0, 130.0))
    assert short < 8 and long > 20


def test_a_hem_ends_lock_by_lock():
    """Strands of a lock end together, locks do not."""
    assert tip(50.0, True, 10.0, 0.0) - tip(50.0, True, 10.0, 1.0) < 6
    ends = np.array([tip(50.0, True, across, 0.5) for across in np.arange(0.0, 60.0)])
    assert np.ptp(ends) > 6 and np.abs(np.diff(ends)).max() < 5


def test_a_side_that_is_seen_somewhat_worse_tells_nothing_but_what_it_sees_well_itself():
    """A few degrees of turn tell which temple is believed; a forehead is seen well on both sides."""
    cosine = np.array([[0.9, 0.3, 0.6, 0.95]])
    own, _ = trusted(cosine, np.ones((1, 4)))
    assert own[0, 1] < 1e-6 and own[0, [0, 2, 3]].min() == 1
