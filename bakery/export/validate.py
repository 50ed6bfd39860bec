"""What is wrong with a bundle: a list of findings, nothing opened before it is known to be safe."""

import json
import os
import stat
import struct
from pathlib import Path

from bakery.errors import BakeryError
from bakery.export import bundle, hostile
from bakery.export.web import files as web
from bakery.formats import exr, record
from bakery.formats.image_header import read_header
from bakery.formats.place import MANIFEST, is_litter
from bakery.types import EXPRESSIONS

MOST = 50  # findings that are listed
NEEDED = (
    "head.glb",
    "face.exr",
    "masks.exr",
    "coverage.exr",
    "hair.exr",
    "gaze.exr",
    "mouth.exr",
    "preview.png",
)


def problems(folder):
    """Everything that is wrong with a bundle.

    Hashes come first; only files that are what was written are looked into, headers before pixels.

    Args:
        folder: the bundle.

    Returns:
        list of one-line findings, empty for a good bundle.
    """
    folder = Path(folder)
    if not folder.is_dir():
        return [f"{folder}: not a folder"]
    path = folder / MANIFEST
    try:
        if not stat.S_ISREG(os.lstat(path).st_mode):
            return [f"{MANIFEST}: not a plain file"]
        manifest = record.parse(MANIFEST, bundle.read_bytes(path, record.LARGEST_JSON))
    except (OSError, BakeryError) as error:
        return [f"{MANIFEST}: {getattr(error, 'strerror', None) or error}"]
    found = _schema_problems(manifest) + [
        f"{MANIFEST}: {finding}" for finding in hostile.table_problems(manifest)
    ]
    if found:
        return found[:MOST]
    found, good = _file_problems(folder, manifest)
    found += _meaning_problems(manifest)
    for name in good:
        found += _content_problems(folder / name, name, manifest)
    return found[:MOST]


def _schema_problems(manifest):
    import jsonschema

    checker = jsonschema.Draft202012Validator(bundle.schema())
    return [f"{MANIFEST}: {bundle.schema_problem(e)}" for e in checker.iter_errors(manifest)]


def _file_problems(folder, manifest):
    """Findings about the files, and the names of those that are as they were written."""
    found, good, listed = [], [], set()
    for entry in manifest["files"]:
        name = entry["path"]
        if name in listed:
            found.append(f"{name}: listed twice")
            continue
        listed.add(name)
        trouble = hostile.file_problem(folder, entry) or hostile.header_problem(folder, name)
        if trouble:
            found.append(f"{name}: {trouble}")
        else:
            good.append(name)
    found += [f"{name}: missing from the list of files" for name in NEEDED if name not in listed]
    for here, folders, files in os.walk(folder):
        for name in sorted(folders + files):
            path = Path(here) / name
            relative = path.relative_to(folder).as_posix()
            if path.is_symlink():
                found.append(f"{relative!r}: a link; bundles hold plain files only")
            elif name in folders or is_litter(name):
                continue
            elif relative not in listed and relative != MANIFEST:
                found.append(f"{relative!r}: not in the list of files")
    return found, good


def _meaning_problems(manifest):
    found = []
    if tuple(manifest["expressions"]) != EXPRESSIONS:
        found.append("expressions: not the 52 ARKit names in order")
    if set(manifest["channels"]) != set(EXPRESSIONS):
        found.append("channels: not the 52 ARKit names")
    if set(manifest["masks"]["channels"]) != set(EXPRESSIONS):
        found.append("masks: not one channel for each of the 52 expressions")
    gaze, mouths = manifest["gaze"], manifest["mouths"]
    if len(gaze["parts"]) != len(gaze["directions"]):
        found.append("gaze: parts and directions differ in number")
    if not len(mouths["parts"]) == len(mouths["landmarks"]) == len(mouths["weights"]):
        found.append("mouths: parts, landmarks and weights differ in number")
    if len({len(row) for row in mouths["landmarks"]}) > 1:
        found.append("mouths: landmarks differ in number")
    for name, (left, top, width, height) in manifest["uv"].items():
        if left + width > 1.000001 or top + height > 1.000001 or width <= 0 or height <= 0:
            found.append(f"uv/{name}: reaches out of the atlas")
    try:
        record.fit_from_table("fit", manifest["fit"])
    except BakeryError as error:
        found.append(str(error))
    return found


