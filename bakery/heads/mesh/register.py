"""The built-in head laid over a surface: by its landmarks, then by the surface itself.

References:
    Amberg, Romdhani, Vetter, "Optimal step nonrigid ICP algorithms for surface registration",
    CVPR 2007: stiffness that falls from step to step. Here stiffness is bending energy, so that a
    stretched or turned region costs nothing.
"""

from dataclasses import dataclass

import numpy as np

from bakery import landmarks as marks
from bakery.geometry.mesh import boundary_loops, vertex_normals
from bakery.heads.mesh.pose import similarity
from bakery.heads.mesh.search import Nearest
from bakery.heads.mesh.solve import factorized, stiffness, vertex_areas

FLESH = ("skin", "eye_socket", "mouth_cavity")  # of the built-in head: one connected surface
SIGMA = 2.0  # mm that landmarks miss by where identity explains them
# Stiffness: the length in mm that a dent must have to be followed, how far the surface may be away
# to count, and what a landmark counts, in mm2 of surface.
STEPS = (
    (60.0, 25.0, 400.0),
    (40.0, 20.0, 200.0),
    (25.0, 15.0, 100.0),
    (15.0, 10.0, 50.0),
    (10.0, 6.0, 30.0),
    (6.0, 5.0, 15.0),
    (4.0, 4.0, 8.0),
)
STEPS_LIDS = ((10.0, 5.0, 20.0), (5.0, 4.0, 40.0))
MATCHED = 4.0  # mm from the surface: farther, the head does not lie on it
ROUNDS = 3  # of nearest places at each stiffness
STRETCH = 0.02  # of the stiffness is against stretching
INSIDE = 5.0  # mm behind the lips that are still looked for on the surface
VAGUE = 0.15  # what points of the contour and the brows count: no shading shows their place


@dataclass(frozen=True)
class Laid:
    """The built-in head on a surface."""

    head: object  # HeadModel, the built-in one
    vertices: np.ndarray  # [V, 3] mm; what is not FLESH is where a similarity takes it
    scale: float  # size over the built-in head's
    turn: np.ndarray  # [3, 3] of that similarity
    matched: np.ndarray  # [V] bool: has a place on the surface
    distance: np.ndarray  # [V] mm from the surface, infinite where nothing matches

    def turned(self, moves):
        """Displacements [..., 3] of the built-in head as they are on the laid one."""
        return self.scale * moves @ self.turn.T


def wanted(seen, places):
    """Where landmarks at places [468, 3] should be by Seen or Posed: on their lines of sight, or as
    given."""
    return seen.points if seen.rays is None else seen.rays.nearest(places)


def fit_identity(head, seen, weight, rounds=15):
    """The neutral shape of a head and its pose that bring its landmarks near those of a surface.

    Args:
        seen: Seen, or Posed; weight: [468] what each landmark counts.

    Returns:
        (vertices [V, 3] mm, scale, turn [3, 3]).
    """
    corners = head.landmark_vertices[: marks.FACE]
    share = head.landmark_barycentric[: marks.FACE].astype(float)
    mean = np.einsum("lkc,lk->lc", head.mean[corners], share)
    modes = np.einsum("ilkc,lk->ilc", head.identity_basis[:, corners], share)
    identity = np.zeros(len(modes))
    points = seen.points
    for _ in range(rounds):
        shape = mean + np.tensordot(identity, modes, 1)
        turn, scale, shift = similarity(shape, points, weight)
        there = (points - shift) @ turn / scale - mean  # in the head's own frame
        A = modes.reshape(len(modes), -1) * np.repeat(weight, 3) / SIGMA**2
        H = A @ modes.reshape(len(modes), -1).T + np.eye(len(modes))
        identity = np.linalg.solve(H, A @ there.ravel())
        shape = mean + np.tensordot(identity, modes, 1)
        points = wanted(seen, scale * shape @ turn.T + shift)
    return scale * head.neutral(identity) @ turn.T + shift, scale, turn


def lay(head, posed, skin):
    """Lay the built-in head over a surface.

    Args:
        head: HeadModel.
        posed: Posed; skin: Surface, the piece of it to lie on, without eyes and teeth.

    Returns:
        Laid.
    """
    trust = (posed.weight if posed.rays is None else posed.rays.trust) + 1e-6
    trust[marks.OVAL] *= VAGUE
    trust[marks.BROWS] *= VAGUE
    start, scale, turn = fit_identity(head, posed, trust)
    sheet = _Sheet(head, start)
    corners = sheet.number[head.landmark_vertices[: marks.FACE]]
    share = head.landmark_barycentric[: marks.FACE].astype(float)
    points = sheet.reader(corners, share)

    def pulls(here):
        return points, trust, wanted(posed, points @ here)

    return sheet.laid(_Goal(skin.vertices, skin.faces), STEPS, pulls, scale, turn)


