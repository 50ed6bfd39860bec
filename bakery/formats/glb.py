"""Binary glTF: its description and its bytes in one file.

Source: Khronos, glTF 2.0, section "GLB file format".
"""

import json
import struct
from typing import Any

HEADER, CHUNK = 12, 8  # bytes
JSON, BINARY = 0x4E4F534A, 0x004E4942  # kinds of chunks


def joined(document: dict[str, Any], binary: bytes) -> bytes:
    """A GLB file of a description and the bytes of its first buffer."""
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    binary += bytes(-len(binary) % 4)
    size = HEADER + 2 * CHUNK + len(text) + len(binary)
    return b"".join(
        (
            struct.pack("<4sII", b"glTF", 2, size),
            struct.pack("<II", len(text), JSON),
            text,
            struct.pack("<II", len(binary), BINARY),
            binary,
        )
    )


def apart(data: bytes) -> tuple[dict[str, Any], bytes]:
    """The description and the bytes of a GLB file that is known to be whole (`validate_glb`)."""
    (length,) = struct.unpack_from("<I", data, HEADER)
    start = HEADER + CHUNK + length
    return json.loads(data[HEADER + CHUNK : start]), data[start + CHUNK :]
