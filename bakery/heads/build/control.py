"""What is done to the control mesh before it is subdivided. Build-time only."""

from dataclasses import replace

import numpy as np

from bakery.geometry.mesh import boundary_loops
from bakery.heads.proxies import split_ring
from bakery.types import EXPRESSION_INDEX, EXPRESSIONS


def mirror_of(points):
    """The vertex [V] on the other side of each."""
    from scipy.optimize import linear_sum_assignment
    from scipy.spatial import cKDTree

    flipped = points * [-1, 1, 1]
    out = cKDTree(points).query(flipped)[1]
    wrong = np.flatnonzero(out[out] != np.arange(len(points)))
    if len(wrong):
        far = np.linalg.norm(points[wrong][:, None] - flipped[wrong][None], axis=-1)
        a, b = linear_sum_assignment(far)
        out[wrong[b]] = wrong[a]
    if (out[out] != np.arange(len(points))).any():
        raise ValueError("the mesh has no mirror image of itself")
    return out


def swap_sides(names=EXPRESSIONS):
    """Index [E] of the shape that each becomes in a mirror."""
    index = {name: k for k, name in enumerate(names)}
    other = []
    for name in names:
        for a, b in (("Left", "Right"), ("Right", "Left")):
            if name.endswith(a):
                name = name[: -len(a)] + b
                break
        other.append(index[name])
    return np.array(other)


FLIP = np.array([-1.0, 1.0, 1.0])


def symmetric(raw):
    """The head with its two sides made mirror images: mean, expressions; identity modes are kept."""
    other = mirror_of(raw.mean)
    mean = (raw.mean + raw.mean[other] * FLIP) / 2
    expression = (raw.expression + raw.expression[swap_sides()][:, other] * FLIP) / 2
    identity = principal(raw.sliders, importance(mean))
    rest = (raw.rest + raw.rest[other] * FLIP) / 2
    return replace(raw, rest=rest, mean=mean, expression=expression, sliders=identity)


def close_lips(raw, gap=0.1):
    """The head with the inner lip contour shut, in its mean and in every identity mode.

    Both lips go half the way; the move fades over the lips as a harmonic field and takes the mouth
    cavity along.

    Args:
        gap: mm that stay open in the mean.
    """
    ring = lip_ring(raw)
    upper, lower = split_ring(ring, raw.mean, raw.expression[EXPRESSION_INDEX["jawOpen"]])
    x = raw.mean[:, 0]
    fade = np.clip((1 - np.abs(x) / x[upper].max()) / 0.12, 0, 1)
    fields = np.concatenate([raw.mean[None], raw.sliders])[..., 1]  # y [1 + S, V]
    move = np.zeros((len(x), len(fields)))
    for k, y in enumerate(fields):
        above, below = np.interp(x, x[upper], y[upper]), np.interp(x, x[lower], y[lower])
        opening = above - below
        share = fade * (np.maximum(opening - gap, 0) if k == 0 else opening) / 2
        move[upper, k], move[lower, k] = -share[upper], share[lower]
    shift = spread_from(raw, ring, move).T[..., None] * [0.0, 1.0, 0.0]
    return replace(raw, mean=raw.mean + shift[0], sliders=raw.sliders + shift[1:])


def spread_from(raw, ring, values, reach=6):
    """Values [V, C] given at the lip ring, fading to nothing over `reach` rows of quads."""
    quads = raw.quads[np.isin(raw.parts, ["skin", "mouth_cavity"])]
    near = rings(quads, ring, reach)
    held = np.ones(len(raw.mean), bool)
    held[np.unique(quads[near < reach])] = False
    held[np.unique(quads[near == reach])] = True
    held[ring] = True
    return harmonic(quads, held, values)


def lip_ring(raw):
    """Control vertices between the skin and the mouth cavity, in order."""
    loops = boundary_loops(triangles_of(raw.quads[raw.parts == "skin"]))
    mean = raw.mean
    return next(
        loop for loop in loops if abs(mean[loop, 0].mean()) < 1 and mean[loop, 2].mean() > 0
    )


