"""Where a person's upper teeth stand, by the photos that show them.

Teeth are fixed to the skull, and lips tell little about them: the head's own stand 1.3 mm (sd) too high
or too low, and half of a tooth aside. A photo of a smile shows their edges. So the mouth is drawn with
teeth moved and scaled, in plain colours and the shade of the lips, and compared with the photo between the
lips. Light and colour of teeth are not known here: a correlation asks for neither.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from types import SimpleNamespace

import cv2
import numpy as np

from bakery.generators.channels import depth_code
from bakery.generators.interior import interior_shade
from bakery.generators.shade import is_part
from bakery.geometry import camera as cameras
from bakery.geometry.color import LUMA, to_linear
from bakery.heads.base import MOUTH, PARTS, HeadModel
from bakery.heads.mouth import around_mouth
from bakery.landmarks import LIPS_INNER, open_mouth
from bakery.stages.condition import condition
from bakery.stages.face_frame import cut
from bakery.stages.segment.frame import draw_polygon
from bakery.types import Camera, Fit, Photo

TEETH = ("teeth_upper", "gums_upper")
# Luminance of a mouth's parts in the same light; between lips that gape, skin.
TONES = {
    "teeth_upper": 0.55, "teeth_lower": 0.50, "gums_upper": 0.28, "gums_lower": 0.28, "tongue": 0.20,
    "mouth_cavity": 0.10, "skin": 0.30,
}  # fmt: skip
SIDE = 96  # pixels of the drawn mouth a side
AROUND = 1.3  # times the inner lips' extent
REACH = 45.0  # mm around the lips: as far as a smile's lips hide teeth
SOFT = 1.0  # pixels: gaps that miss each other by less still count
PLAIN = 1e-4  # deviation of luminance, below which there is nothing to compare
PIXELS = 60  # between the lips, at least
# Luminance of the brightest tenth between the lips over what is around them: less is no teeth. 47 of 48
# people of congress/train have 0.95 to 3.6.
LIGHT = 0.7
# Aside and up in mm, and size: standard deviations, of 48 people of congress/train, and limits.
SPREAD = np.array([1.0, 1.5, 0.05])
MOST = np.array([2.5, 4.0, 0.08])
COST = 0.01  # correlation that one standard deviation has to earn
CLEAR = 0.5  # correlation from which a mouth is believed to show teeth; most have 0.7 to 0.86
# Aside, up and size: what is tried around the best so far, round by round. The first one tries every
# place: a row of teeth looks like itself a tooth farther.
_SIZES = [(0, 0, size) for size in (-0.06, -0.03, 0.03, 0.06)]
_HALVES = [(0, -0.5, 0), (0, 0.5, 0), (-0.5, 0, 0), (0.5, 0, 0)]
ROUNDS = (
    [(x, y, 0) for x in (-2, -1, 0, 1, 2) for y in (-4, -3, -2, -1, 0, 1, 2, 3)],
    *(_SIZES, _HALVES) * 2,
)


def teeth_offsets(head: HeadModel, shape: np.ndarray, teeth: np.ndarray) -> np.ndarray:
    """How upper teeth and gums move: [V, 3] mm, 0 elsewhere.

    Args:
        shape: [V, 3] mm, a neutral shape.
        teeth: [3] `Fit.teeth`; they grow around the incisors.
    """
    out = np.zeros_like(shape)
    used = head.part_vertices(*TEETH)
    if len(used):
        own = shape[used]
        pivot = np.array([own[:, 0].mean(), own[:, 1].mean(), own[:, 2].max()])
        out[used] = (own - pivot) * teeth[2] + [teeth[0], teeth[1], 0]
    return out


@dataclass(frozen=True, eq=False)
class ShownMouth:
    """A mouth as a photo shows it."""

    head: HeadModel  # the piece around the mouth
    neutral: np.ndarray  # [v, 3] mm, of the piece
    fit: Fit
    camera: Camera  # of a picture of SIDE pixels
    luminance: np.ndarray  # [SIDE, SIDE] square root of the photo's
    inside: np.ndarray  # [SIDE, SIDE] bool, between the lips

    def draw(self, teeth: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Luminance [SIDE, SIDE] in plain colours, and parts, with teeth [3] as `Fit.teeth`."""
        moved = self.neutral + teeth_offsets(self.head, self.neutral, np.asarray(teeth, float))
        fit, blank = self.fit, np.zeros((8, 8, 3), np.float32)
        seen = condition(
            self.head, moved, blank, fit.expression, fit.gaze, self.camera, ("skin", *MOUTH)
        )
        channels = SimpleNamespace(
            part=seen.part, normals=127 * seen.normals, depth=depth_code(seen)
        )
        shade = interior_shade(channels, cameras.pixels_per_mm(self.camera))
        return _TONE[seen.part] * shade, seen.part

    def likeness(self, teeth: np.ndarray) -> float:
        """Correlation of the drawn mouth and the photo between the lips, -1..1; 0 if one is plain."""
        drawn = cv2.GaussianBlur(np.sqrt(self.draw(teeth)[0]), (0, 0), SOFT)
        drawn, seen = drawn[self.inside], self.luminance[self.inside]
        if min(drawn.std(), seen.std()) < PLAIN:
            return 0.0
        return float(np.corrcoef(drawn, seen)[0, 1])


