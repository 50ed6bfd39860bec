"""Verification of people: figures by known answers."""

import numpy as np
import pytest
from torch import nn

from bakery.errors import InputError
from bakery.evaluate.identity import measure


class MeanColor(nn.Module):
    """Features of a picture: its mean colour as a direction."""

    def forward(self, pictures):
        return nn.functional.normalize(pictures.mean((2, 3)))


def plain(*color):
    return np.full((8, 8, 3), color, np.uint8)


def test_people_of_plain_colors():
    seen = [
        ("red", plain(200, 10, 10), plain(220, 20, 20)),
        ("green", plain(10, 200, 10), plain(20, 220, 20)),
        ("blue", plain(10, 10, 200), plain(20, 20, 220)),
    ]
    figures = measure(MeanColor(), seen)
    assert figures["people"] == 3
    assert figures["auc"] == 1 and figures["equal_error"] == 0 and figures["known_again"] == 1
    assert figures["same_least"] > 0.99 and figures["other_most"] < 0.3
    # Whoever smiles turns into the next one: nobody is known again.
    turned = [(a[0], a[1], b[2]) for a, b in zip(seen, seen[1:] + seen[:1])]
    figures = measure(MeanColor(), turned)
    assert figures["known_again"] == 0 and figures["auc"] < 0.3


def test_one_person_is_an_error():
    with pytest.raises(InputError, match="give at least 2"):
        measure(MeanColor(), [("red", plain(200, 0, 0), plain(210, 0, 0))])
