"""Expressions by name."""

import hashlib

import numpy as np
import pytest
from numpy.testing import assert_allclose

from bakery.errors import UsageProblem
from bakery.formats import targets
from bakery.stages.texture.mouth import candidate_poses, ranging, talking
from bakery.types import EXPRESSION_INDEX, EXPRESSIONS


def weights(**named):
    out = np.zeros(len(EXPRESSIONS))
    for name, value in named.items():
        out[EXPRESSION_INDEX[name]] = value
    return out


def test_named_expressions():
    known = targets.named_expressions()
    assert {"smile", "laugh", "wink", "key:smile", "key:grimace", "viseme:AA"} <= set(known)
    assert len([name for name in known if name.startswith("viseme:")]) == 15
    assert len([name for name in known if name.startswith("key:")]) == 6
    assert known["smile"]["mouthSmileLeft"] == 0.75 and known["key:smile"]["mouthSmileLeft"] == 1
    targets.weight_rows(list(known.values()), "presets")  # ARKit's names, weights of 0 to 1


@pytest.mark.parametrize(
    "text, wanted",
    [
        ("", {}),
        ("viseme:AA", {"jawOpen": 0.6, "mouthLowerDownLeft": 0.2, "mouthLowerDownRight": 0.2}),
        ("viseme:AA=0.5", {"jawOpen": 0.3, "mouthLowerDownLeft": 0.1, "mouthLowerDownRight": 0.1}),
        (" viseme:OU = 1 , jawOpen=0.1", {"jawOpen": 0.2, "mouthPucker": 0.7, "mouthFunnel": 0.2}),
        ("jawOpen", {"jawOpen": 1}),
        ("jawOpen=0.9,viseme:OU", {"jawOpen": 1, "mouthPucker": 0.7, "mouthFunnel": 0.2}),
    ],
)
def test_text_to_weights(text, wanted):
    made = targets.expression_weights(text)
    assert made.shape == (52,) and made.dtype == np.float32
    assert_allclose(made, weights(**wanted), atol=1e-6)


@pytest.mark.parametrize(
    "text, message",
    [
        ("lauhg", "no expression 'lauhg'; did you mean 'laugh'"),
        ("viseme:aa", "did you mean 'viseme:AA'"),
        ("jawopen", "did you mean 'jawOpen'"),
        ("laugh=2", "laugh is 2.0; needs a strength of 0 to 1"),
        ("laugh=nan", "laugh is nan; needs a strength of 0 to 1"),
        ("laugh=much", "'laugh=much'; give NAME=VALUE"),
        ("laugh,laugh=0.5", "laugh comes twice"),
    ],
)
def test_wrong_expressions(text, message):
    with pytest.raises(UsageProblem, match=message):
        targets.expression_weights(text)


def test_weights_as_text():
    assert targets.parse_weights("a=1, b = 0.5,", "--weights") == {"a": 1.0, "b": 0.5}
    for text, message in (
        ("a", "give NAME=VALUE"),
        ("a=1,b=2,a=1", "a comes twice"),
        ("a=x", "'a=x'"),
    ):
        with pytest.raises(UsageProblem, match=f"--weights: .*{message}|--weights: {message}"):
            targets.parse_weights(text, "--weights")
    with pytest.raises(UsageProblem, match="no shape 'jawopne'; did you mean 'jawOpen'"):
        targets.weight_rows([{"jawopne": 1}], "--weights")


@pytest.mark.parametrize(
    "kind, digest", [(talking, "4e404ad0457a19a5"), (ranging, "8732561a805bea71")]
)
def test_visemes_have_the_numbers_that_the_shipped_mouths_were_chosen_with(kind, digest):
    """Whoever changes visemes chooses the mouths anew (`bakery train mouths`), then the digests."""
    poses = candidate_poses(np.random.default_rng(0), kind, 50)
    assert hashlib.sha256(poses.tobytes()).hexdigest()[:16] == digest
