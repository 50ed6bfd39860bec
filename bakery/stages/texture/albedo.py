"""Albedo of a face: the whole skin without light and highlights, in the tone of the person.

A photo alone cannot tell dark skin in bright light from pale skin in dim light. Two things say how
bright the light was: how photographers expose, and the white of the eyes, which people share.
"""

import cv2
import numpy as np

from bakery.generators.base import Subject
from bakery.geometry import harmonics
from bakery.geometry.color import LUMA
from bakery.geometry.fill import smoothstep
from bakery.landmarks import EYES, LIPS_OUTER, OVAL
from bakery.stages.atlas import make_atlas, uv_polygon
from bakery.stages.texture.unwrap import photo_light
from bakery.types import Fit

METER = 0.9  # luma that a white surface shows in a well exposed photo if it faces the camera
# The white of an eye, as `EyeMaps.white` reads it, in light of 1: between painted eyes (0.45, 0.38,
# 0.33) and those of london/train (0.43, 0.37, 0.35).
WHITE = np.array([0.445, 0.377, 0.349], np.float32)
EYE_SHARE, TINT_SHARE = 0.35, 0.8  # of what the eyes say of the light's level and of its colour
EYES_LOOK = 10.0  # degrees down: lids and brows hide the light from above
MOST = 3.0  # times brighter or darker than METER; more is a mistake
NEAR = 1 / 26  # of the atlas's side: around a texel, what its skin looks like without highlights
MOTTLE = 0.05  # of the skin's own brightness: so much it varies by itself
HAIRY = 0.6  # of the brightness around: what is darker is no bare skin
TINGE = 0.5  # of the skin's own colour in a highlight: cameras roll bright colours off
DIVIDED = 1.1  # times brighter than the skin around may become what was not so in the photo
PALEST = 0.45  # luma of the albedo of the palest face
BRIGHT = (1.0, 1.25)  # times the face's own brightness: none of its saturation is lost, it may be
BLOOM = 1 / 500  # of the side: highlights are no finer, hairs and pores are


def albedo_of(subject: Subject, fit: Fit) -> np.ndarray:
    """The albedo [T, T, 3] float32 linear 0..1 of a person, on the whole atlas.

    Eyes and mouth keep the shades and glints that they are painted with; only the light's level and
    colour are divided out of them.

    Args:
        subject: with T_0 and its eyes.
        fit: Fit of the photo that T_0 has its light from.

    References:
        Saito et al. 2017, section 4: the photo divided by the fitted shading.
    """
    head, size = subject.head, len(subject.texture)
    atlas = make_atlas(head, size).take("skin")
    vertices = head.vertices(subject.neutral, fit.expression, fit.gaze)
    shade = photo_light(fit, head, vertices, atlas)
    skin = atlas.paint(np.ones(len(atlas.index), np.float32))
    for ring, wide in ((LIPS_OUTER, 1.15), (EYES[0], 1.25), (EYES[1], 1.25)):
        skin *= 1 - uv_polygon(head, ring, wide, size)
    light = light_on(subject, fit)
    face = (skin * uv_polygon(head, OVAL, 0.8, size)) > 0
    bare = subject.texture / shade.astype(np.float32)
    light *= max(1, float(np.median(bare[face] @ LUMA / (light @ LUMA))) / PALEST)
    albedo = without_highlights(_evened(bare, subject.texture, skin) / light, skin)
    albedo = saturated(albedo, subject.texture, skin, face)
    return make_atlas(head, size).fill_gutter(np.clip(albedo, 0, 1).astype(np.float32))


def light_on(subject: Subject, fit: Fit) -> np.ndarray:
    """What a white surface shows in a photo if it faces the camera: [3] linear.

    The photometric fit's own answer is no help: it takes half of the tone of the skin for light, as
    its basis has seen few tones (docs/log-albedo.md).

    Args:
        subject: its eyes; fit: Fit of the photo.
    """
    shown = subject.eyes.white[subject.eyes.white.any(1)]
    if not len(shown):
        return np.full(3, METER)
    white = shown.mean(0)
    angle = np.radians(EYES_LOOK)
    down = np.array([0, -np.sin(angle), np.cos(angle)]) @ subject.light_rotation.T
    ahead = np.array([0.0, 0.0, 1.0])
    on_eyes, on_face = (harmonics.irradiance(n, fit.light) @ LUMA for n in (down, ahead))
    level = white @ LUMA / (WHITE @ LUMA) * np.clip(on_face / max(on_eyes, 1e-3), 0.5, 2)
    level = METER * np.clip(level / METER, 1 / MOST, MOST) ** EYE_SHARE
    tint = (white / (white @ LUMA)) / (WHITE / (WHITE @ LUMA))
    found: np.ndarray = level * np.clip(tint, 0.5, 2) ** TINT_SHARE
    return found


