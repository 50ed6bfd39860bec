"""Cameras that hold the whole head and its hair, from whatever side it is seen."""

import numba
import numpy as np

from bakery.geometry import camera as cameras
from bakery.heads.base import HeadModel, weights
from bakery.landmarks import CHIN
from bakery.stages.condition import SIZE, face_camera
from bakery.types import Camera, Fit, HairMesh

STEPS = 200  # towards the smallest ball: within a millimetre of it
FRAMINGS = ("head", "face")  # the whole head and its hair from any side, or the face, nearer
FACE_RATIO = 0.6  # of the picture's height that the face takes, framed as a face
MARGIN = 1.06  # of the ball around the head, for lashes, lips that are pushed out and air


def head_ball(
    head: HeadModel, neutral: np.ndarray, hair: HairMesh | None = None
) -> tuple[np.ndarray, float]:
    """A ball around the head without its neck, the jaw dropped or not.

    Args:
        neutral: [V, 3] mm.
        hair: with volume, which the ball holds too.

    Returns:
        its centre [3] and its radius, mm, head space.
    """
    skin = head.part_vertices("skin")
    chin = head.landmarks(neutral)[CHIN, 1].min()
    dropped = head.vertices(neutral, weights({"jawOpen": 1.0}))
    points = np.concatenate(
        [neutral[skin][neutral[skin, 1] > chin], head.landmarks(dropped)[CHIN]]
    ).astype(np.float64)
    center = (points.min(0) + points.max(0)) / 2
    if hair is not None and len(hair.vertices):
        points = np.concatenate([points, hair.vertices])
        center = _smallest(points, center)
    return center, float(np.linalg.norm(points - center, axis=1).max())


def _smallest(points: np.ndarray, center: np.ndarray) -> np.ndarray:
    """The middle [3] of a small ball around points [N, 3], as far aside as `center`: heads stay there.

    References:
        Badoiu and Clarkson, "Smaller core-sets for balls", SODA 2003.
    """
    points = np.ascontiguousarray(points, np.float64)
    for step in range(1, STEPS):
        toward = points[_farthest(points, center)] - center
        center = center + toward * [0, 1, 1] / (step + 1)
    return center


@numba.njit(cache=True, nogil=True)
def _farthest(points: np.ndarray, center: np.ndarray) -> int:
    """Which of the points [N, 3] is farthest from a centre [3]: the first, of several."""
    found, most = 0, -1.0
    for n in range(len(points)):
        x, y, z = points[n, 0] - center[0], points[n, 1] - center[1], points[n, 2] - center[2]
        square = x * x + y * y + z * z
        if square > most:
            found, most = n, square
    return found


def head_camera(
    fit: Fit,
    head: HeadModel,
    neutral: np.ndarray,
    yaw: float = 0.0,
    pitch: float = 0.0,
    size: int = SIZE,
    hair: HairMesh | None = None,
) -> Camera:
    """A camera with the photo's lens and distance that holds the whole head, upright and centred.

    The head turns about the middle of its ball, so that all views show it at one scale and in one
    place, as a turntable does.

    Args:
        fit: of the photo.
        neutral: [V, 3] mm.
        yaw, pitch: degrees the head turns to the subject's left and up.
        size: pixels a side.
        hair: with volume, which the picture holds too.
    """
    center, radius = head_ball(head, neutral, hair)
    straight = cameras.view(fit.camera, 0.0, 0.0, center)
    x, y, z = cameras.to_camera(center, straight)
    edges = []
    for aside, principal in ((x, straight.center[0]), (-y, straight.center[1])):
        # The two planes through the camera that touch the ball.
        middle = np.arctan2(aside, -z)
        half = np.arcsin(min(MARGIN * radius / np.hypot(aside, z), 0.9))
        edges.append(principal + straight.focal * np.tan([middle - half, middle + half]))
    low, high = np.transpose(edges)
    scale = size / (high - low).max()
    corner = (low + high) / 2 - size / 2 / scale
    framed = cameras.crop(straight, corner[0], corner[1], size, size, scale)
    return cameras.view(framed, yaw, pitch, center)


def framed_camera(
    framing: str,
    fit: Fit,
    head: HeadModel,
    neutral: np.ndarray,
    yaw: float,
    pitch: float,
    size: int,
    hair: HairMesh | None,
) -> Camera:
    """The camera of one of `FRAMINGS`; arguments as `head_camera`."""
    if framing == "face":
        return face_camera(fit, head, neutral, yaw, pitch, size, FACE_RATIO)
    return head_camera(fit, head, neutral, yaw, pitch, size, hair)
