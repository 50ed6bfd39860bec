"""Lashes and tear lines of one person: light strips that grow on the rims of their lids.

They are made for a neutral shape, not stored in a head: they take the place of what lash cards and
tear shells a head brings along, and each of their points is held by a place on the skin, so that it
goes where the lid goes in all 52 shapes. What is drawn on them lies in the hair layer
(`stages.texture_lashes`), in the rectangle "cards" of the atlas, for both eyes the same.
"""

from dataclasses import dataclass, replace

import numpy as np

from bakery import landmarks as marks
from bakery.geometry.mesh import closest_barycentric
from bakery.heads.base import CARDS, FOLLOW, PARTS, HeadModel
from bakery.types import EXPRESSION_INDEX

RECTANGLE = "cards"
# Bands of the rectangle, top and bottom: roots of the lashes and the lid lie on the top.
BANDS = {"upper": (0.0, 0.56), "lower": (0.61, 0.85), "tear": (0.9, 1.0)}


@dataclass(frozen=True)
class Row:
    """The lashes of one lid."""

    columns: int  # across the lid, evenly spaced
    pieces: int  # along a lash
    length: tuple  # mm at shares 0, 0.25 .. 1 from the outer to the inner corner
    start: (
        float  # degrees over the horizon that a lash leaves the lid at, where the lid faces ahead
    )
    end: float  # degrees that it points to at its tip
    ends: tuple  # shares of the rim, from the outer corner, between which lashes grow
    away: tuple  # mm from the edge of the lid, where they come out of the skin
    turn: float  # times that lashes turn more about the eye than the rim that they grow on


# Upper lashes are 8 to 12 mm long, with tips too thin to see; they leave the lid ahead and curl up.
# Lower ones are about half as long.
ROWS = {
    "upper": Row(17, 3, (6.6, 7.4, 6.8, 4.8, 2.4), 0.0, 52.0, (0.03, 0.88), (0, 0.5, 0.3), 1.6),
    "lower": Row(13, 2, (3.6, 4.0, 3.6, 2.8, 2.0), -38.0, -18.0, (0.06, 0.9), (0, -0.4, 0.3), 1.0),
}
UNISON = 0.6  # share of a lash's turn that is the turn of the middle of the lid
LIFT = 0.2  # mm that roots stand off the skin, so that it does not cut them
FAN = 0.4  # share of the eyeball's own direction in that of a lash; the rest is straight ahead
TRIED = 24  # faces of skin around a root, of which the nearest holds it
TEAR_COLUMNS, TEAR_ENDS = 15, (0.04, 0.985)
TEAR_HEIGHT = 0.7  # mm up the eyeball
TEAR_CLEAR = 0.06  # mm before the white of the eye, so that it is not cut
TEAR_BEHIND = 0.25  # mm that it begins behind the edge of the lid
TEAR_SUNK = 1.0  # mm into the shut eye


def with_lashes(head: HeadModel, neutral: np.ndarray) -> tuple[HeadModel, np.ndarray]:
    """A head with lashes and tear lines on the lids of a neutral shape.

    Args:
        head: HeadModel; its own lash cards and tear shells are left out.
        neutral: [V, 3] mm.

    Returns:
        HeadModel without identity modes, and its neutral shape: the vertices of `head`, then those
        of the strips. A head without a place for them in its atlas comes back as it is.
    """
    box = card_rectangle(head)
    if box is None:
        return head, neutral
    head = _without_cards(head)
    skin = head.faces[head.part_faces("skin")]
    strips = []
    for eye, center in enumerate(head.eye_centers(neutral)):
        lids = {
            "upper": head.landmarks(neutral)[marks.LIDS_UPPER[eye]],
            "lower": head.landmarks(neutral)[marks.LIDS_LOWER[eye]],
        }
        near = skin[np.linalg.norm(neutral[skin].mean(1) - center, axis=1) < 30]
        for name in ("tear", "lower", "upper"):
            rim = lids["lower" if name == "tear" else name]
            make = _tear if name == "tear" else _lashes
            strips.append(make(head, neutral, eye, center, rim, near, name))
    return _joined(head, neutral, strips, box)


def own_vertices(head):
    """How many vertices of a head with lashes are those of the head before them."""
    cards = head.faces[head.part_faces(*CARDS)]
    return int(cards.min()) if len(cards) else len(head.mean)


def carried(neutral, moved):
    """A neutral shape [V, 3] mm whose own vertices have moved: cards go with what is nearest.

    Args:
        neutral: [V, 3] mm, of `with_lashes`, or without cards.
        moved: [n, 3] mm, displacement of the head's own vertices; V - n belong to cards.
    """
    own = neutral[: len(moved)]
    nearest = [int(((own - point) ** 2).sum(1).argmin()) for point in neutral[len(moved) :]]
    return neutral + np.concatenate([moved, moved[nearest]])


