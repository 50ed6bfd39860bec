"""What was found in a photo, drawn over it for a person to judge; words on pictures.

Pictures go in and come out as [H, W, 3] uint8 sRGB. What is drawn is sized by the picture it is
drawn on, and that is brought to a size on which it can be read.
"""

from collections.abc import Sequence

import cv2
import numpy as np

from bakery import landmarks as marks
from bakery.geometry import camera as cameras
from bakery.geometry import rotation
from bakery.geometry.mesh import vertex_normals
from bakery.geometry.raster import rasterize
from bakery.geometry.sample import interpolate
from bakery.heads.base import HeadModel
from bakery.stages.face_frame import cut
from bakery.stages.segment import LABELS
from bakery.types import Camera, Fit, Landmarks

Color = tuple[int, int, int]  # sRGB
SMALLEST, LARGEST = 1000, 2400  # pixels of the longer side of a photo that is drawn on
PANEL = 800  # pixels a side of the pictures of a fit
SHIFT = 4  # bits of a pixel's fraction, for OpenCV's drawing
FONT = cv2.FONT_HERSHEY_SIMPLEX
STRIP, LETTERS = 0.075, 0.034  # of a picture's height: a caption's strip, its capital letters
DIM = 0.4  # what is left of the picture below words
WHITE, GROUND = (255, 255, 255), 24  # of words, below words
GROUPS = (  # landmarks by name: which, colour; a point has the colour of the last that holds it
    ("face", np.arange(marks.FACE), (255, 255, 255)),
    ("contour", marks.OVAL, (255, 150, 0)),
    ("brows", marks.BROWS, (190, 110, 255)),
    ("eyes", np.concatenate(marks.EYES), (0, 220, 255)),
    ("irises", np.arange(marks.FACE, 478), (255, 255, 0)),
    ("lips", marks.LIPS, (255, 60, 120)),
)
LABEL_COLORS = np.array(  # [len(LABELS), 3] uint8
    [
        (70, 70, 78), (236, 170, 140), (140, 84, 36), (66, 110, 230), (0, 205, 205),
        (255, 255, 255), (225, 30, 90), (120, 0, 50), (255, 220, 0), (140, 255, 235),
        (255, 110, 50), (205, 130, 190), (50, 20, 0), (160, 150, 30), (30, 150, 60), (170, 80, 255),
    ],
    np.uint8,
)  # fmt: skip
SHADED = (30, 0, 130)  # hard cast shadow
DETECTED, FITTED = (0, 235, 120), (255, 40, 200)
SHADE = np.array([0.82, 0.8, 0.86])
SEE_THROUGH = 0.35  # of the photo below the fitted head


def draw_faces(picture: np.ndarray, faces: Sequence[Landmarks]) -> np.ndarray:
    """A photo with the faces that were found: box, number, score, and landmarks by group.

    Args:
        picture: [H, W, 3] uint8.
        faces: in the order that `--face` counts.

    Returns:
        [h, w, 3] uint8: the photo, its longer side within SMALLEST..LARGEST, and a strip below.
    """
    out, scale = _canvas(picture)
    line = max(2, round(max(out.shape) / 500))
    colors = np.zeros((478, 3), int)
    for _, members, shade in GROUPS:
        colors[members] = shade
    for face in faces:
        radius = max(1.0, scale * float(face.box[2:].max()) / 170)
        for point, color in zip(face.points * scale, colors):
            _dot(out, point, radius, color)
    letters = max(out.shape) / 70
    for number, face in enumerate(faces, 1):
        left, top, width, height = (round(float(x)) for x in face.box * scale)
        cv2.rectangle(out, (left, top), (left + width, top + height), DETECTED, line, cv2.LINE_AA)
        _sign(out, f"{number}: {face.score:.2f}", (left, top), letters)
    return _legend(out, [(name, color) for name, _, color in GROUPS])


