"""What a head model is: data, not code. `bakery.heads.file` reads and writes it."""

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from operator import attrgetter
from typing import TypeVar

import numpy as np

from bakery.geometry import rotation
from bakery.memo import once_per_object
from bakery.types import EXPRESSION_INDEX, EXPRESSIONS

# Every face belongs to one part. A head model may lack parts, but not skin and eyes.
PARTS = (
    "skin",
    "eye_socket",  # inside of the lids, behind the opening
    "mouth_cavity",  # inner lips, cheeks, palate
    "eye_left",
    "eye_right",
    "teeth_upper",
    "teeth_lower",
    "gums_upper",
    "gums_lower",
    "tongue",
    "lashes",  # alpha cards
    "tear",  # alpha shells: lacrimal fluid, occlusion, blend
    "mouth_sheet",  # proxy mesh: spans the inner lip contour
    "eye_cap_left",  # proxy mesh: sphere cap in front of the eyeball, behind the lids
    "eye_cap_right",
)
# Proxy meshes: pictures of the mouth and of the eyes are shown on them. Files name them so.
PROXIES = ("mouth_sheet", "eye_cap_left", "eye_cap_right")
CARDS = ("lashes", "tear")  # drawn over the rest, as clear as the hair layer makes them
INTERIOR = (  # what the generator's conditions show instead
    "eye_socket mouth_cavity eye_left eye_right teeth_upper teeth_lower gums_upper gums_lower tongue"
).split()
MOUTH = ("mouth_cavity", "teeth_upper", "teeth_lower", "gums_upper", "gums_lower", "tongue")
FOLLOW = ("skin", "skull", "jaw", "eye_left", "eye_right")  # what a vertex moves with
EYES = ("left", "right")  # order of every per-eye array: the subject's left first

# Degrees of eyeball rotation at weight 1 of eyeLookIn/Out and eyeLookUp/Down.
GAZE_YAW, GAZE_PITCH = 30.0, 25.0


Made = TypeVar("Made")


@dataclass(frozen=True)
class HeadModel:
    """A linear 3D morphable head: one topology, one atlas, 52 expressions, any number of modes."""

    name: str
    licence: str  # SPDX id, or the licence in a few words
    source: str
    mean: np.ndarray  # [V, 3] float32 mm
    faces: np.ndarray  # [F, 3] int32 into mean, counter-clockwise seen from outside
    uv: np.ndarray  # [U, 2] float32 0..1, origin top left, no overlaps
    uv_faces: np.ndarray  # [F, 3] int32 into uv
    face_part: np.ndarray  # [F] uint8 into PARTS
    follow: np.ndarray  # [V] uint8 into FOLLOW
    identity_basis: np.ndarray  # [I, V, 3] float32 mm for one standard deviation
    expression_basis: np.ndarray  # [E, V, 3] float32 mm at weight 1, in the order of EXPRESSIONS
    landmark_faces: np.ndarray  # [L] int32: the face each landmark lies on
    landmark_barycentric: np.ndarray  # [L, 3] float32 where on it
    # proxy or "cards" (lashes and tear line) -> [left, top, width, height] 0..1
    uv_rectangles: dict[str, list[float]] = field(default_factory=dict)
    whole: "HeadModel | None" = None  # what a piece (`cut`) is of
    whole_vertices: np.ndarray | None = None  # [V] the piece's vertices among those of the whole

    def part_faces(self, *names: str) -> np.ndarray:
        """Indices of the faces that belong to the named parts."""
        return np.flatnonzero(np.isin(self.face_part, [PARTS.index(name) for name in names]))

    def part_vertices(self, *names: str) -> np.ndarray:
        """Indices of the vertices that the named parts use."""
        return np.unique(self.faces[self.part_faces(*names)])

    def cut(self, faces: np.ndarray) -> "HeadModel":
        """The piece of the head that some faces [F] make up, and those that landmarks lie on.

        Returns:
            HeadModel with `whole` and `whole_vertices`.

        Raises:
            ValueError: the head is a piece itself.
        """
        if self.whole is not None:
            raise ValueError("a piece of a head cannot be cut again; cut the whole one")
        kept = np.zeros(len(self.faces), bool)
        kept[faces] = kept[self.landmark_faces] = True
        used, compact = np.unique(self.faces[kept], return_inverse=True)
        return replace(
            self,
            mean=self.mean[used],
            faces=compact.reshape(-1, 3).astype(np.int32),
            uv_faces=self.uv_faces[kept],
            face_part=self.face_part[kept],
            follow=self.follow[used],
            identity_basis=self.identity_basis[:, used],
            expression_basis=np.ascontiguousarray(self.expression_basis[:, used]),
            landmark_faces=(np.cumsum(kept) - 1)[self.landmark_faces].astype(np.int32),
            whole=self,
            whole_vertices=used,
        )

    @property
    @once_per_object
    def digest(self) -> str:
        """SHA-256 over every name and number of the head, for what is made from it.

        Each array goes in with its name, type and shape, so that no two heads read alike.
        """
        sha = hashlib.sha256()
        for entry in fields(self):
            value = getattr(self, entry.name)
            if isinstance(value, HeadModel):
                value = value.digest
            if isinstance(value, np.ndarray):
                about = [entry.name, str(value.dtype), value.shape]
                sha.update(json.dumps(about).encode())
                sha.update(np.ascontiguousarray(value).data)
            else:
                sha.update(json.dumps([entry.name, value], sort_keys=True).encode())
        return sha.hexdigest()

    @property
    @once_per_object
    def landmark_vertices(self) -> np.ndarray:
        """The three vertices [L, 3] around each landmark."""
        corners: np.ndarray = self.faces[self.landmark_faces]
        return corners

    def landmarks(self, vertices: np.ndarray) -> np.ndarray:
        """Landmark positions [L, 3] on a shape [V, 3]."""
        corners = vertices[self.landmark_vertices]
        places: np.ndarray = np.einsum("lkc,lk->lc", corners, self.landmark_barycentric)
        return places

    def landmark_uv(self) -> np.ndarray:
        """Where the landmarks lie in the atlas: [L, 2] 0..1."""
        corners = self.uv[self.uv_faces[self.landmark_faces]]
        places: np.ndarray = np.einsum("lkc,lk->lc", corners, self.landmark_barycentric)
        return places

    def neutral(self, identity: np.ndarray, offsets: np.ndarray | None = None) -> np.ndarray:
        """The neutral shape [V, 3] mm of identity [<= I], moved by offsets [V, 3] mm if given."""
        identity = np.asarray(identity, np.float32)
        shape = self.mean + np.tensordot(identity, self.identity_basis[: len(identity)], 1)
        return shape if offsets is None else shape + np.asarray(offsets, np.float32)

    def eye_centers(self, neutral: np.ndarray) -> np.ndarray:
        """Centres [2, 3] of the eyeballs (left, right) of a neutral shape."""
        return np.stack([neutral[ball].mean(0) for ball in self.eyeballs])

    @property
    @once_per_object
    def eyeballs(self) -> list[np.ndarray]:
        """Numbers [n] of the vertices of each eyeball (left, right)."""
        return [np.flatnonzero(self.follow == FOLLOW.index("eye_" + eye)) for eye in EYES]

    def vertices(
        self,
        neutral: np.ndarray,
        expression: np.ndarray,
        gaze: Sequence[float] | np.ndarray | None = None,
    ) -> np.ndarray:
        """Deform a neutral shape.

        Args:
            neutral: [V, 3] mm, from `neutral`.
            expression: [E] weights.
            gaze: [2] degrees (yaw to the subject's left, pitch up) turns both eyeballs rigidly and
                takes the place of what the eyeLook* weights do to the eyeballs (lids follow the
                weights all the same); None derives it from those weights.

        Returns:
            [V, 3] mm.
        """
        expression = np.asarray(expression, np.float32)
        used = np.flatnonzero(expression)
        moved = np.tensordot(expression[used], self.expression_basis[used], 1)
        out: np.ndarray = neutral + moved.astype(neutral.dtype)
        pair = gaze_of(expression) if gaze is None else np.array([gaze, gaze], float)
        for ball, center, (yaw, pitch) in zip(self.eyeballs, self.eye_centers(neutral), pair):
            out[ball] = (neutral[ball] - center) @ rotation.yaw_pitch(yaw, pitch).T + center
        return out


