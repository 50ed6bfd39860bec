"""HEIC and AVIF, as phones give them: pictures in boxes of ISO base media files.

Pillow reads AVIF; pi-heif, an extra, gives it HEIC. OpenImageIO as its wheels are built reads neither.
Colours are said by an ICC profile or by code points (ISO/IEC 23091-2), of which Display P3 and sRGB
are known here.
"""

import io
import struct

import numpy as np
from PIL import Image, features

from bakery.errors import InputError
from bakery.geometry.color import to_encoded, to_linear

HEIC = (b"heic", b"heix", b"heim", b"heis", b"hevc", b"hevx")
AVIF = (b"avif", b"avis")
SDR = (1, 2, 6, 13, 14, 15)  # transfer: BT.709, unsaid, BT.601, sRGB, BT.2020; all taken as sRGB's
HDR = {16: "PQ", 18: "HLG"}
P3 = 12  # primaries of Display P3
TO_SRGB = np.array(  # linear light, both with white D65; from the primaries of SMPTE EG 432-1
    [[1.224940, -0.224940, 0.0], [-0.042057, 1.042057, 0.0], [-0.019638, -0.078636, 1.098274]],
    np.float32,
)


def kind(data: bytes) -> str:
    """ "heif", "avif" or "" of the first bytes of a file in boxes."""
    if data[4:8] != b"ftyp":
        return ""
    (size,) = struct.unpack(">I", data[:4])
    box = data[8 : max(min(size, 256), 16)]
    brands = [box[:4], *(box[at : at + 4] for at in range(8, len(box), 4))]
    if any(brand in AVIF for brand in brands):
        return "avif"
    return "heif" if any(brand in (*HEIC, b"mif1", b"msf1") for brand in brands) else ""


def make_ready(name: object, which: str) -> None:
    """Have Pillow read a kind.

    Args:
        name: how messages call the file.

    Raises:
        InputError: what reads it is not installed.
    """
    if which == "avif" and not features.check("avif"):
        raise InputError(
            f"{name}: an AVIF picture, which this Pillow cannot read; install a newer one, or save "
            "the photo as JPEG"
        )
    if which == "heif":
        try:
            import pi_heif
        except ImportError:
            raise InputError(
                f"{name}: a HEIC picture; pip install 'bakery[heic]' reads it, or save it as JPEG"
            ) from None
        pi_heif.register_heif_opener()


def samples(data: bytes, which: str, frame: int) -> np.ndarray:
    """The stored samples [H, W, C] uint8, or uint16 of more than 8 bits; alpha not multiplied in.

    Raises:
        Exception: of many kinds, from the decoders, if the picture is damaged.
    """
    if which == "heif":
        import pi_heif

        found = pi_heif.open_heif(io.BytesIO(data), convert_hdr_to_8bit=False)[frame]
        out = np.array(found)  # a copy: its own array does not keep the memory it looks at
    else:
        picture = Image.open(io.BytesIO(data), formats=["AVIF"])
        picture.seek(frame)
        out = np.asarray(picture)
    return out if out.ndim == 3 else out[:, :, None]


def code_points(data: bytes) -> tuple[int, int] | None:
    """Primaries and transfer that the first `colr` box of kind `nclx` names, or None."""
    at = data.find(b"colrnclx", 0, 1 << 16)
    return struct.unpack(">HH", data[at + 8 : at + 12]) if 0 <= at <= len(data) - 12 else None


def to_srgb(name: object, encoded: np.ndarray, data: bytes, notes: list[str]) -> np.ndarray:
    """Colours [H, W, 3] by the file's code points, in sRGB.

    Args:
        notes: gets a line of what was converted.

    Raises:
        InputError: a picture of high dynamic range.
    """
    primaries, transfer = code_points(data) or (1, 13)
    if transfer in HDR:
        raise InputError(
            f"{name}: a picture of high dynamic range ({HDR[transfer]}); save it in standard range, "
            "as JPEG"
        )
    if primaries != P3 or transfer not in SDR:
        return encoded
    notes.append("Display P3 converted to sRGB")
    return to_encoded(np.clip(to_linear(encoded) @ TO_SRGB.T, 0, 1)).astype(np.float32)
