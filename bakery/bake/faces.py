"""Detect: which faces a photo shows, and which of them is meant."""

from dataclasses import replace
from pathlib import Path

from bakery.detectors.base import Detector
from bakery.detectors.file import FileDetector
from bakery.errors import InputError
from bakery.formats import image
from bakery.plugins import maker_of, plug_in
from bakery.stages.detect import SMALLEST_FACE, detect_faces, face_size
from bakery.types import Landmarks, Photo


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
            f"{path}: no face found; give a photo of a face, upright and at least "
            f"{SMALLEST_FACE} pixels large"
        )
    return photo, found


def landmarks_file(landmarks: Path | None, photo: Path) -> Path | None:
    """The landmarks of a photo: the file given, or NAME.json in the folder given."""
    if landmarks is not None and Path(landmarks).is_dir():
        return Path(landmarks) / f"{Path(photo).stem}.json"
    return landmarks


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
        number: which face, from 1; None if there is but one.

    Raises:
        InputError: several faces and no number, or a face that is too small.
    """
    photo, faces = find_faces(path, frame, landmarks, detector, photo)
    if number is None and len(faces) > 1:
        boxes = ", ".join(
            f"{k} at ({face.box[0]:.0f}, {face.box[1]:.0f})" for k, face in enumerate(faces[:6], 1)
        )
        raise InputError(f"{path}: {len(faces)} faces ({boxes}); choose one with --face N")
    if number is not None and number > len(faces):
        raise InputError(f"{path}: has {len(faces)} face(s), no face {number}; give a lower --face")
    chosen = faces[(number or 1) - 1]
    if face_size(chosen) < SMALLEST_FACE:
        raise InputError(
            f"{path}: the face is {face_size(chosen):.0f} pixels large; at least {SMALLEST_FACE} "
            "are needed; give a larger picture"
        )
    return photo, chosen