def draw_fit(
    picture: np.ndarray,
    landmarks: Landmarks,
    fit: Fit,
    head: HeadModel,
    vertices: np.ndarray,
) -> np.ndarray:
    """A fitted head beside its landmarks, both over the photo, cut to the head.

    On the left every landmark as it was found (ring) and as the head has it (dot); on the right the
    head, shaded, with its outline.

    Args:
        picture: [H, W, 3] uint8.
        landmarks: as detected.
        fit: Fit of them.
        vertices: [V, 3] mm, the head as fitted, with expression and gaze.

    Returns:
        [h, 2 PANEL, 3] uint8: two pictures of PANEL pixels a side, and a strip below.
    """
    skin = cameras.project(vertices[head.part_vertices("skin")], fit.camera)
    face = landmarks.points[: marks.FACE]
    # From the top of the skull to a bit of neck, on which the caption lies.
    low = np.minimum(skin.min(0), face.min(0))
    high = np.array([max(face[:, 0].max(), skin[:, 0].max()), face[:, 1].max()])
    high[1] += 0.12 * (high[1] - low[1])
    side = 1.1 * float((high - low).max())
    scale, corner = PANEL / side, (low + high) / 2 - side / 2
    affine = np.column_stack([np.eye(2) * scale, -corner * scale])
    photo = cut(picture.astype(np.float32), affine, PANEL)
    photo = np.clip(photo + 0.5, 0, 255).astype(np.uint8)
    camera = cameras.crop(fit.camera, corner[0], corner[1], PANEL, PANEL, scale)

    points = photo.copy()
    found, fitted = ((p - corner) * scale for p in (landmarks.points, fit.landmarks_projected))
    for one, other in zip(found, fitted):
        _dot(points, one, 4, DETECTED, 1)
        cv2.line(points, _fixed(one), _fixed(other), FITTED, 1, cv2.LINE_AA, SHIFT)
        _dot(points, other, 1.7, FITTED)
    apart = np.linalg.norm(found - fitted, axis=1)[: marks.FACE].mean() / marks.face_size(found)
    points = caption(points, f"landmarks {apart:.2%} of the eyes' distance apart")

    forward = rotation.matrix(fit.camera.rotation)[:, 2]
    turn = np.degrees([np.arctan2(forward[0], forward[2]), np.arcsin(np.clip(forward[1], -1, 1))])
    yaw, pitch, aside, up = (round(float(angle)) for angle in (*turn, *fit.gaze))
    shaded = caption(
        _shaded(photo, head, vertices, camera),
        f"{fit.head}: yaw {yaw}, pitch {pitch}; gaze {aside}, {up}",
    )
    both = np.concatenate([points, shaded], 1)
    return _legend(both, [("found", DETECTED), ("fitted", FITTED)])


def draw_labels(
    picture: np.ndarray, labels: np.ndarray, shadow: np.ndarray | None = None
) -> np.ndarray:
    """A photo coloured by what each pixel shows, with the colours' meaning.

    Args:
        picture: [H, W, 3] uint8.
        labels: [H, W] uint8 into `stages.segment.LABELS`.
        shadow: [H, W] 0..1, hard cast shadow; hatched where it is above a half.

    Returns:
        [h, w, 3] uint8: the photo, its longer side within SMALLEST..LARGEST, and a strip below.
    """
    out, _ = _canvas(picture)
    shown = cv2.resize(labels, out.shape[1::-1], interpolation=cv2.INTER_NEAREST)
    out = (out * 0.5 + LABEL_COLORS[shown] * 0.5 + 0.5).astype(np.uint8)
    line = max(1, round(max(out.shape) / 900))
    for label in np.unique(shown):
        edges, _ = cv2.findContours(
            (shown == label).astype(np.uint8), cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE
        )
        cv2.drawContours(out, edges, -1, LABEL_COLORS[label].tolist(), line, cv2.LINE_AA)
    used = [(LABELS[label], LABEL_COLORS[label].tolist()) for label in np.unique(labels)]
    if shadow is not None and (shadow > 0.5).any():
        dark = cv2.resize(shadow, out.shape[1::-1], interpolation=cv2.INTER_LINEAR) > 0.5
        rows, columns = np.ogrid[: dark.shape[0], : dark.shape[1]]
        hatch = dark & ((rows + columns) % (8 * line) < 4 * line)
        out[hatch] = (out[hatch] * 0.3 + np.array(SHADED) * 0.7 + 0.5).astype(np.uint8)
        used.append(("cast shadow", SHADED))
    return _legend(out, used)


def caption(picture: np.ndarray, text: str) -> np.ndarray:
    """The picture with a line of white text on a dark strip along its lower edge.

    Args:
        picture: [H, W, 3] uint8.
    """
    out = picture.copy()
    height, width = picture.shape[:2]
    top = height - round(STRIP * height)
    out[top:] = (out[top:] * DIM + 0.5).astype(np.uint8)
    scale, (across, up) = _letters(text, LETTERS * height)
    if across > 0.92 * width:
        scale, (across, up) = _letters(text, LETTERS * height * 0.92 * width / across)
    place = (round((width - across) / 2), round((top + height + up) / 2))
    cv2.putText(out, text, place, FONT, scale, WHITE, _stroke(scale), cv2.LINE_AA)
    return out


def _letters(text: str, capitals: float) -> tuple[float, tuple[int, float]]:
    """The font's scale for capitals of so many pixels; width and height of a text."""
    (_, unit), _ = cv2.getTextSize("H", FONT, 1.0, 1)
    scale = capitals / unit
    (across, up), _ = cv2.getTextSize(text, FONT, scale, _stroke(scale))
    return scale, (across, capitals)


