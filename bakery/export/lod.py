"""Cut the head into surfaces, and make them coarser with their shapes and uv."""

from dataclasses import replace

import fast_simplification
import numpy as np

from bakery.export.glb import Surface
from bakery.geometry.mesh import vertex_normals
from bakery.heads.base import CARDS, PROXIES, gaze_of
from bakery.heads.lashes import card_rectangle
from bakery.types import EXPRESSION_INDEX, EXPRESSIONS

RATIOS = (1.0, 0.5, 0.2, 0.05)  # of the triangles
MATERIALS = {
    "skin": ("skin", "eye_socket", "mouth_cavity"),
    "eyes": ("eye_left", "eye_right"),
    "teeth": ("teeth_upper", "teeth_lower", "gums_upper", "gums_lower"),
    "tongue": ("tongue",),
    "tear": ("tear",),
    "lashes": ("lashes",),
}
# Triangles. With fewer an eyeball has corners that the lids do not cover, and crowns become fangs.
FEWEST = {"eyes": 480, "teeth": 1500}
LOOSE = ("teeth",)  # whose borders are hidden: crowns end in the gums, gums behind the lips
# Where coarse heads need their triangles: a shape whose moves show the place, and mm around it.
FINE = {"eyeBlinkLeft": 18.0, "eyeBlinkRight": 18.0, "mouthFunnel": 28.0}
MAGNIFIED = 2.2  # times, in the middle of these places; above 3.2 the map folds
COARSE = 0.1  # ratio below which places are magnified; above it chins get bumpy and nothing is won
ROUNDS = 6  # of simplification at most, each more aggressive than the last


def head_surfaces(head, neutral, mixes=()):
    """The head of one person as a list of Surfaces with bends.

    Args:
        neutral: [V, 3] mm.
        mixes: [N, E] weights of further shapes, behind the 52.
    """
    found = [with_bends(_mixed(piece, mixes)) for piece in _surfaces(head, neutral, MATERIALS)]
    return [_on_own_picture(piece, card_rectangle(head)) for piece in found]


def _mixed(surface, mixes):
    """A surface with mixes [N, E] of its shapes as further ones."""
    if not len(mixes):
        return surface
    further = np.tensordot(np.asarray(mixes, np.float32), surface.shapes, 1)
    return replace(surface, shapes=np.concatenate([surface.shapes, further]))


def proxy_surfaces(head, neutral):
    """What a player shows in place of mouth and eyes, as a list of Surfaces."""
    return _surfaces(head, neutral, {name: (name,) for name in PROXIES})


def _surfaces(head, neutral, named):
    neutral = np.asarray(neutral, np.float32)
    shapes = shape_displacements(head, neutral)
    found = [cut_surface(head, neutral, shapes, name, parts) for name, parts in named.items()]
    return [piece for piece in found if piece]


def _on_own_picture(piece, box):
    """Cards with their uv in the picture of the atlas's `box` alone; other surfaces as they are."""
    if piece.name not in CARDS:
        return piece
    uv = (piece.uv - box[:2]) / box[2:]
    return replace(piece, uv=np.clip(uv, 0, 1).astype(np.float32))


def shape_displacements(head, neutral):
    """What each expression at weight 1 does to a neutral shape [V, 3]: [E, V, 3] mm, eyes turned."""
    shapes = head.expression_basis.copy()
    for index, one in enumerate(np.eye(len(EXPRESSIONS), dtype=np.float32)):
        if gaze_of(one).any():
            shapes[index] = head.vertices(neutral, one) - neutral
    return shapes


def cut_surface(head, neutral, shapes, name, parts):
    """The faces of some parts, vertices split where the atlas is; None if the head lacks them."""
    chosen = head.part_faces(*parts)
    if not len(chosen):
        return None
    corners = np.stack([head.faces[chosen].ravel(), head.uv_faces[chosen].ravel()], 1)
    pairs, index = np.unique(corners, axis=0, return_inverse=True)
    normals = vertex_normals(neutral, head.faces[chosen])
    return Surface(
        name=name,
        vertices=neutral[pairs[:, 0]],
        normals=normals[pairs[:, 0]],
        uv=np.clip(head.uv[pairs[:, 1]], 0, 1),
        faces=index.reshape(-1, 3),
        shapes=shapes[:, pairs[:, 0]],
    )


