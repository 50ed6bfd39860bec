"""Skin of photographed people on the atlas, for subjects that are painted to train on.

A folder of such skins is made from photographs by `bakery synth skins`; it never ships. Each file is
one person's reflectance: the unwrapped photo with its light divided out. A painted subject mixes two
of them, so that none of the people looks out of a training picture.
"""

from functools import lru_cache
from pathlib import Path

import cv2
import numpy as np

from bakery.errors import InputError
from bakery.geometry.color import LUMA
from bakery.geometry.fill import diffuse, smoothstep
from bakery.geometry.noise import value_noise
from bakery.landmarks import FACE, OVAL
from bakery.stages.atlas import make_atlas
from bakery.stages.texture.complete import INFERRED
from bakery.stages.texture.neutral import prepare
from bakery.stages.texture.unwrap import photo_shade
from bakery.synth.skin import HAEMOGLOBIN, MELANIN

TEXELS = 512  # side of a skin; 0.5 mm on the face
INNER = (7.0, 17.0)  # mm from the landmarks within the contour: the photo counts, and ended
EXPOSED = 0.85  # reflectance of what a photo shows as 1 at a frontal normal
FEATURE = 24.0  # texels, blur that parts a skin's tone from its features


def unwrap(photo, landmarks, fit, neutral, head, mattes):
    """The reflectance of a photographed person.

    Args, as for `stages.texture.neutral.prepare`.

    Returns:
        albedo [T, T, 3] float32 linear; meant for the skin parts of the atlas only.
    """
    prepared = prepare(photo, landmarks, fit, neutral, head, mattes, TEXELS, method="mirror")
    atlas = make_atlas(head, TEXELS)
    vertices = head.vertices(neutral, fit.expression, fit.gaze)
    shade = atlas.paint(photo_shade(fit, head, vertices, atlas).astype(np.float32), 1)
    skin = atlas.paint(atlas.rows("skin").astype(np.float32))
    albedo = EXPOSED * prepared.subject.texture / np.where(shade > 0, shade, 1)
    sure = skin * (prepared.source != INFERRED)
    # The throat lies in the chin's shadow and hair darkens the jaw: both go on from the face.
    inner = atlas.paint(atlas.at(_inner_face(head)[:, None])[:, 0])
    smooth = diffuse(albedo, sure * (inner > 0.9))
    albedo = np.where(skin[..., None] > 0, smooth + (albedo - smooth) * inner[..., None], smooth)
    return np.clip(albedo, 0.004, 0.95).astype(np.float32)


def _inner_face(head):
    """1 at vertices [V] well within the face's contour, fading to 0 behind it."""
    marks = head.landmarks(head.mean)[np.setdiff1d(np.arange(FACE), OVAL)]
    distance = np.full(len(head.mean), np.inf)
    for mark in marks:
        distance = np.minimum(distance, ((head.mean - mark) ** 2).sum(1))
    return smoothstep(*reversed(INNER), np.sqrt(distance)).astype(np.float32)


def save(path, albedo):
    """Write a skin [T, T, 3] as .npz, half precision."""
    np.savez_compressed(path, albedo=albedo.astype(np.float16))


@lru_cache(maxsize=96)
def load(path):
    """Read a skin [T, T, 3]; kept, since subjects draw from the same few dozen."""
    with np.load(path) as file:
        return file["albedo"].astype(np.float32)


def skins_of(folder, head):
    """The skins in a folder that were unwrapped on this head: [Path].

    Raises:
        InputError: there is none.
    """
    found = sorted(Path(folder).glob(f"{head.name}-*.npz"))
    if not found:
        raise InputError(
            f"{folder}: no skins of head {head.name}; make them with `bakery synth skins`"
        )
    return found


def by_tone(paths):
    """Three lists of skins, dark to light: drawn from in turn, no tone is rare."""
    ordered = sorted(paths, key=lambda path: _level(load(path)))
    return [list(part) for part in np.array_split(np.array(ordered, object), 3) if len(part)]


def mixed(rng, paths, points):
    """A skin nobody has: the features of two people, a tone between theirs.

    Args:
        rng: numpy Generator.
        paths: skins to draw from.
        points: [T, T, 3] mm, the mean head at the texels.

    Returns:
        albedo [T, T, 3] float32 linear.
    """
    first, *others = (load(paths[k]) for k in rng.integers(len(paths), size=5))
    # Of four, the one nearest in tone: very dark features on very light skin look like burns.
    second = min(others, key=lambda one: abs(_level(one) - _level(first)))
    tone_a, detail_a = _parted(_turned(rng, first))
    tone_b, detail_b = _parted(_turned(rng, second))
    share = _share(rng, points)[..., None]
    lean = rng.uniform(0.0, 1.0)
    tone = tone_a + lean * (tone_b - tone_a)
    detail = detail_a * (1 - share) + detail_b * share
    shift = rng.normal(size=2) * [0.14, 0.07]
    pigment = shift[0] * MELANIN + shift[1] * HAEMOGLOBIN
    gain = rng.uniform(0.85, 1.2)
    albedo = np.exp(tone + gain * detail - pigment)
    return np.clip(albedo, 0.004, 0.95).astype(np.float32)


def _level(albedo):
    """Log-luminance of a skin as a whole."""
    return float(np.log(albedo[::16, ::16] @ LUMA).mean())


def _turned(rng, albedo):
    """The skin or its mirror image: atlases are symmetric (`stages.texture_complete`)."""
    return albedo[:, ::-1] if rng.random() < 0.5 else albedo


def _parted(albedo):
    """log albedo as smooth tone and features [T, T, 3] each."""
    whole = np.log(np.maximum(albedo, 4e-3))
    small = cv2.resize(whole, (TEXELS // 8, TEXELS // 8), interpolation=cv2.INTER_AREA)
    tone = cv2.resize(cv2.GaussianBlur(small, (0, 0), FEATURE / 8), (TEXELS, TEXELS))
    return tone, whole - tone


def _share(rng, points):
    """How much of the second person's features each texel takes [T, T]: whole regions, no ghosts."""
    if rng.random() < 0.35:
        return np.zeros(points.shape[:2], np.float32)
    wide = points.reshape(-1, 3) * np.array([0.6, 1.0, 1.0])  # brows and lids stay pairs
    wide[:, 0] = np.abs(wide[:, 0])
    noise = value_noise(wide, 55.0, int(rng.integers(2**31))).reshape(points.shape[:2])
    return smoothstep(-0.15, 0.15, noise + rng.normal() * 0.3).astype(np.float32)
