"""Detect: which faces a photo shows, and which of them is meant."""

import logging
from dataclasses import replace
from pathlib import Path

from bakery.detectors.base import Detector
from bakery.detectors.file import FileDetector
from bakery.errors import InputError
from bakery.formats import image
from bakery.formats.record import read_choice
from bakery.plugins import maker_of, plug_in
from bakery.stages.detect import (
    MOST_OUTSIDE,
    SMALLEST_FACE,
    detect_faces,
    face_size,
    share_outside,
)
from bakery.types import Landmarks, Photo

log = logging.getLogger(__name__)
LARGER = 1.5  # times that a face is larger than every other one, to be taken without a number
LESS_SURE = 0.1  # of score at most, below another face: a sharp passer-by is as sure as the subject
SHOWN = 6  # faces that a message lists


def find_faces(
    path: Path | str,
    frame: int | None = None,
    landmarks: Path | None = None,
    detector: str = "network",
    photo: Photo | None = None,
) -> tuple[Photo, list[Landmarks]]:
    """A photo and every face in it, the largest first.

    Args:
        path: photo.
        frame: which frame of an animated picture.
        landmarks: a file that `bakery detect` wrote, in place of the detector.
        photo: the Photo, if it was read already.

    Returns:
        Photo and a list of Landmarks, at least one.

    Raises:
        InputError: the photo cannot be read or shows no face, or the landmarks are not its own.
    """
    photo = photo or image.read_photo(path, frame)
    if landmarks:
        found = detect_faces(photo.encoded, FileDetector(landmarks))
    else:
        finder: Detector = plug_in("detectors", detector)
        maker = maker_of("detectors", finder)
        found = [replace(face, maker=maker) for face in detect_faces(photo.encoded, finder)]
    if not found:
        raise InputError(
            f"{path}: no face found; needed is one that is upright, seen with both eyes, lit, and "
            f"at least {SMALLEST_FACE} pixels large"
        )
    return photo, found


def landmarks_file(landmarks: Path | None, photo: Path) -> Path | None:
    """The landmarks of a photo: the file given, or NAME.json in the folder given."""
    if landmarks is not None and Path(landmarks).is_dir():
        return Path(landmarks) / f"{Path(photo).stem}.json"
    return landmarks


def choose_face(path: Path | str, faces: list[Landmarks], number: int | None = None) -> Landmarks:
    """The face that is meant of all that a photo shows.

    Without a number that is the one which is clearly the largest and no less sure than the others:
    a face in a picture on the wall, or somebody behind, does not stop a bake.

    Args:
        path: what messages call the photo.
        faces: the largest first, at least one.
        number: which face, from 1; None to take the one that stands out.

    Raises:
        InputError: no face stands out and no number is given, or there is no such number.
    """
    if number is not None:
        if number > len(faces):
            raise InputError(
                f"{path}: has {len(faces)} face(s), no face {number}; give a lower --face"
            )
        return faces[number - 1]
    first, *others = faces
    if all(
        face_size(first) >= LARGER * face_size(face) and first.score >= face.score - LESS_SURE
        for face in others
    ):
        return first
    listed = ", ".join(
        f"{k} at ({face.box[0]:.0f}, {face.box[1]:.0f}) of {face_size(face):.0f} pixels"
        for k, face in enumerate(faces[:SHOWN], 1)
    )
    raise InputError(
        f"{path}: {len(faces)} faces ({listed}), none of them clearly the largest and surest; "
        "choose one with --face N"
    )


def one_face(
    path: Path | str,
    frame: int | None = None,
    landmarks: Path | None = None,
    number: int | None = None,
    detector: str = "network",
    photo: Photo | None = None,
) -> tuple[Photo, Landmarks]:
    """A photo and the one face in it that is meant.

    Args:
        path, frame, landmarks, detector, photo: see `find_faces`.
        number: which face, from 1; None takes what the landmarks' file says, or else the one that
            stands out; see `choose_face`.

    Raises:
        InputError: no face stands out, there is no such face, it is too small, or too much of
            it lies outside of the picture.
    """
    photo, faces = find_faces(path, frame, landmarks, detector, photo)
    if number is None and landmarks:
        number = read_choice(landmarks)
    chosen = choose_face(path, faces, number)
    if number is None and len(faces) > 1:
        sizes = ", ".join(f"{face_size(face):.0f}" for face in faces[1 : SHOWN + 1])
        log.warning(
            "%s: took the largest face (%.0f pixels); left out %d more (%s pixels), see --face N",
            path, face_size(chosen), len(faces) - 1, sizes,
        )  # fmt: skip
    if face_size(chosen) < SMALLEST_FACE:
        raise InputError(
            f"{path}: the face is {face_size(chosen):.0f} pixels large; at least {SMALLEST_FACE} "
            "are needed; give a larger picture"
        )
    if (outside := share_outside(chosen, photo.encoded.shape)) > MOST_OUTSIDE:
        raise InputError(
            f"{path}: {outside:.0%} of the face lie outside of the picture; at most {MOST_OUTSIDE:.0%} "
            "may; give one that shows both eyes, nose and mouth"
        )
    return photo, chosen
