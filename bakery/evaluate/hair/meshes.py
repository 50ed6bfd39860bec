"""Hair meshes that others made for MakeHuman's base mesh, put on heads of the built-in model.

A .mhclo file binds each vertex of an OBJ to three vertices of hm08; see the README of MakeHuman's
`makeclothes`. Meshes and base mesh stay outside of the project: both are given as files.
"""

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from bakery.errors import InputError
from bakery.evaluate.scan import read_obj
from bakery.formats.files import read_bytes
from bakery.geometry.color import to_linear
from bakery.geometry.noise import value_noise
from bakery.heads.base import HeadModel
from bakery.types import HAIR_KINDS, HairMesh

SIZE = 1024  # texels on a side of a texture, at most
STREAKS = 512  # the same of one that is made here
AXES = ("x_scale", "y_scale", "z_scale")
NEAR = 12  # vertices of the head that hair is carried by
LOWEST = -120.0  # mm, of them


@dataclass(frozen=True, eq=False)
class Hairdo:
    """Hair on the mean head."""

    name: str
    points: np.ndarray  # [P, 3] mm, in the space of heads.build.wheel.read_body
    faces: np.ndarray  # [F, 3]
    uv: np.ndarray  # [U, 2] 0..1, origin top left
    uv_faces: np.ndarray  # [F, 3]
    texture: np.ndarray  # [S, S, 4] float32 linear, colour multiplied by alpha
    painted: bool  # whether it came with a texture; else that has no colour of its own


def find_hairdos(folder: Path) -> list[Path]:
    """The .mhclo files in a folder and its folders.

    Raises:
        InputError: there are none.
    """
    found = sorted(Path(folder).glob("**/*.mhclo"))
    if not found:
        raise InputError(f"{folder}: holds no .mhclo; give a folder of hair made for MakeHuman")
    return found


def read_hairdo(path: Path, body: np.ndarray) -> Hairdo:
    """Read a .mhclo file, the OBJ beside it, and NAME_diffuse.png if there is one.

    Args:
        body: [B, 3] mm, of `heads.build.wheel.read_body`.

    Raises:
        InputError: one cannot be read, or the OBJ has another number of vertices.
    """
    points = bound(path, body)
    there, faces, uv, uv_faces = read_obj(path.with_suffix(".obj"))
    if len(there) != len(points):
        raise InputError(
            f"{path}: binds {len(points)} vertices, {path.stem}.obj has {len(there)}; give both "
            "from one package"
        )
    picture = path.with_name(f"{path.stem}_diffuse.png")
    texture = _read_texture(picture) if picture.is_file() else streaks()
    return Hairdo(path.stem, points, faces, uv, uv_faces, texture, picture.is_file())


def bound(path: Path, body: np.ndarray) -> np.ndarray:
    """Where a .mhclo file puts the vertices [P, 3] of its mesh around a body [B, 3].

    Raises:
        InputError: it is no .mhclo of a body with that many vertices.
    """
    scale, rows, begun = np.zeros(3), [], False
    try:
        for line in read_bytes(path).decode().splitlines():
            words = line.split()
            if not words or words[0].startswith("#"):
                continue
            if words[0] in AXES:
                axis = AXES.index(words[0])
                one, other = (body[int(word), axis] for word in words[1:3])
                scale[axis] = abs(one - other) / float(words[3])
            elif words[0] == "verts":
                begun = True
            elif begun and words[0][0] in "-0123456789":
                row = [float(word) for word in words]
                if len(row) == 1:  # lies on one vertex
                    row = [row[0], row[0], row[0], 1, 0, 0, 0, 0, 0]
                rows.append(row)
            elif rows:
                break  # what is hidden under it follows
        table = np.array(rows, float).reshape(-1, 9)
        corners = body[table[:, :3].astype(int)]
    except (ValueError, IndexError) as error:
        raise InputError(f"{path}: not a .mhclo for hm08 ({error})") from error
    if not len(table) or not scale.all():
        raise InputError(f"{path}: not a .mhclo for hm08: it needs {', '.join(AXES)} and verts")
    return np.einsum("nk,nkc->nc", table[:, 3:6], corners) + table[:, 6:] * scale


