"""The people of a folder of portraits, fitted, as trainings want them."""

from bakery.bake.fitting import segment_portrait
from bakery.bake.options import BuildOptions
from bakery.formats.image import read_photo
from bakery.formats.portraits import landmarks_of, reference_points
from bakery.stages.fit import FitOptions, fit

TRAINING = "london/train"  # the only photos that anything may be trained on


def albedo_subjects(portraits, head, start=TRAINING):
    """Yield (Photo, Fit, skin [H, W]) of each neutral training photo, fitted by landmarks alone.

    Args:
        portraits: folder with dense478.npz and the photos that it names.

    Raises:
        InputError: dense478.npz is missing or names no such photo.
    """
    for path, points in reference_points(portraits, start, part="neutral").items():
        photo = read_photo(path)
        face = landmarks_of(points)
        skin = segment_portrait(photo, face, BuildOptions()).skin
        yield photo, fit(photo, face, head, FitOptions(photometric=False)), skin
