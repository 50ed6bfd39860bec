"""Eyes from the photo: what the lids left open, completed to whole eyeballs (PITFALLS 8)."""

import cv2
import numpy as np

from bakery.generators.eyes import EyeMaps, directions_of_map, look_up, to_map
from bakery.generators.shade import lid_occlusion
from bakery.geometry import rotation
from bakery.geometry.camera import project, to_camera
from bakery.geometry.color import LUMA
from bakery.geometry.fill import diffuse, smoothstep
from bakery.geometry.sample import bilinear
from bakery.heads.base import FOLLOW, HeadModel
from bakery.landmarks import EYES, LEFT_IRIS, RIGHT_IRIS
from bakery.stages.atlas import uv_polygon

MAP = 256  # pixels a side; one is 0.8 degrees, 0.16 mm on the ball
IRIS_MM = (5.3, 6.5)  # plausible radius of an adult iris; the mean is 5.85
COVERED = 0.4  # share of an eye's opening that is hidden, above which nothing is read from it
LIDS = 1.8  # of an eye's opening: how far the skin goes that is as well lit as the eye
FEW = 20  # pixels of an eye's opening, too few to tell by
# Pupil, iris and lashes are dark. If a tenth of the opening is not darker than so much of the skin's
# luminance, a lens mirrors something bright.
MIRRORED = 0.25
PUPIL = 0.35, 0.5  # of an iris's radius, over which its pupil ends
TWO_TONES, MOST_LIT = 0.15, 1.3  # log by which two irises may differ; by which one is lit at most
SCLERA_OVER_SKIN = 1.35  # luminance, when no sclera can be seen
# Luminance that the white has at most: linear, and over the skin's. Of 488 whites in photos of congress 95%
# have less than 0.58, and 95% beside skin lighter than 0.2 less than 1.44 times its own. An eye in shade,
# lit as its skin was, can come out lighter.
WHITEST = 0.45, 1.8


def eye_maps(linear, occluder, points, fit, head, vertices, part, depth, skin_tone):
    """Read both eyeballs out of the photo; one that is hidden is the other's mirror image.

    Args:
        linear: [H, W, 3] float32 photo.
        occluder: [H, W] float32 0..1, what hides the face.
        points: [L, 2] pixels, landmarks of the photo.
        vertices: [V, 3] mm, the shape as it stands in the photo.
        part, depth: [H, W] of the drawn shape in the photo's camera.
        skin_tone: [3] linear, for eyes of which nothing can be seen.

    Returns:
        EyeMaps.
    """
    shade = lid_occlusion(part, depth, fit.camera.focal)
    maps, irises, hidden = [], [], []
    for eye in range(2):
        inside = np.zeros(occluder.shape, np.uint8)
        cv2.fillPoly(inside, [np.round(points[EYES[eye]] * 16).astype(np.int32)], 1, shift=4)
        covered = bool(inside.any()) and occluder[inside > 0].mean() > COVERED
        hidden.append(covered or _mirrored(linear[inside > 0] @ LUMA, skin_tone @ LUMA))
        found, iris = _one_eye(
            linear, hidden[eye], points, fit, vertices, head, eye, shade, skin_tone
        )
        maps.append(found)
        irises.append(iris)
    if hidden[0] != hidden[1]:
        shown = maps[hidden.index(False)]
        maps[hidden.index(True)] = (*(layer[:, ::-1] for layer in shown[:2]), *shown[2:])
    elif not any(hidden):
        for which, texture in enumerate(alike([found[0] for found in maps], irises)):
            maps[which] = (texture, *maps[which][1:])
    return EyeMaps(*(np.stack(field) for field in zip(*maps)))


