"""Numbers to compare head models by: landmark fit, closed lids, teeth that stay inside, size."""

import time

import numpy as np

from bakery.geometry.mesh import vertex_normals
from bakery.geometry.raster import rasterize
from bakery.heads.base import CARRIERS, PARTS, weights
from bakery.heads.file import find_head, load_head
from bakery.heads.place import place_head
from bakery.heads.report import atlas_stretch, face_texels
from bakery.landmarks import LIPS_INNER
from bakery.types import EXPRESSION_INDEX, EXPRESSIONS

DEEP = 0.3  # mm that a vertex may reach into the skin
NEAR = 8.0  # mm; farther from the skin it is not the skin that it touches


def landmark_fit(head, points, sizes):
    """Mean distance of the fitted points [N, 468] and of the inner lip, in eye distances."""
    error = np.array([place_head(head, p, tuple(map(int, s))).error for p, s in zip(points, sizes)])
    return float(error.mean()), float(error[:, LIPS_INNER].mean())


def visible(head, vertices, yaw, names, size=900, width=130.0):
    """Pixels of the named parts seen from `yaw` degrees, without perspective, about the eyes."""
    hidden = [PARTS.index(name) for name in (*CARRIERS, "lashes", "tear")]
    shown = ~np.isin(head.face_part, hidden)
    turn, scale = np.radians(yaw), size / width
    x = vertices[:, 0] * np.cos(turn) - vertices[:, 2] * np.sin(turn)
    z = vertices[:, 0] * np.sin(turn) + vertices[:, 2] * np.cos(turn)
    pixels = np.stack([size / 2 + x * scale, size / 2 - vertices[:, 1] * scale], -1)
    face = rasterize(pixels, 500 - z, head.faces[shown], (size, size), True).face
    seen = head.face_part[shown][face[face >= 0]]
    return int(np.isin(seen, [PARTS.index(name) for name in names]).sum())


def open_eye_share(head, identities):
    """The largest share of the open eye that shows at eyeBlink 1, seen from 0 and +-40 degrees."""
    shut = weights({"eyeBlinkLeft": 1, "eyeBlinkRight": 1})
    eyes = ("eye_left", "eye_right")
    worst = 0.0
    for identity in identities:
        neutral = head.neutral(identity)
        closed = head.vertices(neutral, shut)
        for yaw in (-40, 0, 40):
            open_ = visible(head, neutral, yaw, eyes)
            worst = max(worst, visible(head, closed, yaw, eyes) / max(open_, 1))
    return worst


def poking(head, vertices):
    """Teeth vertices deeper than DEEP inside the skin of the face."""
    faces = head.faces[head.part_faces("skin", "mouth_cavity")]
    normals = vertex_normals(vertices, faces)
    skin = head.part_vertices("skin")
    around = np.unique(faces)
    around = around[(head.mean[around, 2] > -45) & (head.mean[around, 1] < -25)]
    is_skin = np.isin(around, skin)
    count = 0
    for chunk in np.array_split(head.part_vertices("teeth_upper", "teeth_lower"), 12):
        far = np.linalg.norm(vertices[chunk][:, None] - vertices[around][None], axis=-1)
        nearest = far.argmin(1)
        at = around[nearest]
        depth = -((vertices[chunk] - vertices[at]) * normals[at]).sum(1)
        reach = far[np.arange(len(chunk)), nearest]
        count += int((is_skin[nearest] & (depth > DEEP) & (reach < NEAR)).sum())
    return count


def mixes(rng, count):
    """Random mixes of four talking and mouth shapes: [count, E]."""
    talk = [
        EXPRESSION_INDEX[name]
        for name in EXPRESSIONS
        if name.startswith(("jaw", "mouth")) and name != "mouthClose"
    ]
    out = np.zeros((count, len(EXPRESSIONS)))
    for row in out:
        row[rng.choice(talk, 4, replace=False)] = rng.random(4) * 0.7
    return out


def measure(name, points, sizes, names, rng, count=40):
    """One column of the table: what a head is worth, as a mapping.

    Args:
        points: [N, 478, 2] pixels; sizes: [N, 2]; names: [N], _neutral or _smiling in each.
        rng: numpy Generator; count: random mixes to try.
    """
    head = load_head(name)
    start = time.perf_counter()
    load_head(name)
    seconds = time.perf_counter() - start
    out = {"vertices": len(head.mean), "triangles": len(head.faces)}
    out["megabytes"] = round(find_head(name).stat().st_size / 1e6, 2)
    out["load, ms"] = round(1000 * seconds)
    for kind in ("neutral", "smiling"):
        rows = [k for k, photo in enumerate(names) if kind in photo]
        if rows:
            every, lips = landmark_fit(head, points[rows], sizes[rows])
            out[f"{kind}: landmarks, %"] = round(100 * every, 3)
            out[f"{kind}: inner lips, %"] = round(100 * lips, 3)
    people = np.concatenate([np.zeros((1, len(head.identity_basis))),
                             rng.normal(size=(8, len(head.identity_basis)))])  # fmt: skip
    out["blink: eye showing, %, worst of 9"] = round(100 * open_eye_share(head, people), 2)
    teeth = ("teeth_upper", "teeth_lower")
    out["neutral: pixels of teeth"] = sum(visible(head, head.mean, y, teeth) for y in (-40, 0, 40))
    single = np.eye(len(EXPRESSIONS))
    out["teeth vertices in the skin, 52 shapes"] = sum(
        poking(head, head.vertices(head.mean, w)) for w in single
    )
    out[f"mixes of {count} with teeth in the skin"] = sum(
        poking(head, head.vertices(head.mean, w)) > 0 for w in mixes(rng, count)
    )
    area, angle = atlas_stretch(head)
    out["face texels of 1024 x 1024"] = face_texels(head)
    out["atlas: deviation of ln area"], out["atlas: angle stretch"] = (
        round(area, 3),
        round(angle, 3),
    )
    return out
