"""Cut the head into surfaces, and make them coarser with their shapes and uv."""

from dataclasses import replace

import fast_simplification
import numpy as np

from bakery.export.glb import Surface
from bakery.geometry.mesh import closest_barycentric, vertex_normals
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
FEWEST = {"eyes": 480}  # triangles; with fewer an eyeball has corners that the lids do not cover
LOOSE = ("teeth",)  # whose borders are hidden: crowns end in the gums, gums behind the lips
# Where coarse heads need their triangles: a shape whose moves show the place, and mm around it.
FINE = {"eyeBlinkLeft": 18.0, "eyeBlinkRight": 18.0, "mouthFunnel": 28.0}
MAGNIFIED = 2.2  # times, in the middle of these places; above 3.2 the map folds
COARSE = 0.1  # ratio below which places are magnified; above it chins get bumpy and nothing is won
ROUNDS = 6  # of simplification at most, each more aggressive than the last


def head_surfaces(head, neutral):
    """The head of one person, neutral [V, 3] mm, as a list of Surfaces."""
    found = _surfaces(head, neutral, MATERIALS)
    return [_on_own_picture(piece, card_rectangle(head)) for piece in found]


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


def simplify(surface, ratio):
    """A surface with about `ratio` of its triangles.

    Cards are mostly border and stay whole. Borders, the cuts of the atlas among them, stay as they
    are, so that no gap opens; those of LOOSE parts may go. Eyes and mouth keep more than their share.
    Shapes, uv and normals are read from the original surface, at the nearest point among the faces
    that a new vertex stands for: never across a cut.

    Args:
        surface: Surface.
        ratio: 0..1.

    Returns:
        Surface; less coarse than asked where the border alone takes more.
    """
    wanted = max(int(len(surface.faces) * ratio), FEWEST.get(surface.name, 0))
    if wanted >= len(surface.faces) or wanted < 4 or surface.name in CARDS:
        return surface
    places = surface.vertices.astype(np.float64)
    vertices = _magnified(surface) if ratio < COARSE else places
    faces = surface.faces.astype(np.int32)
    for step in range(ROUNDS):
        _, triangles, collapses = fast_simplification.simplify(
            vertices,
            faces,
            target_count=wanted,
            agg=5 + 2 * step,
            return_collapses=True,
            preserve_border=surface.name not in LOOSE,
        )
        if len(triangles) <= 1.05 * wanted:
            break
    points, triangles, stands_for = fast_simplification.replay_simplification(
        vertices, faces, collapses
    )
    face, weights = _nearest(points, stands_for, vertices, faces)
    corners = faces[face]  # [N, 3]

    def carried(values):
        return np.einsum("nk,...nkc->...nc", weights, values[..., corners, :])

    # Positions are carried as well: on the surface, and exactly where uv and shapes were read.
    return Surface(
        name=surface.name,
        vertices=carried(places).astype(np.float32),
        normals=carried(surface.normals.astype(np.float64)),
        uv=np.clip(carried(surface.uv.astype(np.float64)), 0, 1).astype(np.float32),
        faces=triangles.astype(np.int64),
        shapes=carried(surface.shapes.astype(np.float64)).astype(np.float32),
    )


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


def _nearest(points, stands_for, vertices, faces):
    """The nearest place on the original surface for each new vertex.

    Args:
        points: [N, 3] new vertices.
        stands_for: [V] which new vertex each old one went into.
        vertices, faces: the original surface.

    Returns:
        face [N] and barycentric [N, 3].
    """
    owner = stands_for[faces]  # [F, 3] the new vertices that a face's corners went into
    pairs = np.unique(np.stack([owner.ravel(), np.repeat(np.arange(len(faces)), 3)], 1), axis=0)
    pairs = pairs[(pairs[:, 0] >= 0) & (pairs[:, 0] < len(points))]
    weights = closest_barycentric(points[pairs[:, 0]], vertices[faces[pairs[:, 1]]])
    place = np.einsum("nk,nkc->nc", weights, vertices[faces[pairs[:, 1]]])
    distance = ((place - points[pairs[:, 0]]) ** 2).sum(1)
    order = np.lexsort([pairs[:, 1], distance, pairs[:, 0]])
    first = order[np.unique(pairs[order, 0], return_index=True)[1]]
    return pairs[first, 1], weights[first]
