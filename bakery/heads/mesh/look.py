"""Landmarks of a surface: drawn from a few sides, detected, compared with the built-in head.

A detector of photographs is biased on shaded previews: without brows it takes the hollow of the eye
for them and moves the lids down by millimetres. The built-in head, shaped alike and drawn alike,
shows the bias.
"""

import numpy as np

from bakery.errors import InputError
from bakery.geometry import rotation
from bakery.heads.mesh.draw import SIZE, SKIN, cast, draw, first_view, frames
from bakery.heads.mesh.pose import Seen, ViewRays, shape_of, similarity
from bakery.heads.mesh.read import Surface, pieces
from bakery.heads.mesh.register import FLESH, fit_identity
from bakery.heads.report import shaded
from bakery.landmarks import FACE, LEFT_IRIS, RIGHT_IRIS

SURE = 0.85  # score of a face at which no other axes are tried
YAWS = (0.0, -32.0, 32.0)  # degrees of the views that landmarks are taken from
EYE_REACH = 24.0  # mm around an eye's centre: what lies there in pieces of its own is the eye's
SHUT = 4.0  # mm before an eye's centre, and it is skin: the lids are shut


def look(surface, find, head, up=None):
    """Find the landmarks of a surface by drawing it.

    Args:
        surface: Surface.
        find: function (picture [H, W, 3] uint8) -> list of Landmarks, the likeliest first.
        head: HeadModel, to compare with.
        up: axis of the file that points up, as "z" or "-y"; None tries them all.

    Returns:
        Seen.

    Raises:
        InputError: no face is found from any side.
    """
    first = first_look(surface, find, up)
    shape = shape_of(head)
    points, weight = cast(first[1], first[0].points[:FACE])
    turn, scale, shift = similarity(points, shape, weight)
    surface, color, open_eyes = with_eyes(surface, head, first, turn, scale, shift)
    views, found = [], []
    for yaw in YAWS:
        turn, scale, _ = similarity(points, shape, weight)
        middle = np.average(points, axis=0, weights=weight)
        extent = np.ptp(shape[:, 1]) / scale
        view = draw(surface, rotation.yaw_pitch(yaw, 0) @ turn, middle, 0.85 * extent, color)
        faces = find(view.picture)
        if faces:
            views.append(view)
            found.append(faces[0])
            if yaw == YAWS[0]:
                points, weight = cast(view, faces[0].points[:FACE])
    if not views:
        raise InputError("the face is lost when it is looked at from near; give --landmarks")
    pixels = [face.points[:FACE].astype(float) for face in found]
    trust = np.array([face.confidence[:FACE] for face in found], float)
    score = min(face.score for face in found)
    about = f"landmarks: found in {len(views)} drawn views, score {score:.2f} or more"
    seen = seen_in(views, pixels, trust, about)
    if not open_eyes:  # then it is off by something else
        return seen
    bias = biases(seen, views, find, head)
    return seen_in(views, [p - b for p, b in zip(pixels, bias)], trust, about)


def first_look(surface, find, up):
    """The surest face of a surface seen along its axes: (Landmarks, View)."""
    best = None
    for turn in frames(up):
        view = first_view(surface, turn)
        faces = find(view.picture)
        if faces and (best is None or faces[0].score > best[0].score):
            best = faces[0], view
        if best and best[0].score >= SURE:
            break
    if best is None:
        raise InputError(
            "no face is seen on the mesh from any side; is it a head? --up names the axis that "
            "points up, --landmarks gives the points"
        )
    return best


def biases(seen, views, find, head):
    """By how many pixels [468, 2] the detector is off in each view, on the built-in head.

    Args:
        seen: Seen, what the head is shaped after; views: list of View that it is drawn as.
    """
    vertices, _, _ = fit_identity(head, seen, seen.rays.trust + 1e-6)
    chosen = head.part_faces(*FLESH, "eye_left", "eye_right")
    color = shaded.colors(head)[chosen].mean(1)
    color[np.isin(chosen, head.part_faces(*FLESH))] = SKIN
    own, places = Surface(vertices, head.faces[chosen]), head.landmarks(vertices)[:FACE]
    out = []
    for view in views:
        faces = find(draw(own, view.turn, view.middle, view.half, color).picture)
        off = faces[0].points[:FACE] - view.pixels(places) if faces else np.zeros((FACE, 2))
        out.append(off)
    return out


def with_eyes(surface, head, seen, turn, scale, shift):
    """A surface with the coloured eyeballs of a head in its sockets, in place of its own.

    A detector that sees hollow or white eyes places lids wrong by millimetres. Lids that are shut
    stay shut.

    Args:
        seen: (Landmarks, View) of a first look.
        turn, scale, shift: of `similarity`, from the file's axes to the head's.

    Returns:
        (Surface, colour of each of its faces [F, 3] linear, whether both eyes are open).
    """
    label = pieces(surface.faces)
    points = scale * surface.vertices @ turn.T + shift
    kept = np.ones(len(surface.faces), bool)
    balls, (face, view) = [], seen
    for name, iris in (("eye_left", LEFT_IRIS), ("eye_right", RIGHT_IRIS)):
        column, row = np.clip(face.points[iris.start], 0, SIZE - 1).astype(int)
        chosen = head.part_faces(name)
        center = head.mean[np.unique(head.faces[chosen])].mean(0)
        hit = view.face[row, column]
        place = scale * turn @ view.place[row, column] + shift
        if hit >= 0 and label[hit] == 0 and place[2] > center[2] + SHUT:
            continue  # skin lies where the eye should be
        balls.append(chosen)
        near = np.linalg.norm(points[surface.faces].mean(1) - center, axis=1) < EYE_REACH
        for piece in np.setdiff1d(np.unique(label[near]), [0]):
            kept &= ~((label == piece) & (near[label == piece].mean() > 0.9))
    own = surface.take(kept)
    color = np.tile(SKIN, (len(own.faces), 1))
    if not balls:
        return own, color, False
    chosen = np.concatenate(balls)
    used, faces = np.unique(head.faces[chosen], return_inverse=True)
    added = (head.mean[used] - shift) @ turn / scale
    joined = Surface(
        np.concatenate([own.vertices, added]),
        np.concatenate([own.faces, faces.reshape(-1, 3) + len(own.vertices)]),
    )
    return joined, np.concatenate([color, shaded.colors(head)[chosen].mean(1)]), len(balls) == 2


def seen_in(views, pixels, trust, about):
    """What landmarks in views tell about the surface.

    Args:
        views: list of n View; pixels: n times [468, 2]; trust: [n, 468] 0..1; about: for people.

    Returns:
        Seen.
    """
    rays = ViewRays(
        np.array([view.eye for view in views]),
        np.array([view.rays(points) for view, points in zip(views, pixels)]),
        trust,
    )
    casts = [cast(view, points) for view, points in zip(views, pixels)]
    places, weights = np.array([at for at, _ in casts]), np.array([w for _, w in casts])
    weights = weights * trust + 1e-6
    points = np.einsum("nl,nlc->lc", weights / weights.sum(0), places)
    return Seen(points, weights.max(0), about, rays)
