"""OpenEXR textures for renderers: half float, tiles, mipmaps, by OpenImageIO as its `maketx` makes them."""

from pathlib import Path
from tempfile import TemporaryDirectory

import cv2
import numpy as np
import OpenImageIO as oiio

from bakery.errors import InputError
from bakery.formats.exr import DATA, LINEAR, REC709
from bakery.formats.files import write_bytes

TILE = 64  # texels
TIME = "1980:01:01 00:00:00"  # the same bytes whenever they are written


def write_texture(path: Path, picture: np.ndarray, size: int) -> None:
    """Write a texture; three channels are scene-linear Rec.709, one is data.

    Args:
        picture: [T, T, 3] or [T, T].
        size: texels on a side, at most.

    Raises:
        InputError: it cannot be written.
    """
    picture = np.asarray(picture, np.float32)
    if len(picture) > size:
        picture = cv2.resize(picture, (size, size), interpolation=cv2.INTER_AREA)
    height, width = picture.shape[:2]
    spec = oiio.ImageSpec(width, height, 1 if picture.ndim == 2 else 3, oiio.FLOAT)
    if picture.ndim == 2:
        spec.channelnames = ("Y",)
    spec.attribute("DateTime", TIME)
    spec.attribute("colorInteropID", LINEAR if picture.ndim == 3 else DATA)
    if picture.ndim == 3:
        spec.attribute("chromaticities", oiio.TypeDesc("float[8]"), REC709)
    source = oiio.ImageBuf(spec)
    source.set_pixels(oiio.ROI(), np.ascontiguousarray(picture.reshape(height, width, -1)))
    wanted = oiio.ImageSpec()
    wanted.set_format(oiio.HALF)
    wanted.tile_width = wanted.tile_height = TILE
    wanted.attribute("compression", "zip")
    wanted.attribute("wrapmodes", "clamp,clamp")
    with TemporaryDirectory() as folder:  # its writer does not report a full disk, Python does
        made = Path(folder) / "texture.exr"
        if not oiio.ImageBufAlgo.make_texture(oiio.MakeTxTexture, source, str(made), wanted):
            raise InputError(f"{path}: cannot be written ({oiio.geterror()[:200]})")
        write_bytes(path, made.read_bytes())
