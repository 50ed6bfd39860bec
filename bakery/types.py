"""The records that pass between stages.

Shapes are written [rows, columns]. The letters mean:
    V vertices   F faces   U uv points   L landmarks (478)   H, W image rows, columns
    I identity coefficients   E expressions (52)   T texels on a side   K key expressions (6)

Axes, units and colour spaces stand in `bakery.geometry`.
"""

from dataclasses import dataclass, field

import numpy as np

from bakery.check import check_array

LANDMARKS = 478  # 468 of the face mesh and 5 of each iris, the subject's right iris first

# Apple's ARKit names in the order that every array of expressions here has.
EXPRESSIONS = tuple(
    """browDownLeft browDownRight browInnerUp browOuterUpLeft browOuterUpRight cheekPuff
    cheekSquintLeft cheekSquintRight eyeBlinkLeft eyeBlinkRight eyeLookDownLeft eyeLookDownRight
    eyeLookInLeft eyeLookInRight eyeLookOutLeft eyeLookOutRight eyeLookUpLeft eyeLookUpRight
    eyeSquintLeft eyeSquintRight eyeWideLeft eyeWideRight jawForward jawLeft jawOpen jawRight
    mouthClose mouthDimpleLeft mouthDimpleRight mouthFrownLeft mouthFrownRight mouthFunnel
    mouthLeft mouthLowerDownLeft mouthLowerDownRight mouthPressLeft mouthPressRight mouthPucker
    mouthRight mouthRollLower mouthRollUpper mouthShrugLower mouthShrugUpper mouthSmileLeft
    mouthSmileRight mouthStretchLeft mouthStretchRight mouthUpperUpLeft mouthUpperUpRight
    noseSneerLeft noseSneerRight tongueOut""".split()
)
EXPRESSION_INDEX = {name: index for index, name in enumerate(EXPRESSIONS)}


@dataclass(frozen=True)
class Photo:
    """A decoded picture, upright, in Rec.709 primaries."""

    encoded: np.ndarray  # [H, W, 3] float32 sRGB-encoded 0..1
    sha256: str  # of the file's bytes
    focal_35mm: float | None = None  # mm, 35 mm equivalent, from EXIF
    notes: tuple[str, ...] = ()  # conversions that were made, for the manifest

    def __post_init__(self):
        check_array("Photo.encoded", self.encoded, (None, None, 3))


@dataclass(frozen=True)
class Landmarks:
    """One detected face."""

    box: np.ndarray  # [4] pixels: left, top, width, height
    score: float  # 0..1, how sure the finder is that this is a face
    points: np.ndarray  # [L, 2] pixels of the upright photo
    confidence: np.ndarray  # [L] 0..1

    def __post_init__(self):
        check_array("Landmarks.box", self.box, (4,))
        check_array("Landmarks.points", self.points, (LANDMARKS, 2))
        check_array("Landmarks.confidence", self.confidence, (LANDMARKS,), low=0, high=1)


@dataclass(frozen=True)
class Camera:
    """A pinhole camera; head space to pixels. See `bakery.geometry.camera`."""

    focal: float  # pixels
    center: np.ndarray  # [2] pixels, principal point
    rotation: np.ndarray  # [3] axis-angle, radians: head space -> camera space
    translation: np.ndarray  # [3] mm; z negative: the camera looks along -z
    width: int  # pixels
    height: int  # pixels

    def __post_init__(self):
        check_array("Camera.center", self.center, (2,))
        check_array("Camera.rotation", self.rotation, (3,))
        check_array("Camera.translation", self.translation, (3,))


@dataclass(frozen=True)
class Fit:
    """A head model placed in a photo."""

    head: str  # name of the head model
    camera: Camera
    identity: np.ndarray  # [I] standard deviations from the mean head
    expression: np.ndarray  # [E] blendshape weights, 0..1
    gaze: np.ndarray  # [2] degrees: yaw (+ to the subject's left), pitch (+ up), head space
    light: np.ndarray  # [9, 3] spherical harmonics of the irradiance, linear RGB
    albedo: np.ndarray  # [A] coefficients of the albedo basis, standard deviations
    residual: np.ndarray  # [468, 3] mm, head space: what the linear model leaves at the landmarks
    landmarks_projected: np.ndarray  # [L, 2] pixels
    seconds: float = 0.0  # of the fit alone
    focal_source: str = "default"  # "exif" or "default"
    diagnostics: dict = field(default_factory=dict)  # measured numbers, for warnings

    def __post_init__(self):
        check_array("Fit.identity", self.identity, (None,))
        check_array("Fit.expression", self.expression, (len(EXPRESSIONS),), low=0, high=1)
        check_array("Fit.gaze", self.gaze, (2,))
        check_array("Fit.light", self.light, (9, 3))
        check_array("Fit.residual", self.residual, (468, 3))


@dataclass(frozen=True)
class Fragments:
    """What the rasteriser saw at each pixel centre."""

    face: np.ndarray  # [H, W] int32, index of the nearest face, -1 for none
    barycentric: np.ndarray  # [H, W, 3] float32, perspective-correct, sum 1; 0 where none
    depth: np.ndarray  # [H, W] float32 mm in front of the camera, inf where none
