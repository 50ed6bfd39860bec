"""The generator that needs no network: deformed neutral, shaded interior, eyes, wrinkle shading.

It is the baseline that a trained generator has to beat, and the fallback.
"""

import numpy as np

from bakery.generators.base import Subject
from bakery.generators.eyes import seen_eye
from bakery.generators.fold_maps import TINT, FoldMaps
from bakery.generators.lids import with_lids
from bakery.generators.shade import (
    EYES,
    MOUTH,
    is_part,
    lid_occlusion,
    lip_occlusion,
    relative_irradiance,
)
from bakery.geometry import camera as cameras
from bakery.geometry import rotation
from bakery.geometry.mesh import vertex_normals
from bakery.geometry.sample import interpolate
from bakery.heads.base import PARTS
from bakery.landmarks import LIPS_INNER
from bakery.types import Conditions, Generated

# Half-strength light change gave +0.17 dB on real smiles, full strength nothing (PITFALLS 12).
LIGHT_CHANGE = 0.5


class RenderedGenerator:
    """See the module; one instance serves any number of subjects."""

    name = "rendered"
    source_type = "compositeSynthetic"
    sha256 = ""  # it has no weights

    def __init__(self):
        self._folds = FoldMaps()

    def generate(
        self, subject: Subject, conditions: Conditions, interior_only: bool = False
    ) -> Generated:
        """Paint one target of a subject (generators.base.Generator)."""
        if interior_only:
            ratio = np.ones_like(conditions.deformed_neutral)
        else:
            ratio = self._skin_ratio(subject, conditions)
        color, alpha = self._interior(subject, conditions)
        if not interior_only:
            color, alpha = with_lids(subject, conditions, color, alpha)
        image = (
            conditions.deformed_neutral * ratio * (1 - alpha[..., None]) + color * alpha[..., None]
        )
        return Generated(image, ratio, color, alpha)

    def _skin_ratio(self, subject, conditions):
        """Shading over the deformed neutral [H, W, 3]: change of light, and folds."""
        head = subject.head
        skin = is_part(conditions.part, "skin")
        change = self._light_change(subject, conditions.vertices)
        log_ratio = interpolate(conditions.fragments, change[head.faces][..., None])[..., 0]
        log_ratio = log_ratio + self._folds.at(subject, conditions)
        return np.exp(np.where(skin, log_ratio, 0)[..., None] * TINT).astype(np.float32)

    def _light_change(self, subject, vertices):
        """Log of the relative irradiance, deformed over neutral, [V] float32."""
        turn = subject.light_rotation.T
        faces = subject.head.faces
        before = vertex_normals(subject.neutral, faces) @ turn
        after = vertex_normals(vertices, faces) @ turn
        change = np.log(
            relative_irradiance(after, subject.light) / relative_irradiance(before, subject.light)
        )
        return (LIGHT_CHANGE * change).astype(np.float32)

    def _interior(self, subject, conditions):
        """Eyes and mouth interior: colour [H, W, 3] and alpha [H, W] (1 on their pixels)."""
        head, part = subject.head, conditions.part
        camera, depth = conditions.camera, conditions.depth
        color = np.zeros(part.shape + (3,), np.float32)

        eyes = is_part(part, *EYES)
        if eyes.any():
            lids = lid_occlusion(part, depth, camera.focal)
            for which, name in enumerate(EYES):
                mine = part == PARTS.index(name)
                if mine.any():
                    ball, glint = seen_eye(subject, conditions, which, mine)
                    color[mine] = ball * lids[mine][:, None] + glint

        mouth = is_part(part, *MOUTH)
        if mouth.any():
            lips = cameras.to_camera(head.landmarks(conditions.vertices)[LIPS_INNER], camera)
            lip_depth = float(np.median(-lips[:, 2]))
            reach = lip_occlusion(part, depth, camera.focal, lip_depth)[mouth]
            normals, base = conditions.normals[mouth], conditions.deformed_neutral[mouth]
            turn = subject.light_rotation @ rotation.matrix(camera.rotation).T  # camera -> photo's
            light = relative_irradiance(normals @ turn.T.astype(np.float32), subject.light)
            # Saliva shines under a broad source above the camera.
            wet = np.clip(normals @ np.array([0.0, 0.35, 0.94], np.float32), 0, 1) ** 60
            sheen = 0.5 * wet * base.max()
            color[mouth] = (base * light[:, None] + sheen[:, None]) * reach[:, None]
        inside = eyes | mouth | is_part(part, "eye_socket")
        color = np.where(
            is_part(part, "eye_socket")[..., None], conditions.deformed_neutral * 0.5, color
        )
        return color, inside.astype(np.float32)
