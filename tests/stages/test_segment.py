"""Segmentation of painted faces with known answers, and of real ones where they are at hand."""

import cv2
import numpy as np
import pytest

from bakery import landmarks
from bakery.errors import FitError
from bakery.stages.segment import (
    BACKGROUND,
    CLOTHES,
    EYES,
    GLASSES,
    HAIR,
    HIDDEN,
    LABELS,
    SKIN,
    Segmentation,
    SegmentOptions,
    occlusion,
    prior,
)
from bakery.stages.segment import segment as label
from bakery.stages.segment.models import GuidedFilter, histogram

SIDE = 480
BY_COLOURS = SegmentOptions(method="colours")  # these faces are too plain for the network
CENTER = np.array([240.0, 230.0])
WIDTH, HEIGHT = 80.0, 100.0  # half axes of the painted face, pixels
SKIN_COLOR = (0.80, 0.60, 0.50)
HAIR_COLOR = (0.22, 0.15, 0.10)


def segment(picture, points):
    return label(picture, points, BY_COLOURS)


def ring(indices, center, half_width, half_height, start=-90.0):
    """Points of a contour on an ellipse, clockwise in the picture from the top."""
    turn = np.radians(start + 360 * np.arange(len(indices)) / len(indices))
    return np.array(center) + np.stack([half_width * np.cos(turn), half_height * np.sin(turn)], -1)


def face_points():
    """478 points of the painted face; only those that the segmentation reads are meaningful."""
    points = np.tile(CENTER, (478, 1))
    points[landmarks.OVAL] = ring(landmarks.OVAL, CENTER, WIDTH, HEIGHT)
    for contour, side in ((landmarks.EYE_RIGHT, -1), (landmarks.EYE_LEFT, 1)):
        eye = CENTER + [side * 34, -20]
        points[list(contour)] = ring(contour, eye, 15, 6, start=180 if side < 0 else 0)
    for contour, side in ((landmarks.BROW_RIGHT, -1), (landmarks.BROW_LEFT, 1)):
        points[list(contour)] = ring(contour, CENTER + [side * 34, -38], 20, 4)
    points[landmarks.LIPS_OUTER] = ring(landmarks.LIPS_OUTER, CENTER + [0, 50], 26, 10)
    points[landmarks.LIPS_INNER] = ring(landmarks.LIPS_INNER, CENTER + [0, 50], 16, 3)
    points[2] = CENTER + [0, 28]
    points[195] = CENTER + [0, 2]
    return points


def paint(skin=SKIN_COLOR, hair=HAIR_COLOR, background=(0.55, 0.65, 0.75), fringe=False):
    """A face with neck, hair and shirt; returns the picture and where skin may be found."""
    rng = np.random.default_rng(7)
    picture = np.empty((SIDE, SIDE, 3), np.float32)
    picture[:] = background
    center = tuple(CENTER.astype(int).tolist())
    cv2.ellipse(picture, (240, 205), (105, 115), 0, 0, 360, hair, -1)
    head = np.zeros((SIDE, SIDE), np.uint8)
    cv2.rectangle(head, (195, 290), (285, 400), 1, -1)
    cv2.ellipse(head, center, (int(WIDTH), int(HEIGHT)), 0, 0, 360, 1, -1)
    shirt = np.zeros_like(head)
    cv2.rectangle(shirt, (60, 385), (420, SIDE), 1, -1)
    head[shirt > 0] = 0
    if fringe:
        head[:178, :] = 0
    hair_area = (np.abs(picture - np.float32(hair)).max(-1) < 0.01) & (head == 0) & (shirt == 0)
    picture[shirt > 0] = (0.15, 0.35, 0.25)
    picture[head > 0] = skin
    picture[hair_area] *= 1 + 0.5 * rng.standard_normal((int(hair_area.sum()), 1), np.float32)
    if fringe:
        picture[130:178, 170:310] = hair
        picture[130:178, 170:310] *= 1 + 0.5 * rng.standard_normal((48, 140, 1), np.float32)
    picture += 0.008 * rng.standard_normal(picture.shape, np.float32)
    points = face_points()
    for contour in (
        landmarks.EYE_RIGHT,
        landmarks.EYE_LEFT,
        landmarks.BROW_RIGHT,
        landmarks.BROW_LEFT,
    ):
        cv2.fillPoly(picture, [points[list(contour)].astype(np.int32)], (0.2, 0.15, 0.12))
    return np.clip(picture, 0, 1), head > 0


@pytest.mark.parametrize(
    ("skin", "hair"),
    [
        (SKIN_COLOR, HAIR_COLOR),
        ((0.30, 0.20, 0.15), (0.07, 0.06, 0.06)),
        (SKIN_COLOR, (0.62, 0.5, 0.28)),
    ],
    ids=["dark hair", "dark skin", "blond"],
)
def test_painted_face(skin, hair):
    """Face and neck are found whole, and nothing else is."""
    picture, truth = paint(skin, hair)
    result = segment(picture, face_points())
    inner = cv2.erode(truth.astype(np.uint8), np.ones((25, 25), np.uint8)) > 0
    assert (result.skin[inner] > 0.5).mean() > 0.98
    assert (result.skin[~truth] > 0.1).mean() < 0.001
    assert result.labels[100, 240] == HAIR
    assert result.labels[20, 20] == BACKGROUND
    assert result.labels[210, 206] == EYES


