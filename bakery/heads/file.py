"""Head models on disk: one .npz each, found by name or by path.

name, licence, source           text
mean                            [V, 3] float32 mm
faces, uv_faces                 [F, 3] int32
uv                              [U, 2] float32
face_part, part_names           [F] uint8 into the names of the file
follow                          [V] uint8 into bakery.heads.base.FOLLOW
identity                        [I, V, 3] float16 mm
expression_names                [E], the 52 ARKit names
expression_start, _vertex, _value   sparse: shape k moves the vertices `vertex[start[k]:start[k+1]]`
                                by `value[same]`; [E + 1] int32, [N] int32, [N, 3] float16 mm
landmark_faces, landmark_barycentric   [478] int32, [478, 3] float32
rectangle_names, rectangles     [R], [R, 4] float32
"""

import os
import sys
import zipfile
from functools import cache
from pathlib import Path

import numpy as np

from bakery import plugins
from bakery.errors import InputError, ModelError, no_such
from bakery.formats import npz
from bakery.formats.files import read_bytes, replacing
from bakery.heads.base import FOLLOW, PARTS, HeadModel
from bakery.paths import ASSETS
from bakery.types import EXPRESSIONS, LANDMARKS

BUILT_IN = ASSETS / "heads"
DEFAULT = "makehuman"
# Bytes of identity modes that are stored as they are: inflating the built-in head's took 28 of 65 ms.
PLAIN = 6_000_000
MOST_VERTICES = 500_000  # unpacked, the 52 expressions have 624 bytes a vertex
TEXT = "name licence source part_names expression_names rectangle_names".split()
WHOLE = (
    "faces uv_faces face_part follow expression_start expression_vertex landmark_faces"
).split()
ARRAYS = (
    "name licence source mean faces uv uv_faces face_part part_names follow identity "
    "expression_names expression_start expression_vertex expression_value landmark_faces "
    "landmark_barycentric rectangle_names rectangles"
).split()


def user_folder():
    """Where imported head models are kept: BAKERY_HEADS, or this platform's data folder."""
    if os.environ.get("BAKERY_HEADS"):
        return Path(os.environ["BAKERY_HEADS"])
    if sys.platform == "win32":
        base = Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local")
    elif sys.platform == "darwin":
        base = Path.home() / "Library" / "Application Support"
    else:
        base = Path(os.environ.get("XDG_DATA_HOME") or Path.home() / ".local" / "share")
    return base / "bakery" / "heads"


def list_heads():
    """Known head models by name, as paths; a built-in one wins over a user's of the same name."""
    found = {}
    for folder in (user_folder(), BUILT_IN):
        if folder.is_dir():
            found.update({path.stem: path for path in sorted(folder.glob("*.npz"))})
    return found


def find_head(name_or_path):
    """The file of a head model.

    Raises:
        UsageProblem: neither a known name nor a file.
    """
    known = list_heads()
    if str(name_or_path) in known:
        return known[str(name_or_path)]
    path = Path(name_or_path)
    if path.is_file():
        return path
    names = sorted({*known, *plugins.known("heads")})
    raise no_such("no head model", name_or_path, names, "or give the path of a .npz")


def load_head(name_or_path: str | Path = DEFAULT) -> HeadModel:
    """Read a head model and check it.

    Args:
        name_or_path: a built-in name, the name of an imported one or of a plug-in, or a path.

    Raises:
        UsageProblem: no such head model.
        ModelError: the file is damaged or not a head model.

    Returns:
        the HeadModel; of a built-in one always the same, so nobody may change its arrays.
    """
    if str(name_or_path) in plugins.known("heads") and str(name_or_path) not in list_heads():
        made = plugins.plug_in("heads", str(name_or_path))
        if isinstance(made, HeadModel):
            return made
        name_or_path = made
    path = find_head(name_or_path)
    return _built_in(path) if path.parent == BUILT_IN else _read(path)


@cache
def _built_in(path):
    """One head for all portraits of a process: what is made of it once is kept with it (`memo`)."""
    return _read(path)


