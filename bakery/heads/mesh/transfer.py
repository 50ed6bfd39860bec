"""Shapes and people of one surface carried to another.

References:
    Sumner and Popovic, "Deformation transfer for triangle meshes", SIGGRAPH 2004: each triangle is
    asked to deform as the one it corresponds to.
    Botsch, Sumner, Pauly, Gross, "Deformation transfer for detail-preserving surface editing", VMV
    2006: with the gradients of the displacement this is a Poisson equation for the vertices.
"""

from dataclasses import dataclass

import numpy as np

from bakery.geometry.mesh import face_normals, vertex_normals
from bakery.heads.mesh import openings
from bakery.heads.mesh.search import Nearest
from bakery.heads.mesh.solve import factorized, gradient, stiffness, vertex_areas

HOLD = 8.0  # mm over which gradients rule; beyond, the places that the laid head moves to
STILL = 1e-3  # mm: vertices of the built-in head that no shape moves more hold it in place
FAR = 3.0  # mm from the laid head at which its places count half
SPREAD = 30.0  # mm over which identity modes fade into what the laid head does not reach
LEAST = 0.02  # mm2: smaller triangles of the built-in head say nothing reliable about a deformation
ALIKE = 0.2  # cosine between the normals of triangles that may correspond


@dataclass(frozen=True)
class Pairs:
    """What corresponds to a surface on the laid head."""

    face: np.ndarray  # [F] face of the head for each triangle
    vertex_face: np.ndarray  # [V] face of the head for each vertex
    barycentric: np.ndarray  # [V, 3] where on it
    trust: np.ndarray  # [V] 0..1: 1 where the two surfaces meet

    def read(self, head_faces, values):
        """Values [..., V of the head, 3] at the surface's vertices: [..., V, 3]."""
        corners = head_faces[self.vertex_face]
        return np.einsum("...vkc,vk->...vc", values[..., corners, :], self.barycentric)


def frames(vertices, faces):
    """Edges and normal of each triangle as columns: [F, 3, 3].

    The normal is as long as the square root of twice the area, as in Sumner and Popovic.
    """
    a, b, c = np.asarray(vertices, np.float64)[faces].transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    length = np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    return np.stack([b - a, c - a, normal / np.sqrt(length)], -1)


def pair(vertices, faces, part, contours, laid):
    """Find what corresponds to each triangle and vertex of a surface on the laid head.

    A lip or lid may only correspond to the same one, whatever lies nearer; skin only to skin.

    Args:
        vertices: [V, 3] mm; faces: [F, 3]; part: [F] names of parts.
        contours: (upper, lower) vertices of each opening, or None; laid: Laid.

    Returns:
        Pairs.
    """
    head = laid.head
    area = np.linalg.norm(face_normals(laid.vertices, head.faces), axis=1) / 2
    own = openings.regions(vertices, faces, contours)
    used = head.faces[head.part_faces("skin", "eye_socket", "mouth_cavity")]
    theirs = openings.regions(laid.vertices, used, openings.guide(laid))
    own_faces = _of_faces(own[faces])
    their_faces = _of_faces(theirs[head.faces])
    normals = face_normals(vertices, faces)
    normals = normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    out = np.zeros(len(faces), int)
    vertex_face, barycentric = np.zeros(len(vertices), int), np.zeros((len(vertices), 3))
    distance = np.full(len(vertices), np.inf)
    at_vertices = vertex_normals(vertices, faces)
    vertex_part = np.full(len(vertices), "", part.dtype)
    for name in ("mouth_cavity", "eye_socket", "skin"):  # of a contour's vertices the skin decides
        vertex_part[faces[part == name]] = name
    for name in np.unique(part):
        pool = head.part_faces(name)
        for region in np.unique(own_faces[part == name]):
            mine = np.flatnonzero((part == name) & (own_faces == region))
            points = np.flatnonzero((vertex_part == name) & (own == region))
            chosen = pool[area[pool] > LEAST]
            if region:
                chosen = chosen[their_faces[chosen] != openings.other_side(region)]
                low, high = vertices[faces[mine]].min((0, 1)), vertices[faces[mine]].max((0, 1))
                middle = laid.vertices[head.faces[chosen]].mean(1)
                near = ((middle > low - 25) & (middle < high + 25)).all(1)
                chosen = chosen[near] if near.any() else chosen
            search = Nearest(laid.vertices, head.faces[chosen])
            out[mine] = chosen[_nearest(search, vertices[faces[mine]].mean(1), normals[mine])[0]]
            if len(points):
                found, weight, far = _nearest(search, vertices[points], at_vertices[points])
                vertex_face[points], barycentric[points] = chosen[found], weight
                distance[points] = far
    return Pairs(out, vertex_face, barycentric, 1 / (1 + (distance / FAR) ** 2))


