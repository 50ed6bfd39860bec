"""The bundle folder: what stands in which file, written and read."""

import os
from pathlib import Path

import cv2
import numpy as np

from bakery.errors import BundleError
from bakery.export import hair_mesh, hostile, schema
from bakery.export.layout import PICTURES, ROLES, WEB, gaze_parts, mouth_grid, mouth_parts
from bakery.formats import exr, record
from bakery.formats.exr_header import parse_header
from bakery.formats.files import digest, digest_file, read_bytes, write_bytes
from bakery.formats.mark import type_name
from bakery.formats.place import MANIFEST, SIGNATURE
from bakery.types import EXPRESSIONS, Textures


def write_textures(folder, textures, masks):
    """Write the EXR files of a bundle, and the mesh of hair that has volume.

    Args:
        textures: Textures.
        masks: [E, m, m] float32 0..1.
    """
    folder = Path(folder)
    faces = {"neutral": textures.neutral} | dict(zip(textures.key_names, textures.keys))
    exr.write_exr(folder / "face.exr", faces)
    exr.write_exr(folder / "hair.exr", {"hair": textures.hair})
    exr.write_exr(folder / "gaze.exr", dict(zip(gaze_parts(len(textures.gaze)), textures.gaze)))
    exr.write_exr(folder / "mouth.exr", _mouth_sheets(textures.mouths))
    if len(textures.albedo):
        exr.write_exr(folder / "albedo.exr", {"albedo": textures.albedo})
    if textures.hair_mesh is not None:
        colors = {name: color for name, (_, color) in hair_mesh.PARTS.items()}
        exr.write_exr(folder / hair_mesh.ATLAS, hair_mesh.pictures(textures.hair_mesh), colors)
        record.write_arrays(folder / hair_mesh.MESH, hair_mesh.arrays(textures.hair_mesh))
    coverage = {"source": textures.source, "facing": textures.facing}
    exr.write_exr(folder / "coverage.exr", coverage, exr.DATA)
    exr.write_exr(folder / "masks.exr", dict(zip(EXPRESSIONS, masks)), exr.DATA)


def _mouth_sheets(mouths):
    """Contact sheets [rows * h, columns * w, 3] of mouths [M, h, w, 3], by the names of their parts.

    One part a mouth made 900 channels of 300 mouths, of 1,023 that a Nuke script can have.
    """
    columns, rows = mouth_grid(len(mouths))
    height, width = mouths.shape[1:3]
    sheets = {}
    for number, name in enumerate(mouth_parts(len(mouths))):
        sheets[name] = np.zeros((rows * height, columns * width, 3), np.float16)
        cells = _cells(sheets[name], columns, rows)
        for cell, mouth in enumerate(mouths[number * columns * rows :][: columns * rows]):
            cells[divmod(cell, columns)] = mouth
    return sheets


def _cells(sheet, columns, rows):
    """A contact sheet as [rows, columns, h, w, 3], without a copy."""
    height, width = sheet.shape[0] // rows, sheet.shape[1] // columns
    return sheet.reshape(rows, height, columns, width, 3).swapaxes(1, 2)


def sparse(weights):
    """Weights [E] as a table without the zeros."""
    return {
        EXPRESSIONS[index]: float(str(np.float32(weights[index])))
        for index in np.flatnonzero(weights)
    }


def list_files(folder: str | os.PathLike) -> list[dict]:
    """The files of a bundle but for its manifest and signature, as the manifest lists them."""
    folder = Path(folder)
    return [
        {
            "path": name,
            "role": ROLES.get(name, "web" if name.startswith(f"{WEB}/") else "other"),
            "bytes": path.stat().st_size,
            "sha256": digest_file(path),
        }
        for path in sorted(folder.rglob("*"))
        if path.is_file()
        and (name := path.relative_to(folder).as_posix()) not in (MANIFEST, SIGNATURE)
    ]


def write_manifest(folder: str | os.PathLike, manifest: dict) -> None:
    """Write avatar.json, with its digest of itself."""
    write_bytes(Path(folder) / MANIFEST, schema.seal(manifest))


