"""What is wrong with a bundle: a list of findings, nothing opened before it is known to be safe."""

import os
from dataclasses import dataclass
from pathlib import Path

from bakery.errors import BakeryError
from bakery.export import bundle, hair_mesh, hostile, schema
from bakery.export.layout import RIG, is_opened
from bakery.export.validate_glb import glb_problems
from bakery.export.web import files as web
from bakery.formats import exr, jumbf, record
from bakery.formats.files import digest_file
from bakery.formats.image_header import read_header
from bakery.formats.place import MANIFEST, SIGNATURE, is_litter
from bakery.heads.base import PROXIES
from bakery.heads.file import load_head
from bakery.types import EXPRESSIONS

MOST = 50  # findings that are listed
LONGEST = 300  # characters of one; names in a damaged file may be of any length
NEEDED = (
    RIG,
    "face.exr",
    "masks.exr",
    "coverage.exr",
    "hair.exr",
    "gaze.exr",
    "mouth.exr",
)
CLOSE = 1e-4  # chromaticities


@dataclass(frozen=True)
class Report:
    """What was found in a bundle; each finding is one line."""

    problems: list[str]  # none in a good bundle
    notes: list[str]  # what this version does not know, in a bundle of a newer minor version

    def __post_init__(self):
        for lines in (self.problems, self.notes):
            lines[:] = [
                line if len(line) <= LONGEST else line[:LONGEST] + " ..." for line in lines[:MOST]
            ]


def problems(folder: str | os.PathLike) -> list[str]:
    """The problems of `examine`."""
    return examine(folder).problems


def examine(folder: str | os.PathLike) -> Report:
    """Everything that is wrong with a bundle.

    The manifest comes first, by its digest of itself, then hashes; only files that are what was
    written are looked into, headers before pixels.

    Args:
        folder: the bundle.
    """
    folder = Path(folder)
    path = folder / MANIFEST
    if not folder.is_dir():
        return Report([f"{folder}: not a folder"], [])
    if path.is_symlink():
        return Report([f"{MANIFEST}: a link; bundles hold plain files only"], [])
    try:
        manifest, found, notes = bundle.check_manifest(folder)
    except BakeryError as error:
        return Report([_relative(error, folder)], [])
    notes = [_relative(note, folder) for note in notes]
    if found:
        return Report([_relative(line, folder) for line in found], notes)
    found, good = file_problems(folder, manifest)
    found += _meaning_problems(manifest)
    for name in good:
        more, newer = _content_problems(folder / name, name, manifest)
        found += more
        notes += newer
    if not found:
        found = _head_problems(folder / RIG, manifest) + _hair_problems(folder, manifest)
    return Report(found, notes)


def _relative(line, folder):
    return str(line).replace(f"{folder}{os.sep}", "")


def file_problems(folder: Path, manifest: dict) -> tuple[list[str], list[str]]:
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
    needed = [*NEEDED, *(["head.glb"] if manifest["lods"] else [])]
    needed += [atlas["file"] for atlas in manifest.get("web", {}).values()]
    needed += ["albedo.exr"] if "albedo" in manifest else []
    needed += [hair_mesh.MESH, hair_mesh.ATLAS] if "hair_mesh" in manifest else []
    needed += [manifest["photo"]] if "photo" in manifest else []
    found += [f"{name}: missing from the list of files" for name in needed if name not in listed]
    for here, folders, files in os.walk(folder):
        for name in sorted(folders + files):
            path = Path(here) / name
            relative = path.relative_to(folder).as_posix()
            if path.is_symlink():
                found.append(f"{relative!r}: a link; bundles hold plain files only")
            elif name in folders or is_litter(name):
                continue
            elif relative not in listed and relative not in (MANIFEST, SIGNATURE):
                found.append(f"{relative!r}: not in the list of files")
    return found + _signature_problems(folder), good


def _signature_problems(folder):
    """Whether avatar.c2pa is about this manifest; `bakery verify` checks that it holds."""
    place = folder / SIGNATURE
    if place.is_symlink() or not place.is_file():
        return []
    stated = jumbf.signed_digest(bundle.read_bytes(place, jumbf.LARGEST))
    if stated == digest_file(folder / MANIFEST):
        return []
    return [f"{SIGNATURE}: signs another manifest; sign the bundle again with `bakery sign`"]


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
    count, sheets = len(mouths["landmarks"]), len(mouths["parts"])
    size = mouths.get("columns", 1) * mouths.get("rows", 1)
    if len(mouths["weights"]) != count or not size * (sheets - 1) < count <= size * sheets:
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
    """Problems and notes about what is in a file."""
    minor = schema.read_version(MANIFEST, manifest)
    try:
        if not is_opened(name):
            return [], []
        if name.endswith(".exr"):
            return _exr_problems(path, name, manifest)
        if name == "head.glb":
            nodes = [lod["node"] for lod in manifest["lods"]]
            still = [lod["hair"]["node"] for lod in manifest["lods"] if "hair" in lod]
            return glb_problems(name, bundle.read_bytes(path), nodes, minor, still), []
        if name.endswith(".glb"):
            played = name.startswith(f"{web.FOLDER}/")
            still = ["hair"] if played and "hair_mesh" in manifest else []
            meshes = ["head"] if played else PROXIES
            return glb_problems(name, bundle.read_bytes(path), meshes, minor, still), []
        if name == web.DESCRIPTION:
            return _web_problems(path, name, manifest)
        if name.endswith((".png", ".webp", ".jpg")):
            header = read_header(name, bundle.read_bytes(path), smallest=1)
            if header.focal_35mm or header.orientation != 1:
                return [f"{name}: carries EXIF"], []
    except BakeryError as error:
        return [str(error).replace(str(path), name)], []
    return [], []


