"""Known landmarks of many photos, to learn a head model's correspondence and shapes from."""

from pathlib import Path

import numpy as np

from bakery.errors import InputError
from bakery.formats import npz
from bakery.formats.files import read_bytes
from bakery.formats.image_header import read_header
from bakery.types import LANDMARKS


def read_points(points, portraits):
    """The points of the photos in a folder.

    Args:
        points: .npz with `names` [N] (paths that end in the photo's folder and file name) and
            `points` [N, 478, 2 or 3] pixels.
        portraits: folder of photos.

    Returns:
        (points [M, 478, 2] float64, sizes [M, 2] (width, height), names [M]) of the photos that
        are in both.

    Raises:
        InputError: not such a file, or none of its photos is in the folder.
    """
    try:
        table = npz.unpack_arrays(read_bytes(points))
        names, known = [str(name) for name in table["names"]], table["points"]
    except (ValueError, KeyError, TypeError) as error:
        raise InputError(f"{points}: needs arrays `names` and `points` ({error})") from error
    if known.ndim != 3 or known.shape[:2] != (len(names), LANDMARKS) or known.shape[2] < 2:
        raise InputError(
            f"{points}: `points` has shape {list(known.shape)}, needs [{len(names)}, 478, 2 or 3]"
        )
    folder = Path(portraits).resolve()
    chosen, sizes = [], []
    for row, name in enumerate(names):
        file = folder / Path(name).name
        if Path(name).parent.name == folder.name and file.is_file():
            header = read_header(file.name, file.read_bytes())
            chosen.append(row)
            sizes.append((header.width, header.height))
    if not chosen:
        raise InputError(f"{portraits}: holds none of the photos that {points} names")
    return known[chosen, :, :2].astype(float), np.array(sizes), [names[row] for row in chosen]
