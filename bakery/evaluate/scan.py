"""Fits to pictures of a scanned head, surface to surface: the one test against a real shape."""

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from bakery import landmarks as marks
from bakery.bake.faces import find_faces
from bakery.bake.fitting import fit_portrait
from bakery.errors import InputError
from bakery.evaluate.fitting import fitted_vertices, surface_error
from bakery.formats.files import read_bytes
from bakery.formats.image import read_photo, write_image
from bakery.formats.mark import MIXED
from bakery.geometry import camera as cameras
from bakery.geometry import mesh, rotation
from bakery.geometry.color import to_encoded, to_linear
from bakery.geometry.raster import rasterize
from bakery.geometry.sample import bilinear, interpolate
from bakery.stages.fit import EYE_CORNERS, FitOptions
from bakery.types import Camera, Photo

VIEWS = (-20.0, 0.0, 20.0)  # degrees
WIDTH, HEIGHT = 900, 1200  # pixels
SPAN = 0.95  # of the picture that the scan's height would take: a head and the neck fill it
MIDDLE = 0.4  # of its height below the top lies in the middle of the picture
LAMP, AMBIENT = np.array([0.3, 0.4, 0.87]), 0.45
STEP = 3  # pixels between the points that are measured


@dataclass(frozen=True)
class Scan:
    """A textured surface; +y up, +z out of the face, any unit."""

    vertices: np.ndarray  # [V, 3]
    faces: np.ndarray  # [F, 3]
    uv: np.ndarray  # [U, 2] 0..1, origin top left
    uv_faces: np.ndarray  # [F, 3]
    color: np.ndarray  # [H, W, 3] linear


def read_scan(folder, mesh_name="LeePerrySmith.obj", color_name="Map-COL.jpg"):
    """Read an OBJ of quads or triangles with its colour map.

    Raises:
        InputError: a file is missing, or the OBJ holds no textured face.
    """
    path, picture = Path(folder) / mesh_name, Path(folder) / color_name
    for wanted in (path, picture):
        if not wanted.is_file():
            raise InputError(f"{wanted}: no such file; give the folder of the scan that has it")
    points, faces, uv, uv_faces = read_obj(path)
    return Scan(points, faces, uv, uv_faces, to_linear(read_photo(picture).encoded))