def _head_problems(path, manifest):
    """The person as a head model: it opens, and lies on the atlas that the manifest tells of.

    It is opened whole, so this comes last, in a bundle with nothing else wrong.
    """
    try:
        head = load_head(path)
    except BakeryError as error:
        return [str(error).replace(str(path), path.name)]
    if set(head.uv_rectangles) != set(manifest["uv"]):
        return [f"{path.name}: its rectangles are not those of the manifest's uv"]
    return []


def _hair_problems(folder, manifest):
    """Hair with volume: arrays of the right kinds that go together; opened last, as the head is."""
    if "hair_mesh" not in manifest:
        return []
    try:
        mesh = bundle.read_hair(folder, manifest)
    except (KeyError, ValueError) as error:
        return [f"{hair_mesh.MESH}: {error}"]
    stated = {name: manifest["hair_mesh"][name] for name in ("cards", "triangles")}
    found = {name: hair_mesh.table(mesh)[name] for name in stated}
    return [] if found == stated else [f"{hair_mesh.MESH}: holds {found}, stated are {stated}"]


def _exr_layout(manifest):
    """File -> what its parts must be: their names, channels and colorInteropID."""
    masks = manifest["masks"]["channels"].values()
    coverage = manifest["coverage"]
    bare = [manifest["albedo"]["part"]] if "albedo" in manifest else []
    return {
        "albedo.exr": (bare, "RGB", exr.LINEAR),
        "face.exr": (["neutral", *(key["part"] for key in manifest["keys"])], "RGB", exr.LINEAR),
        "hair.exr": ([manifest["hair"]["part"]], "RGBA", exr.LINEAR),
        "gaze.exr": (manifest["gaze"]["parts"], "RGB", exr.LINEAR),
        "mouth.exr": (manifest["mouths"]["parts"], "RGB", exr.LINEAR),
        "masks.exr": (
            sorted({place["part"] for place in masks}),
            "Y" if all(place["channel"] == "Y" for place in masks) else "RGBA",
            exr.DATA,
        ),
        "coverage.exr": ([coverage["source"], coverage["facing"]], "Y", exr.DATA),
    }


def _parts_wanted(name, manifest):
    """Part -> its channels and colorInteropID."""
    if name == hair_mesh.ATLAS:
        return hair_mesh.PARTS if "hair_mesh" in manifest else {}
    names, channels, color = _exr_layout(manifest)[name]
    return dict.fromkeys(names, (channels, color))


def _exr_problems(path, name, manifest):
    minor = schema.read_version(MANIFEST, manifest)
    headers = {part.name: part for part in exr.read_header(path)}
    wanted = _parts_wanted(name, manifest)
    found = [f"{name}: lacks part '{part}'" for part in wanted if part not in headers]
    unknown = [f"{name}: unknown part '{part}'" for part in headers if part not in wanted]
    if minor >= 1 and name == "masks.exr" and any(kind != "Y" for kind, _ in wanted.values()):
        found.append(f"{name}: has not one part with the channel Y for each expression")
    known = [headers[part] for part in wanted if part in headers]
    for part in known:
        channels, color = wanted[part.name]
        if part.channels != channels:
            found.append(f"{name}: part '{part.name}' has channels {part.channels}")
        if part.color != color:
            found.append(f"{name}: part '{part.name}' is not marked as {color}")
        if minor >= 1 and not _has_chromaticities(part, color):
            which = "those of Rec.709" if color == exr.LINEAR else "none, for it is data"
            found.append(f"{name}: part '{part.name}' has other chromaticities; it needs {which}")
    if len({(part.width, part.height) for part in known}) > 1:
        found.append(f"{name}: its parts differ in size")
    if name == "mouth.exr" and known:
        columns, rows = (manifest["mouths"].get(key, 1) for key in ("columns", "rows"))
        if known[0].width % columns or known[0].height % rows:
            found.append(f"{name}: does not divide into {columns} x {rows} mouths")
    newer = minor > schema.MINOR
    return (found, unknown) if newer else (found + unknown, [])


def _has_chromaticities(part, color):
    wanted = exr.REC709 if color == exr.LINEAR else ()
    return len(part.chromaticities) == len(wanted) and all(
        abs(have - want) < CLOSE for have, want in zip(part.chromaticities, wanted)
    )


def _web_problems(path, name, manifest):
    """The description for browsers: its own schema, and only files of the bundle."""
    table = record.parse(name, bundle.read_bytes(path, record.LARGEST_JSON))
    found, notes = schema.findings(name, table, schema.WEB)
    if not found:
        listed = {entry["path"] for entry in manifest["files"]}
        named = [f"{web.FOLDER}/{atlas['file']}" for atlas in table["atlases"].values()]
        for path in [web.head_path(table), *named]:
            if path not in listed:
                found.append(f"{name}: names {path}, which is not in the list of files")
    return found, notes
