"""A closer look at eyes and mouth: points where the whole face leaves too few pixels.

The points network sees a face in 128 pixels. Two small networks look at each eye and at the mouth in
crops of their own, cut from the photo at its full size, and both answers are drawn together.

torch is imported on the first use, for it takes a second.
"""

from dataclasses import dataclass
from functools import cache
from itertools import chain

import numpy as np

from bakery import landmarks as marks
from bakery.detectors import frames
from bakery.errors import ModelError, lacks_memory
from bakery.geometry.shrink import shrink
from bakery.parallel import both
from bakery.paths import ASSETS

WEIGHTS = ASSETS / "detectors" / "closeups.safetensors"
SIDES = {"eye": 64, "mouth": 96}  # pixels of a crop
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
    side: int  # pixels of a crop


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


def matrix_of(frame, side, mirrored=False):
    """[2, 3] picture pixels -> crop pixels, seen in the mirror if asked."""
    matrix = frames.crop_matrix(frame, side, margin=1.0)
    if mirrored:
        matrix = np.array([[-1.0], [1.0]]) * matrix + np.array([[0, 0, side], [0, 0, 0]])
    return matrix


def take(image, matrix, side):
    """A crop [side, side, 3] uint8, large pictures averaged first."""
    scale = np.sqrt(abs(np.linalg.det(matrix[:, :2])))
    if scale < 0.6:  # warping alone would skip pixels
        inverse = frames.invert_affine(matrix)
        corners = frames.apply_affine(
            inverse, np.array([[0, 0], [side, 0], [0, side], [side, side]])
        )
        height, width = image.shape[:2]
        low = np.clip(np.floor(corners.min(0)).astype(int) - 2, 0, (width - 1, height - 1))
        high = np.clip(np.ceil(corners.max(0)).astype(int) + 3, low + 1, (width, height))
        size = np.maximum(((high - low) * scale).astype(int), 1)
        image, pixels = shrink(image[low[1] : high[1], low[0] : high[0]], size)
        matrix = np.column_stack([matrix[:, :2] * pixels, matrix[:, :2] @ low + matrix[:, 2]])
    return frames.take_crop(image, matrix, side)


def look_closer(image, points, errors, looks=LOOKS):
    """Points of the whole face and of closer looks at eyes and mouth, drawn together.

    Each look's answer for a point counts by the inverse square of its expected error: the closer
    one knows rims and irises better, the whole face where a brow lies.

    Args:
        image: [H, W, 3] uint8 sRGB.
        points: [478, 2] pixels, errors: [478] pixels expected, of the points network.
        looks: at most; the last is where crops moved by less than `MOVED`. Where the points network
            takes a dark neck for the chin, the first crop lies a fifth of the face too low.

    Returns:
        points [478, 2], errors [478] pixels

    Raises:
        ModelError: the weights are missing or damaged.
    """
    whole, doubt = np.asarray(points, np.float64), np.asarray(errors, np.float64)
    points, errors = whole, doubt
    for _ in range(looks):
        crops = [*eye_frames(points), mouth_frame(points)]
        seen, expected = _look(image, points, crops)
        share = doubt**2 / (doubt**2 + expected**2)
        points = whole + (seen - whole) * share[:, None]
        errors = np.minimum(doubt, expected)
        after = [*eye_frames(points), mouth_frame(points)]
        moved = [
            np.linalg.norm(new.center - old.center) / old.size for new, old in zip(after, crops)
        ]
        if max(moved) < MOVED:
            break
    return points, errors


def _look(image, points, crops):
    """One look at the crops (left eye, right eye, mouth) of points [478, 2].

    Returns:
        points [478, 2] with those in the crops seen again; expected errors [478], infinite
        elsewhere.
    """
    from bakery.detectors.blocks import inference

    left, right, mouth = crops
    eye_net, mouth_net = networks()
    with inference():  # here too, so that torch has its own number of threads again afterwards
        answers = both(
            lambda: _answers(eye_net, image, ((left, False), (right, True))),
            lambda: _answers(mouth_net, image, ((mouth, False),)),
        )
    found = points.copy()
    weights, total = np.zeros(len(points)), np.zeros_like(points)
    for rows, at, expected in chain(*answers):
        weight = expected**-2.0
        total[rows] += at * weight[:, None]  # crops overlap
        weights[rows] += weight
    seen = weights > 0
    found[seen] = total[seen] / weights[seen][:, None]
    for iris in (marks.LEFT_IRIS, marks.RIGHT_IRIS):
        found[iris] = points[iris] + found[iris.start] - points[iris].mean(0)
        weights[iris] = weights[iris.start]
    with np.errstate(divide="ignore"):
        return found, weights**-0.5


def _answers(closeup, image, looks):
    """What a Closeup sees in crops (FaceFrame, whether mirrored).

    Returns:
        a list of rows [n] of the points, where they are [n, 2] and expected errors [n], pixels.
    """
    import torch

    from bakery.detectors.blocks import inference

    side = closeup.side
    matrices = [matrix_of(frame, side, mirrored) for frame, mirrored in looks]
    pictures = np.stack([take(image, matrix, side) for matrix in matrices])
    with inference():
        batch = torch.from_numpy(pictures).permute(0, 3, 1, 2).float().div_(255)
        places, log_errors = (part.numpy() for part in closeup.network(batch))
    return [
        (
            rows,
            frames.apply_affine(frames.invert_affine(matrix), (place + 0.5) * side),
            np.exp(log_error) * frame.size,
        )
        for rows, matrix, place, log_error, (frame, _) in zip(
            closeup.rows, matrices, places, log_errors, looks
        )
    ]


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
    import torch
    from safetensors.torch import load_file

    from bakery.detectors.blocks import CloseupNet

    found = []
    try:
        tensors = load_file(path)
        for name in ("eye.", "mouth."):
            own = {k.removeprefix(name): v for k, v in tensors.items() if k.startswith(name)}
            rows = own.pop("rows").numpy()
            side = SIDES[name.removesuffix(".")]
            network = CloseupNet(rows.shape[1], side, folded=True)
            network.load_state_dict({k: v.float() for k, v in own.items()})
            network = network.eval().to(memory_format=torch.channels_last)
            found.append(Closeup(network, rows, side))
    except FileNotFoundError:
        raise ModelError(f"{path}: no such weights; reinstall bakery") from None
    except Exception as error:
        if lacks_memory(error):
            raise
        raise ModelError(f"{path}: damaged weights ({error}); reinstall bakery") from None
    return tuple(found)
