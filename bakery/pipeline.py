"""The bake: the order of the steps, what each reads, what is kept of it."""

import logging

from bakery.errors import FitError, InputError
from bakery.formats import image, record

log = logging.getLogger(__name__)

SMALLEST_FACE = 96  # pixels, longer side of the face's box


def open_head(name):
    """The head model of a name or path, ready to be fitted again and again."""
    from bakery.heads.file import load_head

    return load_head(name)


def find_faces(path, frame=None):
    """A photo and every face in it.

    Args:
        path: photo.
        frame: which frame of an animated picture.

    Returns:
        Photo and a list of Landmarks, at least one.

    Raises:
        InputError: the photo cannot be read, or shows no face.
    """
    from bakery.stages.detect import detect_faces

    photo = image.read_photo(path, frame)
    faces = detect_faces(photo.encoded)
    if not faces:
        raise InputError(
            f"{path}: no face found; give a photo of one face, upright, at least {SMALLEST_FACE} pixels"
        )
    return photo, faces


def one_face(path, frame=None, landmarks=None, number=None):
    """A photo and the one face in it that is meant.

    Args:
        path: photo.
        frame: which frame of an animated picture.
        landmarks: a file that `bakery detect` wrote, in place of the detector.
        number: which face, from 1; None if there is but one.

    Returns:
        Photo and Landmarks.

    Raises:
        InputError: no face, several and no number, a face that is too small, or landmarks of
            another picture.
    """
    if landmarks is None:
        photo, faces = find_faces(path, frame)
    else:
        photo = image.read_photo(path, frame)
        faces = _given_faces(path, photo, landmarks)
    if number is None and len(faces) > 1:
        boxes = ", ".join(
            f"{k} at ({face.box[0]:.0f}, {face.box[1]:.0f})" for k, face in enumerate(faces[:6], 1)
        )
        raise InputError(f"{path}: {len(faces)} faces ({boxes}); choose one with --face N")
    if number is not None and number > len(faces):
        raise InputError(f"{path}: has {len(faces)} face(s), no face {number}; give a lower --face")
    face = faces[(number or 1) - 1]
    size = float(max(face.box[2:]))
    if size < SMALLEST_FACE:
        raise InputError(
            f"{path}: the face is {size:.0f} pixels large; at least {SMALLEST_FACE} are needed; "
            "give a larger picture"
        )
    return photo, face


def _given_faces(path, photo, landmarks):
    (width, height), faces = record.read_faces(landmarks)
    have = photo.encoded.shape[1::-1]
    if (width, height) != tuple(have):
        raise InputError(
            f"{landmarks}: made for a photo of {width}x{height} pixels, {path} has "
            f"{have[0]}x{have[1]}; detect again"
        )
    if not faces:
        raise InputError(f"{landmarks}: holds no face; detect again")
    return faces


def place_head(path, photo, landmarks, head):
    """Segment the photo and fit the head.

    Returns:
        Fit and Segmentation.
    """
    from bakery.stages.fit import fit
    from bakery.stages.segment import segment

    try:
        segmentation = segment(photo.encoded, landmarks.points)
        return fit(photo, landmarks, head, skin=segmentation.skin), segmentation
    except FitError as error:
        raise FitError(f"{path}: {error}") from error
