"""Photos as reliefs: a picture on a triangle mesh through its 478 points, to be seen anew.

A portrait with points in depth can be morphed to another face's shape, turned by some degrees,
seen from nearer by, and cropped, all by one resampling of the picture. The points of the new
picture are known exactly, since they are vertices of the mesh.
"""

from dataclasses import dataclass

import cv2
import numba
import numpy as np

from bakery.detectors.frames import PADDING, POINTS, frame_of_points

LATTICE = 15  # vertices on a side of the mesh around the face


@dataclass(frozen=True)
class Relief:
    """A photo on a mesh. The first 478 vertices are the face points."""

    images: tuple  # [H, W, 3] uint8 BGR, each half the size of the one before
    masks: tuple  # [H, W] uint8, 255 where the person is; beside `images`
    vertices: np.ndarray  # [N, 3] x, y and depth (away from the camera), pixels of images[0]
    triangles: np.ndarray  # [T, 3] int32
    follow: np.ndarray  # [N - 478, 478] how much each face point drags each outer vertex
    center: np.ndarray  # [2] pixels
    size: float  # of the face, pixels

    @property
    def points(self):
        """[478, 3] pixels of images[0]."""
        return self.vertices[:POINTS]


def make_relief(image, mask, points):
    """Build the mesh of one photo.

    Args:
        image: [H, W, 3] uint8 BGR.
        mask: [H, W] uint8, 255 where the person is.
        points: [478, 3] x, y, depth in pixels of the image.

    Returns:
        Relief
    """
    points = np.asarray(points, np.float32)
    frame = frame_of_points(points)
    height, width = image.shape[:2]
    x, y = np.meshgrid(
        np.linspace(-0.02, 1.02, LATTICE) * width, np.linspace(-0.02, 1.02, LATTICE) * height
    )
    lattice = np.stack([x, y], -1).reshape(-1, 2).astype(np.float32)
    distance = np.linalg.norm(lattice[:, None] - points[None, :, :2], axis=-1)  # [N - 478, 478]
    outside = distance.min(1) > 0.1 * frame.size
    hull = cv2.convexHull(np.ascontiguousarray(points[:, :2]))
    outside &= np.array(
        [cv2.pointPolygonTest(hull, tuple(map(float, p)), False) < 0 for p in lattice]
    )
    lattice, distance = lattice[outside], distance[outside]
    reach = 0.12 * frame.size + 0.5 * distance.min(1, keepdims=True)
    follow = np.exp(-0.5 * (distance - distance.min(1, keepdims=True)) / reach)
    follow /= follow.sum(1, keepdims=True)
    # Skin, ears and hair fall back from the face's rim; the background is as deep as they are.
    depth = follow @ points[:, 2] + 0.6 * np.minimum(distance.min(1), 0.5 * frame.size)
    outer = np.concatenate([lattice, depth[:, None]], 1)
    vertices = np.concatenate([points, outer]).astype(np.float32)
    triangles = triangulate(vertices[:, :2])
    images, masks = [image], [mask]
    while len(images) < 4:
        images.append(halve(images[-1]))
        masks.append(halve(masks[-1]))
    return Relief(
        tuple(images),
        tuple(masks),
        vertices,
        triangles,
        follow.astype(np.float32),
        frame.center.astype(np.float32),
        float(frame.size),
    )


def triangulate(points):
    """Delaunay triangles [T, 3] int32 of points [N, 2]."""
    low, high = points.min(0) - 1, points.max(0) + 1
    box = (*low.astype(int).tolist(), *(high - low + 2).astype(int).tolist())
    division = cv2.Subdiv2D(box)
    for point in points.tolist():
        division.insert(tuple(point))
    corners = division.getTriangleList().reshape(-1, 3, 2)
    known = {tuple(np.float32(p)): i for i, p in enumerate(points.astype(np.float32))}
    found = [[known.get(tuple(p), -1) for p in triangle] for triangle in corners]
    return np.array([t for t in found if min(t) >= 0], np.int32)


