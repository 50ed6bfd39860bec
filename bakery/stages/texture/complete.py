"""The whole skin from the part that a photo shows: observed, mirrored, or inferred elsewhere."""

from dataclasses import dataclass

import cv2
import numpy as np

from bakery.geometry.color import LUMA
from bakery.geometry.fill import diffuse, normalized_blur, smoothstep
from bakery.geometry.noise import value_noise
from bakery.heads.base import HeadModel
from bakery.landmarks import LIPS_INNER, OVAL
from bakery.stages.atlas import Atlas, make_atlas, uv_polygon
from bakery.stages.texture.correlations import (
    DENSITY,
    Correlations,
    Windows,
    correlations,
    windows_of,
)
from bakery.stages.texture.database import blended, load_database
from bakery.stages.texture.evening import alike, evened, without_holes
from bakery.stages.texture.grain import own_grain
from bakery.stages.texture.occlusion import shade_of
from bakery.stages.texture.shadows import LIKELY, darker_half, darkness, leak, odd
from bakery.stages.texture.shaped import shaped
from bakery.stages.texture.synthesize import synthesized
from bakery.stages.texture.tone import likely_tone
from bakery.stages.texture.unwrap import PartialAlbedo, inner_face

OBSERVED, MIRRORED, INFERRED, PAINTED = 1, 2, 3, 4  # codes of coverage.exr; 0 is outside all charts
FAR_TONE = 0.003  # how strongly unseen skin leans to what is likely, against its borders
SHARED = 0.05  # weight that both halves must reach somewhere before their colours are compared
FADE = 1 / 60  # of the atlas's side, blur of the borders of what is known off the face
MUCOSA = np.array([0.92, 0.66, 0.68], np.float32)  # wet inside of the lips over their outside
GRAIN_WAVELENGTHS = (0.9, 1.8, 3.6)  # mm; pores to small blotches


@dataclass(frozen=True)
class CompleteAlbedo:
    """The skin's albedo on the whole atlas."""

    albedo: np.ndarray  # [T, T, 3] float32 linear
    source: np.ndarray  # [T, T] uint8
    tone: np.ndarray  # [3] linear, median of the well-seen face
    lift: np.ndarray  # [T, T] log of how much lighter shadow on seen skin was made


def complete(
    partial: PartialAlbedo,
    head: HeadModel,
    vertices: np.ndarray,
    atlas: Atlas,
    method: str = "quick",
) -> CompleteAlbedo:
    """Fill in what a photo does not show.

    Args:
        vertices: [V, 3] mm, the shape as it stands in the photo.
        atlas: Atlas of the head's skin.
        method: of texture.METHODS. "none" continues tones smoothly; "mirror" takes the other half of the face
            where only that was seen, and adds noise and the shade of folds; "quick" adds likely tones of the face and the
            person's own grain, shaped as the skin database says; "synthesize" goes on from there
            until hidden skin has the energies that the database says, lighter and darker.

    Raises:
        ModelError: "quick" or "synthesize", and the skin database cannot be read.
    """
    on_skin, seen, observed = partial.on_skin, partial.seen, partial.albedo
    well = seen > 0.9
    tone = np.median(observed[well], 0) if well.any() else np.full(3, 0.3, np.float32)
    lit = partial.even * (1 - darker_half(observed, seen))
    joined, known, even = observed, seen, lit
    if method != "none":
        joined, known, even = with_mirror(observed, seen, lit)
    face, trusted = inner_face(head, atlas.size), _trusted(known, head, atlas.size)
    low = normalized_blur(joined, known, atlas.size / 170)
    wanted, lift = None, np.zeros_like(known)
    if method in ("quick", "synthesize"):
        database = load_database()
        sure = trusted * even
        likely = likely_tone(alike(joined, sure), sure, head, atlas, database)
        gap = darkness(likely, joined, known * partial.plain)
        kept = (1 - leak(gap)) * (1 - odd(gap, even) * (1 - face))
        even = even * (1 - smoothstep(*LIKELY, gap))
        known, sure = known * kept, trusted * even * kept
        likely = likely_tone(alike(joined, sure), sure, head, atlas, database)
        twice = without_holes(np.minimum(seen, seen[:, ::-1]))
        skin = evened(joined, known, even, twice, sure, likely, partial.plain, face, on_skin)
        joined, known, base, lift = skin.albedo, skin.known, skin.tone, skin.lift
        tone = np.median(joined[well], 0) if well.any() else tone
        trusted = np.minimum(trusted, known)
        grain = own_grain(joined, trusted * on_skin, vertices, atlas)
        if grain is not None:
            windows = windows_of(head, atlas)
            wanted = blended(correlations(joined, known, windows), database)
            base = base * np.exp(shaped(grain, base, wanted, windows))
    else:
        anchored = np.maximum(trusted, FAR_TONE * on_skin)
        base = diffuse(np.where(trusted[..., None] > 0, low, tone), anchored)
    if method == "mirror":
        base = base * np.exp(grain_like(joined, trusted * on_skin, vertices, atlas))[..., None]
    inner_lips = cv2.GaussianBlur(
        uv_polygon(head, LIPS_INNER, 1.0, atlas.size), (0, 0), atlas.size / 300
    )
    inferred = base * (1 - (1 - MUCOSA) * inner_lips[..., None])
    if method != "none":  # within the face likely tones have the shade of their folds
        folds = shade_of(partial.openness)
        inferred *= 1 + (folds - 1) * (1 - face[..., None])
    share = faded(np.clip(known, 0, 1), face)[..., None]
    source = np.select(
        [on_skin == 0, seen >= 0.5, known >= 0.5], [0, OBSERVED, MIRRORED], INFERRED
    ).astype(np.uint8)
    albedo = joined * share + inferred * (1 - share)
    if method == "synthesize" and wanted is not None:
        albedo = _at_density(albedo, 1 - share[..., 0], on_skin, wanted, head, windows)
    return CompleteAlbedo(albedo, source, tone, lift)


