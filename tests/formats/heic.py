"""HEIC files for tests: one HEVC picture in the boxes of ISO/IEC 23008-12, with what phones add."""

import base64
import struct
from pathlib import Path

WIDTH, HEIGHT = 160, 120


def ramps():
    """The picture that both streams hold: [HEIGHT, WIDTH, 3] float 0..1, smooth colours."""
    import numpy as np

    y, x = np.mgrid[:HEIGHT, :WIDTH]
    red, green = 40 + x * 170 // (WIDTH - 1), 50 + y * 150 // (HEIGHT - 1)
    return np.stack([red, green, np.full_like(red, 90)], -1) / 255


def heic(bits=8, turns=0, profile=None, codes=(1, 13, 1), exif=None):
    """A HEIC file's bytes.

    Args:
        bits: 8 or 10 a sample.
        turns: quarter turns against the clock that a reader has to make.
        profile: ICC profile, or None.
        codes: primaries, transfer, matrix of ISO/IEC 23091-2 (1, 13, 1 is sRGB), where there is no
            profile.
        exif: EXIF data from its TIFF header on, or None.
    """
    stream = base64.b64decode((Path(__file__).parent / f"ramps-{bits}.hevc.txt").read_text())
    parameters, pictures = [], []
    for unit in stream.split(b"\0\0\1")[1:]:
        unit = unit.rstrip(b"\0")
        kind = unit[0] >> 1 & 63
        if kind in (32, 33, 34):
            parameters.append((kind, unit))
        elif kind < 32:
            pictures.append(unit)
    picture = b"".join(struct.pack(">I", len(unit)) + unit for unit in pictures)
    color = b"nclx" + struct.pack(">HHHB", *codes, 0x80) if profile is None else b"prof" + profile
    properties = [
        _box(b"hvcC", _decoder(parameters, bits)),
        _box(b"ispe", struct.pack(">III", 0, WIDTH, HEIGHT)),
        _box(b"pixi", struct.pack(">IB3B", 0, 3, bits, bits, bits)),
        _box(b"colr", color),
        *([_box(b"irot", bytes([turns]))] if turns else []),
    ]
    used = [1 | 0x80, 2, 3, 4, *([5 | 0x80] if turns else [])]
    items = [(1, b"hvc1", picture)]
    if exif is not None:
        items.append((2, b"Exif", struct.pack(">I", 0) + exif))
    entries = b"".join(
        _box(b"infe", struct.pack(">IHH", 2 << 24, number, 0) + kind + b"\0")
        for number, kind, _ in items
    )
    associated = struct.pack(">IIHB", 0, 1, 1, len(used)) + bytes(used)
    meta = [
        _box(b"hdlr", bytes(8) + b"pict" + bytes(13)),
        _box(b"pitm", struct.pack(">IH", 0, 1)),
        None,  # iloc, when it is known where the data lies
        _box(b"iinf", struct.pack(">IH", 0, len(items)) + entries),
        _box(b"iprp", _box(b"ipco", b"".join(properties)) + _box(b"ipma", associated)),
    ]
    if exif is not None:
        meta.append(_box(b"iref", bytes(4) + _box(b"cdsc", struct.pack(">HHH", 2, 1, 1))))
    start = _box(b"ftyp", b"heic" + bytes(4) + b"mif1heic")
    size = len(start) + len(_meta(meta, items, 0)) + 8
    return start + _meta(meta, items, size) + _box(b"mdat", b"".join(data for *_, data in items))


def _meta(boxes, items, at):
    where = struct.pack(">IBBH", 0, 0x44, 0, len(items))
    for number, _, data in items:
        where += struct.pack(">HHHII", number, 0, 1, at, len(data))
        at += len(data)
    located = [_box(b"iloc", where) if one is None else one for one in boxes]
    return _box(b"meta", bytes(4) + b"".join(located))


def _box(kind, data):
    return struct.pack(">I", len(data) + 8) + kind + data


def _decoder(parameters, bits):
    """HEVCDecoderConfigurationRecord of ISO/IEC 14496-15; general profile from the parameter set."""
    sequence = next(unit for kind, unit in parameters if kind == 33)
    plain = sequence.replace(b"\0\0\3", b"\0\0")
    general = plain[3:15]  # profile space, tier and profile; compatibility; constraints; level
    head = (
        b"\1"
        + general
        + struct.pack(">HBBBBHB", 0xF000, 0xFC, 0xFD, 0xF8 | bits - 8, 0xF8 | bits - 8, 0, 0x0F)
    )
    arrays = b"".join(
        struct.pack(">BHH", 0x80 | kind, 1, len(unit)) + unit for kind, unit in parameters
    )
    return head + bytes([len(parameters)]) + arrays
