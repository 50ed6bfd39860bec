"""Training pairs from photographs: a person in neutral and in another expression.

Both photographs are fitted; the neutral's texture is drawn in the fit of the other, whose own
residual warp registers the two. What is left of the registration is a small smooth flow, and what
the two photographs differ in exposure and white balance is taken off the target.
"""

import cv2
import numpy as np

from bakery import steps
from bakery.formats.image import read_photo
from bakery.generators.planes import NONE, encode, planes
from bakery.geometry import camera as cameras
from bakery.geometry.color import LUMA, to_encoded, to_linear
from bakery.geometry.fill import diffuse, smoothstep
from bakery.geometry.sample import bilinear
from bakery.heads.base import PARTS
from bakery.stages import texture
from bakery.stages.condition import FACE_SHARE, condition
from bakery.stages.segment import HAIR
from bakery.stages.texture_complete import clear_of_hair
from bakery.synth.pairs import PaintedPair

SIZE = 512  # pixels a side
FLOW_LIMIT = 3.0  # pixels of SIZE that the flow may move the target
FLOW_SMOOTH = 10.0  # pixels of SIZE: sigma of the blur that makes the flow smooth
DRIFT_LIMIT = 0.35  # log of the gain that exposure and white balance may differ by


def frame(fit, points, size=SIZE):
    """The camera of a photo's fit cut to the face.

    Args:
        points: [L, 2] pixels, landmarks in the photo.

    Returns:
        Camera, and the affine [2, 3] from the photo to its picture.
    """
    low, high = points.min(0), points.max(0)
    scale = FACE_SHARE * size / (high[1] - low[1])
    corner = (low + high) / 2 - size / 2 / scale
    camera = cameras.crop(fit.camera, *corner, size, size, scale)
    return camera, np.column_stack([np.eye(2) * scale, -corner * scale])


def cut(picture, affine, size=SIZE):
    """A picture [H, W(, C)] float32 resampled by an affine of pixel positions; black outside."""
    matrix = affine.copy()
    matrix[:, 2] += 0.5 * matrix[:, :2].sum(1) - 0.5  # pixel centres lie at +0.5
    scale = affine[0, 0]
    if scale < 1:  # what is made smaller is blurred first, or it aliases
        picture = cv2.GaussianBlur(picture, (0, 0), 0.5 * np.sqrt(1 / scale**2 - 1) + 1e-3)
    return cv2.warpAffine(picture, matrix, (size, size), flags=cv2.INTER_LINEAR)


class Sitter:
    """A person photographed in neutral, ready to be paired with other photographs."""

    def __init__(self, path, landmarks, head, options=None, size=SIZE):
        """Fit and unwrap the neutral photo.

        Args:
            path: the neutral photo.
            landmarks: its Landmarks.
            head: HeadModel.
            options: steps.BuildOptions.
            size: pixels a side of the pairs.

        Raises:
            FitError, InputError: the photo cannot be used.
        """
        self.options, self.size, self.model = options or steps.BuildOptions(), size, head
        self.path = path
        photo = read_photo(path)
        fit, segmentation = steps.place_head(path, photo, landmarks, head, self.options)
        self.head, neutral = steps.own_head(head, fit)
        skin = clear_of_hair(segmentation.skin, segmentation.labels == HAIR, landmarks.points)
        self.subject, _, _ = texture.prepare(
            photo, landmarks, fit, neutral, self.head, skin, self.options.texture.resolution
        )
        own = self._drawn(photo, landmarks.points, fit, segmentation, neutral)
        self.photo, self.photo_face, self._own = own[1], own[2], own

    def _drawn(self, photo, points, fit, segmentation, neutral):
        """Conditions of a fit; its photo [S, S, 3] uint8 and face [S, S] uint8 in their frame."""
        camera, affine = frame(fit, points, self.size)
        drawn = condition(
            self.head, neutral, self.subject.texture, fit.expression, fit.gaze, camera
        )
        layers = planes(self.head, drawn)
        hair = cut((segmentation.labels == HAIR).astype(np.float32), affine, self.size)
        skin = cut(segmentation.skin.astype(np.float32), affine, self.size)
        inner = (drawn.part != NONE) & (drawn.part != PARTS.index("skin"))
        clear = np.where(inner, 1, smoothstep(0.3, 0.9, skin)) * (1 - hair)
        # The border of hair and of the photo's own outline is not trusted either.
        clear = cv2.erode(clear.astype(np.float32), np.ones((5, 5)))
        face = layers.face / 255 * clear
        encoded = cut(photo.encoded, affine, self.size) * (drawn.part != NONE)[..., None]
        return (
            layers,
            _bytes(encoded),
            _bytes(face),
            affine @ np.column_stack([points, np.ones(len(points))]).T,
            fit,
        )

    def neutral_pair(self, number):
        """The neutral photo as its own target: PaintedPair."""
        return self._pair(self._own, number)

    def pair(self, path, landmarks, number):
        """This person as another photo shows them.

        Args:
            path: the other photo.
            landmarks: its Landmarks.
            number: of the subject.

        Returns:
            PaintedPair.
        """
        photo = read_photo(path)
        fit, segmentation = steps.place_head(path, photo, landmarks, self.model, self.options)
        neutral = steps.fitted_neutral(self.model, fit)
        drawn = self._drawn(photo, landmarks.points, fit, segmentation, neutral)
        return self._pair(drawn, number)

    def _pair(self, drawn, number):
        layers, target, face, points, fit = drawn
        target = without_drift(target, layers.deformed, face, layers.part)
        target = registered(target, layers.deformed, face, layers.part)
        return PaintedPair(
            photo=self.photo,
            photo_face=self.photo_face,
            target=target,
            deformed=layers.deformed,
            normals=layers.normals,
            depth=layers.depth,
            gaze=layers.gaze,
            part=layers.part,
            face=face,
            landmarks=points.T.astype(np.float32),
            expression=fit.expression.astype(np.float32),
            gaze_angles=np.asarray(fit.gaze, np.float32),
            yaw=0.0,
            pitch=0.0,
            subject=number,
            head=self.model.name,
        )


