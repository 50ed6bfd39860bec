"""A neutral head at rest: nothing of a resting face, what is known of a smile, and all back when played."""

import hashlib
import json
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from bakery import landmarks as marks
from bakery.bake.fitting import fitted_neutral, own_head, rested, resting_head
from bakery.errors import ModelError
from bakery.heads.base import look, weights
from bakery.stages.fit import rest
from bakery.stages.fit.warp import residual_offsets
from bakery.stages.texture import TextureOptions
from bakery.train.rest import mirrored_weights
from bakery.types import EXPRESSIONS, Camera, Fit

SMILE = weights({"mouthSmileLeft": 0.7, "mouthSmileRight": 0.6, "jawOpen": 0.1})
# What fits of resting faces have: brows, eyes, and what stands for the shape of the lips.
STILL = weights(
    {"browInnerUp": 0.6, "mouthPucker": 0.5, "mouthPressLeft": 0.4, "eyeBlinkLeft": 0.2}
)


@pytest.fixture()
def fit(head):
    """A smiling person whom the model does not hold exactly."""
    rng = np.random.default_rng(0)
    camera = Camera(900.0, np.zeros(2), np.zeros(3), np.array([0, 0, -700.0]), 64, 64)
    return Fit(
        head.name, camera, rng.normal(size=40), SMILE, np.zeros(2), np.zeros((9, 3)), np.zeros(1),
        rng.normal(size=(marks.FACE, 3)) * 0.3, np.zeros((478, 2)),
    )  # fmt: skip


@pytest.fixture()
def basis():
    """One mode, whatever the residual: the mouth's corners rise, a millimetre a unit of jawOpen."""
    modes = np.zeros((1, marks.FACE, 3), np.float32)
    modes[0, marks.MOUTH_CORNERS, 1] = 1
    response = weights({"jawOpen": 1})[:, None]
    nothing = np.zeros((marks.FACE, 3, 1), np.float32)
    return rest.RestShape("makehuman", modes, np.zeros(1, np.float32), response, nothing)


def test_a_resting_face_is_left_alone(head, fit):
    """But for its lids, see below."""
    for still in (np.zeros(len(EXPRESSIONS)), STILL):
        assert rest.presence(head, still) == 0
        (found,) = rested(head, [replace(fit, expression=still)], TextureOptions())
        assert not found.rest.any()
        same, neutral = rest.at_rest(head, fitted_neutral(head, found), found)
        changed = np.abs(same.expression_basis - head.expression_basis).max((1, 2)) > 0
        # Smiles take off how the mouth rests; brows that are up at rest go up by what is left.
        wanted = {*rest.SMILES, EXPRESSIONS.index("browInnerUp")} if still.any() else set()
        assert set(np.flatnonzero(changed)) == wanted
        assert_array_equal(neutral, fitted_neutral(head, found))


def test_presence_grows_with_what_the_lips_do(head):
    found = [rest.presence(head, share * SMILE) for share in (0.0, 0.2, 0.5, 0.8, 1.4)]
    assert found == sorted(found) and found[0] == 0 and found[-1] == 1


def test_keep_keeps(head, fit):
    assert rested(head, [fit], TextureOptions(neutral="keep")) == [fit]
    (found,) = rested(head, [fit], TextureOptions())
    assert np.abs(found.rest).max() > 0.3  # mm: the shipped basis has something to say of a smile


def test_other_heads_are_left_as_fitted(head, fit):
    other = replace(head, name="another")
    assert rested(other, [fit], TextureOptions()) == [fit]


def test_a_known_basis(head, basis, fit):
    moves = rest.rest_moves(basis, weights({"jawOpen": 0.5}), fit.residual)
    assert_allclose(moves[marks.MOUTH_CORNERS], [[0, 0.5, 0]] * 2)
    assert np.count_nonzero(moves) == 2
    far = rest.rest_moves(basis, weights({"jawOpen": 1.0}) * 100, fit.residual)
    assert_allclose(np.linalg.norm(far, axis=1).max(), rest.MOST)


