"""Hair with volume: known answers, and the fast player against the clear one."""

from dataclasses import replace

import numpy as np
import pytest

from bakery.geometry.camera import to_camera
from bakery.geometry.color import to_encoded, to_linear
from bakery.geometry.harmonics import C0
from bakery.runtime.card_kernels import encoded
from bakery.runtime.cards import lay_picture
from bakery.runtime.hair_cards import NONE, hair_cards, over_picture, soft_normals
from bakery.runtime.player import Player
from bakery.runtime.relight import unlit
from bakery.runtime.render import draw, over_gray
from bakery.stages.condition import face_camera
from bakery.types import HairMesh

STILL, AHEAD, SIZE = np.zeros(52, np.float32), np.zeros(2), 160


def camera_of(avatar, yaw=0.0):
    return face_camera(avatar.fit, avatar.head, avatar.neutral, yaw, 0.0, SIZE, 0.4)


def drawn(avatar, yaw=0.0, **options):
    """One frame by the reference."""
    vertices = avatar.head.vertices(avatar.neutral, STILL, AHEAD)
    return draw(avatar, vertices, camera_of(avatar, yaw), STILL, AHEAD, **options)


def played(avatar, yaw=0.0, hair=True, apart=False):
    """The same by the fast player."""
    player, camera = Player(avatar, hair), camera_of(avatar, yaw)
    return player.frame(player.workspace(SIZE, SIZE), camera, STILL, AHEAD, apart=apart)


def wearing(avatar, mesh):
    return replace(avatar, textures=replace(avatar.textures, hair_mesh=mesh))


def sheets(*wanted, levels=7):
    """Squares of one colour each: (z, half its side, colour, alpha, kind) in the order of faces."""
    texture = np.zeros((4 * len(wanted), 4 * len(wanted), 4), np.float16)
    vertices, faces, uv = [], [], []
    for number, (z, half, color, alpha, _) in enumerate(wanted):
        texture[:, 4 * number : 4 * number + 4] = [*(alpha * np.array(color)), alpha]
        corners = np.array([[-1, -1], [1, -1], [-1, 1], [1, 1]]) * half
        vertices += [[x, y, z] for x, y in corners]
        faces += [[4 * number + k for k in face] for face in ((0, 1, 2), (2, 1, 3))]
        uv += [[(number + 0.5) / len(wanted), 0.5]] * 4
    kinds = np.repeat([one[4] for one in wanted], 2).astype(np.uint8)
    side = len(texture)
    return HairMesh(
        np.array(vertices, np.float32), np.array(faces, np.int32), np.array(uv, np.float32), kinds,
        np.where(kinds == 0, -1, np.repeat(np.arange(len(wanted)), 2)).astype(np.int32),
        np.full(len(faces), levels, np.uint8), np.zeros(len(vertices), np.float32), texture,
        np.zeros((side, side, 2), np.float16), np.zeros((side, side), np.float16),
        np.zeros((side, side), np.uint8),
    )  # fmt: skip


RED, GREEN = (0.5, 0.0, 0.0), (0.0, 0.5, 0.0)


@pytest.mark.parametrize("picture", [drawn, played])
@pytest.mark.parametrize("turned", [False, True])
def test_the_nearer_card_lies_on_top_from_either_side(noise_avatar, picture, turned):
    """Of two half clear sheets before the face, or behind the head and seen from there."""
    near, far = (-260.0, -240.0) if turned else (150.0, 130.0)
    mesh = sheets((near, 60, RED, 0.5, 1), (far, 60, GREEN, 0.5, 2))
    skin = picture(noise_avatar, 180.0 * turned)
    found = picture(wearing(noise_avatar, mesh), 180.0 * turned)
    solid = skin.alpha > 0.999
    changed = (np.abs(found.color - skin.color).max(-1) > 0.01) & solid
    below = to_encoded(skin.color) * 0.5 + to_encoded(np.float32(GREEN)) * 0.5
    expected = to_linear(below * 0.5 + to_encoded(np.float32(RED)) * 0.5)
    assert changed.sum() > 500
    inner = np.abs(found.color - expected).max(-1)[changed]
    assert np.median(inner) < 0.003  # a pixel's mean of skin is mixed, not the mean of mixtures
    middle = np.s_[70:90, 70:90]  # under both: a quarter of the face comes through
    np.testing.assert_allclose(found.face[middle], 0.25 * skin.face[middle], atol=0.01)


@pytest.mark.parametrize("picture", [drawn, played])
def test_a_card_behind_the_head_is_hidden_and_one_beside_it_covers(noise_avatar, picture):
    mesh = sheets((-400.0, 300, RED, 0.5, 1))
    bare, found = picture(noise_avatar), picture(wearing(noise_avatar, mesh))
    solid, empty = bare.alpha > 0.999, (bare.alpha == 0) & (found.alpha > 0)
    np.testing.assert_array_equal(found.color[solid], bare.color[solid])
    inside = np.zeros_like(solid)
    inside[40:120, 2:20] = True  # of the sheet, where nothing is before it
    assert (empty & inside).sum() > 500
    np.testing.assert_allclose(found.alpha[empty & inside], 0.5, atol=1e-3)
    assert not found.face[empty & inside].any()  # hair is no face
    own = found.color[empty & inside]
    np.testing.assert_allclose(own, np.broadcast_to([0.25, 0, 0], own.shape), atol=1e-3)


