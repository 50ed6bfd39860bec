"""Measures of the fit: landmark errors on photos, surface errors on synthetic portraits."""

from dataclasses import dataclass

import cv2
import numba
import numpy as np

from bakery import landmarks as marks
from bakery.formats.portraits import landmarks_of
from bakery.geometry import camera as cameras
from bakery.geometry import harmonics, mesh, rotation
from bakery.geometry.color import to_encoded
from bakery.geometry.raster import rasterize
from bakery.geometry.sample import interpolate
from bakery.heads.base import INTERIOR, weights
from bakery.stages.fit import albedo as fit_albedo
from bakery.stages.fit.warp import residual_offsets
from bakery.types import Camera, Landmarks, Photo

EXPRESSIONS_SHOWN = (  # of the synthetic portraits, in turn
    {},
    {"mouthSmileLeft": 0.36, "mouthSmileRight": 0.36, "jawOpen": 0.1},
    {"jawOpen": 0.35},
    {"browInnerUp": 0.5, "browOuterUpLeft": 0.4, "browOuterUpRight": 0.4},
)


def landmark_error(fit, points):
    """Distance of the fit's projected landmarks from given ones, in percent of the face size.

    Args:
        fit: Fit; points: [478, >= 2] pixels.

    Returns:
        dict: mean over all 468, over those off the contour, over lips and lids; the worst; all in
        percent of the distance of the outer eye corners.
    """
    points = np.asarray(points, np.float64)[: marks.FACE, :2]
    miss = np.linalg.norm(fit.landmarks_projected[: marks.FACE] - points, axis=1)
    percent = miss / marks.face_size(points) * 100
    inner = np.ones(marks.FACE, bool)
    inner[marks.OVAL] = False
    lids = np.concatenate([marks.EYE_LEFT, marks.EYE_RIGHT])
    return {
        "all": float(percent.mean()),
        "without_contour": float(percent[inner].mean()),
        "lips": float(percent[marks.LIPS].mean()),
        "lids": float(percent[lids].mean()),
        "worst": float(percent.max()),
    }


@dataclass(frozen=True)
class Synthetic:
    """A rendered head whose shape is known."""

    photo: Photo
    landmarks: Landmarks
    vertices: np.ndarray  # [V, 3] mm, camera space
    head: object  # the HeadModel it shows


def synthetic_portrait(head, rng, number=0, size=768, basis=None):
    """Render a random person of a head model: Lambertian skin in a random second-order light.

    Args:
        rng: numpy Generator; number: which of EXPRESSIONS_SHOWN.
        size: pixels on a side.

    Returns:
        Synthetic. Albedo is drawn from the same basis that the fit uses.
    """
    basis = basis or fit_albedo.load_albedo()
    identity = np.clip(rng.normal(size=len(head.identity_basis)), -2, 2) * 0.8
    expression = weights(EXPRESSIONS_SHOWN[number % len(EXPRESSIONS_SHOWN)])
    vertices = head.vertices(head.neutral(identity), expression).astype(np.float64)
    turn = rotation.yaw_pitch(rng.uniform(-15, 15), rng.uniform(-8, 8))
    camera = Camera(
        1.8 * size, np.full(2, size / 2), rotation.vector(turn), np.zeros(3), size, size
    )
    inside = vertices @ turn.T + [rng.uniform(-15, 15), rng.uniform(0, 30), -560.0]
    pixels = cameras.project_camera(inside, camera)
    faces = head.faces[head.part_faces("skin", *INTERIOR)]
    normals = mesh.vertex_normals(inside, head.faces)
    mean, modes = fit_albedo.vertex_albedo(head, basis)
    albedo = np.clip(mean + np.tensordot(rng.normal(size=len(modes)) * 0.8, modes, 1), 0.02, 1)
    albedo[head.part_vertices(*INTERIOR)] = 0.4
    light = basis.light * rng.uniform(0.7, 1.2)
    light[1:4] += rng.normal(size=(3, 1)) * 0.35
    light *= 1 + rng.normal(size=(1, 3)) * 0.04
    seen = rasterize(pixels, -inside[:, 2], faces, (size, size))
    color = albedo * np.maximum(harmonics.irradiance(normals, light), 0.02)
    image = interpolate(seen, color[faces])
    image[seen.face < 0] = 0.5
    image = cv2.GaussianBlur(image, (0, 0), 0.7)
    encoded = np.clip(to_encoded(image) + rng.normal(size=image.shape) * 0.008, 0, 1)
    points = cameras.project_camera(head.landmarks(inside), camera)
    photo = Photo(encoded.astype(np.float32), "")
    return Synthetic(photo, landmarks_of(points), inside, head)


def fitted_vertices(fit, head):
    """Vertices [V, 3] mm of a fit in camera space, with expression, gaze and warp."""
    neutral = head.neutral(fit.identity, residual_offsets(head, fit.residual))
    shape = head.vertices(neutral, fit.expression, fit.gaze)
    return cameras.to_camera(shape.astype(np.float64), fit.camera)


