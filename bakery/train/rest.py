"""Learns how expressions change the skin, from pairs of photos of one person in one light.

Both photos of a person are fitted and unwrapped; the logarithm of the ratio of both textures, on the
chart of the albedo basis, is analysed into a few modes. Their amounts are a linear function of the
expression weights of the fits without a constant: no expression, no change. Each person counts once as
it is and once mirrored.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from bakery.bake.fitting import fit_portrait, fitted_neutral
from bakery.bake.options import BuildOptions
from bakery.formats.files import digest_file
from bakery.formats.image import read_photo
from bakery.formats.portraits import landmarks_of, reference_points
from bakery.formats.tensors import write_tensors
from bakery.geometry.sample import bilinear
from bakery.stages.fit.albedo import load_albedo
from bakery.stages.fit.lids import close_lids
from bakery.stages.texture.complete import OBSERVED
from bakery.stages.texture.hair import mattes_of
from bakery.stages.texture.neutral import prepare
from bakery.stages.texture.rest import RestBasis, log_change
from bakery.train.albedo import ATTRIBUTION, chart_map
from bakery.train.subjects import TRAINING
from bakery.types import EXPRESSIONS


@dataclass(frozen=True)
class RestOptions:
    size: int = 128  # texels on a side of the chart
    modes: int = 6
    ridge: float = 6.0  # of the amounts, in squared expression weights
    resolution: int = 512  # of the textures that are compared
    least: float = 0.6  # trust from which a texel counts
    share: float = 0.3  # of the people who must show a texel to count in full
    most: float = 1.5  # log ratio; more is another thing than skin


DEFAULTS = RestOptions()
FLOOR = 2e-3  # linear; below it nothing is told


@dataclass(frozen=True, eq=False)
class Unwrapped:
    """One photo on the chart."""

    color: np.ndarray  # [S, S, 3] log of linear colour
    trust: np.ndarray  # [S, S] 0..1
    expression: np.ndarray  # [E]


def unwrap(path, points, head, options=DEFAULTS) -> Unwrapped:
    """One photo of a pair on the chart."""
    photo, landmarks = read_photo(path), landmarks_of(points)
    fit, segmentation = fit_portrait(path, photo, landmarks, head, BuildOptions())
    neutral = fitted_neutral(head, fit)
    mattes = mattes_of(photo.encoded, segmentation, landmarks.points)
    own = close_lids(head, neutral)
    made = prepare(photo, landmarks, fit, neutral, own, mattes, options.resolution, method="none")
    trust = (made.source == OBSERVED) * made.facing.astype(np.float32)
    return on_chart(made.subject.texture, trust, fit.expression, head, options)


def on_chart(texture, trust, expression, head, options=DEFAULTS) -> Unwrapped:
    """A texture [T, T, 3] and its trust [T, T] on the chart."""
    where = chart_map(head, load_albedo().layout, options.size)
    corner = np.zeros((len(head.mean), 2), np.float32)
    corner[head.faces] = head.uv[head.uv_faces]
    place = np.einsum("nkc,nk->nc", corner[where.corners], where.weight) * len(texture)
    sigma = 0.25 * len(texture) / options.size
    soft = cv2.GaussianBlur(texture.astype(np.float32), (0, 0), sigma)
    color = np.zeros((options.size, options.size, 3), np.float32)
    shown = np.zeros((options.size, options.size), np.float32)
    color[where.inside] = np.log(np.maximum(bilinear(soft, place), FLOOR))
    shown[where.inside] = bilinear(trust.astype(np.float32), place)
    return Unwrapped(color, shown, np.asarray(expression, np.float32))


def resting_pairs(portraits) -> Iterator[tuple[tuple[Path, np.ndarray], tuple[Path, np.ndarray]]]:
    """The neutral and the smiling photo of each person of london/train, with their points [478, 2]."""
    smiles = reference_points(portraits, TRAINING, "smiling")
    for path, points in sorted(reference_points(portraits, TRAINING, "neutral").items()):
        other = path.with_name(path.name.replace("neutral", "smiling"))
        if other in smiles:
            yield (path, points), (other, smiles[other])


def unwrapped_pairs(portraits, head, options=DEFAULTS) -> Iterator[tuple[Unwrapped, Unwrapped]]:
    """Both photos of each person on the chart."""
    for rest, smile in resting_pairs(portraits):
        yield unwrap(*rest, head, options), unwrap(*smile, head, options)


def mirrored_weights() -> np.ndarray:
    """Index [E] of each expression's twin on the other side."""
    swap = {"Left": "Right", "Right": "Left"}
    twins = []
    for name in EXPRESSIONS:
        side = next((side for side in swap if name.endswith(side)), None)
        twin = name.removesuffix(side) + swap[side] if side else name
        twins.append(EXPRESSIONS.index(twin))
    return np.array(twins)