def test_played_as_photographed_nothing_is_changed(head, fit):
    squinting = SMILE + weights({"eyeBlinkLeft": 0.2, "eyeSquintRight": 0.5})
    fit = replace(fit, expression=look(squinting, rest.STRAIGHT), gaze=rest.STRAIGHT)
    (found,) = rested(head, [fit], TextureOptions())
    before = head.vertices(fitted_neutral(head, fit), fit.expression, fit.gaze)
    own, neutral = rest.at_rest(head, fitted_neutral(head, found), found)
    after = own.vertices(neutral, found.expression, found.gaze)
    skin = head.part_vertices("skin")
    assert_allclose(after[skin], before[skin], atol=1e-4)  # mm, single precision
    moved = neutral - fitted_neutral(head, found)
    assert_allclose(moved, residual_offsets(head, found.rest), atol=1e-5)
    half = own.vertices(neutral, found.expression / 2, (0, 0)) - head.vertices(
        fitted_neutral(head, found), found.expression / 2, (0, 0)
    )
    assert_allclose(half[skin], moved[skin] / 2, atol=1e-4)


def openness(head, fit, expression):
    shape = head.vertices(fitted_neutral(head, fit), expression, fit.gaze)
    return rest.lids_open(head.landmarks(shape))


def test_who_rests_keeps_the_lids_that_the_photo_shows(head, fit):
    seen = look(weights({"eyeBlinkLeft": 0.05, "eyeBlinkRight": 0.03}), rest.STRAIGHT)
    fit = replace(fit, expression=seen, gaze=rest.STRAIGHT)
    (found,) = rested(head, [fit], TextureOptions())
    assert np.abs(found.expression).max() < 1e-6 and np.abs(found.gaze).max() < 1e-6
    none = np.zeros(len(EXPRESSIONS))
    assert abs(openness(head, found, none) - openness(head, fit, seen)) < 1e-4
    assert openness(head, found, none) < openness(head, fit, none) - 0.02
    # Who blinks is open all the same, as far as hardly anybody's lids are not.
    shut = look(weights({"eyeBlinkLeft": 1, "eyeBlinkRight": 1}), rest.STRAIGHT)
    (found,) = rested(head, [replace(fit, expression=shut)], TextureOptions())
    assert abs(openness(head, found, none) - rest.LEAST_OPEN) < 0.01


def test_a_smile_keeps_less_of_its_squint(head, fit):
    squint = weights({"eyeSquintLeft": 0.8, "eyeSquintRight": 0.8})
    seen = look(SMILE + squint, rest.STRAIGHT)
    fit = replace(fit, expression=seen, gaze=rest.STRAIGHT)
    (found,) = rested(head, [fit], TextureOptions())
    squinted = [EXPRESSIONS.index("eyeSquint" + side) for side in ("Left", "Right")]
    assert_allclose(found.resting[squinted] + found.expression[squinted], 0.8, atol=1e-6)
    assert 0 < found.resting[squinted[0]] < 0.8
    wanted = np.dot(rest.OF_SMILE, (1, openness(head, fit, seen)))
    assert abs(openness(head, found, np.zeros(len(EXPRESSIONS))) - wanted) < 0.01


def test_who_rests_keeps_brows_and_mouth(head, fit):
    """A wide mouth under low brows is who that is: the neutral head has both, and no weights are left."""
    own = {"browDownLeft": 0.5, "browDownRight": 0.4, "mouthDimpleLeft": 0.1, "mouthPucker": 0.1}
    fit = replace(fit, expression=look(weights(own), rest.STRAIGHT), gaze=rest.STRAIGHT)
    (found,) = rested(head, [fit], TextureOptions())
    assert np.abs(found.expression).max() < 1e-6 and not found.rest.any()
    _, neutral = resting_head(head, found)
    as_photographed = head.vertices(fitted_neutral(head, fit), fit.expression, fit.gaze)
    points = [head.landmarks(shape)[: marks.FACE] for shape in (neutral, as_photographed)]
    lids = np.concatenate(marks.EYES)
    apart = np.linalg.norm(points[0] - points[1], axis=1)
    assert np.delete(apart, lids).max() < 0.05 and apart[lids].max() < 1.5  # lids by their own rule
    assert_allclose(rest.shown(found)[rest.BROWS], fit.expression[rest.BROWS], atol=1e-6)
    # The lips of an avatar are closed, whatever parted them by a little.
    open_mouth = look(weights({"jawOpen": 0.03, **own}), rest.STRAIGHT)
    (found,) = rested(head, [replace(fit, expression=open_mouth)], TextureOptions())
    assert_allclose(found.expression[EXPRESSIONS.index("jawOpen")], 0.03)


