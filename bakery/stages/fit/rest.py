"""The shape of a face at rest, of a photo with an expression.

What blendshapes miss of a smile ends in identity and warp, and so in the neutral head: wide or curled
lips, lifted cheeks. How far its landmarks lie from those of the resting face was learned from pairs of
photos (`train.rest_shape`), as a linear function of the expression weights and the residual warp that
fades in as the lips move; a face without expression is not changed.

What is taken off the neutral head goes to the expressions that the photo shows, so that the avatar that
plays them comes back to the photo.

References:
    Li, Weise and Pauly, "Example-based facial rigging", SIGGRAPH 2010: a person's own blendshapes.
"""

from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import numpy as np

from bakery import landmarks as marks
from bakery.formats.tensors import reading
from bakery.geometry.fill import smoothstep
from bakery.heads.base import HeadModel, look
from bakery.paths import ASSETS
from bakery.stages.fit.warp import residual_offsets
from bakery.types import EXPRESSION_INDEX, EXPRESSIONS, Fit

FILE = ASSETS / "rest" / "shape.safetensors"
REMEDY = "reinstall bakery, or keep the expression: --set texture.neutral=keep"
# Expressions that a mouth at rest does not show. Pucker, press and shrug are not among them: in the
# fit of a resting face they stand for the shape of the lips.
OPENING = (
    "jawOpen mouthSmile mouthLowerDown mouthUpperUp mouthDimple mouthStretch mouthFunnel cheekSquint"
).split()
ACTIVE = np.array([k for k, name in enumerate(EXPRESSIONS) if name.startswith(tuple(OPENING))])
# mm, root mean square motion of the lips by these: 94% of the resting photos of london/train lie below 1.5,
# 75% of the smiling ones above 2.
RESTING, MOVING = 1.5, 3.0
MOST = 4.0  # mm; nobody's smile leaves more in the neutral head
MIDDLE = (
    8.0  # mm to either side of the face's middle: an expression of one side fades out over them
)
OTHER_SIDE = 0.15  # what it keeps of the other side, so that every correction belongs to something
# Degrees: how far down the eyes of people who look straight into a camera at the height of their eyes are found to
# look (83 of congress/val, -5.9 with a standard deviation of 1.9, the camera 0.2 above): the head's eyeballs lie
# higher between the lids than people's.
STRAIGHT = np.array([0.0, -5.9])
# How far lids are open, of the width of an eye: in the mean of 24 neutral photos of london/train 0.315 (standard
# deviation 0.028); without any weight 0.355 (0.021). Of a smile this is believed, the least squares line of
# the same people (rms 0.018); fewer than one in a hundred neutral photos have less than the least.
OF_SMILE, LEAST_OPEN = (0.161, 0.53), 0.25
CLOSING = np.array(
    [
        EXPRESSION_INDEX[f"eye{name}{side}"]
        for name in ("Blink", "Squint")
        for side in ("Left", "Right")
    ]
)
LIDS = np.append(CLOSING, [EXPRESSION_INDEX["eyeLookDown" + side] for side in ("Left", "Right")])
# How high brows are is a person's own: of 62 people of london/train, smiling and neutral photo agree by 0.95 in it,
# and the mean differs by 0.3 mm. The fit explains it by expressions (browDown is 0.4 in the mean of congress).
# Nine of ten resting photos have no more of any of them.
BROWS = np.array([k for k, name in enumerate(EXPRESSIONS) if name.startswith("brow")])
MOST_BROWS = 0.75
# A resting mouth, too: its width is told by smile, dimple and stretch, its lips by pucker and roll. What parts
# lips is not among them, for the avatar's are closed. Of ACTIVE ones nine of ten resting photos have no more
# than MOST_ACTIVE; what is more is a faint smile.
PARTING = "mouthClose mouthLowerDown mouthUpperUp mouthFunnel jawOpen".split()
MOUTH = np.array(
    [
        k
        for k, name in enumerate(EXPRESSIONS)
        if name.startswith(("mouth", "jaw", "cheek", "nose"))
        and not name.startswith(tuple(PARTING))
    ]
)
MOST_ACTIVE = 0.1
# A mouth that rests to one side: nine of ten resting photos from the front (80 of london/train) have no more.
# What is more is how a turned head is seen: of 121 photos of congress/train mouthLeft goes with the head's turn
# (correlation 0.70, 1.4 mm for 10 degrees), of those from the front it does not (0.06).
SIDEWAYS = np.array(
    [EXPRESSION_INDEX[name + side] for name in ("mouth", "jaw") for side in ("Left", "Right")]
)
MOST_SIDEWAYS = 0.12
SHOWN = np.concatenate([BROWS, MOUTH])
SMILES = [EXPRESSION_INDEX["mouthSmile" + side] for side in ("Left", "Right")]
SEAM = np.array([13, 14])  # the middle of the inner lips
# mm that the corners of resting mouths stand above the middle of the seam, in the mean of london/train's (young
# people, -1.7) and congress/train's (older ones, +0.5), and what is believed of how far those found of a smile
# differ from that: the best for pairs of london/train, each left out in turn (docs/log-rest.md).
USUAL, BELIEVED = -0.6, 0.7
CORNER = 9.0  # mm around a corner, standard deviation of what is moved with it


