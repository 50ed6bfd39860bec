"""How well a detector finds faces and places their points.

Distances are over the outer-eye-corner distance of the true points, so 0.03 is 3%.
"""

import json
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from bakery.evaluate.detection import lips
from bakery.formats.image import read_photo
from bakery.formats.portraits import reference_points
from bakery.landmarks import face_size
from bakery.stages.detect import detect_faces

SETS = ("london/val", "lisa", "zoom", "canada", "extra")  # what the default detector never saw


@dataclass(frozen=True)
class PhotoResult:
    """One photo against its reference points."""

    name: str
    faces: int  # how many were found; one is right
    error: float  # mean over 478 points, eye distances; NaN where no face was found
    worst_point: float  # largest of the 478, eye distances
    human_error: float  # mean over the human-placed points; NaN without them
    mouth: dict  # see `lips.of_photo`


@dataclass(frozen=True)
class Summary:
    """All photos of one measurement."""

    photos: int
    missed: int  # photos without a face found
    extra: int  # photos with more than one face found
    error: float  # mean of the photos' errors
    error_worst: float
    name_worst: str
    human_error: float  # mean over the photos with human-placed points
    lips: dict  # see `lips.summary`


def point_error(points, reference):
    """Distance of each point over the reference's eye distance.

    Args:
        points: [n, 2] pixels.
        reference: [478, 2] pixels, or a pair (subset [n, 2], its eye distance).

    Returns:
        [n]
    """
    if isinstance(reference, tuple):
        reference, eyes = reference
    else:
        eyes = face_size(reference)
    return np.linalg.norm(points - reference, axis=1) / eyes


def measure(image, detector, reference, human=None):
    """Compare the detector's largest face with reference points.

    Args:
        image: [H, W, 3] as for `stages.detect.detect_faces`.
        detector: see `bakery.detectors.base.Detector`.
        reference: [478, 2] pixels.
        human: None, or (indices [n] into the 478, positions [n, 2] pixels).

    Returns:
        faces found, errors [478], human error (NaN without `human`), mouth (`lips.of_photo`)
    """
    faces = detect_faces(image, detector)
    points = faces[0].points if faces else None
    mouth = lips.of_photo(image, reference, points)
    if points is None:
        return 0, np.full(len(reference), np.nan), np.nan, mouth
    errors, human_error = point_error(points, reference), np.nan
    if human is not None:
        indices, positions = human
        eyes = face_size(reference)
        human_error = float(point_error(points[indices], (positions, eyes)).mean())
    return len(faces), errors, human_error, mouth


def measure_folder(portraits, detector, sets=SETS):
    """Measure a detector on a folder of portraits with their reference points.

    Args:
        portraits: folder with dense478.npz and the photos it names; with landmarks.json and
            frl189_to_478.json the human-placed points are compared as well.
        detector: see `bakery.detectors.base.Detector`.
        sets: which photos: the first part of their names.

    Yields:
        PhotoResult

    Raises:
        InputError: dense478.npz is missing or names no photo of the sets.
    """
    portraits = Path(portraits)
    human = human_points(portraits)
    for path, reference in reference_points(portraits, sets).items():
        name = path.relative_to(portraits).as_posix()
        image = read_photo(path).encoded
        count, errors, human_error, mouth = measure(image, detector, reference, human.get(name))
        yield PhotoResult(
            name, count, float(errors.mean()), float(errors.max()), human_error, mouth
        )


def human_points(portraits):
    """Human-placed points that mean the same place as one of the 478.

    Returns:
        dict: photo name -> (indices [n] into the 478, positions [n, 2] pixels); empty without
        the two files
    """
    files = [portraits / "landmarks.json", portraits / "frl189_to_478.json"]
    if not all(file.exists() for file in files):
        return {}
    images = json.loads(files[0].read_text())["images"]
    pairs = json.loads(files[1].read_text())["pairs"]
    from_template = [pair["frl189"] for pair in pairs]
    indices = np.array([pair["mesh478"] for pair in pairs])
    points = {}
    for name, (template, flat) in images.items():
        if template == "frl189":
            points[name] = indices, np.reshape(flat, (-1, 2)).astype(float)[from_template]
    return points


def summarize(results):
    """Summary of a list of PhotoResult."""
    errors = np.array([result.error for result in results])
    human = np.array([result.human_error for result in results])
    found = np.isfinite(errors)
    worst = int(np.nanargmax(errors)) if found.any() else 0
    return Summary(
        photos=len(results),
        missed=int((~found).sum()),
        extra=sum(result.faces > 1 for result in results),
        error=float(np.mean(errors[found])) if found.any() else float("nan"),
        error_worst=float(errors[worst]),
        name_worst=results[worst].name,
        human_error=float(np.nanmean(human)) if np.isfinite(human).any() else float("nan"),
        lips=lips.summary([result.mouth for result in results]),
    )


def as_json(record):
    """A result as a line of JSON, shares as they are, NaN as null."""
    table = {k: None if v != v else v for k, v in asdict(record).items()}
    return json.dumps(table)
