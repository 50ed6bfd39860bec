"""What a picture file says about itself, read before any pixel is decoded."""

import io
import struct
import warnings
from dataclasses import dataclass

from PIL import ExifTags, Image, TiffImagePlugin

from bakery.errors import InputError
from bakery.formats import heif
from bakery.formats.files import read_bytes

MEGAPIXELS = 64  # at most
SMALLEST = 96  # pixels a side; a face needs as many
SCANS = 64  # of a progressive JPEG; usual encoders make 10, an attack makes hundreds
FORMATS = {  # Pillow's name -> OpenImageIO's
    "JPEG": "jpeg",
    "MPO": "jpeg",
    "PNG": "png",
    "TIFF": "tiff",
    "WEBP": "webp",
    "BMP": "bmp",
    "GIF": "gif",
    "JPEG2000": "jpeg2000",
    "PPM": "pnm",
    "AVIF": "avif",  # these two by formats.heif
    "HEIF": "heif",
}
OPENED = [name for name in FORMATS if name != "MPO"]  # Pillow makes MPO out of JPEG by itself
READABLE = "JPEG, PNG, TIFF, WebP, HEIC, AVIF, BMP, GIF or JPEG 2000"
SAMPLES = {  # Pillow's mode -> what cannot be read as a photo
    "F": "floating-point samples",
    "I": "32 bits a sample",
    "LAB": "L*a*b* colours",
    "HSV": "HSV colours",
}
EXIF_IN_PNG = (b"eXIf", b"Raw profile type exif", b"XML:com.adobe.xmp")  # one is there if EXIF is
MOST_PAGES = 100  # of a TIFF that are counted
SIGNATURES = (  # first bytes -> what it is, for the message
    (b"%PDF", "a PDF document"),
    (b"PK\x03\x04", "a ZIP archive or office document"),
    (b"\x1f\x8b", "a gzip archive"),
    (b"\x76\x2f\x31\x01", "an OpenEXR image"),
    (b"#?RADIANCE", "a Radiance HDR image"),
    (b"8BPS", "a Photoshop document"),
    (b"glTF", "a 3D model"),
    (b"<svg", "an SVG drawing"),
    (b"<?xml", "an XML document"),
    (b"<!DOCTYPE", "a web page"),
    (b"<html", "a web page"),
    (b"\x1aE\xdf\xa3", "a video"),
    (b"fLaC", "a sound file"),
    (b"ID3", "a sound file"),
    (b"\x7fELF", "a program"),
)


@dataclass(frozen=True)
class Header:
    """The header of a picture."""

    format: str  # OpenImageIO's name
    width: int  # pixels, as stored
    height: int  # pixels, as stored
    mode: str  # Pillow's name of the sample layout
    orientation: int  # EXIF 1..8
    profile: bytes | None  # ICC
    focal_35mm: float | None  # mm
    several: str  # what a file of several pictures is, such as "a file of 3 pages"; "" for one


def read_header(name, data, smallest=SMALLEST):
    """Read and judge the header of a picture.

    Args:
        name: how messages call the file.
        data: its bytes.
        smallest: pixels a side, at least.

    Raises:
        InputError: not a photo, a format that cannot be read, too large or too small, or a JPEG with
            more scans than any camera writes.
    """
    _refuse_other_formats(name, data)
    if data.startswith(b"\xff\xd8") and (scans := count_scans(data)) > SCANS:
        raise InputError(
            f"{name}: a JPEG with {scans} scans; at most {SCANS} are decoded; save it again as usual"
        )
    if _is_cut(data):
        raise InputError(
            f"{name}: a truncated picture, its end is missing; copy or download it again"
        )
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            known = [name for name in OPENED if name != "HEIF" or name in Image.OPEN]  # an extra
            picture = Image.open(io.BytesIO(data), formats=known)
            exif = _exif(picture, data)
            several = _several(picture)
            raw = picture.format == "TIFF" and _is_raw(picture)
    except Image.DecompressionBombError:
        raise InputError(
            f"{name}: claims far more than {MEGAPIXELS} megapixels; make it smaller"
        ) from None
    except Exception:  # Pillow's parsers raise almost anything on damaged files
        if samples := _tiff_samples(data):
            raise InputError(f"{name}: a TIFF with {samples}; save it as 8 or 16 bit RGB") from None
        raise InputError(
            f"{name}: not a picture that can be read, or damaged; give a {READABLE} file"
        ) from None
    width, height = picture.size
    if width * height > MEGAPIXELS * 10**6:
        raise InputError(
            f"{name}: {width}x{height} pixels; at most {MEGAPIXELS} megapixels are read; make it smaller"
        )
    if min(width, height) < smallest:
        raise InputError(
            f"{name}: {width}x{height} pixels; at least {smallest} a side are needed; give a larger photo"
        )
    if raw:
        raise InputError(f"{name}: a raw camera file; develop it to JPEG or TIFF first")
    if picture.mode in SAMPLES:
        raise InputError(
            f"{name}: a {picture.format} with {SAMPLES[picture.mode]}; save it as 8 or 16 bit RGB"
        )
    return Header(
        format=FORMATS[picture.format],
        width=width,
        height=height,
        mode=picture.mode,
        orientation=_orientation(exif),
        profile=picture.info.get("icc_profile") or None,
        focal_35mm=_focal(exif, width, height),
        several=several,
    )


