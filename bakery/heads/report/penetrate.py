"""How deep the parts of a head reach into each other. Measurement only."""

import numpy as np

from bakery.geometry import rotation
from bakery.geometry.mesh import vertex_normals
from bakery.heads.base import EYES, FOLLOW, gaze_of, weights
from bakery.heads.eyes import bulge, iris_vertices
from bakery.types import EXPRESSION_INDEX, EXPRESSIONS

DEEP = 0.3  # mm that a vertex may reach into another part
NEAR = 8.0  # mm; farther from a surface it is not that surface which is touched
TALK = tuple(
    name for name in EXPRESSIONS if name.startswith(("jaw", "mouth")) and name != "mouthClose"
)
FEEL = tuple(
    name
    for name in EXPRESSIONS
    if name.startswith(("brow", "eye", "cheek", "nose")) and name != "cheekPuff"
)
PAIRS = ("teeth in skin", "skin in eye", "tongue in teeth")


class Contacts:
    """The vertices of a head that could touch, chosen once."""

    def __init__(self, head):
        self.head = head
        self.skin = set(head.part_vertices("skin").tolist())
        flesh = head.faces[head.part_faces("skin", "mouth_cavity")]
        corners = head.mean[flesh]
        mouth = (corners[..., 2].min(1) > -45) & (corners[..., 1].max(1) < -25)
        self.mouth_faces = flesh[mouth]
        self.mouth = np.unique(self.mouth_faces)
        self.on_skin = np.isin(self.mouth, head.part_vertices("skin"))
        self.teeth = head.part_vertices("teeth_upper", "teeth_lower")
        self.tongue_faces = head.faces[head.part_faces("tongue")]
        self.tongue = np.unique(self.tongue_faces)
        self.lids = []
        for eye, center in zip(EYES, head.eye_centers(head.mean)):
            pole, ring = iris_vertices(head, eye)
            near = head.part_vertices("skin")
            near = near[np.linalg.norm(head.mean[near] - center, axis=1) < 30]
            self.lids.append((near, ring, head.follow == FOLLOW.index("eye_" + eye)))

    def depths(self, vertices, expression):
        """Depth [mm] of each vertex that reaches into another part, for each of PAIRS.

        Args:
            vertices: [V, 3] mm, a deformed head; expression: [E], the weights it has.
        """
        inside = _inside(vertices, self.teeth, self.mouth_faces, self.mouth, self.on_skin)
        tongue = _inside(vertices, self.teeth, self.tongue_faces, self.tongue)
        return dict(zip(PAIRS, (inside, self._lids_in_eyes(vertices, expression), tongue)))

    def _lids_in_eyes(self, vertices, expression):
        found = []
        centers = self.head.eye_centers(vertices)
        for (near, ring, ball), center, gaze in zip(self.lids, centers, gaze_of(expression)):
            radius = np.linalg.norm(vertices[ball] - center, axis=1).min()
            axis = rotation.yaw_pitch(*gaze) @ np.array([0.0, 0.0, 1.0])
            border = (
                (vertices[ring] - center) @ axis / np.linalg.norm(vertices[ring] - center, axis=1)
            )
            iris = np.degrees(np.arccos(border.mean()))
            offset = vertices[near] - center
            reach = np.linalg.norm(offset, axis=1)
            angle = np.degrees(np.arccos(np.clip(offset @ axis / reach, -1, 1)))
            found.append(radius * (1 + bulge(angle, iris)) - reach)
        depth = np.concatenate(found)
        return depth[depth > 0]


def _inside(vertices, points, faces, surface, counts=None):
    """Depth of the points under a surface, by the normal of its nearest vertex.

    Args:
        points: vertex numbers; faces: [F, 3] of the surface; surface: its vertex numbers.
        counts: [len(surface)] bool, where the surface is one that may not be crossed.
    """
    from scipy.spatial import cKDTree

    far, nearest = cKDTree(vertices[surface]).query(vertices[points], distance_upper_bound=NEAR)
    reached = np.isfinite(far)
    if counts is not None:
        reached[reached] = counts[nearest[reached]]
    points, at = points[reached], surface[nearest[reached]]
    normals = vertex_normals(vertices, faces)
    depth = -((vertices[points] - vertices[at]) * normals[at]).sum(1)
    return depth[depth > 0]


def singles():
    """Each shape at 1 as {name: weights}; two of them mean something only with the jaw open."""
    out = {name: weights({name: 1.0}) for name in EXPRESSIONS}
    for name, jaw in (("mouthClose", 1.0), ("tongueOut", 0.5)):
        out[name] = weights({name: 1.0, "jawOpen": jaw})
    return out


def mixes(rng, count):
    """Random talking with expression: [count, E]. Four shapes of the mouth, three of the rest."""
    out = np.zeros((count, len(EXPRESSIONS)))
    for row in out:
        for names, most, strongest in ((TALK, 4, 0.7), (FEEL, 3, 1.0)):
            for name in rng.choice(names, most, replace=False):
                row[EXPRESSION_INDEX[name]] = rng.random() * strongest
    return out
