"""Curls: told from straight hair, put together to a tile, and laid on where nobody has seen."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from bakery.stages.hair import atlas, curls, directions, make_hair
from bakery.stages.hair.curls import (
    INNER,
    MOST,
    PATCHES,
    TILE,
    Curls,
    curliness,
    quilt,
    take_curls,
)
from bakery.stages.hair.portrait import look
from tests.stages.test_hair_volume import bob, fit, head, painted  # noqa: F401

SIDE = 400


def blobs(sigma=2.0, seed=2, side=SIDE):
    """Noise [side, side] of unit variance in spots of no direction, as tight curls look."""
    noise = np.random.default_rng(seed).normal(size=(side, side)).astype(np.float32)
    noise = cv2.GaussianBlur(noise, (0, 0), sigma)
    return noise / noise.std()


def stripes():
    return np.sin(np.arange(SIDE) * 2 * np.pi / 3.5)[None] * np.ones((SIDE, 1))


def portrait_of(pattern, head, fit, thick=22):  # noqa: F811
    hair = bob(head, fit, thick)
    picture, labels = painted(head, fit, hair)
    picture[hair] = (0.3 * np.exp(0.3 * pattern))[hair][:, None]
    return picture.clip(0, 1), labels, look(picture.clip(0, 1), labels, fit, head, head.mean)


def test_stripes_are_straight_and_spots_are_curls(head, fit):  # noqa: F811
    for pattern, low, high in ((stripes(), 0.0, 0.0), (blobs(), 0.9, 1.0)):
        _, _, portrait = portrait_of(pattern, head, fit)
        assert low <= curliness(portrait, *directions.photographed(portrait)) <= high
    nothing = replace(portrait, hair=np.zeros_like(portrait.hair))
    assert curliness(nothing, *directions.photographed(nothing)) == 0


def test_noise_in_even_hair_is_no_curls(head, fit):  # noqa: F811
    """Hair combed back: strands where light falls on it, the photo's noise where it is even and dark."""
    even = np.arange(SIDE) > 0.45 * SIDE
    pattern = np.where(even[None], 0.05 * blobs(1.0), stripes())
    _, _, portrait = portrait_of(pattern, head, fit)
    assert curliness(portrait, *directions.photographed(portrait)) < 0.1
    portrait = portrait_of(0.05 * blobs(1.0), head, fit)[2]
    assert curliness(portrait, *directions.photographed(portrait)) > 0.5


def test_a_tile_repeats_without_a_seam():
    field = blobs(3.0)
    rng = np.random.default_rng(1)
    corners = rng.integers(0, SIDE - 24, (500, 2))
    pieces = np.stack([field[y : y + 24, x : x + 24] for y, x in corners])
    tile = quilt(pieces, 8, 6, rng)
    assert tile.shape == (96, 96)
    inside = np.abs(np.diff(tile, axis=1)).mean()
    across = np.abs(tile[:, 0] - tile[:, -1]).mean()
    down = np.abs(tile[0] - tile[-1]).mean()
    # Spots of 3 pixels change by 0.25 of their deviation a pixel; strangers differ by 1.1.
    assert max(across, down) < 1.5 * inside
    assert 0.7 < tile.std() < 1.1


def test_a_pattern_keeps_its_contrast_from_all_sides():
    rng = np.random.default_rng(3)
    normals = rng.normal(size=(4000, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    curls = Curls(blobs(2.0, side=128), 1.5)
    level = curls.at(rng.uniform(-200, 200, (4000, 3)), normals)
    assert 0.8 < level.std() < 1.2
    # It repeats: a point and one a tile beside it are the same.
    point = rng.uniform(-50, 50, (50, 3))
    up = np.tile([0.0, 1.0, 0.0], (50, 1))
    moved = point + [128 / 1.5, 0, 0]
    assert np.allclose(curls.at(point, up), curls.at(moved, up), atol=1e-4)


def test_the_photos_contrast_is_taken_within_limits(head, fit):  # noqa: F811
    for strength, wanted in ((0.5, None), (4.0, MOST)):
        _, _, portrait = portrait_of(strength * blobs(), head, fit, 30)
        taken = take_curls(portrait)
        assert len(taken.tile) == pytest.approx(
            TILE * portrait.scale, abs=PATCHES[0] * portrait.scale
        )
        if wanted:
            assert taken.tile.std() <= wanted + 1e-3
    few = replace(portrait, hair=portrait.hair * (np.arange(portrait.hair.shape[0]) < 20)[:, None])
    assert take_curls(few) is None


def test_a_narrow_border_of_hair_gives_smaller_pieces(head, fit, monkeypatch):  # noqa: F811
    """None of the large ones would be left inside of it."""
    _, _, portrait = portrait_of(blobs(), head, fit, 30)
    rows = np.arange(portrait.hair.shape[0])
    top = int(np.nonzero(portrait.hair.max(1) > 0.95)[0][0])
    heights = (top + mm * portrait.scale for mm in np.arange(2 * INNER + 8, 60))
    borders = (replace(portrait, hair=portrait.hair * (rows < below)[:, None]) for below in heights)
    narrow = next(border for border in borders if take_curls(border) is not None)
    monkeypatch.setattr(curls, "PATCHES", PATCHES[:1])
    assert take_curls(narrow) is None


def test_the_back_of_curls_is_curls(head, fit):  # noqa: F811
    """Seen from behind, hair is as mottled across as along; straight hair runs down."""
    found = []
    for pattern in (stripes(), blobs()):
        picture, labels, _ = portrait_of(pattern, head, fit, 30)
        mesh = make_hair(picture, labels, fit, head, head.mean)
        tall = int(atlas.CAP_PART * len(mesh.texture))
        cap = mesh.texture[tall // 3 : tall, :200, :3].astype(np.float32).mean(-1)  # the back
        level = np.log(np.maximum(cap, 1e-3))
        level -= cv2.GaussianBlur(level, (0, 0), 12)
        found.append(np.abs(np.diff(level, axis=0)).mean() / np.abs(np.diff(level, axis=1)).mean())
    straight, curly = found
    assert curly > 1.5 * straight