@dataclass(frozen=True, eq=False)
class RestShape:
    """What the expressions of one head model leave in neutral landmarks: K modes, E expressions."""

    head: str  # its name; what other heads leave is not known
    modes: np.ndarray  # [K, 468, 3] float32 mm
    constant: np.ndarray  # [K] float32, amount of each mode in any face that moves its lips
    response: np.ndarray  # [E, K] float32, a unit of expression weight
    by_residual: np.ndarray  # [468, 3, K] float32, a mm of the residual warp


ARRAYS = ("modes", "constant", "response", "by_residual")


@lru_cache(maxsize=4)
def load_rest_shape(path: Path = FILE) -> RestShape:
    """Read a RestShape.

    Raises:
        ModelError: the file is missing or damaged.
    """
    from safetensors import safe_open

    with reading("resting shape", path, REMEDY):
        with safe_open(path, "numpy") as file:
            arrays = [file.get_tensor(name).astype(np.float32) for name in ARRAYS]
            basis = RestShape(str((file.metadata() or {})["head"]), *arrays)
        count = len(basis.constant)
        if basis.modes.shape != (count, marks.FACE, 3):
            raise ValueError(f"modes of shape {list(basis.modes.shape)}")
        if basis.response.shape != (len(EXPRESSIONS), count):
            raise ValueError(f"response of shape {list(basis.response.shape)}")
        if basis.by_residual.shape != (marks.FACE, 3, count):
            raise ValueError(f"by_residual of shape {list(basis.by_residual.shape)}")
        return basis


def presence(head: HeadModel, expression: np.ndarray) -> float:
    """How surely the mouth is not at rest, 0..1, by how far its weights [E] move the lips."""
    corners = head.landmark_vertices[marks.LIPS]
    weight = head.landmark_barycentric[marks.LIPS]
    moved = np.tensordot(
        np.asarray(expression)[ACTIVE], head.expression_basis[ACTIVE][:, corners], 1
    )
    moved = np.einsum("lkc,lk->lc", moved, weight)
    return float(smoothstep(RESTING, MOVING, np.sqrt((moved**2).sum(1).mean())))


def rest_moves(basis: RestShape, expression: np.ndarray, residual: np.ndarray) -> np.ndarray:
    """How the landmarks of the neutral head of a moved mouth come to rest: [468, 3] mm.

    It counts as far as the mouth moved, see `presence`.

    Args:
        expression: [E] weights of the fit; residual: [468, 3] mm, its residual warp.
    """
    amounts = basis.constant + np.asarray(expression, np.float32) @ basis.response
    amounts = amounts + np.tensordot(np.asarray(residual, np.float32), basis.by_residual, 2)
    moves: np.ndarray = np.tensordot(amounts, basis.modes, 1).astype(np.float64)
    length = np.linalg.norm(moves, axis=1).max()
    return min(1.0, MOST / max(length, 1e-9)) * moves