def learned_prior(raw, mean, modes):
    """The head with identity statistics learned from fits.

    Args:
        mean: [K] shift of the mean in the first K sliders; modes: [I, K] new modes in them.
    """
    count = len(mean)
    used = raw.sliders[:count]
    shifted = raw.mean + np.tensordot(mean.astype(float), used, 1)
    return replace(
        raw,
        mean=(shifted + shifted[mirror_of(raw.mean)] * FLIP) / 2,
        sliders=np.tensordot(modes.astype(float), used, 1),
    )


def harmonic(quads, held, values):
    """Fill values [V, C] between the held vertices: each the mean of its neighbours."""
    from scipy.sparse import coo_matrix, diags
    from scipy.sparse.linalg import spsolve

    V = len(held)
    sides = np.stack([quads, np.roll(quads, -1, axis=1)], -1).reshape(-1, 2)
    a = coo_matrix((np.ones(len(sides)), (sides[:, 0], sides[:, 1])), (V, V))
    a = ((a + a.T) > 0).astype(float).tocsr()
    L = diags(np.asarray(a.sum(1)).ravel()) - a
    free = np.flatnonzero(~held)
    out = np.array(values, float)
    rest = -(L[free][:, held] @ out[held])
    out[free] = spsolve(L[free][:, free].tocsc(), rest).reshape(len(free), -1)
    return out


def importance(mean):
    """How much each vertex [V] counts when identity modes are put in order: the face most."""
    return np.where((mean[:, 2] > -40) & (mean[:, 1] > -120), 1.0, 0.15)


def principal(sliders, weight):
    """Principal modes [S, V, 3] of independent sliders [S, V, 3], largest first."""
    flat = (sliders * np.sqrt(weight)[:, None]).reshape(len(sliders), -1).astype(float)
    values, vectors = np.linalg.eigh(flat @ flat.T)
    modes = np.tensordot(vectors[:, ::-1].T, sliders.astype(float), 1)
    strongest = np.abs(modes).reshape(len(modes), -1).argmax(1)
    sign = np.sign(modes.reshape(len(modes), -1)[np.arange(len(modes)), strongest])
    return modes * sign[:, None, None]


def rings(quads, seeds, count):
    """Quads within `count` steps of the seed vertices: steps [F], `count` or more where farther."""
    near = np.zeros(quads.max() + 1, bool)
    near[seeds] = True
    out = np.full(len(quads), count)
    for step in range(count):
        touched = near[quads].any(1)
        out = np.where(touched & (out == count), step, out)
        near[quads[touched]] = True
    return out


def triangles_of(quads):
    """Each quad cut in two."""
    return np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def learned_smile(raw, field):
    """The head with mouthSmileLeft and Right taken from one field [V, 3] mm of both.

    The sides blend over 28 mm and add up to the field; each is the mirror image of the other.
    """
    other = mirror_of(raw.mean)
    field = (field + field[other] * FLIP) / 2
    share = np.clip(raw.rest[:, 0] / 28 + 0.5, 0, 1)
    left = share * share * (3 - 2 * share)
    expression = raw.expression.copy()
    expression[EXPRESSION_INDEX["mouthSmileLeft"]] = field * left[:, None]
    expression[EXPRESSION_INDEX["mouthSmileRight"]] = field * (1 - left)[:, None]
    return replace(raw, expression=expression)


def raise_lids(raw, share=0.8):
    """The head whose lids follow the eye up: eyeLookUp takes a share of eyeWide."""
    expression = raw.expression.copy()
    for side in ("Left", "Right"):
        wide = raw.expression[EXPRESSION_INDEX["eyeWide" + side]]
        expression[EXPRESSION_INDEX["eyeLookUp" + side]] += share * wide
    return replace(raw, expression=expression)