def face_region(head, layout):
    """Vertices of skin that lie inside the landmarks, eyes and mouth left to the photo: [N]."""
    skin = head.part_vertices("skin")
    points = fit_albedo.chart(head, layout)[skin]
    hull = cv2.convexHull(layout.astype(np.float32))[:, 0]
    normals = mesh.vertex_normals(head.mean, head.faces)[skin]
    inside = [cv2.pointPolygonTest(hull, (float(x), float(y)), False) > 0 for x, y in points]
    return skin[np.array(inside) & (normals[:, 2] > 0.1)]


def surface_error(truth, found, faces, start_truth, start_found, rounds=15):
    """Distances of points [N] mm from a surface, after the best similarity.

    Args:
        truth: [N, 3] points of the true surface, mm.
        found: [V, 3] and faces [F, 3]: the surface that was fitted.
        start_truth, start_found: [L, 3] corresponding points to begin the alignment with.
        rounds: of closest points and alignment.
    """
    scale, turn, shift = similarity(start_found, start_truth)
    subset = truth[:: max(1, len(truth) // 800)]
    for _ in range(rounds):
        moved = scale * found @ turn.T + shift
        closest, _ = closest_points(subset, moved, faces)
        # Bring the surface to the points: alignment of the closest points, seen from `found`.
        back = (closest - shift) @ turn / scale
        scale, turn, shift = similarity(back, subset)
    moved = scale * found @ turn.T + shift
    return closest_points(truth, moved, faces)[1]


def similarity(source, target):
    """Scale, rotation [3, 3] and shift [3] that bring points [N, 3] to others (Umeyama, 1991)."""
    a, b = source - source.mean(0), target - target.mean(0)
    left, values, right = np.linalg.svd(b.T @ a)
    sign = np.diag([1, 1, np.sign(np.linalg.det(left @ right))])
    turn = left @ sign @ right
    scale = (values * np.diag(sign)).sum() / (a**2).sum()
    return scale, turn, target.mean(0) - scale * turn @ source.mean(0)


def closest_points(points, vertices, faces):
    """Closest points [N, 3] of a surface to points [N, 3], and their distances [N]."""
    centers = vertices[faces].mean(1)
    reach = np.linalg.norm(vertices[faces] - centers[:, None], axis=2).max(1)
    return _closest(
        np.ascontiguousarray(points, np.float64),
        np.ascontiguousarray(vertices[faces], np.float64),
        np.ascontiguousarray(centers, np.float64),
        reach,
    )


@numba.njit(cache=True, nogil=True)
def _closest(points, corners, centers, reach):
    out = np.zeros_like(points)
    best = np.full(len(points), 1e30)
    for n in range(len(points)):
        p = points[n]
        for f in range(len(corners)):
            dx, dy, dz = p[0] - centers[f, 0], p[1] - centers[f, 1], p[2] - centers[f, 2]
            if dx * dx + dy * dy + dz * dz > (best[n] + reach[f]) ** 2:
                continue
            q = _closest_on_triangle(p, corners[f, 0], corners[f, 1], corners[f, 2])
            distance = np.sqrt(((q - p) ** 2).sum())
            if distance < best[n]:
                best[n] = distance
                out[n] = q
    return out, best


@numba.njit(cache=True, nogil=True)
def _closest_on_triangle(p, a, b, c):
    """Closest point of a triangle (Ericson, Real-Time Collision Detection, 5.1.5)."""
    ab, ac, ap = b - a, c - a, p - a
    d1, d2 = (ab * ap).sum(), (ac * ap).sum()
    if d1 <= 0 and d2 <= 0:
        return a.copy()
    bp = p - b
    d3, d4 = (ab * bp).sum(), (ac * bp).sum()
    if d3 >= 0 and d4 <= d3:
        return b.copy()
    cp = p - c
    d5, d6 = (ab * cp).sum(), (ac * cp).sum()
    if d6 >= 0 and d5 <= d6:
        return c.copy()
    vc = d1 * d4 - d3 * d2
    if vc <= 0 and d1 >= 0 and d3 <= 0:
        return a + d1 / (d1 - d3) * ab
    vb = d5 * d2 - d1 * d6
    if vb <= 0 and d2 >= 0 and d6 <= 0:
        return a + d2 / (d2 - d6) * ac
    va = d3 * d6 - d5 * d4
    if va <= 0 and d4 >= d3 and d5 >= d6:
        return b + (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (c - b)
    return a + (vb * ab + vc * ac) / (va + vb + vc)


def synthetic_error(synthetic, fit, head, layout):
    """Median distance in mm between a fitted and a true surface, over the face."""
    truth = synthetic.vertices[face_region(synthetic.head, layout)]
    found = fitted_vertices(fit, head)
    faces = head.faces[head.part_faces("skin")]
    start = synthetic.head.landmarks(synthetic.vertices)[: marks.FACE]
    distances = surface_error(
        truth, found, faces, start, head.landmarks(found)[: marks.FACE], rounds=12
    )
    return float(np.median(distances))
