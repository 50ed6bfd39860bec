"""Albedo: highlights taken off, the light's level, and what is left of a known skin."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from numpy.testing import assert_allclose

from bakery.geometry import harmonics
from bakery.geometry.color import LUMA
from bakery.heads.base import HeadModel
from bakery.stages.atlas import make_atlas
from bakery.stages.texture.albedo import (
    EYE_SHARE,
    METER,
    PALEST,
    WHITE,
    albedo_of,
    light_on,
    saturated,
    without_highlights,
)
from bakery.stages.texture.unwrap import photo_light
from bakery.testing import painted

SIZE = 256
TONES = {"dark": [0.08, 0.040, 0.026], "middle": [0.30, 0.17, 0.12], "pale": [0.56, 0.34, 0.27]}
WHOLE = np.ones((SIZE, SIZE), np.float32)


def skin(tone, mottle=0.02, seed=0):
    """Skin of a tone [T, T, 3] that varies a little as melanin does."""
    noise = np.random.default_rng(seed).normal(size=(SIZE, SIZE)).astype(np.float32)
    noise = cv2.GaussianBlur(noise, (0, 0), 3)
    more = np.exp(np.outer(mottle * noise / noise.std(), [0.8, 1.0, 1.15])).reshape(SIZE, SIZE, 3)
    return (np.array(tone) * more).astype(np.float32)


def spot(x, y, radius):
    rows, columns = np.mgrid[:SIZE, :SIZE]
    return np.exp(-((rows - y) ** 2 + (columns - x) ** 2) / (2 * radius**2)).astype(np.float32)


@pytest.mark.parametrize("tone", TONES)
def test_a_highlight_is_taken_off(tone):
    """A spot of light as bright as half the skin, of which a tenth may stay."""
    bare = skin(TONES[tone])
    strength = 0.5 * float(bare.mean((0, 1)) @ LUMA)
    glossy = bare + strength * spot(128, 128, 4)[..., None]
    found = without_highlights(glossy, WHOLE)
    inner = spot(128, 128, 4) > 0.5
    before, after = (np.abs((x - bare)[inner] @ LUMA).mean() / strength for x in (glossy, found))
    assert before > 0.7 and after < 0.3 * before
    assert_allclose(
        found[spot(128, 128, 4) < 1e-3], bare[spot(128, 128, 4) < 1e-3], atol=0.02 * strength
    )


@pytest.mark.parametrize("tone", TONES)
def test_skin_without_gloss_stays(tone):
    """Dark skin is not bleached, nor is any made darker: the mean moves by less than half a percent."""
    bare = skin(TONES[tone])
    found = without_highlights(bare, WHOLE)
    assert_allclose(found.mean((0, 1)), bare.mean((0, 1)), rtol=5e-3)


@pytest.mark.parametrize("tone", TONES)
def test_freckles_moles_and_beard_stay(tone):
    """What is darker is no highlight, also where its colour is greyer than the skin's."""
    bare = skin(TONES[tone])
    marked = bare.copy()
    for n, (x, y) in enumerate(np.random.default_rng(1).uniform(20, 236, (40, 2))):
        marked *= 1 - 0.45 * spot(x, y, 1.5 + n % 3)[..., None] * [0.7, 1.0, 1.15]
    hair = (np.random.default_rng(2).random((SIZE, SIZE)) < 0.15) * (np.arange(SIZE) > 180)[:, None]
    marked = np.where(hair[..., None], 0.02, marked).astype(np.float32)
    dark = marked @ LUMA < 0.9 * (bare @ LUMA)
    found = without_highlights(marked, WHOLE)
    # The rims of freckles are nearly as bright as the skin, and some of it is brighter by itself.
    assert_allclose(found[dark], marked[dark], rtol=0.05, atol=1e-4)
    assert_allclose(found[dark].mean(0), marked[dark].mean(0), rtol=1e-3)


def test_nothing_gets_brighter_or_black():
    rng = np.random.default_rng(3)
    wild = rng.random((SIZE, SIZE, 3)).astype(np.float32)
    found = without_highlights(wild, WHOLE)
    assert (found <= wild + 1e-6).all() and (found >= 0.3 * wild - 1e-6).all()
    assert_allclose(without_highlights(wild, 0 * WHOLE), wild)