@dataclass(frozen=True, eq=False)
class Ratios:
    """What pairs say; each person twice, the second time mirrored."""

    change: np.ndarray  # [2P, S, S, 3] log ratio, 0 where not seen
    trust: np.ndarray  # [2P, S, S]
    expressive: np.ndarray  # [2P, E] weights of the photo with an expression
    resting: np.ndarray  # [2P, E] of the other

    def rows(self, at) -> "Ratios":
        return Ratios(*(getattr(self, name)[at] for name in self.__dataclass_fields__))


def ratios(found: list[tuple[Unwrapped, Unwrapped]], options=DEFAULTS) -> Ratios:
    """Log ratios of pairs (resting, expressive), brought to one exposure."""
    twin = mirrored_weights()
    change, trust, expressive, resting = [], [], [], []
    for rest, moved in found:
        both = np.minimum(rest.trust, moved.trust)
        both = np.where(both > options.least, both, 0)
        ratio = rest.color - moved.color
        ratio = ratio - np.median(ratio[both > 0], 0)
        ratio = np.clip(ratio, -options.most, options.most) * (both > 0)[..., None]
        change += [ratio, ratio[:, ::-1]]
        trust += [both, both[:, ::-1]]
        expressive += [moved.expression, moved.expression[twin]]
        resting += [rest.expression, rest.expression[twin]]
    return Ratios(*map(np.stack, (change, trust, expressive, resting)))


def learn(known: Ratios, options=DEFAULTS) -> RestBasis:
    """Modes of the ratios, and how expression weights set their amounts."""
    flat = known.change.reshape(len(known.change), -1)
    energy, left = np.linalg.eigh(flat @ flat.T)
    scale = np.sqrt(np.maximum(energy[::-1][: options.modes], 1e-12))
    left = left[:, ::-1][:, : options.modes]
    modes = ((left / scale).T @ flat).reshape(options.modes, *known.change.shape[1:])
    # Resting photos change nothing: they hold the function to zero.
    weights = np.concatenate([known.expressive, known.resting])
    amounts = np.concatenate([left * scale, np.zeros_like(left)])
    square = weights.T @ weights + options.ridge * np.eye(weights.shape[1])
    response = np.linalg.solve(square, weights.T @ amounts)
    # Texels that many people hide count as unchanged in the modes: make good for that.
    share = (known.trust > 0).mean(0)[..., None]
    return RestBasis(
        (modes / np.maximum(share, options.share)).astype(np.float32), response.astype(np.float32)
    )


def left_out_error(known: Ratios, options=DEFAULTS) -> dict:
    """Root mean square of the log ratio of people who were not learned from, as is and undone."""
    people = len(known.change) // 2
    total, before, after = 0.0, 0.0, 0.0
    for k in range(people):
        others = np.delete(np.arange(2 * people), [2 * k, 2 * k + 1])
        basis = learn(known.rows(others), options)
        weight, change = known.trust[2 * k][..., None], known.change[2 * k]
        left = change - log_change(basis, known.expressive[2 * k])
        total += 3 * float(weight.sum())
        before += float((weight * change**2).sum())
        after += float((weight * left**2).sum())
    return {
        "people": people,
        "log_ratio": round((before / total) ** 0.5, 4),
        "log_ratio_undone": round((after / total) ** 0.5, 4),
    }


def save(basis: RestBasis, path) -> None:
    """Write the basis as safetensors, half precision."""
    arrays = {"modes": basis.modes.astype(np.float16), "response": basis.response}
    write_tensors(arrays, path)


def model_card(basis: RestBasis, metrics: dict, path: Path, commit: str) -> dict:
    """What the basis is, as a JSON table; `path` is the saved one, whose digest goes in."""
    return {
        "name": "resting skin basis",
        "purpose": "what an expression does to the skin's colour, to be undone in the neutral texture",
        "method": "fit and unwrap both photos, log ratio on the chart of the albedo basis, principal "
        "components, ridge regression on expression weights; each person as is and mirrored; "
        "deterministic, no seed",
        "data": "london/train, neutral and smiling",
        "attribution": ATTRIBUTION,
        "licence": "CC-BY-4.0",
        "limits": "smiles, with and without teeth, of 62 adults in one studio light; other "
        "expressions are changed as far as their weights occur in smiles",
        "modes": len(basis.modes),
        "size": basis.modes.shape[1],
        "metrics": metrics,
        "commit": commit,
        "sha256": digest_file(path),
    }