def _stroke(scale: float) -> int:
    return max(1, round(1.4 * scale))


def _shaded(photo: np.ndarray, head: HeadModel, vertices: np.ndarray, camera: Camera) -> np.ndarray:
    """A shaded preview of the head over a photo that its camera sees, with its outline."""
    points = cameras.to_camera(vertices, camera)
    faces = head.faces[head.part_faces("skin", "eye_left", "eye_right")]
    seen = rasterize(
        cameras.project_camera(points, camera), -points[:, 2], faces, photo.shape[:2], cull=True
    )
    normals = interpolate(seen, vertex_normals(points, faces)[faces])
    normals /= np.maximum(np.linalg.norm(normals, axis=-1, keepdims=True), 1e-6)
    light = 0.25 + 0.75 * np.clip(normals @ [-0.35, 0.45, 0.82], 0, 1)
    inside = seen.face >= 0
    opacity = np.where(inside, 1 - SEE_THROUGH, 0)[..., None]
    out: np.ndarray = photo * (1 - opacity) + 255 * SHADE * light[..., None] * opacity
    out = (out + 0.5).astype(np.uint8)
    edges, _ = cv2.findContours(inside.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    cv2.drawContours(out, edges, -1, FITTED, 2, cv2.LINE_AA)
    return out


def _fixed(point: np.ndarray) -> tuple[int, int]:
    """A pixel position as OpenCV draws it: whole numbers are centres, SHIFT bits of fraction."""
    across, down = np.round((point - 0.5) * 2**SHIFT).astype(int).tolist()
    return across, down


def _dot(
    picture: np.ndarray, point: np.ndarray, radius: float, color: Color | np.ndarray, line: int = -1
) -> None:
    size = round(radius * 2**SHIFT)
    cv2.circle(picture, _fixed(point), size, tuple(map(int, color)), line, cv2.LINE_AA, SHIFT)


def _canvas(picture: np.ndarray) -> tuple[np.ndarray, float]:
    """A copy of a photo in a size that can be drawn on, and how much larger it is."""
    longer = max(picture.shape[:2])
    scale = np.clip(longer, SMALLEST, LARGEST) / longer
    if scale == 1:
        return picture.copy(), 1.0
    size = [max(1, round(side * scale)) for side in picture.shape[1::-1]]
    kind = cv2.INTER_AREA if scale < 1 else cv2.INTER_CUBIC
    return cv2.resize(picture, size, interpolation=kind), scale


def _sign(picture: np.ndarray, text: str, place: Sequence[int], capitals: float) -> None:
    """Words on a dark ground that stand on `place`, or below it where the picture ends."""
    scale, (across, up) = _letters(text, capitals)
    pad = round(capitals * 0.6)
    width, height = across + 2 * pad, round(up) + 2 * pad
    left = int(np.clip(place[0], 0, max(picture.shape[1] - width, 0)))
    top = place[1] - height if place[1] >= height else max(place[1], 0)
    picture[top : top + height, left : left + width] = GROUND
    at = (left + pad, top + pad + round(up))
    cv2.putText(picture, text, at, FONT, scale, WHITE, _stroke(scale), cv2.LINE_AA)


def _legend(picture: np.ndarray, entries: Sequence[tuple[str, Color]]) -> np.ndarray:
    """The picture with a dark strip below it: names [(text, colour)], each behind its colour."""
    capitals, width = max(picture.shape) / 75, picture.shape[1]
    gap = 2.4  # of the letters' height: a square of colour and the room around it

    def places(capitals: float) -> tuple[list[float], float]:
        ends = np.cumsum([_letters(text, capitals)[1][0] + gap * capitals for text, _ in entries])
        return [capitals, *(ends[:-1] + capitals)], ends[-1] + capitals

    _, needed = places(capitals)
    capitals *= min(1, width / needed)
    lefts, _ = places(capitals)
    scale, _ = _letters("H", capitals)
    strip = np.full((round(2.6 * capitals), width, 3), GROUND, np.uint8)
    base = round(1.8 * capitals)
    for (text, color), left in zip(entries, lefts):
        left, right = round(left), round(left + capitals)
        corners = (left, base - round(capitals)), (right, base)
        cv2.rectangle(strip, *corners, tuple(map(int, color)), cv2.FILLED)
        at = (round(right + 0.5 * capitals), base)
        cv2.putText(strip, text, at, FONT, scale, WHITE, _stroke(scale), cv2.LINE_AA)
    return np.concatenate([picture, strip])
