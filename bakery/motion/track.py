"""A clip of a talking person to a take: points in every frame, one person, weights that do not shake.

    frames -> points (crop after crop, found anew when lost) -> identity (from some frames at once)
           -> pose and weights of each frame -> smoothing that keeps blinks

References:
    Thies et al., "Face2Face", CVPR 2016, section 4: one identity for the clip, then each frame alone.
    Tomasi and Manduchi, "Bilateral Filtering for Gray and Color Images", ICCV 1998: here over time.
"""

import logging
from dataclasses import dataclass, field

import numpy as np

from bakery.detectors import frames
from bakery.detectors.closeups import look_closer, seen_close
from bakery.errors import FitError, InputError
from bakery.formats.livelink import Take
from bakery.geometry import camera as cameras_of
from bakery.geometry import rotation
from bakery.heads.base import look
from bakery.landmarks import FACE, face_size
from bakery.stages.detect import SMALLEST_FACE
from bakery.stages.fit import EYE_CORNERS, NEAREST, FitOptions, landmark_model
from bakery.stages.fit import SMALLEST_FACE as SMALLEST_EYES
from bakery.stages.fit import expressions as groups
from bakery.stages.fit.gaze import fit_gaze
from bakery.stages.fit.landmarks import (
    Shape,
    Weights,
    contour_weights,
    fit_points,
    landmark_terms,
    prior_terms,
    start_camera,
)
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
class TrackOptions:
    """How a clip is followed and fitted."""

    presence: float = 0.5  # the points network's doubt below which the face is found anew
    hold: float = 0.04  # face sizes that the face may move in its crop before the crop follows
    identity_frames: int = 12  # of the clip, spread evenly, that say who this is
    identity_rounds: int = 6
    steps: int = 3  # Gauss-Newton steps of a frame, from the one before
    rest_frames: int = 60  # of the clip, spread evenly, that say how the person rests
    rest_rounds: int = 2
    rest: float = 0.05  # share of the frames in which a weight is taken for the person's own
    gaze_bias: float = 8.0  # degrees of the median gaze that are taken for the eyeballs' fault
    # With a known person, weights need less reluctance than in one photo (docs/log-drive.md).
    weights: Weights = field(
        default_factory=lambda: Weights(sparse=2.0, expression=16.0, identity=3.0)
    )
    # Trust in points that the close-ups do not see: forehead and contour, which the points network
    # places six times as far off.
    trust: float = 0.02
    near: float = 1.6  # frames, sigma of the smoothing in time
    alike: float = 0.06  # weight, sigma of the smoothing in value: blinks are far beyond it
    angle: float = 1.0  # degrees, the same for head and gaze
    doubt: float = 0.04  # face sizes of expected error above which the take says that it is unsure


@dataclass(frozen=True, eq=False)
class Followed:
    """The points of a clip of N frames."""

    seconds: np.ndarray  # [N]
    points: np.ndarray  # [N, L, 2] float32 pixels; nan where no face was found
    width: int
    height: int
    doubt: float = 0.0  # median error that the points network expects of itself, face sizes

    @property
    def found(self):
        """[N] bool."""
        return np.isfinite(self.points[:, 0, 0])


def follow(clip, detector, options=TrackOptions(), progress=None):
    """Points in every frame.

    Args:
        clip: iterable of (seconds, [H, W, 3] uint8), as `formats.video.Clip.frames` gives.
        detector: detectors.network.NetworkDetector.
        progress: called with the number of frames done.

    Raises:
        InputError: no face in any frame.
    """
    seconds, points, doubts, frame, size = [], [], [], None, (0, 0)
    blank = np.full((frames.POINTS, 2), np.nan, np.float32)
    for number, (now, picture) in enumerate(clip):
        size = picture.shape[:2]
        seen, frame, doubt = _look(picture, detector, frame, options)
        seconds.append(now)
        doubts.append(doubt)
        points.append(blank if seen is None else seen.astype(np.float32))
        if progress is not None:
            progress(number + 1)
    found = [doubt for doubt in doubts if doubt is not None]
    if not found:
        raise InputError(
            "no face found in any frame; give a clip of one face, upright and at least "
            f"{SMALLEST_FACE} pixels large"
        )
    return Followed(np.array(seconds), np.array(points), size[1], size[0], float(np.median(found)))


def _look(picture, detector, frame, options):
    """Points [L, 2] or None, the crop for the next frame or None, doubt in face sizes or None."""
    if frame is not None:
        shapes, errors, presence = detector.place(picture, [frame])
        if presence[0] < options.presence:
            frame = None
    if frame is None:
        faces = detector.detect(picture)
        if not faces:
            return None, None, None
        largest = max(faces, key=lambda face: face.box[2] * face.box[3])
        frame = frames.frame_of_points(largest.points)
        shapes, errors, _ = detector.place(picture, [frame])
    mended, _ = look_closer(picture, shapes[0], errors[0])
    seen = frames.frame_of_points(mended)
    moved = np.linalg.norm(seen.center - frame.center) / frame.size
    moved = max(moved, abs(np.log(seen.size / frame.size)), abs(seen.roll - frame.roll))
    # A crop that follows every tremor of its own answer would pass it on.
    after = seen if moved > options.hold else frame
    return mended, after, float(errors[0].mean() / face_size(shapes[0]))