def _evened(bare: np.ndarray, texture: np.ndarray, skin: np.ndarray) -> np.ndarray:
    """Skin that its light was divided out of, where that was too much.

    Second-order light knows nothing of what is reflected from below: under nose and brows, and
    beside a shadow, it is too dark. What is brighter than the skin around it by the division alone is
    held back.

    Args:
        bare: [T, T, 3] linear, divided; texture: [T, T, 3] as the photo shows it.
        skin: [T, T] 0..1, where to look.
    """
    sigma = NEAR * len(bare)
    over, before = (
        np.log(luma / np.maximum(_blurred(luma, skin, sigma), 1e-4))
        for luma in (np.maximum(each @ LUMA, 1e-4) for each in (bare, texture))
    )
    excess = np.maximum(over - np.maximum(before, np.log(DIVIDED)), 0) * skin
    smooth = np.minimum(_smooth(excess, BLOOM * len(bare)), excess)
    held: np.ndarray = bare * np.exp(-smooth)[..., None]
    return held


def without_highlights(albedo: np.ndarray, skin: np.ndarray) -> np.ndarray:
    """Take off what oil and water on the skin mirror.

    A highlight adds the colour of the lamp to that of the skin: what is brighter than the skin around
    it and less saturated by just so much is one. Freckles, moles, brows and beards are darker; paler
    skin is not less saturated by as much as it is brighter.

    Args:
        albedo: [T, T, 3] linear, relative to a white light.
        skin: [T, T] 0..1, where to look.

    Returns:
        [T, T, 3] linear.

    References:
        Shafer, "Using color to separate reflection components", Color Research and Application
        10(4), 1985.
    """
    size = albedo.shape[0]
    luma = np.maximum(albedo @ LUMA, 1e-4)
    bare = skin * (luma > HAIRY * _blurred(luma, skin, NEAR * size))
    matt = bare * (luma < _blurred(luma, bare, NEAR * size))  # the darker half of what is around
    base = _blurred(albedo, matt, NEAR * size)
    # albedo = share * base + mirrored * white, by least squares.
    white = np.ones(3, np.float32)
    bb, bw, ww = (base**2).sum(-1), base @ white, 3.0
    cb, cw = (albedo * base).sum(-1), albedo @ white
    mirrored = (bb * cw - bw * cb) / np.maximum(bb * ww - bw**2, 1e-6)
    brighter = np.maximum(luma - (1 + MOTTLE) * (base @ LUMA), 0) * skin
    mirrored = np.clip(mirrored - MOTTLE * (base @ LUMA), 0, brighter)
    mirrored = np.minimum(_smooth(mirrored, BLOOM * size), brighter)[..., None]
    color = TINGE * albedo / luma[..., None] + 1 - TINGE
    out: np.ndarray = np.maximum(albedo - mirrored * color, 0.3 * albedo)
    return out


def saturated(
    albedo: np.ndarray, texture: np.ndarray, skin: np.ndarray, face: np.ndarray
) -> np.ndarray:
    """Give skin that was bright in the photo the saturation of the rest of the face.

    A broad sheen, and a camera that rolls bright colours off, leave a forehead of the right brightness
    that is grey. Neither has an edge, so `without_highlights` does not see them.

    Args:
        albedo: [T, T, 3] linear; texture: [T, T, 3] as the photo shows it.
        skin: [T, T] 0..1, where to look.
        face: [T, T] bool, whose tone is that of the person.

    Returns:
        [T, T, 3] linear, of the luma that it had.
    """
    sigma = NEAR * len(albedo)
    smooth = _blurred(albedo, skin, sigma)
    tint = smooth / np.maximum(smooth @ LUMA, 1e-4)[..., None] - 1  # of luma 0
    typical = np.median(tint[face], 0)
    share = tint @ typical / max(typical @ typical, 1e-6)
    shown = _blurred(texture @ LUMA, skin, sigma)
    bright = smoothstep(*BRIGHT, shown / max(float(np.median(shown[face])), 1e-4)) * skin
    more = (bright * np.clip(1 - share, 0, 1))[..., None] * (typical - (typical @ LUMA))
    out: np.ndarray = albedo + (albedo @ LUMA)[..., None] * more
    return out


def _smooth(values: np.ndarray, sigma: float) -> np.ndarray:
    blurred: np.ndarray = cv2.GaussianBlur(values.astype(np.float32), (0, 0), max(sigma, 0.5))
    return blurred


def _blurred(values: np.ndarray, weight: np.ndarray, sigma: float) -> np.ndarray:
    """Weighted Gaussian mean of values [T, T, ...], at a quarter of the size."""
    size = values.shape[0] // 4
    shape = (*weight.shape, *[1] * (values.ndim - 2))

    def small(picture: np.ndarray) -> np.ndarray:
        less = cv2.resize(picture, (size, size), interpolation=cv2.INTER_AREA)
        return cv2.GaussianBlur(less, (0, 0), sigma / 4)

    weight = weight.astype(np.float32)
    total = small((values * weight.reshape(shape)).astype(np.float32))
    mean = total / np.maximum(small(weight), 1e-4).reshape(size, size, *[1] * (values.ndim - 2))
    grown: np.ndarray = cv2.resize(mean, values.shape[1::-1], interpolation=cv2.INTER_LINEAR)
    return grown
