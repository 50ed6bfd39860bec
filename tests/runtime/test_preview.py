"""The contact sheet: the pictures of the reference renderer, in their places, with their names."""

import numpy as np

from bakery.geometry.color import to_encoded
from bakery.runtime import contact_sheet
from bakery.runtime.framing import head_camera
from bakery.runtime.overlay import caption
from bakery.runtime.render import draw, over_gray

SIDE = 64
STRIP = 5  # rows below a picture with its name


def test_pictures_are_those_of_the_reference(noise_avatar):
    avatar, wanted = noise_avatar, contact_sheet.tiles(noise_avatar)
    sheet = contact_sheet.contact_sheet(avatar, size=SIDE, columns=4)
    assert sheet.shape == (-(-len(wanted) // 4) * SIDE, 4 * SIDE, 3) and sheet.dtype == np.uint8
    for number in (0, 6, 8, 9):  # turned, blinking, looking aside, a key
        expression, gaze, yaw = wanted[number][1]
        camera = head_camera(avatar.fit, avatar.head, avatar.neutral, yaw, size=SIDE)
        vertices = avatar.head.vertices(avatar.neutral, expression, gaze)
        frame = draw(avatar, vertices, camera, expression, np.array(gaze, float))
        top, left = number // 4 * SIDE, number % 4 * SIDE
        shown = sheet[top : top + SIDE - STRIP, left : left + SIDE].astype(float)
        off = np.abs(255 * to_encoded(over_gray(frame))[:-STRIP] - shown).max(-1)
        # A sample on the edge of a triangle may fall to its neighbour (tests of the player).
        assert np.quantile(off, 0.99) < 1.5
    assert len(wanted) % 4 == 3
    assert (sheet[-SIDE:, -SIDE:] == sheet[0, 0, 0]).all()  # the grey behind the head


def test_every_picture_says_what_it_shows(noise_avatar):
    names = [name for name, _ in contact_sheet.tiles(noise_avatar)]
    assert len(set(names)) == len(names) == 9 + 6
    assert names[1] == "neutral" and names[-1] == "key: f"
    sheet = contact_sheet.contact_sheet(noise_avatar, size=200, columns=5)
    again = contact_sheet.contact_sheet(noise_avatar, size=200, columns=5)
    assert (sheet == again).all()
    for number in range(15):
        top, left = number // 5 * 200, number % 5 * 200
        strip = sheet[top + 185 : top + 200, left : left + 200]
        bright = (strip.min(-1) > 140).sum()  # below a caption nothing is above 102
        assert 20 < bright < 1000, "white letters on a dark strip"


def test_a_long_caption_stays_inside():
    """Letters shrink rather than leave the picture, and what is above them stays as it is."""
    picture = np.full((100, 80, 3), 90, np.uint8)
    named = caption(picture, "a name that is far too long for so small a picture")
    assert (named[: 100 - 8] == 90).all() and (picture == 90).all()
    assert (named[-8:, :2] == 36).all() and (named[-8:, -2:] == 36).all()
    assert named[-8:].max() > 100
