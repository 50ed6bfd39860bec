"""Numbers that describe a head model."""

import numpy as np

from bakery.geometry.raster import rasterize
from bakery.heads.base import PARTS

SIZE = 1024  # texels of the atlas that areas are counted in


def describe(head):
    """What a head holds: a mapping for people and for JSON."""
    parts = {
        name: int((head.face_part == number).sum())
        for number, name in enumerate(PARTS)
        if (head.face_part == number).any()
    }
    return {
        "name": head.name,
        "licence": head.licence,
        "source": head.source,
        "vertices": len(head.mean),
        "triangles": len(head.faces),
        "identity modes": len(head.identity_basis),
        "expressions": len(head.expression_basis),
        "landmarks": len(head.landmark_faces),
        "triangles of each part": parts,
        "texels of the face": face_texels(head),
    }


def face_texels(head):
    """Texels of 1024 x 1024 on the face: forehead to chin, ear to ear."""
    seen = rasterize(head.uv * SIZE, None, head.uv_faces, (SIZE, SIZE)).face
    low, high = _face_box(head)
    middle = head.mean[head.faces].mean(1)
    inside = ((middle > low) & (middle < high)).all(1) & (head.face_part == PARTS.index("skin"))
    return int(inside[seen[seen >= 0]].sum())


def _face_box(head):
    """The box [2, 3] mm around the face: between the ears, from the chin to the hairline."""
    points = head.landmarks(head.mean)
    low, high = points[:468].min(0), points[:468].max(0)
    return low - [2, 2, 2], high + [2, 2, np.inf]


def atlas_stretch(head):
    """Area and angle distortion of the skin's chart, weighted by the face's area in space.

    Returns:
        (area: standard deviation of ln(texels per mm^2) on the face, angle: mean of larger over
        smaller singular value of the map).
    """
    skin = head.part_faces("skin")
    low, high = _face_box(head)
    middle = head.mean[head.faces[skin]].mean(1)
    skin = skin[((middle > low) & (middle < high)).all(1)]
    p, q = head.mean[head.faces[skin]].astype(float), head.uv[head.uv_faces[skin]].astype(float)
    e1, e2 = p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]
    x = np.linalg.norm(e1, axis=1)
    u = e1 / x[:, None]
    a = np.einsum("nc,nc->n", e2, u)
    h = np.linalg.norm(e2 - a[:, None] * u, axis=1)
    local = np.zeros((len(p), 2, 2))
    local[:, 0, 0], local[:, 0, 1], local[:, 1, 1] = x, a, h
    flat = np.stack([q[:, 1] - q[:, 0], q[:, 2] - q[:, 0]], -1) * SIZE
    values = np.linalg.svd(flat @ np.linalg.inv(local), compute_uv=False)
    weight = x * h
    log_area = np.log(values.prod(1))
    mean = np.average(log_area, weights=weight)
    return (
        float(np.sqrt(np.average((log_area - mean) ** 2, weights=weight))),
        float(np.average(values[:, 0] / values[:, 1], weights=weight)),
    )
