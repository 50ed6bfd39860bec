"""Learns the albedo basis from portraits of many people taken in one light.

Every person is fitted by landmarks, the photo read at each texel of the chart
(`stages.fit_albedo`), the common light divided out, and what is left analysed into a mean and
principal modes, each face once as it is and once mirrored.
"""

import hashlib
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from bakery.formats.tensors import write_tensors
from bakery.geometry import camera as cameras
from bakery.geometry import harmonics, mesh
from bakery.geometry.color import LUMA, to_linear
from bakery.geometry.raster import rasterize
from bakery.geometry.sample import bilinear
from bakery.landmarks import FACE
from bakery.stages.fit import albedo as fit_albedo
from bakery.stages.fit.albedo import AlbedoBasis
from bakery.stages.fit.warp import residual_offsets

SKIN_LUMA = 0.35  # mean albedo of skin by convention: light and albedo share one free scale


@dataclass(frozen=True)
class AlbedoOptions:
    size: int = 80  # texels on a side of the chart: 2.5 to 3 mm each
    modes: int = 30
    rounds: int = 12  # of filling what was not seen from the modes
    facing: float = 0.35  # cosine of the flattest skin that is read
    even: float = 0.12  # spread of albedo over one face that still counts as plain skin, when the
    # light is estimated: brows, lips and beards are outliers


DEFAULTS = AlbedoOptions()
ATTRIBUTION = (
    "Face Research Lab London Set, DeBruine, L. and Jones, B. (2017), CC BY 4.0, "
    "https://doi.org/10.6084/m9.figshare.5047666.v5"
)


@dataclass(frozen=True)
class ChartMap:
    """Where each texel of the chart lies on a head."""

    inside: np.ndarray  # [S, S] bool
    corners: np.ndarray  # [N, 3] vertices around each texel inside
    weight: np.ndarray  # [N, 3] barycentric


def chart_map(head, layout, size):
    """ChartMap of the front skin of a head."""
    points = fit_albedo.chart(head, layout) * size
    faces = head.faces[head.part_faces("skin")]
    normals = mesh.vertex_normals(head.mean, head.faces)
    out = (normals[:, [0, 2]] * (head.mean[:, [0, 2]] - [0, fit_albedo.AXIS])).sum(1) > -20
    faces = faces[out[faces].all(1)]
    # The nearer to the front the better: the outer skin wins over nostrils and ear folds.
    radius = np.hypot(head.mean[:, 0], head.mean[:, 2] - fit_albedo.AXIS)
    seen = rasterize(points, 400.0 - radius, faces, (size, size))
    inside = seen.face >= 0
    return ChartMap(inside, faces[seen.face[inside]], seen.barycentric[inside].astype(np.float64))


def head_layout(head):
    """Where a head's own landmarks lie on the unbent cylinder: the layout it defines."""
    return fit_albedo.cylinder(head.landmarks(head.mean)[:FACE].astype(np.float64))


def unwrap_photo(photo, placed, head, where, skin, options):
    """Colour, normal and trust of each texel of the chart in one photo.

    Args:
        photo: Photo; placed: its Fit (with warp); where: ChartMap; skin: [H, W] 0..1.

    Returns:
        color [N, 3] linear, normals [N, 3] camera space, weight [N] 0..1.
    """
    neutral = head.neutral(placed.identity, residual_offsets(head, placed.residual))
    vertices = head.vertices(neutral, placed.expression, placed.gaze)
    inside = cameras.to_camera(vertices, placed.camera)
    pixels = cameras.project_camera(inside, placed.camera)
    normals = mesh.vertex_normals(inside, head.faces)

    def at_texels(values):
        return np.einsum("nkc,nk->nc", values[where.corners], where.weight)

    height, width = skin.shape
    shrink = 0.25
    small = (int(height * shrink), int(width * shrink))
    seen = rasterize(pixels * shrink, -inside[:, 2], head.faces, small)
    depth = np.where(np.isfinite(seen.depth), seen.depth, 1e6).astype(np.float32)
    point = at_texels(inside)
    pixel = cameras.project_camera(point, placed.camera)
    normal = at_texels(normals)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-9)
    toward = -point / np.linalg.norm(point, axis=1, keepdims=True)
    facing = (normal * toward).sum(1)
    visible = -point[:, 2] < bilinear(depth, pixel * shrink) + 4.0
    trust = bilinear(skin.astype(np.float32), pixel)
    blurred = cv2.GaussianBlur(to_linear(photo.encoded), (0, 0), 0.008 * width)
    weight = np.clip((facing - options.facing) / 0.3, 0, 1) * visible * (trust > 0.8)
    return bilinear(blurred, pixel), normal, weight


def common_light(colors, normals, trusts, options):
    """The light that all photos share, from the mean face, taken as of one even albedo.

    Args:
        colors [P, N, 3], normals [P, N, 3], trusts [P, N].

    Returns:
        [9, 3].
    """
    total = trusts.sum(0)[:, None] + 1e-6
    # Photos are of differently dark people: bring all to one exposure first.
    level = (colors @ LUMA * trusts).sum(1) / trusts.sum(1)
    color = (colors / level[:, None, None] * trusts[..., None]).sum(0) / total * level.mean()
    normal = (normals * trusts[..., None]).sum(0) / total
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-9)
    rows = harmonics.basis(normal)
    robust = total[:, 0] / len(colors)
    for _ in range(20):
        ridge = np.diag([0.0] + [1e-2] * 8) * robust.sum() * 0.05
        system = (rows * robust[:, None]).T @ rows + ridge
        light = np.linalg.solve(system, (rows * robust[:, None]).T @ color)
        shade = rows @ light
        ratio = (color @ LUMA) / np.maximum(shade @ LUMA, 1e-3) - 1
        robust = total[:, 0] / len(colors) / (1 + (ratio / options.even) ** 2)
    # What tints the mean face is skin, not light: the lamp is taken as white.
    light = (light @ LUMA)[:, None] * np.ones(3)
    return light / SKIN_LUMA