def test_no_background_at_the_rim():
    """A white wall behind the jaw leaves no pale pixel in the mask."""
    picture, truth = paint(background=(0.97, 0.97, 0.97))
    result = segment(picture, face_points())
    assert result.skin[picture.min(-1) > 0.9].max() < 0.05
    assert result.skin[truth].mean() > 0.85


def test_fringe_is_not_skin():
    picture, truth = paint(fringe=True)
    result = segment(picture, face_points())
    assert (result.skin[140:172, 180:300] > 0.2).mean() < 0.02
    assert occlusion(result, face_points())["forehead_hair"] > 0.3
    bare = occlusion(segment(paint()[0], face_points()), face_points())
    assert bare["forehead_hair"] < 0.05
    assert bare["glasses"] == 0


def test_glasses():
    """Drawn frames are found and left out; a bare face has none."""
    picture, _ = paint()
    for side in (-1, 1):
        eye = tuple((CENTER + [side * 34, -17]).astype(int).tolist())
        cv2.ellipse(picture, eye, (26, 21), 0, 0, 360, (0.05, 0.05, 0.05), 3)
        if side > 0:  # a window in one lens, below the eye
            cv2.rectangle(
                picture, (eye[0] - 8, eye[1] + 9), (eye[0] + 8, eye[1] + 15), (0.8, 0.9, 1), -1
            )
    cv2.line(picture, (232, 208), (248, 208), (0.05, 0.05, 0.05), 3)
    result = segment(picture, face_points())
    window, bare = (tuple(CENTER + [side * 34, -5]) for side in (1, -1))
    assert result.labels[int(window[1]), int(window[0])] == GLASSES, "what a lens mirrors"
    assert result.labels[int(bare[1]), int(bare[0])] == SKIN
    assert occlusion(result, face_points())["glasses"] > 0.1
    assert result.labels[208, 240] == GLASSES
    assert result.skin[208, 240] < 0.2


@pytest.mark.parametrize("factor", [0.4, 2.5])
def test_scale_and_turn(factor):
    """Half the picture or a turned one gives the same mask, resized and turned."""
    picture, _ = paint()
    middle = segment(picture, face_points()).skin
    turn = cv2.getRotationMatrix2D((240, 240), 25, factor)
    turn[:, 2] += (factor - 1) * 240
    side = int(SIDE * factor)
    moved = cv2.warpAffine(picture, turn, (side, side), borderMode=cv2.BORDER_REPLICATE)
    points = (face_points() - 0.5) @ turn[:, :2].T + turn[:, 2] + 0.5
    result = segment(moved, points).skin
    wanted = cv2.warpAffine(middle, turn, (side, side))
    assert ((result > 0.5) != (wanted > 0.5)).mean() < 0.01  # rims move by a pixel or two


def test_face_cut_by_the_border():
    """A face that fills the photo still gets a mask of the photo's shape."""
    picture, truth = paint()
    part = np.ascontiguousarray(picture[140:330, 165:315])
    result = segment(part, face_points() - [165, 140])
    assert result.labels.shape == part.shape[:2]
    assert (result.skin[50:150, 40:110] > 0.5).mean() > 0.98


def test_bad_input():
    picture, _ = paint()
    with pytest.raises(ValueError, match="points: shape"):
        segment(picture, np.zeros((68, 2)))
    with pytest.raises(FitError, match="smaller than a pixel"):
        segment(picture, np.zeros((478, 2)))
    with pytest.raises(FitError, match="outside the photo"):
        segment(picture, face_points() + 10000)
    with pytest.raises(ValueError, match="encoded: shape"):
        segment(picture[..., 0], face_points())
    with pytest.raises(ValueError, match="Segmentation.skin"):
        Segmentation(np.zeros((2, 2), np.uint8), np.zeros((3, 2), np.float32))


def test_class_shares_are_shares():
    contour = face_points()[landmarks.OVAL]
    to_frame = prior.face_frame(face_points())
    angle, radius = prior.polar(contour @ to_frame[:, :2].T + to_frame[:, 2])
    shares = prior.class_shares(angle, radius)
    assert shares.min() >= 0
    assert shares.sum(0).max() <= 1 + 2 / 35  # rounding of the tables
    assert shares[0, 190, 200] == 1  # the middle of the face is skin
    assert (
        0.95 < radius[190, 200 + int(70 * np.sqrt(0.8))] < 1.05
    )  # half the width, 0.8 of the height


def test_guided_filter_keeps_linear_maps():
    """A map that is a linear function of the guide passes unchanged, whatever the window."""
    guide = np.random.default_rng(0).random((3, 40, 50), np.float32)
    plane = 0.5 * guide[0] - 0.2 * guide[1] + 0.3
    smooth = GuidedFilter(guide, 3, 1e-7)(plane)
    np.testing.assert_allclose(smooth, plane, atol=1e-3)  # float32 covariances


