"""What a first bake compiles, compiled before it."""

import logging
import tempfile
import time
from pathlib import Path

from bakery import preset
from bakery.bake import pipeline
from bakery.bake.options import BuildOptions
from bakery.paths import ASSETS, PACKAGE

# On top of the preset small: every part, few of each.
SETTINGS = ("texture.mouths=2", "texture.views=[0.0]")
# A painted portrait that smiles and has hair, in a wheel and in a checkout.
PORTRAITS = (ASSETS / "portrait.jpg", PACKAGE.parent / "samples" / "dalia.jpg")


def warm() -> float:
    """Bake a painted portrait into nothing: numba compiles the loops that a bake runs, and keeps them.

    Their code is written beside the package, or below the user's cache where that cannot be written.

    Returns:
        seconds.

    Raises:
        BakeryError: what the user can mend.
    """
    began = time.monotonic()
    tables = preset.with_settings(preset.load("builds", "small"), SETTINGS)
    options = preset.options_from(BuildOptions, tables, "warm")
    portrait = next(path for path in PORTRAITS if path.exists())
    logging.disable(logging.WARNING)  # nobody asked how good the portrait is
    try:
        with tempfile.TemporaryDirectory() as place:
            pipeline.build(pipeline.Request(portrait, Path(place) / "warm.avatar", options))
    finally:
        logging.disable(logging.NOTSET)
    return time.monotonic() - began