def assert_plays_as_plain(head, found, played, which):
    """Played in full, weights look as if those of `which` did not rest; another shape has the model's plain ones."""
    mine, neutral = rest.at_rest(head, fitted_neutral(head, found), found)
    others = found.resting.copy()
    others[which] = 0
    bare = fitted_neutral(head, replace(found, resting=others))
    back = rest.played_back(head, neutral, found, played)
    skin = head.part_vertices("skin")
    for own, plain in ((neutral, bare), (neutral + back, neutral)):
        assert_allclose(
            mine.vertices(own, played, (0, 0))[skin],
            head.vertices(plain, played, (0, 0))[skin],
            atol=1e-4,
        )


def test_a_smile_takes_the_mouth_off_its_resting_shape(head, fit):
    own = weights({"mouthPucker": 0.2, "mouthSmileLeft": 0.3, "mouthSmileRight": 0.05})
    (found,) = rested(head, [replace(fit, expression=own)], TextureOptions())
    left, right = rest.SMILES
    # What is more than resting mouths have is a faint smile.
    assert_allclose(found.resting[[left, right]], [rest.MOST_ACTIVE, 0.05], atol=1e-6)
    assert_allclose(found.expression[left], 0.3 - rest.MOST_ACTIVE, atol=1e-6)
    grin = weights({"mouthSmileLeft": 1.0, "mouthSmileRight": 1.0})
    assert_plays_as_plain(head, found, grin, rest.MOUTH)


def test_a_mouth_hardly_rests_to_one_side(head, fit):
    """What is more than nine of ten mouths have is played: the photo's own weights look as before."""
    own = weights({"mouthLeft": 0.4, "jawLeft": 0.2, "mouthRight": 0.05})
    (found,) = rested(head, [replace(fit, expression=own)], TextureOptions())
    places = [EXPRESSIONS.index(name) for name in ("mouthLeft", "jawLeft", "mouthRight")]
    assert_allclose(found.resting[places], [rest.MOST_SIDEWAYS] * 2 + [0.05], atol=1e-6)
    assert_allclose(
        found.expression[places], [0.4 - rest.MOST_SIDEWAYS, 0.2 - rest.MOST_SIDEWAYS, 0], atol=1e-6
    )


def test_brows_go_as_far_as_anybodys(head, fit):
    """Low brows at rest are not lowered twice, and another shape keeps the model's plain frown."""
    own = weights({"browDownLeft": 0.6, "browDownRight": 0.6})
    (found,) = rested(head, [replace(fit, expression=own)], TextureOptions())
    frown = weights({"browDownLeft": 1.0, "browDownRight": 1.0})
    assert_plays_as_plain(head, found, frown, rest.BROWS)


def test_other_photos_weights_are_told_from_the_resting_ones(head, fit):
    own = weights({"browDownLeft": 0.5, "mouthPucker": 0.2})
    (mine,) = rested(head, [replace(fit, expression=own)], TextureOptions())
    (other,) = rested(head, [replace(fit, expression=SMILE + own)], TextureOptions())
    played = rest.played_on(other, mine.resting)
    assert_allclose(played.expression[rest.BROWS], 0, atol=1e-6)
    assert_allclose(played.expression[rest.MOUTH], SMILE[rest.MOUTH], atol=1e-6)
    assert_array_equal(played.gaze, other.gaze)


def test_a_smile_keeps_brows_alone_and_not_any(head, fit):
    low = weights({"browDownLeft": 0.5, "browInnerUp": 1.0})
    (found,) = rested(head, [replace(fit, expression=SMILE + low)], TextureOptions())
    raised, lowered = (EXPRESSIONS.index(name) for name in ("browInnerUp", "browDownLeft"))
    assert_allclose(found.resting[[raised, lowered]], [rest.MOST_BROWS, 0.5])
    assert not found.resting[rest.MOUTH].any()
    assert_allclose(found.expression[[raised, lowered]], [1 - rest.MOST_BROWS, 0], atol=1e-12)
    assert_allclose(rest.shown(found)[rest.ACTIVE], SMILE[rest.ACTIVE])


def test_a_smile_of_one_side_gives_back_that_side(head, fit):
    (found,) = rested(head, [fit], TextureOptions())
    plain = fitted_neutral(head, found)
    right, left = marks.MOUTH_CORNERS
    back = rest.played_back(head, plain, found, weights({"mouthSmileLeft": 0.7}))
    moved = np.linalg.norm(head.landmarks(residual_offsets(head, found.rest)), axis=1)
    given = np.linalg.norm(head.landmarks(back), axis=1)
    assert given[left] > 0.7 * moved[left]
    assert given[right] < 0.4 * moved[right]