@pytest.mark.parametrize("picture", [drawn, played])
@pytest.mark.parametrize("turned", [False, True])
def test_the_cap_is_opaque_from_both_sides_and_hides_cards(noise_avatar, picture, turned):
    """Whatever alpha its texels have: the head behind it and the card behind it are gone."""
    z = (-260.0, -240.0) if turned else (150.0, 130.0)
    mesh = sheets((z[0], 60, RED, 0.75, 0), (z[1], 60, GREEN, 0.9, 1))
    found = picture(wearing(noise_avatar, mesh), 180.0 * turned)
    middle = found.color[70:90, 70:90]
    np.testing.assert_allclose(middle, np.broadcast_to(RED, middle.shape), atol=2e-3)
    assert (found.alpha[70:90, 70:90] > 0.999).all() and not found.face[70:90, 70:90].any()


def test_hair_over_a_picture_of_the_head(noise_avatar):
    """What lies nearer than the hair stays; cap and card cover the rest as they do in `draw`."""
    camera = camera_of(noise_avatar)
    mesh = sheets((130.0, 60, RED, 0.75, 0), (150.0, 60, GREEN, 0.5, 1))
    gray = np.full((camera.height, camera.width, 3), 0.2, np.float32)
    near, far = np.zeros(gray.shape[:2]), np.full(gray.shape[:2], np.inf)
    np.testing.assert_array_equal(over_picture(gray, near, camera, mesh), gray)
    np.testing.assert_array_equal(over_picture(gray, far, camera, None), gray)
    found = over_picture(gray, far, camera, mesh)
    middle = found[70:90, 70:90]
    mixed = to_linear(to_encoded(np.float32(RED)) * 0.5 + to_encoded(np.float32(GREEN)) * 0.5)
    np.testing.assert_allclose(middle, np.broadcast_to(mixed, middle.shape), atol=2e-3)


@pytest.mark.parametrize("picture", [drawn, played])
def test_without_hair_nothing_of_it_is_drawn(noise_avatar, hairdo, picture):
    head, neutral = noise_avatar.head, noise_avatar.neutral
    dressed = wearing(noise_avatar, hairdo(head, neutral))
    for one, other in zip(
        vars(picture(dressed, hair=False)).values(),
        vars(picture(noise_avatar, hair=False)).values(),
    ):
        np.testing.assert_array_equal(one, other)
    assert np.abs(picture(dressed).color - picture(noise_avatar).color).max() > 0.2


@pytest.mark.parametrize("style", ["bob", "crop"])
@pytest.mark.parametrize("yaw", [0, 35, -75, 180])
def test_fast_player_draws_the_hair_of_the_reference(noise_avatar, hairdo, style, yaw):
    dressed = wearing(noise_avatar, hairdo(noise_avatar.head, noise_avatar.neutral, style))
    frames = drawn(dressed, yaw), played(dressed, yaw)
    apart = np.abs(np.subtract(*[to_encoded(over_gray(frame)) for frame in frames])).max(-1)
    # The player mixes texels of a card in sRGB, not in linear light; what comes through less than
    # CLEAR is not drawn: a quarter of a byte. Found: 0.09% over a byte, 1.3 bytes at most.
    assert (apart > 1 / 255).mean() < 2e-3 and apart.max() < 3 / 255 and apart.mean() < 0.1 / 255
    assert (np.abs(frames[0].alpha - frames[1].alpha) > 2e-3).mean() < 5e-4
    assert (np.abs(frames[0].face - frames[1].face) > 3e-3).mean() < 5e-4
    assert np.abs(drawn(noise_avatar, yaw).alpha - frames[0].alpha).sum() > 50  # hair stands out


@pytest.mark.parametrize("yaw", [0, 50])
def test_hair_apart_is_what_is_missing(noise_avatar, hairdo, yaw):
    """Without it the head alone is drawn; laid over that it gives the whole; alike in both players."""
    dressed = wearing(noise_avatar, hairdo(noise_avatar.head, noise_avatar.neutral))
    layers = []
    for picture in (drawn, played):
        apart, whole = picture(dressed, yaw, apart=True), picture(dressed, yaw)
        assert whole.hair is None and apart.hair is not None
        color, alpha = apart.color.copy(), apart.alpha.copy()
        lay_picture(color, alpha, apart.hair)
        np.testing.assert_allclose(alpha, whole.alpha, atol=0.3)  # a pixel's means, not its samples
        assert np.abs(alpha - whole.alpha).mean() < 1e-3
        assert np.abs(to_encoded(color) - to_encoded(whole.color)).mean() < 1e-3
        shown = 1 - apart.hair[..., 3]
        assert np.abs(apart.face * shown - whole.face).mean() < 2e-3
        layers.append(apart)
    for one, other in zip(*(vars(layer).values() for layer in layers)):
        assert (np.abs(one - other) > 2e-3).mean() < 1e-3
    assert drawn(noise_avatar, yaw, apart=True).hair is None


