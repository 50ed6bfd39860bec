"""T_0 of the skin: observed where the photo shows it, mirrored or inferred elsewhere."""

from dataclasses import dataclass

import cv2
import numpy as np

from bakery.geometry import harmonics, rotation
from bakery.geometry.color import LUMA
from bakery.geometry.fill import diffuse, smoothstep
from bakery.geometry.mesh import vertex_normals
from bakery.geometry.noise import value_noise
from bakery.geometry.sample import bicubic, bilinear
from bakery.landmarks import EYES, LIPS_INNER, OVAL
from bakery.stages.atlas import soften, uv_polygon

OBSERVED, MIRRORED, INFERRED, PAINTED = 1, 2, 3, 4  # codes of coverage.exr; 0 is outside all charts
FAR_TONE = 0.003  # how strongly unseen skin leans to the median of the face, against its borders
MUCOSA = np.array([0.92, 0.66, 0.68], np.float32)  # wet inside of the lips over their outside
GRAIN_WAVELENGTHS = (0.9, 1.8, 3.6)  # mm; pores to small blotches


@dataclass(frozen=True)
class SkinTexture:
    """The skin of one person on the atlas."""

    color: np.ndarray  # [T, T, 3] float32 linear
    source: np.ndarray  # [T, T] uint8
    facing: np.ndarray  # [T, T] float32
    tone: np.ndarray  # [3] linear, median of the well-seen face


def reflectance(linear_points, shade):
    """Divide colours [N, 3] by shading [N, 3], both linear."""
    return linear_points / np.maximum(shade, 1e-3)


def shading(normals, light):
    """Irradiance [N, 3] at camera-space normals, relative to that of a frontal normal.

    Second-order harmonics swing wildly on sides the photo never showed, so the ratio is held to
    0.45..1.5 around the frontal value.
    """
    front = harmonics.irradiance(np.array([[0.0, 0.0, 1.0]]), light)
    ratio = harmonics.irradiance(normals, light) / np.maximum(front, 1e-4)
    gray = ratio @ LUMA
    return np.clip(gray, 0.45, 1.5)[:, None] * np.ones(3, np.float32)


def rims(points, shape):
    """How near a pixel [H, W] 0..1 is to the edge of a lid or to the line between the lips.

    There the surface turns away from the camera, yet what the photo shows is its own colour: the
    lash line, the line of the mouth.
    """
    out = np.zeros(shape, np.float32)
    for ring, band in ((EYES[0], 0.07), (EYES[1], 0.07), (LIPS_INNER, 0.05)):
        curve = points[ring]
        width = np.ptp(curve[:, 0])
        line = np.ones(shape, np.uint8)
        cv2.polylines(line, [np.round(curve * 16).astype(np.int32)], True, 0, shift=4)
        away = cv2.distanceTransform(line, cv2.DIST_L2, 3)
        out = np.maximum(out, smoothstep(band * width, 0.5 * band * width, away))
    return out.astype(np.float32)


def open_lids(skin_mask, points, occluder):
    """The mask with the lids let in up to their edge, where nothing hides them.

    A segmentation leaves a margin around the eyes; without it the lash line would be lost and lids
    would end in bare skin.

    Args:
        points: [L, 2] pixels.
        occluder: [H, W] 0..1, what hides the face.
    """
    out = skin_mask.copy()
    for lids in EYES:
        ring = points[lids]
        width = np.ptp(ring[:, 0])
        eye = np.zeros(out.shape, np.uint8)
        cv2.fillPoly(eye, [np.round(ring * 16).astype(np.int32)], 1, shift=4)
        away = cv2.distanceTransform(1 - eye, cv2.DIST_L2, 3)
        around = smoothstep(0.30 * width, 0.18 * width, away) * (1 - eye)
        out = np.maximum(out, around.astype(np.float32))
    return out * (1 - occluder)


