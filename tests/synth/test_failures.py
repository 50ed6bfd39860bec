"""Portraits that spoil an avatar: each is named for what it is, and good ones are not."""

from pathlib import Path

import numpy as np
import pytest

from bakery.bake.fitting import fit_portrait
from bakery.formats.image import read_photo
from bakery.plugins import plug_in
from bakery.stages.assess import assess
from bakery.stages.detect import detect_faces
from bakery.stages.segment import GLASSES, HIDDEN
from bakery.synth.failures import CASES, paint_case
from bakery.types import Photo

SAMPLES = Path(__file__).parents[2] / "samples"
QUICK = {"detail": 2.0, "share": 0.1, "supersample": 1, "quality": 0.2}


@pytest.fixture(scope="module")
def examine(head):
    detector = plug_in("detectors", "network")

    def run(photo):
        face = detect_faces(photo.encoded, detector)[0]
        fit, segmentation = fit_portrait("painted", photo, face, head)
        return [found.code for found in assess(photo, face, fit, segmentation)], segmentation

    return run


def painted(head, name):
    scale = 1.0 if name == "small" else 0.5
    return Photo(np.ascontiguousarray(paint_case(head, name, scale, **QUICK)), "0" * 64)


EVERY_RUN = {"smile", "half-shadow"}  # the others: `make proofs`


@pytest.mark.parametrize(
    "name",
    [name if name in EVERY_RUN else pytest.param(name, marks=pytest.mark.slow) for name in CASES],
)
def test_each_failure_is_named(head, examine, name):
    codes, segmentation = examine(painted(head, name))
    assert CASES[name].code in codes
    face = segmentation.regions[
        segmentation.regions.shape[0] // 4 : -segmentation.regions.shape[0] // 4
    ]
    if name in ("fringe", "half-shadow"):
        assert (face == HIDDEN).mean() > 0.03, "left to the other side"
    if name == "dark-glasses":
        assert (segmentation.skin[segmentation.labels == GLASSES] == 0).all(), "no skin"


# A fringe does hide the forehead.
TRUE_OF = {"fumiko": {"hair"}, "anna": {"hair_cut"}}  # her locks reach the lower edge


@pytest.mark.parametrize("name", ["anna", "bela", "chidi", "emil", "fumiko"])
def test_good_portraits_are_not(examine, name):
    assert set(examine(read_photo(SAMPLES / f"{name}.jpg"))[0]) == TRUE_OF.get(name, set())
