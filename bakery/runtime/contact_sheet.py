"""A contact sheet on which a person can judge an avatar at a glance."""

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from bakery.formats.targets import named_expressions
from bakery.geometry.color import to_encoded
from bakery.heads.base import look, weights
from bakery.runtime.avatar import Avatar
from bakery.runtime.framing import head_camera
from bakery.runtime.overlay import caption
from bakery.runtime.player import Player
from bakery.runtime.render import GRAY
from bakery.types import EXPRESSIONS

Pose = tuple[np.ndarray, Sequence[float], float]  # weights [E], gaze [2] and yaw, degrees
SMILE = named_expressions()["smile"]
TALK = {"jawOpen": 0.45, "mouthFunnel": 0.25, "browInnerUp": 0.3}
BLINK = {"eyeBlinkLeft": 1.0, "eyeBlinkRight": 1.0}


def tiles(avatar: Avatar) -> list[tuple[str, Pose]]:
    """The sheet's pictures: what each shows, and its (weights [E], gaze [2], yaw)."""
    textures = avatar.textures
    still = np.zeros(len(EXPRESSIONS), np.float32)

    def aside(yaw: float, pitch: float) -> tuple[str, Pose]:
        return f"gaze {yaw}, {pitch}", (look(still, (yaw, pitch)), (yaw, pitch), 0)

    return [
        ("neutral, yaw -40", (still, (0, 0), -40)),
        ("neutral", (still, (0, 0), 0)),
        ("neutral, yaw 40", (still, (0, 0), 40)),
        ("smile, yaw -30", (weights(SMILE), (0, 0), -30)),
        ("smile", (weights(SMILE), (0, 0), 0)),
        ("talk, yaw 15", (weights(TALK), (0, 0), 15)),
        ("blink", (weights(BLINK), (0, 0), 0)),
        aside(25, 5),
        aside(-15, -15),
        *(
            (f"key: {name}", (key, (0, 0), 0))
            for name, key in zip(textures.key_names, textures.key_weights)
        ),
    ]


def portraits(avatar: Avatar, wanted: Iterable[Pose], size: int) -> Iterator[np.ndarray]:
    """Iterate over pictures of an avatar before grey: [size, size, 3] uint8 sRGB.

    Args:
        wanted: (weights [E], gaze [2] degrees, degrees that the head is turned) of each.
        size: pixels of one picture's side.
    """
    player = Player(avatar)
    work = player.workspace(size, size)
    for expression, gaze, yaw in wanted:
        camera = head_camera(
            avatar.fit, avatar.head, avatar.neutral, yaw, size=size, hair=avatar.textures.hair_mesh
        )
        yield player.picture(work, camera, expression, np.array(gaze, float))


def contact_sheet(avatar: Avatar, size: int = 320, columns: int = 5) -> np.ndarray:
    """Neutral, turned, smiling, talking, blinking, looking aside, and the key expressions.

    Args:
        avatar: runtime.avatar.Avatar.
        size: pixels of one picture's side.

    Returns:
        [rows * size, columns * size, 3] uint8 sRGB; each picture says below what it shows.
    """
    names, wanted = zip(*tiles(avatar))
    pictures = list(map(caption, portraits(avatar, wanted, size), names))
    while len(pictures) % columns:
        pictures.append(np.full((size, size, 3), round(255 * float(to_encoded(GRAY))), np.uint8))
    rows = [np.concatenate(pictures[k : k + columns], 1) for k in range(0, len(pictures), columns)]
    return np.concatenate(rows, 0)
