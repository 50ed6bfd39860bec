"""The expression is taken out of the neutral skin: nothing without expression, what is known with it."""

import hashlib
import json
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from bakery.errors import ModelError
from bakery.heads.base import weights
from bakery.stages.atlas import make_atlas
from bakery.stages.fit.albedo import load_albedo, texel_chart
from bakery.stages.texture import TextureOptions, rest
from bakery.types import EXPRESSION_INDEX, EXPRESSIONS

SMILE = weights({"mouthSmileLeft": 0.7, "mouthSmileRight": 0.7})
SIZE = 64


@pytest.fixture()
def basis():
    """One mode: everything a tenth lighter for each unit of a smile on the left."""
    response = np.zeros((len(EXPRESSIONS), 1), np.float32)
    response[EXPRESSION_INDEX["mouthSmileLeft"]] = 1
    return rest.RestBasis(np.full((1, SIZE, SIZE, 3), 0.1, np.float32), response)


def test_no_expression_no_change():
    shipped = rest.load_rest()
    assert_allclose(rest.log_change(shipped, np.zeros(len(EXPRESSIONS))), 0)


def test_a_known_change(basis):
    assert_allclose(rest.log_change(basis, SMILE), 0.07, rtol=1e-5)
    assert_allclose(rest.log_change(basis, 100 * SMILE), rest.MOST)  # held to what folds can do


def test_it_fades_where_nothing_was_learned(basis, head):
    on_skin = make_atlas(head, 256).take("skin")
    change = rest.change_of(basis, head, on_skin, SMILE)
    place = texel_chart(head, load_albedo(), on_skin)
    border = np.minimum(place, 1 - place).min(1)
    assert_allclose(change[border > rest.EDGE], 0.07, rtol=1e-4)
    assert_allclose(change[border <= 0], 0)
    assert np.isfinite(change).all()


def test_the_shipped_basis_fills_the_folds_of_a_smile(head):
    """The fold beside the nose and the cheek's shadow get lighter, the raised cheek does not."""
    change = rest.log_change(rest.load_rest(), SMILE).mean(-1)
    layout = load_albedo().layout * change.shape[0]
    at = {name: tuple(layout[k][::-1].astype(int)) for name, k in (("fold", 206), ("brow", 9))}
    assert change[at["fold"]] > 0.03
    assert abs(change[at["brow"]]) < 0.05
    # Learned from mirrored pairs too: both sides change alike.
    assert_allclose(change, change[:, ::-1], atol=0.03)


def test_what_the_options_ask_for():
    assert rest.rest_of(TextureOptions()) is rest.load_rest()
    assert rest.rest_of(replace(TextureOptions(), neutral="keep")) is None


def test_a_missing_or_damaged_file(tmp_path):
    path = tmp_path / "rest.safetensors"
    for content in (None, b"nothing"):
        if content:
            path.write_bytes(content)
        with pytest.raises(ModelError, match="texture.neutral=keep") as told:
            rest.load_rest(path)
        assert "\n" not in str(told.value)


def test_the_card_is_of_this_file():
    card = json.loads(rest.FILE.with_suffix(".json").read_text(encoding="utf-8"))
    assert card["sha256"] == hashlib.sha256(rest.FILE.read_bytes()).hexdigest()
    assert card["metrics"]["log_ratio_undone"] < 0.95 * card["metrics"]["log_ratio"]
