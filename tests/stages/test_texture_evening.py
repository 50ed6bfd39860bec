"""Skin in one even tone: light from one side goes, what is the person's own stays."""

import cv2
import numpy as np
from numpy.testing import assert_allclose

from bakery.geometry.color import LUMA
from bakery.stages.texture.evening import HOLE, alike, evened, without_holes

SIZE = 256
TONE = np.array([0.35, 0.22, 0.16], np.float32)
WHOLE = np.ones((SIZE, SIZE), np.float32)
PLAIN = np.tile(TONE, (SIZE, SIZE, 1))
ACROSS = np.linspace(-1, 1, SIZE, dtype=np.float32)[None, :, None]


def even_out(albedo, known=WHOLE, even=WHOLE, plain=WHOLE, face=WHOLE, twice=WHOLE):
    """`evened` of a face of one likely tone."""
    albedo, sure = albedo.astype(np.float32), even * known
    return evened(albedo, known, even, twice, sure, PLAIN, plain, face, WHOLE)


def halves(albedo, margin=16):
    """Log luminance of the two halves, its median."""
    log = np.log(albedo @ LUMA)
    return (np.median(part[:, margin:-margin]) for part in np.split(log, 2, axis=1))


def test_skin_of_one_tone_stays():
    made = even_out(PLAIN)
    assert_allclose(made.albedo, PLAIN, rtol=1e-3)
    assert made.known.min() == 1 and np.abs(made.lift).max() < 1e-3


def test_the_darker_half_gets_the_tone_of_the_lighter_and_keeps_its_detail():
    detail = np.exp(np.random.default_rng(0).normal(0, 0.05, (SIZE, SIZE, 1)))
    # A soft terminator: 2.5 times darker from one side to the other, and redder.
    light = np.exp(0.46 * np.tanh(3 * ACROSS)) * [1.1, 1, 0.9] ** (-ACROSS)
    made = even_out(PLAIN * detail * light)
    dark, lit = halves(made.albedo)
    assert abs(lit - dark) < 0.2, "0.9 before"
    assert lit > np.log(TONE @ LUMA) + 0.1, "drawn to the darker half"
    tint = np.log(made.albedo[..., 0] / made.albedo[..., 2])
    # Of the middle's colour, that of both, each half keeps its own difference up to ONE.
    assert abs(np.median(tint[:, :100]) - np.median(tint[:, 156:])) < 0.12, "0.2 before"
    left = np.log(made.albedo @ LUMA)
    assert_allclose(np.diff(left, axis=0).std(), np.diff(np.log(detail), axis=0).std(), rtol=0.1)
    assert made.known.min() == 1, "a soft terminator has no edge"


def test_a_coloured_lamp_on_one_side_colours_neither():
    """A yellow light on one cheek makes it lighter: in colour the middle of the face is believed."""
    lamp = np.exp(0.4 * np.clip(2 * ACROSS - 0.6, 0, 1) * np.array([1.0, 0.8, -0.4]))
    made = even_out(PLAIN * lamp)
    tint = np.log(made.albedo[..., 0] / made.albedo[..., 2]) - np.log(TONE[0] / TONE[2])
    lit, other = (np.median(tint[16:-16, part]) for part in (slice(-40, -16), slice(16, 40)))
    assert abs(other) < 0.03, "0.21 before"
    assert abs(lit) < 0.15, "0.33 before"
    skin = np.exp(0.2 * np.abs(ACROSS) * np.array([0.5, -0.5, -0.5]))  # cheeks that are redder
    assert_allclose(even_out(PLAIN * skin).albedo, PLAIN * skin, rtol=0.1)


def test_what_is_darker_ends_no_lighter_than_what_was_lighter():
    """Lifting what passes a limit, and nothing else, would leave patches that are turned round."""
    dark = np.linspace(0, 1.5, SIZE, dtype=np.float32)[:, None, None]
    made = even_out(PLAIN * np.exp(-dark))
    tone = np.log(made.albedo @ LUMA)[8:-8, 8:-8].mean(1)
    assert np.diff(tone).max() < 1e-3


def test_small_holes_in_what_is_known_are_none():
    known = np.zeros((SIZE, SIZE), np.float32)
    known[50:200] = 1
    speck = int(1.5 * HOLE * SIZE)
    known[100 : 100 + speck, 100 : 100 + speck] = 0
    known[100:150, 150:200] = 0
    found = without_holes(known)
    assert found[100 : 100 + speck, 100 : 100 + speck].min() == 1
    assert found[120:130, 170:180].max() == 0 and found[:45].max() == 0


def test_a_hairline_goes_on_as_the_forehead_inside():
    """Forehead that a lamp lights, 0.4 of log above what is likely, up to where nothing is known: no band beside the hair."""
    known, face = WHOLE.copy(), WHOLE.copy()
    known[:60], face[:140] = 0, 0
    lamp = np.exp(0.4 * (np.arange(SIZE) < 140))[:, None, None]
    tone = {
        name: np.log(even_out(PLAIN * lamp, known, even, face=face).albedo @ LUMA)[:, 128]
        for name, even in (("squarely", WHOLE), ("slanting", np.full_like(WHOLE, 0.05)))
    }
    inner, border = slice(90, 110), slice(61, 63)
    step = {name: line[border].mean() - line[inner].mean() for name, line in tone.items()}
    assert abs(step["squarely"]) < 0.05, "0.12 before"
    assert tone["squarely"][inner].mean() - tone["slanting"][inner].mean() > 0.15


