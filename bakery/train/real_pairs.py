"""Training pairs from photographs: a person in neutral and in another expression.

Both photographs are fitted; the neutral's texture is drawn in the fit of the other, whose own
residual warp registers the two. What is left of the registration is a small smooth flow, and what
the two photographs differ in exposure and white balance is removed from the target.
"""

from pathlib import Path

import cv2
import numpy as np

from bakery.bake.subject import FittedSubject
from bakery.errors import BakeryError
from bakery.generators.channels import expression_channels
from bakery.geometry.color import LUMA, to_linear
from bakery.geometry.encode import encode
from bakery.geometry.fill import diffuse
from bakery.geometry.sample import bicubic
from bakery.heads.base import PARTS
from bakery.synth.pairs import NAME, PaintedPair, write_shard

FLOW_LIMIT = 3.0  # pixels that the flow may move the target
FLOW_SMOOTH = 10.0  # pixels: sigma of the blur that makes the flow smooth
DRIFT_LIMIT = 0.35  # log of the scale that exposure and white balance may differ by


def write_pairs(people, landmarks, head, output, options=None):
    """Write one shard a person: each other photo, and the neutral on itself.

    A person whose shard is there already is passed over, so an interrupted run goes on.

    Args:
        people: [folders.Person].
        landmarks: function from a path to its Landmarks.
        head: HeadModel.
        output: folder of the shards.
        options: steps.BuildOptions.

    Yields:
        (Person, error or None): a person whose photos cannot be used is left out.
    """
    for number, person in enumerate(people):
        path = Path(output) / NAME.format(number)
        if path.exists():
            continue
        try:
            fitted = FittedSubject(person.neutral, landmarks(person.neutral), head, options)
            observations = [fitted.observe(photo, landmarks(photo)) for _, photo in person.others]
        except BakeryError as error:
            yield person, error
            continue
        pairs = [
            pair_of(fitted, observation, number) for observation in (*observations, fitted.neutral)
        ]
        write_shard(path, pairs, {"person": person.name})
        yield person, None


def pair_of(fitted, observation, number):
    """A person as a photo shows them: PaintedPair.

    Args:
        fitted: FittedSubject.
        observation: of `fitted.sit`; `fitted.neutral` makes the neutral photo its own target.
        number: of the subject.
    """
    channels, fit = observation.channels, observation.fit
    target = observation.head_only
    for mend in (without_drift, registered):
        target = mend(target, channels.deformed, observation.face, channels.part)
    return PaintedPair(
        photo=fitted.subject.photo,
        photo_face=fitted.neutral.face,
        target=target,
        deformed=channels.deformed,
        normals=channels.normals,
        depth=channels.depth,
        gaze=channels.gaze,
        part=channels.part,
        face=observation.face,
        landmarks=observation.points.astype(np.float32),
        expression=fit.expression.astype(np.float32),
        **expression_channels(fitted.subject, observation.conditions, observation.camera),
        gaze_angles=np.asarray(fit.gaze, np.float32),
        yaw=0.0,
        pitch=0.0,
        subject=number,
        head=fitted.model.name,
    )


def without_drift(target, deformed, face, part):
    """Divide a target by its difference in exposure and white balance.

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
    scale = np.exp(np.clip(np.median(ratio, 0), -DRIFT_LIMIT, DRIFT_LIMIT))
    return encode(seen * scale)


def registered(target, deformed, face, part):
    """Move a target by a small smooth flow onto the deformed neutral.

    Only skin tells how to move: what the neutral never showed follows the skin around it.
    """
    skin = ((face > 128) & (part == PARTS.index("skin"))).astype(np.float32)
    gray = []
    for picture in (deformed, target):
        luma = np.log(picture / 255.0 @ LUMA + 0.05).astype(np.float32)
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
    # Cubic: the photo has been resampled once already, and what is fine is to be learned too.
    return bicubic(target, where.astype(np.float32))