_TONE = np.zeros(256, np.float32)  # by the code of a part
_TONE[[PARTS.index(name) for name in TONES]] = list(TONES.values())


def shown_mouth(
    head: HeadModel, neutral: np.ndarray, fit: Fit, photo: Photo, points: np.ndarray
) -> ShownMouth | None:
    """The mouth of a photo; None where lips are closed, or the head has no teeth.

    Args:
        neutral: [V, 3] mm, `bake.fitting.fitted_neutral` of the fit.
        points: [L, 2] pixels.
    """
    if not len(head.part_faces("teeth_upper")) or not open_mouth(points):
        return None
    ring = points[LIPS_INNER]
    low, high = ring.min(0), ring.max(0)
    side = AROUND * float((high - low).max())
    corner, scale = (low + high) / 2 - side / 2, SIDE / side
    # What is cut is blurred first: only what is around the mouth.
    height, width = photo.encoded.shape[:2]
    first = np.clip(np.floor(corner - side / 4).astype(int), 0, [width - 1, height - 1])
    last = np.clip(np.ceil(corner + 1.25 * side).astype(int), first + 1, [width, height])
    picture = photo.encoded[first[1] : last[1], first[0] : last[0]]
    picture = cut(picture, np.column_stack([np.eye(2) * scale, (first - corner) * scale]), SIDE)
    lips = np.zeros((SIDE, SIDE), np.uint8)
    draw_polygon(lips, (ring - corner) * scale, 1)
    piece = around_mouth(head, neutral, REACH)
    luminance = np.sqrt(np.maximum(to_linear(np.clip(picture, 0, 1)) @ LUMA, 0))
    camera = cameras.crop(fit.camera, corner[0], corner[1], SIDE, SIDE, scale)
    mouth = ShownMouth(piece, neutral[piece.whole_vertices], fit, camera, luminance, lips > 0)
    inside = mouth.inside & is_part(mouth.draw(np.zeros(3))[1], *MOUTH)
    if inside.sum() < PIXELS:
        return None
    outside = cv2.dilate(lips, np.ones((9, 9), np.uint8)) == 0
    if np.quantile(luminance[inside], 0.9) ** 2 < LIGHT * np.median(luminance[outside]) ** 2:
        return None
    return replace(mouth, inside=inside)


def place_teeth(mouths: Sequence[ShownMouth]) -> np.ndarray:
    """Where one person's upper teeth stand (`Fit.teeth`) [3]; zeros where no photo tells."""
    if not mouths:
        return np.zeros(3)

    def worth(teeth: np.ndarray) -> float:
        likeness = np.mean([mouth.likeness(teeth) for mouth in mouths])
        return float(likeness - COST * ((teeth / SPREAD) ** 2).sum())

    found = _climb(worth)
    likeness = np.mean([mouth.likeness(found) for mouth in mouths])
    return found if likeness >= CLEAR else np.zeros(3)


def _climb(worth: Callable[[np.ndarray], float]) -> np.ndarray:
    """The best [3] of what ROUNDS try."""
    best, most = np.zeros(3), worth(np.zeros(3))
    for steps in ROUNDS:
        for tried in np.clip(best + np.array(steps), -MOST, MOST):
            if (value := worth(tried)) > most:
                best, most = tried, value
    return best
