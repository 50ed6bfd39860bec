"""A surface of unknown axes and unit in head space, by the landmarks found on it."""

from dataclasses import dataclass, replace

import numpy as np

from bakery.errors import InputError
from bakery.geometry.mesh import vertex_normals
from bakery.heads.mesh.draw import AXES
from bakery.heads.mesh.read import Surface
from bakery.landmarks import FACE

UNITS = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "in": 25.4}  # mm in each
EYE_CORNERS = (62.0, 125.0)  # mm between the outer eye corners of a child and of a giant
POSSIBLE = (40.0, 200.0)  # mm; with units that were asked for, anything else is a mistake


@dataclass(frozen=True)
class ViewRays:
    """Lines of sight to the landmarks, from n views."""

    origins: np.ndarray  # [n, 3] where each view was drawn from
    directions: np.ndarray  # [n, 468, 3] unit, from there
    weight: np.ndarray  # [n, 468] 0..1, how sure the detector was

    def nearest(self, points):
        """The places nearest to points [468, 3] on their lines, mean of the views: [468, 3]."""
        offset = points - self.origins[:, None]
        along = (offset * self.directions).sum(-1, keepdims=True)
        places = self.origins[:, None] + along * self.directions
        share = self.weight / np.maximum(self.weight.sum(0), 1e-9)
        return np.einsum("nl,nlc->lc", share, places)

    @property
    def trust(self):
        """[468] 0..1: how sure the landmarks are."""
        return self.weight.max(0)


@dataclass(frozen=True)
class Seen:
    """Landmarks found on a surface, in the unit and axes of its file."""

    points: np.ndarray  # [468, 3]
    weight: np.ndarray  # [468] 0..1, how well each place on the surface is known
    about: str  # how they were found, for people
    rays: ViewRays | None = None  # None where the points themselves were given


@dataclass(frozen=True)
class Posed:
    """A surface in head space: mm, +y up, +z out of the face."""

    surface: Surface
    points: np.ndarray  # [468, 3] mm, the landmarks on it
    weight: np.ndarray  # [468] 0..1
    rays: ViewRays | None
    about: tuple  # what was assumed, a line each


def shape_of(head):
    """The landmarks [468, 3] mm of a head at rest."""
    return head.landmarks(head.mean)[:FACE].astype(float)


def similarity(points, shape, weight, scaled=True):
    """The turn, scale and shift that put points [N, 3] onto a shape [N, 3] best.

    Returns:
        (turn [3, 3], scale, shift [3]): shape is about scale * points @ turn.T + shift.

    References:
        Umeyama, "Least-squares estimation of transformation parameters between two point
        patterns", PAMI 13(4), 1991.
    """
    weight = weight / weight.sum()
    a, b = weight @ points, weight @ shape
    x, y = points - a, shape - b
    U, S, Vt = np.linalg.svd((y * weight[:, None]).T @ x)
    flip = np.array([1.0, 1.0, np.sign(np.linalg.det(U @ Vt))])
    turn = (U * flip) @ Vt
    scale = float((S * flip).sum() / (weight @ (x**2).sum(1))) if scaled else 1.0
    return turn, scale, b - scale * turn @ a


def pose(surface, seen, shape, units=None):
    """Move a surface into head space.

    Args:
        seen: Seen; shape: [468, 3] mm, the landmarks of the built-in head.
        units: a key of UNITS; None chooses the one that makes the size of the face a person's.

    Returns:
        Posed.

    Raises:
        InputError: with the units asked for, this is no head.
    """
    apart = float(np.linalg.norm(seen.points[33] - seen.points[263]))
    about = [seen.about]
    if units:
        unit = UNITS[units]
        if not POSSIBLE[0] < unit * apart < POSSIBLE[1]:
            raise InputError(
                f"with --units {units} the outer eye corners are {unit * apart:.3g} mm apart, people "
                f"have {EYE_CORNERS[0]:.0f} to {EYE_CORNERS[1]:.0f}; give another unit or none"
            )
        about.append(f"unit: {units}, as told; eye corners {unit * apart:.0f} mm apart")
    else:
        fits = [u for u in UNITS if EYE_CORNERS[0] <= UNITS[u] * apart <= EYE_CORNERS[1]]
        if fits:
            unit = UNITS[fits[0]]
            about.append(f"unit: {fits[0]} assumed; eye corners {unit * apart:.0f} mm apart")
        else:
            mean = float(np.linalg.norm(shape[33] - shape[263]))
            unit = mean / apart
            about.append(f"unit: none fits; scaled so that eye corners are {mean:.0f} mm apart")
    turn, _, _ = similarity(seen.points, shape, seen.weight)
    points = unit * seen.points @ turn.T
    shift = np.average(shape - points, axis=0, weights=seen.weight)

    def moved(places):
        return unit * places @ turn.T + shift

    rays = seen.rays
    if rays:
        rays = replace(rays, origins=moved(rays.origins), directions=rays.directions @ turn.T)
    names = [min(AXES, key=lambda a: -float(AXES[a] @ turn[k])) for k in (1, 2)]
    about.append(f"axes: {names[0]} up, {names[1]} out of the face")
    surface = outside_out(replace(surface, vertices=moved(surface.vertices)), points + shift)
    return Posed(surface, points + shift, seen.weight, rays, tuple(about))


def outside_out(surface, points):
    """A surface in head space with its faces turned if the face at points [N, 3] looks inward."""
    from scipy.spatial import cKDTree

    nearest = cKDTree(surface.vertices).query(points)[1]
    if np.median(vertex_normals(surface.vertices, surface.faces)[nearest, 2]) > 0:
        return surface
    uv_faces = None if surface.uv_faces is None else surface.uv_faces[:, ::-1]
    return replace(surface, faces=surface.faces[:, ::-1], uv_faces=uv_faces)
