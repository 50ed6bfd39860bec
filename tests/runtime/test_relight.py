"""An avatar in another light."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from bakery.formats.light import read_light
from bakery.geometry import harmonics, rotation
from bakery.geometry.color import LUMA
from bakery.runtime.relight import posed, shine, unlit
from bakery.runtime.render import draw
from bakery.stages.condition import face_camera
from bakery.types import EXPRESSIONS

STILL = np.zeros(len(EXPRESSIONS), np.float32)


def in_light(avatar, light, turn=(0.1, -0.2, 0.05)):
    """The avatar as photographed in a light, the head a little turned."""
    camera = replace(avatar.fit.camera, rotation=np.array(turn))
    return replace(avatar, fit=replace(avatar.fit, light=light, camera=camera))


def frame(avatar, light=None, yaw=0.0, hair=True):
    camera = face_camera(avatar.fit, avatar.head, avatar.neutral, yaw, 0, 160)
    return draw(avatar, avatar.neutral, camera, STILL, np.zeros(2), True, hair, light)


@pytest.fixture(scope="module")
def even():
    light = np.zeros((9, 3))
    light[0] = 1 / harmonics.C0
    return light


@pytest.fixture(scope="module")
def slanting():
    """Stays between the bounds of `unwrap.shading` at every normal."""
    light = np.zeros((9, 3))
    light[0], light[1], light[3] = 1 / harmonics.C0, 0.15, 0.2
    return light


def test_neutral_light_changes_nothing_of_a_photo_in_even_light(noise_avatar, even):
    avatar = in_light(noise_avatar, even)
    before, after = frame(avatar), frame(avatar, read_light("neutral"))
    assert_allclose(after.color, before.color, atol=2e-5)
    assert np.array_equal(after.alpha, before.alpha) and np.array_equal(after.face, before.face)


def test_the_photos_own_light_gives_the_picture_back(noise_avatar, slanting):
    """What was divided out is put in again: the same picture, but for how bright it is."""
    avatar = in_light(noise_avatar, slanting)
    turn = rotation.matrix(avatar.fit.camera.rotation)
    own = harmonics.turned(slanting, turn.T)
    before, after = frame(avatar), frame(avatar, own)
    whole = before.alpha > 0.999
    ratio = after.color[whole] / np.maximum(before.color[whole], 1e-3)
    # Texels were divided by the shade at their own normals, pixels are lit at theirs.
    middle = np.median(ratio)
    assert np.percentile(np.abs(ratio / middle - 1), 90) < 0.02
    assert np.corrcoef(before.color[whole].ravel(), after.color[whole].ravel())[0, 1] > 0.999


def test_neutral_light_takes_the_slant_out_and_keeps_the_level(noise_avatar, slanting):
    """Two photos of one skin, in even and in slanting light, are one picture in neutral light."""
    from bakery.stages.atlas import make_atlas
    from bakery.stages.texture.unwrap import photo_shade

    avatar = in_light(noise_avatar, slanting)
    bare = replace(avatar, textures=replace(avatar.textures, hair=avatar.textures.hair * 0))
    atlas = make_atlas(bare.head, len(bare.textures.neutral)).take("skin")
    shade = photo_shade(bare.fit, bare.head, posed(bare), atlas)
    albedo = np.asarray(bare.textures.neutral, np.float32)
    shown = albedo.reshape(-1, 3).copy()
    shown[atlas.index] *= shade
    shown = shown.reshape(albedo.shape).astype(np.float16)
    lit = replace(bare, textures=replace(bare.textures, neutral=shown))
    found = shown * unlit(lit).skin
    seen = atlas.paint(np.ones(len(atlas.index), bool))
    assert_allclose(found[seen], albedo[seen], rtol=2e-3, atol=1e-3)  # half floats
    known = seen & np.isin(lit.textures.source, (1, 2))
    neutral = found[known] * unlit(lit).exposure
    assert (neutral @ LUMA).mean() == pytest.approx((shown[known] @ LUMA).mean(), rel=1e-3)


def test_a_light_stays_when_the_camera_goes_round(noise_avatar, even):
    """A lamp on the subject's left lights the left side of the head from wherever it is seen."""
    avatar = in_light(noise_avatar, even)
    lamp = read_light("neutral") * 0.3 + harmonics.lamp(np.array([1.0, 0, 0]), np.ones(3))

    def gain(yaw):
        before, after = (frame(avatar, light, yaw, False) for light in (None, lamp))
        whole = before.alpha > 0.999
        return after.color[whole].sum() / before.color[whole].sum()

    left, right = gain(-80.0), gain(80.0)
    assert max(left, right) > 2 * min(left, right)
    before, after = frame(avatar, None, 0.0, False), frame(avatar, lamp, 0.0, False)
    half = before.color.shape[1] // 2  # the subject's left is on the picture's right
    ratio = [
        after.color[:, side].sum() / before.color[:, side].sum()
        for side in (np.s_[:half], np.s_[half:])
    ]
    assert ratio[1] > 1.5 * ratio[0]


def test_no_side_is_black_behind_a_lamp():
    z = -8 / 15  # where second order swings lowest
    normals = np.array([[0, 0, 1.0], [np.sqrt(1 - z * z), 0, z]])
    lamp = harmonics.lamp(np.array([0, 0, 1.0]), np.ones(3))
    assert harmonics.irradiance(normals, lamp).min() < -0.03
    assert shine(normals, lamp).min() > 0


def test_highlights_and_the_lights_colour_go_where_there_is_albedo(noise_avatar, slanting):
    """The skin shows albedo times the new light; eyes and hair lose the same colour."""
    from bakery.stages.atlas import make_atlas
    from bakery.stages.texture.unwrap import photo_shade

    avatar = in_light(noise_avatar, slanting)
    size = len(avatar.textures.neutral)
    atlas = make_atlas(avatar.head, size).take("skin")
    seen = atlas.paint(np.ones(len(atlas.index), bool))
    shade = atlas.paint(photo_shade(avatar.fit, avatar.head, posed(avatar), atlas), 1)
    color, gloss = np.array([1.2, 1.0, 0.7]), np.zeros((size, size, 1))
    gloss[::9, ::7] = 0.3
    albedo = (0.2 + 0.3 * np.asarray(avatar.textures.neutral, np.float64)).astype(np.float16)
    shown = (albedo * shade * color + gloss).astype(np.float16)
    # The hair layer: dark hair on one half, on the other the skin beside it.
    strip = np.arange(size) < size // 2
    layer = np.where(strip[:, None], 1.1, 0.2) * np.float32(shown)
    layer = np.dstack([0.9 * layer, np.full((size, size), 0.9)]).astype(np.float16)
    textures = replace(avatar.textures, neutral=shown, albedo=albedo, hair=layer)
    bare = unlit(replace(avatar, textures=textures))
    assert_allclose((shown * bare.skin)[seen], albedo[seen], rtol=3e-3)  # half floats
    assert_allclose(bare.white, 1 / color, rtol=0.02)  # the median over texels, of which some gleam
    hairy = seen & ~strip
    assert_allclose(bare.hair[hairy], (bare.white / shade)[hairy], rtol=1e-5)
    assert_allclose(bare.hair[seen & strip], bare.skin[seen & strip], rtol=1e-5)
    known = seen & np.isin(textures.source, (1, 2))
    kept = (np.float32(albedo)[known] @ LUMA).mean() * bare.exposure
    assert kept == pytest.approx((np.float32(shown)[known] @ LUMA).mean(), rel=5e-3)