@pytest.mark.parametrize("tone", TONES)
def test_a_broad_sheen_gets_the_tone_of_the_face_and_keeps_its_brightness(tone):
    """As an albedo shows it: as bright as the rest, for the light was divided out, and grey."""
    bare = skin(TONES[tone])
    sheen = spot(128, 60, 25)[..., None]
    photo = bare * (1 + 0.6 * sheen)
    grey = (bare @ LUMA)[..., None] * np.ones(3)
    faded = (bare + 0.5 * sheen * (grey - bare)).astype(np.float32)
    found = saturated(faded, photo, WHOLE, WHOLE > 0)
    inner = sheen[..., 0] > 0.7
    before, after = (np.abs(x - bare)[inner].mean() for x in (faded, found))
    assert after < 0.35 * before
    assert_allclose(found @ LUMA, faded @ LUMA, rtol=1e-4)
    away = sheen[..., 0] < 1e-3
    assert_allclose(found[away], faded[away], rtol=0.02)


@pytest.mark.parametrize("tone", TONES)
def test_pale_and_red_skin_that_was_no_brighter_stays(tone):
    bare = skin(TONES[tone])
    grey = (bare @ LUMA)[..., None] * np.ones(3)
    patches = bare + (0.4 * spot(90, 90, 20) - 0.3 * spot(170, 170, 20))[..., None] * (grey - bare)
    patches = patches.astype(np.float32)
    assert_allclose(saturated(patches, patches, WHOLE, WHOLE > 0), patches, rtol=0.02)


def in_light(light, tone, meter=METER):
    """A person of one plain tone photographed in a light: Subject, Fit."""
    seen = painted()
    subject, fit = seen.subject, replace(seen.fit, light=light)
    head: HeadModel = subject.head
    size = len(subject.texture)
    atlas = make_atlas(head, size).take("skin")
    vertices = head.vertices(subject.neutral, fit.expression, fit.gaze)
    shade = photo_light(fit, head, vertices, atlas)
    texture = (np.array(tone) * shade * meter).astype(np.float32)
    eyes = replace(subject.eyes, white=np.float32([WHITE * meter] * 2))
    return replace(subject, texture=texture, eyes=eyes, light=light), fit, atlas


EVEN = np.zeros((9, 3))
EVEN[0] = 1 / harmonics.C0
SLANTING = EVEN.copy()
SLANTING[1], SLANTING[2], SLANTING[3] = 0.1, 0.3, 0.25


@pytest.mark.parametrize("tone", TONES)
@pytest.mark.parametrize("light", [EVEN, SLANTING], ids=["even", "slanting"])
def test_a_known_skin_comes_back(tone, light):
    """In light that looks down on nobody, a well exposed photo gives the very albedo."""
    subject, fit, atlas = in_light(light, TONES[tone])
    found = albedo_of(subject, fit)
    inside = atlas.paint(np.ones(len(atlas.index), bool))
    # The slant is seen by the eyes a little differently than by the face.
    assert_allclose(found[inside], np.broadcast_to(TONES[tone], found[inside].shape), rtol=0.05)
    assert found.dtype == np.float32 and 0 <= found.min() and found.max() <= 1


def test_eyes_tell_the_exposure_and_the_colour_of_the_light():
    subject, fit, _ = in_light(EVEN, TONES["middle"])
    assert_allclose(light_on(subject, fit), METER, rtol=1e-5)
    bright = replace(subject, eyes=replace(subject.eyes, white=2 * subject.eyes.white))
    assert_allclose(light_on(bright, fit), METER * 2**EYE_SHARE, rtol=1e-5)
    warm = replace(subject, eyes=replace(subject.eyes, white=subject.eyes.white * [1.2, 1, 0.8]))
    red, green, blue = light_on(warm, fit)
    assert red > green > blue
    hidden = replace(subject, eyes=replace(subject.eyes, white=0 * subject.eyes.white))
    assert_allclose(light_on(hidden, fit), METER)
    one = np.stack([subject.eyes.white[0], np.zeros(3)])
    assert_allclose(
        light_on(replace(subject, eyes=replace(subject.eyes, white=one)), fit), METER, rtol=1e-5
    )


def test_no_face_is_paler_than_faces_are():
    """An overexposed photo whose eyes lie in the dark."""
    subject, fit, atlas = in_light(EVEN, TONES["pale"], 2 * METER)
    subject = replace(subject, eyes=replace(subject.eyes, white=subject.eyes.white / 4))
    inside = atlas.paint(np.ones(len(atlas.index), bool))
    assert np.median(albedo_of(subject, fit)[inside] @ LUMA) == pytest.approx(PALEST, rel=0.02)


def test_the_white_of_painted_eyes_is_seen():
    white = painted().subject.eyes.white
    assert white.shape == (2, 3) and (white > 0.05).all()
