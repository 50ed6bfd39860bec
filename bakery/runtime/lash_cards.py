"""Lash cards and tear line over a drawn picture: the clear reference.

The lid of a portrait carries its photographed lashes already. So the lash cards show as far as those
are hidden: from the sides, and when the eye shuts and the lid shows skin that no photo saw. They are
translucent, so that they are laid over what is nearest, one after the other in the order of their
faces, from both sides. They are mixed in sRGB, not in linear light: so does every browser.
"""

import numpy as np

from bakery.generators.lids import SHUTS
from bakery.geometry import rotation
from bakery.geometry.color import to_encoded, to_linear
from bakery.geometry.fill import smoothstep
from bakery.geometry.sample import bilinear
from bakery.heads.base import CARDS, HeadModel
from bakery.types import EXPRESSION_INDEX, Camera

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
    for face, weight in zip(faces, weights[card_sides(head, faces)]):
        corners = head.faces[face]
        if (distance[corners] <= 1e-6).any():
            continue
        box = _box(pixels[corners], alpha.shape)
        if box is None:
            continue
        corner_weights, inside = _weights(pixels[corners], 1 / distance[corners], box)
        near = corner_weights.sum(-1)  # 1 / depth
        seen = inside & (near * depth[box] > 1)
        if not seen.any():
            continue
        barycentric = corner_weights[seen] / near[seen][:, None]
        uv = barycentric @ head.uv[head.uv_faces[face]].astype(np.float64)
        card = weight * bilinear(layer, uv[None] * layer.shape[0])[0]
        if card[:, 3].any():
            _mix(color[box], alpha[box], known[box], seen, card)


def _box(corners: np.ndarray, size: tuple[int, int]) -> tuple[slice, slice] | None:
    """The pixels whose middles a face [3, 2] may cover, as slices; None if there are none."""
    low = np.maximum(np.ceil(corners.min(0) - 0.5).astype(int), 0)
    high = np.minimum(np.floor(corners.max(0) - 0.5).astype(int) + 1, size[::-1])
    if (low >= high).any():
        return None
    return slice(low[1], high[1]), slice(low[0], high[0])


def _weights(
    corners: np.ndarray, inverse: np.ndarray, box: tuple[slice, slice]
) -> tuple[np.ndarray, np.ndarray]:
    """Barycentric weights over depth [h, w, 3] at the pixels of a box, and where they are inside."""
    rows, columns = box
    x, y = np.arange(columns.start, columns.stop) + 0.5, np.arange(rows.start, rows.stop) + 0.5
    (ax, ay), (bx, by), (cx, cy) = corners
    area = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay)
    x, y = x[None], y[:, None]
    if area == 0:
        return np.ones((*np.broadcast_shapes(x.shape, y.shape), 3)), np.zeros((1, 1), bool)
    a = ((bx - x) * (cy - y) - (cx - x) * (by - y)) / area
    b = ((cx - x) * (ay - y) - (ax - x) * (cy - y)) / area
    weights = np.stack([a, b, 1 - a - b], -1)
    return weights * inverse, np.all(weights >= 0, axis=-1)


def _mix(
    color: np.ndarray,
    alpha: np.ndarray,
    known: np.ndarray,
    seen: tuple[np.ndarray, ...],
    card: np.ndarray,
) -> None:
    """Lay card texels [n, 4] over the pixels `seen` of views into the picture."""
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
