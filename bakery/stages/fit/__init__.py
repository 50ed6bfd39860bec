"""Photo and landmarks to a fitted head: camera, identity, expression, light, albedo, warp."""

import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from bakery import landmarks as marks
from bakery.errors import FitError, UsageProblem
from bakery.geometry import camera as cameras
from bakery.geometry import harmonics
from bakery.heads.base import HeadModel, look
from bakery.memo import once_per_object
from bakery.settings import Settings, setting
from bakery.stages.fit import sideways
from bakery.stages.fit.albedo import load_albedo
from bakery.stages.fit.diagnostics import diagnose, head_angles
from bakery.stages.fit.gaze import fit_gaze
from bakery.stages.fit.landmarks import LandmarkModel, Shape, Weights, fit_points
from bakery.stages.fit.lips import seam_offsets
from bakery.stages.fit.person import Person, Shot, misses, shared_moves, solve_identity
from bakery.stages.fit.photometric import fit_photo
from bakery.stages.fit.samples import choose_samples
from bakery.stages.fit.warp import residual_offsets, unfolded_residual, warp_weights
from bakery.types import EXPRESSIONS, Fit, Landmarks, Photo

FILM_DIAGONAL = 43.27  # mm, of the 35 mm frame that EXIF focal lengths refer to
NEAREST = 500.0  # mm, a portrait is seldom taken from closer; a tight crop would look so
EYE_CORNERS = 90.0  # mm, distance of the outer eye corners of an adult, nearly
LEVELS = (1, 6)  # of the photometric fit, least and most
SMALLEST_FACE = 24.0  # pixels between the outer eye corners; less cannot be fitted


@dataclass(frozen=True)
class FitOptions(Settings):
    """How to fit (Saito sec. 3)."""

    weights: Weights = field(default_factory=Weights)
    modes: int = setting(80, "identity modes used, as far as the head has them", 1, 1000)
    focal: float = setting(
        1.8, "focal length of a photo without EXIF, over its longer side", 0.3, 20
    )
    landmark_steps: int = setting(8, "Gauss-Newton steps of the landmark-only stage", 1, 200)
    photometric: bool = setting(True, "fit colours too, not landmarks alone")
    level_widths: tuple[float, ...] = setting(
        (24.0, 48.0, 96.0), "distance of the outer eye corners at each level of the photometric fit",
        8, 512, unit="pixels", count=LEVELS,
    )  # fmt: skip
    level_steps: tuple[int, ...] = setting(
        (30, 10, 3), "Gauss-Newton steps of each level, at most", 1, 200, count=LEVELS
    )
    level_samples: tuple[int, ...] = setting(
        (500, 900, 1500), "sample faces of each level", 50, 20000, count=LEVELS
    )
    level_tolerance: float = setting(
        1e-3, "a level ends when a step saves less than this share of the energy", 0, 1
    )
    warp: bool = setting(True, "end with the smooth warp onto the landmarks")
    outline: bool = setting(
        True, "fit ears, skull and neck to what the photo shows around the face"
    )
    teeth: bool = setting(True, "place the upper teeth where the photo shows them")

    def __post_init__(self) -> None:
        super().__post_init__()
        levels = {len(self.level_widths), len(self.level_steps), len(self.level_samples)}
        if len(levels) > 1:
            raise UsageProblem("level_widths, level_steps and level_samples: give as many of each")


@dataclass(frozen=True, eq=False)
class Face:
    """One photo of a person."""

    photo: Photo
    landmarks: Landmarks
    skin: np.ndarray | None = None  # [H, W] 0..1, how surely each pixel is bare skin
    labels: np.ndarray | None = None  # [H, W] uint8 into segment.LABELS; None: not known


@once_per_object
def landmark_model(head, modes):
    """The head's LandmarkModel of so many modes."""
    return LandmarkModel(head, modes)


def prepare(head: HeadModel, options: FitOptions = FitOptions()) -> None:
    """Build what every fit of this head shares, so that the first is as fast as the next."""
    landmark_model(head, options.modes)
    warp_weights(head)
    if options.photometric:
        basis = load_albedo()
        for count in options.level_samples:
            choose_samples(head, landmark_model(head, options.modes).modes, basis, count)


