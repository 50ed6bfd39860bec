"""OpenEXR textures for renderers: half float, tiles, mipmaps, by OpenImageIO as its `maketx` makes them."""

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import OpenImageIO as oiio

from bakery.errors import InputError
from bakery.formats.exr import DATA, LINEAR, REC709
from bakery.formats.files import write_bytes
from bakery.formats.place import scratch

TILE = 64  # texels
TIME = "1980:01:01 00:00:00"  # the same bytes whenever they are written


@dataclass(frozen=True, eq=False)
class Colors:
    """A scene-linear space."""

    name: str  # colorInteropID
    chromaticities: tuple[float, ...]  # x, y of red, green, blue, white
    matrix: np.ndarray  # [3, 3] to it from Rec.709


REC709_COLORS = Colors(LINEAR, REC709, np.eye(3, dtype=np.float32))
# White adapted from D65 to that of ACES by Bradford's matrix; a test derives it from the primaries.
ACESCG = Colors(
    "lin_ap1_scene",
    (0.713, 0.293, 0.165, 0.830, 0.128, 0.044, 0.32168, 0.33767),
    np.array(
        [
            [0.61309732, 0.33952285, 0.04737928],
            [0.07019422, 0.91635557, 0.01345259],
            [0.02061560, 0.10956983, 0.86981512],
        ],
        np.float32,
    ),
)


def write_texture(
    path: Path, picture: np.ndarray, size: int, colors: Colors = REC709_COLORS
) -> None:
    """Write a texture; three channels are scene-linear colour, one is data.

    Args:
        picture: [T, T, 3] linear Rec.709, or [T, T].
        size: texels on a side, at most.
        colors: of the file.

    Raises:
        InputError: it cannot be written.
    """
    picture = np.asarray(picture, np.float32)
    if picture.ndim == 3:
        picture = picture @ colors.matrix.T
    if len(picture) > size:
        picture = cv2.resize(picture, (size, size), interpolation=cv2.INTER_AREA)
    height, width = picture.shape[:2]
    spec = oiio.ImageSpec(width, height, 1 if picture.ndim == 2 else 3, oiio.FLOAT)
    if picture.ndim == 2:
        spec.channelnames = ("Y",)
    spec.attribute("DateTime", TIME)
    spec.attribute("colorInteropID", colors.name if picture.ndim == 3 else DATA)
    if picture.ndim == 3:
        spec.attribute("chromaticities", oiio.TypeDesc("float[8]"), colors.chromaticities)
    source = oiio.ImageBuf(spec)
    source.set_pixels(oiio.ROI(), np.ascontiguousarray(picture.reshape(height, width, -1)))
    wanted = oiio.ImageSpec()
    wanted.set_format(oiio.HALF)
    wanted.tile_width = wanted.tile_height = TILE
    wanted.attribute("compression", "zip")
    wanted.attribute("wrapmodes", "clamp,clamp")
    with scratch() as folder:  # its writer does not report a full disk, Python does
        made = folder / "texture.exr"
        if not oiio.ImageBufAlgo.make_texture(oiio.MakeTxTexture, source, str(made), wanted):
            raise InputError(f"{path}: cannot be written ({oiio.geterror()[:200]})")
        write_bytes(path, made.read_bytes())
