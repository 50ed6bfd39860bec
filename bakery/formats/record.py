"""The records between the stages as files: JSON for what people and programs read, npz for arrays."""

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from bakery.check import check_array
from bakery.errors import InputError
from bakery.formats import npz
from bakery.formats.files import digest, read_bytes, write_bytes
from bakery.formats.npz import pack_arrays
from bakery.types import (
    EXPRESSIONS,
    LANDMARKS,
    Camera,
    Fit,
    HairMesh,
    Landmarks,
    Maker,
    Photo,
    Textures,
)

FARTHEST = 1e7  # pixels and mm; numbers of a camera beyond that overflow where they are multiplied
REACH = 10  # picture sizes; a point farther from the corner than that belongs to no face in it
LARGEST_JSON = 64 * 2**20  # bytes
HAIR_MESH = "hair_mesh"  # before the names of its arrays in a file of textures
LARGEST_ARRAYS = 8 * 2**30  # bytes; a 4096-texel texture file has 1 GiB


def numbers(array: ArrayLike, digits: int | None = None) -> Any:
    """An array as nested lists of floats: shortest text that reads back the same, or rounded."""
    array = np.asarray(array)
    if digits is not None:
        return np.round(array.astype(np.float64), digits).tolist()
    if array.dtype in (np.float16, np.float32):
        return np.array([float(str(x)) for x in array.ravel()]).reshape(array.shape).tolist()
    return array.tolist()


def dump(table: Mapping[str, object]) -> bytes:
    """JSON bytes: one line for each entry of the outer table, so that it can be read and compared."""
    lines = (
        f"{json.dumps(key)}: {json.dumps(value, ensure_ascii=False, allow_nan=False)}"
        for key, value in table.items()
    )
    return ("{\n  " + ",\n  ".join(lines) + "\n}\n").encode()


def parse(name: object, data: bytes) -> dict[str, Any]:
    """A JSON table from bytes.

    Raises:
        InputError: not JSON, or not a table.
    """
    try:
        if len(data) > LARGEST_JSON:
            raise ValueError(f"{len(data)} bytes")
        table = json.loads(data.decode("utf-8"), parse_constant=_refuse_constant)
    except (ValueError, RecursionError):
        raise InputError(
            f"{name}: not valid JSON; write it again with the command it came from"
        ) from None
    if not isinstance(table, dict):
        raise InputError(f"{name}: JSON without a table on the outside; write it again")
    return table


def _refuse_constant(text):
    raise ValueError(text)


def faces_to_table(
    width: int, height: int, faces: Sequence[Landmarks], chosen: int | None = None
) -> dict[str, object]:
    """What `bakery detect` writes of a photo.

    Args:
        width, height: pixels of the upright photo.
        faces: Landmarks of each face, at least one, all of one detector, the largest first.
        chosen: the one that is meant, from 1; None leaves that to who reads the file.
    """
    return {
        "image": {"width": int(width), "height": int(height)},
        "detector": asdict(faces[0].maker),
        "faces": [
            {
                "box": numbers(face.box, 3),
                "score": round(float(face.score), 5),
                "points": numbers(face.points, 3),
                "confidence": numbers(face.confidence, 4),
            }
            for face in faces
        ],
    } | ({} if chosen is None else {"face": chosen})


def faces_from_table(
    name: object, table: Mapping[str, Any]
) -> tuple[tuple[int, int], list[Landmarks]]:
    """Image size (width, height) and the Landmarks of each face.

    Raises:
        InputError: something is missing, has a wrong shape, or cannot be a face of such a picture.
    """
    with _reading(name, "bakery detect"):
        size = (_size(table["image"]["width"]), _size(table["image"]["height"]))
        maker = _maker(table.get("detector", {"name": "given"}))
        faces = [
            Landmarks(
                box=np.array(face["box"], np.float64),
                score=float(face["score"]),
                points=np.array(face["points"], np.float64)[:, :2],
                confidence=np.array(face.get("confidence", [1.0] * LANDMARKS), np.float64),
                maker=maker,
            )
            for face in table["faces"]
        ]
        for face in faces:
            _check_face(face, size)
        return size, faces


def _maker(table: Mapping[str, object]) -> Maker:
    """The Maker of a table of texts; what it does not know of is left out."""
    known = {
        field.name: str(table[field.name])[:200] for field in fields(Maker) if field.name in table
    }
    return Maker(**known)


def rounded_face(photo: Photo, face: Landmarks) -> Landmarks:
    """Landmarks as a file of them reads back: what follows is the same with and without the file."""
    height, width = photo.encoded.shape[:2]
    return faces_from_table("landmarks", faces_to_table(width, height, [face]))[1][0]


