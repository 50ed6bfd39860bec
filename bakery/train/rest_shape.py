"""Learns what expressions leave in the neutral head, from pairs of photos of one person.

Both photos are fitted. The neutral landmarks of the smiling photo's fit are compared with those of the
resting head of the neutral photo, rigidly aligned by what a smile does not move; the difference is a linear
function of expression weights and residual warp that fades in as the lips move (`stages.fit.rest`), of a few
modes. Resting photos count as pairs without change. Each person counts once as it is and once mirrored.

The people of the pairs are young. Older people, of whom there are no pairs, count by their means: what leads
from the mean smile of congress/train to the mean of its resting photos.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path

import numpy as np

from bakery import landmarks as marks
from bakery.bake.fitting import fit_portrait, fitted_neutral
from bakery.bake.options import BuildOptions
from bakery.formats.files import digest_file
from bakery.formats.image import read_photo
from bakery.formats.portraits import landmarks_of, reference_points
from bakery.formats.tensors import write_tensors
from bakery.heads.base import HeadModel
from bakery.stages.fit.rest import (
    ACTIVE,
    ARRAYS,
    MOUTH,
    SEAM,
    RestShape,
    only,
    presence,
    rest_moves,
    shown,
)
from bakery.stages.texture import TextureOptions
from bakery.train.albedo import ATTRIBUTION
from bakery.train.rest import mirrored_weights, resting_pairs
from bakery.types import EXPRESSIONS, Fit

KEPT = BuildOptions(texture=TextureOptions(neutral="keep"))
NOSE, IRISES = (
    1,
    np.array([marks.RIGHT_IRIS.start, marks.LEFT_IRIS.start]),
)  # its tip; their centres
TURNED = 0.35  # how far a face may be turned (`_turned`); 0.35 is 7 degrees of the mean head
# Of the distance of the irises: how far lips are parted and corners lie above their middle at most.
PARTED, LIFTED = 0.02, 0.05
# `presence` of who is taken for resting, at most, and for smiling, at least.
AT_REST, SMILING = 0.3, 0.99


@dataclass(frozen=True)
class ShapeOptions:
    modes: int = 16
    ridge: float = 1.0  # in squared expression weights
    constant: float = 10.0  # variance of what any moved mouth leaves, over that of a unit of weight
    residual: float = 0.003  # the same of a mm of the residual warp at one landmark
    means: float = 16.0  # for how many pairs the means of older people count


DEFAULTS = ShapeOptions()
GROUPS = {  # what the errors are reported of
    "lips": marks.LIPS,
    "corners": marks.MOUTH_CORNERS,
    "jaw": marks.OVAL[11:26],
}


@dataclass(frozen=True, eq=False)
class Pairs:
    """What pairs say; each person twice, the second time mirrored. P people."""

    change: np.ndarray  # [2P, 468, 3] mm, from the neutral landmarks of the smile to those at rest
    presence: np.ndarray  # [2P] 0..1, of the smile; the same of the other photo
    resting_presence: np.ndarray
    expression: np.ndarray  # [2P, E] weights of the smile; the same of the other photo
    resting_expression: np.ndarray
    residual: np.ndarray  # [2P, 468, 3] mm, of the smile; the same of the other photo
    resting_residual: np.ndarray

    def rows(self, at: np.ndarray) -> "Pairs":
        return Pairs(*(getattr(self, entry.name)[at] for entry in fields(self)))


@dataclass(frozen=True, eq=False)
class Means:
    """What leads from the mean smile of people to their mean resting face, without sides."""

    change: np.ndarray  # [468, 3] mm, as of `Pairs`
    expression: np.ndarray  # [E] of the smiles
    residual: np.ndarray  # [468, 3] mm, of the smiles


def _fitted(path: Path, points: np.ndarray, head: HeadModel) -> Fit:
    return fit_portrait(path, read_photo(path), landmarks_of(points), head, KEPT)[0]


def fitted_pairs(portraits: Path, head: HeadModel) -> Iterator[tuple[Fit, Fit]]:
    """The fits of the neutral and the smiling photo of each person of london/train."""
    for rest, smile in resting_pairs(portraits):
        yield _fitted(*rest, head), _fitted(*smile, head)


def fitted_others(portraits: Path, head: HeadModel) -> Iterator[Fit]:
    """Fits of congress/train: whose lips are closed and about level, and every fourth of the others."""
    found = reference_points(portraits / "congress", "train")
    facing = [each for each in sorted(found.items()) if abs(_turned(each[1])) < TURNED]
    closed = [each for each in facing if _about_closed(each[1])]
    others = [each for each in facing if not _about_closed(each[1])]
    for path, points in closed + others[::4]:
        yield _fitted(path, points, head)


def _turned(points):
    """The logarithm of how much nearer the tip of the nose is to one side of the face [478, 2]."""
    right, left = np.linalg.norm(points[marks.BEFORE_EARS] - points[NOSE], axis=1)
    return np.log(right / left)


def _about_closed(points):
    """Whether lips [478, 2] touch, with corners that are hardly higher than their middle."""
    irises = points[IRISES]
    across = irises[1] - irises[0]
    down = np.array([-across[1], across[0]]) / (across @ across)
    upper, lower = points[SEAM] @ down
    corners = (points[marks.MOUTH_CORNERS] @ down).mean()
    return lower - upper < PARTED and (upper + lower) / 2 - corners < LIFTED


def rested_landmarks(head: HeadModel, fit: Fit, which: np.ndarray = MOUTH) -> np.ndarray:
    """Landmarks [468, 3] mm of the neutral head of a resting photo, with all that some weights show of rest."""
    resting = only(shown(fit), which)
    return head.landmarks(fitted_neutral(head, replace(fit, resting=resting)))[: marks.FACE]


def means(found: Sequence[Fit], head: HeadModel) -> Means:
    """What fits of resting and of smiling people, who need not be the same, say in the mean."""
    by, lower = still(head), moving(head)
    sure = np.array([presence(head, fit.expression) for fit in found])
    smiles = [fit for fit, each in zip(found, sure) if each > SMILING]
    rests = [fit for fit, each in zip(found, sure) if each < AT_REST]
    here = [head.landmarks(fitted_neutral(head, fit))[: marks.FACE] for fit in smiles]
    there = [rested_landmarks(head, fit) for fit in rests]
    center = np.mean(here, 0)
    before, after = (
        np.mean([aligned(points, center, by) for points in group], 0) for group in (here, there)
    )
    twin, other = mirrored_weights(), marks.mirror_landmarks(head.landmarks(head.mean))

    def even(points):
        flipped: np.ndarray = points[other] * [-1, 1, 1]
        return (points + flipped) / 2

    weights = np.mean([fit.expression for fit in smiles], 0)
    residual = np.mean([fit.residual for fit in smiles], 0)
    return Means(
        even((after - before) * lower[:, None]), (weights + weights[twin]) / 2, even(residual)
    )


def moving(head: HeadModel) -> np.ndarray:
    """Which landmarks [468] bool a smile leaves something in: those below the eyes."""
    places = head.landmarks(head.mean)[: marks.FACE]
    eyes = np.concatenate(marks.EYES)
    below = places[:, 1] < places[eyes, 1].mean() - 5
    below[eyes] = False
    return below


def still(head: HeadModel) -> np.ndarray:
    """Which landmarks [468] bool both photos are aligned by: nose, eyes and forehead."""
    places = head.landmarks(head.mean)[: marks.FACE]
    nose = (np.abs(places[:, 0]) < 22) & (places[:, 1] > places[marks.NOSE_BASE[0], 1] - 2)
    out = ~moving(head) | nose
    out[marks.OVAL] = False
    return out


def aligned(points: np.ndarray, onto: np.ndarray, by: np.ndarray) -> np.ndarray:
    """Points [N, 3] moved rigidly so that those chosen `by` [N] bool lie on those of `onto` best."""
    center, there = points[by].mean(0), onto[by].mean(0)
    left, _, right = np.linalg.svd((points[by] - center).T @ (onto[by] - there))
    turn = np.diag([1, 1, np.sign(np.linalg.det(left @ right))])
    return (points - center) @ left @ turn @ right + there


def pairs(found: list[tuple[Fit, Fit]], head: HeadModel) -> Pairs:
    """What the fits of pairs (resting, expressive) say."""
    twin, other = mirrored_weights(), marks.mirror_landmarks(head.landmarks(head.mean))
    by, lower = still(head), moving(head)
    rows = []
    for rest, smile in found:
        there = rested_landmarks(head, rest)
        here = head.landmarks(fitted_neutral(head, smile))[: marks.FACE]
        change = (aligned(there, here, by) - here) * lower[:, None]
        sure = [presence(head, fit.expression) for fit in (smile, rest)]
        weights = [fit.expression for fit in (smile, rest)]
        warps = [fit.residual for fit in (smile, rest)]
        rows.append((change, *sure, *weights, *warps))
        flipped = [(part[other] * [-1, 1, 1]) for part in (change, *warps)]
        rows.append((flipped[0], *sure, *(part[twin] for part in weights), *flipped[1:]))
    return Pairs(*(np.stack(column) for column in zip(*rows)))


def learn(
    known: Pairs, head: HeadModel, options: ShapeOptions = DEFAULTS, others: Means | None = None
) -> RestShape:
    """The modes, and how weights and residual set their amounts: ridge regression of reduced rank."""
    lower = moving(head)
    scale = np.concatenate(
        [
            [options.constant**0.5],
            np.ones(len(ACTIVE)),
            np.full(3 * int(lower.sum()), options.residual**0.5),
        ]
    )

    def seen(sure, weights, residual):
        count = len(sure)
        flat = residual[:, lower].reshape(count, -1)
        return sure[:, None] * np.hstack([np.ones((count, 1)), weights[:, ACTIVE], flat]) * scale

    smiles = seen(known.presence, known.expression, known.residual)
    # Resting photos change nothing: they hold the function to zero.
    rests = seen(known.resting_presence, known.resting_expression, known.resting_residual)
    inputs = np.concatenate([smiles, rests])
    wanted = known.change.reshape(len(known.change), -1)
    wanted = np.concatenate([wanted, np.zeros_like(wanted)])
    if others is not None:
        mean = seen(np.ones(1), others.expression[None], others.residual[None])
        inputs = np.concatenate([inputs, options.means**0.5 * mean])
        wanted = np.concatenate([wanted, options.means**0.5 * others.change.reshape(1, -1)])
    square = inputs @ inputs.T + options.ridge * np.eye(len(inputs))
    change = np.linalg.solve(square, wanted)  # by sample
    _, _, axes = np.linalg.svd(inputs @ (inputs.T @ change), full_matrices=False)
    axes = axes[: options.modes]
    amounts = (inputs.T @ (change @ axes.T)) * scale[:, None]
    response = np.zeros((len(EXPRESSIONS), len(axes)))
    response[ACTIVE] = amounts[1 : 1 + len(ACTIVE)]
    by_residual = np.zeros((marks.FACE, 3, len(axes)))
    by_residual[lower] = amounts[1 + len(ACTIVE) :].reshape(-1, 3, len(axes))
    arrays = (axes.reshape(-1, marks.FACE, 3), amounts[0], response, by_residual)
    return RestShape(head.name, *(part.astype(np.float32) for part in arrays))


def left_out_error(
    known: Pairs, head: HeadModel, options: ShapeOptions = DEFAULTS, others: Means | None = None
) -> dict:
    """Root mean square distance across the line of sight, mm, of people who were not learned from.

    Returns:
        {group: [as fitted, at rest]}, and how far the resting photos' lips are moved on average.
    """
    people = len(known.change) // 2
    before, after, moved = [], [], []
    for k in range(people):
        rows = np.delete(np.arange(2 * people), [2 * k, 2 * k + 1])
        basis = learn(known.rows(rows), head, options, others)
        row = 2 * k
        moves = rest_moves(basis, known.expression[row], known.residual[row])
        moves *= known.presence[row]
        before.append(known.change[row])
        after.append(known.change[row] - moves)
        rested = rest_moves(basis, known.resting_expression[row], known.resting_residual[row])
        rested *= known.resting_presence[row]
        moved.append(np.linalg.norm(rested[marks.LIPS], axis=1).mean())

    def error(left, group):
        return round(float(np.sqrt((np.array(left)[:, group, :2] ** 2).sum(-1).mean())), 3)

    out: dict = {"people": people, "resting_lips_moved": round(float(np.mean(moved)), 3)}
    for name, group in GROUPS.items():
        out[name] = [error(before, group), error(after, group)]
    return out


def save(basis: RestShape, path: Path) -> None:
    """Write the basis as safetensors, what is large in half precision."""
    types = {"modes": np.float16, "by_residual": np.float16}
    arrays = {name: np.asarray(getattr(basis, name), types.get(name)) for name in ARRAYS}
    write_tensors(arrays, path, {"head": basis.head})


def model_card(basis: RestShape, metrics: dict, path: Path, commit: str) -> dict:
    """What the basis is, as a JSON table; `path` is the saved one, whose digest goes in."""
    return {
        "name": "resting shape basis",
        "purpose": "what an expression leaves in the fitted neutral head, to be taken off it",
        "method": "fit both photos, difference of the neutral landmarks after rigid alignment, ridge "
        "regression of reduced rank on expression weights and residual warp, faded in by how far "
        "the lips move; each person as is and mirrored; older people by the means of their smiling and "
        "resting photos; deterministic, no seed",
        "data": "london/train, neutral and smiling; means of congress/train (public domain)",
        "attribution": ATTRIBUTION,
        "licence": "CC-BY-4.0",
        "limits": "smiles, with and without teeth, of 62 young adults seen from the front, and of older "
        "people in the mean alone; other heads "
        "than this one are left as fitted; other expressions are changed as far as their weights occur in smiles",
        "head": basis.head,
        "modes": len(basis.modes),
        "metrics": metrics,
        "commit": commit,
        "sha256": digest_file(path),
    }
