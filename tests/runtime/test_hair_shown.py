"""Hair with volume in what people ask for: without a background, over the photo, in another light."""

from dataclasses import replace

import numpy as np
import pytest

from bakery.geometry.color import to_encoded, to_linear
from bakery.geometry.fill import enclosed
from bakery.motion.animate import AnimationPlayer, RenderSettings
from bakery.runtime.contact_sheet import contact_sheet
from bakery.runtime.player import Player
from bakery.runtime.render import draw, portrait_at
from bakery.show.frame import Scene, draw_scene
from bakery.stages.condition import face_camera

STILL, AHEAD = np.zeros(52, np.float32), np.zeros(2)
SCENE = Scene(STILL, AHEAD, None, (30.0, 0.0), 160, True, background="none")


@pytest.fixture(scope="module")
def dressed(noise_avatar, hairdo):
    mesh = hairdo(noise_avatar.head, noise_avatar.neutral)
    return replace(noise_avatar, textures=replace(noise_avatar.textures, hair_mesh=mesh))


def test_gaps_between_locks_stay_clear(dressed):
    """Nothing is seen through the eyes' slits into the empty head, but much between hair and neck."""
    picture, _ = draw_scene(dressed, SCENE)
    gaps = enclosed(picture[..., 3] < 0.999)  # such as would be filled in a head without hair
    assert gaps.sum() > 20
    bald, _ = draw_scene(dressed, replace(SCENE, hair=False))
    assert not enclosed(bald[..., 3] < 0.999).any()
    assert (picture[..., :3].max(-1) <= picture[..., 3] + 0.1).all()  # multiplied by alpha


def test_alpha_is_the_coverage_of_the_hair(dressed):
    scene = replace(SCENE, framing="face")
    camera = face_camera(dressed.fit, dressed.head, dressed.neutral, 30.0, 0.0, 160, 0.6)
    vertices = dressed.head.vertices(dressed.neutral, STILL, AHEAD)
    frame = draw(dressed, vertices, camera, STILL, AHEAD)
    bare = draw(dressed, vertices, camera, STILL, AHEAD, hair=False)
    picture, _ = draw_scene(dressed, scene)
    beside = ~enclosed(bare.alpha < 1)
    np.testing.assert_array_equal(picture[beside, 3], frame.alpha[beside])
    half = (frame.alpha > 0.2) & (frame.alpha < 0.8) & (bare.alpha == 0)
    assert half.sum() > 100


@pytest.mark.parametrize("source", [1, 3])
def test_over_the_photo_hair_is_mixed_by_its_alpha(dressed, source):
    """At the photo's own pose no rim of another colour, beside the head and where its skin is made up."""
    kind = np.full_like(dressed.textures.source, source)
    avatar = replace(dressed, textures=replace(dressed.textures, source=kind))
    fit = avatar.fit
    vertices = avatar.head.vertices(avatar.neutral, fit.expression, fit.gaze)
    frame = draw(avatar, vertices, fit.camera, fit.expression, fit.gaze, apart=True)
    scene = Scene(fit.expression, fit.gaze, None, "photo", None, True)
    picture, face = draw_scene(avatar, scene)
    flat = replace(avatar, textures=replace(avatar.textures, hair_mesh=None))
    bald, _ = draw_scene(flat, scene)
    alpha = frame.hair[..., 3:]
    own = frame.hair[..., :3] / np.maximum(alpha, 1e-6)
    wanted = to_linear(to_encoded(bald) * (1 - alpha) + to_encoded(own) * alpha)
    uncapped = frame.hair[..., 3] < 0.9  # behind the cap another head is drawn
    assert (uncapped & (frame.hair[..., 3] > 0.1)).sum() > 1000
    assert (np.abs(picture - wanted)[uncapped] > 2e-3).mean() < 1e-3  # the rim of the cap
    np.testing.assert_array_equal(bald[alpha[..., 0] == 0], picture[alpha[..., 0] == 0])
    if source == 3:  # all that shows is photo, eyes, mouth and hair
        _, photo = portrait_at(avatar, fit.camera)
        rest = (alpha[..., 0] == 0) & (face == 0)
        assert rest.sum() > 1000
        np.testing.assert_allclose(picture[rest], photo[rest], atol=5e-3)