def alike(textures: list[np.ndarray], irises: list[np.ndarray]) -> list[np.ndarray]:
    """Both eyes [n, n, 3] with the tone of the lighter iris: the other lies in the shade of nose or brow.

    Args:
        irises: [n, n] 0..1 each, 1 on the iris, 0 in the pupil and on the white.
    """
    tones = [np.median(t[i > 0.9], 0) for t, i in zip(textures, irises) if (i > 0.9).any()]
    if len(tones) < 2:
        return textures
    log = np.log(np.maximum(tones, 1e-4))
    darker = int(np.argmin(log @ LUMA))
    apart = log[1 - darker] - log[darker]
    size = float(apart @ LUMA)
    gain = apart * max(size - TWO_TONES, 0.0) / max(size, 1e-6)
    gain = np.clip(gain, -MOST_LIT, MOST_LIT).astype(np.float32)
    out = list(textures)
    out[darker] = out[darker] * np.exp(irises[darker][..., None] * gain)
    return out


def _mirrored(shown: np.ndarray, skin: float) -> bool:
    """Whether an eye's opening [n] shows what a lens mirrors; luminances."""
    return len(shown) > FEW and bool(np.percentile(shown, 10) > MIRRORED * skin)


def dimming(sclera: np.ndarray, skin: np.ndarray) -> np.float32:
    """Factor 0..1 on an eye whose white [3] is whiter than one beside such skin [3] can be."""
    most = max(WHITEST[0], WHITEST[1] * float(skin @ LUMA))
    return np.float32(min(1.0, most / max(float(sclera @ LUMA), 1e-3)))


def with_lit_eyes(
    linear: np.ndarray, points: np.ndarray, lift: np.ndarray, head: HeadModel
) -> np.ndarray:
    """The photo [H, W, 3] with eyes as light as the lids around them were made.

    Args:
        points: [L, 2] pixels; lift: [T, T] log, as of CompleteAlbedo.
    """
    insides, gains, whites = [], [], []
    for lids in EYES:
        around = uv_polygon(head, lids, LIDS, len(lift)) > 0
        inside = np.zeros(linear.shape[:2], np.uint8)
        cv2.fillPoly(inside, [np.round(points[lids] * 16).astype(np.int32)], 1, shift=4)
        insides.append(inside[..., None] > 0)
        gains.append(float(np.exp(np.median(lift[around]))))
        whites.append(np.percentile(linear[inside > 0] @ LUMA, 75) if inside.any() else 0.0)
    # Both whites are alike: the eye in less shadow, which was changed less, tells the other's.
    told = int(np.argmin(np.abs(np.log(gains))))
    level, other = whites[told] * gains[told], 1 - told
    if gains[other] > 1 and whites[other] * gains[other] > level > 0:
        gains[other] = max(level / whites[other], 1.0)
    out = linear
    for inside, gain in zip(insides, gains):
        out = np.where(inside, out * np.float32(gain), out)
    return out


