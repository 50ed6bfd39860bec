"""Short hairs around hair with volume: where they grow, and where none may."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import cKDTree

from bakery.geometry.mesh import vertex_normals
from bakery.heads.scalp import ear_box, ear_depth, unrolled
from bakery.stages.atlas import make_atlas
from bakery.stages.texture.growth import OVAL_EAR
from bakery.stages.texture.hairline import (
    CAP,
    GOES_ON,
    THINS,
    _sampled,
    beside_mesh,
    cap_of,
    in_tones_of,
    with_short_hair,
)
from bakery.types import Camera

SIZE = 256
BEFORE = Camera(1000.0, np.array([200.0, 200.0]), np.zeros(3), np.array([0, 0, -1100.0]), 400, 400)
COLOR, RED = (0.1, 0.05, 0.02), (0.3, 0.1, 0.06)


@pytest.fixture(scope="module")
def atlas(head):
    return make_atlas(head, SIZE).take("skin")


@pytest.fixture(scope="module")
def mesh(head, hairdo):
    found = hairdo(head, head.mean, "crop")
    texture = found.texture.copy()
    texture[..., :3] = COLOR * texture[..., 3:]
    return replace(found, texture=texture)


@pytest.fixture(scope="module")
def cap(head, mesh):
    return cap_of(mesh, head, head.mean, SIZE)


@pytest.fixture(scope="module")
def grown(head, cap):
    return with_short_hair(np.zeros((SIZE, SIZE, 4), np.float32), cap, head)


def test_hair_thins_out_from_the_cap(head, atlas, mesh, grown):
    away, _ = cKDTree(_sampled(mesh, mesh.faces[(mesh.kind == CAP) & mesh.shown(0)])[0]).query(
        atlas.at(head.mean)
    )
    ear = ear_depth(unrolled(head)(atlas.at(head.mean)), ear_box(head), OVAL_EAR) < 1
    alpha = grown[..., 3].ravel()[atlas.index]
    shares = [alpha[(away >= near) & (away < near + 2) & ~ear].mean() for near in (3, 5, 7)]
    assert shares == sorted(shares, reverse=True)
    assert shares[0] > 0.5 and 0.2 < shares[1] < 0.6 and shares[2] < 0.25
    # Distances are found on a coarser grid than is painted.
    assert alpha[away > THINS[0] + 2].max() == 0 and alpha[ear].mean() < 0.02


def test_it_has_the_colour_of_the_hair_beside(grown):
    hairs = grown[grown[..., 3] > 0.5]
    colors = hairs[:, :3] / hairs[:, 3:]
    np.testing.assert_allclose(np.median(colors, 0), COLOR, rtol=0.2)  # single hairs vary by that


def test_what_the_photo_shows_lies_over_it(head, cap):
    shown = np.random.default_rng(1).uniform(0, 1, (SIZE, SIZE, 4)).astype(np.float32)
    shown[..., 3] = 1
    np.testing.assert_array_equal(with_short_hair(shown, cap, head), shown)


def test_no_cap_no_hair(head, mesh):
    layer = np.zeros((SIZE, SIZE, 4), np.float32)
    cards = replace(mesh, kind=np.maximum(mesh.kind, 1))
    np.testing.assert_array_equal(beside_mesh(layer, cards, head, head.mean, BEFORE), layer)
    np.testing.assert_array_equal(beside_mesh(layer, None, head, head.mean, BEFORE), layer)


def test_what_is_made_up_has_the_tones_of_the_mesh(head, atlas, mesh, cap):
    red = np.array([*RED, 0.5], np.float32) * [0.5, 0.5, 0.5, 1]
    layer = np.broadcast_to(red, (SIZE, SIZE, 4)).astype(np.float32)
    given = layer.copy()
    out = in_tones_of(layer, cap, cap.atlas.at(vertex_normals(head.mean, head.faces)), BEFORE)
    np.testing.assert_array_equal(layer, given)  # what is kept must not change
    np.testing.assert_array_equal(out[..., 3], layer[..., 3])
    color = (out[..., :3] / out[..., 3:]).reshape(-1, 3)[atlas.index]
    points = atlas.at(head.mean)
    normals = atlas.at(vertex_normals(head.mean, head.faces))
    away, _ = cKDTree(_sampled(mesh, mesh.faces[(mesh.kind == CAP) & mesh.shown(0)])[0]).query(
        points
    )
    # Well behind the rim that the photo shows, and well before it; a coarser grid is blurred between.
    beside, square = (away < GOES_ON[1]) & (normals[:, 2] < -0.3), normals[:, 2] > 0.6
    np.testing.assert_allclose(np.median(color[beside], 0), COLOR, rtol=0.1)
    changed = np.abs(color / RED - 1).max(1)
    assert np.quantile(changed[square], 0.95) < 0.02  # folds of ears face the camera too
    assert changed[away > GOES_ON[0] + 10].max() < 0.02


def test_without_a_cap_tones_stay(head):
    layer = np.ones((SIZE, SIZE, 4), np.float32)
    np.testing.assert_array_equal(beside_mesh(layer, None, head, head.mean, BEFORE), layer)