def test_tones_at_a_slant_are_held_closer():
    """What one side alone has: a shadow beside the face is none of its own."""
    spot = np.exp(-0.5 * (np.hypot(*np.mgrid[-128:128, -64:192]) < 30))[..., None]
    left = {
        name: np.log(even_out(PLAIN * spot, even=even).albedo @ LUMA)[128, 64]
        for name, even in (("square", WHOLE), ("slanting", 0 * WHOLE + 1e-3))
    }
    assert left["square"] < left["slanting"] - 0.03


def test_a_half_that_stands_in_for_the_other_is_no_second_witness():
    """What both halves have darker stays where the photo shows both; else it is held as at a slant."""
    spot = WHOLE * 0
    spot[90:150, 40:80] = spot[90:150, -80:-40] = 0.3
    both = PLAIN * np.exp(-cv2.GaussianBlur(spot, (0, 0), 4))[..., None]
    seen, stood = (even_out(both, twice=part).lift.max() for part in (WHOLE, 0 * WHOLE))
    assert seen < 0.01 < 0.03 < stood  # the wide field, which is the skin's own, has the rest


def test_skin_that_is_a_little_doubted_keeps_its_tone():
    """A bright forehead that is known by four fifths is no border: it was a round dark patch."""
    place = np.hypot(*(np.mgrid[:SIZE, :SIZE] - SIZE / 2))
    bright = PLAIN * np.exp(0.3 * np.exp(-((place / (SIZE / 8)) ** 2)))[..., None]
    doubt = WHOLE - 0.25 * (place < SIZE / 10)
    off = np.zeros_like(WHOLE)
    sure = even_out(bright, face=off).albedo
    doubted = even_out(bright, known=np.float32(doubt), face=off).albedo
    assert np.abs(np.log(doubted / sure)).max() < 0.03  # 0.1 lower before


def test_a_deep_shadow_off_the_face_is_left_to_be_filled_in():
    for level, kept in ((0.2, 0), (0.9, 1)):
        shadow = np.where(np.abs(ACROSS) < 0.3, level, 1)
        made = even_out(PLAIN * shadow, even=np.float32(np.abs(ACROSS[..., 0]) > 0.4) * WHOLE,
                        face=np.zeros((SIZE, SIZE), np.float32))  # fmt: skip
        assert_allclose(made.known[:, 120:136], kept, atol=0.02)


def test_the_edge_of_a_hard_shadow_is_left_to_be_filled_in():
    made = even_out(PLAIN * np.where(ACROSS < 0, 0.2, 1))
    assert made.known[128, 116:132].min() < 0.1
    assert made.known[128, [40, 210]].min() > 0.9


def test_a_brow_in_shadow_stays_darker_than_the_skin_beside_it():
    brow = np.ones((SIZE, SIZE, 1))
    brow[125:129] = 0.5
    plain = np.float32(brow[..., 0] == 1)
    shadow = np.where(ACROSS < 0, 0.3, 1)
    made = even_out(PLAIN * brow * shadow, plain=plain)
    ratio = (made.albedo / PLAIN)[:, 60].mean(1)
    assert_allclose(ratio[127] / ratio[[90, 160]].mean(), 0.5, atol=0.05)
    assert ratio[[90, 160]].min() > 0.8


def test_a_border_of_another_colour_is_no_skin():
    known = WHOLE.copy()
    known[:, 170:] = 0
    red = np.where((np.arange(SIZE) > 162)[None, :, None], [1.3, 0.9, 0.9], 1)
    made = even_out(PLAIN * red, known=known)
    assert made.known[128, 167:169].max() < 0.6
    assert made.known[128, 100:140].min() > 0.9
    tint = np.log(made.tone[..., 0] / made.tone[..., 2])
    assert abs(tint[128, 220] - np.log(TONE[0] / TONE[2])) < 0.05, "continued all the same"


def test_halves_are_made_alike_by_the_lighter():
    made = alike(PLAIN * np.where(ACROSS < 0, 0.4, 1).astype(np.float32), WHOLE)
    dark, lit = halves(made)
    assert abs(dark - lit) < 1e-3
    assert -0.2 < lit - np.log(TONE @ LUMA) < 0.01


def test_the_middle_of_a_wide_dark_beard_stays():
    beard = np.where(np.hypot(*np.mgrid[-128:128, -128:128]) < 60, 0.2, 1)[..., None]
    made = even_out(PLAIN * beard, plain=np.float32(beard[..., 0] == 1))
    assert_allclose((made.albedo / PLAIN)[128, 128], 0.2, rtol=0.1)
