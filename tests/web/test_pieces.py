"""The player draws the pieces that the export writes: which is a card, which lies behind the lips."""

import json

import pytest

from bakery.export.web.head import PIECES
from bakery.heads.base import CARDS, PROXIES
from bakery.runtime.render import SHOWN
from tests.web.test_build import VIEWER


@pytest.fixture(scope="module")
def known(request, node):
    source = VIEWER / "src"
    return json.loads(
        node(request.path.with_name("pieces.mjs"), source / "glb.js", source / "shaders.js")
    )


def test_every_piece_that_is_written_is_drawn(known):
    assert sorted(known["pieces"]) == sorted(PIECES)


def test_the_image_based_head_is_that_of_the_reference(known):
    assert sorted(known["image"]) == sorted(SHOWN) and set(PROXIES) < set(known["image"])


def test_cards_are_lashes_and_tear_line_and_no_teeth(known):
    assert sorted(known["cards"]) == sorted(known["shaded"]) == sorted(CARDS)