def _check_face(face, size):
    """Raise ValueError for points or a box that lie nowhere near the picture or span nothing."""
    places = np.concatenate([face.points, face.box[None, :2], face.box[None, 2:]])
    far = places[np.abs(places).max(1) > REACH * max(size)]
    if len(far):
        raise ValueError(
            f"a point at ({far[0, 0]:.4g}, {far[0, 1]:.4g}), in a picture of {size[0]}x{size[1]}"
        )
    if np.ptp(face.points, axis=0).min() < 1:
        raise ValueError("the points of a face lie in one place or line")
    if face.box[2:].min() <= 0:
        raise ValueError("the box of a face has no area")


def camera_to_table(camera: Camera) -> dict[str, object]:
    """A Camera as a table."""
    return {
        "focal": float(camera.focal),
        "center": numbers(camera.center),
        "rotation": numbers(camera.rotation),
        "translation": numbers(camera.translation),
        "width": int(camera.width),
        "height": int(camera.height),
    }


def fit_to_table(fit: Fit, photo: Photo | None = None) -> dict[str, object]:
    """What `bakery fit` writes.

    Args:
        fit: Fit.
        photo: Photo it belongs to; its hash and notes go along.
    """
    table = {
        "head": fit.head,
        "head_sha256": fit.head_sha256,
        "camera": camera_to_table(fit.camera),
        "identity": numbers(fit.identity),
        "expression": dict(zip(EXPRESSIONS, numbers(fit.expression))),
        "gaze": numbers(fit.gaze),
        "light": numbers(fit.light),
        "albedo": numbers(fit.albedo),
        "residual": numbers(fit.residual),
        "landmarks_projected": numbers(fit.landmarks_projected, 4),
        "seconds": round(float(fit.seconds), 4),
        "focal_source": fit.focal_source,
        "diagnostics": fit.diagnostics,
    }
    if fit.resting.any():
        table["resting"] = {n: w for n, w in zip(EXPRESSIONS, numbers(fit.resting)) if w}
    for name in ("rest", "outline", "teeth"):
        if getattr(fit, name).any():
            table[name] = numbers(getattr(fit, name))
    if photo is not None:
        table["photo"] = {"sha256": photo.sha256, "notes": list(photo.notes)}
    return table


# What `lids` were the weights of, which tables of before 28 November 2026 have for `resting`.
OLD_LIDS = (
    "eyeBlinkLeft eyeBlinkRight eyeSquintLeft eyeSquintRight eyeLookDownLeft eyeLookDownRight"
)


def fit_from_table(name: object, table: Mapping[str, Any]) -> Fit:
    """The Fit of a table that `bakery fit` wrote.

    Raises:
        InputError: something is missing or has a wrong shape.
    """
    with _reading(name, "bakery fit"):
        camera, expression = table["camera"], dict(table["expression"])
        resting = dict(table.get("resting", zip(OLD_LIDS.split(), table.get("lids", ()))))
        unknown = sorted({*expression, *resting} - set(EXPRESSIONS))
        if unknown:
            raise ValueError(f"unknown expression {', '.join(unknown)}")
        return Fit(
            head=str(table["head"]),
            camera=_camera(camera),
            identity=np.array(table["identity"], np.float64),
            expression=np.array([expression.get(name, 0.0) for name in EXPRESSIONS], np.float64),
            gaze=np.array(table["gaze"], np.float64),
            light=np.array(table["light"], np.float64),
            albedo=np.array(table.get("albedo", []), np.float64),
            residual=np.array(table.get("residual", np.zeros((468, 3))), np.float64),
            landmarks_projected=np.array(table["landmarks_projected"], np.float64),
            seconds=float(table.get("seconds", 0)),
            focal_source=str(table.get("focal_source", "default")),
            diagnostics=dict(table.get("diagnostics", {})),
            head_sha256=str(table.get("head_sha256", "")),
            rest=np.array(table.get("rest", np.zeros((468, 3))), np.float64),
            resting=np.array([resting.get(name, 0.0) for name in EXPRESSIONS], np.float64),
            outline=np.array(table.get("outline", []), np.float64),
            teeth=np.array(table.get("teeth", np.zeros(3)), np.float64),
        )


def _camera(table):
    camera = Camera(
        focal=_positive(table["focal"]),
        center=np.array(table["center"], np.float64),
        rotation=np.array(table["rotation"], np.float64),
        translation=np.array(table["translation"], np.float64),
        width=_size(table["width"]),
        height=_size(table["height"]),
    )
    farthest = max(camera.focal, np.abs([*camera.center, *camera.translation]).max())
    if farthest > FARTHEST:
        raise ValueError(f"a camera with the number {farthest:.4g}, at most {FARTHEST:g} are read")
    return camera


def _positive(value):
    value = float(value)
    if not (math.isfinite(value) and value > 0):
        raise ValueError(f"focal length {value}")
    return value