def check_manifest(folder: str | os.PathLike) -> tuple[dict, list[str], list[str]]:
    """The manifest, and what is wrong with it.

    Returns:
        the manifest; problems; notes about what a newer version may have added.

    Raises:
        BundleError: not a bundle, or one of a version that is not read.
        InputError: the manifest is no file, or not JSON.
    """
    path = Path(folder) / MANIFEST
    if not os.path.lexists(path):
        lacks = f"it has no {MANIFEST}" if os.path.lexists(folder) else "there is nothing"
        raise BundleError(
            f"{folder}: no bundle ({lacks}); give the folder that `bakery build` made"
        )
    data = read_bytes(path, record.LARGEST_JSON)
    manifest = record.parse(path, data)
    if trouble := schema.seal_problem(data, manifest):
        return manifest, [f"{path}: {trouble}"], []
    problems, notes = schema.findings(path, manifest)
    unsafe = [f"{path}: {finding}" for finding in hostile.table_problems(manifest)]
    return manifest, unsafe + problems, notes


def read_manifest(folder: str | os.PathLike) -> dict:
    """The manifest, checked against its schema.

    Raises:
        BundleError: not a bundle, its manifest breaks the schema or says what no manifest may.
    """
    manifest, problems, _ = check_manifest(folder)
    if problems:
        raise BundleError(f"{problems[0]}; make the bundle again")
    return manifest


def read_file(folder, manifest, path):
    """The bytes of a file of the bundle, if they are those that were written.

    Raises:
        BundleError: not listed, a link, missing or changed.
    """
    listed = {entry["path"]: entry for entry in manifest["files"]}
    if path not in listed:
        raise BundleError(f"{folder}: lacks {path}; make the bundle again")
    place = Path(folder) / path
    if place.is_symlink():
        raise BundleError(f"{place}: is a link; bundles hold plain files only")
    data = read_bytes(place, largest=listed[path]["bytes"])
    if digest(data) != listed[path]["sha256"]:
        raise BundleError(f"{place}: is not the file that was written; make the bundle again")
    return data


def read_textures(folder, manifest):
    """Textures and masks [E, m, m] of a bundle.

    Raises:
        BundleError: damaged.
    """
    names = [*PICTURES, *(["albedo"] if "albedo" in manifest else [])]
    parts = {name: dict(_parts(folder, manifest, f"{name}.exr")) for name in names}
    face, gaze, masks, coverage = (parts[name] for name in ("face", "gaze", "masks", "coverage"))
    try:
        textures = Textures(
            neutral=face["neutral"],
            keys=np.stack([face[key["part"]] for key in manifest["keys"]]),
            key_names=tuple(key["name"] for key in manifest["keys"]),
            key_weights=np.stack([dense(key["weights"]) for key in manifest["keys"]]),
            source=coverage[manifest["coverage"]["source"]].astype(np.uint8),
            facing=coverage[manifest["coverage"]["facing"]],
            hair=parts["hair"][manifest["hair"]["part"]],
            gaze=np.stack([gaze[part] for part in manifest["gaze"]["parts"]]),
            gaze_directions=np.array(manifest["gaze"]["directions"], np.float64),
            mouths=_read_mouths(folder, manifest),
            mouth_landmarks=np.array(manifest["mouths"]["landmarks"], np.float64),
            mouth_weights=np.stack([dense(table) for table in manifest["mouths"]["weights"]]),
            **(
                {"albedo": parts["albedo"][manifest["albedo"]["part"]]} if "albedo" in parts else {}
            ),
            hair_mesh=read_hair(folder, manifest) if "hair_mesh" in manifest else None,
        )
        places = [manifest["masks"]["channels"][name] for name in EXPRESSIONS]
        planes = [_channel(masks[place["part"]], place["channel"]) for place in places]
        return textures, np.stack(planes).astype(np.float32)
    except (KeyError, ValueError, IndexError) as error:
        raise BundleError(f"{folder}: its textures do not fit its manifest ({error})") from None