def card_rectangle(head):
    """Where cards lie in the atlas: [left, top, width, height], or None.

    A head that does not say so gives them the place of its own lash cards.
    """
    if RECTANGLE in head.uv_rectangles:
        return head.uv_rectangles[RECTANGLE]
    faces = head.part_faces("lashes")
    if not len(faces):
        return None
    uv = head.uv[head.uv_faces[faces]].reshape(-1, 2)
    return [*uv.min(0).tolist(), *np.ptp(uv, axis=0).tolist()]


def card_texels(head, size):
    """Rows and columns of the cards' rectangle in an atlas of `size` texels a side: two slices."""
    box = card_rectangle(head)
    left, top = (round(value * size) for value in box[:2])
    right, bottom = (round((box[k] + box[k + 2]) * size) for k in range(2))
    return slice(top, bottom), slice(left, right)


def _without_cards(head):
    """The head without cards of its own; vertices stay, landmarks keep their faces."""
    kept = ~np.isin(head.face_part, [PARTS.index(name) for name in CARDS])
    return replace(
        head,
        faces=head.faces[kept],
        uv_faces=head.uv_faces[kept],
        face_part=head.face_part[kept],
        landmark_faces=(np.cumsum(kept) - 1)[head.landmark_faces].astype(np.int32),
    )


@dataclass(frozen=True)
class Strip:
    """A grid of vertices, row after row away from the lid."""

    part: str
    band: str  # of the rectangle
    mean: np.ndarray  # [rows, columns, 3] mm
    moved: np.ndarray  # [E, rows, columns, 3] mm


def _joined(head, neutral, strips, box):
    """The head and the strips as one: (HeadModel, neutral)."""
    points, texels, faces, uv_faces, parts = [neutral], [head.uv], [head.faces], [head.uv_faces], []
    basis = [head.expression_basis]
    vertex, texel = len(neutral), len(head.uv)
    for strip in strips:
        rows, columns = strip.mean.shape[:2]
        index = np.arange(rows * columns).reshape(rows, columns)
        a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, :-1], index[1:, 1:]
        grid = np.stack([a, c, b, b, c, d], -1).reshape(-1, 3)
        top, bottom = BANDS[strip.band]
        across, down = np.meshgrid(np.linspace(0, 1, columns), np.linspace(top, bottom, rows))
        points.append(strip.mean.reshape(-1, 3))
        basis.append(strip.moved.reshape(len(basis[0]), -1, 3))
        texels.append(np.stack([across, down], -1).reshape(-1, 2) * box[2:] + box[:2])
        faces.append(grid + vertex)
        uv_faces.append(grid + texel)
        parts.append(np.full(len(grid), PARTS.index(strip.part), np.uint8))
        vertex, texel = vertex + index.size, texel + index.size
    neutral = np.concatenate(points).astype(np.float32)
    follow = np.full(len(neutral) - len(points[0]), FOLLOW.index("skin"), np.uint8)
    return replace(
        head,
        mean=neutral,
        faces=np.concatenate(faces).astype(np.int32),
        uv=np.concatenate(texels).astype(np.float32),
        uv_faces=np.concatenate(uv_faces).astype(np.int32),
        face_part=np.concatenate([head.face_part, *parts]),
        follow=np.concatenate([head.follow, follow]),
        identity_basis=np.zeros((0, *neutral.shape), np.float32),
        expression_basis=np.concatenate(basis, 1).astype(np.float32),
        uv_rectangles={**head.uv_rectangles, RECTANGLE: list(box)},
    ), neutral


@dataclass(frozen=True)
class Rim:
    """Points along the edge of a lid, and how they move with the skin."""

    place: np.ndarray  # [N, 3] mm at rest
    moved: np.ndarray  # [E, N, 3] mm
    center: np.ndarray  # [3] mm, of the eyeball

    def turns(self, extra):
        """How far each shape turns what grows on the rim about the eye: [E, N, 3] axis times angle.

        The ends of a lid hardly travel, but their lashes go with those of its middle.
        """
        start, end = self.place - self.center, self.place + self.moved - self.center
        axis = np.cross(np.broadcast_to(start, end.shape), end)
        sine = np.linalg.norm(axis, axis=-1, keepdims=True)
        turn = axis / np.maximum(sine, 1e-9) * np.arctan2(sine, (start * end).sum(-1)[..., None])
        third = len(start) // 3
        return extra * ((1 - UNISON) * turn + UNISON * turn[:, third:-third].mean(1, keepdims=True))


def _turned(vectors, turns):
    """Vectors [N, 3] turned by axis times angle [E, N, 3]: [E, N, 3].

    References:
        Rodrigues' formula.
    """
    angle = np.linalg.norm(turns, axis=-1, keepdims=True)
    axis = turns / np.maximum(angle, 1e-9)
    along = (axis * vectors).sum(-1, keepdims=True)
    across = np.cross(axis, np.broadcast_to(vectors, axis.shape))
    return vectors * np.cos(angle) + across * np.sin(angle) + axis * along * (1 - np.cos(angle))


