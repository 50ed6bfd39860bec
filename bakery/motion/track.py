"""The points of a clip to a take: one person, weights that do not shake.

    points of each frame (`follow`) -> identity (from some frames at once)
           -> pose and weights of each frame -> smoothing that keeps blinks

References:
    Thies et al., "Face2Face", CVPR 2016, section 4: one identity for the clip, then each frame alone.
    Tomasi and Manduchi, "Bilateral Filtering for Gray and Color Images", ICCV 1998: here over time.
"""

import logging
from dataclasses import dataclass, field

import numpy as np

from bakery.detectors import frames
from bakery.detectors.closeups import seen_close
from bakery.errors import FitError
from bakery.formats.livelink import Take
from bakery.geometry import rotation
from bakery.heads.base import look
from bakery.landmarks import FACE, face_size
from bakery.motion.fits import ClipFit
from bakery.motion.follow import FollowOptions
from bakery.motion.gaps import filled, told
from bakery.settings import Settings, setting
from bakery.stages.fit import EYE_CORNERS, NEAREST, FitOptions, landmark_model
from bakery.stages.fit import SMALLEST_FACE as SMALLEST_EYES
from bakery.stages.fit import expressions as groups
from bakery.stages.fit.gaze import fit_gaze
from bakery.stages.fit.landmarks import (
    Shape,
    Weights,
    fit_points,
    start_camera,
)
from bakery.stages.fit.lips import seam_offsets
from bakery.stages.fit.person import Person, Shot, misses, solve_identity
from bakery.types import EXPRESSION_INDEX, EXPRESSIONS

log = logging.getLogger(__name__)
MODEL = FitOptions()
# What a face cannot do at once. Portraits know more rivals, which stand for what is unlikely in one
# picture; takes of trained people do most of it: 0.063 became 0.060 on a range of motion.
_RIVALS = (
    ("jawLeft", "jawRight"),
    ("mouthLeft", "mouthRight"),
    ("eyeWideLeft", "eyeBlinkLeft"),
    ("eyeWideRight", "eyeBlinkRight"),
)
_PLACE = {int(index): place for place, index in enumerate(groups.FITTED)}
RIVALS = [tuple(_PLACE[EXPRESSION_INDEX[name]] for name in pair) for pair in _RIVALS]


@dataclass(frozen=True)
class TrackOptions(Settings):
    """How a clip is followed and fitted."""

    follow: FollowOptions = field(default_factory=FollowOptions)
    identity_frames: int = setting(12, "of the clip, spread evenly, that say who this is", 1, 1000)
    identity_rounds: int = setting(6, "Gauss-Newton steps of the identity", 0, 100)
    steps: int = setting(3, "Gauss-Newton steps of a frame, from the one before", 1, 100)
    rest_frames: int = setting(
        60, "of the clip, spread evenly, that say how the person rests", 1, 10000
    )
    rest_rounds: int = setting(2, "rounds in which that is found", 0, 100)
    rest: float = setting(
        0.05, "share of the frames in which a weight is taken for the person's own", 0, 1
    )
    gaze_bias: float = setting(
        8.0, "of the median gaze at most that is taken for the eyeballs' fault", 0, 90,
        unit="degrees",
    )  # fmt: skip
    # With a known person, weights need less reluctance than in one photo (docs/log-drive.md).
    weights: Weights = field(
        default_factory=lambda: Weights(sparse=2.0, expression=16.0, identity=3.0)
    )
    # The points network places forehead and contour six times as far off.
    trust: float = setting(0.02, "in points that the close-ups do not see", 1e-6, 1)
    near: float = setting(1.6, "sigma of the smoothing in time", 0, 100, unit="frames")
    # Blinks are far beyond it.
    alike: float = setting(0.06, "sigma of the smoothing in value, of weights", 1e-6, 10)
    angle: float = setting(1.0, "the same for head and gaze", 1e-6, 90, unit="degrees")
    doubt: float = setting(
        0.04, "expected error above which the take says that it is unsure", 0, 10,
        unit="outer-eye-corner distances",
    )  # fmt: skip


def trust_of(options):
    """How far each point is believed: [L] 0..1."""
    trust = np.full(frames.POINTS, options.trust)
    trust[FACE:] = trust[seen_close()] = 1
    return trust


def solve_frames(person, head, neutral, points, confidence, size, options, progress=None):
    """Pose and weights of frames, each warm from the one before.

    Args:
        person: Person; neutral: [V, 3] mm, its whole shape, for the eyes.
        points: [N, L, 2] pixels; confidence: [N, L].
        size: (focal, width, height) pixels.

    Returns:
        weights [N, E], gaze [N, 2] degrees, list of N Cameras.
    """
    shape = Shape(np.zeros(0), np.zeros(len(EXPRESSIONS)))
    camera = start_camera(person, points[0], confidence[0], *size)
    weights, gazes, cameras = [], [], []
    for number, (seen, sure) in enumerate(zip(points, confidence)):
        steps = options.steps if number else 4 * options.steps
        camera, shape = fit_points(
            person, camera, shape, seen, sure, options.weights, steps, RIVALS
        )
        gaze = fit_gaze(head, neutral, camera, seen, sure, shape.expression)
        shape = Shape(shape.identity, look(shape.expression, gaze).astype(np.float64))
        weights.append(shape.expression)
        gazes.append(gaze)
        cameras.append(camera)
        if progress is not None:
            progress(number + 1)
    return np.array(weights), np.array(gazes), cameras


