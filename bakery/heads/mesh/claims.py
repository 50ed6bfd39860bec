"""What a mesh file says that it holds, held against its bytes before trimesh makes room for it.

A file of a few hundred bytes can ask for gigabytes: by a count that no bytes stand behind, by parts
that are named again and again, by lines of one character. trimesh finds out when the memory is taken.
"""

import json
import math
import struct
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from mmap import ACCESS_COPY, mmap
from pathlib import Path
from typing import Any

from bakery.errors import InputError
from bakery.formats.glb import CHUNK, HEADER, JSON

LONGEST_HEADER = 64 * 2**10  # lines of a PLY's, and bytes of one of them
LONGEST_LINE = 64 * 2**10  # bytes of a face or vertex of an OBJ
SPARE_LINES = 1000  # that an ASCII PLY may have behind what its header tells of
MOST_EMPTY = 1000  # vertices of a glTF without a buffer view: too few to be worth a word
CORNERS = 3  # vertices that a face may bring along: none of them shared
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
BYTES = {5120: 1, 5121: 1, 5122: 2, 5123: 2, 5125: 4, 5126: 4}
TRIANGLES, STRIP = 4, 5
BREAKS = (b"\n", b"\r", b"\v", b"\f", b"\x1c", b"\x1d", b"\x1e", b"\xc2\x85",
          b"\xe2\x80\xa8", b"\xe2\x80\xa9")  # fmt: skip  # where str.splitlines splits


def check_claims(path: Path, faces: int, size: int) -> None:
    """Refuse a file whose meshes would take far more memory than they have bytes.

    Args:
        path: .obj, .ply, .glb or .gltf.
        faces: the most triangles that are taken.
        size: the largest file that is read, bytes; what is decoded may not be larger.

    Raises:
        InputError: too much is claimed.
        Exception: of any kind, where the file is damaged; as trimesh does.
    """
    check = {".obj": _obj, ".ply": _ply, ".glb": _gltf, ".gltf": _gltf}[path.suffix.lower()]
    check(path, faces, size)


def _few(path: Path, count: int, most: int, what: str) -> None:
    if count > most:
        raise InputError(
            f"{path}: tells of {_told(count)} {what}, at most {most:,} are taken; decimate it first"
        )


def _told(count: int) -> str:
    """A number for a message: one of hundreds of digits is no news."""
    return f"{count:,}" if abs(count) < 10**15 else "over 10^15"


# --- OBJ ---


def _obj(path: Path, faces: int, size: int) -> None:
    """Lines, for each takes an object of Python; a face of many corners becomes many."""
    counts, kind, going = Counter[str | bytes](), b"", False
    with path.open("rb") as file:
        for line in file:
            kind = kind if going else line[:2].strip()[:1]
            goes, going = going, line.rstrip(b"\r\n").endswith(b"\\")
            if kind not in (b"f", b"v"):
                continue
            if len(line) > LONGEST_LINE:
                raise InputError(
                    f"{path}: has a line of {len(line):,} bytes, at most {LONGEST_LINE:,} are "
                    "needed for a face; export it again as triangles"
                )
            counts[kind] += not goes
            if kind == b"f":
                counts["corners"] += len(line.split()) - (not goes)
    _few(path, counts[b"f"], faces, "faces")
    _few(path, counts["corners"], 2 * CORNERS * faces, "corners of faces")
    # Places, uv points and normals, none of them shared.
    _few(path, counts[b"v"], 3 * CORNERS * faces, "lines of vertices")


# --- PLY ---


def _ply(path: Path, faces: int, size: int) -> None:
    """The elements of the header; an ASCII file has a line for each and next to no other."""
    with path.open("rb") as file:
        lines, told = [], Counter[str]()
        while "end_header" not in (line := file.readline(LONGEST_HEADER).decode().split()):
            lines.append(line)
            if not line or len(lines) > LONGEST_HEADER:
                raise ValueError("a header without an end")
            if "element" in line[0]:
                told[line[1]] += _whole(path, f"element '{line[1][:40]}' has", int(line[2]))
        start = file.tell()
        _few(path, told["face"], faces, "faces")
        for name, count in told.items():
            _few(path, count, CORNERS * faces, f"elements '{name[:40]}'")
        rest = path.stat().st_size - start
        if (total := sum(told.values())) > rest:
            raise InputError(
                f"{path}: tells of {total:,} elements in {rest:,} bytes; export it again"
            )
        if "ascii" in " ".join(lines[1]).lower():
            body = file.read()
            found = sum(body.count(mark) for mark in BREAKS)
            if found > 2 * total + SPARE_LINES:  # two: \r\n
                raise InputError(
                    f"{path}: has {found:,} lines for {total:,} elements; export it again"
                )


# --- glTF ---


def _gltf(path: Path, faces: int, size: int) -> None:
    table = _description(path)
    behind = path.stat().st_size + _beside(path, table)
    if behind > size:
        raise InputError(
            f"{path}: {behind / 2**20:.0f} MiB with the files beside it, at most "
            f"{size / 2**20:.0f} are read; decimate the mesh first"
        )
    views, accessors = table.get("bufferViews", []), table.get("accessors", [])
    _views(path, views, behind, size)
    _accessors(path, accessors, views, size)
    _meshes(path, table, accessors, faces)


