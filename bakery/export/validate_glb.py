"""What is wrong with a GLB file of a bundle, beyond its hash. Khronos' validator says far more."""

import json
import struct
from collections.abc import Iterable

from bakery.formats.glb import JSON
from bakery.types import EXPRESSIONS

DAMAGE = (
    AttributeError, IndexError, KeyError, OverflowError, RecursionError, TypeError, ValueError,
)  # fmt: skip


def glb_problems(
    name: str, data: bytes, meshes: Iterable[str], minor: int, still: Iterable[str] = ()
) -> list[str]:
    """Findings about a GLB file.

    Args:
        name: how findings call it.
        data: the file.
        meshes: names of those that it must hold.
        minor: version of the bundle. Since 1 there is one scene, and every accessor has a view or
            is sparse: programs refuse others, though glTF takes them for zeros.
        still: names of those that it must hold too, without morph targets.
    """
    if len(data) < 28 or data[:4] != b"glTF":
        return [f"{name}: not binary glTF"]
    version, length, chunk, kind = struct.unpack_from("<4I", data, 4)
    if version != 2 or length != len(data) or kind != JSON or chunk > length - 28:
        return [f"{name}: damaged"]
    (binary,) = struct.unpack_from("<I", data, 20 + chunk)
    if 28 + chunk + binary > length:
        return [f"{name}: damaged"]
    try:
        found = _document_problems(
            json.loads(data[20 : 20 + chunk]), binary, meshes, minor, tuple(still)
        )
    except DAMAGE:
        found = ["its description is damaged"]
    return [f"{name}: {line}" for line in found]


def _document_problems(document, binary, meshes, minor, still):
    """See `glb_problems`; raises one of DAMAGE where the description is not one at all."""
    views, accessors = document["bufferViews"], document["accessors"]
    for number, view in enumerate(views):
        packed = view.get("extensions", {}).get("EXT_meshopt_compression", view)
        if _index(packed["buffer"], document["buffers"]) == 0:
            start, size = packed.get("byteOffset", 0), packed["byteLength"]
            if start < 0 or size < 1 or start + size > binary:
                return [f"buffer view {number} reaches out of the file"]
    for number, accessor in enumerate(accessors):
        if "bufferView" in accessor:
            _index(accessor["bufferView"], views)
        elif "sparse" not in accessor and minor >= 1:
            return [f"accessor {number} has no buffer view, which many programs refuse"]
    named = {mesh["name"]: mesh for mesh in document["meshes"]}
    found = [f"lacks {mesh}" for mesh in [*meshes, *still] if mesh not in named]
    if len(document["scenes"]) != 1 and minor >= 1:
        found.append(f"has {len(document['scenes'])} scenes; programs that draw all need one")
    for name, mesh in named.items():
        if name in still:
            if any("targets" in primitive for primitive in mesh["primitives"]):
                found.append(f"mesh {name[:40]}: has morph targets; hair keeps its shape")
            continue
        names = mesh["extras"]["targetNames"]
        if tuple(names[: len(EXPRESSIONS)]) != EXPRESSIONS:
            found.append(f"mesh {name[:40]}: its morph targets are not the 52 ARKit names in order")
            continue
        for primitive in mesh["primitives"]:
            targets = [target["POSITION"] for target in primitive["targets"]]
            points = _index(primitive["attributes"]["POSITION"], accessors)
            counts = {accessors[_index(target, accessors)]["count"] for target in targets}
            if len(targets) != len(names) or counts != {accessors[points]["count"]}:
                found.append(
                    f"mesh {name[:40]}: its morph targets are not {len(names)} of its vertices"
                )
    return found


def _index(value, items):
    """`value` as an index into `items`; ValueError if it is none."""
    if type(value) is not int or not 0 <= value < len(items):
        raise ValueError(f"index {value}")
    return value