def halve(image):
    """Half the size, by area."""
    size = (image.shape[1] // 2, image.shape[0] // 2)
    return cv2.resize(image, size, interpolation=cv2.INTER_AREA)


def reshape(relief, points):
    """Move the face points to `points` [478, 3]; the outer vertices follow. Returns [N, 3]."""
    shift = points - relief.points
    return np.concatenate([points, relief.vertices[POINTS:] + relief.follow @ shift])


def pose(vertices, center, size, yaw, pitch, nearness):
    """Turn vertices about the middle of the head and see them from nearer by.

    Args:
        vertices: [N, 3] x, y, depth.
        center, size: of the face.
        yaw, pitch: radians.
        nearness: face size / camera distance; 0 leaves the perspective of the photo.

    Returns:
        [N, 3] in units of the face size, origin at the middle of the head.
    """
    v = np.empty_like(vertices)
    v[:, :2] = (vertices[:, :2] - center) / size
    v[:, 2] = vertices[:, 2] / size - 0.3
    cy, sy, cp, sp = np.cos(yaw), np.sin(yaw), np.cos(pitch), np.sin(pitch)
    turn = np.array([[cy, 0, sy], [sy * sp, cp, -cy * sp], [-sy * cp, sp, cy * cp]], np.float32)
    v = v @ turn.T
    v[:, :2] /= np.maximum(1 + nearness * (v[:, 2:] + 0.3), 0.3)
    return v


@numba.njit(cache=True, nogil=True)
def _rasterize(vertices, source, triangles, height, width):
    """Source position [height, width, 2] behind every pixel, NaN where no triangle lies."""
    position = np.full((height, width, 2), -1e4, np.float32)
    nearest = np.full((height, width), np.inf, np.float32)
    for t in range(triangles.shape[0]):
        a, b, c = triangles[t]
        ax, ay, bx, by, cx, cy = (
            vertices[a, 0],
            vertices[a, 1],
            vertices[b, 0],
            vertices[b, 1],
            vertices[c, 0],
            vertices[c, 1],
        )
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        if abs(area) < 1e-6:
            continue
        x0 = max(int(min(ax, bx, cx) - 0.5), 0)
        x1 = min(int(max(ax, bx, cx) + 0.5), width - 1)
        y0 = max(int(min(ay, by, cy) - 0.5), 0)
        y1 = min(int(max(ay, by, cy) + 0.5), height - 1)
        for i in range(y0, y1 + 1):
            for j in range(x0, x1 + 1):
                px, py = j + 0.5, i + 0.5
                wb = ((px - ax) * (cy - ay) - (py - ay) * (cx - ax)) / area
                wc = ((bx - ax) * (py - ay) - (by - ay) * (px - ax)) / area
                wa = 1 - wb - wc
                if wa < -1e-4 or wb < -1e-4 or wc < -1e-4:
                    continue
                z = wa * vertices[a, 2] + wb * vertices[b, 2] + wc * vertices[c, 2]
                if z < nearest[i, j]:
                    nearest[i, j] = z
                    position[i, j, 0] = wa * source[a, 0] + wb * source[b, 0] + wc * source[c, 0]
                    position[i, j, 1] = wa * source[a, 1] + wb * source[b, 1] + wc * source[c, 1]
    return position


def render(relief, vertices, height, width, scale):
    """Paint the relief with its vertices at new places.

    Args:
        relief: the photo.
        vertices: [N, 3] x, y in pixels of the new picture, depth.
        height, width: of the new picture.
        scale: new pixels a photo pixel, to choose the resolution to read from.

    Returns:
        image [height, width, 3] uint8 BGR, mask [height, width] float32 0..1 (0 where the person
        is not), reached [height, width] bool: the photo covers this pixel.
    """
    position = _rasterize(
        np.ascontiguousarray(vertices, np.float32),
        relief.vertices,
        relief.triangles,
        height,
        width,
    )
    level = int(np.clip(np.floor(np.log2(1.4 / max(scale, 1e-3))), 0, len(relief.images) - 1))
    at = position * np.float32(0.5**level) - np.float32(0.5)
    grey = (PADDING,) * 3
    image = cv2.remap(relief.images[level], at, None, cv2.INTER_LINEAR, borderValue=grey)
    mask = cv2.remap(relief.masks[level], at, None, cv2.INTER_LINEAR, borderValue=0)
    inside = position[..., 0] > -1e3
    return image, mask.astype(np.float32) * (1 / 255), inside
