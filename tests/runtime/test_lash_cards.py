"""Lashes over a picture: known answers, the fast loop against the clear one, old bundles."""

from dataclasses import replace

import numpy as np
import pytest

from bakery.geometry.color import to_encoded, to_linear
from bakery.heads.base import CARDS, weights
from bakery.heads.lashes import card_texels
from bakery.runtime import cards
from bakery.runtime.lash_cards import AS_PHOTOGRAPHED, card_weights, lay_cards
from bakery.runtime.player import Player
from bakery.runtime.render import draw, over_gray
from bakery.stages.condition import face_camera

SHUT = weights({"eyeBlinkLeft": 1.0})


def camera_of(avatar, yaw):
    return face_camera(avatar.fit, avatar.head, avatar.neutral, yaw, 0.0, 160, 1.5)


def with_cards(avatar, color, alpha):
    """The avatar with one colour all over its cards, and no other hair."""
    hair = np.zeros(avatar.textures.hair.shape, np.float32)
    hair[card_texels(avatar.head, len(hair))] = [*(alpha * np.array(color)), alpha]
    return replace(avatar, textures=replace(avatar.textures, hair=hair))


def pictures(avatar, yaw, expression):
    """The same frame by the reference and by the player."""
    camera, gaze = camera_of(avatar, yaw), np.zeros(2)
    vertices = avatar.head.vertices(avatar.neutral, expression, gaze)
    player = Player(avatar)
    fast = player.frame(player.workspace(160, 160), camera, expression, gaze)
    return [
        to_encoded(over_gray(x)) for x in (draw(avatar, vertices, camera, expression, gaze), fast)
    ]


@pytest.mark.parametrize("yaw", [0, 40])
def test_cards_darken_the_eyes_alone(noise_avatar, yaw):
    """Black cards against clear ones: the difference is dark, about the eyes, alike in both players."""
    black, clear = (
        pictures(with_cards(noise_avatar, (0, 0, 0), alpha), yaw, SHUT) for alpha in (0.9, 0.0)
    )
    for one, other in zip(black, clear):
        change = other - one
        assert change.min() > -0.02  # never lighter
        rows, columns = np.nonzero(change.max(-1) > 0.05)
        assert 60 < len(rows) < 0.05 * 160 * 160 and np.ptp(rows) < 40
    assert np.quantile(np.abs(black[0] - black[1]).max(-1), 0.999) < 0.1 / 255


@pytest.mark.parametrize("at_once", [1, 5000])
def test_cards_are_laid_in_their_order_however_many_at_once(noise_avatar, monkeypatch, at_once):
    """Translucent cards of many colours, one upon the other: the same picture to the bit."""
    camera, gaze = camera_of(noise_avatar, 20), np.zeros(2)
    vertices = noise_avatar.head.vertices(noise_avatar.neutral, SHUT, gaze)
    together = draw(noise_avatar, vertices, camera, SHUT, gaze)
    monkeypatch.setattr(cards, "AT_ONCE", at_once)
    apart = draw(noise_avatar, vertices, camera, SHUT, gaze)
    np.testing.assert_array_equal(together.color, apart.color)
    np.testing.assert_array_equal(together.alpha, apart.alpha)


def test_cards_are_mixed_in_srgb():
    """Half of a white card over black is 0.5 encoded, as in a browser, not 0.5 linear."""

    class Square:
        faces = np.array([[0, 1, 2], [2, 1, 3]])
        uv_faces, uv = faces, np.full((4, 2), 0.5)
        mean = np.array([[1.0, 0, 0]] * 4)

        def part_faces(self, *names):
            assert names == CARDS
            return np.array([0, 1])

    pixels = np.array([[1.25, 1.25], [6.75, 1.25], [1.25, 6.75], [6.75, 6.75]])
    layer = np.full((4, 4, 4), 0.5, np.float32)
    color, alpha, known = (
        np.zeros((8, 8, 3), np.float32),
        np.ones((8, 8), np.float32),
        np.zeros((8, 8)),
    )
    alpha[:, 4:] = 0  # nothing behind: there the card itself is all there is
    depth = np.full((8, 8), 100.0)
    depth[6] = 10.0  # something before it
    lay_cards(color, alpha, known, depth, Square(), pixels, np.full(4, 50.0), layer, np.ones(2))
    np.testing.assert_allclose(color[3, 2], to_linear(0.5), atol=1e-6)
    np.testing.assert_allclose([*color[3, 5], alpha[3, 5]], 0.5, atol=1e-6)
    assert not color[6].any() and not color[:, 0].any() and not color[7].any()


def test_cards_show_where_the_photographed_lashes_do_not(noise_avatar):
    photo = noise_avatar.fit.camera
    still = np.zeros(52, np.float32)
    np.testing.assert_allclose(card_weights(photo, photo, still), AS_PHOTOGRAPHED)
    np.testing.assert_allclose(card_weights(photo, photo, SHUT), [1, AS_PHOTOGRAPHED])
    turned = [
        card_weights(camera_of(noise_avatar, yaw), photo, still)[0] for yaw in (10, 20, 30, 40)
    ]
    assert (np.diff([AS_PHOTOGRAPHED, *turned[:3]]) > 0.01).all() and turned[3] == 1


def test_a_bundle_from_before_shows_none(noise_avatar):
    """Its hair layer is clear where cards are drawn from now on."""
    textures = noise_avatar.textures
    textures = replace(textures, hair=np.zeros_like(textures.hair))
    old = replace(noise_avatar, textures=textures)
    kept = ~np.isin(np.arange(len(old.head.faces)), old.head.part_faces(*CARDS))
    head = old.head
    none = replace(
        head, faces=head.faces[kept], uv_faces=head.uv_faces[kept], face_part=head.face_part[kept]
    )  # landmarks lie on faces before the cards
    assert head.landmark_faces.max() < head.part_faces(*CARDS).min()
    assert len(Player(old).card_faces) == 0
    for one, other in zip(pictures(old, 30, SHUT), pictures(replace(old, head=none), 30, SHUT)):
        np.testing.assert_array_equal(one, other)
