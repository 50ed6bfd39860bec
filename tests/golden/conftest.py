"""Stored pictures: compared with a tolerance, replaced by `make golden`."""

import os
from pathlib import Path

import numpy as np
import pytest

from bakery.formats.image import read_photo, write_image

FOLDER = Path(__file__).parent
REJECTED = FOLDER.parents[1] / ".work" / "golden"  # both pictures of a failure lie there


@pytest.fixture
def golden():
    """A function (name, picture, tolerance, outliers) that compares with tests/golden/NAME.png.

    Args of it:
        picture: [H, W] or [H, W, 3], 0..1.
        tolerance: allowed difference of a pixel, 0..1.
        outliers: share of the pixels that may differ more.
    """

    def compare(name, picture, tolerance, outliers):
        path = FOLDER / f"{name}.png"
        picture = np.clip(np.asarray(picture, np.float32), 0, 1)
        if picture.ndim == 2:
            picture = np.repeat(picture[..., None], 3, 2)
        if os.environ.get("UPDATE_GOLDEN"):
            write_image(path, picture)
            return
        if not path.exists():
            pytest.skip(f"no golden picture {name} yet; `make golden` stores it")
        wanted = read_photo(path).encoded
        assert picture.shape == wanted.shape, "another size; look at it, then `make golden`"
        error = np.abs(picture - wanted).max(-1)
        share = float((error > tolerance).mean())
        if share > outliers:
            write_image(REJECTED / f"{name}-found.png", picture)
            write_image(REJECTED / f"{name}-wanted.png", wanted)
            row, column = np.unravel_index(error.argmax(), error.shape)
            pytest.fail(
                f"{name}: {share:.2%} of the pixels differ by more than {tolerance:.3f} (allowed "
                f"{outliers:.2%}), most by {error.max():.3f} at row {row}, column {column}; see "
                f"{REJECTED}"
            )

    return compare
