"""Lash cards and tear line over a drawn picture: the clear reference.

The lid of a portrait carries its photographed lashes already. So the lash cards show as far as those
are hidden: from the sides, and when the eye shuts and the lid shows skin that no photo saw. They are
translucent, so that they are laid over what is nearest, one after the other in the order of their
faces, from both sides. They are mixed in sRGB, not in linear light: so does every browser.
"""

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from bakery.generators.lids import SHUTS
from bakery.geometry import rotation
from bakery.geometry.color import to_encoded, to_linear
from bakery.geometry.fill import smoothstep
from bakery.geometry.sample import bilinear
from bakery.heads.base import CARDS, HeadModel
from bakery.types import EXPRESSION_INDEX, Camera

AT_ONCE = 1 << 17  # pixels of faces that are looked at together
AS_PHOTOGRAPHED = 0.25  # of the lash cards shows where the photo's lashes do
TURNED = (8.0, 32.0)  # degrees off the photo's view at which more begins to show, and all does


def card_weights(camera: Camera, photo_camera: Camera, expression: np.ndarray) -> np.ndarray:
    """How much of the lash cards of the left and of the right eye shows: [2] float32, 0..1.

    From the photo's own view a share of them, until a bare lid takes the photographed one's place.

    Args:
        camera, photo_camera: Camera of the picture, and of the portrait.
        expression: [E] weights.
    """
    toward = [rotation.matrix(one.rotation)[2] for one in (camera, photo_camera)]
    degrees = np.degrees(np.arccos(np.clip(toward[0] @ toward[1], -1, 1)))
    blink = np.array([expression[EXPRESSION_INDEX["eyeBlink" + eye]] for eye in ("Left", "Right")])
    gone = np.maximum(smoothstep(*TURNED, degrees), smoothstep(*SHUTS, blink))
    shown: np.ndarray = AS_PHOTOGRAPHED + (1 - AS_PHOTOGRAPHED) * gone
    return shown.astype(np.float32)


def card_sides(head: HeadModel, faces: np.ndarray) -> np.ndarray:
    """Which eye's the lash cards are: [F], 0 for the left, 1 for the right."""
    middle: np.ndarray = head.mean[head.faces[faces]].mean(1)
    return (middle[:, 0] < 0).astype(int)


def lay_cards(
    color: np.ndarray,
    alpha: np.ndarray,
    known: np.ndarray,
    depth: np.ndarray,
    head: HeadModel,
    pixels: np.ndarray,
    distance: np.ndarray,
    layer: np.ndarray,
    weights: np.ndarray,
) -> None:
    """Draw the lash cards and tear line of a head over a picture.

    Args:
        color: [H, W, 3] float32 linear, premultiplied by alpha; changed, as are the next two.
        alpha: [H, W] float32, 1 where the head is, else 0; known: [H, W] float32, as `Frame.face`.
        depth: [H, W] mm of what is nearest, inf for nothing.
        pixels: [V, 2], distance: [V] mm in front of the camera.
        layer: [T, T, 4] float32 linear, colour multiplied by alpha: the hair layer.
        weights: [2] from `card_weights`.
    """
    faces = head.part_faces(*CARDS)
    shown = weights[card_sides(head, faces)]
    before = ~(distance[head.faces[faces]] <= 1e-6).any(1)  # the camera
    faces, shown = faces[before], shown[before]
    low, size = _boxes(pixels[head.faces[faces]], alpha.shape)
    for run in _runs(size.prod(1)):
        corners = head.faces[faces[run]]
        face, places, shares = _seen(
            pixels[corners], 1 / distance[corners], low[run], size[run], depth
        )
        if not len(face):
            continue
        uv = head.uv[head.uv_faces[faces[run]]].astype(np.float64)
        at = (shares[:, None] @ uv[face])[:, 0]
        card = shown[run][face][:, None] * bilinear(layer, at[None] * layer.shape[0])[0]
        drawn = np.isin(face, face[card[:, 3] != 0])
        for turn in _turns(places[drawn]):
            here = np.unravel_index(places[drawn][turn], alpha.shape)
            _mix(color, alpha, known, here, card[drawn][turn])


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
    opacity = np.clip(card[:, 3:], 0, 1)
    own = card[:, :3] / np.maximum(opacity, 1e-6)
    solid = alpha[seen][:, None] > 0.999
    behind = color[seen]
    over = to_linear(to_encoded(behind) * (1 - opacity) + to_encoded(own) * opacity)
    color[seen] = np.where(solid, over, behind * (1 - opacity) + card[:, :3])
    for plane in (alpha, known):
        plane[seen] = np.where(
            solid[:, 0], plane[seen], opacity[:, 0] + plane[seen] * (1 - opacity[:, 0])
        )
