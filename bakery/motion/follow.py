"""A clip to points in every frame: crop after crop, and looked for around its last place when lost."""

from dataclasses import dataclass, field, replace

import numpy as np

from bakery.detectors import frames
from bakery.detectors.frames import FaceFrame
from bakery.detectors.placing import placing
from bakery.errors import InputError
from bakery.landmarks import face_size
from bakery.settings import Settings, setting
from bakery.stages.detect import SMALLEST_FACE

LOOKS = 4  # at most at one place of a frame; the crop moves onto what each of them saw
WIDER = (
    1.0,
    1.3,
    1.6,
)  # crops that are tried, over the one before; the points network sees no wider
LOST = 2.0  # times the doubt above which a face is lost that is found nowhere else either
TAILS = (1, 99)  # percentiles of a window that become black and white
SMALLEST_WINDOW = 16  # pixels a side


@dataclass(frozen=True)
class FollowOptions(Settings):
    """How the face of a clip is followed."""

    presence: float = setting(
        0.5, "how sure the points network must be to keep a face; below, it is looked for", 0, 1
    )
    hold: float = setting(
        0.04, "how far the face may move in its crop before the crop follows", 0, 1,
        unit="face sizes",
    )  # fmt: skip
    # Faces in the dark, in noise and half covered have up to 0.07, folds of cloth that the network
    # takes for one 0.13 and more.
    unsure: float = setting(
        0.08, "expected error of the points above which it is looked for; above twice that it is lost",
        0, 10, unit="outer-eye-corner distances",
    )  # fmt: skip
    # Half a face beside its crop, a face is seen with a presence of 1 and points a quarter of it off.
    jump: float = setting(
        0.15, "how far it may move before the frame is looked at again", 0, 1, unit="face sizes"
    )
    around: float = setting(
        3.0, "side of the window around the last place in which faces are detected", 1, 20,
        unit="face sizes",
    )  # fmt: skip
    reach: float = setting(
        2.0, "how far from its last place a face found again may lie", 0.1, 20, unit="face sizes"
    )
    sizes: float = setting(2.0, "times larger or smaller that it may be", 1, 10)
    bridge: int = setting(
        8, "frames in a row without the face that lie between their neighbours; in longer gaps the "
        "face rests, and whoever is the largest is followed afterwards", 0, 1000, unit="frames",
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class Followed:
    """The points of a clip of N frames."""

    seconds: np.ndarray  # [N]
    points: np.ndarray  # [N, L, 2] float32 pixels; nan where no face was found
    width: int
    height: int
    # [N] error that the points network expects, outer-eye-corner distances; nan where no face was
    doubts: np.ndarray = field(default_factory=lambda: np.zeros(0))

    @property
    def doubt(self) -> float:
        """Median of `doubts`; 0 if they are not known."""
        known = self.doubts[np.isfinite(self.doubts)]
        return float(np.median(known)) if len(known) else 0.0

    @property
    def found(self) -> np.ndarray:
        """[N] bool."""
        return np.isfinite(self.points[:, 0, 0])


@dataclass(frozen=True, eq=False)
class Seen:
    """A face in one frame."""

    points: np.ndarray  # [L, 2] pixels
    errors: np.ndarray  # [L] pixels, expected
    presence: float  # 0..1
    crop: FaceFrame  # where it was looked for

    @property
    def doubt(self) -> float:
        """Mean expected error, outer-eye-corner distances."""
        return float(self.errors.mean() / face_size(self.points))

    @property
    def frame(self) -> FaceFrame:
        """Where it is."""
        return frames.frame_of_points(self.points)


def largest(faces):
    """The largest of the Landmarks that a frame shows."""
    return max(faces, key=lambda face: face.box[2] * face.box[3])


def follow(clip, detector, options=FollowOptions(), progress=None, choose=largest):
    """Points in every frame.

    Args:
        clip: iterable of (seconds, [H, W, 3] uint8), as `formats.video.Clip.frames` gives.
        detector: any detectors.base.Detector; one that is no PlacingDetector finds faces anew each time.
        progress: called with the number of frames done.
        choose: which of the Landmarks of the first frame with a face is followed; may raise.

    Raises:
        InputError: no face in any frame.
    """
    detector = placing(detector)
    seconds, points, doubts, last, lost, size = [], [], [], None, 0, (0, 0)
    known = False
    blank = np.full((frames.POINTS, 2), np.nan, np.float32)
    for number, (now, picture) in enumerate(clip):
        size = picture.shape[:2]
        seen = _look(picture, detector, last, options, largest if known else choose)
        seconds.append(now)
        doubts.append(np.nan if seen is None else seen.doubt)
        if seen is None:
            points.append(blank)
            lost += 1
            if lost > options.bridge:
                last = None
        else:
            mended, _ = detector.closer(picture, seen.points, seen.errors)
            points.append(mended.astype(np.float32))
            known = True
            after = frames.frame_of_points(mended)
            # A crop that follows every tremor of its own answer would pass it on.
            last = after if moved(seen.crop, after) > options.hold else seen.crop
            lost = 0
        if progress is not None:
            progress(number + 1)
    if not known:
        raise InputError(
            "no face found in any frame; give a clip of one face, upright and at least "
            f"{SMALLEST_FACE} pixels large"
        )
    return Followed(np.array(seconds), np.array(points), size[1], size[0], np.array(doubts))


def _look(picture, detector, last, options, choose):
    """The face in one frame: in its last crop, in wider ones, in a window around it, anywhere near.

    Args:
        picture: [H, W, 3] uint8.
        last: FaceFrame of the frames before; None takes the face that `choose` says.

    Returns:
        Seen, or None if the face is not there.
    """
    if last is None:
        faces = detector.detect(picture)
        if not faces:
            return None
        crop = frames.frame_of_points(choose(faces).points)
        return _settle(picture, detector, _see(picture, detector, crop), options)
    held = _see(picture, detector, last)
    for wider in WIDER:
        seen = (
            held if wider == 1 else _see(picture, detector, replace(last, size=wider * last.size))
        )
        seen = _settle(picture, detector, seen, options)
        if _present(seen, options) and _same(seen.frame, last, options):
            return seen
    for search in (_around, _anywhere):
        found = [frame for frame in search(picture, detector, last, options)
                 if _same(frame, last, options)]  # fmt: skip
        if found:
            nearest = min(found, key=lambda frame: np.linalg.norm(frame.center - last.center))
            return _settle(picture, detector, _see(picture, detector, nearest), options)
    return held if _present(held, options, LOST) else None


def _present(seen, options, times=1.0):
    """Whether the points network sees a face, and knows where, with `times` the usual doubt."""
    return seen.presence >= options.presence and seen.doubt <= times * options.unsure


def _see(picture, detector, crop):
    """Seen of one look."""
    (points,), (errors,), (presence,) = detector.place(picture, [crop])
    return Seen(points, errors, float(presence), crop)


def _settle(picture, detector, seen, options):
    """Seen after more looks, until the crop stands on the face."""
    for _ in range(LOOKS - 1):
        if moved(seen.crop, seen.frame) <= options.jump:
            break
        seen = _see(picture, detector, seen.frame)
    return seen


def moved(before, after):
    """How far one FaceFrame lies from another, sizes of the first; growth and turns count alike."""
    shift = np.linalg.norm(after.center - before.center) / before.size
    turn = abs(np.angle(np.exp(1j * (after.roll - before.roll))))
    return max(shift, abs(np.log(after.size / before.size)), turn)


def _same(frame, last, options):
    """Whether a FaceFrame can be the face that was at `last`."""
    near = np.linalg.norm(frame.center - last.center) <= options.reach * last.size
    return near and last.size / options.sizes <= frame.size <= last.size * options.sizes


def _around(picture, detector, last, options):
    """FaceFrames that are detected in a window around the last place: in it a face is large."""
    half = options.around / 2 * last.size
    size = np.array(picture.shape[1::-1])
    low = np.clip(np.floor(last.center - half).astype(int), 0, size)
    high = np.clip(np.ceil(last.center + half).astype(int), 0, size)
    if (high - low).min() < SMALLEST_WINDOW:
        return []
    window = np.ascontiguousarray(picture[low[1] : high[1], low[0] : high[0]])
    # The finder is blind in the dark, where the points network still sees.
    found = detector.detect(window) or detector.detect(_stretched(window))
    return [frames.frame_of_points(face.points + low) for face in found]


def _stretched(picture):
    """A picture [H, W, 3] uint8 with the contrast that 8 bits have."""
    low, high = np.percentile(picture, TAILS)
    scale = 255 / max(high - low, 1.0)
    return np.clip((picture - low) * scale, 0, 255).astype(np.uint8)


def _anywhere(picture, detector, last, options):
    return [frames.frame_of_points(face.points) for face in detector.detect(picture)]