def check_file(path, frame=None):
    """Refuse a file that its header alone rules out, before anything slow is loaded.

    Raises:
        InputError: see `read_header`; or of several pictures, and none is asked for.
    """
    check_frame(path, read_header(path, read_bytes(path)), frame)


def check_frame(path, header, frame):
    """Refuse a file of several pictures unless one is asked for."""
    if header.several and frame is None:
        raise InputError(
            f"{path}: {header.several}; --frame takes the first picture, --frame 1 the second"
        )


def count_scans(data):
    """How many scans a JPEG has, found by its markers alone."""
    return _walk(data)[0]


def _walk(data):
    """The scans of a JPEG, and whether its end was reached; what follows the end is not looked at."""
    scans, at = 0, 2
    while (at := data.find(b"\xff", at)) >= 0 and at + 2 <= len(data):
        marker = data[at + 1]
        if marker in (0x00, 0xFF) or 0xD0 <= marker <= 0xD8 or marker == 0x01:
            at += 1 if marker == 0xFF else 2  # stuffing, fill bytes, restart: no length follows
        elif marker == 0xD9:
            return scans, True
        else:
            scans += marker == 0xDA
            if at + 4 > len(data):
                break
            at += 2 + struct.unpack(">H", data[at + 2 : at + 4])[0]
    return scans, False


def _is_cut(data):
    """Whether the mark at the end of a JPEG, PNG or WebP is missing."""
    if data.startswith(b"\xff\xd8\xff"):
        return not _walk(data)[1]
    if data.startswith(b"\x89PNG"):
        return b"IEND" not in data[8:]
    if data.startswith(b"RIFF") and data[8:12] == b"WEBP":
        return len(data) + 1 < 8 + struct.unpack("<I", data[4:8])[0]
    return False


def _refuse_other_formats(name, data):
    if data[4:8] == b"ftyp":
        if which := heif.kind(data):
            heif.make_ready(name, which)
            return
        raise InputError(f"{name}: a video; give a {READABLE} photo")
    start = data[:64].lstrip(b"\xef\xbb\xbf \t\r\n")
    for signature, what in SIGNATURES:
        if start.lower().startswith(signature.lower()):
            raise InputError(f"{name}: {what}; give a {READABLE} photo")


def _exif(picture, data):
    """EXIF tags by number: the main directory and, in it, the camera's."""
    if picture.format == "PNG" and not any(mark in data for mark in EXIF_IN_PNG):
        return {}  # Pillow would decode all pixels to look behind them
    try:
        exif = picture.getexif()
        return dict(exif) | dict(exif.get_ifd(ExifTags.IFD.Exif))
    except Exception:  # damaged EXIF must not stop a good picture
        return {}


def _orientation(exif):
    value = exif.get(ExifTags.Base.Orientation, 1)
    return value if isinstance(value, int) and 1 <= value <= 8 else 1


def _several(picture):
    """What a file of several pictures is, or "". Pillow would count to the end of a file of any length."""
    if picture.format == "MPO" or not getattr(picture, "is_animated", False):
        return ""
    if picture.format != "TIFF":
        return "an animated picture"
    count = 1
    try:
        while count < MOST_PAGES:
            picture.seek(count)
            count += 1
    except Exception:  # the end, or a damaged page
        pass
    picture.seek(0)
    return f"a file of {count} pages" if count < MOST_PAGES else f"a file of {count} pages or more"


def _tiff_samples(data):
    """What the samples of a TIFF are that Pillow cannot open, or ""."""
    if data[:4] not in (b"II*\0", b"MM\0*"):
        return ""
    try:
        directory = TiffImagePlugin.ImageFileDirectory_v2(data[:8])
        stream = io.BytesIO(data)
        stream.seek(directory.next)
        directory.load(stream)
        if 3 in directory.get(TiffImagePlugin.SAMPLEFORMAT, ()):
            return SAMPLES["F"]
        bits = max(directory.get(TiffImagePlugin.BITSPERSAMPLE, (1,)))
        return f"{bits} bits a sample" if bits > 16 else ""
    except Exception:
        return ""


def _is_raw(picture):
    tags = picture.tag_v2
    return ExifTags.Base.DNGVersion in tags or tags.get(ExifTags.Base.NewSubfileType) == 1


def _focal(exif, width, height):
    """Focal length in 35 mm equivalents, or None where it is missing or cannot be believed."""

    def number(tag):
        try:
            value = float(exif[tag])
        except (KeyError, TypeError, ValueError, ZeroDivisionError):
            return None
        return value if 0 < value < 1e6 else None

    wide, high = number(ExifTags.Base.ExifImageWidth), number(ExifTags.Base.ExifImageHeight)
    if wide and high:
        taken, have = max(wide, high) / min(wide, high), max(width, height) / min(width, height)
        if abs(taken / have - 1) > 0.02:
            return None  # cropped since: the focal length belongs to another frame
    focal = number(ExifTags.Base.FocalLengthIn35mmFilm)
    if focal is None:
        length = number(ExifTags.Base.FocalLength)
        density = number(ExifTags.Base.FocalPlaneXResolution)
        unit = {2: 25.4, 3: 10.0, 4: 1.0}.get(exif.get(ExifTags.Base.FocalPlaneResolutionUnit, 2))
        if length and density and unit:
            focal = length * 36 / ((wide or width) / density * unit)
    return focal if focal and 8 <= focal <= 1000 else None
