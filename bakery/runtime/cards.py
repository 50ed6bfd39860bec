"""Translucent faces over a drawn picture: the clear reference of lashes, tear line and hair.

They are laid over what is nearest, one after the other in the order of their faces, from both sides,
and hide nothing. They are mixed in sRGB, not in linear light: so does every browser.
"""

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from bakery.geometry.color import to_encoded, to_linear
from bakery.geometry.sample import bilinear

AT_ONCE = 1 << 17  # pixels of faces that are looked at together


def lay_faces(
    color: np.ndarray,
    alpha: np.ndarray,
    known: np.ndarray,
    depth: np.ndarray,
    pixels: np.ndarray,
    distance: np.ndarray,
    uv: np.ndarray,
    texture: np.ndarray,
    share: np.ndarray,
) -> None:
    """Lay textured faces over a picture.

    Args:
        color: [H, W, 3] float32 linear, premultiplied by alpha; changed, as are the next two.
        alpha: [H, W] float32, 1 where the head is, else 0; known: [H, W] float32, as `Frame.face`.
        depth: [H, W] mm of what is nearest, inf for nothing.
        pixels: [F, 3, 2], distance: [F, 3] mm in front of the camera, uv: [F, 3, 2] 0..1: of the
            faces' corners, the first face to be laid first.
        texture: [T, T, 4] float32 linear, colour multiplied by alpha.
        share: [F, 3, 4] float32: what the texture is multiplied by at each corner.
    """
    before = ~(distance <= 1e-6).any(1)  # the camera
    pixels, distance, uv, share = (part[before] for part in (pixels, distance, uv, share))
    low, size = _boxes(pixels, alpha.shape)
    for run in _runs(size.prod(1)):
        face, places, weights = _seen(pixels[run], 1 / distance[run], low[run], size[run], depth)
        if not len(face):
            continue
        at, scale = ((weights[:, None] @ part[run][face])[:, 0] for part in (uv, share))
        card = scale * bilinear(texture, at[None] * len(texture))[0]
        drawn = card[:, 3] > 0
        places, card = places[drawn], card[drawn]
        for turn in _turns(places):
            _mix(color, alpha, known, np.unravel_index(places[turn], alpha.shape), card[turn])


def lay_picture(color: np.ndarray, alpha: np.ndarray, layer: np.ndarray) -> None:
    """Lay a picture [H, W, 4], linear and premultiplied, over another: color [H, W, 3] with its alpha."""
    seen = np.nonzero(layer[..., 3])
    _mix(color, alpha, np.zeros_like(alpha), seen, layer[seen])


def _boxes(corners: np.ndarray, shape: tuple[int, ...]) -> tuple[np.ndarray, np.ndarray]:
    """The pixels whose middles faces [F, 3, 2] may cover: the first [F, 2], how many [F, 2], x, y."""
    low = np.maximum(np.ceil(corners.min(1) - 0.5).astype(int), 0)
    high = np.minimum(np.floor(corners.max(1) - 0.5).astype(int) + 1, shape[::-1])
    return low, np.maximum(high - low, 0)


def _runs(counts: np.ndarray) -> Iterator[slice]:
    """Slices of faces [F] with so many pixels each: AT_ONCE in a slice, but for its last face."""
    ends = np.flatnonzero(np.diff(np.cumsum(counts) // AT_ONCE)) + 1
    yield from (slice(*both) for both in pairwise([0, *ends.tolist(), len(counts)]))


def _seen(
    corners: np.ndarray,
    inverse: np.ndarray,
    low: np.ndarray,
    size: np.ndarray,
    depth: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Where faces show, face by face.

    Args:
        corners: [F, 3, 2] pixels; inverse: [F, 3] 1 / distance; low, size: [F, 2] of `_boxes`.
        depth: [H, W] of what is nearest.

    Returns:
        (face [n], pixel [n] of the flat picture, barycentric weights [n, 3]).
    """
    counts = size.prod(1)
    face = np.repeat(np.arange(len(counts)), counts)
    number = np.arange(len(face)) - np.repeat(np.cumsum(counts) - counts, counts)
    row, column = np.divmod(number, size[face, 0]) + low[face, ::-1].T
    x, y = column + 0.5, row + 0.5
    (ax, ay), (bx, by), (cx, cy) = corners.transpose(1, 2, 0)
    area = ((bx - ax) * (cy - ay) - (cx - ax) * (by - ay))[face]
    (ax, ay), (bx, by), (cx, cy) = corners[face].transpose(1, 2, 0)
    with np.errstate(divide="ignore", invalid="ignore"):  # a face without area is inside nowhere
        a = ((bx - x) * (cy - y) - (cx - x) * (by - y)) / area
        b = ((cx - x) * (ay - y) - (ax - x) * (cy - y)) / area
        weights = np.stack([a, b, 1 - a - b], -1)
        inside = np.all(weights >= 0, axis=-1) & (area != 0)
        over = weights * inverse[face]
        near = over.sum(-1)  # 1 / depth
        inside &= near * depth[row, column] > 1
    places = row[inside] * depth.shape[1] + column[inside]
    return face[inside], places, over[inside] / near[inside][:, None]


def _turns(places: np.ndarray) -> Iterator[np.ndarray]:
    """Indices into places [n]: of all that come first in their pixel, then of the second ones, ..."""
    order = np.argsort(places, kind="stable")
    starts = np.flatnonzero(np.diff(places[order], prepend=-1))
    counts = np.diff(starts, append=len(places))
    for turn in range(counts.max(initial=0)):
        yield order[starts[counts > turn] + turn]


def _mix(
    color: np.ndarray,
    alpha: np.ndarray,
    known: np.ndarray,
    seen: tuple[np.ndarray, ...],
    card: np.ndarray,
) -> None:
    """Lay card texels [n, 4] over the pixels `seen`, each of which is named once."""
    opacity = np.clip(card[:, 3], 0, 1)
    own, behind = card[:, :3] / np.maximum(opacity, 1e-6)[:, None], alpha[seen]
    through = behind * (1 - opacity)
    whole = opacity + through
    straight = color[seen] / np.maximum(behind, 1e-6)[:, None]
    mixed = to_encoded(straight) * through[:, None] + to_encoded(own) * opacity[:, None]
    color[seen] = to_linear(mixed / np.maximum(whole, 1e-6)[:, None]) * whole[:, None]
    known[seen] = np.where(behind > 0.999, known[seen], opacity + known[seen] * (1 - opacity))
    alpha[seen] = whole
