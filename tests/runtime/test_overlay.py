"""Overlays: what is drawn lies where it was found, at any size of photo, and can be told apart."""

import io
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from bakery import landmarks as marks
from bakery.formats.labels import encode_labels
from bakery.runtime import overlay
from bakery.stages.segment import LABELS, SKIN
from bakery.types import Landmarks

GRAY = 120


def face_at(avatar, scale, shift=(0.0, 0.0)):
    points = avatar.fit.landmarks_projected * scale + shift
    low, high = points.min(0), points.max(0)
    return Landmarks(np.concatenate([low, high - low]), 0.875, points, np.ones(478))


def plain(avatar, scale):
    size = round(400 * scale), round(300 * scale)
    return np.full((*size, 3), GRAY, np.uint8)


def near(picture, place, color, reach=2):
    """Whether a pixel around `place` has about this colour."""
    x, y = np.asarray(place, int)
    patch = picture[max(y - reach, 0) : y + reach + 1, max(x - reach, 0) : x + reach + 1]
    return (np.abs(patch.astype(int) - color).max(-1) < 60).any()


@pytest.mark.parametrize("scale", [0.4, 3.0, 12.0])
def test_faces_are_drawn_where_they_are(noise_avatar, scale):
    photo, face = plain(noise_avatar, scale), face_at(noise_avatar, scale)
    drawn = overlay.draw_faces(photo, [face])
    assert (photo == GRAY).all()
    width = drawn.shape[1]
    grown = width / photo.shape[1]
    assert overlay.SMALLEST <= round(grown * photo.shape[0]) <= overlay.LARGEST
    groups = {name: (members, color) for name, members, color in overlay.GROUPS}
    for name in ("lips", "eyes", "brows", "contour"):
        members, color = groups[name]
        hit = [near(drawn, face.points[k] * grown, color) for k in members]
        assert np.mean(hit) > 0.8, name
    left, top, wide, high = face.box * grown
    for corner in ((left, top + high), (left + wide, top + high)):
        assert near(drawn, corner, overlay.DETECTED)
    strip = drawn[round(grown * photo.shape[0]) + 2 :]
    for _, color in groups.values():
        assert (strip == color).all(-1).any(), "the legend shows every colour"


def test_faces_at_the_edge_keep_their_signs(noise_avatar):
    """A box that begins above the picture has its number inside it."""
    face = face_at(noise_avatar, 3.0)
    face = replace(face, box=np.array([-40.0, -50.0, 300.0, 300.0]))
    drawn = overlay.draw_faces(plain(noise_avatar, 3.0), [face])
    assert (drawn[:60, :150] == overlay.WHITE).all(-1).sum() > 20


def test_several_faces_are_all_drawn(noise_avatar):
    one, other = face_at(noise_avatar, 1.0), face_at(noise_avatar, 1.0, (300.0, 0.0))
    drawn = overlay.draw_faces(np.full((400, 600, 3), GRAY, np.uint8), [one, other])
    grown = drawn.shape[1] / 600
    for face in (one, other):
        assert near(drawn, face.points[marks.MOUTH_CORNERS[0]] * grown, (255, 60, 120))


