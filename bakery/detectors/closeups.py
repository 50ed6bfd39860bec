"""A closer look at eyes, brows and mouth: points where the whole face leaves too few pixels.

The points network sees a face in 128 pixels and learned from resting and smiling people: it shows
a quarter of how far eyes close and a third of how far lips part. Two small networks look at each eye
and at the mouth in crops of their own; their points take the place of the first ones.

torch is imported on the first use, for it takes a second.
"""

from functools import cache
from pathlib import Path

import cv2
import numpy as np

from bakery import landmarks as marks
from bakery.detectors import frames
from bakery.errors import ModelError

WEIGHTS = Path(__file__).resolve().parents[1] / "assets" / "detectors" / "closeups.safetensors"
SIDE = 64  # pixels of a crop
EYE_SPAN, MOUTH_SPAN = 2.3, 1.2  # side of a crop over the eye's width; over the outer-eye distance
EYE_LIFT = 0.3  # eye widths that the crop's middle lies above the eye's: the brow is in it
LID_POINTS, BROW_POINTS = len(marks.EYE_LEFT), len(marks.BROW_LEFT)
# The left eye's points; the right eye is looked at in the mirror, where it has the same order.
EYES = (
    (marks.EYE_LEFT, marks.LEFT_IRIS, marks.BROW_LEFT),
    (marks.EYE_RIGHT, marks.RIGHT_IRIS, marks.BROW_RIGHT),
)
CORNERS = (
    (marks.LEFT_EYE_OUTER, marks.LEFT_EYE_INNER),
    (marks.RIGHT_EYE_OUTER, marks.RIGHT_EYE_INNER),
)
MOUTH = np.concatenate([marks.LIPS_OUTER, marks.LIPS_INNER])
SEEN_CLOSE = np.unique(
    np.concatenate([MOUTH, *(part for eye in EYES for part in (eye[0], eye[2]))])
)
EYE_COUNT, MOUTH_COUNT = LID_POINTS + 1 + BROW_POINTS, len(MOUTH)


def eye_frames(points):
    """The crops of both eyes (left, right): FaceFrame each, `size` the crop's side.

    Args:
        points: [478, 2] pixels.
    """
    across = points[marks.LEFT_EYE_OUTER] - points[marks.RIGHT_EYE_OUTER]
    roll = float(np.arctan2(across[1], across[0]))
    up = frames.rotation(roll) @ [0, -1]
    found = []
    for outer, inner in CORNERS:
        width = np.linalg.norm(points[outer] - points[inner])
        middle = (points[outer] + points[inner]) / 2 + up * EYE_LIFT * width
        found.append(frames.FaceFrame(middle, EYE_SPAN * float(width), roll))
    return found


def mouth_frame(points):
    """The crop of the mouth: FaceFrame, `size` the crop's side."""
    across = points[marks.LEFT_EYE_OUTER] - points[marks.RIGHT_EYE_OUTER]
    roll = float(np.arctan2(across[1], across[0]))
    middle = points[marks.LIPS_OUTER].mean(0)
    return frames.FaceFrame(middle, MOUTH_SPAN * float(np.linalg.norm(across)), roll)


def matrix_of(frame, mirrored=False, side=SIDE):
    """[2, 3] picture pixels -> crop pixels, seen in the mirror if asked."""
    matrix = frames.crop_matrix(frame, side, margin=1.0)
    if mirrored:
        matrix = np.array([[-1.0], [1.0]]) * matrix + np.array([[0, 0, side], [0, 0, 0]])
    return matrix


def take(image, matrix, side=SIDE):
    """A grey crop [side, side] uint8, large pictures averaged first."""
    scale = np.sqrt(abs(np.linalg.det(matrix[:, :2])))
    if scale < 0.6:  # warping alone would skip pixels
        inverse = frames.invert_affine(matrix)
        corners = frames.apply_affine(
            inverse, np.array([[0, 0], [side, 0], [0, side], [side, side]])
        )
        height, width = image.shape[:2]
        low = np.clip(np.floor(corners.min(0)).astype(int) - 2, 0, (width - 1, height - 1))
        high = np.clip(np.ceil(corners.max(0)).astype(int) + 3, low + 1, (width, height))
        window = image[low[1] : high[1], low[0] : high[0]]
        shrink = 1 / scale
        size = np.maximum(((high - low) / shrink).astype(int), 1)
        small = cv2.resize(window, size.tolist(), interpolation=cv2.INTER_AREA)
        ratio = (high - low) / size
        matrix = np.column_stack([matrix[:, :2] * ratio, matrix[:, :2] @ low + matrix[:, 2]])
        image = small
    return cv2.cvtColor(frames.take_crop(image, matrix, side), cv2.COLOR_RGB2GRAY)


def look_closer(image, points):
    """Points [478, 2] with those of eyes, brows and mouth seen again.

    Args:
        image: [H, W, 3] uint8 sRGB.
        points: [478, 2] pixels, of the points network.

    Raises:
        ModelError: the weights are missing or damaged.
    """
    import torch

    eye_net, mouth_net = networks()
    points = np.array(points, np.float64)
    matrices = [
        matrix_of(frame, mirrored) for frame, mirrored in zip(eye_frames(points), (False, True))
    ]
    crops = np.stack([take(image, matrix) for matrix in matrices])
    lower = matrix_of(mouth_frame(points))
    mouth = take(image, lower)[None]
    with torch.inference_mode():
        eyes = eye_net(torch.from_numpy(crops)).numpy()
        lips = mouth_net(torch.from_numpy(mouth)).numpy()[0]
    for (lids, iris, brow), matrix, found in zip(EYES, matrices, eyes):
        found = frames.apply_affine(frames.invert_affine(matrix), (found + 0.5) * SIDE)
        points[lids] = found[:LID_POINTS]
        points[iris] += found[LID_POINTS] - points[iris].mean(0)
        points[brow] = found[LID_POINTS + 1 :]
    points[MOUTH] = frames.apply_affine(frames.invert_affine(lower), (lips + 0.5) * SIDE)
    return points


@cache
def networks(path=WEIGHTS):
    """The networks of eyes and mouth, ready to run.

    Raises:
        ModelError: the file is missing, damaged or of another network.
    """
    from safetensors.torch import load_file

    from bakery.detectors.blocks import CloseupNet

    found = []
    try:
        tensors = load_file(path)
        for name, count in (("eye.", EYE_COUNT), ("mouth.", MOUTH_COUNT)):
            network = CloseupNet(count, folded=True)
            network.load_state_dict(
                {k.removeprefix(name): v.float() for k, v in tensors.items() if k.startswith(name)}
            )
            found.append(network.eval())
    except FileNotFoundError:
        raise ModelError(f"{path}: no such weights; reinstall bakery") from None
    except Exception as error:
        raise ModelError(f"{path}: damaged weights ({error}); reinstall bakery") from None
    return tuple(found)