def _read(path):
    try:
        arrays = npz.unpack_arrays(read_bytes(path))
    except (npz.NpzError, InputError) as error:
        reason = str(error).removeprefix(f"{path}: ")
        raise ModelError(f"{path}: not a readable head model ({reason}); import it again") from None
    try:
        return _from_arrays(arrays)
    except ValueError as error:
        raise ModelError(f"{path}: {error}; build or import it again") from error


def _from_arrays(arrays):
    missing = [key for key in ARRAYS if key not in arrays]
    if missing:
        raise ValueError(f"lacks {', '.join(missing)}")
    for key in ARRAYS:
        kinds, wanted = ("iu", "whole numbers") if key in WHOLE else ("f", "numbers with a point")
        if key in TEXT:
            kinds, wanted = "U", "text"
        if arrays[key].dtype.kind not in kinds:
            raise ValueError(f"{key} holds {arrays[key].dtype}, needs {wanted}")
        single = key in ("name", "licence", "source")
        if (arrays[key].ndim == 0) != single or (key in TEXT and arrays[key].ndim > 1):
            wanted = "one text" if single else "a list"
            raise ValueError(f"{key} has shape {list(arrays[key].shape)}, needs {wanted}")
    names = [str(name) for name in arrays["part_names"]]
    unknown = sorted(set(names) - set(PARTS))
    if unknown:
        raise ValueError(f"unknown part {unknown[0][:60]!r}, known are {', '.join(PARTS)}")
    if [str(name) for name in arrays["expression_names"]] != list(EXPRESSIONS):
        raise ValueError(
            f"has {len(arrays['expression_names'])} expressions, needs the {len(EXPRESSIONS)} "
            "ARKit names in order"
        )
    mean, uv = arrays["mean"], arrays["uv"]
    V, F, U = len(mean), len(arrays["faces"]), len(uv)
    if V > MOST_VERTICES:
        raise ValueError(f"has {V} vertices, at most {MOST_VERTICES} are read")
    shapes = {
        "mean": (V, 3),
        "faces": (F, 3),
        "uv": (U, 2),
        "uv_faces": (F, 3),
        "face_part": (F,),
        "follow": (V,),
        "identity": (len(arrays["identity"]), V, 3),
        "expression_start": (len(EXPRESSIONS) + 1,),
        "expression_value": (len(arrays["expression_vertex"]), 3),
        "landmark_faces": (LANDMARKS,),
        "landmark_barycentric": (LANDMARKS, 3),
        "rectangles": (len(arrays["rectangle_names"]), 4),
    }
    for key, shape in shapes.items():
        if arrays[key].shape != shape:
            raise ValueError(f"{key} has shape {list(arrays[key].shape)}, needs {list(shape)}")
    for key in ("mean", "uv", "identity", "expression_value", "landmark_barycentric", "rectangles"):
        if not np.isfinite(arrays[key]).all():
            raise ValueError(f"{key} has values that are not finite")
    for key, end in {
        "faces": V,
        "uv_faces": U,
        "face_part": len(names),
        "follow": len(FOLLOW),
        "expression_vertex": V,
        "landmark_faces": F,
    }.items():
        if arrays[key].size and not 0 <= arrays[key].min() <= arrays[key].max() < end:
            raise ValueError(f"{key} points outside 0..{end - 1}")
    if uv.min() < 0 or uv.max() > 1:
        raise ValueError(f"uv reaches from {uv.min():.3g} to {uv.max():.3g}, needs 0..1")
    off = np.abs(arrays["landmark_barycentric"].sum(1) - 1).max()
    if off > 1e-4:
        raise ValueError(f"landmark_barycentric does not sum to 1 (off by {off:.3g})")
    start = arrays["expression_start"]
    if start[0] != 0 or (np.diff(start) < 0).any() or start[-1] != len(arrays["expression_vertex"]):
        raise ValueError("expression_start does not rise from 0 to the length of expression_vertex")
    if not (arrays["follow"] == FOLLOW.index("eye_left")).any() or "skin" not in names:
        raise ValueError("has no skin or no eyeballs")

    expression = np.zeros((len(EXPRESSIONS), V, 3), np.float32)
    for k in range(len(EXPRESSIONS)):
        part = slice(start[k], start[k + 1])
        expression[k, arrays["expression_vertex"][part]] = arrays["expression_value"][part]
    table = np.array([PARTS.index(name) for name in names], np.uint8)
    return HeadModel(
        name=str(arrays["name"]),
        licence=str(arrays["licence"]),
        source=str(arrays["source"]),
        mean=mean.astype(np.float32, copy=False),
        faces=arrays["faces"].astype(np.int32, copy=False),
        uv=uv.astype(np.float32, copy=False),
        uv_faces=arrays["uv_faces"].astype(np.int32, copy=False),
        face_part=table[arrays["face_part"]],
        follow=arrays["follow"].astype(np.uint8, copy=False),
        identity_basis=arrays["identity"].astype(np.float32),
        expression_basis=expression,
        landmark_faces=arrays["landmark_faces"].astype(np.int32, copy=False),
        landmark_barycentric=arrays["landmark_barycentric"].astype(np.float32, copy=False),
        uv_rectangles={
            str(name): [float(x) for x in box]
            for name, box in zip(arrays["rectangle_names"], arrays["rectangles"])
        },
    )


