"""The figures of an outline, on labels that are known."""

from dataclasses import replace

import numpy as np
import pytest

from bakery.evaluate import outline as outlines
from bakery.formats.portraits import landmarks_of
from bakery.geometry import camera as cameras
from bakery.geometry.raster import rasterize
from bakery.heads.outline import NAMES, outline_basis, outline_offsets
from bakery.stages.fit.outline import population
from bakery.stages.segment import BACKGROUND, CLOTHES, EARS, NECK, SKIN, Segmentation
from bakery.types import Camera, Fit

SIZE = 600


@pytest.fixture(scope="module")
def drawn(head):
    """(Fit with an outline, Segmentation that shows just that)."""
    camera = Camera(
        1.8 * SIZE, np.array([SIZE / 2, 0.45 * SIZE]), np.zeros(3), np.array([0, 0, -800.0]), SIZE, SIZE
    )  # fmt: skip
    points = cameras.project(head.landmarks(head.mean).astype(np.float64), camera)
    outline = population(head)[0]
    outline[[NAMES.index(f"ear_out_{side}") for side in ("left", "right")]] = 9
    fit = Fit(
        head.name, camera, np.zeros(1), np.zeros(52), np.zeros(2), np.zeros((9, 3)), np.zeros(0),
        np.zeros((468, 3)), points, outline=outline,
    )  # fmt: skip
    inside = cameras.to_camera((head.mean + outline_offsets(head, outline)).astype(float), camera)
    faces = head.faces[head.part_faces("skin", "eye_left", "eye_right")]
    pixels = cameras.project_camera(inside, camera)
    seen = rasterize(pixels, -inside[:, 2], faces, (SIZE, SIZE))
    kinds = np.where(head.mean[faces].mean(1)[:, 1] < -108, NECK, SKIN)
    kinds[outline_basis(head).ear[faces].mean(1) > 0.5] = EARS
    labels = np.where(seen.face >= 0, kinds[seen.face], BACKGROUND).astype(np.uint8)
    return fit, Segmentation(labels, (labels > 0).astype(np.float32))


def figures(head, fit, segmentation):
    blank = np.zeros((SIZE, SIZE, 3), np.float32)
    points = landmarks_of(fit.landmarks_projected).points
    return outlines.measure(head, fit, segmentation, points, blank)


def test_the_true_outline_is_near_perfect(head, drawn):
    found = figures(head, *drawn)
    for name in ("ears", "neck", "head", "skull"):
        assert found["after"][name] > 0.9  # pixels of half a millimetre, edges of triangles
        assert found["before"][name] < found["after"][name] - 0.05
    assert found["after"]["side_mm"] < 0.7 < found["before"]["side_mm"]


def test_what_is_hidden_has_no_figure(head, drawn):
    fit, segmentation = drawn
    labels = np.where(segmentation.labels == EARS, SKIN, segmentation.labels)
    labels = np.where(labels == NECK, CLOTHES, labels).astype(np.uint8)
    found = figures(head, fit, Segmentation(labels, segmentation.skin))
    assert "ears" not in found["after"] and "neck" not in found["after"]


def test_a_fit_without_outline_is_alike_both_ways(head, drawn):
    fit, segmentation = drawn
    found = figures(head, replace(fit, outline=np.zeros(0)), segmentation)
    assert found["before"] == found["after"]


def test_the_summary_counts_who_has_a_figure():
    both = {"before": {"ears": 0.2, "head": 0.5}, "after": {"ears": 0.8, "head": 0.7}}
    one = {"before": {"head": 0.7}, "after": {"head": 0.8}}
    assert outlines.summary([both, one]) == {
        "ears": {"before": 0.2, "after": 0.8, "photos": 1},
        "head": {"before": 0.6, "after": 0.75, "photos": 2},
    }
