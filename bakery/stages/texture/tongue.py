"""A tongue that makes room for itself: corrections of jawOpen and tongueOut for one neutral shape.

At rest the tongue fills the mouth up to the palate. Carried along by the jaw alone, it would still
fill an open mouth: a flat panel from one row of teeth to the other, with no throat behind it. And a
tongue that comes out needs a way between teeth and lips, for `tongueOut` says nothing of the jaw.
"""

from dataclasses import replace

import numpy as np

from bakery.generators.base import Subject
from bakery.generators.shade import relative_irradiance
from bakery.geometry.fill import smoothstep
from bakery.geometry.mesh import vertex_normals
from bakery.heads.base import HeadModel, weights
from bakery.stages.atlas import Atlas
from bakery.types import EXPRESSION_INDEX

SINK = 20.0  # degrees that its back sinks about its tip while the jaw opens, as for a doctor
FLAT = 0.7  # of its thickness is left then
NARROW, THIN = 0.8, 0.85  # of its width and of its thickness are left where it is out
ROUND = 2.5  # mm that the middle of its tip reaches farther than its sides
MIDDLE = 8.0  # mm to each side: the incisors, and what passes between them
CLEAR = 0.5  # mm between the tongue and the upper incisors
OVER = 3.6  # mm of it above the lower lip
MOST_JAW, MOST_LIFT = 0.6, 9.0  # share of jawOpen, and mm, that a tongue may take
BENDS = (0.0, 4.0)  # mm before the upper incisors, over which it rises to the lip
STEP = 3.0  # mm: the tongue's rings lie up to 3 mm apart
DIM = 0.8  # of the light from the front that it has at least: light passes through a tip
LEAST = 1.0  # mm: a head whose tongue moves less has no tongueOut


def seat_tongue(head: HeadModel, neutral: np.ndarray) -> HeadModel:
    """The head whose tongue lies on the floor of an open mouth and comes out between the lips.

    Args:
        head: HeadModel.
        neutral: [V, 3] mm, one person's neutral shape.

    Returns:
        HeadModel with its own expression_basis; the one given if it has no tongue or no teeth.
    """
    tongue, teeth = head.part_vertices("tongue"), head.part_vertices("teeth_upper")
    if not len(tongue) or not len(teeth):
        return head
    jaw, out = EXPRESSION_INDEX["jawOpen"], EXPRESSION_INDEX["tongueOut"]
    basis = head.expression_basis.copy()
    basis[jaw, tongue] += _sunk(neutral[tongue])
    if basis[out, tongue, 2].max() >= LEAST:
        basis[out, tongue] += _drawn_out(neutral[tongue], basis[out, tongue])
        edge = _middle(neutral[teeth])
        edge = edge[edge[:, 1].argmin()]
        at = neutral[tongue] + basis[out, tongue]
        basis[out] += _room(at, basis[jaw, tongue], edge) * basis[jaw]
        moved = neutral + basis[out]
        lip = _lower_lip(head, neutral, basis[jaw])
        basis[out, tongue, 1] += _rise(moved[tongue], moved[lip], edge)
    return replace(head, expression_basis=basis)


def _middle(points: np.ndarray) -> np.ndarray:
    return points[np.abs(points[:, 0] - np.median(points[:, 0])) < MIDDLE]


def _sunk(rest: np.ndarray) -> np.ndarray:
    """Displacement [n, 3] mm of a tongue at rest [n, 3] that flattens and turns about its tip."""
    tip = rest[rest[:, 2].argmax()]
    away = (rest - tip) * [1, FLAT, 1]
    turn = np.radians(SINK)
    y = away[:, 1] * np.cos(turn) + away[:, 2] * np.sin(turn)
    z = away[:, 2] * np.cos(turn) - away[:, 1] * np.sin(turn)
    return np.stack([away[:, 0], y, z], -1) + tip - rest


def _drawn_out(rest: np.ndarray, out: np.ndarray) -> np.ndarray:
    """Displacement [n, 3] mm that makes a tongue at rest [n, 3] thin and narrow where `out` takes it.

    It gets thin from above: below are the lower teeth, which hide behind it.
    """
    share = smoothstep(0.3, 0.8, out[:, 2] / out[:, 2].max())
    across = rest[:, 0] - rest[:, 0].mean()
    floor = np.percentile(rest[share > 0.5, 1], 5)
    above = np.maximum(rest[:, 1] - floor, 0)
    return np.stack([(NARROW - 1) * share * across, (THIN - 1) * share * above, 0 * across], -1)