def test_histogram_is_a_distribution():
    bins = np.random.default_rng(0).integers(0, 60, (20, 20))
    colors = histogram(bins, np.ones((20, 20), np.float32), (3, 4, 5))
    assert colors.shape == (60,)
    np.testing.assert_allclose(colors.sum(), 1, rtol=1e-5)
    assert histogram(bins, np.zeros((20, 20), np.float32), (3, 4, 5)).sum() == 0


@pytest.mark.parametrize("name", ["london/train/017_neutral.jpg", "london/train/061_smiling.jpg"])
def test_real_face(shared, name):
    """The inside of a real face is skin; the corners of the photo are not."""
    folder = shared / "portraits"
    encoded = cv2.imread(str(folder / name))[..., ::-1].astype(np.float32) / 255
    table = np.load(folder / "dense478.npz")
    points = table["points"][list(table["names"]).index(name)][:, :2]
    result = segment(encoded, points)
    inside = [50, 280, 205, 425, 1, 4, 152, 199, 9, 151, 117, 346]  # cheeks, nose, chin, forehead
    columns, rows = points[inside].astype(int).T
    assert np.isin(result.labels[rows, columns], [SKIN, LABELS.index("lips")]).all()
    assert result.skin[:100].max() == 0


@pytest.mark.parametrize("wall", ["black", "wood", "clutter"])
def test_the_wall_does_not_matter(shared, wall):
    """Another background and a dyed shirt change the mask of a real face by little."""
    rng = np.random.default_rng(3)
    folder = shared / "portraits"
    table = np.load(folder / "dense478.npz")
    for name in ("017_neutral", "081_neutral", "099_smiling", "129_neutral"):
        name = f"london/train/{name}.jpg"
        encoded = cv2.imread(str(folder / name))[..., ::-1].astype(np.float32) / 255
        points = table["points"][list(table["names"]).index(name)][:, :2]
        before = segment(encoded, points)
        shape = encoded.shape[:2]
        if wall == "black":
            other = np.full((*shape, 3), 0.03, np.float32)
        elif wall == "wood":  # streaks in the hue of skin and hair
            grain = cv2.resize(rng.standard_normal((8, 200)).astype(np.float32), shape[::-1])
            other = np.float32([0.42, 0.27, 0.16]) * (1 + 0.3 * grain[..., None])
        else:
            other = 0.45 + 0.25 * sum(
                cv2.resize(rng.standard_normal((n, n, 3)).astype(np.float32), shape[::-1])
                for n in (4, 12, 40, 120)
            )
        behind = cv2.GaussianBlur((before.labels == BACKGROUND).astype(np.float32), (0, 0), 1.2)
        behind = behind[..., None]
        dyed = np.where((before.labels == CLOTHES)[..., None], np.float32([0.3, 0.5, 0.2]), 1)
        after = segment(np.clip(encoded * dyed * (1 - behind) + other * behind, 0, 1), points)
        face = before.skin > 0.5
        person = cv2.dilate(np.isin(before.labels, (1, 5, 6, 7)).astype(np.uint8), np.ones((3, 3)))
        assert ((after.skin > 0.5) & (person == 0)).sum() < 0.005 * face.sum()  # measured 0.001
        assert (face & (after.skin < 0.5)).sum() < 0.06 * face.sum()  # measured 0.05


def test_dark_glasses():
    """Grey discs over both eyes are lenses, reflection and all; a shadow that keeps its hue is none."""
    for color, found in (((0.1, 0.1, 0.1), True), (None, False)):
        picture, _ = paint()
        for side in (-1, 1):
            eye = tuple((CENTER + [side * 34, -17]).astype(int).tolist())
            disc = np.zeros(picture.shape[:2], np.uint8)
            cv2.ellipse(disc, eye, (28, 22), 0, 0, 360, 1, -1)
            picture[disc > 0] = color or picture[disc > 0] * 0.45
            if color:
                cv2.circle(picture, (eye[0] + 6, eye[1] - 4), 4, (0.9, 0.9, 0.9), -1)
        result = segment(picture, face_points())
        assert (result.labels[disc > 0] == GLASSES).all() == found
        assert (result.skin[disc > 0] == 0).all() == found


def test_one_side_hidden():
    """Hair before one half of the face is left out there; before both halves it is let be."""
    picture, _ = paint()
    dark = picture[100, 240].copy()
    picture[150:250, 250:320] = dark
    result = segment(picture, face_points())
    assert result.labels[215, 280] == HIDDEN and result.skin[215, 280] == 0
    assert result.labels[225, 200] == SKIN and result.skin[225, 200] > 0.9
    assert 0.1 < occlusion(result, face_points())["hidden"] < 0.5
    picture[150:250, 160:320] = dark
    assert not (segment(picture, face_points()).labels == HIDDEN).any()
