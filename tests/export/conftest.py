"""Bundles as version 1.0 had them, and with hair that has volume, made of new ones."""

import json
import shutil
import struct
from dataclasses import replace

import numpy as np
import OpenEXR
import pytest

from bakery.export.bundle import list_files, write_manifest
from bakery.export.hair_mesh import table
from bakery.export.open import open_avatar
from bakery.exporters.exr import ExrExporter
from bakery.exporters.glb import GlbExporter
from bakery.exporters.web import WebExporter
from bakery.formats.files import digest_file
from bakery.types import EXPRESSIONS


def read_parts(path):
    """The parts of an EXR file by OpenEXR's own reader: name -> (header, pixels)."""
    parts = OpenEXR.File(str(path)).parts
    return {part.name(): (part.header, next(iter(part.channels.values())).pixels) for part in parts}


def write_parts(path, pictures, color):
    """An EXR file as 1.0 had it: without chromaticities."""
    made = []
    for name, picture in pictures.items():
        header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
        channels = {"RGBA"[: picture.shape[2]]: OpenEXR.Channel(np.ascontiguousarray(picture))}
        made.append(OpenEXR.Part(header | {"colorInteropID": color}, channels, name))
    OpenEXR.File(made).write(str(path))


def split_glb(data):
    """The description and the rest of a GLB file."""
    (length,) = struct.unpack_from("<I", data, 12)
    return json.loads(data[20 : 20 + length]), data[20 + length :]


def join_glb(document, rest):
    """A GLB file of what `split_glb` gave."""
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    head = struct.pack("<4sIIII", b"glTF", 2, 20 + len(text) + len(rest), len(text), 0x4E4F534A)
    return head + text + rest


def _old_masks(folder, manifest):
    planes = read_parts(folder / "masks.exr")
    groups, channels = {}, {}
    for first in range(0, len(EXPRESSIONS), 4):
        names = EXPRESSIONS[first : first + 4]
        part = f"masks{first // 4:02d}"
        groups[part] = np.stack([planes[name][1] for name in names], -1)
        channels |= {name: {"part": part, "channel": letter} for name, letter in zip(names, "RGBA")}
    write_parts(folder / "masks.exr", groups, "data")
    manifest["masks"]["channels"] = channels


def _old_mouths(folder, manifest):
    table = manifest["mouths"]
    columns, rows = table.pop("columns"), table.pop("rows")
    sheets = read_parts(folder / "mouth.exr")
    mouths = {}
    for index in range(len(table["landmarks"])):
        number, cell = divmod(index, columns * rows)
        sheet = sheets[table["parts"][number]][1]
        height, width = sheet.shape[0] // rows, sheet.shape[1] // columns
        row, column = divmod(cell, columns)
        mouths[f"mouth{index:03d}"] = sheet[row * height :, column * width :][:height, :width]
    write_parts(folder / "mouth.exr", mouths, "lin_rec709_scene")
    table["parts"] = list(mouths)


def _old_head(folder):
    """Shapes that move nothing had no view, and a second scene showed what are proxies now."""
    document, rest = split_glb((folder / "head.glb").read_bytes())
    owners = [accessor.get("bufferView") for accessor in document["accessors"]]
    zeros = max({view for view in owners if view is not None}, key=owners.count)
    for accessor in document["accessors"]:
        if accessor.get("bufferView") == zeros:
            del accessor["bufferView"], accessor["byteOffset"]
    document["scenes"].append({"name": "carriers", "nodes": [1]})
    (folder / "head.glb").write_bytes(join_glb(document, rest))
    (folder / "proxies.glb").unlink()


def _old_web(folder):
    table = json.loads((folder / "web" / "avatar.json").read_text())
    (folder / "web" / table.pop("geometry")).rename(folder / "web" / "head.glb")
    table["asset"]["version"] = "1.0"
    (folder / "web" / "avatar.json").write_text(json.dumps(table))


@pytest.fixture(scope="session")
def old_bundle(bundle, tmp_path_factory):
    """The bundle of the painted portrait in the layout of version 1.0; tests must not change it."""
    folder = shutil.copytree(bundle, tmp_path_factory.mktemp("old") / "old.avatar")
    manifest = json.loads((folder / "avatar.json").read_text())
    for name, color in (("face", "lin_rec709_scene"), ("gaze", "lin_rec709_scene")):
        parts = {part: pixels for part, (_, pixels) in read_parts(folder / f"{name}.exr").items()}
        write_parts(folder / f"{name}.exr", parts, color)
    _old_masks(folder, manifest)
    _old_mouths(folder, manifest)
    _old_head(folder)
    _old_web(folder)
    del manifest["sha256"]
    for added in ("models", "recipe"):
        manifest["provenance"].pop(added, None)
    manifest["fit"].pop("head_sha256", None)
    manifest.pop("albedo")
    (folder / "albedo.exr").unlink()
    manifest["asset"]["version"] = "1.0"
    files = {entry["path"]: entry for entry in manifest["files"]}
    files["web/head.glb"] = files.pop("web/player.glb") | {"path": "web/head.glb"}
    del files["proxies.glb"], files["albedo.exr"]
    for path, entry in files.items():
        entry |= {"bytes": (folder / path).stat().st_size, "sha256": digest_file(folder / path)}
    manifest["files"] = list(files.values())
    (folder / "avatar.json").write_text(json.dumps(manifest))
    return folder


@pytest.fixture
def copy(bundle, tmp_path):
    """A copy of the bundle that a test may change."""
    return shutil.copytree(bundle, tmp_path / "copy.avatar")


@pytest.fixture(scope="session")
def glb():
    """Functions (split, join) over the bytes of GLB files."""
    return split_glb, join_glb


@pytest.fixture(scope="session")
def hairy_bundle(bundle, hairdo, once):
    """The bundle of the painted portrait with a bob; tests must not change it."""

    def dress(folder):
        folder = shutil.copytree(bundle, folder / "hairy.avatar")
        avatar = open_avatar(bundle)
        mesh = hairdo(avatar.head, avatar.neutral)
        dressed = replace(avatar, textures=replace(avatar.textures, hair_mesh=mesh))
        said = {}
        for exporter in (ExrExporter(), GlbExporter(), WebExporter()):
            said |= exporter.export(dressed, folder / exporter.place, 512)
        said |= {"hair_mesh": table(mesh), "files": list_files(folder)}
        write_manifest(folder, json.loads((folder / "avatar.json").read_text()) | said)

    return once("hairy", dress) / "hairy.avatar"


@pytest.fixture(scope="session")
def hairy(hairy_bundle):
    """The bundle with a bob, opened; tests must not change it."""
    return open_avatar(hairy_bundle)
