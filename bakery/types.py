"""The records that pass between stages.

Shapes are written [rows, columns]. The letters mean:
    V vertices   F faces   U uv points   L landmarks (478)   H, W image rows, columns
    I identity coefficients   E expressions (52)   T texels on a side   K key expressions (6)

Axes, units and colour spaces stand in `bakery.geometry`.
"""

from dataclasses import dataclass, field

import numpy as np

from bakery.check import check_array, check_shape

LARGEST_TEETH = 10.0  # mm; no teeth stand farther from the head's own
LARGEST_OUTLINE = 60.0  # mm; no head differs by more from another outside the face
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
class Maker:
    """What made a result: a plug-in, told from every other version of itself."""

    name: str
    version: str = ""  # of the package that it came from
    sha256: str = ""  # over the weights or other data that its answers depend on
    source_type: str = ""  # IPTC digital source type of what a generator makes


@dataclass(frozen=True)
class Ingredient:
    """What an input says about how it was made: its own mark, which an avatar's manifest keeps."""

    sha256: str  # of the file's bytes
    source_type: str = ""  # IPTC digital source type in its XMP, a URL
    store: str = ""  # SHA-256 of the C2PA manifest store that it carries
    claimed_by: str = ""  # what made its active C2PA manifest: "Program 1.0"
    claimed: tuple[str, ...] = ()  # digital source types in its C2PA manifests, URLs


@dataclass(frozen=True)
class Photo:
    """A decoded picture, upright, in Rec.709 primaries."""

    encoded: np.ndarray  # [H, W, 3] float32 sRGB-encoded 0..1
    sha256: str  # of the file's bytes
    focal_35mm: float | None = None  # mm, 35 mm equivalent, from EXIF
    notes: tuple[str, ...] = ()  # conversions that were made, for the manifest
    ingredient: Ingredient | None = None  # its own mark

    def __post_init__(self) -> None:
        check_array("Photo.encoded", self.encoded, (None, None, 3))


@dataclass(frozen=True)
class Landmarks:
    """One detected face."""

    box: np.ndarray  # [4] pixels: left, top, width, height
    score: float  # 0..1, how sure the finder is that this is a face
    points: np.ndarray  # [L, 2] pixels of the upright photo
    confidence: np.ndarray  # [L] 0..1
    maker: Maker = Maker("given")  # the detector

    def __post_init__(self) -> None:
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

    def __post_init__(self) -> None:
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
    # [L, 2] pixels; the upper lip's rim where it is seen, which is the seam if lips are closed
    landmarks_projected: np.ndarray
    seconds: float = 0.0  # of the fit alone
    focal_source: str = "default"  # "exif" or "default"
    diagnostics: dict[str, float] = field(default_factory=dict)  # measured numbers, for warnings
    head_sha256: str = ""  # over all numbers of the head model; "" if unknown
    # [468, 3] mm, head space: takes what the expression left in the neutral head off its landmarks,
    # and fades as the expression is played (`stages.fit.rest`)
    rest: np.ndarray = field(default_factory=lambda: np.zeros((468, 3)))
    # [E] weights of blendshapes with which this person rests, as brows that lie low: part of the neutral head and
    # not of `expression` (`stages.fit.rest`)
    resting: np.ndarray = field(default_factory=lambda: np.zeros(len(EXPRESSIONS)))
    # [O] mm: ears, skull, jaw corners, neck and shoulders (`heads.outline`); [0] is the head's own
    outline: np.ndarray = field(default_factory=lambda: np.zeros(0))
    # [3] how upper teeth and gums stand: mm to the subject's left, mm up, share by which they are
    # larger (`stages.fit.teeth`); 0 where no photo shows them
    teeth: np.ndarray = field(default_factory=lambda: np.zeros(3))

    def __post_init__(self) -> None:
        check_array("Fit.rest", self.rest, (468, 3))
        check_array("Fit.resting", self.resting, (len(EXPRESSIONS),), low=0, high=1)
        check_array(
            "Fit.outline", self.outline, (None,), low=-LARGEST_OUTLINE, high=LARGEST_OUTLINE
        )
        check_array("Fit.teeth", self.teeth, (3,), low=-LARGEST_TEETH, high=LARGEST_TEETH)
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


@dataclass(frozen=True)
class Conditions:
    """One target (expression, gaze, camera) of one subject, drawn for the generator (paGAN sec. 4)."""

    camera: Camera
    expression: np.ndarray  # [E] weights
    gaze: np.ndarray  # [2] degrees: yaw, pitch
    vertices: np.ndarray  # [V, 3] mm, deformed, head space
    fragments: Fragments  # skin, eyes and mouth interior; no proxies
    part: np.ndarray  # [H, W] uint8 into heads.base.PARTS, 255 for none
    normals: np.ndarray  # [H, W, 3] float32 unit, camera space; 0 for none
    depth: np.ndarray  # [H, W] float32 mm in front of the camera, inf for none
    gaze_mask: np.ndarray  # [H, W, 2] float32: iris and sclera that can be seen, 0..1
    deformed_neutral: np.ndarray  # [H, W, 3] float32 linear: the neutral texture on this shape


@dataclass(frozen=True)
class Generated:
    """What a generator makes of Conditions. image = deformed_neutral * ratio * (1 - alpha) + color * alpha."""

    image: np.ndarray  # [H, W, 3] float32 linear
    ratio: np.ndarray  # [H, W, 3] float32 > 0: shading over the deformed neutral
    color: np.ndarray  # [H, W, 3] float32 linear: what the photo never showed
    alpha: np.ndarray  # [H, W] float32 0..1: where `color` stands


