"""Does a video of generated pictures flicker more than the conditions that it is made from."""

import numpy as np

from bakery.generators.channels import condition_channels
from bakery.generators.interior import interior_shade
from bakery.generators.steady import followed
from bakery.geometry import camera as cameras
from bakery.geometry.color import to_encoded
from bakery.geometry.sample import bilinear
from bakery.show import synthesis
from bakery.stages.condition import condition, face_camera, finer, shrunk

PICTURES = ("conditions", "bare", "generated")


def flicker(fitted, take, generator, first, count):
    """Mean change from frame to frame at points of the surface, in levels of 255.

    The mesh says where each point goes, so motion itself does not count; a point counts if the next
    frame shows the same place of the face there. Light that comes and goes with an expression (teeth
    as the mouth opens) counts. In "jitter" it does not: that is how far a point is from the middle
    between the frames before and after.

    Args:
        fitted: bake.subject.FittedSubject; take: formats.livelink.Take.
        first, count: frames of the take.

    Returns:
        dict: "conditions" (the deformed neutral with the first shade of eyes and mouth, as a network
        is given it), "bare" (without that shade), "generated", its "ratio" to the conditions and its
        "bare_ratio"; "jitter": a dict of the same five.
    """
    changes, jitters = ({name: [] for name in PICTURES} for _ in range(2))
    older = before = None
    for now in _frames(fitted, take, generator, first, count):
        if before is not None:
            after, seen = _changes(fitted.head, before, now)
            for name, change in after.items():
                changes[name].append(np.abs(change)[seen].mean() * 255)
        if older is not None:
            back, seen_back = _changes(fitted.head, before, older)
            for name, change in after.items():
                bent = np.abs(change + back[name])[seen & seen_back] / 2
                jitters[name].append(bent.mean() * 255)
        older, before = before, now
    return _means(changes) | {"jitter": _means(jitters)}


def _frames(fitted, take, generator, first, count):
    """Conditions of each frame, and its pictures [H, W, 3] float32 sRGB-encoded by name.

    Both pictures are painted finer and shrunk, as a video is.
    """
    head, subject = fitted.head, fitted.subject
    still = face_camera(fitted.neutral.fit, head, subject.neutral)
    for weights, gaze, camera in synthesis.poses(fitted, take, still, range(first, first + count)):
        seen, fine = (
            condition(head, subject.neutral, subject.texture, weights, gaze, c)
            for c in (camera, finer(camera))
        )
        made = generator.generate(subject, fine).image
        pictures = (fine.deformed_neutral * first_shade(head, fine), fine.deformed_neutral, made)
        shown = (shrunk(to_encoded(np.clip(picture, 0, 1)), camera) for picture in pictures)
        yield seen, dict(zip(PICTURES, shown))


def first_shade(head, conditions):
    """The factor [H, W, 1] on eyes and mouth that a network's deformed neutral comes with."""
    channels = condition_channels(head, conditions)
    per_mm = cameras.pixels_per_mm(conditions.camera)
    return interior_shade(channels, per_mm)[..., None]


def _changes(head, here, other):
    """How another frame's pictures differ along the surface [H, W, 3], by name; where they show it."""
    there, same = followed(head, here[0], other[0])
    return {name: bilinear(other[1][name], there) - own for name, own in here[1].items()}, same


def _means(found):
    out = {name: float(np.mean(values)) if values else 0.0 for name, values in found.items()}
    return out | {
        "ratio": out["generated"] / max(out["conditions"], 1e-6),
        "bare_ratio": out["generated"] / max(out["bare"], 1e-6),
    }
