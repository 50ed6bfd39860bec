"""Lashes and tear lines go with the lids of every person, outside of the eye."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from bakery.heads.base import FOLLOW, PARTS, look, weights
from bakery.heads.lashes import card_rectangle, card_texels, carried, own_vertices, with_lashes
from bakery.heads.mesh.search import Nearest
from bakery.show import frame as frames
from bakery.stages.fit.lids import close_lids
from bakery.types import EXPRESSIONS, Camera, Fit

LONGEST = 9.0  # mm from the skin: a lash and the depth of its root
ROOTED = 0.6  # mm from the skin: roots stand 0.2 off it


def person(head, seed):
    neutral = head.neutral(np.random.default_rng(seed).normal(size=len(head.identity_basis)))
    return with_lashes(close_lids(head, neutral), neutral)


def blink(weight):
    return weights({"eyeBlinkLeft": weight, "eyeBlinkRight": weight})


def distances(points, vertices, faces):
    """Distance [N] of points to the nearest of the faces, mm."""
    near = faces[np.linalg.norm(vertices[faces].mean(1) - points.mean(0), axis=1) < 32]
    return Nearest(vertices, near).query(points)[2]


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("weight", [0, 0.3, 0.6, 1])
def test_cards_follow_the_lids(head, seed, weight):
    own, neutral = person(head, seed)
    vertices = own.vertices(neutral, blink(weight), (0, 0))
    skin = own.faces[own.part_faces("skin")]
    lashes = own.part_vertices("lashes")
    for eye, center in enumerate(own.eye_centers(neutral)):
        ball = neutral[own.follow == FOLLOW.index("eye_" + ("left", "right")[eye])] - center
        radius = np.median(np.linalg.norm(ball, axis=1))
        mine = lashes[(vertices[lashes, 0] > 0) == (eye == 0)]
        assert np.linalg.norm(vertices[mine] - center, axis=1).min() > radius + 0.1
        off = distances(vertices[mine], vertices, skin)
        assert off.max() < LONGEST
        rest = distances(neutral[mine], neutral, skin)
        roots = rest < 0.3
        assert 25 < roots.sum() < 80, "both rows of roots lie on the lids of this person"
        assert off[roots].max() < ROOTED, "and stay there"


def test_shut_lashes_point_down_and_open_ones_up(head):
    own, neutral = person(head, 0)
    lashes = own.part_vertices("lashes")
    for weight, sign in ((0, 1), (1, -1)):
        vertices = own.vertices(neutral, blink(weight), (0, 0))[lashes]
        upper = vertices[-17 * 4 :].reshape(4, 17, 3)  # the right eye's upper lid comes last
        rise = upper[-1, :, 1] - upper[0, :, 1]
        assert (sign * rise[3:-3] > 0.8).all(), rise


@pytest.mark.parametrize("seed", range(3))
def test_the_tear_line_lies_on_the_eye_and_goes_when_it_shuts(head, seed):
    own, neutral = person(head, seed)
    tear, caps = own.part_vertices("tear"), own.part_vertices("eye_cap_left", "eye_cap_right")
    for look_up in (0, 15, -15):
        vertices = own.vertices(neutral, look(blink(0), (0, look_up)), (0, look_up))
        for center in own.eye_centers(neutral):
            near = tear[np.linalg.norm(vertices[tear] - center, axis=1) < 25]
            outer = np.linalg.norm(vertices[caps] - center, axis=1)
            reach = np.linalg.norm(vertices[near] - center, axis=1)
            assert reach.min() > outer[outer < 20].max() - 0.1 and reach.max() < 20
    faces = own.faces[own.part_faces("tear")]

    def area(weight):
        a, b, c = np.moveaxis(own.vertices(neutral, blink(weight), (0, 0))[faces], 1, 0)
        return np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()

    assert area(1) < 0.01 * area(0), "nothing is left of it"


def test_what_was_there_stays(head):
    """Vertices keep their numbers, landmarks their places, and the budget of triangles holds."""
    own, neutral = with_lashes(head, head.mean)
    V = len(head.mean)
    np.testing.assert_array_equal(neutral[:V], head.mean)
    np.testing.assert_array_equal(own.expression_basis[:, :V], head.expression_basis)
    np.testing.assert_array_equal(own.landmarks(neutral), head.landmarks(head.mean))
    assert len(own.faces) <= 40_000
    cards = own.part_faces("lashes", "tear")
    assert 0 < len(cards) <= 716 and own.faces[cards].min() >= V
    assert not np.any(own.expression_basis[EXPRESSIONS.index("jawOpen"), V:])


def test_cards_have_their_own_place_in_the_atlas(head):
    own, _ = with_lashes(head, head.mean)
    left, top, width, height = card_rectangle(own)
    uv = own.uv[own.uv_faces]
    middle = uv.mean(1)
    inside = ((middle > [left, top]) & (middle < [left + width, top + height])).all(1)
    np.testing.assert_array_equal(
        inside, np.isin(own.face_part, [PARTS.index("lashes"), PARTS.index("tear")])
    )
    rows, columns = card_texels(own, 1024)
    assert (columns.stop - columns.start, rows.stop - rows.start) == (209, 88)


def test_a_head_that_names_no_place_gives_its_own_lashes_place(head):
    """As one that was imported before cards were made."""
    old = replace(head, uv_rectangles={})
    box = card_rectangle(old)
    uv = old.uv[old.uv_faces[old.part_faces("lashes")]].reshape(-1, 2)
    np.testing.assert_allclose([box[0] + box[2], box[1] + box[3]], uv.max(0), atol=1e-6)
    own, _ = with_lashes(old, old.mean)
    assert card_rectangle(own) == box, "and says so from now on"
    uv = own.uv[own.uv_faces[own.part_faces("lashes", "tear")]].reshape(-1, 2)
    np.testing.assert_allclose([*uv.min(0), *np.ptp(uv, axis=0)], box, atol=1e-6)


def test_a_head_without_a_place_for_cards_comes_back(tiny):
    own, neutral = with_lashes(tiny, tiny.mean)
    assert own is tiny and neutral is tiny.mean


def test_cards_go_with_a_shape_that_moves(head):
    own, neutral = person(head, 0)
    count = own_vertices(own)
    assert count == len(head.mean) < len(neutral)
    moved = np.zeros((count, 3), np.float32)
    assert_array_equal(carried(neutral, moved), neutral)
    assert_allclose(
        carried(neutral, moved + [1, 2, 3]) - neutral, [[1, 2, 3]] * len(neutral), atol=1e-5
    )
    assert_array_equal(carried(head.mean, moved), head.mean)  # no cards, nothing to carry


def test_another_photo_of_the_person_warps_a_head_with_lashes(head):
    own, neutral = person(head, 0)
    identity = np.random.default_rng(0).normal(size=len(head.identity_basis))
    residual = np.zeros((468, 3))
    residual[13] = [0, 1, 0]  # 1 mm at the upper lip
    camera = Camera(900.0, np.zeros(2), np.zeros(3), np.array([0, 0, -700.0]), 64, 64)
    fit = Fit(
        head.name, camera, identity, np.zeros(52), np.zeros(2), np.zeros((9, 3)), np.zeros(1),
        residual, np.zeros((478, 2)),
    )  # fmt: skip
    found = frames.neutral_for(own, neutral, fit, fit, fit.expression)
    lift = (own.landmarks(found) - own.landmarks(neutral))[13]
    assert_allclose(lift, [0, 1, 0], atol=0.15)  # as far as the warp is smooth
    elsewhere = replace(fit, head="nowhere to be found")  # as a head that was given by its path
    assert frames.neutral_for(own, neutral, elsewhere, elsewhere, fit.expression) is neutral