def read_obj(path: Path) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Read a textured OBJ of triangles or larger convex faces, which are cut into triangles.

    Returns:
        vertices [V, 3], triangles [F, 3], uv [U, 2] from the top left, triangles [F, 3] of these.

    Raises:
        InputError: it cannot be read, or holds no textured face.
    """
    points, uv, faces, uv_faces = [], [], [], []
    try:
        for line in read_bytes(path).decode().splitlines():
            kind, *words = line.split() or [""]
            if kind == "v":
                points.append([float(word) for word in words[:3]])
            elif kind == "vt":
                uv.append([float(words[0]), 1 - float(words[1])])
            elif kind == "f":
                corners = [word.split("/") for word in words]
                for k in range(1, len(corners) - 1):
                    chosen = (corners[0], corners[k], corners[k + 1])
                    faces.append([int(corner[0]) - 1 for corner in chosen])
                    uv_faces.append([int(corner[1]) - 1 for corner in chosen])
    except (ValueError, IndexError) as error:
        raise InputError(f"{path}: not a textured OBJ ({error})") from error
    if not faces:
        raise InputError(f"{path}: holds no face; an OBJ with v, vt and f is needed")
    return np.array(points), np.array(faces), np.array(uv), np.array(uv_faces)


def draw(scan, yaw):
    """A picture of a scan under a soft lamp: (Photo, Camera, Fragments).

    The camera has the focal length that a photo without EXIF is taken to have.
    """
    low, high = scan.vertices.min(0), scan.vertices.max(0)
    focal = FitOptions().focal * HEIGHT
    distance = focal * (high - low)[1] / (SPAN * HEIGHT)
    turn = rotation.yaw_pitch(yaw, 0.0)
    middle = (low + high) / 2
    middle[1] = high[1] - MIDDLE * (high - low)[1]
    place = np.array([0, 0, -distance]) - turn @ middle
    center = np.array([WIDTH, HEIGHT]) / 2
    camera = Camera(focal, center, rotation.vector(turn), place, WIDTH, HEIGHT)
    inside = cameras.to_camera(scan.vertices, camera)
    seen = rasterize(
        cameras.project_camera(inside, camera), -inside[:, 2], scan.faces, (HEIGHT, WIDTH)
    )
    normals = interpolate(seen, mesh.vertex_normals(inside, scan.faces)[scan.faces])
    normals /= np.maximum(np.linalg.norm(normals, axis=-1, keepdims=True), 1e-6)
    size = np.array(scan.color.shape[1::-1])
    color = bilinear(scan.color, interpolate(seen, scan.uv[scan.uv_faces]) * size)
    light = AMBIENT + (1 - AMBIENT) * np.clip(normals @ LAMP / np.linalg.norm(LAMP), 0, 1)
    image = np.where((seen.face >= 0)[..., None], color * light[..., None], 0.2)
    encoded = cv2.GaussianBlur(to_encoded(image).astype(np.float32), (0, 0), 0.6)
    return Photo(np.clip(encoded, 0, 1), ""), camera, seen


def surface_points(scan, seen, pixels):
    """Points [N, 3] of a drawn scan under pixels [N, 2], and which of them lie on it [N]."""
    column, row = np.clip(pixels, 0, [WIDTH - 1, HEIGHT - 1]).astype(int).T
    face = seen.face[row, column]
    corners = scan.vertices[scan.faces[np.maximum(face, 0)]]
    return np.einsum("nk,nkc->nc", seen.barycentric[row, column], corners), face >= 0


def detected(photo):
    """The largest face that the project's own detector finds: Landmarks."""
    return find_faces("the drawn scan", photo=photo)[1][0]


def face_points(scan):
    """What a fit is measured by, from the frontal view.

    The unit of the scan is told by its outer eye corners, EYE_CORNERS mm apart.

    Returns:
        (points [N, 3] mm of the face, inside its contour; landmarks [468, 3] mm; which of these lie
        on the surface [468] bool).
    """
    photo, _, seen = draw(scan, 0.0)
    points = detected(photo).points[: marks.FACE]
    places, there = surface_points(scan, seen, points)
    mm = EYE_CORNERS / marks.face_size(places)
    hull = cv2.convexHull(points[marks.OVAL].astype(np.float32))
    inside = np.zeros((HEIGHT, WIDTH), np.uint8)
    cv2.fillConvexPoly(inside, np.round(hull).astype(np.int32), 1)
    row, column = np.nonzero(inside[::STEP, ::STEP])
    grid, on = surface_points(scan, seen, np.stack([column, row], 1) * STEP)
    return grid[on] * mm, places * mm, there


def measure(scan, head, views=VIEWS, pictures=None):
    """Fit a head to each view of a scan, by our own detection.

    Args:
        pictures: folder for the drawn views, or None.

    Yields:
        dict a view: yaw, median and mean distance of the face in mm, 90th percentile, detector's
        score.
    """
    truth, places, there = face_points(scan)
    for yaw in views:
        photo, _, _ = draw(scan, yaw)
        if pictures is not None:
            Path(pictures).mkdir(parents=True, exist_ok=True)
            write_image(Path(pictures) / f"scan_{yaw:+.0f}.png", photo.encoded, mark=MIXED)
        face = detected(photo)
        found, _ = fit_portrait("the drawn scan", photo, face, head)
        shape = fitted_vertices(found, head)
        start = head.landmarks(shape)[: marks.FACE]
        skin = head.faces[head.part_faces("skin")]
        miss = surface_error(truth, shape, skin, places[there], start[there])
        yield {
            "head": head.name,
            "yaw": yaw,
            "median_mm": round(float(np.median(miss)), 3),
            "mean_mm": round(float(miss.mean()), 3),
            "p90_mm": round(float(np.percentile(miss, 90)), 3),
            "score": round(float(face.score), 3),
        }