def _one_eye(linear, hidden, points, fit, vertices, head, eye, shade, skin_tone):
    ball = vertices[head.follow == FOLLOW.index(("eye_left", "eye_right")[eye])]
    center = ball.mean(0)
    radius = float(np.median(np.linalg.norm(ball - center, axis=1)))
    camera = fit.camera
    distance = -to_camera(center, camera)[2]
    lids, iris = points[EYES[eye]], points[(LEFT_IRIS, RIGHT_IRIS)[eye]]
    iris_pixels = np.linalg.norm(iris[1:] - iris[0], axis=1).mean()
    iris_mm = float(np.clip(iris_pixels * (distance - radius) / camera.focal, *IRIS_MM))
    iris_angle = np.degrees(np.arcsin(min(iris_mm / radius, 0.7)))

    # The map turns with the fitted gaze, which both eyes share. Each iris keeps the place that its
    # own landmarks give it, a few degrees off the middle: eyes converge, and no ball fits exactly.
    turn = rotation.yaw_pitch(*fit.gaze)
    axis = turn.T @ _axis(iris[0], center, radius, camera)
    aim = _turn_to(axis)
    directions = directions_of_map(MAP)
    pixels = project(center + radius * (directions @ turn.T), camera).astype(np.float32)
    facing = _facing(directions @ turn.T, center, camera)

    # Open pixels: inside the lid polygon, away from its border (lashes), on the near side.
    opening = np.zeros(linear.shape[:2], np.uint8)
    cv2.fillPoly(opening, [np.round(lids * 16).astype(np.int32)], 1, shift=4)
    inside = cv2.distanceTransform(opening, cv2.DIST_L2, 3)
    height = max(inside.max(), 1e-3)  # half the opening, pixels
    upper_margin = smoothstep(0.12, 0.5, inside / height)
    weight = bilinear(upper_margin.astype(np.float32), pixels) * smoothstep(0.15, 0.4, facing)
    if hidden or inside.max() < 1.5:
        weight = np.zeros_like(weight)
    light = np.maximum(bilinear(shade, pixels), 0.3)[..., None]
    color = bilinear(linear, pixels) / light

    angle = np.degrees(np.arccos(np.clip(directions @ axis, -1, 1)))
    sclera, shown = _sclera(color, weight, angle, iris_angle, skin_tone)
    dim = dimming(sclera, skin_tone)
    color, sclera = color * dim, sclera * dim
    model = _model(color, weight, angle, iris_angle, sclera)
    excess = (color - model) @ LUMA
    # Highlights: far brighter than their surroundings, on or near the cornea, small.
    bright = max(float(sclera @ LUMA), 1e-3)
    glare = smoothstep(0.25, 0.6, excess / bright) * smoothstep(
        1.0 * iris_angle, 0.8 * iris_angle, angle
    )
    glare = cv2.GaussianBlur(glare.astype(np.float32), (0, 0), 1.0)
    glint_here = np.maximum(color - model, 0) * light * (glare * (weight > 0.02))[..., None]
    clean = weight * (1 - smoothstep(0.05, 0.4, glare))

    # Detail over the radial model, mirrored top to bottom under the upper lid.
    detail = np.clip(np.log(np.maximum(color, 1e-3) / np.maximum(model, 1e-3)), -0.8, 0.8)
    mirror = to_map(((directions @ aim) * [1, -1, 1]) @ aim.T, MAP)
    flipped = bilinear(np.ascontiguousarray(detail, np.float32), mirror)
    flipped_weight = bilinear(np.ascontiguousarray(clean, np.float32), mirror) * (
        angle < iris_angle
    )
    known = clean + (1 - clean) * flipped_weight
    joined = (detail * clean[..., None] + flipped * ((1 - clean) * flipped_weight)[..., None]) / (
        np.maximum(known, 1e-4)[..., None]
    )
    far = smoothstep(1.0, 2.2, angle / iris_angle)  # beyond what lids ever show: the plain model
    anchored = np.maximum(known, np.maximum(0.02 * far, 1e-3))
    filled = diffuse(np.where(known[..., None] > 1e-3, joined, 0), np.clip(anchored, 0, 1))
    out = model * np.exp(filled * (1 - 0.7 * far * (1 - known))[..., None])

    # The highlight belongs to the camera and the light, not to the turning ball: store it unturned.
    fixed = directions_of_map(MAP)

    glint = bilinear(glint_here.astype(np.float32), to_map(fixed @ turn, MAP))
    white = np.float32(sclera * shown)
    place = angle / iris_angle
    iris_ring = smoothstep(*PUPIL, place) * smoothstep(1.08, 0.95, place)
    found = out.astype(np.float32), glint.astype(np.float32), np.float32(iris_angle), white
    return found, iris_ring.astype(np.float32)


