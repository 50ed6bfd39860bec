"""Lash cards and tear line over a drawn picture: the clear reference.

The lid of a portrait carries its photographed lashes already. So the lash cards show as far as those
are hidden: from the sides, and when the eye shuts and the lid shows skin that no photo saw.
"""

import numpy as np

from bakery.generators.lids import SHUTS
from bakery.geometry import rotation
from bakery.geometry.fill import smoothstep
from bakery.heads.base import CARDS, HeadModel
from bakery.runtime.cards import lay_faces
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
    corners = head.faces[faces]
    share = np.ones((len(faces), 3, 4), np.float32) * weights[card_sides(head, faces), None, None]
    lay_faces(
        color, alpha, known, depth, pixels[corners], distance[corners],
        head.uv[head.uv_faces[faces]].astype(np.float64), layer, share,
    )  # fmt: skip