def complete_skin(linear, mattes, points, fit, head, vertices, atlas, visibility):
    """Unwrap the photo and fill what it does not show.

    Args:
        linear: [H, W, 3] float32 photo, already filtered to about the atlas's density.
        mattes: texture.hair.Mattes of the photo.
        points: [L, 2] pixels, landmarks of the photo.
        fit: Fit of the photo.
        vertices: [V, 3] mm, the shape as it stands in the photo.
        atlas: Atlas of the head's skin.
        visibility: Visibility of that atlas through the photo's camera.

    Returns:
        SkinTexture.
    """
    pixels = visibility.pixels
    # There is no second view that could know better, so even slanting skin counts.
    weight = visibility.weight(grazing=88.0, full=76.0)
    weight = np.maximum(
        weight, visibility.visible * bilinear(rims(points, linear.shape[:2]), pixels)
    )
    mask = open_lids(mattes.skin, points, mattes.occluder)
    weight *= smoothstep(0.5, 0.95, bilinear(mask, pixels))
    color = np.maximum(bicubic(linear, pixels), 0)

    # Light is taken out before anything is continued across the head, and put back at the end.
    turn = rotation.matrix(fit.camera.rotation)
    normals = atlas.at(vertex_normals(vertices, head.faces) @ turn.T)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-6)
    shade = shading(normals, fit.light)
    albedo = reflectance(color, shade)

    on_skin = atlas.paint(np.ones(len(pixels), np.float32))
    seen = soften(atlas.paint(weight), on_skin)
    observed = atlas.paint(albedo)
    well = (seen > 0.9).reshape(-1)[atlas.index]
    tone = np.median(albedo[well], 0) if well.any() else np.full(3, 0.3, np.float32)

    # The other half of the face stands in where it was seen and this one was not.
    seen_mirror, mirror = seen[:, ::-1], observed[:, ::-1]
    both = np.minimum(seen, seen_mirror)
    matched = mirror * np.exp(diffuse(log_ratio(observed, mirror), both))
    mirror_weight = seen_mirror * (1 - seen)
    known = seen + mirror_weight
    joined = (observed * seen[..., None] + matched * mirror_weight[..., None]) / np.maximum(
        known, 1e-6
    )[..., None]

    # What nobody saw: tone continued from the borders and fading to the median far away, with grain.
    # The far tone joins the diffusion as a faint opinion held everywhere.
    low = cv2.GaussianBlur(joined * known[..., None], (0, 0), atlas.size / 170)
    low /= np.maximum(cv2.GaussianBlur(known, (0, 0), atlas.size / 170), 1e-3)[..., None]
    rim = atlas.size // 100 | 1  # borders of what was seen are the least sure: hair, halo, glare
    firm = (known > 0.8).astype(np.float32)
    # Well within the contour, edges are lids and lips, and as good as their middle.
    inner = cv2.erode(firm, np.ones((3, 3), np.uint8)) * uv_polygon(head, OVAL, 0.8, atlas.size)
    trusted = np.maximum(cv2.erode(firm, np.ones((rim, rim), np.uint8)), inner)
    anchored = np.maximum(trusted, FAR_TONE * on_skin)
    values = np.where(trusted[..., None] > 0, low, tone)
    base = diffuse(values, anchored)
    grain = grain_like(joined, trusted * on_skin, vertices, atlas)
    inner_lips = cv2.GaussianBlur(
        uv_polygon(head, LIPS_INNER, 1.0, atlas.size), (0, 0), atlas.size / 300
    )
    mucosa = 1 - (1 - MUCOSA) * inner_lips[..., None]
    inferred = base * mucosa * np.exp(grain)[..., None]
    coverage = np.clip(known, 0, 1)[..., None]
    albedo_full = joined * coverage + inferred * (1 - coverage)

    lit = albedo_full * np.where(on_skin[..., None] > 0, atlas.paint(shade), 1)
    source = np.select(
        [on_skin == 0, seen >= 0.5, known >= 0.5], [0, OBSERVED, MIRRORED], INFERRED
    ).astype(np.uint8)
    return SkinTexture(lit, source, (seen * on_skin).astype(np.float32), tone)


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


def normalized_blur(values, weight, sigma):
    """Gaussian blur of values [T, T] that ignores texels of weight 0."""
    total = cv2.GaussianBlur(values * weight, (0, 0), sigma)
    return total / np.maximum(cv2.GaussianBlur(weight, (0, 0), sigma), 1e-3)


def texel_spacing(position, weight):
    """Median distance of neighbouring texels [T, T, 3] on the well-seen skin, mm."""
    step = np.linalg.norm(np.diff(position, axis=1), axis=2)
    both = np.minimum(weight[:, 1:], weight[:, :-1]) > 0.9
    return float(np.median(step[both])) if both.any() else 0.3
