"""The skin of a new head with what it is one surface with: of the file's triangles or our own."""

from dataclasses import dataclass

import numpy as np

from bakery.heads import boundaries
from bakery.heads.base import EYES, PARTS
from bakery.heads.build import flatten
from bakery.heads.embed import on_faces, sides, skin_rims, with_landmarks
from bakery.heads.mesh import openings, parts, register, transfer, unwrap
from bakery.heads.mesh.lining import lining
from bakery.heads.mesh.search import Nearest
from bakery.heads.patch import Patch, follow_ids, place
from bakery.landmarks import FACE

SMALLER = 0.5  # of its true size that what nobody looks at gets in the atlas


@dataclass(frozen=True)
class Flesh:
    """Skin, mouth cavity and eye sockets of a head to be."""

    patches: list  # of Patch, the one with the skin first
    lips: np.ndarray  # vertices of that one on the inner contour of the lips, in order
    laid: object  # Laid, as it fits them
    laid_shapes: np.ndarray  # [E, V of the built-in head, 3] mm
    chosen: np.ndarray | None  # faces of the built-in head that the first patch has, if it has them
    about: list  # lines for people


def of_built_in(laid):
    """The built-in head's own triangles where they were laid."""
    head = laid.head
    shapes = transfer.own_shapes(laid)
    chosen = head.part_faces(*register.FLESH)
    patch = parts.built_in(laid, chosen, laid.vertices, shapes)
    used = np.unique(head.faces[chosen])
    lips = np.searchsorted(used, np.asarray(skin_rims(head)[0]))
    near = laid.distance[head.part_vertices("skin")]
    off = np.median(near[np.isfinite(near)])
    about = [f"skin: the built-in head's triangles, {off:.2f} mm (median) from the mesh"]
    return Flesh([patch], lips, laid, shapes, chosen, about)


def of_file(skin, found, laid):
    """The file's own triangles.

    Args:
        skin: Surface in head space, one piece; found: Openings, none of them sealed; laid: Laid.
    """
    outer = skin.faces[found.inside == 0]
    theirs = [openings.halves(skin.vertices, ring) for ring in found.rings]
    lids = list(zip(theirs, openings.guide(laid)))[1:]
    laid = register.fit_lids(laid, skin, outer, lids)
    names = np.array(["skin", *(openings.PART[name] for name in openings.OPENINGS)])
    part = names[found.inside]
    pairs = transfer.pair(skin.vertices, skin.faces, part, theirs, laid)
    shapes = transfer.own_shapes(laid)
    uv, uv_faces, about = _layout(skin, part, pairs, laid)
    patch = Patch(
        parts=np.array([PARTS.index(name) for name in part], np.uint8),
        mean=skin.vertices,
        faces=skin.faces,
        uv=place(uv, flatten.SKIN_BOX),
        uv_faces=uv_faces,
        follow=follow_ids("skin", len(skin.vertices)),
        identity=transfer.people(skin.vertices, skin.faces, pairs, laid),
        expression=transfer.shapes(skin.vertices, skin.faces, pairs, laid, shapes),
    )
    patches = [patch]
    for number, contour in enumerate(theirs):
        if not (found.inside == 1 + number).any():
            patches.append(lining(number, contour, patch, laid, shapes))
            about.append(f"{openings.OPENINGS[number]}: lined with the built-in head's")
    upper, lower = theirs[0]
    lips = np.concatenate([upper, lower[-2:0:-1]])
    near = (pairs.trust > 0.5)[np.unique(outer)].mean()
    about.insert(0, f"skin: the file's triangles, {100 * near:.0f}% of them matched")
    return Flesh(patches, lips, laid, shapes, None, about)


def _layout(skin, part, pairs, laid):
    """uv [U, 2] 0..1, uv_faces [F, 3] and lines about them."""
    marks = laid.head.landmarks(laid.vertices)[:FACE]
    marked = Nearest(skin.vertices, skin.faces).query(marks)[0]
    reason = unwrap.unusable(skin, marked)
    if reason is None:
        return np.clip(skin.uv, 0, 1), skin.uv_faces, ["uv: the file's own"]
    hint = unwrap.carried(skin.vertices, skin.faces, part, pairs, laid)
    corners = skin.vertices[skin.faces]
    corners[(part != "skin") | (np.abs(hint).sum((1, 2)) == 0)] *= SMALLER
    uv, uv_faces, charts = unwrap.unwrap(corners, hint)
    return uv, uv_faces, [f"uv: made anew, {charts} charts ({reason})"]


def marked(head, flesh, middle):
    """The head with its 478 landmarks.

    Args:
        head: HeadModel whose first faces are those of the flesh's first patch; middle: [3] mm that
            it was moved by.
    """
    own = flesh.laid.head
    if flesh.chosen is not None:
        number = np.full(len(own.faces), -1)
        number[flesh.chosen] = np.arange(len(flesh.chosen))
        return on_faces(head, number[own.landmark_faces[:FACE]], own.landmark_barycentric[:FACE])
    places = own.landmarks(flesh.laid.vertices)[:FACE] - middle
    head = with_landmarks(head, places)
    # What the laid head's rims only nearly meet goes to the rims that are seen.
    groups = sides(head)
    rims = {name: (groups[k][1], groups[k + 1][1]) for name, k in zip(("lips", *EYES), (1, 3, 5))}
    front = places[None, :, :2] * [1, -1]
    for point, at in boundaries.pinned(head, front, places, skin_rims(head), rims).items():
        places[point] = at
    return with_landmarks(head, places)
