"""Photos in, pictures out.

OpenImageIO decodes, because it reports what other readers pass over: the grey fill of a truncated
JPEG and the warnings of its decoder. Pillow reads headers and converts colour (little CMS).
"""

import io
import os
import re
import shutil
from pathlib import Path

import cv2
import numpy as np
import OpenImageIO as oiio
from PIL import Image, ImageCms

from bakery.errors import InputError
from bakery.formats import heif
from bakery.formats.files import digest, read_bytes, write_bytes
from bakery.formats.image_header import MEGAPIXELS, check_frame, read_header
from bakery.formats.ingredient import ingredient_in, note_of
from bakery.formats.mark import Mark, stamped
from bakery.formats.place import scratch
from bakery.types import Photo

BACKGROUND = 0.5  # sRGB-encoded grey behind transparent pixels: neither bright rim nor dark
OPAQUE = 0.9  # alpha from which a pixel shows the person, and below 1 minus which it shows nothing
MOST_FAINT = 0.25  # of the pixels that show something; soft edges and hair have a few hundredths
ENDINGS = (".jpg", ".jpeg", ".png", ".tif", ".tiff", ".webp", ".bmp", ".gif", ".jp2", ".ppm")
# Descriptions of ICC profiles that are told.
PROFILES = (
    "Display P3",
    "DCI-P3",
    "Adobe RGB (1998)",
    "ProPhoto RGB",
    "ROMM RGB",
    "Rec. 2020",
    "Gray",
)
oiio.attribute(
    "limits:imagesize_MB", MEGAPIXELS * 16
)  # 64 megapixels of four 16-bit samples, twice
oiio.attribute("limits:resolution", 65536)
oiio.attribute("threads", 1)  # the same bytes whatever the machine


def read_photo(path: str | Path, frame: int | None = None) -> Photo:
    """Read a photo, upright and in sRGB.

    Args:
        path: a JPEG, PNG, TIFF, WebP, HEIC, AVIF, BMP, GIF or JPEG 2000 file.
        frame: which picture of a file of several, from 0; None refuses animations and pages.

    Returns:
        Photo; its notes name every conversion, and say if the file says that it is synthetic.

    Raises:
        InputError: not a photo, damaged, too large or too small, half-transparent, animated.
    """
    path = Path(path)
    data = read_bytes(path)
    header = read_header(path, data)
    notes = []
    check_frame(path, header, frame)
    if header.several:
        notes.append(f"frame {frame} of {header.several}")
    samples = _decode(path, data, header, frame or 0)
    if header.mode == "CMYK":
        encoded = _from_cmyk(path, data, header, notes)
    else:
        encoded = _to_rgb(path, samples, header, notes)
        if header.format in ("heif", "avif") and header.profile is None:
            encoded = heif.to_srgb(path, encoded, data, notes)
    if header.orientation != 1:
        encoded = _upright(encoded, header.orientation)
        notes.append(f"turned upright (EXIF orientation {header.orientation})")
    sha256 = digest(data)
    ingredient = ingredient_in(data, sha256)
    if note := note_of(ingredient):
        notes.append(note)
    return Photo(
        np.ascontiguousarray(encoded, np.float32),
        sha256,
        header.focal_35mm,
        tuple(notes),
        ingredient,
    )


def write_image(
    path: str | Path, encoded: np.ndarray, quality: int = 92, mark: Mark | None = None
) -> None:
    """Write a picture as PNG, JPEG or WebP, by the name's ending.

    Args:
        encoded: [H, W, 1, 3 or 4] sRGB-encoded 0..1, or uint8.
        quality: 1..100 of JPEG and WebP.
        mark: what it says about itself; None for photographs, and where it is stamped later.
    """
    kind = str(path)[str(path).rfind(".") :].lower()
    data = encode_image(encoded, kind, quality)
    write_bytes(path, stamped(kind, data, mark) if mark else data)