def _at_density(
    albedo: np.ndarray,
    hidden: np.ndarray,
    on_skin: np.ndarray,
    wanted: Correlations,
    head: HeadModel,
    windows: Windows,
) -> np.ndarray:
    """`synthesized`, at DENSITY where the atlas is denser: of finer octaves the database knows nothing.

    They stay those of the person's own grain.
    """
    if windows.atlas.size <= DENSITY:
        return synthesized(albedo, hidden, on_skin, wanted, windows)
    small, mask, skin = (
        cv2.resize(picture, (DENSITY, DENSITY), interpolation=cv2.INTER_AREA)
        for picture in (albedo, hidden, on_skin)
    )
    coarse = windows_of(head, make_atlas(head, DENSITY).take("skin"))
    changed = synthesized(small, mask, (skin > 0.5).astype(np.float32), wanted, coarse)
    change = log_ratio(changed, small).mean(2) * (skin > 0.5)
    size = (windows.atlas.size,) * 2
    large = cv2.resize(change, size, interpolation=cv2.INTER_CUBIC)
    return albedo * np.exp(large * np.clip(hidden, 0, 1))[..., None]


def with_mirror(
    observed: np.ndarray, seen: np.ndarray, even: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The other half of the face stands in where it was seen and this one was not.

    Args:
        observed: [T, T, 3]; seen, even: [T, T] 0..1, as of PartialAlbedo.

    Returns:
        albedo of both joined [T, T, 3], how surely that is known [T, T], and how surely its tone is
        the skin's own [T, T].
    """
    seen_mirror, mirror = seen[:, ::-1], observed[:, ::-1]
    both = np.minimum(seen * even, seen_mirror * even[:, ::-1])
    if both.max() > SHARED:
        mirror = mirror * np.exp(diffuse(log_ratio(observed, mirror), both))
    weight = seen_mirror * (1 - seen)
    known = seen + weight
    share = np.maximum(known, 1e-6)
    joined = (observed * seen[..., None] + mirror * weight[..., None]) / share[..., None]
    return joined, known, (even * seen + even[:, ::-1] * weight) / share


def faded(known: np.ndarray, face: np.ndarray) -> np.ndarray:
    """How much of what is known [T, T] 0..1 is shown: off the face its borders fade out inwards.

    There tones are the least sure, and a line where the photo ends shows from the side.

    Args:
        known: [T, T] 0..1; face: [T, T] 0..1, 1 well within the face.
    """
    around = cv2.GaussianBlur(known, (0, 0), FADE * len(known))
    return known * (face + (1 - face) * np.float32(smoothstep(0.5, 0.9, around)))


def _trusted(known: np.ndarray, head: HeadModel, size: int) -> np.ndarray:
    """What may be continued [T, T] 0 or 1: borders of what was seen are the least sure.

    They hold hair, halo and glare. Well within the contour, though, edges are lids and lips, and as
    good as their middle.
    """
    rim = size // 100 | 1
    firm = (known > 0.8).astype(np.float32)
    inner = cv2.erode(firm, np.ones((3, 3), np.uint8)) * uv_polygon(head, OVAL, 0.8, size)
    out: np.ndarray = np.maximum(cv2.erode(firm, np.ones((rim, rim), np.uint8)), inner)
    return out


def log_ratio(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """log(a / b) of linear colours, held to a factor of two."""
    return np.clip(np.log(np.maximum(a, 1e-3)) - np.log(np.maximum(b, 1e-3)), -0.7, 0.7)


def grain_like(albedo, weight, vertices, atlas):
    """Noise [T, T] (log luminance) with the band energies of the skin that was seen."""
    luminance = np.log(np.maximum(albedo @ LUMA, 1e-3))
    points = atlas.at(vertices)
    noise = np.zeros(len(points), np.float32)
    spacing = texel_spacing(atlas.paint(points), weight)
    for octave, wavelength in enumerate(GRAIN_WAVELENGTHS):
        sigma = max(0.35 * wavelength / spacing, 0.5)
        fine = normalized_blur(luminance, weight, sigma)
        coarse = normalized_blur(luminance, weight, 2 * sigma)
        inner = cv2.erode(weight, np.ones((3, 3))) > 0.9
        # Median, not mean: brows, nostrils and moles are not grain.
        energy = np.median(np.abs(fine - coarse)[inner]) / 0.6745 if inner.any() else 0.01
        noise += np.float32(min(energy, 0.05)) * value_noise(points, wavelength, octave)
    return atlas.paint(noise)


def texel_spacing(position, weight):
    """Median distance of neighbouring texels [T, T, 3] on the well-seen skin, mm."""
    step = np.linalg.norm(np.diff(position, axis=1), axis=2)
    both = np.minimum(weight[:, 1:], weight[:, :-1]) > 0.9
    return float(np.median(step[both])) if both.any() else 0.3