def solve_rest(model, person, weights, cameras, points, options):
    """What of the frames belongs to the person and not to the moment: [468, 3] mm.

    Every weight is at rest at some time of a clip, so what it never falls below is how this person
    is made; and so is what all frames leave at a landmark.

    Args:
        weights: [N, E], cameras, points: as from `solve_frames`, of some frames.
    """
    least = np.quantile(weights, options.rest, axis=0)
    least[[EXPRESSIONS.index(name) for name in EXPRESSIONS if name.startswith("eyeLook")]] = 0
    left = []
    for row, camera, seen in zip(weights, cameras, points):
        places = person.points(Shape(np.zeros(0), row)) + seam_offsets(model.rest, seen)
        left.append(misses(places, seen[:FACE], camera)[0])
    return np.median(left, 0) + (least @ model.expression).reshape(-1, 3)


def track(followed, head, options=TrackOptions(), progress=None):
    """The take that a clip's points tell: `take_of` what `solve` finds.

    Returns:
        formats.livelink.Take.
    """
    return take_of(solve(followed, head, options, progress), options, followed.doubt)


def solve(followed, head, options=TrackOptions(), progress=None):
    """The person of a clip, and where the head is and what it does in each frame.

    Args:
        followed: follow.Followed.
        head: HeadModel.
        progress: called with the number of frames done.

    Returns:
        fits.ClipFit.

    Raises:
        FitError: the face is too small or fits no head.
    """
    found = np.flatnonzero(followed.found)
    points = followed.points[found].astype(np.float64)
    apart = float(np.median(face_size(points)))
    if apart < SMALLEST_EYES:
        raise FitError(
            f"the outer eye corners are {apart:.0f} pixels apart, at least {SMALLEST_EYES:.0f} are "
            "needed; use a larger picture of the face"
        )
    width, height = followed.width, followed.height
    focal = max(MODEL.focal * max(width, height), NEAREST / EYE_CORNERS * apart)
    size = (focal, width, height)
    model = landmark_model(head, MODEL.modes)
    confidence = np.tile(trust_of(options), (len(found), 1))
    some = _spread(len(found), options.identity_frames)
    shots = [Shot(seen, sure, *size) for seen, sure in zip(points[some], confidence[some])]
    identity = solve_identity(model, shots, options.weights, options.identity_rounds, RIVALS)
    neutral, offsets = head.neutral(identity), np.zeros((FACE, 3))
    some = _spread(len(found), options.rest_frames)
    for _ in range(options.rest_rounds):
        person = Person(model, identity, offsets)
        weights, gaze, cameras = solve_frames(
            person, head, neutral, points[some], confidence[some], size, options
        )
        offsets = offsets + solve_rest(model, person, weights, cameras, points[some], options)
    person = Person(model, identity, offsets)
    weights, gaze, cameras = solve_frames(
        person, head, neutral, points, confidence, size, options, progress
    )

    def everywhere(values, rests):
        return filled(
            np.array(values), followed.found, followed.seconds, options.follow.bridge, rests
        )

    return ClipFit(
        head=head.name,
        head_sha256=head.digest,
        identity=identity,
        residual=offsets,
        focal=focal,
        center=np.asarray(cameras[0].center),
        size=np.array([width, height]),
        seconds=followed.seconds,
        found=followed.found,
        rotation=everywhere([camera.rotation for camera in cameras], rests=False),
        translation=everywhere([camera.translation for camera in cameras], rests=False),
        expression=np.clip(everywhere(weights, rests=True), 0, 1),
        gaze=everywhere(gaze, rests=True),
    )


def take_of(fits, options=TrackOptions(), doubt=0.0):
    """The take of a clip's fits: smoothed over time, the eyes' own fault taken off.

    Frames without a face are filled, see `gaps`; the take's notes count them.

    Args:
        fits: fits.ClipFit.
        doubt: of the points, see `follow.Followed`.

    Returns:
        formats.livelink.Take.
    """
    found, seconds, bridge = fits.found, fits.seconds, options.follow.bridge
    gaze, weights = fits.gaze[found], steady(fits.expression[found], options.near, options.alike)
    gaze = gaze - np.clip(np.median(gaze, 0), -options.gaze_bias, options.gaze_bias)
    turns = [rotation.angles_of(rotation.matrix(turn)) for turn in fits.rotation[found]]
    turns = steady(np.array(turns), options.near, options.angle)
    gaze = steady(gaze, options.near, options.angle)
    weights = np.array([look(row, where) for row, where in zip(weights, gaze)])
    gaze = filled(gaze, found, seconds, bridge)
    notes = told(found, seconds, bridge)
    if doubt > options.doubt:
        notes += (
            f"the face is hard to see (points unsure by {doubt:.0%} of its size, limit "
            f"{options.doubt:.0%}); a brighter, sharper, larger picture of it is followed better",
        )
    return Take(
        seconds=seconds - seconds[0],
        weights=np.clip(filled(weights, found, seconds, bridge), 0, 1).astype(np.float32),
        head=filled(turns, found, seconds, bridge, rests=False),
        eyes=np.stack([gaze, gaze], 1),
        notes=notes,
    )


def _spread(count, most):
    return np.unique(np.linspace(0, count - 1, most).astype(int))


def steady(values, near, alike):
    """Smooth over time where values hardly change: a bilateral filter of each column.

    Args:
        values: [N, C].
        near: frames, sigma in time.
        alike: sigma in value.

    Returns:
        [N, C].
    """
    if near <= 0:
        return values
    reach = int(np.ceil(3 * near))
    total, mass = np.zeros_like(values), np.zeros_like(values)
    padded = np.pad(values, ((reach, reach), (0, 0)), mode="edge")
    for offset in range(-reach, reach + 1):
        there = padded[reach + offset : reach + offset + len(values)]
        weight = np.exp(-0.5 * (offset / near) ** 2 - 0.5 * ((there - values) / alike) ** 2)
        total += weight * there
        mass += weight
    return total / mass
