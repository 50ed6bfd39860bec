"""A contact sheet on which a person can judge an avatar at a glance."""

import numpy as np

from bakery.geometry.color import to_encoded
from bakery.heads.base import look, weights
from bakery.runtime.player import GRAY, Player
from bakery.stages.condition import face_camera
from bakery.types import EXPRESSIONS

SMILE = {
    "mouthSmileLeft": 0.8, "mouthSmileRight": 0.8, "mouthUpperUpLeft": 0.3, "mouthUpperUpRight": 0.3,
    "cheekSquintLeft": 0.6, "cheekSquintRight": 0.6, "mouthLowerDownLeft": 0.25,
    "mouthLowerDownRight": 0.25,
}  # fmt: skip
TALK = {"jawOpen": 0.45, "mouthFunnel": 0.25, "browInnerUp": 0.3}
BLINK = {"eyeBlinkLeft": 1.0, "eyeBlinkRight": 1.0}


def tiles(avatar):
    """The sheet's pictures: (weights [E], gaze [2], yaw) each."""
    keys = list(avatar.textures.key_weights)
    still = np.zeros(len(EXPRESSIONS), np.float32)
    first = [(still, (0, 0), yaw) for yaw in (-40, 0, 40)]
    second = [(weights(SMILE), (0, 0), yaw) for yaw in (-30, 0)] + [(weights(TALK), (0, 0), 15)]
    third = [(weights(BLINK), (0, 0), 0), (look(still, (25, 5)), (25, 5), 0)]
    third += [(look(still, (-15, -15)), (-15, -15), 0)]
    fourth = [(key, (0, 0), 0) for key in keys]
    return first + second + third + fourth


def portraits(avatar, wanted, size, share):
    """Iterate over pictures of an avatar before grey: [size, size, 3] uint8 sRGB.

    Args:
        wanted: (weights [E], gaze [2] degrees, degrees that the head is turned) of each.
        size, share: see `contact_sheet`.
    """
    player = Player(avatar)
    work = player.workspace(size, size)
    for expression, gaze, yaw in wanted:
        camera = face_camera(avatar.fit, avatar.head, avatar.neutral, yaw, size=size, share=share)
        yield player.picture(work, camera, expression, np.array(gaze, float))


def contact_sheet(avatar, size=320, columns=5, share=0.52):
    """Neutral, turned, smiling, talking, blinking, looking aside, and the key expressions.

    Args:
        avatar: runtime.avatar.Avatar.
        size: pixels of one picture's side.
        share: face height over the side.

    Returns:
        [rows * size, columns * size, 3] uint8 sRGB.
    """
    pictures = list(portraits(avatar, tiles(avatar), size, share))
    while len(pictures) % columns:
        pictures.append(np.full((size, size, 3), round(255 * float(to_encoded(GRAY))), np.uint8))
    rows = [np.concatenate(pictures[k : k + columns], 1) for k in range(0, len(pictures), columns)]
    return np.concatenate(rows, 0)
