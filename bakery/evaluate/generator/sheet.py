"""A sheet to look at: the six key expressions of some people beside their photos, eyes and mouths near."""

import cv2
import numpy as np

from bakery.bake.options import BuildOptions
from bakery.formats.targets import read_keys
from bakery.geometry import camera as cameras
from bakery.landmarks import EYES, LIPS_OUTER
from bakery.plugins import plug_in
from bakery.preset import find
from bakery.show import synthesis
from bakery.stages.condition import face_camera

CELL = 256  # pixels a side


def rows_of(photo, head, generator, yaw=0.0):
    """The sheet's part of one person: photo and keys above, their eyes and mouths below.

    Args:
        photo: path.
        head: name of the head model.
        generator: generators.base.Generator.
        yaw: degrees that the keys are turned by.

    Returns:
        [2 * CELL, 7 * CELL, 3] uint8 sRGB.

    Raises:
        BakeryError: the photo cannot be used.
    """
    fitted = synthesis.fit_subject(photo, head, BuildOptions())
    _, keys = read_keys(find("expressions/keys.toml"))
    rest = np.zeros_like(keys[0])
    columns = [_column(fitted, _bytes(fitted.neutral.picture), rest, 0.0)]
    for weights in keys:
        target = synthesis.Target(weights, np.zeros(2), view=(yaw, 0.0))
        picture, _ = synthesis.paint(fitted, target, generator)
        columns.append(_column(fitted, _bytes(picture), weights, yaw))
    return np.hstack(columns)


def _column(fitted, picture, weights, yaw):
    """A picture [S, S, 3] uint8 above what it shows of eyes and mouth."""
    neutral = fitted.subject.neutral
    camera = face_camera(fitted.neutral.fit, fitted.head, neutral, yaw)
    points = cameras.project(fitted.head.landmarks(fitted.head.vertices(neutral, weights)), camera)
    points *= picture.shape[0] / camera.width
    near = [_strip(picture, points[np.concatenate(EYES)]), _strip(picture, points[LIPS_OUTER])]
    whole = cv2.resize(picture, (CELL, CELL), interpolation=cv2.INTER_AREA)
    return np.vstack([whole, *near])


def _strip(picture, points):
    """What lies around points [n, 2], twice as wide as high: [CELL / 2, CELL, 3]."""
    low, high = points.min(0), points.max(0)
    width = 1.25 * max(high[0] - low[0], 2 * (high[1] - low[1]))
    scale = CELL / width
    shift = np.array([CELL / 2, CELL / 4]) - scale * (low + high) / 2
    matrix = np.column_stack([np.eye(2) * scale, shift + 0.5 * scale - 0.5])
    return cv2.warpAffine(picture, matrix, (CELL, CELL // 2), flags=cv2.INTER_CUBIC)


def _bytes(picture):
    return np.round(picture * 255).astype(np.uint8)


def sheet(photos, head, generator_name, yaw=0.0):
    """`rows_of` of several people, two side by side: [h, w, 3] uint8 sRGB."""
    generator = plug_in("generators", generator_name)
    people = [rows_of(photo, head, generator, yaw) for photo in photos]
    if len(people) % 2 and len(people) > 1:
        people.append(np.full_like(people[0], 127))
    across = min(len(people), 2)
    return np.vstack([np.hstack(people[k : k + across]) for k in range(0, len(people), across)])
