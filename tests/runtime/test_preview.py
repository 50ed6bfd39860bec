"""The contact sheet: the pictures of the reference renderer, in their places."""

import numpy as np

from bakery.geometry.color import to_encoded
from bakery.runtime import contact_sheet as preview
from bakery.runtime.render import draw, over_gray
from bakery.stages.condition import face_camera

SIDE = 64


def test_pictures_are_those_of_the_reference(noise_avatar):
    avatar, wanted = noise_avatar, preview.tiles(noise_avatar)
    sheet = preview.contact_sheet(avatar, size=SIDE, columns=4)
    assert sheet.shape == (-(-len(wanted) // 4) * SIDE, 4 * SIDE, 3) and sheet.dtype == np.uint8
    for number in (0, 6, 8, 9):  # turned, blinking, looking aside, a key
        expression, gaze, yaw = wanted[number]
        camera = face_camera(avatar.fit, avatar.head, avatar.neutral, yaw, size=SIDE, share=0.52)
        vertices = avatar.head.vertices(avatar.neutral, expression, gaze)
        frame = draw(avatar, vertices, camera, expression, np.array(gaze, float))
        top, left = number // 4 * SIDE, number % 4 * SIDE
        shown = sheet[top : top + SIDE, left : left + SIDE].astype(float)
        off = np.abs(255 * to_encoded(over_gray(frame)) - shown).max(-1)
        # A sample on the edge of a triangle may fall to its neighbour (tests of the player).
        assert np.quantile(off, 0.99) < 1.5
    assert len(wanted) % 4 == 3
    assert (sheet[-SIDE:, -SIDE:] == sheet[0, 0, 0]).all()  # the grey behind the head
