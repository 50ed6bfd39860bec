"""The bundle folder: what stands in which file, written and read."""

import json
from functools import cache
from pathlib import Path

import cv2
import numpy as np

from bakery.errors import BundleError
from bakery.export import hostile
from bakery.formats import exr, record
from bakery.formats.files import digest, digest_file, read_bytes, write_bytes
from bakery.formats.place import MANIFEST
from bakery.paths import ASSETS
from bakery.types import EXPRESSIONS, Textures

SCHEMA = ASSETS / "schema" / "avatar-1.schema.json"
ROLES = {
    "head.glb": "geometry",
    "head.npz": "geometry",
    "face.exr": "face",
    "masks.exr": "masks",
    "hair.exr": "hair",
    "coverage.exr": "coverage",
    "gaze.exr": "gaze",
    "mouth.exr": "mouth",
    "preview.png": "preview",
    "photo.png": "photo",
}
SOURCES = {0: "none", 1: "observed", 2: "mirrored", 3: "inferred", 4: "painted"}
CONVENTIONS = {
    "units": "millimetres; metres in head.glb",
    "axes": "right-handed, +x the subject's left, +y up, +z out of the face",
    "uv": "origin top left, rows run down, texel centres at +0.5",
    "textures": "scene-linear Rec.709 half float (lin_rec709_scene); web/ is sRGB-encoded",
    "gaze": "degrees, yaw to the subject's left, pitch up",
    "weights": "0 to 1, ARKit names, left and right are the subject's",
}


@cache
def schema(path=SCHEMA):
    """A published JSON Schema; that of the manifest, unless told otherwise."""
    return json.loads(path.read_text())


def mask_channels():
    """Where the mask of each expression stands: name -> (part, channel)."""
    return {
        name: (f"masks{index // 4:02d}", "RGBA"[index % 4])
        for index, name in enumerate(EXPRESSIONS)
    }


def write_textures(folder, textures, masks):
    """Write the EXR files of a bundle.

    Args:
        textures: Textures.
        masks: [E, m, m] float32 0..1.
    """
    folder = Path(folder)
    faces = {"neutral": textures.neutral} | dict(zip(textures.key_names, textures.keys))
    exr.write_exr(folder / "face.exr", faces)
    exr.write_exr(folder / "hair.exr", {"hair": textures.hair})
    exr.write_exr(folder / "gaze.exr", dict(zip(gaze_parts(textures), textures.gaze)))
    exr.write_exr(folder / "mouth.exr", dict(zip(mouth_parts(textures), textures.mouths)))
    coverage = {"source": textures.source, "facing": textures.facing}
    exr.write_exr(folder / "coverage.exr", coverage, exr.DATA)
    groups = {
        f"masks{first // 4:02d}": np.moveaxis(np.asarray(masks[first : first + 4]), 0, -1)
        for first in range(0, len(EXPRESSIONS), 4)
    }
    exr.write_exr(folder / "masks.exr", groups, exr.DATA)


def gaze_parts(textures):
    """Names of the parts of gaze.exr."""
    return [f"gaze{index:02d}" for index in range(len(textures.gaze))]


def mouth_parts(textures):
    """Names of the parts of mouth.exr."""
    return [f"mouth{index:03d}" for index in range(len(textures.mouths))]


def describe_textures(textures, masks):
    """The manifest's tables about the textures."""
    values, counts = np.unique(textures.source, return_counts=True)
    return {
        "keys": [
            {"name": name, "part": name, "weights": sparse(weights)}
            for name, weights in zip(textures.key_names, textures.key_weights)
        ],
        "hair": {
            "file": "hair.exr",
            "part": "hair",
            "layout": "RGBA over the face texture, colour multiplied by alpha; lashes in uv/cards",
        },
        "gaze": {
            "file": "gaze.exr",
            "parts": gaze_parts(textures),
            "directions": record.numbers(textures.gaze_directions, 4),
            "layout": "the cap of the left eye on the left, that of the right eye on the right",
        },
        "mouths": {
            "file": "mouth.exr",
            "parts": mouth_parts(textures),
            "landmarks": record.numbers(textures.mouth_landmarks, 5),
            "weights": [sparse(weights) for weights in textures.mouth_weights],
        },
        "masks": {
            "file": "masks.exr",
            "resolution": int(masks.shape[1]),
            "channels": {
                name: {"part": part, "channel": channel}
                for name, (part, channel) in mask_channels().items()
            },
        },
        "coverage": {
            "file": "coverage.exr",
            "source": "source",
            "facing": "facing",
            "values": {str(value): name for value, name in SOURCES.items()},
            "shares": {
                SOURCES[int(value)]: round(float(count / textures.source.size), 4)
                for value, count in zip(values, counts)
            },
        },
    }