def _axis(pixel, center, radius, camera):
    """Unit direction from the ball's centre to where the sight ray of `pixel` meets the ball."""
    ray = np.array(
        [
            (pixel[0] - camera.center[0]) / camera.focal,
            -(pixel[1] - camera.center[1]) / camera.focal,
            -1.0,
        ]
    )
    ray /= np.linalg.norm(ray)
    middle = to_camera(center, camera)
    along = ray @ middle
    inside = max(radius**2 - (middle @ middle - along**2), 0.0)
    hit = ray * (along - np.sqrt(inside)) - middle
    return rotation.matrix(camera.rotation).T @ (hit / np.linalg.norm(hit))


def _turn_to(axis):
    """Rotation [3, 3] from +z to `axis` by yaw and pitch, no roll."""
    yaw = np.degrees(np.arctan2(axis[0], axis[2]))
    pitch = np.degrees(np.arcsin(np.clip(axis[1], -1, 1)))
    return rotation.yaw_pitch(yaw, pitch)


def _facing(normals, center, camera):
    """Cosine between directions on the ball and the way to the camera."""
    turn = rotation.matrix(camera.rotation)
    toward = -to_camera(center, camera)
    return (normals @ turn.T) @ (toward / np.linalg.norm(toward))


def _sclera(color, weight, angle, iris_angle, skin_tone):
    """Typical colour [3] of the white of the eye, and whether the photo shows it."""
    white = (weight > 0.7) & (angle > 1.25 * iris_angle) & (angle < 60)
    gray = skin_tone @ LUMA
    fallback = np.float32(SCLERA_OVER_SKIN * gray) * np.array([1.04, 0.99, 0.96], np.float32)
    if white.sum() < 30:
        return fallback, False
    luminance = color[white] @ LUMA
    upper = luminance >= np.percentile(luminance, 60)
    found = np.median(color[white][upper], 0)
    good = bool(found @ LUMA > 0.3 * fallback @ LUMA)
    return (found if good else fallback), good


def _model(color, weight, angle, iris_angle, sclera):
    """Radially symmetric eye [n, n, 3]: medians over rings of the iris, then sclera."""
    steps = np.linspace(0, 1.05, 22) * iris_angle
    rings, centers = [], []
    for low, high in zip(steps[:-1], steps[1:]):
        ring = (angle >= low) & (angle < high) & (weight > 0.5)
        if ring.sum() >= 6:
            # Below the median: highlights are bright, and lids that strayed in are too.
            rings.append(np.percentile(color[ring], 42, axis=0))
            centers.append((low + high) / 2)
    if len(rings) < 6:  # nothing to go by: a dark brown iris with its pupil
        centers = np.array([0.0, 0.34, 0.40, 0.85, 1.0]) * iris_angle
        iris = sclera * np.array([0.16, 0.10, 0.07])
        rings = np.stack([0.1 * iris, 0.1 * iris, iris, iris, 0.5 * iris])
    rings = np.array(rings)
    out = np.stack([np.interp(angle, centers, rings[:, c]) for c in range(3)], -1)
    # The white grows pinker and darker towards the back, where only wide open lids show it.
    back = smoothstep(1.3 * iris_angle, 85, angle)[..., None]
    white = sclera * (1 - back * np.array([0.25, 0.42, 0.42]))
    limbus = smoothstep(0.93 * iris_angle, 1.09 * iris_angle, angle)[..., None]
    return (out * (1 - limbus) + white * limbus).astype(np.float32)


def paint_eyes(eyes, head, neutral, atlas):
    """Rows of the atlas on the eyeballs and their colours: [n], [n, 3]."""

    rows, colors = [], []
    centers = head.eye_centers(neutral)
    points = atlas.at(neutral)
    for which, name in enumerate(("eye_left", "eye_right")):
        mine = np.flatnonzero(atlas.rows(name))
        direction = points[mine] - centers[which]
        direction /= np.maximum(np.linalg.norm(direction, axis=1, keepdims=True), 1e-6)
        rows.append(mine)
        colors.append(look_up(eyes, which, direction, (0.0, 0.0))[0])
    return np.concatenate(rows), np.concatenate(colors)