def read_hair(folder, manifest):
    """The HairMesh of a bundle.

    Raises:
        BundleError: damaged.
        KeyError, ValueError: its arrays do not go together.
    """
    parts = dict(_parts(folder, manifest, hair_mesh.ATLAS))
    return hair_mesh.assembled(read_file(folder, manifest, hair_mesh.MESH), parts)


def _channel(picture, name):
    """One channel of a part: Y, or one of RGBA as before version 1.1."""
    if name == "Y" and picture.ndim == 2:
        return picture
    return picture[..., "RGBA".index(name)]


def _read_mouths(folder, manifest):
    """The mouths [M, h, w, 3] float16, sheet after sheet: all sheets at once would be as much again."""
    table = manifest["mouths"]
    columns, rows = table.get("columns", 1), table.get("rows", 1)
    count, size = len(table["landmarks"]), columns * rows
    sheets = {name: number for number, name in enumerate(table["parts"])}
    if not size * (len(sheets) - 1) < count <= size * len(sheets):
        raise ValueError(f"{count} mouths in {len(sheets)} parts of {size}")
    mouths = None
    for name, sheet in _parts(folder, manifest, "mouth.exr"):
        first = size * sheets.pop(name)
        cells = _cells(sheet, columns, rows)
        if mouths is None:
            mouths = np.empty((count, *cells.shape[2:]), np.float16)
        for cell, mouth in enumerate(mouths[first : first + size]):
            mouth[:] = cells[divmod(cell, columns)]
    if sheets:
        raise ValueError(f"no part {', '.join(sheets)}")
    return mouths


def read_photo(folder, manifest):
    """The portrait [H, W, 3] float32 sRGB-encoded that a bundle keeps."""
    data = np.frombuffer(read_file(folder, manifest, manifest["photo"]), np.uint8)
    picture = cv2.imdecode(data, cv2.IMREAD_COLOR)
    if picture is None:
        raise BundleError(f"{folder}: its photo is damaged; make the bundle again")
    return picture[..., ::-1].astype(np.float32) / 255


def dense(table):
    """Weights [E] float32 of a table without the zeros."""
    return np.array([table.get(name, 0.0) for name in EXPRESSIONS], np.float32)


def _parts(folder, manifest, path):
    return exr.read_parts(Path(folder) / path, read_file(folder, manifest, path))


def summary(folder, manifest):
    """What a person wants to know of a bundle, as a table.

    Raises:
        BundleError, InputError: face.exr is missing, no plain file, or changed.
    """
    roles = {}
    for entry in manifest["files"]:
        roles[entry["role"]] = roles.get(entry["role"], 0) + entry["bytes"]
    status = {}
    for channel in manifest["channels"].values():
        status[channel["status"]] = status.get(channel["status"], 0) + 1
    face = read_file(folder, manifest, "face.exr")
    resolution = parse_header(Path(folder) / "face.exr", face)[0][0].width
    return {
        "bundle": Path(folder).name,
        "version": manifest["asset"]["version"],
        "made by": manifest["asset"]["generator"],
        "resolution": resolution,
        "head": manifest["head"]["name"],
        "generator": manifest["provenance"]["generator"],
        "source type": type_name(manifest["provenance"]["digitalSourceType"]),
        "consent": manifest["provenance"].get("consent", {}).get("statement", "none"),
        "signature": SIGNATURE if (Path(folder) / SIGNATURE).is_file() else "none",
        "keys": [key["name"] for key in manifest["keys"]],
        "gaze": len(manifest["gaze"]["parts"]),
        "mouths": len(manifest["mouths"]["landmarks"]),
        "lods": [lod["triangles"] for lod in manifest["lods"]],
        **({"hair cards": manifest["hair_mesh"]["cards"]} if "hair_mesh" in manifest else {}),
        "channels": status,
        "coverage": manifest["coverage"]["shares"],
        "notes": manifest["provenance"]["input"]["notes"],
        "warnings": [
            f"{w['code']} {w['value']:g} (limit {w['limit']:g})" for w in manifest["warnings"]
        ],
        "bytes": roles | {"all": sum(roles.values())},
    }