def corner_moves(points: np.ndarray) -> np.ndarray:
    """How landmarks [468 or more, 3] mm at rest go on to where mouths usually have their corners: [468, 3].

    A smile hides how far corners hang: what is found of it is half chance.
    """
    middle = points[SEAM, 1].mean()
    moves = np.zeros((marks.FACE, 3))
    for corner in points[marks.MOUTH_CORNERS]:
        off = corner[1] - middle - USUAL
        away = np.linalg.norm(points[: marks.FACE] - corner, axis=1)
        moves[:, 1] -= (1 - BELIEVED) * off * np.exp(-((away / CORNER) ** 2) / 2)
    return moves


def resting_weights(
    head: HeadModel, neutral: np.ndarray, expression: np.ndarray, sure: float
) -> np.ndarray:
    """The weights [E] with which this person rests, as `Fit.resting`: of lids, brows and mouth.

    Of the mouth's a face at rest keeps all, an expressive one none: how it rests is told by `rest_moves`.

    Args:
        head: HeadModel; neutral: [V, 3] mm, the neutral shape of a fit with all weights [E] of it.
        sure: 0..1, how surely the face is not at rest.
    """
    out = np.zeros(len(EXPRESSIONS))
    out[LIDS] = _resting_lids(head, neutral, expression, sure)
    out[BROWS] = np.minimum(expression[BROWS], MOST_BROWS)
    out[MOUTH] = (1 - sure) * expression[MOUTH]
    out[ACTIVE] = np.minimum(out[ACTIVE], MOST_ACTIVE)
    out[SIDEWAYS] = np.minimum(out[SIDEWAYS], MOST_SIDEWAYS)
    return out


def _resting_lids(head, neutral, expression, sure):
    """The weights [6] of LIDS.

    They lie where the eyes look STRAIGHT. A face at rest keeps all blink and squint that the photo shows; a
    smile narrows eyes, and more of both is the smile's.
    """
    out = look(np.zeros(len(EXPRESSIONS)), STRAIGHT)[LIDS].astype(np.float64)
    closing = np.zeros(len(LIDS))
    closing[: len(CLOSING)] = expression[CLOSING]

    def opening(lids):
        moves = np.tensordot(lids, head.expression_basis[LIDS], 1).astype(np.float32)
        return lids_open(head.landmarks(neutral + moves))

    most, least = opening(out), opening(out + closing)
    if most - least > 1e-3:
        seen = lids_open(head.landmarks(head.vertices(neutral, expression, (0, 0))))
        wanted = max(seen + sure * (np.dot(OF_SMILE, (1, seen)) - seen), LEAST_OPEN)
        out += np.clip((most - wanted) / (most - least), 0, 1) * closing
    return out


def resting_moves(head: HeadModel, resting: np.ndarray) -> np.ndarray:
    """How resting weights [E] move the vertices of a neutral head: [V, 3] float32 mm."""
    some = np.flatnonzero(resting)
    out: np.ndarray = np.tensordot(resting[some], head.expression_basis[some], 1).astype(np.float32)
    return out


def with_resting(fit: Fit, resting: np.ndarray) -> Fit:
    """The same shape and look, of a neutral head with weights [E] of its own that looks STRAIGHT."""
    expression = np.maximum(fit.expression - resting, 0)
    gaze = fit.gaze - STRAIGHT
    return replace(
        fit, expression=look(expression, gaze).astype(np.float64), gaze=gaze, resting=resting
    )


def shown(fit: Fit) -> np.ndarray:
    """The weights [E] of brows and mouth that the photo shows, with those of its resting head; others as they are."""
    return np.minimum(fit.expression + only(fit.resting, SHOWN), 1)


def only(weights: np.ndarray, which: np.ndarray) -> np.ndarray:
    """Some of weights [E], the others 0."""
    out = np.zeros(len(EXPRESSIONS))
    out[which] = weights[which]
    return out


def played_on(fit: Fit, resting: np.ndarray) -> Fit:
    """The same weights for another neutral head of this person, which has `resting` [E] of brows and mouth."""
    return replace(fit, expression=np.maximum(shown(fit) - only(resting, SHOWN), 0))


