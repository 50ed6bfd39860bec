"""A closer look at eyes and mouth: points where the whole face leaves too few pixels.

The points network sees a face in 128 pixels and learned from resting and smiling people: it shows
a quarter of how far eyes close and a third of how far lips part. Two small networks look at each eye
and at the mouth in crops of their own; all points in these crops take the place of the first ones.

torch is imported on the first use, for it takes a second.
"""

from dataclasses import dataclass
from functools import cache

import cv2
import numpy as np

from bakery import landmarks as marks
from bakery.detectors import frames
from bakery.errors import ModelError
from bakery.paths import ASSETS

WEIGHTS = ASSETS / "detectors" / "closeups.safetensors"
SIDE = 64  # pixels of a crop
EYE_SPAN, MOUTH_SPAN = 2.3, 1.2  # side of a crop over the eye's width; over the outer-eye distance
EYE_LIFT = 0.3  # eye widths that the crop's middle lies above the eye's: the brow is in it
LOOKS = 4  # at most at one picture
MOVED = 0.05  # share of a crop's side: where its middle lay farther off, it is cut and seen again
CORNERS = (
    (marks.LEFT_EYE_OUTER, marks.LEFT_EYE_INNER),
    (marks.RIGHT_EYE_OUTER, marks.RIGHT_EYE_INNER),
)


@dataclass(frozen=True, eq=False)
class Closeup:
    """A network and what it sees."""

    network: object  # CloseupNet
    rows: np.ndarray  # [crops, n] its points in the crops of one face; an iris' first is its middle


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
    """Points [478, 2] with those around eyes and mouth seen again.

    Where the points network takes a dark neck for the chin, the first crop lies a fifth of the face too
    low; the second does not.

    Args:
        image: [H, W, 3] uint8 sRGB.
        points: [478, 2] pixels, of the points network.

    Raises:
        ModelError: the weights are missing or damaged.
    """
    points = np.array(points, np.float64)
    for _ in range(LOOKS):
        crops = [*eye_frames(points), mouth_frame(points)]
        points = _look(image, points, crops)
        after = [*eye_frames(points), mouth_frame(points)]
        moved = [
            np.linalg.norm(new.center - old.center) / old.size for new, old in zip(after, crops)
        ]
        if max(moved) < MOVED:
            break
    return points


def _look(image, points, crops):
    """One look at the crops (left eye, right eye, mouth) of points [478, 2]."""
    import torch

    left, right, mouth = crops
    eyes = [matrix_of(left), matrix_of(right, True)]
    total, times = np.zeros_like(points), np.zeros(len(points))
    for closeup, matrices in zip(networks(), (eyes, [matrix_of(mouth)])):
        pictures = np.stack([take(image, matrix) for matrix in matrices])
        with torch.inference_mode():
            answers = closeup.network(torch.from_numpy(pictures)).numpy()
        for rows, matrix, found in zip(closeup.rows, matrices, answers):
            total[rows] += frames.apply_affine(frames.invert_affine(matrix), (found + 0.5) * SIDE)
            times[rows] += 1
    seen = times > 0
    total[seen] /= times[seen][:, None]  # crops overlap
    points = points.copy()
    for iris in (marks.LEFT_IRIS, marks.RIGHT_IRIS):
        points[iris] += total[iris.start] - points[iris].mean(0)
        seen[iris] = False
    return np.where(seen[:, None], total, points)


def seen_close():
    """The points of the skin that `look_closer` sees again [n]."""
    rows = np.unique(np.concatenate([closeup.rows.ravel() for closeup in networks()]))
    return rows[rows < marks.FACE]


@cache
def networks(path=WEIGHTS):
    """The Closeups of eyes and mouth, ready to run.

    Raises:
        ModelError: the file is missing, damaged or of another network.
    """
    from safetensors.torch import load_file

    from bakery.detectors.blocks import CloseupNet

    found = []
    try:
        tensors = load_file(path)
        for name in ("eye.", "mouth."):
            own = {k.removeprefix(name): v for k, v in tensors.items() if k.startswith(name)}
            rows = own.pop("rows").numpy()
            network = CloseupNet(rows.shape[1], folded=True)
            network.load_state_dict({k: v.float() for k, v in own.items()})
            found.append(Closeup(network.eval(), rows))
    except FileNotFoundError:
        raise ModelError(f"{path}: no such weights; reinstall bakery") from None
    except Exception as error:
        raise ModelError(f"{path}: damaged weights ({error}); reinstall bakery") from None
    return tuple(found)
