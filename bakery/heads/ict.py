"""ICT-FaceKit Light as a head model. The data stays with the user; only its layout is known here.

References:
    github.com/ICT-VGL/ICT-FaceKit (MIT, (c) 2020 USC Institute for Creative Technologies).
    Li et al., "Learning Formation of Physically-Based Face Attributes", CVPR 2020.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bakery.errors import InputError
from bakery.formats import npz
from bakery.formats.files import read_bytes
from bakery.geometry.mesh import boundary_loops
from bakery.heads.base import PARTS, PROXIES
from bakery.heads.embed import known_landmarks, on_faces
from bakery.heads.eyes import Ball, eye_proxy, eyeball, fit_ball
from bakery.heads.patch import Patch, boxed, follow_ids, join, place
from bakery.heads.proxies import mouth_proxy
from bakery.types import EXPRESSION_INDEX, EXPRESSIONS

LICENCE = "MIT, (c) 2020 USC Institute for Creative Technologies"
SOURCE = "ICT-FaceKit Light, github.com/ICT-VGL/ICT-FaceKit"
VERTICES = 26719
# Vertices of each piece of the mesh, in its order: name, end (each starts where the last ended).
PIECES = (
    ("skin", 11248),
    ("mouth_cavity", 13294),
    ("eye_socket", 14062),
    ("gums_tongue", 17039),
    ("teeth", 21451),
    ("sclera_left", 22221),
    ("iris_left", 23021),
    ("sclera_right", 23791),
    ("iris_right", 24591),
    ("lacrimal_left", 24795),
    ("lacrimal_right", 24999),
    ("blend_left", 25023),
    ("blend_right", 25047),
    ("occlusion_left", 25199),
    ("occlusion_right", 25351),
    ("lashes_left", 26035),
    ("lashes_right", 26719),
)
# Islands of the gums-and-tongue chart in the order of the file.
ISLANDS = (
    "gums_upper gums_lower gums_upper gums_upper gums_lower mouth_cavity mouth_cavity "
    "mouth_cavity tongue mouth_cavity tongue"
).split()
# uv of each piece: the tile (u, v) it fills in the source -> its box in the atlas.
CHARTS = {
    "face": ((0, 0, 1, 1), (0.004, 0.004, 0.992, 0.66)),
    "back": ((1, 0, 1, 1), (0.338, 0.672, 0.324, 0.324)),
    "gums_tongue": ((2, 0, 1, 1), (0.668, 0.83, 0.328, 0.166)),
    "teeth": ((3, 0, 1, 1), (0.794, 0.672, 0.202, 0.154)),
    "lacrimal_left": ((4, 0, 1, 1), (0.212, 0.796, 0.058, 0.096)),
    "lacrimal_right": ((5, 0, 1, 1), (0.274, 0.796, 0.058, 0.096)),
    "blend_left": ((0, 0, 1, 1), (0.004, 0.9, 0.06, 0.096)),
    "blend_right": ((0, 0, 1, 1), (0.068, 0.9, 0.06, 0.096)),
    "occlusion_left": ((0, 0, 1, 1), (0.132, 0.9, 0.06, 0.096)),
    "occlusion_right": ((0, 0, 1, 1), (0.196, 0.9, 0.06, 0.096)),
    "lashes_left": ((6.5, 0, 0.5, 1), (0.26, 0.9, 0.034, 0.096)),
    "lashes_right": ((6, 0, 0.5, 1), (0.298, 0.9, 0.034, 0.096)),
}
BOXES = {
    "mouth_sheet": (0.004, 0.672, 0.2, 0.12),
    "eye_cap_right": (0.208, 0.672, 0.12, 0.12),
    "eye_cap_left": (0.668, 0.672, 0.12, 0.12),
    "eye_left": (0.108, 0.796, 0.1, 0.1),
    "eye_right": (0.004, 0.796, 0.1, 0.1),
    "cards": (0.128, 0.905, 0.204, 0.086),  # over the source's own, which no avatar shows
}
CLOSE = 1.12  # of eyeBlink: the source leaves a slit for its lash cards to hide
TONGUE_OUT = np.array([0.0, -4.0, 26.0])  # mm; the source has no such shape


@dataclass(frozen=True)
class Source:
    """The numbers of ICT-FaceKit, in centimetres as they come."""

    mean: np.ndarray  # [V, 3]
    quads: np.ndarray  # [F, 4], -1 last in triangles
    uv: np.ndarray  # [U, 2], tiles side by side, v up
    uv_quads: np.ndarray  # [F, 4]
    identity: np.ndarray  # [I, V, 3]
    expression: dict  # name in the source -> [V, 3]


def read(path):
    """Read ICT-FaceKit from its FaceXModel folder of OBJ files, or from an .npz of its numbers.

    Raises:
        InputError: neither; or a file is missing or has another layout.
    """
    path = Path(path)
    source = _read_npz(path) if path.suffix == ".npz" else _read_folder(path)
    if len(source.mean) != VERTICES:
        raise InputError(
            f"{path}: has {len(source.mean)} vertices, ICT-FaceKit Light has {VERTICES}; "
            "give its FaceXModel folder"
        )
    return source


def _read_npz(path):
    try:
        data = npz.unpack_arrays(read_bytes(path))
        start, index, value = data["expr_ptr"], data["expr_idx"], data["expr_val"]
        shapes = {}
        for k, name in enumerate(data["expr_names"]):
            shape = np.zeros(data["neutral"].shape, np.float32)
            shape[index[start[k] : start[k + 1]]] = value[start[k] : start[k + 1]]
            shapes[str(name)] = shape
        return Source(
            data["neutral"],
            data["faces"],
            data["uv"],
            data["uv_faces"],
            data["identity_deltas"].astype(np.float32),
            shapes,
        )
    except (ValueError, KeyError, IndexError, TypeError) as error:
        raise InputError(f"{path}: not a file of ICT-FaceKit ({error})") from error


def _positions(path):
    with open(path, encoding="utf-8", errors="replace") as lines:
        rows = [line.split()[1:4] for line in lines if line.startswith("v ")]
    try:
        return np.array(rows, np.float32).reshape(-1, 3)
    except ValueError as error:
        raise InputError(f"{path}: a vertex is not three numbers") from error


def _read_folder(path):
    neutral = path / "generic_neutral_mesh.obj"
    if not neutral.is_file():
        raise InputError(
            f"{path}: holds no generic_neutral_mesh.obj; give the FaceXModel folder of ICT-FaceKit"
        )
    mean = _positions(neutral)
    uv, quads, uv_quads = [], [], []
    with open(neutral, encoding="utf-8", errors="replace") as lines:
        for line in lines:
            if line.startswith("vt "):
                uv.append([float(word) for word in line.split()[1:3]])
            elif line.startswith("f "):
                corners = [word.split("/") for word in line.split()[1:]]
                quads.append([int(c[0]) - 1 for c in corners] + [-1] * (4 - len(corners)))
                uv_quads.append([int(c[1]) - 1 for c in corners] + [-1] * (4 - len(corners)))
    others = {file.stem: file for file in sorted(path.glob("*.obj")) if file != neutral}

    def offsets(file):
        moved = _positions(file)
        if moved.shape != mean.shape:
            raise InputError(f"{file}: has {len(moved)} vertices, the neutral mesh {len(mean)}")
        return moved - mean

    identity = [offsets(file) for name, file in others.items() if name.startswith("identity")]
    if not identity:
        raise InputError(f"{path}: holds no identity*.obj; give the whole FaceXModel folder")
    shapes = {n: offsets(f) for n, f in others.items() if not n.startswith("identity")}
    return Source(
        mean, np.array(quads), np.array(uv), np.array(uv_quads), np.array(identity), shapes
    )


def arkit_shapes(source, tongue):
    """The 52 shapes [52, V, 3] mm; gums and teeth move only where the jaw or tongue does."""
    out = np.zeros((len(EXPRESSIONS), len(source.mean), 3), np.float32)
    for k, name in enumerate(EXPRESSIONS):
        if name == "tongueOut":
            z = source.mean[tongue, 2]
            share = np.clip((z - z.min()) / np.ptp(z), 0, 1)
            out[k, tongue] = (share**1.5)[:, None] * TONGUE_OUT
            continue
        names = [name, name.replace("Left", "_L").replace("Right", "_R"), name + "_L", name + "_R"]
        if name in ("jawLeft", "jawRight", "mouthLeft", "mouthRight"):
            names = [name]
        found = [source.expression[n] for n in names if n in source.expression]
        if not found:
            raise InputError(f"ICT-FaceKit here lacks the shape {name}; give its whole folder")
        out[k] = 10 * sum(found) * (CLOSE if name.startswith("eyeBlink") else 1)
        inside = slice(_start("gums_tongue"), dict(PIECES)["teeth"])
        if not name.startswith("jaw"):  # noise of up to 0.3 mm in the source
            out[k, inside] = 0
    return out


def _start(piece):
    names = [name for name, _ in PIECES]
    return dict((n, s) for n, s in zip(names, [0] + [end for _, end in PIECES]))[piece]


def _islands(uv_faces):
    """Number the connected charts of uv_faces [F, 3], in the order of their first faces: [F]."""
    label = np.arange(uv_faces.max() + 1)
    while True:
        lowest = label[uv_faces].min(1)
        new = label.copy()
        for k in range(3):
            np.minimum.at(new, uv_faces[:, k], lowest)
        new = new[new]
        if (new == label).all():
            break
        label = new
    found, first = np.unique(label[uv_faces[:, 0]], return_index=True)
    order = {found[k]: rank for rank, k in enumerate(np.argsort(first))}
    return np.array([order[x] for x in label[uv_faces[:, 0]]])


def _triangles(quads, uv_quads):
    four = quads[:, 3] >= 0
    cut = [([0, 1, 2], slice(None)), ([0, 2, 3], four)]
    return (
        np.concatenate([quads[rows][:, columns] for columns, rows in cut]),
        np.concatenate([uv_quads[rows][:, columns] for columns, rows in cut]),
    )


def _ball(source, side):
    """The eyeball as a Ball: a sphere through the back of the sclera."""
    used = np.arange(_start("sclera_" + side), dict(PIECES)["sclera_" + side])
    points = source.mean[used].astype(float) * 10
    points = points[points[:, 2] < np.median(points[:, 2])]
    A = np.concatenate([2 * points, np.ones((len(points), 1))], 1)
    *center, rest = np.linalg.lstsq(A, (points**2).sum(1), rcond=None)[0]
    center = np.array(center)
    radius = float(np.sqrt(rest + center @ center))
    modes, scales = fit_ball(source.mean[used] * 10.0, center, 10.0 * source.identity[:, used])
    return Ball(center, radius, 27.0, modes, scales)


def build(source):
    """The head model of a Source.

    Returns:
        HeadModel named "ict".
    """
    faces, uv_faces = _triangles(source.quads, source.uv_quads)
    piece_of = np.empty(VERTICES, int)
    names = [name for name, _ in PIECES]
    for number, (name, end) in enumerate(PIECES):
        piece_of[_start(name) : end] = number
    # Rings shared with the sockets belong to the skin's range, so a face is what its last piece is.
    piece = np.array(names)[piece_of[faces].max(1)]
    keep = ~np.isin(piece, ["sclera_left", "sclera_right", "iris_left", "iris_right"])
    faces, uv_faces, piece = faces[keep], uv_faces[keep], piece[keep]
    parts = piece.copy()
    inner = np.flatnonzero(piece == "gums_tongue")
    island = _islands(uv_faces[inner])
    if island.max() + 1 != len(ISLANDS):
        raise InputError(f"ICT-FaceKit here has {island.max() + 1} gum charts, not {len(ISLANDS)}")
    parts = parts.astype("U16")
    parts[inner] = np.array(ISLANDS)[island]
    jaw = source.expression["jawOpen"]
    teeth = np.flatnonzero(piece == "teeth")
    moves = np.linalg.norm(jaw[faces[teeth]], axis=-1).mean(1) > 0.05
    parts[teeth] = np.where(moves, "teeth_lower", "teeth_upper")
    for short, part in (
        ("lacrimal", "tear"),
        ("blend", "tear"),
        ("occlusion", "tear"),
        ("lashes", "lashes"),
    ):
        for side in ("left", "right"):
            parts[piece == f"{short}_{side}"] = part
    tongue = np.unique(faces[parts == "tongue"])
    expression = arkit_shapes(source, tongue)

    follow = follow_ids("skin", VERTICES)
    for part, what in (
        ("teeth_upper", "skull"),
        ("gums_upper", "skull"),
        ("teeth_lower", "jaw"),
        ("gums_lower", "jaw"),
        ("tongue", "jaw"),
    ):
        follow[np.unique(faces[parts == part])] = follow_ids(what, 1)[0]

    tile = np.where(
        piece == "skin",
        "face",
        np.where(np.isin(piece, ["mouth_cavity", "eye_socket"]), "back", piece),
    )
    tile[(tile == "face") & (source.uv[uv_faces].mean(1)[:, 0] >= 1)] = "back"
    uv = np.zeros((0, 2))
    new_uv_faces = np.zeros_like(uv_faces)
    for name, (window, box) in CHARTS.items():
        on = tile == name
        used, small = np.unique(uv_faces[on], return_inverse=True)
        local = (source.uv[used] - window[:2]) / window[2:]
        new_uv_faces[on] = small.reshape(-1, 3) + len(uv)
        uv = np.concatenate([uv, place(np.stack([local[:, 0], 1 - local[:, 1]], -1), box)])

    balls = {side: _ball(source, side) for side in ("left", "right")}
    origin = (balls["left"].center + balls["right"].center) / 2
    mean = source.mean * 10.0 - origin
    identity = source.identity * np.float32(10)
    used, small = np.unique(faces, return_inverse=True)
    body = Patch(
        parts=np.array([PARTS.index(name) for name in parts], np.uint8),
        mean=mean[used],
        faces=small.reshape(-1, 3),
        uv=np.clip(uv, 0, 1),
        uv_faces=new_uv_faces,
        follow=follow[used],
        identity=identity[:, used],
        expression=expression[:, used],
    )
    skin = body.faces[body.parts == PARTS.index("skin")]
    lips = max(
        (loop for loop in boundary_loops(skin) if abs(body.mean[loop, 0].mean()) < 3),
        key=lambda loop: body.mean[loop, 2].mean(),
    )
    jaw_open = body.expression[EXPRESSION_INDEX["jawOpen"]]
    sheet = mouth_proxy(lips, body.mean, body.identity, body.expression, jaw_open)
    patches = [body, boxed(sheet, BOXES["mouth_sheet"])]
    for side, ball in balls.items():
        ball = Ball(
            ball.center - origin, ball.radius, ball.iris, ball.center_modes, ball.scale_modes
        )
        patches.append(boxed(eyeball(side, ball), BOXES["eye_" + side]))
        patches.append(boxed(eye_proxy(side, ball, -0.2), BOXES["eye_cap_" + side]))
    head = join(
        patches, "ict", LICENCE, SOURCE, {name: BOXES[name] for name in (*PROXIES, "cards")}
    )
    known = known_landmarks("ict")
    return on_faces(head, known["faces"], known["barycentric"]) if known else head