def _rim(head, neutral, marked, center, near, ends, columns, away=0.0):
    """The rim through the marked points [9, 3] of a lid, from the outer corner: Rim.

    Args:
        near: [n, 3] corners of the faces of skin around; ends: shares between which it is wanted.
        away: [3] mm, from the very edge.
    """
    marked = np.delete(marked, 1, 0) + away  # that one lies in a fold
    place = _curve(marked, np.linspace(*ends, columns))
    # Held by the nearest place on the skin, so that no shape takes it off the lid.
    off = np.linalg.norm(neutral[near].mean(1) - place[:, None], axis=2)
    tried = np.sort(np.argpartition(off, TRIED)[:, :TRIED], 1)  # [N, TRIED] of the faces around
    corners = near[tried].reshape(-1, 3)
    weights = closest_barycentric(place.repeat(TRIED, 0), neutral[corners].astype(float))
    at = np.einsum("nk,nkc->nc", weights, neutral[corners])
    far = np.linalg.norm(at - place.repeat(TRIED, 0), axis=1).reshape(-1, TRIED)
    best = np.arange(columns) * TRIED + far.argmin(1)
    corners, weights = corners[best], weights[best]
    moved = np.einsum("enkc,nk->enc", head.expression_basis[:, corners], weights)
    return Rim(at[best], moved, center)


def _curve(points, shares):
    """A smooth curve [N, 3] through points [n, 3] at shares 0..1 of its length.

    References:
        Catmull & Rom, "A class of local interpolating splines", 1974.
    """
    padded = np.concatenate([[2 * points[0] - points[1]], points, [2 * points[-1] - points[-2]]])
    t = np.linspace(0, len(points) - 1 - 1e-9, 40 * (len(points) - 1))
    k, t = t.astype(int), (t % 1)[:, None]
    a, b, c, d = (padded[k + n] for n in range(4))
    fine = b + 0.5 * t * (c - a + t * (2 * a - 5 * b + 4 * c - d + t * (3 * (b - c) + d - a)))
    length = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(fine, axis=0), axis=1))])
    return np.stack([np.interp(shares * length[-1], length, fine[:, n]) for n in range(3)], 1)


def _lashes(head, neutral, eye, center, marked, near, name):
    """The lashes of one lid: Strip."""
    row = ROWS[name]
    rim = _rim(head, neutral, marked, center, near, row.ends, row.columns, np.array(row.away))
    ahead = rim.place - center
    ahead = FAN * ahead / np.linalg.norm(ahead, axis=1, keepdims=True) + [0, 0, 1 - FAN]
    ahead[:, 1] = 0
    ahead /= np.linalg.norm(ahead, axis=1, keepdims=True)
    share = np.linspace(0, 1, row.columns)
    length = np.interp(share, np.linspace(0, 1, len(row.length)), row.length)[:, None]
    offsets = [np.zeros_like(ahead)]
    for angle in np.radians(
        row.start + (row.end - row.start) * (np.arange(row.pieces) + 0.5) / row.pieces
    ):
        step = np.cos(angle) * ahead + np.sin(angle) * np.array([0, 1, 0])
        offsets.append(offsets[-1] + step * length / row.pieces)
    offsets = np.stack(offsets) + LIFT * ahead
    turns = rim.turns(row.turn)
    turned = np.stack([_turned(offset, turns) for offset in offsets], 1)  # [E, rows, N, 3]
    return Strip("lashes", name, rim.place + offsets, rim.moved[:, None] + turned - offsets)


def _tear(head, neutral, eye, center, marked, near, name):
    """The strip of fluid between the lower lid and the eyeball: Strip."""
    rim = _rim(head, neutral, marked, center, near, TEAR_ENDS, TEAR_COLUMNS)
    cap = head.part_vertices("eye_cap_" + ("left", "right")[eye])
    radius = np.linalg.norm(neutral[cap] - center, axis=1).max() + TEAR_CLEAR
    blink = EXPRESSION_INDEX["eyeBlink" + ("Left", "Right")[eye]]
    place = np.concatenate([rim.place[None], rim.place + rim.moved])  # [1 + E, N, 3]
    outward = place - center
    reach = np.linalg.norm(outward, axis=-1, keepdims=True)
    outward = outward / reach
    up = np.array([0, 1, 0]) - outward * outward[..., 1:2]
    gap = np.maximum(reach - TEAR_BEHIND - radius, 0)
    rows = []
    for height, depth in ((0, 1), (0.4 * TEAR_HEIGHT, 0.3), (TEAR_HEIGHT, 0)):  # concave
        ray = outward + up * height / radius
        ray /= np.linalg.norm(ray, axis=-1, keepdims=True)
        row = center + ray * (radius + depth * gap)
        row[1 + blink] = center + outward[1 + blink] * (radius - TEAR_SUNK)  # shut: nothing is left
        rows.append(row)
    rows = np.stack(rows, 1)  # [1 + E, rows, N, 3]
    return Strip("tear", name, rows[0], rows[1:] - rows[0])