def _description(path: Path) -> dict[str, Any]:
    """The JSON of a GLB or glTF."""
    with without_pictures(path) as file:
        if path.suffix.lower() == ".glb":
            magic, _, _, length, kind = struct.unpack("<4s4I", file.read(HEADER + CHUNK))
            if magic != b"glTF" or kind != JSON:
                raise ValueError("no GLB, or none that begins with its description")
            table = json.loads(file.read(length).decode())
        else:
            table = json.loads(file.read().decode())
    if not isinstance(table, dict) or "images" in table:  # its key may be spelt with escapes
        raise ValueError("a description that cannot be used")
    return table


@contextmanager
def without_pictures(path: Path) -> Iterator[mmap]:
    """The bytes of a GLB or glTF to read, in which no pictures are found.

    trimesh decodes them all, though only the uv are wanted: 169 megapixels of black come in 0.7 MB
    and took 1.4 GiB. The key gets a name of the same length, so that nothing moves, in a copy of the
    pages that it stands on.
    """
    with path.open("rb") as file, mmap(file.fileno(), 0, access=ACCESS_COPY) as data:
        end = len(data)
        if path.suffix.lower() == ".glb":
            end = HEADER + CHUNK + struct.unpack("<I", data[HEADER : HEADER + 4])[0]
        at = data.find(b'"images"', 0, end)
        while at >= 0:
            data[at : at + 8] = b'"unread"'
            at = data.find(b'"images"', at, end)
        yield data


def _beside(path: Path, table: dict[str, Any]) -> int:
    """Bytes of the files that a description names: as often as it names them, each is read anew."""
    total = 0
    for entry in table.get("buffers", []):
        uri = entry.get("uri")
        if uri is None or "base64," in uri:
            continue
        beside = path.parent / uri
        if beside.exists() and not beside.is_file():
            raise InputError(f"{path}: names '{uri[:80]}', which is no file; export it again")
        total += beside.stat().st_size if beside.exists() else 0
    return total


def _whole(path: Path, what: str, value: Any) -> int:
    """A number that must be a count."""
    if isinstance(value, bool) or not isinstance(value, int) or value < 0:
        raise InputError(f"{path}: {what} {value!r:.40}, a count is needed; export it again")
    return value


def _views(path: Path, views: list[dict[str, Any]], behind: int, size: int) -> None:
    """Each is a copy of its bytes."""
    total = 0
    for number, view in enumerate(views):
        length = _whole(path, f"buffer view {number} has the length", view["byteLength"])
        if length > behind:
            raise InputError(
                f"{path}: buffer view {number} has {_told(length)} bytes, the file {behind:,}; "
                "export it again"
            )
        total += length
    if total > size:
        raise InputError(
            f"{path}: its buffer views add up to {total / 2**20:.0f} MiB, at most "
            f"{size / 2**20:.0f} are read; export it again"
        )


def _accessors(
    path: Path, accessors: list[dict[str, Any]], views: list[dict[str, Any]], size: int
) -> None:
    """Each lies inside its view; all together are no more than a file can hold.

    The sum is for those without a view (zeros, as the shapes of a face that moves little are kept) and
    for views that many accessors share.
    """
    total = 0
    for number, entry in enumerate(accessors):
        count = _whole(path, f"accessor {number} has the count", entry["count"])
        one = WIDTHS[entry["type"]] * BYTES[entry["componentType"]]
        total += count * one
        if "bufferView" not in entry:
            continue
        view = views[_whole(path, f"accessor {number} names the view", entry["bufferView"])]
        start = _whole(path, f"accessor {number} begins at", entry.get("byteOffset", 0))
        step = max(_whole(path, "a view has the step", view.get("byteStride", one)), one)
        if count and start + (count - 1) * step + one > view["byteLength"]:
            raise InputError(
                f"{path}: accessor {number} tells of {_told(count)} entries of {one} bytes, its "
                f"buffer view has {view['byteLength']:,} bytes; export it again"
            )
    if total > size:
        # Whole MiB, without a float: a count may have hundreds of digits.
        raise InputError(
            f"{path}: its accessors add up to {_told(total >> 20)} MiB, at most {size >> 20} are "
            "read; decimate the mesh first"
        )


def _meshes(path: Path, table: dict[str, Any], accessors: list[dict[str, Any]], faces: int) -> None:
    """Triangles and vertices of all parts, each as often as the scene shows it."""
    nodes = table.get("nodes", [])
    above = Counter(child for node in nodes for child in set(node.get("children", [])))
    if len(scenes := table.get("scenes", [])):
        above.update(set(scenes[table.get("scene", 0)].get("nodes", [])))
    shown: Counter[int] = Counter()
    for number, node in enumerate(nodes):
        if "mesh" in node:
            shown[node["mesh"]] += above[number]
    triangles = vertices = 0
    for number, mesh in enumerate(table.get("meshes", [])):
        times = max(shown[number], 1)
        for part in mesh["primitives"]:
            if part.get("mode", TRIANGLES) not in (TRIANGLES, STRIP):
                continue
            points = _seen(path, number, "vertices", accessors[part["attributes"]["POSITION"]])
            corners = points
            if "indices" in part:
                corners = _seen(path, number, "corners", accessors[part["indices"]])
            triangles += times * (
                corners if part.get("mode") == STRIP else math.ceil(corners / CORNERS)
            )
            vertices += times * points
    _few(path, vertices, CORNERS * faces, "vertices")
    _few(path, triangles, faces, "triangles")


def _seen(path: Path, number: int, what: str, entry: dict[str, Any]) -> int:
    """How many vertices or corners an accessor has; without a view they would all be zero."""
    count: int = entry["count"]
    if "bufferView" not in entry and count > MOST_EMPTY:
        raise InputError(
            f"{path}: mesh {number} tells of {_told(count)} {what} without a buffer view, "
            "as a compressed one does; export it without compression"
        )
    return count