def test_a_fit_is_drawn_over_its_photo(noise_avatar):
    """Rings lie on the landmarks as found, dots on the fitted ones, the shaded preview on the head alone."""
    avatar, face = noise_avatar, face_at(noise_avatar, 1.0, (6.0, 0.0))
    drawn = overlay.draw_fit(plain(avatar, 1.0), face, avatar.fit, avatar.head, avatar.neutral)
    side = overlay.PANEL
    assert drawn.shape[1] == 2 * side and drawn.shape[0] > side
    panels = drawn[:side, :side], drawn[:side, side:]
    found, fitted = (
        np.flatnonzero((np.abs(panels[0].astype(int) - color).max(-1) < 60).any(0))
        for color in (overlay.DETECTED, overlay.FITTED)
    )
    # Found ones lie 6 pixels of the photo to the right; rings have a radius of 4, dots of 2.
    scale = (np.ptp(found) - 8) / np.ptp(face.points[:, 0])
    assert scale > 2 and abs(found.min() + 4 - (fitted.min() + 2) - 6 * scale) < 3
    shaded = np.abs(panels[1].astype(int) - panels[0]).max(-1) > 10
    assert shaded[side // 2, side // 2] and not shaded[side // 2, :20].any()
    assert 0.2 < shaded.mean() < 0.8


def test_a_photo_that_is_cut_has_a_fit_too(noise_avatar):
    """What lies outside of the photo is black."""
    avatar = noise_avatar
    photo = plain(avatar, 1.0)[:200]
    drawn = overlay.draw_fit(photo, face_at(avatar, 1.0), avatar.fit, avatar.head, avatar.neutral)
    assert drawn.shape[1] == 2 * overlay.PANEL


def test_labels_are_coloured_and_named():
    height = 10 * len(LABELS)
    labels = np.zeros((height, 220), np.uint8)
    for label in range(len(LABELS)):
        labels[10 * label : 10 * label + 10] = label
    photo = np.full((*labels.shape, 3), GRAY, np.uint8)
    drawn = overlay.draw_labels(photo, labels)
    grown = drawn.shape[1] / 220
    for label, color in enumerate(overlay.LABEL_COLORS):
        middle = drawn[round((10 * label + 5) * grown), drawn.shape[1] // 2]
        np.testing.assert_allclose(middle, (GRAY + color.astype(int)) / 2, atol=2)
        assert (drawn[round(height * grown) :] == color).all(-1).any(), LABELS[label]
    few = overlay.draw_labels(photo, np.full_like(labels, SKIN))
    strip = few[round(height * grown) :]
    shown = [(strip == color).all(-1).any() for color in overlay.LABEL_COLORS[:4]]
    assert shown == [False, True, False, False], "only what is in the picture is named"


def test_cast_shadow_is_hatched_and_named():
    """Half of the shaded pixels keep their label's colour; where there is no shadow all do."""
    labels = np.full((300, 300), SKIN, np.uint8)
    shadow = np.zeros(labels.shape, np.float32)
    shadow[:150] = 0.9
    photo = np.full((300, 300, 3), GRAY, np.uint8)
    plain_drawn = overlay.draw_labels(photo, labels)
    drawn = overlay.draw_labels(photo, labels, shadow)
    side = drawn.shape[1]
    assert drawn.shape[1] == plain_drawn.shape[1] and drawn.shape[0] >= side
    changed = (drawn[:side] != plain_drawn[:side]).any(-1)
    assert 0.4 < changed[: side // 2 - 5].mean() < 0.6
    assert not changed[side // 2 + 5 : side - 5].any()
    legends = (picture[side:] for picture in (drawn, plain_drawn))
    assert [(strip == overlay.SHADED).all(-1).any() for strip in legends] == [True, False]


def test_colours_differ():
    for colors in (overlay.LABEL_COLORS, np.array([color for *_, color in overlay.GROUPS])):
        apart = np.abs(colors[:, None].astype(int) - colors[None]).sum(-1)
        assert apart[np.triu_indices(len(colors), 1)].min() > 60


def test_indexed_png_holds_the_labels():
    labels = np.random.default_rng(0).integers(0, len(LABELS), (31, 17)).astype(np.uint8)
    data = encode_labels(labels, overlay.LABEL_COLORS)
    picture = Image.open(io.BytesIO(data))
    assert picture.mode == "P" and data == encode_labels(labels, overlay.LABEL_COLORS)
    np.testing.assert_array_equal(np.asarray(picture), labels)
    np.testing.assert_array_equal(np.asarray(picture.convert("RGB")), overlay.LABEL_COLORS[labels])
