"""Pieces of a head under construction, and how they become one `HeadModel`."""

from dataclasses import dataclass, replace

import numpy as np

from bakery.heads.base import FOLLOW, PARTS, HeadModel
from bakery.types import EXPRESSIONS, LANDMARKS


@dataclass(frozen=True)
class Patch:
    """Some parts of a head that share vertices. uv lies in the chart's own 0..1 square."""

    parts: np.ndarray  # [F] uint8 into PARTS
    mean: np.ndarray  # [V, 3] mm
    faces: np.ndarray  # [F, 3] int
    uv: np.ndarray  # [U, 2]
    uv_faces: np.ndarray  # [F, 3] int
    follow: np.ndarray  # [V] uint8 into FOLLOW
    identity: np.ndarray  # [I, V, 3] mm
    expression: np.ndarray  # [E, V, 3] mm


def part_ids(name, count):
    """`count` times the number of a part."""
    return np.full(count, PARTS.index(name), np.uint8)


def follow_ids(name, count):
    """`count` times the number of what a vertex follows."""
    return np.full(count, FOLLOW.index(name), np.uint8)


def place(uv, box):
    """Move uv [U, 2] of a 0..1 chart into box [left, top, width, height] of the atlas."""
    return np.asarray(box[:2]) + np.asarray(uv) * np.asarray(box[2:])


def boxed(patch, box):
    """The patch with its chart moved into a box of the atlas."""
    return replace(patch, uv=place(patch.uv, box))


def rigid(mean, center, modes, scales):
    """Identity modes [I, V, 3] that move points [V, 3] by `modes` [I, 3] mm and scale them about
    `center` by `scales` [I] (0.1 = 10% larger)."""
    return modes[:, None] + scales[:, None, None] * (mean - center)[None]


def still(count):
    """No expression moves these vertices: [E, V, 3]."""
    return np.zeros((len(EXPRESSIONS), count, 3), np.float32)


def join(patches, name, licence, source, rectangles):
    """One head of the patches, all with uv in the atlas already; landmarks not yet placed."""
    points = np.cumsum([0] + [len(p.mean) for p in patches])
    texels = np.cumsum([0] + [len(p.uv) for p in patches])
    F32 = np.float32
    return HeadModel(
        name=name,
        licence=licence,
        source=source,
        mean=np.concatenate([p.mean for p in patches]).astype(F32),
        faces=np.concatenate([p.faces + n for p, n in zip(patches, points)]).astype(np.int32),
        uv=np.concatenate([p.uv for p in patches]).astype(F32),
        uv_faces=np.concatenate([p.uv_faces + n for p, n in zip(patches, texels)]).astype(np.int32),
        face_part=np.concatenate([p.parts for p in patches]).astype(np.uint8),
        follow=np.concatenate([p.follow for p in patches]).astype(np.uint8),
        identity_basis=np.concatenate([p.identity for p in patches], axis=1).astype(F32),
        expression_basis=np.concatenate([p.expression for p in patches], axis=1).astype(F32),
        landmark_faces=np.zeros(LANDMARKS, np.int32),
        landmark_barycentric=np.tile(F32([1, 0, 0]), (LANDMARKS, 1)),
        uv_rectangles=rectangles,
    )