def _of_faces(regions):
    """The region of each face [F, 3 corners]: the largest of its corners' (0 only if all are)."""
    return regions.max(1)


def _nearest(search, points, normals):
    """As `Nearest.query`; where no normal is alike the nearest place does, however it is turned."""
    face, weight, far = search.query(points, normals, ALIKE)
    lost = np.flatnonzero(~np.isfinite(far))
    if len(lost):
        face[lost], weight[lost], away = search.query(points[lost])
        far[lost] = away + 2 * FAR  # it says little
    return face, weight, far


class Transfer:
    """Solves for the displacement of a surface whose triangles shall deform as others do."""

    def __init__(self, vertices, faces, hold, strength=1 / HOLD**2):
        """hold: [V] 0..1 how much the wanted place of each vertex counts; strength: 1/mm2."""
        from scipy.sparse import diags

        self.gradient, self.area = gradient(vertices, faces)
        weight = np.repeat(self.area, 3)
        K = self.gradient.T @ diags(weight) @ self.gradient
        self.held = strength * np.maximum(hold, 1e-6) * vertex_areas(vertices, faces)
        self.divergence = (self.gradient.T @ diags(weight)).tocsr()
        self.solve = factorized(K + diags(self.held))

    def displacement(self, gradients, places):
        """The displacement [V, 3] mm.

        Args:
            gradients: [F, 3, 3] wanted; row c is the gradient of component c.
            places: [V, 3] mm, wanted displacement of the held vertices.
        """
        right = self.divergence @ gradients.transpose(0, 2, 1).reshape(-1, 3)
        return self.solve(right + self.held[:, None] * places)


def deformations(laid, faces):
    """A function (shape [V, 3] mm of the head) -> gradients [N, 3, 3] of some faces' displacement.

    They are turned as the head was when it was laid.
    """
    head = laid.head
    undo = np.linalg.inv(frames(head.mean, head.faces[faces]))

    def of(shape):
        after = frames(head.mean + shape, head.faces[faces])
        return laid.turn @ (after @ undo - np.eye(3)) @ laid.turn.T

    return of


def own_shapes(laid):
    """The shapes of the built-in head on its own triangles as they were laid: [E, V, 3] mm.

    What is not flesh moves as in the built-in head, turned and scaled.
    """
    head = laid.head
    out = laid.turned(head.expression_basis)
    chosen = head.part_faces("skin", "eye_socket", "mouth_cavity")
    used, faces = np.unique(head.faces[chosen], return_inverse=True)
    faces = faces.reshape(-1, 3)
    still = np.abs(head.expression_basis[:, used]).max((0, 2)) < STILL
    solver = Transfer(laid.vertices[used], faces, still.astype(float), 1.0)
    none, wanted = np.zeros((len(used), 3)), deformations(laid, chosen)
    for k, shape in enumerate(head.expression_basis):
        if np.abs(shape[used]).max() > STILL:
            out[k, used] = solver.displacement(wanted(shape), none)
    return out.astype(np.float32)


def shapes(vertices, faces, pairs, laid, laid_shapes):
    """The shapes [E, V, 3] mm of a surface that corresponds to the laid head.

    Args:
        vertices: [V, 3] mm; faces: [F, 3]; pairs: Pairs.
        laid_shapes: [E, V of the head, 3] from `own_shapes`.
    """
    head = laid.head
    solver = Transfer(vertices, faces, pairs.trust**2)
    needed, index = np.unique(pairs.face, return_inverse=True)
    wanted = deformations(laid, needed)
    out = np.zeros((len(laid_shapes), len(vertices), 3), np.float32)
    for k, shape in enumerate(head.expression_basis):
        places = pairs.read(head.faces, laid_shapes[k])
        if np.abs(places).max() < STILL:
            continue
        out[k] = solver.displacement(wanted(shape)[index], places)
    return out


def people(vertices, faces, pairs, laid):
    """The identity modes [I, V, 3] mm of a surface, read off the laid head and smoothly continued."""
    from scipy.sparse import diags

    head = laid.head
    modes = laid.turned(pairs.read(head.faces, head.identity_basis))
    weight = pairs.trust**2 * vertex_areas(vertices, faces)
    K = stiffness(vertices, faces)
    solve = factorized(diags(weight + 1e-6) + 0.25 * K)
    flat = np.moveaxis(modes, 0, 1).reshape(len(vertices), -1)
    out = solve(weight[:, None] * flat)
    return np.moveaxis(out.reshape(len(vertices), len(modes), 3), 1, 0).astype(np.float32)
