"""What of a photo may become skin."""

from dataclasses import fields
from types import SimpleNamespace

import cv2
import numpy as np
from numpy.testing import assert_allclose

from bakery.geometry import harmonics
from bakery.geometry.mesh import vertex_normals
from bakery.geometry.sample import bilinear
from bakery.landmarks import BROWS, CHIN, EYE_LEFT, EYE_RIGHT, LIPS_INNER
from bakery.stages.atlas import make_atlas
from bakery.stages.texture.hair import Mattes
from bakery.stages.texture.occlusion import openness
from bakery.stages.texture.shadows import penumbra
from bakery.stages.texture.unwrap import (
    AHEAD,
    CONTRAST,
    FALLOFF,
    SHELTERED,
    bearded,
    inner_face,
    open_lids,
    photo_light,
    photo_shade,
    rims,
    shading,
    up_to_hair,
    without_worse,
)
from bakery.types import Camera


def eye_points():
    """Two round eyes of radius 10 at (40, 50) and (90, 50), and lips at (65, 100)."""
    points = np.zeros((478, 2))
    for ring, center in ((EYE_RIGHT, (40, 50)), (EYE_LEFT, (90, 50)), (LIPS_INNER, (65, 100))):
        turn = np.linspace(0, 2 * np.pi, len(ring), endpoint=False)
        points[ring] = np.stack([np.cos(turn), np.sin(turn)], 1) * 10 + center
    return points


def test_lids_open_up_to_their_edge():
    none = np.zeros((130, 130), np.float32)
    mask = open_lids(none, eye_points(), none)
    assert mask[50, 40] == 0, "the eye itself is no skin"
    assert mask[38, 40] == 1, "the lid above it is"
    assert mask[20, 40] == 0, "the brow is left to the segmentation"
    assert open_lids(none, eye_points(), none + 1).max() == 0, "nor does a lid behind dark glass"


def test_rims_are_along_lids_and_lips():
    near = rims(eye_points(), (130, 130))
    assert near[50, 50] > 0.9 and near[100, 75] > 0.9
    assert near[50, 40] == 0 and near[75, 65] == 0


def test_only_the_hard_edge_of_a_shadow_is_left_out():
    shadow = np.zeros((512, 512), np.float32)
    shadow[200:300, 200:300] = 1
    whole = np.ones_like(shadow)
    dark = cv2.GaussianBlur(np.exp(-2 * shadow), (0, 0), 1)[..., None] * np.float32([0.4, 0.3, 0.2])
    edge = penumbra(shadow, dark, whole)
    assert edge[200, 250] == edge[299, 250] == edge[250, 199] == 1
    assert edge[250, 250] == edge[190, 250] == edge[0, 0] == 0
    assert penumbra(0 * shadow, dark, whole).max() == 0
    soft = dark**0.1  # shade below a fringe: the same outline, a step of 0.2 in the logarithm
    assert penumbra(shadow, soft, whole).max() == 0


