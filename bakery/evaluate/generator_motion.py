"""Does a video of generated pictures flicker more than the conditions that it is made from."""

import numpy as np

from bakery import portrayal
from bakery.generators.planes import NONE
from bakery.geometry import camera as cameras
from bakery.geometry.color import to_encoded
from bakery.geometry.sample import bilinear, interpolate
from bakery.heads.base import gaze_of
from bakery.stages.condition import condition, face_camera


def flicker(sitter, take, generator, first, count):
    """Mean change from frame to frame at points of the surface, in levels of 255.

    The mesh says where each point goes, so motion itself does not count; a point counts if the next
    frame shows the same place of the face there.

    Args:
        sitter: sitter.Sitter; take: formats.livelink.Take.
        first, count: frames of the take.

    Returns:
        dict: "conditions" (the deformed neutral), "generated", and their "ratio".
    """
    weights, turns, eyes = take.at(np.arange(first, first + count) / take.rate)
    subject = sitter.subject
    still = face_camera(sitter.neutral.fit, sitter.head, subject.neutral)
    before, changes = None, {"conditions": [], "generated": []}
    for k in range(count):
        gaze = gaze_of(weights[k]).mean(0) if eyes is None else eyes[k].mean(0)
        camera = portrayal.turned(sitter, still, turns[k])
        seen = condition(sitter.head, subject.neutral, subject.texture, weights[k], gaze, camera)
        pictures = {
            "conditions": to_encoded(np.clip(seen.deformed_neutral, 0, 1)),
            "generated": to_encoded(np.clip(generator.generate(subject, seen).image, 0, 1)),
        }
        if before is not None:
            there, same = _followed(sitter.head, before[0], seen)
            for name, found in changes.items():
                moved = bilinear(pictures[name].astype(np.float32), there)
                found.append(np.abs(moved - before[1][name])[same].mean() * 255)
        before = seen, pictures
    out = {name: float(np.mean(found)) for name, found in changes.items()}
    return out | {"ratio": out["generated"] / out["conditions"]}


def _followed(head, old, new):
    """Where the surface at each pixel [H, W, 2] of a frame lies in the next; which show it [H, W]."""
    place = interpolate(old.fragments, new.vertices[head.faces])
    there = cameras.project(place, new.camera)
    uv, new_uv = (interpolate(c.fragments, head.uv[head.uv_faces]) for c in (old, new))
    apart = np.abs(bilinear(new_uv, there) - uv).max(-1)
    return there.astype(np.float32), (old.part != NONE) & (apart < 0.005)
