"""The project's own detector: a finder over a picture pyramid, then points in three looks.

The finder says where faces are, how large and how tilted. The points network looks at an upright
crop of each; its answer gives a better crop for the second look. It also says whether there is a
face at all, which weeds out what the finder took for one. The last look is a closer one at eyes and
mouth (`closeups`).

torch is imported on the first use, for it takes a second.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from bakery.detectors import closeups, frames
from bakery.detectors.closeups import look_closer
from bakery.detectors.frames import FaceFrame
from bakery.errors import ModelError, lacks_memory
from bakery.formats.files import digest, digest_file
from bakery.geometry.shrink import shrink
from bakery.landmarks import face_size
from bakery.paths import ASSETS
from bakery.types import Landmarks

WEIGHTS = ASSETS / "detectors" / "network.safetensors"
CELL = 8  # pixels of a pyramid level a cell of the finder's answer
SIZE_RATIO = 1.5  # two levels may differ more about one face: then the points network decides
UNIT_SIZE = 48.0  # pixels; the finder gives sizes as multiples of this


@dataclass(frozen=True)
class NetworkOptions:
    shrink: float = 3.2  # photo pixels a pixel of the finest level: a 64 pixel face is 20 there
    coarsest: int = 96  # longer side of the coarsest level, pixels
    finest: int = 2000  # longer side of the finest level at most, pixels
    finder_score: float = 0.35  # weaker peaks are not looked at
    presence: float = 0.5  # weaker faces are not reported
    score: float = 0.6  # nor are those with a lower geometric mean of both; training photos made
    # dark, blurred and noisy have 0.88 and more, textures taken for faces up to 0.57
    candidates: int = 12  # peaks that are looked at
    looks: int = 2  # of the points network; each after the first starts from the one before
    # Of the photo's longer side: beside a face this large finer levels, which cost most, are left
    # out; small faces behind it are nobody's portrait.
    portrait: float = 0.25
    settled: float = (
        0.05  # of the face: one that moved less since the last look is not looked at again
    )
    full_confidence_error: float = 0.1  # expected error, eye distances, at confidence 1/e


class NetworkDetector:
    """See `bakery.detectors.base.PlacingDetector`."""

    name = "network"

    def __init__(self, finder, points, options=NetworkOptions(), sha256=""):
        self.finder, self.points, self.options, self.sha256 = finder, points, options, sha256

    def detect(self, image: np.ndarray) -> list[Landmarks]:
        """All faces of a photo.

        Args:
            image: [H, W, 3] uint8, sRGB, upright.

        Returns:
            list of Landmarks, surest first
        """
        peaks, large = [], self.options.portrait * max(image.shape)
        for size in level_sizes(image.shape, self.options):
            peaks += self.peaks(*level(image, size))
            if any(frame.size > 0.8 * large for _, frame in peaks):  # the finder's sizes are rough
                faces = self._faces(image, *self._strongest(peaks))
                if any(face.box[2:].max() > large for face in faces):
                    return faces
        return self._faces(image, *self._strongest(peaks))

    def _faces(self, image, scores, found):
        """Those of the frames that show a face, surest first."""
        if not found:
            return []
        shapes, errors, presence = self.place(image, found)
        for _ in range(self.options.looks - 1):
            keep = np.flatnonzero(presence > self.options.presence / 2)
            shapes, errors, presence = shapes[keep], errors[keep], presence[keep]
            scores, before = [scores[i] for i in keep], [found[i] for i in keep]
            found = [frames.frame_of_points(points) for points in shapes]
            again = [i for i in range(len(keep)) if self._moved(before[i], found[i])]
            if again:
                new = self.place(image, [found[i] for i in again])
                shapes[again], errors[again], presence[again] = new
                for i in again:
                    found[i] = frames.frame_of_points(shapes[i])
        scores = np.sqrt(np.multiply(scores, presence))
        faces, kept = [], []
        for i in np.argsort(-scores):
            sure = presence[i] >= self.options.presence and scores[i] >= self.options.score
            if sure and not _repeats(found[i], kept):
                kept.append(found[i])
                points, expected = look_closer(image, shapes[i], errors[i], looks=1)
                faces.append(self._landmarks(points, expected, scores[i]))
        return faces

    def _moved(self, before, after):
        """Whether another look at a face, at the frame of its points, can show more."""
        off = np.linalg.norm(after.center - before.center) / after.size
        turned = abs(np.angle(np.exp(1j * (after.roll - before.roll))))
        return max(off, abs(np.log(after.size / before.size)), turned) > self.options.settled

    def peaks(self, picture, scale):
        """Where the finder sees faces in a `level`: list of (score, FaceFrame)."""
        return _peaks(self._run(self.finder, _padded(picture))[0], scale, self.options)

    def _strongest(self, peaks):
        """The scores and frames of the peaks that are worth a look, surest first."""
        scores, kept = [], []
        for score, frame in sorted(peaks, key=lambda peak: -peak[0]):
            if len(kept) < self.options.candidates and not _repeats(frame, kept, SIZE_RATIO):
                scores.append(score)
                kept.append(frame)
        return scores, kept

    def place(
        self, image: np.ndarray, found: Sequence[FaceFrame]
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Look at the upright crop of each frame.

        Returns:
            points [n, 478, 2] pixels, expected errors [n, 478] pixels, presence [n] 0..1
        """
        size = self.points.crop_size
        crops, matrices = zip(*(_crop(image, frame, size) for frame in found))
        shapes, log_errors, logits = self._run(self.points, np.stack(crops))
        shapes, errors = (shapes + 0.5) * size, np.exp(log_errors) * size
        for i, matrix in enumerate(matrices):
            inverse = frames.invert_affine(matrix)
            shapes[i] = frames.apply_affine(inverse, shapes[i])
            errors[i] *= np.sqrt(abs(np.linalg.det(inverse[:, :2])))
        return shapes, errors, 1 / (1 + np.exp(-logits))

    def closer(
        self, image: np.ndarray, points: np.ndarray, errors: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Closer looks at eyes and mouth; see `closeups.look_closer`."""
        return look_closer(image, points, errors)

    def _run(self, network, images):
        """Pictures [n, H, W, 3] uint8 through a network; a tuple of float32 arrays."""
        import torch

        from bakery.detectors.blocks import inference

        with inference():
            batch = torch.from_numpy(np.ascontiguousarray(images)).permute(0, 3, 1, 2)
            out = network(batch.float().mul_(1 / 255))
        return tuple(part.numpy() for part in (out if isinstance(out, tuple) else (out,)))

    def _landmarks(self, points, errors, score):
        eyes = face_size(points)
        confidence = np.exp(-errors / max(eyes, 1e-6) / self.options.full_confidence_error)
        low, high = points[:468].min(0), points[:468].max(0)
        return Landmarks(
            box=np.concatenate([low, high - low]).astype(np.float32),
            score=float(score),
            points=points.astype(np.float32),
            confidence=np.clip(confidence, 0, 1).astype(np.float32),
        )


def load(path: str | Path = WEIGHTS, options: NetworkOptions = NetworkOptions()) -> NetworkDetector:
    """The detector with weights from a file.

    Args:
        path: .safetensors as `bakery.train.detector.export` writes it.
        options: NetworkOptions

    Returns:
        NetworkDetector

    Raises:
        ModelError: the file is missing, damaged or of another network.
    """
    import torch
    from safetensors.torch import load_file

    from bakery.detectors.blocks import FinderNet, PointsNet

    try:
        tensors = load_file(path)
    except FileNotFoundError:
        raise ModelError(
            f"{path}: no such weights; reinstall bakery or train the detector"
        ) from None
    except Exception as error:
        if lacks_memory(error):
            raise
        raise ModelError(f"{path}: damaged weights ({error}); reinstall bakery") from None
    networks = []
    for name, kind in (("finder.", FinderNet), ("points.", PointsNet)):
        network = kind(folded=True)
        mine = {k.removeprefix(name): v.float() for k, v in tensors.items() if k.startswith(name)}
        try:
            network.load_state_dict(mine)
        except RuntimeError:
            raise ModelError(
                f"{path}: weights of another network; give a file that this version exported"
            ) from None
        networks.append(network.eval().to(memory_format=torch.channels_last))
    both = digest_file(path) + digest_file(closeups.WEIGHTS)
    return NetworkDetector(*networks, options, sha256=digest(both.encode()))


def level_sizes(shape: Sequence[int], options: NetworkOptions) -> list[tuple[int, int]]:
    """Columns and rows of the photo as the finder looks at it, coarsest first, each a third of the next.

    Args:
        shape: of the photo: rows, columns.
    """
    longest = max(shape[:2])
    side = min(max(longest / options.shrink, options.coarsest), options.finest)
    sizes = []
    while True:
        width, height = (max(round(n * side / longest), 8) for n in shape[1::-1])
        sizes.append((width, height))
        if side <= options.coarsest * 1.2:
            return sizes[::-1]
        side = max(side / 3, options.coarsest)


def level(image: np.ndarray, size: tuple[int, int]) -> tuple[np.ndarray, np.ndarray]:
    """The photo [H, W, 3] at a size of `level_sizes`, and its pixels a photo pixel [2], x and y."""
    if size[0] < image.shape[1]:
        picture, pixels = shrink(image, size)
        return picture, 1 / pixels
    larger = cv2.resize(image, size, interpolation=cv2.INTER_LINEAR)
    return larger, np.array(size) / image.shape[1::-1]


def _padded(level):
    """Grey on the right and below up to multiples of 16, as a batch of one."""
    height, width = level.shape[:2]
    below, right = -height % 16, -width % 16
    grey = (frames.PADDING,) * 3
    padded = cv2.copyMakeBorder(level, 0, below, 0, right, cv2.BORDER_CONSTANT, value=grey)
    return padded[None]


def _peaks(answer, scale, options):
    """Local maxima of the finder's answer [1, 6, G, G]: list of (score, FaceFrame)."""
    score = 1 / (1 + np.exp(-answer[0, 0]))
    highest = cv2.dilate(score, np.ones((3, 3), np.uint8))
    peaks = []
    for i, j in np.argwhere((score >= highest) & (score > options.finder_score)):
        dx, dy, log_size, cosine, sine = map(float, answer[0, 1:, i, j])
        center = np.array([(j + 0.5 + dx) * CELL / scale[0], (i + 0.5 + dy) * CELL / scale[1]])
        size = UNIT_SIZE * float(np.exp(np.clip(log_size, -3, 3))) / np.sqrt(scale[0] * scale[1])
        frame = frames.FaceFrame(center, size, float(np.arctan2(sine, cosine)))
        peaks.append((float(score[i, j]), frame))
    return peaks


def _repeats(frame, others, ratio=np.inf):
    """Whether a frame shows a face that one of the others, at most `ratio` larger or smaller, shows."""
    for other in others:
        larger, smaller = max(frame.size, other.size), min(frame.size, other.size)
        if larger <= ratio * smaller:
            if np.linalg.norm(frame.center - other.center) < 0.5 * larger:
                return True
    return False


def _crop(image, frame, size):
    """Upright crop [size, size, 3] of a frame and its matrix, photo pixels -> crop pixels."""
    matrix = frames.crop_matrix(frame, size)
    times = max(round(frame.size * frames.CROP_MARGIN / size), 1)
    if times == 1:
        return frames.take_crop(image, matrix, size), matrix
    corners = np.array([[0, 0], [size, 0], [0, size], [size, size]], float)
    corners = frames.apply_affine(frames.invert_affine(matrix), corners)
    height, width = image.shape[:2]
    x0, y0 = np.clip(corners.min(0).astype(int) - 2, 0, (width - 1, height - 1)).tolist()
    x1, y1 = np.clip(corners.max(0).astype(int) + 3, (x0 + 1, y0 + 1), (width, height)).tolist()
    # Whole pixels into one: three times as fast as other fractions.
    columns = max(min(-(-(x1 - x0) // times), (width - x0) // times), 1)
    rows = max(min(-(-(y1 - y0) // times), (height - y0) // times), 1)
    window = image[y0 : y0 + rows * times, x0 : x0 + columns * times]
    small = cv2.resize(window, (columns, rows), interpolation=cv2.INTER_AREA)
    from_small = matrix.copy()
    from_small[:, :2] = matrix[:, :2] * times
    from_small[:, 2] += matrix[:, :2] @ (x0, y0)
    return frames.take_crop(small, from_small, size), matrix