def _read_texture(path):
    """A picture with alpha as a square texture [S, S, 4], linear and premultiplied."""
    picture = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    if picture is None or picture.ndim != 3 or picture.shape[2] != 4 or picture.dtype != np.uint8:
        raise InputError(f"{path}: not a PNG of 8 bits with alpha")
    picture = picture[..., [2, 1, 0, 3]].astype(np.float32) / 255
    alpha = picture[..., 3:]
    texture = np.concatenate([to_linear(picture[..., :3]) * alpha, alpha], -1)
    size = min(SIZE, picture.shape[0])
    return cv2.resize(texture.astype(np.float32), (size, size), interpolation=cv2.INTER_AREA)


def streaks(size: int = STREAKS) -> np.ndarray:
    """Opaque hair that runs down a texture [size, size, 4] float32, grey, 1 in the mean."""
    down, across = np.mgrid[:size, :size].reshape(2, -1) / size
    level = np.zeros(size * size)
    for wide, long, strong in ((1 / 40, 0.7, 0.3), (1 / 160, 0.5, 0.3), (1 / 400, 0.3, 0.3)):
        place = np.stack([across / wide, down / long, np.zeros_like(down)], 1)
        level += strong * value_noise(place.astype(np.float32), 1.0, round(1 / wide))
    gray = np.exp(level).reshape(size, size, 1)
    return np.repeat(gray / gray.mean(), 4, 2).astype(np.float32) * [1, 1, 1, 0] + [0, 0, 0, 1]


def put_on(hairdo: Hairdo, head: HeadModel, neutral: np.ndarray, tint: np.ndarray) -> HairMesh:
    """A hairdo on a person's head; every triangle is a card of its own, sorted by itself.

    Args:
        neutral: [V, 3] mm.
        tint: [3] linear colour of hair without a texture.
    """
    points = carried(hairdo.points, head, neutral)
    pairs = np.stack([hairdo.faces, hairdo.uv_faces], -1).reshape(-1, 2)
    used, corner = np.unique(pairs, axis=0, return_inverse=True)
    count, side = len(hairdo.faces), len(hairdo.texture)
    texture = hairdo.texture * (1 if hairdo.painted else [*tint, 1])
    return HairMesh(
        points[used[:, 0]].astype(np.float32), corner.reshape(-1, 3).astype(np.int32),
        np.clip(hairdo.uv[used[:, 1]], 0, 1).astype(np.float32),
        np.full(count, HAIR_KINDS.index("card"), np.uint8), np.arange(count, dtype=np.int32),
        np.full(count, 7, np.uint8), np.zeros(len(used), np.float32), texture.astype(np.float16),
        np.zeros((side, side, 2), np.float16), np.zeros((side, side), np.float16),
        np.zeros((side, side), np.uint8),
    )  # fmt: skip


def carried(points: np.ndarray, head: HeadModel, neutral: np.ndarray) -> np.ndarray:
    """Points [P, 3] around the mean head where they lie around another neutral shape [V, 3].

    Each goes as the nearest vertices of the skin go, those of the neck and shoulders aside.
    """
    skin = head.part_vertices("skin")
    skin = skin[head.mean[skin, 1] > LOWEST][::3]
    rest, move = head.mean[skin].astype(float), (neutral[skin] - head.mean[skin]).astype(float)
    out = np.empty(points.shape)
    for some in np.array_split(np.arange(len(points)), max(1, len(points) // 500)):
        far = ((points[some, None] - rest) ** 2).sum(-1)
        near = np.argpartition(far, NEAR, 1)[:, :NEAR]
        weight = 1 / (np.take_along_axis(far, near, 1) + 25)
        weight /= weight.sum(1, keepdims=True)
        out[some] = points[some] + np.einsum("nk,nkc->nc", weight, move[near])
    return out
