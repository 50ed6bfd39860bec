"""What lies inside a head: eyes, teeth, gums and tongue, from the file or from the built-in head."""

from dataclasses import dataclass

import numpy as np

from bakery.geometry.mesh import face_normals
from bakery.heads.base import EYES
from bakery.heads.build import flatten
from bakery.heads.build.teeth import affine_carry, outward_faces
from bakery.heads.embed import skin_rims
from bakery.heads.eyes import Ball, eye_proxy, eyeball, fit_ball
from bakery.heads.mesh.pose import similarity
from bakery.heads.mesh.search import Nearest
from bakery.heads.mesh.unwrap import unwrap
from bakery.heads.patch import Patch, boxed, follow_ids, part_ids, place

MOUTH = ("teeth_upper", "teeth_lower", "gums_upper", "gums_lower", "tongue")
FOLLOWS = {"upper": "skull", "lower": "jaw", "tongue": "jaw"}
IRIS = 5.56  # mm, radius of the built-in head's iris
NEAR_LIDS = 14.0  # mm around a lid's contour that tell where the eyeball lies
ROUND = 0.06  # of its radius that an eyeball's surface may be off a sphere
EYEBALL = (9.0, 17.0)  # mm, radius
OFF_CENTER = 9.0  # mm between an eyeball of the file and where it is expected
CLOSE = 8.0  # mm from a part of the built-in head that a piece of the file may lie
MAJORITY = 0.6  # of a piece's points that must be nearest to one part
CAP = 0.05  # mm between the white of the eye and the cap
LEAST, MOST = 24, 20_000  # triangles of a piece that is looked at, and of a part that is taken


@dataclass(frozen=True)
class Told:
    """Separate pieces of a file that could be named."""

    pieces: dict  # part -> list of [n, 3] triangles into the surface's vertices
    dropped: int  # how many pieces could not


def seat(laid):
    """The laid head's vertices [V, 3] mm with teeth, gums and tongue behind its lips."""
    head, out = laid.head, laid.vertices.copy()
    lips, _ = skin_rims(head)
    lips = np.asarray(lips)
    middle = lips[np.abs(head.mean[lips, 0]) < 12]
    shift = laid.vertices[middle].mean(0) - laid.turned(head.mean[middle].mean(0))
    inner = head.part_vertices(*MOUTH)
    out[inner] = laid.turned(head.mean[inner]) + shift
    return out


def tell(surface, labels, main, laid, seated):
    """Name the pieces of a surface beside its skin by what of the built-in head they lie at.

    Args:
        surface: Surface; labels: [F] piece of each face; main: the piece that is the skin.
        laid: Laid; seated: [V, 3] from `seat`.

    Returns:
        Told.
    """
    head = laid.head
    names = [*MOUTH, *("eye_" + side for side in EYES), "skin"]
    chosen = np.concatenate([head.part_faces(name) for name in names])
    owner = np.concatenate([np.full(len(head.part_faces(n)), k) for k, n in enumerate(names)])
    search = Nearest(seated, head.faces[chosen])
    found, dropped = {}, 0
    for label in np.unique(labels):
        faces = surface.faces[labels == label]
        if label == main:
            continue
        points = surface.vertices[np.unique(faces)]
        face, _, far = search.query(points)
        votes = np.bincount(owner[face[far < CLOSE]], minlength=len(names)) / len(points)
        name = names[int(votes.argmax())]
        if len(faces) >= LEAST and votes.max() >= MAJORITY and name != "skin":
            found.setdefault(name, []).append(faces)
        else:
            dropped += 1
    return Told(found, dropped)


def balls(surface, told, laid):
    """Both eyeballs: a sphere of the file where there is one, else the built-in head's behind its lids.

    Returns:
        ((left Ball, right Ball), how many come from the file).
    """
    head = laid.head
    _, rims = skin_rims(head)
    skin = head.part_vertices("skin", "eye_socket")
    out, own = [], 0
    for side, rim in zip(EYES, rims):
        used = head.part_vertices("eye_" + side)
        points = head.mean[used].astype(float)
        center = points.mean(0)
        radius = float(np.median(np.linalg.norm(points - center, axis=1)))
        modes, scales = fit_ball(points, center, head.identity_basis[:, used].astype(float))
        lids = head.mean[np.asarray(rim)]
        away = np.linalg.norm(head.mean[skin][:, None] - lids[None, ::4], axis=2).min(1)
        near = skin[away < NEAR_LIDS]
        turn, scale, shift = similarity(
            head.mean[near].astype(float), laid.vertices[near], np.ones(len(near))
        )
        center, radius = scale * turn @ center + shift, scale * radius
        sphere = _sphere(surface, told.pieces.get("eye_" + side, ()), center)
        if sphere:
            (center, radius), own = sphere, own + 1
        iris = np.degrees(np.arcsin(min(laid.scale * IRIS / radius, 0.7)))
        out.append(Ball(center, radius, float(iris), laid.turned(modes), scales))
    return tuple(out), own