def sparse(weights):
    """Weights [E] as a table without the zeros."""
    return {
        EXPRESSIONS[index]: float(str(np.float32(weights[index])))
        for index in np.flatnonzero(weights)
    }


def write_manifest(folder, manifest):
    """List the files of a bundle with their hashes and write avatar.json.

    Args:
        folder: the bundle, complete but for avatar.json.
        manifest: everything but `files`.
    """
    folder = Path(folder)
    files = []
    for path in sorted(folder.rglob("*")):
        name = path.relative_to(folder).as_posix()
        if path.is_file() and name != MANIFEST:
            files.append(
                {
                    "path": name,
                    "role": ROLES.get(name, "web"),
                    "bytes": path.stat().st_size,
                    "sha256": digest_file(path),
                }
            )
    write_bytes(folder / MANIFEST, record.dump(manifest | {"files": files}))


def read_manifest(folder):
    """The manifest, checked against its schema.

    Raises:
        BundleError: not a bundle, its manifest breaks the schema or says what no manifest may.
    """
    import jsonschema

    folder = Path(folder)
    if not (folder / MANIFEST).is_file():
        raise BundleError(
            f"{folder}: no bundle (it has no {MANIFEST}); give the folder that `bakery build` made"
        )
    manifest = record.parse(folder / MANIFEST, read_bytes(folder / MANIFEST, record.LARGEST_JSON))
    errors = list(jsonschema.Draft202012Validator(schema()).iter_errors(manifest))
    if errors:
        raise BundleError(
            f"{folder / MANIFEST}: {schema_problem(errors[0])}; make the bundle again"
        )
    for finding in hostile.table_problems(manifest):
        raise BundleError(f"{folder / MANIFEST}: {finding}; do not use this bundle")
    return manifest


def schema_problem(error):
    """A schema error in one line: where, and what."""
    where = "/".join(str(step) for step in error.absolute_path) or "the manifest"
    return f"{where}: {error.message[:160]}"


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
    face = _parts(folder, manifest, "face.exr")
    gaze = _parts(folder, manifest, "gaze.exr")
    mouths = _parts(folder, manifest, "mouth.exr")
    coverage = _parts(folder, manifest, "coverage.exr")
    hair = _parts(folder, manifest, "hair.exr")
    masks = _parts(folder, manifest, "masks.exr")
    try:
        textures = Textures(
            neutral=face["neutral"],
            keys=np.stack([face[key["part"]] for key in manifest["keys"]]),
            key_names=tuple(key["name"] for key in manifest["keys"]),
            key_weights=np.stack([dense(key["weights"]) for key in manifest["keys"]]),
            source=coverage["source"].astype(np.uint8),
            facing=coverage["facing"],
            hair=hair["hair"],
            gaze=np.stack([gaze[part] for part in manifest["gaze"]["parts"]]),
            gaze_directions=np.array(manifest["gaze"]["directions"], np.float64),
            mouths=np.stack([mouths[part] for part in manifest["mouths"]["parts"]]),
            mouth_landmarks=np.array(manifest["mouths"]["landmarks"], np.float64),
            mouth_weights=np.stack([dense(table) for table in manifest["mouths"]["weights"]]),
        )
        channels = manifest["masks"]["channels"]
        planes = [
            masks[channels[name]["part"]][..., "RGBA".index(channels[name]["channel"])]
            for name in EXPRESSIONS
        ]
        return textures, np.stack(planes).astype(np.float32)
    except (KeyError, ValueError, IndexError) as error:
        raise BundleError(f"{folder}: its textures do not fit its manifest ({error})") from None


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
    return exr.parse_exr(Path(folder) / path, read_file(folder, manifest, path))


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
    read_file(
        folder, manifest, "face.exr"
    )  # it is there, a plain file, and the one that was written
    resolution = exr.read_header(Path(folder) / "face.exr")[0].width
    return {
        "bundle": Path(folder).name,
        "version": manifest["asset"]["version"],
        "made by": manifest["asset"]["generator"],
        "resolution": resolution,
        "head": manifest["head"]["name"],
        "generator": manifest["provenance"]["generator"],
        "source type": manifest["provenance"]["digitalSourceType"].rsplit("/", 1)[-1],
        "keys": [key["name"] for key in manifest["keys"]],
        "gaze": len(manifest["gaze"]["parts"]),
        "mouths": len(manifest["mouths"]["parts"]),
        "lods": [lod["triangles"] for lod in manifest["lods"]],
        "channels": status,
        "coverage": manifest["coverage"]["shares"],
        "notes": manifest["provenance"]["input"]["notes"],
        "warnings": [
            f"{w['code']} {w['value']:g} (limit {w['limit']:g})" for w in manifest["warnings"]
        ],
        "bytes": roles | {"all": sum(roles.values())},
    }