HAIR_KINDS = ("cap", "card", "fringe")  # opaque; cut out by alpha; blended before the face
HAIR_TRIANGLES = (8000, 4000, 1500)  # at most, in each level of detail, 0 the finest


@dataclass(frozen=True, eq=False)
class HairMesh:
    """Hair with volume: an opaque cap on the skull, and cards with alpha over it.

    N vertices, M faces, S texels on a side of its own atlas.
    """

    vertices: np.ndarray  # [N, 3] float32 mm, head space, on the person's neutral head
    faces: np.ndarray  # [M, 3] int32: the cap's, then card by card, from the skull outwards
    uv: np.ndarray  # [N, 2] float32 0..1 from the top left of the atlas
    kind: np.ndarray  # [M] uint8 into HAIR_KINDS
    card: np.ndarray  # [M] int32: which card, -1 for the cap; faces of a card stand together
    levels: np.ndarray  # [M] uint8: bit l is set if level of detail l (0 finest, 1, 2) shows it
    hang: np.ndarray  # [N] float32 0..1: 0 turns with the head, 1 stays with neck and shoulders
    texture: np.ndarray  # [S, S, 4] float16 scene-linear, colour multiplied by alpha
    direction: np.ndarray  # [S, S, 2] float16: unit, along the strand to its tip, x right, y down
    root_to_tip: np.ndarray  # [S, S] float16 0..1
    source: np.ndarray  # [S, S] uint8, as Textures.source

    def __post_init__(self) -> None:
        points, corners, side = len(self.vertices), len(self.faces), len(self.texture)
        check_array("HairMesh.vertices", self.vertices, (points, 3))
        check_array("HairMesh.faces", self.faces, (corners, 3), low=0, high=max(points - 1, 0))
        check_array("HairMesh.uv", self.uv, (points, 2), low=0, high=1)
        check_array("HairMesh.kind", self.kind, (corners,), low=0, high=len(HAIR_KINDS) - 1)
        check_array("HairMesh.card", self.card, (corners,), low=-1)
        check_array("HairMesh.levels", self.levels, (corners,), low=0, high=7)
        check_array("HairMesh.hang", self.hang, (points,), low=0, high=1)
        for name in ("faces", "kind", "card", "levels"):
            if getattr(self, name).dtype.kind not in "iu":
                found = getattr(self, name).dtype
                raise ValueError(f"HairMesh.{name}: {found}, needs whole numbers")
        check_shape("HairMesh.texture", self.texture, (side, side, 4))
        check_shape("HairMesh.direction", self.direction, (side, side, 2))
        check_shape("HairMesh.root_to_tip", self.root_to_tip, (side, side))
        check_shape("HairMesh.source", self.source, (side, side))

    def shown(self, level: int) -> np.ndarray:
        """Which faces a level of detail shows: [M] bool."""
        faces: np.ndarray = (self.levels >> level & 1).astype(bool)
        return faces


@dataclass(frozen=True)
class Textures:
    """Everything that is painted on the atlas and the proxies; scene-linear Rec.709."""

    neutral: np.ndarray  # [T, T, 3] float16, T_0
    keys: np.ndarray  # [K, T, T, 3] float16, T_k
    key_names: tuple[str, ...]
    key_weights: np.ndarray  # [K, E] a_e^k
    source: np.ndarray  # [T, T] uint8: 0 none, 1 observed, 2 mirrored, 3 inferred, 4 painted
    facing: np.ndarray  # [T, T] float16 0..1: weight of the observation
    hair: np.ndarray  # [T, T, 4] float16, colour multiplied by alpha: lies over all of the above
    gaze: np.ndarray  # [20, h, 2 w, 3] float16: left cap, right cap side by side
    gaze_directions: np.ndarray  # [20, 2] degrees
    mouths: np.ndarray  # [M, h, w, 3] float16: the mouth proxy
    mouth_landmarks: np.ndarray  # [M, n, 2] see runtime.mouth
    mouth_weights: np.ndarray  # [M, E] pose of each
    maker: Maker = Maker("unknown")  # the generator
    made_from: str = ""  # SHA-256 over photo, landmarks, fit and head; "" if unknown
    # [T, T, 3] float16: T_0 without light and highlights; [0, 0, 3] if the bundle has none
    albedo: np.ndarray = field(default_factory=lambda: np.zeros((0, 0, 3), np.float16))
    hair_mesh: HairMesh | None = None  # None: the hair is a layer on the skin alone

    def __post_init__(self) -> None:
        side, keys, shapes = len(self.neutral), len(self.key_names), len(EXPRESSIONS)
        gazes, mouths = len(self.gaze), len(self.mouths)
        bare = side if len(self.albedo) else 0
        for name, shape in {  # pictures are too large to look for what is not finite
            "neutral": (side, side, 3),
            "albedo": (bare, bare, 3),
            "keys": (keys, side, side, 3),
            "source": (side, side),
            "facing": (side, side),
            "hair": (side, side, 4),
            "gaze": (gazes, None, None, 3),
            "mouths": (mouths, None, None, 3),
        }.items():
            check_shape(f"Textures.{name}", getattr(self, name), shape)
        check_array("Textures.key_weights", self.key_weights, (keys, shapes), low=0, high=1)
        check_array("Textures.gaze_directions", self.gaze_directions, (gazes, 2))
        check_array("Textures.mouth_landmarks", self.mouth_landmarks, (mouths, None, 2))
        check_array("Textures.mouth_weights", self.mouth_weights, (mouths, shapes), low=0, high=1)