def fit_lids(laid, surface, faces, contours):
    """The laid head with its lids' rims on those of the surface.

    Args:
        surface: Surface; faces: [F, 3] of its skin.
        contours: ((upper, lower) vertices of the surface, the same of the head) for each eye.
    """
    sheet = _Sheet(laid.head, laid.vertices)
    ours, targets = [], []
    for theirs, own in contours:
        for half, rim in zip(theirs, own):
            ours.append(rim)
            targets.append(at_shares(surface.vertices[half], shares(laid.vertices[rim])))
    ours, targets = sheet.number[np.concatenate(ours)], np.concatenate(targets)
    rims = sheet.reader(ours[:, None], np.ones((len(ours), 1)))

    def pulls(here):
        return rims, np.ones(len(targets)), targets

    goal = _Goal(surface.vertices, faces)
    return sheet.laid(goal, STEPS_LIDS, pulls, laid.scale, laid.turn)


def shares(line):
    """How far along a line [n, 3] its points lie, 0..1."""
    length = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    return length / max(length[-1], 1e-9)


def at_shares(line, wanted_shares):
    """Points of a line [n, 3] at shares [m] of its length: [m, 3]."""
    have = shares(line)
    return np.stack([np.interp(wanted_shares, have, line[:, k]) for k in range(3)], -1)


class _Goal:
    """A surface to lie on."""

    def __init__(self, vertices, faces):
        self.nearest = Nearest(vertices, faces)
        edge = np.zeros(len(vertices), bool)
        for loop in boundary_loops(faces):
            edge[loop] = True
        self.outer = edge[faces].sum(1) >= 2  # a place on the border stands for what lies beyond

    def query(self, points, normals, reach):
        """Places [N, 3], which of them count [N] and their distances [N] mm."""
        found, weights, far = self.nearest.query(points, normals)
        at = np.einsum("nk,nkc->nc", weights, self.nearest.triangles[found])
        return at, (far < reach) & ~self.outer[found], far


class _Sheet:
    """The flesh of the built-in head as an elastic sheet."""

    def __init__(self, head, start):
        """start: [V, 3] mm, its shape at rest."""
        from scipy.sparse import diags

        self.head, self.start = head, start
        flesh = head.faces[head.part_faces(*FLESH)]
        self.used, small = np.unique(flesh, return_inverse=True)
        self.faces = small.reshape(-1, 3)
        self.number = np.full(len(head.mean), -1)
        self.number[self.used] = np.arange(len(self.used))
        self.rest = start[self.used]
        self.counts = _counting(head, start)[self.used]
        self.area = vertex_areas(self.rest, self.faces)
        self.stretch = stiffness(self.rest, self.faces)
        self.bend = (self.stretch @ diags(1 / self.area) @ self.stretch).tocsc()

    def reader(self, corners, weights):
        """Sparse [N, V] that reads the sheet's vertices at corners [N, k] with weights [N, k]."""
        from scipy.sparse import coo_matrix

        rows = np.repeat(np.arange(len(corners)), corners.shape[1])
        shape = (len(corners), len(self.used))
        return coo_matrix((weights.ravel(), (rows, corners.ravel())), shape).tocsr()

    def laid(self, goal, steps, pulls, scale, turn):
        """Lay it on a goal: Laid.

        Args:
            pulls: function (shape [V, 3]) -> (reader [N, V], weights [N], where those go [N, 3]).
        """
        from scipy.sparse import diags

        here = self.rest
        for length, reach, pull in steps:
            energy = length**4 * self.bend + STRETCH * length**2 * self.stretch
            for _ in range(ROUNDS):
                at, near, far = goal.query(here, vertex_normals(here, self.faces), reach)
                near &= self.counts
                held = near * self.area / (1 + (np.where(near, far, 0) / (0.4 * reach)) ** 2)
                points, weights, target = pulls(here)
                drawn = points.T @ diags(pull * weights)
                right = held[:, None] * np.where(near[:, None], at - self.rest, 0)
                right += drawn @ (target - points @ self.rest)
                moved = factorized(energy + diags(held + 1e-9) + drawn @ points)(right)
                here = self.rest + moved
        _, near, far = goal.query(here, vertex_normals(here, self.faces), np.inf)
        vertices, distance = self.start.copy(), np.full(len(self.start), np.inf)
        vertices[self.used] = here
        distance[self.used] = np.where(near, far, np.inf)
        matched = np.zeros(len(self.start), bool)
        matched[self.used] = self.counts
        return Laid(self.head, vertices, scale, turn, matched & (distance < MATCHED), distance)


def _counting(head, vertices):
    """Vertices [V] that look for the surface: skin, and the lips a little way in."""
    from scipy.spatial import cKDTree

    out = np.zeros(len(vertices), bool)
    skin, cavity = head.part_vertices("skin"), head.part_vertices("mouth_cavity")
    ring = np.intersect1d(skin, cavity)
    out[skin] = True
    out[cavity] = cKDTree(vertices[ring]).query(vertices[cavity])[0] < INSIDE
    return out
