"""Measures of hair, and the plain drawing that they look at."""

import numpy as np

from bakery.evaluate.hair import overlap, summary
from bakery.evaluate.hair_drawing import draw_hair
from bakery.types import Camera, HairMesh

CAMERA = Camera(100.0, np.array([20.0, 20.0]), np.zeros(3), np.array([0, 0, -100.0]), 40, 40)


def cards(colors, depths, kind=1):
    """Squares of 20 mm, one behind the other, each with one colour [r, g, b, alpha] of the atlas."""
    count = len(colors)
    square = np.array([[-10, 10, 0], [10, 10, 0], [10, -10, 0], [-10, -10, 0]], np.float32)
    corners = np.array([[0, 2, 1], [0, 3, 2]], np.int32)
    texture = np.zeros((8, 8, 4), np.float16)
    for k, color in enumerate(colors):
        texture[:, 2 * k : 2 * k + 2] = np.array(color) * [*[color[3]] * 3, 1]
    middle = [np.full((4, 2), [(2 * k + 1) / 8, 0.5]) for k in range(count)]
    return HairMesh(
        np.concatenate([square + [0, 0, z] for z in depths]).astype(np.float32),
        np.concatenate([corners + 4 * k for k in range(count)]).astype(np.int32),
        np.concatenate(middle).astype(np.float32), np.full(2 * count, kind, np.uint8),
        np.repeat(np.arange(count) if kind else [-1] * count, 2).astype(np.int32),
        np.ones(2 * count, np.uint8), np.zeros(4 * count, np.float32), texture,
        np.zeros((8, 8, 2), np.float16), np.zeros((8, 8), np.float16), np.zeros((8, 8), np.uint8),
    )  # fmt: skip


def drawn(mesh, wall=np.inf):
    return draw_hair(np.zeros((40, 40, 3), np.float32), np.full((40, 40), wall), mesh, CAMERA)


def test_the_nearer_card_lies_over_the_farther_one_in_any_order():
    red, blue = (1, 0, 0, 0.5), (0, 0, 1, 0.5)
    for colors, depths in (((red, blue), (0, 20)), ((blue, red), (20, 0))):
        color, alpha = drawn(cards(colors, depths))
        np.testing.assert_allclose(color[20, 17], [0.25, 0, 0.5], atol=1e-3)  # mixed in sRGB
        assert abs(alpha[20, 17] - 0.75) < 1e-3 and alpha[2, 2] == 0


def test_what_lies_behind_the_head_is_not_drawn():
    assert drawn(cards([(1, 0, 0, 1)], [0]), wall=90)[1].max() == 0
    assert drawn(cards([(1, 0, 0, 1)], [0]), wall=110)[1].max() == 1


def test_the_cap_hides_cards_behind_it():
    cap = cards([(0, 1, 0, 1)], [0], kind=0)
    color, alpha = drawn(cap)
    np.testing.assert_allclose(color[20, 20], [0, 1, 0], atol=1e-3)
    assert alpha[20, 20] == 1


def test_overlap_and_means():
    one, other = np.zeros((4, 4), bool), np.zeros((4, 4), bool)
    one[:2], other[1:3] = True, True
    assert overlap(one, other) == round(1 / 3, 4) and overlap(one & False, other & False) == 1
    row = {"bare": 0.8, "bare_outside": 0.5, "outside": 0.9, "seconds": 3.0}
    rows = [{"photo": str(iou), "iou": iou, "triangles": [n, 2, 1]} | row
            for n, iou in ((5, 0.9), (7, 0.7))]  # fmt: skip
    found = summary(rows)
    assert found["iou"] == 0.8 and found["worst"] == "0.7" and found["most_triangles"] == [7, 2, 1]
    assert summary([]) == {"photos": 0}
