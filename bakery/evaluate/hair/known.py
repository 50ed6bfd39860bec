"""Avatars of people whose hair is known, baked from their portraits as users bake, against the truth.

The avatar is brought to the true head by the similarity that fits all skin above the chin best, and
both are looked at from the same sides.
"""

from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

from bakery.bake.faces import find_faces
from bakery.bake.fitting import fit_portrait, own_head
from bakery.errors import BakeryError
from bakery.evaluate.fitting import similarity
from bakery.evaluate.hair.drawing import CardHair, Figure, Seen
from bakery.evaluate.hair.outlines import overlap
from bakery.evaluate.hair.people import Person
from bakery.formats.image import write_image
from bakery.formats.mark import PAINTED
from bakery.geometry import camera as cameras
from bakery.hair.base import Hair
from bakery.heads.base import HeadModel, once_a_mean
from bakery.landmarks import CHIN, OVAL
from bakery.stages.hair.directions import photographed
from bakery.stages.hair.portrait import look
from bakery.stages.segment import Segmentation
from bakery.synth.scene import portrait_camera
from bakery.types import Camera, Fit, Fragments

YAWS = (0, 30, -30, 45, -45, 60, -60, 90, -90)  # degrees
ASIDE = 45  # degrees, of the views that false hair is looked for in
SPARSE = 0.1  # cover of true hair below which the face is bare
LEAST = 200  # pixels of hair, below which there is nothing to measure
VIEW = {"width": 480, "height": 640, "filling": 0.336, "middle": (0.5, 0.3)}  # a pixel a mm


def view(yaw: float) -> Camera:
    """The camera that people are compared in; one pixel is about a millimetre of the head."""
    return portrait_camera(yaw=yaw, **VIEW)


def bake(
    person: Person, head: HeadModel, hair: Hair
) -> tuple[Fit, Segmentation, np.ndarray, Figure]:
    """Detect, segment, fit, hair.

    Returns:
        Fit, Segmentation, neutral shape [V, 3] mm, and the avatar as it is in its own photo, in its
        own space.

    Raises:
        BakeryError: a step fails.
    """
    _, (landmarks, *_) = find_faces(person.name, photo=person.photo)
    fit, segmentation = fit_portrait(person.name, person.photo, landmarks, head)
    own, neutral = own_head(head, fit)
    mesh = hair.mesh(person.photo, segmentation, fit, own, neutral)
    vertices = own.vertices(neutral, fit.expression, fit.gaze)
    return (
        fit,
        segmentation,
        neutral,
        Figure(own, vertices, None if mesh is None else CardHair(mesh)),
    )


def brought(made: Figure, true: Figure) -> Figure:
    """The avatar in the space of the true head; it may have vertices behind those of the other."""
    head = true.head
    skin = head.part_vertices("skin")
    chin = head.landmarks(true.vertices)[CHIN, 1].mean()
    above = skin[true.vertices[skin, 1] > chin]
    scale, turn, shift = similarity(
        made.vertices[above].astype(float), true.vertices[above].astype(float)
    )
    hair = made.hair
    if isinstance(hair, CardHair):
        points = scale * hair.mesh.vertices @ turn.T + shift
        hair = CardHair(replace(hair.mesh, vertices=points.astype(np.float32)))
    return Figure(made.head, scale * made.vertices @ turn.T + shift, hair)


def compare(true: Figure, made: Figure, yaw: float) -> dict:
    """Both from one side.

    Returns:
        {"iou": of the silhouettes of head and hair above the chin; "bare": the same of the avatar
        without hair, which is what `--hair layer` and `--hair none` give; "whole": with the hair
        below the chin; "depth_mm": median distance of the visible hair surfaces along the camera,
        where both have hair, None for less than LEAST pixels; "false": share of the face that true
        hair leaves free and the avatar's covers; "missing": share of the true hair above the chin
        that the avatar's does not cover}.
    """
    camera = view(yaw)
    found = true.fragments(camera)
    one, other = found.depth, made.wall(camera)
    hair, mine = true.seen(camera, one), made.seen(camera, other)
    chin = cameras.project(true.head.landmarks(true.vertices)[CHIN].mean(0), camera)[1]
    above = np.arange(camera.height)[:, None] < chin
    head, bald = np.isfinite(one) & above, np.isfinite(other) & above
    both, locks = hair.there & mine.there, hair.there & above
    apart = np.abs(hair.depth - mine.depth)[both]
    face = free_face(true.head, found, hair)
    return {
        "iou": overlap(bald | (mine.there & above), head | (hair.there & above)),
        "bare": overlap(bald, head | (hair.there & above)),
        "whole": overlap(bald | mine.there, head | hair.there),
        "depth_mm": round(float(np.median(apart)), 2) if len(apart) >= LEAST else None,
        "false": round(float((face & mine.there).sum() / max(face.sum(), 1)), 4),
        "missing": round(float((locks & ~mine.there).sum() / max(locks.sum(), 1)), 4),
    }


def free_face(head: HeadModel, found: Fragments, hair: Seen) -> np.ndarray:
    """Where a picture shows the face and no hair before it: [H, W] bool.

    Args:
        found: what is seen of the head, of `Figure.fragments`; hair: what is seen of its hair.
    """
    free: np.ndarray = (found.face >= 0) & face_triangles(head)[found.face]
    return free & (hair.cover < SPARSE)