def _content_problems(path, name, manifest):
    try:
        if name.endswith(".exr"):
            return _exr_problems(path, name, manifest)
        if name.endswith(".glb"):
            return _glb_problems(path, name, manifest)
        if name == web.DESCRIPTION:
            return _web_problems(path, name, manifest)
        if name.endswith((".png", ".webp", ".jpg")):
            header = read_header(name, bundle.read_bytes(path), smallest=1)
            if header.focal_35mm or header.orientation != 1:
                return [f"{name}: carries EXIF"]
    except BakeryError as error:
        return [str(error).replace(str(path), name)]
    return []


def _exr_problems(path, name, manifest):
    headers = {part.name: part for part in exr.read_header(path)}
    wanted, channels, color = {
        "face.exr": (["neutral", *(key["part"] for key in manifest["keys"])], "BGR", exr.LINEAR),
        "hair.exr": ([manifest["hair"]["part"]], "ABGR", exr.LINEAR),
        "gaze.exr": (manifest["gaze"]["parts"], "BGR", exr.LINEAR),
        "mouth.exr": (manifest["mouths"]["parts"], "BGR", exr.LINEAR),
        "masks.exr": (
            sorted({place["part"] for place in manifest["masks"]["channels"].values()}),
            "ABGR",
            exr.DATA,
        ),
        "coverage.exr": (
            [manifest["coverage"]["source"], manifest["coverage"]["facing"]],
            "Y",
            exr.DATA,
        ),
    }.get(name, ([], "", ""))
    found = [f"{name}: lacks part '{part}'" for part in wanted if part not in headers]
    found += [f"{name}: unknown part '{part}'" for part in headers if part not in wanted]
    sizes = set()
    for part in headers.values():
        sizes.add((part.width, part.height))
        if sorted(part.channels) != sorted(channels):
            found.append(f"{name}: part '{part.name}' has channels {', '.join(part.channels)}")
        if part.color != color:
            found.append(f"{name}: part '{part.name}' is not marked as {color}")
        if part.compression != "ZIP_COMPRESSION":
            found.append(f"{name}: part '{part.name}' is not packed by ZIP")
    if len(sizes) > 1:
        found.append(f"{name}: its parts differ in size")
    return found


def _web_problems(path, name, manifest):
    """The description for browsers: its own schema, and only files of the bundle."""
    import jsonschema

    table = record.parse(name, bundle.read_bytes(path, record.LARGEST_JSON))
    checker = jsonschema.Draft202012Validator(bundle.schema(web.SCHEMA))
    found = [f"{name}: {bundle.schema_problem(e)}" for e in checker.iter_errors(table)]
    if found:
        return found
    listed = {entry["path"] for entry in manifest["files"]}
    for atlas in table["atlases"].values():
        if f"{web.FOLDER}/{atlas['file']}" not in listed:
            found.append(f"{name}: names {atlas['file']}, which is not in the list of files")
    return found


def _glb_problems(path, name, manifest):
    with open(path, "rb") as file:
        start = file.read(20)
        if len(start) < 20 or start[:4] != b"glTF":
            return [f"{name}: not binary glTF"]
        version, length, chunk = struct.unpack("<III", start[4:16])
        if version != 2 or length != path.stat().st_size or chunk > length - 20:
            return [f"{name}: damaged"]
        text = file.read(chunk)
    try:
        document = json.loads(text)
        meshes = {mesh["name"]: mesh["extras"]["targetNames"] for mesh in document["meshes"]}
    except (ValueError, KeyError, TypeError, RecursionError):
        return [f"{name}: its description is damaged"]
    wanted = ["head"] if name == web.HEAD else [lod["node"] for lod in manifest["lods"]]
    found = [f"{name}: lacks {node}" for node in wanted if node not in meshes]
    if any(tuple(names) != EXPRESSIONS for names in meshes.values()):
        found.append(f"{name}: its morph targets are not the 52 ARKit names in order")
    return found
