"""An avatar of noise: every texel, mask and mouth differs, so that a wrong fetch shows."""

import cv2
import numpy as np
import pytest


@pytest.fixture(scope="session")
def noise_avatar(head):
    """runtime.avatar.Avatar on the built-in head, 128 texels on a side, with a photo."""
    from bakery.geometry import camera as cameras
    from bakery.heads.lashes import with_lashes
    from bakery.runtime.avatar import Avatar
    from bakery.stages.texture.mouth import mouth_landmarks, talking
    from bakery.stages.texture.tongue import seat_tongue
    from bakery.types import EXPRESSIONS, Camera, Fit, Textures

    rng = np.random.default_rng(0)
    size, mouths = 128, 60

    def smooth(*shape):
        flat = rng.random((*shape[:2], int(np.prod(shape[2:])))).astype(np.float32)
        planes = [cv2.GaussianBlur(flat[..., n], (0, 0), 2.0) for n in range(flat.shape[2])]
        low, high = np.min(planes), np.max(planes)
        return ((np.stack(planes, -1) - low) / (high - low)).reshape(shape)

    head, neutral = with_lashes(seat_tongue(head, head.mean), head.mean)
    poses = np.stack([talking(rng) for _ in range(mouths)]).astype(np.float32)
    lips = [mouth_landmarks(head, neutral, head.vertices(neutral, pose)) for pose in poses]
    keys = (rng.random((6, 52)) * (rng.random((6, 52)) < 0.2)).astype(np.float32)
    masks = smooth(64, 64, 52) ** 2
    masks[:32] *= rng.random(52) < 0.5  # some act below only, as real ones do
    hair = smooth(size, size, 4)
    hair[..., :3] *= hair[..., 3:]
    textures = Textures(
        neutral=smooth(size, size, 3).astype(np.float16),
        keys=np.stack([smooth(size, size, 3) for _ in range(6)]).astype(np.float16),
        key_names=tuple("abcdef"),
        key_weights=keys,
        source=rng.integers(0, 5, (size, size)).astype(np.uint8),
        facing=np.ones((size, size), np.float16),
        hair=hair.astype(np.float16),
        gaze=np.stack([smooth(20, 40, 3) for _ in range(20)]).astype(np.float16),
        gaze_directions=rng.uniform(-30, 30, (20, 2)),
        mouths=np.stack([smooth(15, 25, 3) for _ in range(mouths)]).astype(np.float16),
        mouth_landmarks=np.stack(lips),
        mouth_weights=poses,
    )
    camera = Camera(
        900.0, np.array([150.0, 200.0]), np.zeros(3), np.array([0, 20.0, -700.0]), 300, 400
    )
    marks = cameras.project(head.landmarks(neutral), camera)
    fit = Fit(
        head.name, camera, np.zeros(1), np.zeros(len(EXPRESSIONS)), np.zeros(2),
        np.zeros((9, 3)), np.zeros(0), np.zeros((468, 3)), marks,
    )  # fmt: skip
    photo = smooth(400, 300, 3)
    return Avatar(head, neutral, fit, textures, np.moveaxis(masks, 2, 0).copy(), photo)


@pytest.fixture(scope="session")
def short_take():
    """formats.livelink.Take of 12 rows at 30 frames a second, head and eyes in motion."""
    from bakery.formats.livelink import Take
    from bakery.heads.base import weights

    start = weights({"jawOpen": 0.1, "eyeBlinkLeft": 0.2})
    end = weights({"jawOpen": 0.8, "mouthSmileLeft": 0.7, "eyeLookInLeft": 0.5, "browInnerUp": 0.9})
    share = np.linspace(0, 1, 12)[:, None]
    head = share * [12.0, -8.0, 5.0]
    eyes = np.repeat((share * [9.0, 4.0])[:, None], 2, 1)
    rows = (start + share * (end - start)).astype(np.float32)
    return Take(np.arange(12) / 30, rows, head, eyes, 3600.0)