def with_bends(surface):
    """A surface with what each shape does to its normals; vertices of one place share a normal.

    Vertices of one place that a shape tears apart, as those of closed lips, share none.
    """
    flat = np.concatenate([surface.vertices[None], surface.shapes]).transpose(1, 0, 2)
    rows = np.ascontiguousarray(flat).reshape(len(flat), -1) + 0  # -0 becomes 0
    known = dict[bytes, int]()  # np.unique would sort the long rows
    place = np.array([known.setdefault(row.tobytes(), len(known)) for row in rows])
    first = np.unique(place, return_index=True)[1]
    vertices, faces = surface.vertices[first], place[surface.faces]
    rest = vertex_normals(vertices, faces)
    bends = np.zeros_like(surface.shapes)
    for bend, shape in zip(bends, surface.shapes):
        if shape.any():
            bend[:] = (vertex_normals(vertices + shape[first], faces) - rest)[place]
    return replace(surface, bends=bends)


def simplify(surface, ratio):
    """A surface with about `ratio` of its triangles; see `coarser`."""
    return coarser(surface, (1.0, ratio))[-1]


def coarser(surface, ratios):
    """A surface at falling ratios of its triangles: a list of Surfaces.

    The vertices of each level are the first of those of the level before, so that a file need hold
    what they carry only once; a few serve coarser levels alone. Hence all stand on vertices of the
    original, the ones nearest to where the simplification would put its own. (Each level is made of
    the original: made of the level before, the coarsest shut its lids five times worse.)

    Cards are mostly border and stay whole. Borders, the cuts of the atlas among them, stay as they
    are, so that no gap opens; those of LOOSE parts may go. Eyes and mouth keep more than their share.

    Args:
        surface: Surface.
        ratios: 0..1, falling.

    Returns:
        Surfaces; less coarse than asked where the border alone takes more.
    """
    levels = []
    for ratio in ratios:
        wanted = max(int(len(surface.faces) * ratio), FEWEST.get(surface.name, 0))
        whole = wanted >= len(surface.faces) or wanted < 4 or surface.name in CARDS
        levels.append(surface.faces if whole else _collapsed(surface, wanted, ratio))
    last = np.full(len(surface.vertices), -1)  # the coarsest level that shows a vertex
    for number, faces in enumerate(levels):
        last[faces] = number
    order = np.argsort(-last, kind="stable")
    place = np.argsort(order)
    counts = [(last >= number).sum() for number in range(len(levels))]
    return [_first(surface, order[:count], place[faces]) for count, faces in zip(counts, levels)]


def _first(surface, kept, faces):
    """Some vertices of a surface, between other faces."""
    lit = surface.tangents is not None
    return Surface(
        name=surface.name,
        vertices=surface.vertices[kept],
        normals=surface.normals[kept],
        uv=surface.uv[kept],
        faces=faces,
        shapes=surface.shapes[:, kept],
        bends=None if surface.bends is None else surface.bends[:, kept],
        tangents=surface.tangents[kept] if lit else None,
        twists=surface.twists[:, kept] if lit else None,
    )


def _collapsed(surface, wanted, ratio):
    """About `wanted` triangles [F, 3] between vertices of a surface."""
    places = _magnified(surface) if ratio < COARSE else surface.vertices.astype(np.float64)
    faces = np.ascontiguousarray(surface.faces, np.int32)
    for step in range(ROUNDS):
        _, triangles, collapses = fast_simplification.simplify(
            places,
            faces,
            target_count=wanted,
            agg=5 + 2 * step,
            return_collapses=True,
            preserve_border=surface.name not in LOOSE,
        )
        if len(triangles) <= 1.05 * wanted:
            break
    points, triangles, stands_for = fast_simplification.replay_simplification(
        places, faces, collapses
    )
    return _nearest(points, stands_for, places)[triangles]


def _magnified(surface):
    """The vertices [V, 3] with eyes and mouth enlarged, so that errors there count more."""
    out = surface.vertices.astype(np.float64)
    for name, reach in FINE.items():
        moved = np.linalg.norm(surface.shapes[EXPRESSION_INDEX[name]], axis=1).astype(np.float64)
        if surface.name != "skin" or not moved.any():
            continue
        center = moved @ surface.vertices / moved.sum()
        offset = surface.vertices - center
        near = np.exp(-((np.linalg.norm(offset, axis=1) / reach) ** 2))
        out += (MAGNIFIED - 1) * near[:, None] * offset
    return out


def _nearest(points, stands_for, vertices):
    """For each new vertex [N, 3] the nearest of the old ones [V, 3] that went into it: [N].

    Args:
        stands_for: [V] which new vertex each old one went into.
    """
    old = np.flatnonzero((stands_for >= 0) & (stands_for < len(points)))
    new = stands_for[old]
    order = np.lexsort([((vertices[old] - points[new]) ** 2).sum(1), new])
    return old[order[np.unique(new[order], return_index=True)[1]]]