def save_head(path: str | Path, head: HeadModel, threshold: float = 2e-3) -> None:
    """Write a head model; the same head gives the same bytes.

    Args:
        path: where to; the folder is made, an older file is replaced in one step.
        head: HeadModel.
        threshold: mm; expression displacements shorter than this are left out.
    """
    start, vertex, value = [0], [], []
    for shape in head.expression_basis:
        moved = np.flatnonzero(np.abs(shape).max(1) > threshold)
        vertex.append(moved)
        value.append(shape[moved])
        start.append(start[-1] + len(moved))
    arrays = {
        "name": np.array(head.name),
        "licence": np.array(head.licence),
        "source": np.array(head.source),
        "mean": head.mean.astype(np.float32),
        "faces": head.faces.astype(np.int32),
        "uv": head.uv.astype(np.float32),
        "uv_faces": head.uv_faces.astype(np.int32),
        "face_part": head.face_part.astype(np.uint8),
        "part_names": np.array(PARTS),
        "follow": head.follow.astype(np.uint8),
        # Steps of 4 micrometres: as good as exact, and half the file.
        "identity": (np.round(head.identity_basis * 256) / 256 + 0.0).astype(np.float16),
        "expression_names": np.array(EXPRESSIONS),
        "expression_start": np.array(start, np.int32),
        "expression_vertex": np.concatenate(vertex).astype(np.int32),
        "expression_value": np.concatenate(value).astype(np.float16) + np.float16(0),  # no -0.0
        "landmark_faces": head.landmark_faces.astype(np.int32),
        "landmark_barycentric": head.landmark_barycentric.astype(np.float32),
        "rectangle_names": np.array(list(head.uv_rectangles) or [""], dtype="U32")[
            : len(head.uv_rectangles)
        ],
        "rectangles": np.array(list(head.uv_rectangles.values()), np.float32).reshape(-1, 4),
    }
    _from_arrays(arrays)
    save_arrays(path, arrays, plain="identity" if arrays["identity"].nbytes <= PLAIN else None)


def save_arrays(path, arrays, plain=None):
    """Write arrays as .npz; the same arrays give the same bytes, and a torn file is never seen.

    Args:
        plain: name of an array that is not compressed.
    """
    with (
        replacing(path) as file,
        zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive,
    ):
        for key, array in arrays.items():
            stamp = zipfile.ZipInfo(f"{key}.npy", (1980, 1, 1, 0, 0, 0))  # np.savez writes now
            stamp.compress_type = zipfile.ZIP_STORED if key == plain else zipfile.ZIP_DEFLATED
            with archive.open(stamp, "w") as stream:
                np.lib.format.write_array(stream, np.asarray(array), allow_pickle=False)