def test_cards_are_sorted_by_the_view(noise_avatar, hairdo):
    """From every side each card's middle is no farther than that of the card before it."""
    hair = hair_cards(hairdo(noise_avatar.head, noise_avatar.neutral))
    orders = []
    for yaw in (0, 50, 180):
        camera = camera_of(noise_avatar, yaw)
        order = hair.order(camera)
        orders.append(order)
        assert sorted(order) == list(range(len(hair.cards)))
        away = -to_camera(hair.middles, camera)[hair.number[order], 2]
        assert (np.diff(away) <= 1e-6).all()
        assert (np.diff(hair.number[order]) != 0).sum() == len(
            hair.middles
        ) - 1  # cards in one piece
    assert not np.array_equal(orders[0], orders[2])


def test_levels_show_their_own_faces(noise_avatar, hairdo):
    mesh = hairdo(noise_avatar.head, noise_avatar.neutral)
    for level in range(3):
        hair = hair_cards(mesh, level)
        shown = (mesh.levels >> level & 1).astype(bool)
        assert len(hair.cap) == 2 * (shown & (mesh.kind == 0)).sum()
        np.testing.assert_array_equal(hair.cards, mesh.faces[shown & (mesh.kind > 0)])
    assert hair_cards(mesh, 1) is hair_cards(mesh, 1) and hair_cards(None) is NONE


def test_soft_normals_point_out_of_the_hair(noise_avatar, hairdo):
    mesh = hairdo(noise_avatar.head, noise_avatar.neutral)
    normals = soft_normals(mesh)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1, atol=1e-5)
    left = mesh.vertices[:, 0] > 60
    assert (normals[left, 0] > 0.3).all()
    low = mesh.vertices[:, 1] < -60
    assert np.abs(normals[low, 1]).max() < 1e-6  # long hair looks aside, not down


def test_hair_is_relit_with_the_head(noise_avatar):
    """A light of half the strength halves cap and card; one from the left leaves the right dark."""
    even = np.zeros((9, 3))
    even[0] = 1 / C0
    fit = replace(noise_avatar.fit, light=even)
    mesh = sheets((150.0, 60, RED, 1, 0), (160.0, 60, RED, 1, 1))
    avatar = wearing(replace(noise_avatar, fit=fit), mesh)
    for kinds in ((0, 1), (0,)):
        kept = np.isin(mesh.kind, kinds)
        names = ("faces", "kind", "card", "levels")
        avatar = wearing(
            avatar, replace(mesh, **{name: getattr(mesh, name)[kept] for name in names})
        )
        whole, half = (drawn(avatar, light=light) for light in (even, 0.5 * even))
        inner = np.s_[70:90, 70:90]
        np.testing.assert_allclose(
            half.color[inner], 0.5 * whole.color[inner], rtol=0.01, atol=1e-4
        )
        bare = unlit(avatar)
        assert whole.color[inner][..., 0].mean() == pytest.approx(
            0.5 * bare.exposure * bare.white[0], rel=0.01
        )
        left = even.copy()
        left[3] = 0.9 / 0.488603
        bright = drawn(avatar, light=left).color[80]
        assert bright[95:105, 0].mean() > 1.3 * bright[55:65, 0].mean()


def test_what_is_looked_for_behind_the_rest_is_seen_as_ever(noise_avatar, hairdo):
    """Squares in which all is nearer than a face are left out: the same faces win, from every side."""
    dressed = wearing(noise_avatar, hairdo(noise_avatar.head, noise_avatar.neutral))
    player, seen = Player(dressed), []
    late, whole = player.late, len(player.faces)
    assert 0 < late < whole
    for yaw, pitch in ((0, 0), (100, -30), (180, -60), (0, -60), (0, 60)):
        camera = face_camera(dressed.fit, dressed.head, dressed.neutral, yaw, pitch, SIZE, 0.4)
        found = []
        for begin in (late, whole):
            player.late = begin
            work = player.workspace(SIZE, SIZE)
            work.face[:] = -1
            player.draw_into(work, camera, STILL, AHEAD)
            found.append(work.face)
        np.testing.assert_array_equal(*found)
        seen.append((found[0] >= late).sum())
    assert max(seen) > 0, seen


def test_texels_of_cards_are_srgb_multiplied_by_alpha():
    texture = np.zeros((3, 4, 4), np.float32)
    texture[1, 2] = [0.25 * 0.5, 0, 0.25, 0.25]
    layer, some = encoded(texture)
    expected = [*(to_encoded(np.array([0.5, 0, 1])) * 0.25), 0.25]
    np.testing.assert_allclose(layer[1, 2], expected, atol=1e-6)
    assert layer.sum() == pytest.approx(sum(expected), abs=1e-5)
    filled = np.zeros((4, 5), bool)
    filled[1:3, 2:4] = True  # between this texel and its neighbours
    np.testing.assert_array_equal(some, filled)