def _bytes(values):
    return np.round(np.clip(values, 0, 1) * 255).astype(np.uint8)


def without_drift(target, deformed, face, part):
    """Take the gain of exposure and white balance off a target.

    Expressions darken folds and brighten bulges; the median over all skin of the face says how the
    photographs differ.

    Args:
        target, deformed: [S, S, 3] uint8 sRGB.
        face: [S, S] uint8.
        part: [S, S] uint8.

    Returns:
        [S, S, 3] uint8.
    """
    stable = (face > 250) & (part == PARTS.index("skin"))
    if stable.sum() < 100:
        return target
    seen, wanted = to_linear(target / 255.0), to_linear(deformed / 255.0)
    ratio = np.log(np.maximum(wanted[stable], 2e-3) / np.maximum(seen[stable], 2e-3))
    gain = np.exp(np.clip(np.median(ratio, 0), -DRIFT_LIMIT, DRIFT_LIMIT))
    return encode(seen * gain)


def registered(target, deformed, face, part):
    """Move a target by a small smooth flow onto the deformed neutral.

    Only skin tells how to move: what the neutral never showed follows the skin around it.
    """
    skin = ((face > 128) & (part == PARTS.index("skin"))).astype(np.float32)
    gray = []
    for picture in (deformed, target):
        luma = np.log(to_encoded(to_linear(picture / 255.0)) @ LUMA + 0.05).astype(np.float32)
        smooth = diffuse(luma[..., None], skin)[..., 0]
        local = luma - cv2.GaussianBlur(smooth, (0, 0), 12.0)  # shading is no structure
        gray.append(np.clip(128 + 250 * local * skin, 0, 255).astype(np.uint8))
    finder = cv2.DISOpticalFlow_create(cv2.DISOPTICAL_FLOW_PRESET_MEDIUM)
    flow = finder.calc(gray[0], gray[1], None)
    sure = cv2.GaussianBlur(skin, (0, 0), FLOW_SMOOTH)
    flow = cv2.GaussianBlur(flow * skin[..., None], (0, 0), FLOW_SMOOTH)
    flow = diffuse(flow / np.maximum(sure, 1e-3)[..., None], np.clip(sure, 0, 1))
    length = np.linalg.norm(flow, axis=-1, keepdims=True)
    flow = flow * np.minimum(1, FLOW_LIMIT / np.maximum(length, 1e-6))
    size = target.shape[0]
    where = np.stack(np.meshgrid(*[np.arange(size) + 0.5] * 2), -1) + flow
    return bilinear(target, where.astype(np.float32))