def test_the_mask_of_the_face_is_what_hair_leaves_of_it(dressed):
    """Alike whether hair is laid over the head or, with it, over the photo."""
    fit = dressed.fit
    scene = Scene(fit.expression, fit.gaze, None, "photo", None, True)
    masks = [draw_scene(dressed, replace(scene, background=kind))[1] for kind in ("photo", "gray")]
    flat = replace(dressed, textures=replace(dressed.textures, hair_mesh=None))
    bald = draw_scene(flat, scene)[1]
    assert np.abs(masks[0] - masks[1]).mean() < 2e-3
    assert all((mask <= bald + 1e-6).all() and mask.sum() < 0.9 * bald.sum() for mask in masks)


def test_a_take_over_the_photo_keeps_the_hair(dressed, short_take):
    """As `render --view photo`: the fast player's hair is laid over the photo too."""
    settings = RenderSettings(view="photo", size=200, rate=None, first=0, last=None, dynamic=True,
                              hair=True, film=False)  # fmt: skip
    shown = []
    for hair in (True, False):
        player = AnimationPlayer(dressed, short_take, replace(settings, hair=hair))
        camera = player.camera
        shown.append(player.picture(player.player.workspace(camera.width, camera.height), 0))
    scene = Scene(player.weights[0], player.gaze[0], None, "photo", 200, True)
    reference = np.round(to_encoded(draw_scene(dressed, scene)[0]) * 255)
    assert (np.abs(shown[0].astype(int) - shown[1]).max(-1) > 20).mean() > 0.1
    apart = np.abs(shown[0] - reference).max(-1)
    assert (apart > 3).mean() < 2e-3


def test_hair_turns_with_the_head_whatever_hangs(dressed, short_take):
    """The bust turns as a whole, as the camera's motion: hair keeps its place on it."""
    mesh = dressed.textures.hair_mesh
    settings = RenderSettings(view="front", size=96, rate=None, first=0, last=None, dynamic=True,
                              hair=True, film=True)  # fmt: skip
    pictures = []
    for hang in (0.0, 1.0):
        own = replace(mesh, hang=np.full(len(mesh.vertices), hang, np.float32))
        avatar = replace(dressed, textures=replace(dressed.textures, hair_mesh=own))
        player = AnimationPlayer(avatar, short_take, settings)
        pictures.append(player.picture(player.player.workspace(96, 96), 11))
        camera = player.camera_of(11)
    np.testing.assert_array_equal(*pictures)
    alone = Player(dressed)
    expression, gaze = player.weights[11], player.gaze[11]
    turned = alone.picture(alone.workspace(96, 96), camera, expression, gaze)
    np.testing.assert_array_equal(pictures[0], turned)


def test_the_sheet_shows_hair(dressed, noise_avatar):
    with_hair, without = (contact_sheet(one, 64) for one in (dressed, noise_avatar))
    assert with_hair.shape == without.shape
    brown = (with_hair[:50, :64].astype(int) @ [1, 0, -1]) > 25
    assert brown.sum() > 300


def test_a_darker_light_darkens_the_hair(dressed):
    from bakery.formats.light import read_light

    whole = read_light("neutral")
    scene = replace(SCENE, background=None, light=whole)
    bright, _ = draw_scene(dressed, scene)
    dark, _ = draw_scene(dressed, replace(scene, light=0.4 * whole))
    alpha = draw_scene(dressed, SCENE)[0][..., 3]
    covered = alpha > 0.999
    ratio = dark[covered].sum() / bright[covered].sum()
    assert ratio == pytest.approx(0.4, abs=0.05)
