"""The lower end of the default head's nose: where photos have it, and texels stay where they were."""

import numpy as np
import pytest

from bakery.heads.base import PARTS
from bakery.heads.build import nose
from bakery.heads.file import load_head
from bakery.heads.patch import Patch
from bakery.landmarks import FACE, NOSE_BASE

TIP = 4


def test_the_tip_lies_at_its_landmark():
    """On a scanned head that is drawn and detected, landmark 4 is the foremost point, and 2 lies 14.7 mm behind."""
    head = load_head()
    places = head.landmarks(head.mean)
    skin = head.mean[head.part_vertices("skin")]
    middle = skin[np.abs(skin[:, 0]) < 4]
    assert abs(middle[middle[:, 2].argmax(), 1] - places[TIP, 1]) < 3.5  # 7.3 before it was lifted
    assert middle[:, 2].max() - places[TIP, 2] < 0.5
    assert (places[TIP, 2] - places[NOSE_BASE, 2] > 8).all()


def test_only_the_nose_moves():
    tip = np.array([0.0, -37.0, 44.0])
    places = tip + [[0, 0, 0], [0, 40, 0], [0, -20, 0], [25, 0, 0], [0, 0, -60]]
    assert nose.lift_at(places, tip) == pytest.approx([nose.LIFT, 0, 0, 0, 0])
    above = tip + [[0, nose.BRIDGE_UP[0], 0], [15, nose.BRIDGE_UP[0], 0]]
    assert nose.bridge_at(above, tip) == pytest.approx([nose.BRIDGE, 0])


def sheet():
    """A face of one sheet, 1 mm a step, with a hump for a nose; its uv is what the front sees."""
    steps = np.arange(-40, 41)
    x, y = (part.reshape(-1).astype(float) for part in np.meshgrid(steps, steps))
    z = 20 * np.exp(-((x / 8) ** 2) - ((y / 15) ** 2))
    number = np.arange(len(x)).reshape(len(steps), -1)
    a, b, c, d = (
        part.reshape(-1)
        for part in (number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1])
    )
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    uv = np.stack([0.5 + x / 200, 0.5 - y / 200], 1)
    none = np.zeros((0, len(x), 3), np.float32)
    parts = np.full(len(faces), PARTS.index("skin"), np.uint8)
    follow = np.zeros(len(x), np.uint8)
    return Patch(parts, np.stack([x, y, z], 1), faces, uv, faces, follow, none, none)


def test_texels_stay_in_front_of_what_they_were():
    """uv that is flat as seen from the front goes up with the surface, folds nowhere, and ends with it."""
    flat = sheet()
    lifted = flat.mean.copy()
    lifted[:, 1] += nose.lift_at(flat.mean, nose.tip_of(flat.mean))
    uv = nose.moved_uv(flat, lifted)
    wanted = np.stack([0.5 + lifted[:, 0] / 200, 0.5 - lifted[:, 1] / 200], 1)
    off = np.linalg.norm(uv - wanted, axis=1) * nose.ATLAS
    assert (
        off.mean() < 0.5 and off.max() < 6
    )  # texels; the lift is 26, and is smoothed over 8 to 14
    still = lifted[:, 1] == flat.mean[:, 1]
    assert (uv[still] == flat.uv[still]).all()
    one, other = (uv[flat.faces[:, k]] - uv[flat.faces[:, 0]] for k in (1, 2))
    area = one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0]
    assert (np.sign(area) == np.sign(area[0])).all()


def test_landmarks_are_their_mirror_images():
    """To 0.01 mm, each to another one or to itself."""
    head = load_head()
    points = head.landmarks(head.mean)[:FACE]
    far = np.linalg.norm((points * [-1, 1, 1])[:, None] - points[None], axis=-1)
    other = far.argmin(1)
    assert (other[other] == np.arange(FACE)).all() and far.min(1).max() < 0.02