def _room(tongue: np.ndarray, jaw: np.ndarray, edge: np.ndarray) -> float:
    """Share of jawOpen at which a tongue [n, 3] passes below the upper incisors' edge [3]."""
    near = np.abs(tongue[:, 2] - edge[2]) < MIDDLE
    near &= np.abs(tongue[:, 0] - np.median(tongue[:, 0])) < MIDDLE
    too_high = tongue[near, 1] - (edge[1] - CLEAR)
    falls = np.maximum(-jaw[near, 1], 1.0)
    return float(np.clip((too_high / falls).max(initial=0), 0, MOST_JAW))


def _lower_lip(head: HeadModel, neutral: np.ndarray, jaw: np.ndarray) -> np.ndarray:
    """The vertices of skin that make up the middle of the lower lip."""
    sheet = head.part_vertices("mouth_sheet")
    skin = head.part_vertices("skin")
    if not len(sheet):
        return skin[:0]
    middle = neutral[sheet].mean(0)
    off = neutral[skin] - middle
    near = (np.abs(off[:, 0]) < MIDDLE) & (np.abs(off[:, 1]) < MIDDLE) & (off[:, 2] > -MIDDLE)
    falls = -jaw[skin, 1]
    return skin[near & (falls > 0.5 * falls.max())]


def _rise(tongue: np.ndarray, lip: np.ndarray, edge: np.ndarray) -> np.ndarray:
    """Millimetres [n] that a tongue [n, 3] bends up before the incisors to lie over a lip [m, 3].

    Its tip hangs down again beyond the lip's ridge, rounded.
    """
    column = _middle(tongue)
    tip = column[:, 2].max()
    lip = lip[(lip[:, 2] > edge[2]) & (lip[:, 2] < tip)]
    if not len(lip):
        return np.zeros(len(tongue))
    ridge = lip[lip[:, 1].argmax()]
    # The upper side of its middle as a line over z: the highest point of every few millimetres.
    bins = np.round(column[:, 2] / STEP).astype(int)
    z = np.unique(bins)
    top = np.interp(ridge[2], STEP * z, [column[bins == b, 1].max() for b in z])
    bend = smoothstep(*BENDS, tongue[:, 2] - edge[2])
    hang = 1 - smoothstep(ridge[2] + 2, max(tip, ridge[2] + 3), tongue[:, 2])
    aside = (tongue[:, 0] - np.median(column[:, 0])) / max(np.abs(tongue[hang < 0.5, 0]).max(), 1)
    round_off = ROUND * (1 - hang) * np.clip(1 - aside**2, 0, 1)
    return np.clip(ridge[1] + OVER - top, 0, MOST_LIFT) * bend * hang - round_off


def keep_in(head: HeadModel) -> HeadModel:
    """The head whose tongueOut leaves the tongue on the jaw: what is behind a tongue that is out.

    Args:
        head: what `seat_tongue` made, or a piece of it.
    """
    tongue, teeth = head.part_vertices("tongue"), head.part_vertices("teeth_lower")
    if not len(tongue) or not len(teeth):
        return head
    jaw, out = EXPRESSION_INDEX["jawOpen"], EXPRESSION_INDEX["tongueOut"]
    basis = head.expression_basis.copy()
    drop = basis[jaw, teeth].ravel()
    share = basis[out, teeth].ravel() @ drop / max(float(drop @ drop), 1e-9)
    basis[out, tongue] = share * basis[jaw, tongue]
    return replace(head, expression_basis=basis)


def tongue_light(subject: Subject, atlas: Atlas) -> np.ndarray:
    """Light on a tongue that is out, for the texture of players that draw it without any.

    Args:
        subject: generators.base.Subject.
        atlas: Atlas of its head.

    Returns:
        [T, T, 1] float32: factor on linear colour, 1 off the tongue.
    """
    head = subject.head
    out = head.vertices(subject.neutral, weights({"tongueOut": 1.0}))
    normals = vertex_normals(out, head.faces) @ subject.light_rotation.T
    light = relative_irradiance(normals, subject.light, low=DIM)
    picture = np.ones((atlas.size * atlas.size, 1), np.float32)
    mine = atlas.rows("tongue")
    picture[atlas.index[mine]] = atlas.at(light[:, None])[mine]
    return atlas.fill_gutter(picture.reshape(atlas.size, atlas.size, 1))
