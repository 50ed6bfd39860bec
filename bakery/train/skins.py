"""Unwraps photographs of neutral faces into skins for painted training subjects."""

from bakery.bake.faces import one_face
from bakery.bake.fitting import fit_portrait, own_head
from bakery.errors import InputError
from bakery.stages.texture.hair import mattes_of
from bakery.synth import skins

PATTERN = "*_neutral.jpg"


def unwrap_folder(photos, head, output):
    """Unwrap every NAME_neutral.jpg of a folder; what is there already is left alone.

    Args:
        photos, output: Path.
        head: HeadModel.

    Yields:
        Path of each skin once it is written.

    Raises:
        InputError: the folder holds no such photo.
    """
    paths = sorted(photos.glob(PATTERN))
    if not paths:
        raise InputError(f"{photos}: holds no {PATTERN}; give a folder of such photographs")
    output.mkdir(parents=True, exist_ok=True)
    for path in paths:
        target = output / f"{head.name}-{path.stem.split('_')[0]}.npz"
        if target.exists():
            continue
        photo, landmarks = one_face(path)
        fit, segmentation = fit_portrait(path, photo, landmarks, head)
        own, neutral = own_head(head, fit)
        mattes = mattes_of(photo.encoded, segmentation, landmarks.points)
        skins.save(target, skins.unwrap(photo, landmarks, fit, neutral, own, mattes))
        yield target