def test_another_persons_shape_keeps_plain_expressions(head, fit):
    """Own expressions on another neutral shape, with what is played back, are those of the model."""
    (found,) = rested(head, [fit], TextureOptions())
    plain = fitted_neutral(head, found)
    own, _ = rest.at_rest(head, plain, found)
    played = weights({"mouthSmileLeft": 0.3, "jawOpen": 0.5})
    other = head.neutral(np.full(5, 0.5))
    back = rest.played_back(head, plain, found, played)
    skin = head.part_vertices("skin")
    assert_allclose(
        own.vertices(other + back, played, (0, 0))[skin],
        head.vertices(other, played, (0, 0))[skin],
        atol=1e-4,
    )


def test_the_avatars_head_is_the_resting_one(head, fit):
    (found,) = rested(head, [fit], TextureOptions())
    plain, neutral = resting_head(head, found)
    own, whole = own_head(head, found)
    assert_array_equal(whole[: len(neutral)], neutral)
    assert plain.expression_basis.shape == head.expression_basis.shape
    kept, _ = own_head(head, fit)
    smile = EXPRESSIONS.index("mouthSmileLeft")
    assert np.abs(own.expression_basis[smile] - kept.expression_basis[smile]).max() > 0.1


def test_one_photo_at_rest_speaks_for_all(head, fit):
    still = replace(fit, expression=STILL)
    assert not any(found.rest.any() for found in rested(head, [fit, still], TextureOptions()))
    both = rested(head, [fit, fit], TextureOptions())
    (alone,) = rested(head, [fit], TextureOptions())
    assert_array_equal(both[0].rest, alone.rest)


def test_the_shipped_basis_knows_no_side(head, fit):
    """Of a mirrored photo it says the mirrored."""
    twin, other = mirrored_weights(), marks.mirror_landmarks(head.landmarks(head.mean))
    basis = rest.load_rest_shape()
    moves = rest.rest_moves(basis, fit.expression, fit.residual)
    flipped = fit.residual[other] * [-1, 1, 1]
    mirrored = rest.rest_moves(basis, fit.expression[twin], flipped)
    assert_allclose(mirrored, moves[other] * [-1, 1, 1], atol=0.02)  # mm; kept in half precision
    still = np.concatenate([*marks.EYES, marks.BROWS])
    assert not moves[still].any()


def test_a_missing_or_damaged_file(tmp_path):
    path = tmp_path / "shape.safetensors"
    for content in (None, b"nothing", rest.FILE.with_name("rest.safetensors").read_bytes()):
        if content:
            path.write_bytes(content)
        with pytest.raises(ModelError, match="texture.neutral=keep") as told:
            rest.load_rest_shape(path)
        assert "\n" not in str(told.value)


def test_the_card_is_of_this_file():
    card = json.loads(rest.FILE.with_suffix(".json").read_text(encoding="utf-8"))
    assert card["sha256"] == hashlib.sha256(rest.FILE.read_bytes()).hexdigest()
    # What the neutral photo shows of a mouth's rest by weights is part of the aim, and hardly to be told of a smile.
    for group in ("lips", "corners"):
        before, after = card["metrics"][group]
        assert after < 0.92 * before
    assert card["metrics"]["resting_lips_moved"] < 0.1


def test_corners_come_half_of_the_way_to_the_usual_place(head):
    points = head.landmarks(head.mean).astype(float)[: marks.FACE]
    middle = points[rest.SEAM, 1].mean()
    points[marks.MOUTH_CORNERS, 1] = middle + rest.USUAL
    assert_allclose(rest.corner_moves(points), 0, atol=1e-9)  # a usual mouth stays
    right, left = marks.MOUTH_CORNERS
    points[right, 1] -= 2.0  # one corner hangs
    moves = rest.corner_moves(points)
    assert_allclose(moves[right, 1], 2.0 * (1 - rest.BELIEVED))
    assert np.abs(moves[left]).max() < 0.02  # 50 mm away
    assert (moves[:, [0, 2]] == 0).all()
    far = np.linalg.norm(points - points[right], axis=1) > 40
    assert np.abs(moves[far]).max() < 1e-3


def test_corners_move_on_from_where_rest_moves_brought_them(head, fit):
    (found,) = rested(head, [fit], TextureOptions())
    bare = rest.rest_moves(rest.load_rest_shape(), fit.expression, fit.residual)
    sure = rest.presence(head, fit.expression)
    points = head.landmarks(fitted_neutral(head, fit))[: marks.FACE] + bare
    assert_allclose(found.rest, sure * (bare + rest.corner_moves(points)), atol=1e-9)