def encode_image(encoded, kind, quality=92):
    """The file bytes of [H, W], [H, W, 3] or [H, W, 4] sRGB-encoded 0..1 or uint8.

    Args:
        kind: ".png", ".jpg" or ".webp".
        quality: 1..100 of JPEG and WebP.
    """
    pixels = np.asarray(encoded)
    if pixels.dtype != np.uint8:
        pixels = (np.clip(pixels, 0, 1) * 255 + 0.5).astype(np.uint8)
    if pixels.ndim == 3 and pixels.shape[2] >= 3:
        pixels = cv2.cvtColor(
            pixels, cv2.COLOR_RGB2BGR if pixels.shape[2] == 3 else cv2.COLOR_RGBA2BGRA
        )
    settings = {
        ".jpg": [cv2.IMWRITE_JPEG_QUALITY, quality],
        ".webp": [cv2.IMWRITE_WEBP_QUALITY, quality],
        ".png": [cv2.IMWRITE_PNG_COMPRESSION, 6],
    }
    if kind not in settings:
        raise InputError(f"pictures are written as .png, .jpg or .webp, not as '{kind}'")
    return compressed(kind, pixels, settings[kind]).tobytes()


def compressed(kind: str, pixels: np.ndarray, settings: list[int]) -> np.ndarray:
    """The bytes [n] uint8 of a picture as OpenCV codes it, its channels in OpenCV's order.

    Raises:
        MemoryError: OpenCV gives half a file and a flag that nobody looks at.
    """
    whole, data = cv2.imencode(kind, pixels, settings)
    if not whole:
        raise MemoryError(f"no memory to code {kind}")
    return data


def _decode(path, data, header, frame):
    """The stored samples [H, W, C] uint8 or uint16, alpha not multiplied in."""
    if header.format in ("heif", "avif"):
        try:
            samples = heif.samples(data, header.format, frame)
        except Exception as error:  # the decoders raise almost anything on damaged files
            if frame and isinstance(error, (EOFError, IndexError)):
                raise _no_frame(path, frame) from None
            raise _damaged(path) from None
        if samples.shape[:2] != (header.height, header.width):
            raise _damaged(path)
        return samples
    asked = oiio.ImageSpec()
    asked.attribute("oiio:UnassociatedAlpha", 1)
    # OpenImageIO chooses its reader by the ending first and wants UTF-8.
    if path.suffix.lower() in ENDINGS and str(path).isascii():
        return _samples(oiio.ImageInput.open(str(path), asked), path, header, frame)
    if os.path.isdir("/dev/fd"):  # a name that has neither an ending nor a foreign spelling
        with open(path, "rb") as file:
            source = oiio.ImageInput.open(f"/dev/fd/{file.fileno()}", asked)
            return _samples(source, path, header, frame)
    with scratch() as folder:
        copy = str(shutil.copyfile(path, folder / "photo"))
        return _samples(oiio.ImageInput.open(copy, asked), path, header, frame)


def _samples(source, path, header, frame):
    if source is None:
        oiio.geterror()
        raise _damaged(path)
    try:
        if frame and not source.seek_subimage(frame, 0):
            source.geterror()
            raise _no_frame(path, frame)
        spec = source.spec()
        if source.format_name() != header.format or (spec.width, spec.height) != (
            header.width,
            header.height,
        ):
            raise _damaged(path)
        deep = spec.format.basetype not in (oiio.UINT8, oiio.INT8)
        samples = source.read_image(oiio.UINT16 if deep else oiio.UINT8)
        if source.has_error and not _harmless(message := source.geterror()):
            raise _damaged(path, message)
        if samples is None:
            raise _damaged(path)
    finally:
        source.close()
    return samples


def _harmless(message):
    """Some phones leave a few bytes before the end marker, with the picture complete."""
    extra = re.search(r"Corrupt JPEG data: (\d+) extraneous bytes before marker 0xd9", message)
    return bool(extra) and int(extra[1]) <= 64


def _no_frame(path, frame):
    return InputError(f"{path}: has no frame {frame}; frames count from 0")


def _damaged(path, message=""):
    reason = " ".join(message.split("(")[0].split())[:80]
    return InputError(
        f"{path}: a truncated or damaged picture{f' ({reason})' if reason else ''}; "
        "copy or download it again"
    )


