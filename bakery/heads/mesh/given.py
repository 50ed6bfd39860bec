"""Landmarks of a mesh that someone gives, in place of looking for them."""

import numpy as np

from bakery.errors import InputError
from bakery.formats.files import read_bytes
from bakery.formats.record import LARGEST_JSON, faces_from_table, parse
from bakery.heads.mesh.draw import SIZE, first_view, frames
from bakery.heads.mesh.look import seen_in
from bakery.heads.mesh.pose import Seen
from bakery.landmarks import FACE
from bakery.types import LANDMARKS


def read_seen(path, surface, up=None):
    """Landmarks from a file: {"points": [[x, y, z], ...]}, or what `bakery detect` wrote.

    Args:
        path: JSON. "points" are the 478 (or first 468) points on the surface, in the mesh file's own
            unit and axes. What `bakery detect` wrote must be of the picture `drawn` gives.
        surface: Surface; up: axis that points up, "y" if None.

    Returns:
        Seen.

    Raises:
        InputError: neither, or the points are not of this mesh.
    """
    table = parse(path, read_bytes(path, LARGEST_JSON))
    if "faces" in table:
        size, faces = faces_from_table(path, table)
        if tuple(size) != (SIZE, SIZE) or len(faces) != 1:
            raise InputError(
                f"{path}: {len(faces)} faces in {size[0]}x{size[1]} pixels; one face in the "
                f"{SIZE}x{SIZE} picture that --picture writes is needed"
            )
        pixels, trust = faces[0].points[:FACE].astype(float), faces[0].confidence[None, :FACE]
        about = f"landmarks: those of {path} in the drawn picture"
        return seen_in([drawn(surface, up)], [pixels], trust, about)
    try:
        points = np.array(table.get("points"), float)
    except (TypeError, ValueError):
        points = np.zeros(0)
    if points.shape not in ((FACE, 3), (LANDMARKS, 3)) or not np.isfinite(points).all():
        raise InputError(
            f'{path}: needs "points", a list of {LANDMARKS} or {FACE} times [x, y, z]; see '
            "docs/heads/import-mesh.md"
        )
    points = points[:FACE]
    size = np.ptp(surface.vertices, axis=0).max()
    low, high = surface.vertices.min(0) - 0.05 * size, surface.vertices.max(0) + 0.05 * size
    if (points < low).any() or (points > high).any():
        raise InputError(f"{path}: its points do not lie on this mesh; give them in its own unit")
    return Seen(points, np.ones(FACE), f"landmarks: the points of {path}")


def drawn(surface, up=None):
    """The picture that landmarks can be given for: the whole surface from the front, View."""
    return first_view(surface, next(frames(up or "y")))