def lids_open(points: np.ndarray) -> float:
    """How far lids are open at their middle, of the width of the eye, in the mean; less than 0 if they cross.

    Args:
        points: [L, 2 or 3] landmarks of any unit, y up.
    """
    far = []
    for upper, lower in zip(marks.LIDS_UPPER, marks.LIDS_LOWER):
        apart = points[upper[3:6]] - points[lower[3:6]]
        length = np.sign(apart[:, 1]) * np.linalg.norm(apart, axis=1)
        far.append(length.mean() / np.linalg.norm(points[upper[0]] - points[upper[-1]]))
    return float(np.mean(far))


def at_rest(head: HeadModel, neutral: np.ndarray, fit: Fit) -> tuple[HeadModel, np.ndarray]:
    """The head whose neutral shape is at rest (`Fit.rest`), and that shape.

    Its expressions take up what the neutral shape loses: played with the photo's own weights, the
    head has the same shape as before. A smile takes the mouth off its resting shape, as pursed lips
    are no longer pursed in it, and brows that lie low at rest go down by what is left: of a photo that has
    more than MOST_BROWS of one, played with its own weights, a quarter of what is more.

    Args:
        head: HeadModel; neutral: [V, 3] mm, the fitted neutral shape.

    Returns:
        HeadModel with its own expression_basis, the one given if nothing is to be taken off;
        [V, 3] mm.
    """
    mouth = _resting_mouth(head, fit)
    if not (fit.rest.any() or mouth.any() or fit.resting[BROWS].any()):
        return head, neutral
    basis = head.expression_basis.copy()
    basis[BROWS] *= (1 - fit.resting[BROWS]).astype(np.float32)[:, None, None]
    for shape in SMILES:
        basis[shape] -= _share(EXPRESSIONS[shape], neutral[:, 0])[:, None] * mouth
    offsets = residual_offsets(head, fit.rest)
    for shape, part in zip(ACTIVE, _parts(fit.expression, neutral[:, 0])):
        basis[shape] -= part[:, None] * offsets
    return replace(head, expression_basis=basis), (neutral + offsets).astype(neutral.dtype)


def played_back(
    head: HeadModel, neutral: np.ndarray, fit: Fit, expression: np.ndarray
) -> np.ndarray:
    """What expressions of the head `at_rest` put back of what was taken off, negated: [V, 3] mm.

    Added to a neutral shape that is not this person's, it leaves the head's plain expressions.

    Args:
        head: HeadModel, as fitted; neutral: [V, 3] mm, its fitted neutral shape; fit: its Fit.
        expression: [E] weights that are played.
    """
    weights, across = np.asarray(expression), neutral[:, 0]
    smile = sum(weights[shape] * _share(EXPRESSIONS[shape], across) for shape in SMILES)
    share = np.tensordot(weights[ACTIVE], _parts(fit.expression, across), 1)
    out = smile[:, None] * _resting_mouth(head, fit)
    out += share[:, None] * residual_offsets(head, fit.rest)
    out += np.tensordot((weights * fit.resting)[BROWS], head.expression_basis[BROWS], 1)
    return out.astype(np.float32)


def _resting_mouth(head, fit):
    """How the resting weights of the mouth move vertices: [V, 3] mm."""
    return resting_moves(head, only(fit.resting, MOUTH))


def _share(name, across):
    """How much of a vertex's side an expression of one side has: [V] 0..1, both sides together 1.

    Args:
        across: [V] mm, to the subject's left.
    """
    return smoothstep(-MIDDLE, MIDDLE, across * _side(name))


def _parts(expression, across):
    """Share [len(ACTIVE), V] of a vertex's correction that each expression undoes a unit of weight.

    By weight, as regression of one example has it; those of one side mostly on their side. Played
    with the photo's weights they add up to 1.

    Args:
        expression: [E] weights of the fit; across: [V] mm, to the subject's left.
    """
    sides = np.stack(
        [
            OTHER_SIDE + (1 - OTHER_SIDE) * _share(EXPRESSIONS[shape], across)
            if _side(EXPRESSIONS[shape])
            else np.ones(len(across))
            for shape in ACTIVE
        ]
    )
    weights = np.asarray(expression, np.float64)[ACTIVE, None]
    total = (weights**2 * sides).sum(0)
    return weights * sides / np.maximum(total, 1e-12)


def _side(name):
    """1 for an expression of the subject's left, -1 of the right, 0 of both."""
    return 1 if name.endswith("Left") else -1 if name.endswith("Right") else 0