@once_a_mean
def face_triangles(head: HeadModel) -> np.ndarray:
    """Which of the triangles of `Figure.faces` lie inside the face's contour: [F] bool."""
    faces = Figure(head, head.mean).faces
    ring = head.landmarks(head.mean)[OVAL].astype(np.float32)
    flat, middle = ring[:, :2].copy(), head.mean[faces].mean(1)
    inside = [cv2.pointPolygonTest(flat, place, False) > 0 for place in middle[:, :2].tolist()]
    return np.array(inside) & (middle[:, 2] > ring[:, 2].min())


def direction_error(
    person: Person, segmentation: Segmentation, fit: Fit, head: HeadModel, neutral: np.ndarray
) -> dict:
    """How far the directions seen in the photo are from the true ones, where both have hair.

    Args:
        head, neutral: of the avatar.

    Returns:
        {"direction": mean of the surer half, degrees; "direction_all": of all}; {} without hair.
    """
    portrait = look(person.photo.encoded, segmentation, fit, head, neutral)
    angle, sure = photographed(portrait)
    scale = portrait.camera.focal / fit.camera.focal
    corner = np.asarray(fit.camera.center) - np.asarray(portrait.camera.center) / scale
    height, width = sure.shape
    camera = cameras.crop(person.camera, *corner, width, height, scale)
    true = person.figure.seen(camera, person.figure.wall(camera))
    both = true.there & portrait.solid
    if both.sum() < LEAST or true.angle is None:
        return {}
    off = np.degrees(apart(angle, true.angle))[both]
    sure = sure[both]
    surer = off[sure >= np.median(sure)]
    return {
        "direction": round(float(surer.mean()), 2),
        "direction_all": round(float(off.mean()), 2),
    }


def apart(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Angles 0..pi/2 between lines that have no sense, both in radians."""
    turned: np.ndarray = np.abs((one - other + np.pi / 2) % np.pi - np.pi / 2)
    return turned


def measure(
    people: Iterable[Person], head: HeadModel, hair: Hair, pictures: Path | None = None
) -> Iterator[dict]:
    """A row a person: what `compare` gives of each yaw, and `direction_error`.

    Args:
        pictures: folder for PNGs of the portrait and of both silhouettes, or None.

    Yields:
        {"person", "kind", "views": {yaw: compare}, ...}; {"person", "kind", "failed": message}
        where the avatar could not be made.
    """
    for person in people:
        row = {"person": person.name, "kind": person.kind}
        try:
            fit, segmentation, neutral, own = bake(person, head, hair)
        except BakeryError as error:
            yield row | {"failed": str(error)}
            continue
        made = brought(own, person.figure)
        row["cards"] = own.hair is not None
        row |= direction_error(person, segmentation, fit, own.head, neutral)
        row["views"] = {str(yaw): compare(person.figure, made, yaw) for yaw in YAWS}
        if pictures is not None:
            write_image(Path(pictures) / f"{person.name}.png", sheet(person, made), mark=PAINTED)
        yield row


def sheet(person: Person, made: Figure) -> np.ndarray:
    """The portrait and the silhouettes from all sides: [h, w, 3] encoded.

    Grey both, red the truth alone, blue the avatar alone; hair is darker than head. Hair that covers
    the free face is green.
    """
    height = VIEW["height"]
    photo = person.photo.encoded
    parts = [
        cv2.resize(
            photo,
            (round(photo.shape[1] * height / len(photo)), height),
            interpolation=cv2.INTER_AREA,
        )
    ]
    for yaw in sorted(YAWS):
        camera = view(yaw)
        found, other = person.figure.fragments(camera), made.wall(camera)
        one, hair = found.depth, person.figure.seen(camera, found.depth)
        locks = hair.there, made.seen(camera, other).there
        true, mine = np.isfinite(one) | locks[0], np.isfinite(other) | locks[1]
        picture = np.ones((*one.shape, 3), np.float32)
        picture[true & mine] = 0.75
        picture[true & ~mine] = [0.9, 0.1, 0.1]
        picture[mine & ~true] = [0.1, 0.2, 0.9]
        for where, dark in zip(locks, ([0.7, 0.55, 0.55], [0.55, 0.55, 0.75])):
            picture[where] *= dark
        picture[free_face(person.figure.head, found, hair) & locks[1]] = [0, 0.7, 0]
        parts.append(picture[:, 80:400])
    return np.concatenate(parts, 1)


def summary(rows: list[dict]) -> dict:
    """Means over people and both sides, failures counted, and the worst at ASIDE."""
    done = [row for row in rows if "failed" not in row]
    out = {"people": len(rows), "failed": len(rows) - len(done)}
    if not done:
        return out

    def sides(row, name, turn):
        return _mean([row["views"][str(yaw)][name] for yaw in (turn, -turn)])

    turns = sorted({abs(yaw) for yaw in YAWS})
    for names, which in (
        (("iou", "bare", "whole"), turns), (("depth_mm", "false", "missing"), (0, ASIDE)),
    ):  # fmt: skip
        for name in names:
            out[name] = {
                str(turn): _mean([sides(row, name, turn) for row in done]) for turn in which
            }
    out["layer_better"] = sum(sides(row, "bare", ASIDE) > sides(row, "iou", ASIDE) for row in done)
    out["direction"] = _mean([row.get("direction") for row in done])
    out["worst"] = min(done, key=lambda row: sides(row, "iou", ASIDE))["person"]
    return out


def _mean(values):
    """Mean of those numbers that there are, or None."""
    known = [value for value in values if value is not None]
    return round(float(np.mean(known)), 4) if known else None