def focal_length(photo: Photo, size: float, options: FitOptions) -> tuple[float, str]:
    """Focal length in pixels, and where it comes from: "exif" or "default".

    Landmarks alone cannot tell it: their error is flat from 1.3 to 6 image widths. The default
    keeps the camera at least NEAREST away, however tightly the photo was cut.

    Args:
        size: pixels between the outer eye corners.
    """
    height, width = photo.encoded.shape[:2]
    if photo.focal_35mm:
        return photo.focal_35mm / FILM_DIAGONAL * float(np.hypot(width, height)), "exif"
    return max(options.focal * max(width, height), NEAREST / EYE_CORNERS * size), "default"


def fit(
    photo: Photo,
    landmarks: Landmarks,
    head: HeadModel,
    options: FitOptions = FitOptions(),
    skin: np.ndarray | None = None,
) -> Fit:
    """Fit the head model to one face of a photo.

    Args:
        photo: Photo.
        landmarks: Landmarks of the face.
        head: HeadModel.
        skin: [H, W] 0..1, how surely each pixel is bare skin (`stages.segment`); None trusts
            every pixel that the head covers.

    Returns:
        Fit.

    Raises:
        FitError: the landmarks are too small or no head projects to them.

    References:
        Thies et al., "Face2Face", CVPR 2016; Saito et al., "Photorealistic Facial Texture
        Inference Using Deep Neural Networks", CVPR 2017, sec. 3; Nagano et al., "paGAN",
        SIGGRAPH Asia 2018, sec. 4.
    """
    begin = time.perf_counter()
    face = Face(photo, landmarks, skin)
    shot, source = shot_of(face, options)
    model = landmark_model(head, options.modes)
    shape = Shape(np.zeros(len(head.identity_basis)), np.zeros(len(EXPRESSIONS)))
    points, confidence = shot.points, shot.confidence
    camera, shape = landmark_fit(head, model, shot.start(model), shape, points, confidence, options)
    camera, shape, found = colour_fit(head, model, camera, shape, face, options)
    residual, left = landmark_residuals(head, model, camera, shape, points, confidence, options)
    if not options.warp:
        residual = np.zeros((marks.FACE, 3))
    fitted = _fit_of(head, face, camera, shape, residual, left, found)
    return replace(fitted, seconds=time.perf_counter() - begin, focal_source=source)


def fit_together(
    faces: Sequence[Face], head: HeadModel, options: FitOptions = FitOptions()
) -> list[Fit]:
    """Fit the head model to several photos of one person: one identity and one warp for all.

    Camera, expression, light, albedo and gaze are each photo's own. The identity is that of the
    landmarks; colours then refine what each photo has to itself.

    Args:
        faces: of one person, at least one.

    Returns:
        a Fit of each; `seconds` is an equal share.

    Raises:
        FitError: as `fit`, of any of the photos.

    References:
        Ichim, Bouaziz and Pauly, "Dynamic 3D Avatar Creation from Hand-Held Video Input", SIGGRAPH
        2015, section 4: one neutral model for several photos.
    """
    begin = time.perf_counter()
    shots, sources = zip(*(shot_of(face, options) for face in faces))
    model = landmark_model(head, options.modes)
    turns = [head_angles(shot.start(model))[0] for shot in shots]
    share = sideways.share_of(turns, options.weights.sideways)
    options = replace(options, weights=replace(options.weights, sideways=share))
    identity = solve_identity(model, shots, options.weights)
    person = Person(model, identity)
    rest = Shape(identity, np.zeros(len(EXPRESSIONS)))
    found, wanted, moved = [], [], []
    for face, shot in zip(faces, shots):
        camera, shape = landmark_fit(
            head, person, shot.start(person), rest, shot.points, shot.confidence, options
        )
        camera, shape, colours = colour_fit(head, person, camera, shape, face, options)
        found.append((camera, shape, colours))
        seam = seam_offsets(model.rest, shot.points)
        wanted.append(misses(person.points(shape) + seam, shot.points[: marks.FACE], camera)[0])
        moved.append(np.linalg.norm(person.points(shape) - person.mean, axis=1))
    residual = np.zeros((marks.FACE, 3))
    if options.warp:
        sure = [shot.confidence for shot in shots]
        moves = shared_moves(wanted, moved, sure, [camera for camera, _, _ in found])
        moves = sideways.believed(moves, model.twin, options.weights.sideways)
        most = np.max(sure, 0)[: marks.FACE]
        residual = unfolded_residual(head, head.neutral(identity), moves, most)
    warped = Person(model, identity, residual)
    out = []
    for face, shot, source, (camera, shape, colours) in zip(faces, shots, sources, found):
        camera, shape = fit_points(
            warped, camera, shape, shot.points, shot.confidence, options.weights
        )
        seam = seam_offsets(model.rest, shot.points)
        _, left = misses(person.points(shape) + seam, shot.points[: marks.FACE], camera)
        fitted = _fit_of(head, face, camera, shape, residual, left, colours)
        out.append(replace(fitted, focal_source=source))
    each = (time.perf_counter() - begin) / len(faces)
    return [replace(fitted, seconds=each) for fitted in out]