def _sphere(surface, pieces, expected):
    """Centre and radius of the largest round piece near a place, or None."""
    best = None
    for faces in pieces:
        points = surface.vertices[np.unique(faces)]
        back = points[points[:, 2] < np.median(points[:, 2])]  # without the cornea
        A = np.concatenate([2 * back, np.ones((len(back), 1))], 1)
        *center, rest = np.linalg.lstsq(A, (back**2).sum(1), rcond=None)[0]
        center = np.array(center)
        radius = float(np.sqrt(max(rest + center @ center, 0)))
        off = np.abs(np.linalg.norm(back - center, axis=1) - radius).mean()
        good = off < ROUND * radius and EYEBALL[0] < radius < EYEBALL[1]
        if good and np.linalg.norm(center - expected) < OFF_CENTER:
            if best is None or radius > best[1]:
                best = center, radius
    return best


def eye_patches(pair):
    """Eyeballs and the caps in front of them, in the built-in head's places of the atlas."""
    for side, ball in zip(EYES, pair):
        yield boxed(eyeball(side, ball), flatten.BOXES["eye_" + side])
        yield boxed(eye_proxy(side, ball, CAP), flatten.BOXES["eye_cap_" + side])


def has_mouth(told):
    """Whether a file holds both rows of teeth and their gums, so that they are taken from it."""
    found = [told.pieces.get(name, ()) for name in MOUTH[:4]]
    return all(0 < sum(map(len, pieces)) <= MOST for pieces in found)


def mouth_patches(surface, told, laid, seated):
    """Teeth, gums and tongue: of the file if it has them all, else the built-in head's.

    Args:
        surface: Surface; told: Told; laid: Laid; seated: [V, 3] from `seat`.
    """
    own = has_mouth(told)
    for name in MOUTH:
        if own and 0 < sum(map(len, told.pieces.get(name, ()))) <= MOST:
            yield _from_file(name, surface, told.pieces[name], laid, seated)
        else:
            faces = laid.head.part_faces(name)
            yield built_in(laid, faces, seated, laid.turned(laid.head.expression_basis))


def built_in(laid, chosen, vertices, shapes):
    """Some faces of the built-in head as it was laid, with its own uv: Patch.

    Args:
        chosen: [F] numbers of faces; vertices: [V, 3] mm and shapes: [E, V, 3] mm of the laid head.
    """
    head = laid.head
    used, small = np.unique(head.faces[chosen], return_inverse=True)
    uv_used, uv_small = np.unique(head.uv_faces[chosen], return_inverse=True)
    return Patch(
        parts=head.face_part[chosen],
        mean=vertices[used],
        faces=small.reshape(-1, 3),
        uv=head.uv[uv_used].astype(float),
        uv_faces=uv_small.reshape(-1, 3),
        follow=head.follow[used],
        identity=laid.turned(head.identity_basis[:, used]),
        expression=shapes[:, used],
    )


def _from_file(name, surface, pieces, laid, seated):
    """A part of the file that moves as the built-in head's does: Patch."""
    head = laid.head
    turned = [_outward(surface.vertices, faces) for faces in pieces]
    used, small = np.unique(np.concatenate(turned), return_inverse=True)
    points, faces = surface.vertices[used], small.reshape(-1, 3)
    source = head.part_vertices(name)
    modes = len(head.identity_basis)
    moves = np.concatenate([head.identity_basis[:, source], head.expression_basis[:, source]])
    # A tongue bends; rows of teeth and gums do not.
    carry = _nearby if name == "tongue" else affine_carry
    moved = carry(seated[source], laid.turned(moves.astype(float)), points).astype(np.float32)
    if name.endswith("upper"):
        moved[modes:] = 0
    uv, uv_faces, _ = unwrap(points[faces])
    return Patch(
        parts=part_ids(name, len(faces)),
        mean=points,
        faces=faces,
        uv=place(uv, flatten.BOXES[name]),
        uv_faces=uv_faces,
        follow=follow_ids(FOLLOWS[name.split("_")[-1]], len(points)),
        identity=moved[:modes],
        expression=moved[modes:],
    )


def _outward(vertices, faces):
    """A closed piece with its faces turned outward; an open one, like a gum, as it is."""
    normals = face_normals(vertices, faces)
    open_ = np.linalg.norm(normals.sum(0)) > 0.05 * np.linalg.norm(normals, axis=1).sum()
    return faces if open_ else outward_faces(vertices, faces)


def _nearby(points, moves, targets, count=4):
    """As `affine_carry`, but by the moves of the nearest points, blended."""
    from scipy.spatial import cKDTree

    far, which = cKDTree(points).query(targets, count)
    weight = 1 / np.maximum(far, 1e-3) ** 2
    weight /= weight.sum(1, keepdims=True)
    return np.einsum("kmnc,mn->kmc", moves[:, which], weight)