def once_a_mean(make: Callable[[HeadModel], Made]) -> Callable[[HeadModel], Made]:
    """A function of a head that is computed once for all that share a mean (`memo`).

    Heads that differ in their expressions alone do.
    """
    return once_per_object(make, attrgetter("mean"))


def gaze_of(expression: np.ndarray) -> np.ndarray:
    """Gaze of both eyes [2 (left, right), 2 (yaw, pitch)] degrees that the eyeLook* weights mean."""
    weight = {name: expression[index] for name, index in EXPRESSION_INDEX.items()}
    out = np.zeros((2, 2))
    for row, eye in enumerate(("Left", "Right")):
        outward = weight["eyeLookOut" + eye] - weight["eyeLookIn" + eye]
        out[row, 0] = GAZE_YAW * outward * (1 if eye == "Left" else -1)
        out[row, 1] = GAZE_PITCH * (weight["eyeLookUp" + eye] - weight["eyeLookDown" + eye])
    return out


def look(expression: np.ndarray, gaze: Sequence[float] | np.ndarray) -> np.ndarray:
    """Expression [E] with its eyeLook* weights set to gaze [2] degrees (yaw, pitch), clipped to 1."""
    out = np.array(expression, np.float32)
    yaw, pitch = gaze[0] / GAZE_YAW, gaze[1] / GAZE_PITCH
    for eye, side in (("Left", 1), ("Right", -1)):
        out[EXPRESSION_INDEX["eyeLookOut" + eye]] = np.clip(side * yaw, 0, 1)
        out[EXPRESSION_INDEX["eyeLookIn" + eye]] = np.clip(-side * yaw, 0, 1)
        out[EXPRESSION_INDEX["eyeLookUp" + eye]] = np.clip(pitch, 0, 1)
        out[EXPRESSION_INDEX["eyeLookDown" + eye]] = np.clip(-pitch, 0, 1)
    return out


def weights(named: Mapping[str, float]) -> np.ndarray:
    """Expression array [E] from a mapping of ARKit names to weights."""
    out = np.zeros(len(EXPRESSIONS), np.float32)
    for name, value in named.items():
        out[EXPRESSION_INDEX[name]] = value
    return out
