"""Photo and landmarks to a fitted head: camera, identity, expression, light, albedo, warp."""

import time
from dataclasses import dataclass, field, replace

import numpy as np

from bakery import landmarks as marks
from bakery.errors import FitError, UsageProblem
from bakery.geometry import camera as cameras
from bakery.geometry import harmonics, rotation
from bakery.heads.base import HeadModel, look
from bakery.settings import Settings, setting
from bakery.stages.fit.albedo import load_albedo
from bakery.stages.fit.diagnostics import diagnose
from bakery.stages.fit.gaze import fit_gaze
from bakery.stages.fit.landmarks import LandmarkModel, Shape, Weights, fit_points, start_camera
from bakery.stages.fit.lips import seam_offsets
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

    def __post_init__(self) -> None:
        super().__post_init__()
        levels = {len(self.level_widths), len(self.level_steps), len(self.level_samples)}
        if len(levels) > 1:
            raise UsageProblem("level_widths, level_steps and level_samples: give as many of each")


def landmark_model(head, modes):
    """The head's LandmarkModel, built once and kept on it."""
    kept = head.__dict__.get("_landmark_model")
    if kept is None or kept.modes != min(modes, len(head.identity_basis)):
        kept = head.__dict__["_landmark_model"] = LandmarkModel(head, modes)
    return kept


def prepare(head: HeadModel, options: FitOptions = FitOptions()) -> None:
    """Build what every fit of this head shares, so that the first is as fast as the next."""
    landmark_model(head, options.modes)
    warp_weights(head)
    if options.photometric:
        basis = load_albedo()
        for count in options.level_samples:
            choose_samples(head, landmark_model(head, options.modes), basis, count)


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
    points = np.asarray(landmarks.points, np.float64)
    confidence = np.asarray(landmarks.confidence, np.float64)
    size = float(marks.face_size(points))
    if size < SMALLEST_FACE:
        raise FitError(
            f"the outer eye corners are {size:.0f} pixels apart, at least {SMALLEST_FACE:.0f} are "
            "needed; use a larger picture of the face"
        )
    height, width = photo.encoded.shape[:2]
    focal, source = focal_length(photo, size, options)
    model = landmark_model(head, options.modes)
    shape = Shape(np.zeros(len(head.identity_basis)), np.zeros(len(EXPRESSIONS)))
    camera = start_camera(model, points, confidence, focal, width, height)
    camera, shape = landmark_fit(head, model, camera, shape, points, confidence, options)
    light, albedo = np.zeros((9, 3)), np.zeros(0)
    light[0] = 1 / harmonics.C0
    found = None
    if options.photometric:
        basis = load_albedo()
        camera, shape, found = fit_photo(
            head, model, camera, shape, photo, points, confidence, skin, basis, options
        )
        light, albedo = found.appearance.light, found.appearance.albedo
    residual, left = landmark_residuals(head, model, camera, shape, points, confidence)
    if not options.warp:
        residual = np.zeros((marks.FACE, 3))
    neutral = head.neutral(shape.identity, residual_offsets(head, residual))
    gaze = fit_gaze(head, neutral, camera, points, confidence, shape.expression)
    vertices = head.vertices(neutral, shape.expression, gaze)
    places = head.landmarks(vertices).astype(np.float64)
    places[: marks.FACE] += seam_offsets(model.rest, points)
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
        seconds=time.perf_counter() - begin,
        focal_source=source,
        diagnostics=diagnose(photo, points, camera, shape, left, projected, found),
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


def landmark_residuals(head, model, camera, shape, points, confidence):
    """What the linear model leaves at the landmarks.

    A landmark moves parallel to the image plane, since the photo says nothing about depth.

    Returns:
        [468, 3] mm in head space, smoothed; [468, 2] pixels, as measured.
    """
    seam = seam_offsets(model.rest, points)
    inside = cameras.to_camera(model.points(shape) + seam, camera)
    miss = points[: marks.FACE] - cameras.project_camera(inside, camera)
    wanted = np.zeros_like(inside)
    wanted[:, :2] = miss * (-inside[:, 2:] / camera.focal) * [1, -1]
    wanted = wanted @ rotation.matrix(camera.rotation)
    reference = head.neutral(shape.identity)
    return unfolded_residual(head, reference, wanted, confidence[: marks.FACE]), miss