def test_brows_count_up_to_hair(head):
    size, nothing = 128, np.zeros((64, 64), np.float32)
    atlas = make_atlas(head, size).take("skin")
    middle = np.full((len(atlas.index), 2), 32.0)

    def found(**layers):
        every = {field.name: nothing for field in fields(Mattes)} | layers
        return atlas.paint(up_to_hair(Mattes(**every), head, atlas, middle))

    x, y = head.landmark_uv()[BROWS].mean(0) * size
    brow = int(y), int(x)
    one = nothing + 1
    assert found(strip=one, dark=one)[brow] > 0.99 and found(shadow=one, dark=one)[brow] > 0.99
    assert found(dark=one)[brow] == 0, "what is no skin stays none"
    assert found(strip=one)[brow] == 0, "strands may lie on plain skin"
    assert found(strip=one, dark=one, occluder=one)[brow] == 0
    assert found(strip=one, dark=one)[:, : size // 8].max() == 0, "beyond the face it stays out"


def one_lamp(azimuth, ambient=0.0):
    """Irradiance [9, 3] of a lamp (degrees to the subject's left of the camera) and light all around."""
    angle = np.radians(azimuth)
    at = np.array([np.sin(angle), 0, np.cos(angle)])
    light = (harmonics.basis(at) * harmonics.COSINE / np.pi)[:, None] * np.ones(3)
    light[0] += ambient / harmonics.C0
    return light


def test_a_lamp_from_one_side_leaves_no_half_in_the_dark():
    for azimuth in (-80, 45, 90):
        bare = (harmonics.irradiance(AHEAD, one_lamp(azimuth)))[:, 0]
        assert bare.max() > 4 * max(bare.min(), 0), "the lamp is hard"
        kept = shading(AHEAD, one_lamp(azimuth))[:, 0]
        assert 1.2 < kept.max() / kept.min() < CONTRAST + 0.05
        assert (np.argsort(kept) == np.argsort(bare)).all()
    around = np.stack([np.sin(t := np.linspace(0, 2 * np.pi, 90)), 0 * t, np.cos(t)], 1)
    steps = np.diff(np.log(shading(around, one_lamp(90))[:, 0]))
    assert np.abs(steps).max() < 0.08, "no edge where the light ends"


def test_soft_light_is_shaded_as_it_is():
    light = one_lamp(20, ambient=3.0)
    bare = (harmonics.irradiance(AHEAD, light) / harmonics.irradiance(AHEAD[0], light))[:, 0]
    np.testing.assert_allclose(shading(AHEAD, light)[:, 0], bare, rtol=0.02)


def test_dark_hair_below_the_nose_is_no_shadow(head):
    size = 256
    skin, whole = np.tile([0.35, 0.2, 0.12], (size, size, 1)), np.ones((size, size), np.float32)
    chin = head.landmark_uv()[CHIN].mean(0) * size
    y, x = np.mgrid[:size, :size] + 0.5
    patch = (np.hypot(x - chin[0], y - chin[1] + 12) < 10)[..., None]
    inner = (np.hypot(x - chin[0], y - chin[1] + 12) < 6) & (y < chin[1] - 8)
    for color, hair in (([0.06, 0.055, 0.05], 1), ([0.12, 0.06, 0.03], 0)):  # black; skin in shadow
        albedo = np.where(patch, color, skin).astype(np.float32)
        found = bearded(albedo, whole, head)
        assert np.abs(found[inner] - hair).max() < 0.1
        assert found[~patch[..., 0] & (np.hypot(x - chin[0], y - chin[1] + 12) > 14)].max() < 0.01
    top = np.where(patch[::-1], [0.06, 0.055, 0.05], skin).astype(np.float32)
    assert not bearded(top, whole, head)[: size // 3].any(), "hair on the forehead is none of it"
    assert not bearded(top, 0 * whole, head).any(), "nothing is seen"


def test_the_far_side_of_a_nose_is_left_to_the_near_one():
    face, weight, cosine = np.ones((4, 8)), np.ones((4, 8)), np.full((4, 8), 0.8)
    cosine[:, 1] = 0.3  # its mirror image, column 6, is seen squarely
    cosine[:, [0, 7]] = 0.3, 0.4  # both halves at a slant
    weight[3, 6] = 0  # nor is there anything to take
    face[2] = 0
    out = without_worse(weight, cosine, face)
    assert (out[:2, 1] == 0).all() and (out[2:, 1] == 1).all()
    out[:2, 1], out[3, 6] = 1, 1
    assert (out == 1).all()


def test_light_falls_off_no_further_beside_the_face(head):
    """What faces the camera is as lit as in the photo; ears hardly less than the rim of the face.

    Below the jaw it is dark, at any light of the photo's.
    """
    ahead = Camera(1000.0, np.full(2, 256.0), np.zeros(3), np.array([0, 0, -600.0]), 512, 512)
    fit = SimpleNamespace(camera=ahead, light=one_lamp(20, ambient=0.3))
    atlas = make_atlas(head, 256).take("skin")
    shade = atlas.paint(photo_shade(fit, head, head.mean, atlas), 1)
    light = photo_light(fit, head, head.mean, atlas)
    on_skin = atlas.paint(np.ones(len(atlas.index))) > 0
    assert np.all(light[~on_skin] == 1)
    square = atlas.paint(atlas.at(vertex_normals(head.mean, head.faces))[:, 2]) > 0.85
    middle = (inner_face(head, 256, 1.0) > 0.99) & square
    assert middle.any()
    assert_allclose(light[middle], shade[middle], rtol=1e-5)
    everywhere, above = atlas.paint(atlas.at(np.stack(openness(head, head.mean), 1))).transpose(
        2, 0, 1
    )
    beside = on_skin & (inner_face(head, 256, 1.0) < 0.01)
    sides = beside & (above > everywhere)
    dark = sides & (np.log(shade[..., 0]) < -0.5)
    assert dark.any()
    gain = np.log(light[dark] / shade[dark])
    assert gain.min() > 0.03  # shading is 0.69 darker at most, rims about 0.4
    assert light[sides].max() < light[middle].max() * np.exp(FALLOFF)
    height = atlas.paint(atlas.at(head.mean)[:, 1])
    jaw = beside & (above < 0.5) & (everywhere > 0.7) & (height < head.landmarks(head.mean)[152, 1])
    assert jaw.sum() > 100 and np.median(light[jaw]) < 0.65 * np.median(light[sides])
    assert light[jaw].min() > SHELTERED * light[sides].min()


def test_light_from_a_side_has_no_edge_at_the_back(head):
    """The head is cut open there: both borders of its chart are one place."""
    ahead = Camera(1000.0, np.full(2, 256.0), np.zeros(3), np.array([0, 0, -600.0]), 512, 512)
    fit = SimpleNamespace(camera=ahead, light=one_lamp(60, ambient=0.2))
    atlas = make_atlas(head, 256).take("skin")
    light = atlas.fill_gutter(photo_light(fit, head, head.mean, atlas))[..., 0]
    faces = head.part_faces("skin")
    corners = np.stack([head.faces[faces], head.uv_faces[faces]], -1).reshape(-1, 2)
    vertices, places = np.unique(corners, axis=0).T
    cut = np.flatnonzero(np.diff(vertices) == 0)  # those that have two places
    at = bilinear(light, head.uv[places] * 256)
    back = head.mean[vertices[cut], 2] < -20
    assert back.sum() > 10
    gap = np.abs(np.log(at[cut] / at[cut + 1]))[back]
    assert gap.max() < 0.1
    assert np.log(np.percentile(light, 95) / np.percentile(light, 5)) > 0.5, "its sides differ"