def _to_rgb(path, samples, header, notes):
    """Stored samples [H, W, C] to sRGB-encoded [H, W, 3] float32."""
    scale = np.float32(1 / np.iinfo(samples.dtype).max)
    if samples.dtype == np.uint16:
        notes.append("16-bit samples")
    channels = samples.shape[2]
    color = samples[:, :, :3] if channels >= 3 else samples[:, :, :1]
    if color.shape[2] == 1:
        notes.append("grey picture")
    encoded = _from_profile(color, header.profile, notes)
    if encoded is None:
        encoded = color * scale
    if encoded.shape[2] == 1:
        encoded = np.repeat(encoded, 3, 2)
    if channels in (2, 4):
        alpha = samples[:, :, -1:] * scale
        if alpha.min() < 1:
            _check_alpha(path, alpha)
            encoded = encoded * alpha + BACKGROUND * (1 - alpha)
            notes.append("transparent parts put over mid-grey")
    return encoded


def _check_alpha(path, alpha):
    """Refuse a picture that is a ghost over any background; a cut-out person with soft hair is none."""
    seen = np.count_nonzero(alpha > 1 - OPAQUE)
    faint = seen - np.count_nonzero(alpha >= OPAQUE)
    if not seen:
        raise InputError(f"{path}: transparent everywhere; save it without transparency")
    if faint > MOST_FAINT * seen:
        raise InputError(
            f"{path}: {faint / seen:.0%} of what it shows is half-transparent; lay it over a plain "
            "background and save it without transparency"
        )


def _from_profile(color, profile, notes):
    """Convert by an ICC profile to sRGB [H, W, 3] float32; None where there is nothing to convert."""
    if profile is None:
        return None
    pixels = color if color.dtype == np.uint8 else (color >> 8).astype(np.uint8)
    grey = pixels.shape[2] == 1
    try:
        source = ImageCms.ImageCmsProfile(io.BytesIO(profile))
        name = " ".join(ImageCms.getProfileDescription(source).split())
        if "sRGB" in name or (grey and source.profile.xcolor_space.strip() != "GRAY"):
            return None
        picture = Image.fromarray(pixels[:, :, 0] if grey else np.ascontiguousarray(pixels))
        converted = _convert(picture, source)
    except (ImageCms.PyCMSError, OSError, ValueError, TypeError):
        notes.append("a colour profile that cannot be read; taken as sRGB")
        return None
    # The description may be anybody's own words: "Anna's monitor".
    known = [f"'{each}' " for each in PROFILES if each in name]
    notes.append(f"colour profile {''.join(known[:1])}converted to sRGB")
    return converted


def _from_cmyk(path, data, header, notes):
    """A CMYK picture by its profile, or by plain subtraction without one: [H, W, 3] float32."""
    picture = Image.open(io.BytesIO(data))
    try:
        picture.load()
    except (OSError, SyntaxError, ValueError):
        raise _damaged(path) from None
    if header.profile is not None:
        try:
            converted = _convert(picture, ImageCms.ImageCmsProfile(io.BytesIO(header.profile)))
            notes.append("CMYK converted to sRGB by its profile")
            return converted
        except (ImageCms.PyCMSError, OSError, ValueError, TypeError):
            notes.append("a colour profile that cannot be read")
    notes.append("CMYK without a profile converted to sRGB by plain subtraction")
    return np.asarray(picture.convert("RGB"), np.float32) / 255


def _convert(picture, source):
    converted = ImageCms.profileToProfile(
        picture,
        source,
        ImageCms.createProfile("sRGB"),
        renderingIntent=ImageCms.Intent.RELATIVE_COLORIMETRIC,
        outputMode="RGB",
        flags=ImageCms.Flags.BLACKPOINTCOMPENSATION,
    )
    return np.asarray(converted, np.float32) / 255


def _upright(picture, orientation):
    """Undo the EXIF orientation 2..8 of [H, W, C]."""
    if orientation in (5, 6, 7, 8):
        picture = picture.transpose(1, 0, 2)
    if orientation in (2, 3, 6, 7):
        picture = picture[:, ::-1]
    if orientation in (3, 4, 7, 8):
        picture = picture[::-1]
    return picture
