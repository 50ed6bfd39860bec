"""The whole skin from a part: what was seen stays, what was not gets tone and grain."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from numpy.testing import assert_allclose

from bakery.geometry.color import LUMA
from bakery.landmarks import OVAL
from bakery.stages.atlas import make_atlas, uv_polygon
from bakery.stages.texture import METHODS
from bakery.stages.texture.complete import (
    INFERRED,
    MIRRORED,
    OBSERVED,
    complete,
    leveled,
    with_mirror,
)
from bakery.stages.texture.correlations import (
    FEATURES,
    KINDS,
    OCTAVES,
    WINDOWS,
    Correlations,
    Filters,
    windows_of,
)
from bakery.stages.texture.grain import own_grain
from bakery.stages.texture.shaped import shaped
from bakery.stages.texture.unwrap import PartialAlbedo, without_foreign

SIZE = 512
TONE = np.array([0.35, 0.22, 0.16], np.float32)


@pytest.fixture(scope="module")
def atlas(head):
    return make_atlas(head, SIZE).take("skin")


@pytest.fixture(scope="module")
def face(head):
    return uv_polygon(head, OVAL, 1.0, SIZE)


def grainy(amount, seed=0):
    """Skin whose log albedo varies by `amount`, over about two texels, as a lens leaves it."""
    noise = cv2.GaussianBlur(np.random.default_rng(seed).normal(size=(SIZE, SIZE)), (0, 0), 1)
    return (TONE * np.exp(amount / noise.std() * noise[..., None])).astype(np.float32)


def partial_of(albedo, seen, atlas):
    on_skin = atlas.paint(np.ones(len(atlas.index), np.float32))
    whole = np.ones((SIZE, SIZE), np.float32)
    return PartialAlbedo(albedo, seen * on_skin, whole, np.ones_like(albedo), on_skin)


@pytest.mark.parametrize("method", METHODS)
def test_what_was_seen_stays(head, atlas, face, method):
    seen = face.copy()
    seen[:, SIZE // 2 + 40 :] = 0
    partial = partial_of(grainy(0.05), seen, atlas)
    made = complete(partial, head, head.mean, atlas, method)
    sure = partial.seen == 1
    assert_allclose(made.albedo[sure], partial.albedo[sure], rtol=1e-5)
    assert np.isfinite(made.albedo).all() and made.albedo.min() >= 0
    assert (made.source[sure] == OBSERVED).all()
    assert ((made.source == 0) == (partial.on_skin == 0)).all()
    other = (partial.on_skin > 0) & (seen == 0) & (partial.seen[:, ::-1] == 1)
    assert (made.source[other] == (INFERRED if method == "none" else MIRRORED)).all()
    # One tone everywhere: what is filled in has it as well, up to what people's faces vary.
    filled = (made.source == INFERRED) & (face == 0)
    assert_allclose(np.median(made.albedo[filled], 0), TONE, rtol=0.15)


def test_quick_has_the_grain_of_the_skin_that_was_seen(head, atlas, face):
    partial = partial_of(grainy(0.05), face, atlas)
    made = complete(partial, head, head.mean, atlas, "quick")
    spread = {
        name: np.log(made.albedo @ LUMA)[where].std()
        for name, where in (
            ("seen", (face > 0) & (partial.on_skin > 0)),
            ("filled", (made.source == INFERRED) & (partial.on_skin > 0)),
        )
    }
    assert 0.6 < spread["filled"] / spread["seen"] < 1.6
    smooth = complete(partial, head, head.mean, atlas, "none")
    assert np.log(smooth.albedo @ LUMA)[(made.source == INFERRED)].std() < 0.5 * spread["seen"]


def test_grain_keeps_its_variance_where_pieces_blend(head, atlas, face):
    grain = own_grain(grainy(0.05), face, head.mean, atlas)
    values = (grain @ LUMA).reshape(-1)[atlas.index]
    assert 0.85 < values.std() / 0.05 < 1.1
    assert abs(values.mean()) < 0.005
    again = own_grain(grainy(0.05), face, head.mean, atlas)
    assert np.array_equal(grain, again), "not the same twice"
    assert not np.array_equal(grain, own_grain(grainy(0.05), face, head.mean, atlas, seed=1))


def test_too_little_skin_has_no_grain(head, atlas):
    nothing = np.zeros((SIZE, SIZE), np.float32)
    assert own_grain(grainy(0.05), nothing, head.mean, atlas) is None
    speck = nothing.copy()
    speck[250:254, 250:254] = 1
    assert own_grain(grainy(0.05), speck, head.mean, atlas) is None
    assert np.isfinite(
        complete(partial_of(grainy(0.05), speck, atlas), head, head.mean, atlas, "quick").albedo
    ).all()


def test_grain_gets_the_energy_that_is_wanted(head, atlas):
    windows = windows_of(head, atlas)
    grain = np.random.default_rng(3).normal(0, 0.05, (SIZE, SIZE, 1)) * np.ones(3)
    grain = grain.astype(np.float32)
    on_skin = atlas.paint(np.ones(len(atlas.index), np.float32))

    def energies(luma):
        pyramid = Filters(on_skin, SIZE).levels(luma.astype(np.float32))
        bands = np.stack([a - b for a, b in zip(pyramid, pyramid[1:])])
        inside = windows.number >= 0
        return (bands.reshape(OCTAVES, -1)[:, atlas.index[inside]] ** 2).mean(1)

    half = np.zeros((WINDOWS**2, FEATURES, FEATURES), np.float32)
    for octave, energy in enumerate(energies(grain @ LUMA)):
        half[:, octave * KINDS, octave * KINDS] = energy / 4
    flat = np.tile(TONE, (SIZE, SIZE, 1))
    made = shaped(grain, flat, Correlations(half, np.ones(WINDOWS**2, np.float32)), windows)
    ratio = energies(made @ LUMA) / energies(grain @ LUMA)
    # What is coarser than all octaves stays as it is, and reaches into the last one.
    assert_allclose(ratio[:3], 0.25, rtol=0.15)
    assert 0.2 < ratio[3] < 0.45


def test_the_mirror_takes_the_colour_of_its_side(atlas):
    """The right half is twice as bright: mirrored parts are matched where both are seen."""
    albedo = np.tile(TONE, (SIZE, SIZE, 1))
    albedo[:, SIZE // 2 :] *= 1.5
    seen = np.ones((SIZE, SIZE), np.float32)
    seen[200:240, 300:340] = 0
    joined, known, _ = with_mirror(partial_of(albedo, seen, atlas))
    on_skin = atlas.paint(np.ones(len(atlas.index), np.float32))
    hole = (seen == 0) & (on_skin > 0) & (on_skin[:, ::-1] > 0)
    assert hole.any() and known[hole].min() == 1
    assert_allclose(joined[hole], np.tile(1.5 * TONE, (hole.sum(), 1)), rtol=0.05)


def test_slanting_tones_are_leveled_and_detail_stays():
    base = np.tile(TONE, (SIZE, SIZE, 1))
    detail = np.exp(np.random.default_rng(4).normal(0, 0.05, (SIZE, SIZE, 1)))
    dark = (0.6 * base * detail).astype(np.float32)
    known = np.ones((SIZE, SIZE), np.float32)
    assert np.array_equal(leveled(dark, known, base, 0 * known), dark)
    out = leveled(dark, known, base, known)
    assert 0.9 < np.median(out / base) < 1
    a, b = (np.log(x @ LUMA).std() for x in (out, dark))
    assert 0.9 < a / b < 1.1


def test_a_cast_shadow_goes_and_leaves_no_border(head, atlas, face):
    """A band of the face at a third of its light: lifted, with its detail; its edge is filled in."""
    albedo = grainy(0.05)
    dark = np.zeros((SIZE, SIZE), bool)
    dark[SIZE * 7 // 16 : SIZE * 9 // 16] = True
    albedo[dark] *= 0.45
    edge = np.abs(np.arange(SIZE)[:, None] - np.array([SIZE * 7 // 16, SIZE * 9 // 16])).min(1) < 3
    seen = face * ~edge[:, None]
    plain = partial_of(albedo, seen, atlas)
    shaded = replace(plain, even=np.where(dark, 0, 1).astype(np.float32))
    inside = dark & (face > 0) & (plain.on_skin > 0)
    before, after = (
        complete(partial, head, head.mean, atlas, "quick").albedo for partial in (plain, shaded)
    )
    assert np.median((before / TONE)[inside]) < 0.5
    assert 0.8 < np.median((after / TONE)[inside]) < 1.1
    assert 0.5 < np.log(after @ LUMA)[inside].std() / 0.05 < 2.5


def test_what_is_no_skin_beyond_the_face_is_left_out(head, atlas, face):
    on_skin = atlas.paint(np.ones(len(atlas.index), np.float32))
    beyond = (face == 0) & (on_skin > 0)
    rows = np.flatnonzero(beyond.any(1))
    row = rows[len(rows) * 9 // 10]
    column = int(np.median(np.flatnonzero(beyond[row])))
    patch = np.zeros((SIZE, SIZE), bool)
    patch[row - 8 : row + 8, column - 8 : column + 8] = True
    albedo = np.tile(TONE, (SIZE, SIZE, 1))
    albedo[patch] = 0.6  # a white collar
    assert without_foreign(albedo, on_skin, head)[patch & beyond].max() == 0
    assert without_foreign(albedo, on_skin, head)[face > 0].min() >= on_skin[face > 0].min()
    # An island of true skin colour far from the face is left out as well.
    lone = np.maximum(face, patch) * on_skin
    assert without_foreign(np.tile(TONE, (SIZE, SIZE, 1)), lone, head)[patch & beyond].max() == 0
    plain = np.tile(TONE, (SIZE, SIZE, 1))
    assert np.array_equal(without_foreign(plain, on_skin, head), on_skin)