def _size(value):
    if not 1 <= int(value) <= 65536:
        raise ValueError(f"{value} pixels")
    return int(value)


WRONG = (KeyError, ValueError, TypeError, IndexError, AttributeError, OverflowError)


class _reading:
    """Turns what a wrong table raises into one line."""

    def __init__(self, name: object, command: str) -> None:
        self.name, self.command = name, command

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: object
    ) -> None:
        if kind is None or not issubclass(kind, WRONG):
            return
        reason = " ".join(str(error).split())[:120]
        if issubclass(kind, KeyError):
            reason = f"lacks {error}"
        elif not issubclass(kind, ValueError):
            reason = "a table of another layout"
        raise InputError(f"{self.name}: {reason}; write it again with `{self.command}`") from None


def read_faces(path: str | Path) -> tuple[tuple[int, int], list[Landmarks]]:
    """`faces_from_table` of a file."""
    return faces_from_table(path, parse(path, read_bytes(path, LARGEST_JSON)))


def read_choice(path: str | Path) -> int | None:
    """The face that is meant by a file that `bakery detect --face N` wrote, from 1; None if none is.

    Raises:
        InputError: it is no such number.
    """
    table = parse(path, read_bytes(path, LARGEST_JSON))
    with _reading(path, "bakery detect"):
        chosen = table.get("face")
        if chosen is not None and not (type(chosen) is int and 1 <= chosen <= len(table["faces"])):
            raise ValueError(f"face {str(chosen)[:20]!r} of {len(table['faces'])}")
        return chosen


def read_fit(path: str | Path) -> Fit:
    """`fit_from_table` of a file."""
    return fit_from_table(path, parse(path, read_bytes(path, LARGEST_JSON)))


def unpack_arrays(name: object, data: bytes) -> dict[str, np.ndarray]:
    """Named arrays from npz bytes.

    Raises:
        InputError: damaged, or not an npz; see `npz.unpack_arrays`.
    """
    try:
        # What is stored as it is may be as large as the file; what is packed is small as a rule.
        return npz.unpack_arrays(data, max(len(data), npz.LARGEST))
    except npz.NpzError as error:
        raise InputError(f"{name}: {error}; make it again") from None


def write_arrays(path: str | Path, arrays: Mapping[str, np.ndarray]) -> str:
    """Write `pack_arrays` to a file; returns its SHA-256."""
    data = pack_arrays(arrays)
    write_bytes(path, data)
    return digest(data)


def read_arrays(path: str | Path, needed: Iterable[str] = ()) -> dict[str, np.ndarray]:
    """Read what `write_arrays` wrote.

    Raises:
        InputError: damaged, or one of `needed` is missing.
    """
    arrays = unpack_arrays(path, read_bytes(path, LARGEST_ARRAYS))
    missing = [name for name in needed if name not in arrays]
    if missing:
        raise InputError(f"{path}: lacks {', '.join(missing)}; make it again")
    return arrays


TEXTURES = [field.name for field in fields(Textures) if field.name != HAIR_MESH]


def textures_to_arrays(textures: Textures) -> dict[str, np.ndarray]:
    """Textures as named arrays; who made them as JSON text."""
    table = {name: getattr(textures, name) for name in TEXTURES}
    table["maker"] = json.dumps(asdict(textures.maker))
    if textures.hair_mesh is not None:
        for field in fields(HairMesh):
            table[f"{HAIR_MESH}_{field.name}"] = getattr(textures.hair_mesh, field.name)
    return {name: np.array(value) for name, value in table.items()}


def textures_from_arrays(arrays: Mapping[str, np.ndarray]) -> Textures:
    """Textures of what `textures_to_arrays` made.

    Raises:
        ValueError: shapes that do not go together.
    """
    found = {name: arrays[name] for name in TEXTURES}
    check_array("key_names", found["key_names"], (None,))
    return Textures(
        **found
        | {
            "key_names": tuple(str(name) for name in found["key_names"]),
            "maker": _maker(parse("maker", str(found["maker"]).encode())),
            "made_from": str(found["made_from"]),
            "hair_mesh": _hair_mesh(arrays),
        }
    )


def _hair_mesh(arrays: Mapping[str, np.ndarray]) -> HairMesh | None:
    names = [field.name for field in fields(HairMesh)]
    if not any(f"{HAIR_MESH}_{name}" in arrays for name in names):
        return None
    try:
        return HairMesh(**{name: arrays[f"{HAIR_MESH}_{name}"] for name in names})
    except KeyError as error:
        raise ValueError(f"lacks {error.args[0]}") from None


def read_textures(path: str | Path) -> Textures:
    """Textures that `bakery texture` wrote.

    Raises:
        InputError: damaged, or something else.
    """
    with _reading(path, "bakery texture"):
        return textures_from_arrays(read_arrays(path, TEXTURES))