def shot_of(face: Face, options: FitOptions = FitOptions()) -> tuple[Shot, str]:
    """The points of a face and the lens, and where its focal length comes from (`focal_length`).

    Raises:
        FitError: the face is too small.
    """
    points = np.asarray(face.landmarks.points, np.float64)
    confidence = np.asarray(face.landmarks.confidence, np.float64)
    size = float(marks.face_size(points))
    if size < SMALLEST_FACE:
        raise FitError(
            f"the outer eye corners are {size:.0f} pixels apart, at least {SMALLEST_FACE:.0f} are "
            "needed; use a larger picture of the face"
        )
    height, width = face.photo.encoded.shape[:2]
    focal, source = focal_length(face.photo, size, options)
    return Shot(points, confidence, focal, width, height), source


def colour_fit(head, model, camera, shape, face, options):
    """The photometric stage, if it is wanted: camera, Shape, and Photometry or None."""
    if not options.photometric:
        return camera, shape, None
    shot, _ = shot_of(face, options)
    return fit_photo(
        head, model, camera, shape, face.photo, shot.points, shot.confidence, face.skin,
        load_albedo(), options,
    )  # fmt: skip


def _fit_of(head, face, camera, shape, residual, left, found):
    """The Fit of one photo.

    Args:
        left: [468, 2] pixels that the linear model leaves; found: Photometry or None.
    """
    points = np.asarray(face.landmarks.points, np.float64)
    confidence = np.asarray(face.landmarks.confidence, np.float64)
    light, albedo = np.zeros((9, 3)), np.zeros(0)
    light[0] = 1 / harmonics.C0
    if found is not None:
        light, albedo = found.appearance.light, found.appearance.albedo
    neutral = head.neutral(shape.identity, residual_offsets(head, residual))
    gaze = fit_gaze(head, neutral, camera, points, confidence, shape.expression)
    vertices = head.vertices(neutral, shape.expression, gaze)
    places = head.landmarks(vertices).astype(np.float64)
    places[: marks.FACE] += seam_offsets(head.landmarks(head.mean)[: marks.FACE], points)
    projected = cameras.project(places, camera)
    return Fit(
        head=head.name,
        camera=camera,
        identity=shape.identity,
        expression=shape.expression,
        gaze=gaze,
        light=light,
        albedo=albedo,
        residual=residual,
        landmarks_projected=projected,
        diagnostics=diagnose(face.photo, points, camera, shape, left, projected, found),
    )


def landmark_fit(head, model, camera, shape, points, confidence, options):
    """The landmark-only stage: pose and shape, with lids that follow the gaze.

    Returns:
        camera, shape.
    """
    steps = options.landmark_steps
    for count in (3, steps):
        camera, shape = fit_points(
            model, camera, shape, points, confidence, options.weights, steps=count
        )
        gaze = fit_gaze(
            head, head.neutral(shape.identity), camera, points, confidence, shape.expression
        )
        shape = replace(shape, expression=look(shape.expression, gaze).astype(np.float64))
    return camera, shape


def landmark_residuals(head, model, camera, shape, points, confidence, options):
    """What the linear model leaves at the landmarks.

    A landmark moves parallel to the image plane, since the photo says nothing about depth.

    Returns:
        [468, 3] mm in head space, smoothed; [468, 2] pixels, as measured.
    """
    seam = seam_offsets(model.rest, points)
    wanted, miss = misses(model.points(shape) + seam, points[: marks.FACE], camera)
    wanted = sideways.believed(wanted, model.twin, options.weights.sideways)
    reference = head.neutral(shape.identity)
    return unfolded_residual(head, reference, wanted, confidence[: marks.FACE]), miss