class Person:
    """A fit_landmarks.LandmarkModel of one identity: only the expression is left to solve for."""

    modes = 0

    def __init__(self, model, identity, offsets=0.0):
        """
        Args:
            identity: [I].
            offsets: [468, 3] mm, where this person's landmarks lie besides.
        """
        moved = identity[: model.modes] @ model.identity
        self.mean = model.mean + moved.reshape(-1, 3) + offsets
        self.columns = np.ascontiguousarray(model.columns[:, :, model.modes :])
        self.expression = model.expression

    def points(self, shape):
        """Landmarks [468, 3] mm; see `LandmarkModel.points`."""
        return self.mean + (shape.expression @ self.expression).reshape(-1, 3)


def solve_identity(model, points, confidence, focal, width, height, options):
    """The one person who is in several frames.

    Each frame's pose and expression are eliminated from the step of the identity, so that what an
    open mouth explains is not taken for a long face.

    Args:
        points: [K, L, 2] pixels; confidence: [K, L].

    Returns:
        [I].
    """
    weights, first = options.weights, 6
    modes = slice(first, first + model.modes)
    total = model.modes + first
    shapes, cameras = [], []
    rest = Shape(np.zeros(len(model.identity)), np.zeros(len(EXPRESSIONS)))
    for seen, sure in zip(points, confidence):
        camera = start_camera(model, seen, sure, focal, width, height)
        camera, shape = fit_points(model, camera, rest, seen, sure, weights, 6, RIVALS)
        cameras.append(camera)
        shapes.append(shape)
    identity = np.mean([shape.identity for shape in shapes], 0)
    for _ in range(options.identity_rounds):
        person = Person(model, identity)
        hessian = weights.prior * weights.identity * np.eye(model.modes)
        gradient = hessian @ identity[: model.modes]
        for k, (seen, sure) in enumerate(zip(points, confidence)):
            alone = Shape(np.zeros(0), shapes[k].expression)
            cameras[k], alone = fit_points(
                person, cameras[k], alone, seen, sure, weights, 4, RIVALS
            )
            shapes[k] = Shape(identity, alone.expression)
            seen, sure = seen[:FACE], sure[:FACE]
            root = contour_weights(seen, weights) * np.sqrt(sure)[:, None, None]
            size = float(face_size(seen))
            g, h, _ = landmark_terms(model, cameras[k], shapes[k], seen, root, size, weights)
            prior_g, prior_h, _ = prior_terms(model, shapes[k], weights)
            g[total:] += prior_g[total:]
            h[total:, total:] += prior_h[total:, total:]
            active = np.flatnonzero(shapes[k].expression[groups.FITTED] > 1e-6)
            free = np.concatenate([np.arange(first), total + active])
            across = h[np.ix_(free, np.arange(first, total))]
            solved = np.linalg.solve(h[np.ix_(free, free)], np.column_stack([across, g[free]]))
            hessian += (h[modes, modes] - across.T @ solved[:, :-1]) / len(points)
            gradient += (g[modes] - across.T @ solved[:, -1]) / len(points)
        identity = identity.copy()
        identity[: model.modes] -= np.linalg.solve(hessian, gradient)
    return identity


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
        inside = cameras_of.to_camera(person.points(Shape(np.zeros(0), row)), camera)
        miss = seen[:FACE] - cameras_of.project_camera(inside, camera)
        moved = np.zeros_like(inside)
        moved[:, :2] = miss * (-inside[:, 2:] / camera.focal) * [1, -1]
        left.append(moved @ rotation.matrix(camera.rotation))
    return np.median(left, 0) + (least @ model.expression).reshape(-1, 3)


def track(followed, head, options=TrackOptions(), progress=None):
    """The take that a clip's points tell.

    Frames without a face lie between their neighbours; the take's notes count them.

    Args:
        followed: Followed.
        head: HeadModel.
        progress: called with the number of frames done.

    Returns:
        formats.livelink.Take.

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
    identity = solve_identity(model, points[some], confidence[some], *size, options)
    neutral, offsets = head.neutral(identity), 0.0
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
    gaze = gaze - np.clip(np.median(gaze, 0), -options.gaze_bias, options.gaze_bias)
    turns = np.array([rotation.angles_of(rotation.matrix(camera.rotation)) for camera in cameras])
    times = followed.seconds[found]
    weights = steady(weights, options.near, options.alike)
    gaze = steady(gaze, options.near, options.angle)
    turns = steady(turns, options.near, options.angle)
    weights = np.array([look(row, where) for row, where in zip(weights, gaze)])

    def everywhere(values):
        return np.stack([np.interp(followed.seconds, times, column) for column in values.T], 1)

    gaze = everywhere(gaze)
    lost = len(followed.seconds) - len(found)
    notes = (f"{lost} frames without a face interpolated",) if lost else ()
    if followed.doubt > options.doubt:
        notes += (
            f"the face is hard to see (points unsure by {followed.doubt:.0%} of its size, limit "
            f"{options.doubt:.0%}); a brighter, sharper, larger picture of it is followed better",
        )
    return Take(
        seconds=followed.seconds - followed.seconds[0],
        weights=np.clip(everywhere(weights), 0, 1).astype(np.float32),
        head=everywhere(turns),
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