def analyse(albedo, trusts, mirror, options):
    """Mean and modes of faces that are partly unseen.

    Args:
        albedo: [P, N, 3]; trusts: [P, N]; mirror: [N] the texel on the other side of each.

    Returns:
        mean [N, 3], modes [A, N, 3] scaled to one standard deviation, share of variance explained.
    """
    albedo = np.concatenate([albedo, albedo[:, mirror]])
    trusts = np.concatenate([trusts, trusts[:, mirror]])
    known = trusts[..., None] > 0.05
    mean = (albedo * trusts[..., None]).sum(0) / (trusts.sum(0)[:, None] + 1e-6)
    never = trusts.sum(0) < 0.05 * len(trusts)
    usual = np.median(mean[~never], 0)
    mean[never] = usual
    gain = np.stack(
        [
            np.median((face / np.maximum(mean, 1e-3))[trust > 0.5], 0)
            for face, trust in zip(albedo, trusts)
        ]
    )
    filled = np.where(known, albedo, mean * gain[:, None])
    for _ in range(options.rounds):
        center = filled.mean(0)
        left, scale, right = np.linalg.svd(
            (filled - center).reshape(len(filled), -1), full_matrices=False
        )
        kept = left[:, : options.modes] * scale[: options.modes] @ right[: options.modes]
        blend = trusts[..., None]
        filled = blend * np.where(known, albedo, 0) + (1 - blend) * (
            kept.reshape(filled.shape) + center
        )
    spread = scale[: options.modes] / np.sqrt(len(filled))
    modes = (right[: options.modes] * spread[:, None]).reshape(options.modes, -1, 3)
    explained = float((scale[: options.modes] ** 2).sum() / (scale**2).sum())
    return center, modes, explained


def learn(subjects, head, options=DEFAULTS):
    """Learn an AlbedoBasis.

    Args:
        subjects: yields (Photo, Fit, skin [H, W]), all photos in the same light.
        head: the HeadModel of the fits; it defines the layout of the chart.

    Returns:
        AlbedoBasis, metrics dict.
    """
    layout = head_layout(head)
    where = chart_map(head, layout, options.size)
    read = [unwrap_photo(*subject[:2], head, where, subject[2], options) for subject in subjects]
    colors, normals, trusts = (np.stack(part) for part in zip(*read))
    light = common_light(colors, normals, trusts, options)
    shade = np.maximum(harmonics.basis(normals) @ light, 0.15)
    albedo = np.clip(colors / shade, 0.005, 1.2)
    number = np.full((options.size, options.size), -1)
    number[where.inside] = np.arange(where.inside.sum())
    mirror = number[:, ::-1][where.inside]
    mirror = np.where(mirror >= 0, mirror, np.arange(len(mirror)))
    mean, modes, explained = analyse(albedo, trusts, mirror, options)

    def picture(values):
        """Texels [N, 3] as a chart [S, S, 3], the border continued outward."""
        out = np.zeros((options.size, options.size, 3), np.float32)
        out[where.inside] = values
        filled = where.inside.astype(np.float32)
        for _ in range(options.size):
            if filled.min() > 0:
                break
            near = cv2.blur(filled, (3, 3))
            grown = cv2.blur(out * filled[..., None], (3, 3)) / np.maximum(near, 1e-6)[..., None]
            new = (filled == 0) & (near > 0)
            out[new], filled[new] = grown[new], 1
        return out

    basis = AlbedoBasis(
        mean=picture(mean),
        modes=np.stack([picture(mode) for mode in modes]),
        layout=layout.astype(np.float32),
        light=light.astype(np.float32),
    )
    metrics = {
        "subjects": len(colors),
        "texels_seen": int(where.inside.sum()),
        "variance_explained": round(explained, 4),
    }
    return basis, metrics


def save(basis, path):
    """Write the basis as safetensors, half precision."""
    arrays = {
        "mean": basis.mean.astype(np.float16),
        "modes": basis.modes.astype(np.float16),
        "layout": basis.layout.astype(np.float32),
        "light": basis.light.astype(np.float32),
    }
    write_tensors(arrays, path)


def model_card(basis, metrics, path, commit):
    """What the basis is, as a JSON table.

    Args:
        path: the saved basis, whose digest goes in.
        commit: of the code.
    """
    return {
        "name": "skin albedo basis",
        "purpose": "low-frequency skin reflectance for the photometric fit, linear Rec.709",
        "method": "landmark fit, unwrap, common light divided out, principal components; each face "
        "as it is and mirrored; deterministic, no seed",
        "data": "london/train, neutral",
        "attribution": ATTRIBUTION,
        "licence": "CC-BY-4.0",
        "limits": "one studio light, adults, 62 people; what tints the mean face counts as skin; "
        "brows, lips and beards are part of the modes; gloss is not modelled",
        "modes": len(basis.modes),
        "size": basis.mean.shape[0],
        "metrics": metrics,
        "commit": commit,
        "sha256": hashlib.sha256(Path(path).read_bytes()).hexdigest(),
    }
