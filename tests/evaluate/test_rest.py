"""Rest from a smile, measured: one photo as both of a person's is at rest already."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from bakery.bake.options import BuildOptions
from bakery.cli.options import build_options
from bakery.evaluate import rest
from bakery.evaluate.avatar.pairs import Pair
from bakery.formats.record import read_faces
from bakery.geometry.color import to_encoded, to_linear


def test_a_resting_photo_stays_as_it_is(portrait, head):
    _, (face,) = read_faces(portrait[1])
    pair = Pair("painted", portrait[0], portrait[0], face.points, face.points, True)
    made = BuildOptions()
    quick = replace(made, texture=replace(made.texture, resolution=512))
    result = rest.measure(pair, head, {"rest": quick})
    # Bilinear resampling of a grain of 0.01, by triangles of zero displacement.
    assert result.scores["warp"].face_psnr > 40
    # One photo has one geometry, and a face without expression nothing to take out.
    assert result.driven["rest"] == result.scores["rest"]
    # The plain head has neither brows nor rim light of people: what is seen at a slant gives way.
    assert result.scores["rest"].face_psnr > 26
    # Grain and slants differ, the median hardly: its own photo needs no other exposure.
    assert result.exposed["rest"].face_psnr == pytest.approx(
        result.scores["rest"].face_psnr, abs=0.3
    )
    # A face without expression has the lids of its photo; of a depth of 2 mm pixels show nothing.
    assert result.lids["rest"] == pytest.approx(result.lids["truth"], abs=0.03)
    # Brows and mouth lie where the photo has them; what parts lips stays out of a resting head.
    assert max(result.shape["rest"].values()) < 0.3
    assert list(result.pictures) == ["photo", "rest", "warp", "truth"]
    table = rest.summary([result])
    assert table["all"] == table["teeth"]
    assert table["all"]["scores"]["rest"]["hull_psnr"] == pytest.approx(
        result.scores["rest"].hull_psnr
    )


def test_the_ways_are_those_of_the_option():
    assert {name: o.texture.neutral for name, o in rest.ways().items()} == {
        rest.KEPT: "keep",
        "rest": "rest",
    }
    assert build_options("default", ("texture.neutral=keep",)) == rest.ways()[rest.KEPT]


def test_exposure_and_white_balance_are_evened():
    truth = np.random.default_rng(3).uniform(0.2, 0.8, (16, 16, 3)).astype(np.float32)
    face = np.zeros((16, 16), np.float32)
    face[4:12, 4:12] = 1
    dim = to_encoded(to_linear(truth) * [0.5, 0.6, 0.7])
    dim[0, 0] = 1  # glare beside the face says nothing
    assert_allclose(rest.exposed_alike(dim, truth, face)[4:12], truth[4:12], atol=1e-4)
    assert rest.exposed_alike(dim, truth, 0 * face) is dim
