"""Real smiles beside the expressions of a head model: how far corners and lips go, in mm on the head.

People's smiles are the difference of two photos of one person, found by a detector and laid onto the
head fitted to the first of them (`heads.place.moves_between`); single photos tell what they show alone.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np

from bakery import landmarks as marks
from bakery.bake.faces import find_faces
from bakery.errors import InputError
from bakery.formats.targets import named_expressions
from bakery.heads.base import HeadModel, weights
from bakery.heads.place import at_landmarks, moves_between, offsets_from, place
from bakery.heads.report.measure import visible

HELD = 0.5  # of an expression: a resting face should need none
TOOTHY = 2.5  # mm between the lips in their middle
SEEN = 1.0  # mm between the lips, from which teeth show
UPPER = np.array([78, 191, 80, 81, 82, 13, 312, 311, 310, 415, 308])  # inner lips, right to left
LOWER = np.array([78, 95, 88, 178, 87, 14, 317, 402, 318, 324, 308])
EYES = np.array([33, 263])  # outer corners
SHARES = (10, 50, 90)  # percentiles
SHAPES = (  # what smiles are made of
    "mouthSmile mouthUpperUp mouthLowerDown mouthDimple mouthStretch mouthPress cheekSquint"
).split()


@dataclass(frozen=True)
class Smile:
    """What the mouth does from rest to a smile; nan where no photo at rest says so."""

    up: float  # mm that the corners of the mouth rise
    out: float  # mm that each goes outward
    wider: float  # width of the mouth, over that at rest
    lifted: float  # mm that the upper lip rises in its middle
    dropped: float  # mm that the lower lip falls there
    width: float  # of the mouth, over the distance of the outer eye corners
    gap: float  # mm between the lips in their middle
    row: float  # mm of the mouth's width in which lips are more than SEEN mm apart
    area: float  # mm2 between the lips


NAMES = tuple(field.name for field in fields(Smile))


def smile_of(points: np.ndarray, rest: np.ndarray | None = None) -> Smile:
    """Measure a smile on the head.

    Args:
        points: [>= 468, 3] mm of the smile, seen from the front; rest: the same face at rest, or None.
    """
    right, left = points[marks.MOUTH_CORNERS]
    across = np.linspace(points[UPPER[0], 0], points[UPPER[-1], 0], 101)
    upper, lower = (np.interp(across, points[rim, 0], points[rim, 1]) for rim in (UPPER, LOWER))
    apart, inner = upper - lower, across[-1] - across[0]
    moved = np.full(points.shape, np.nan) if rest is None else points - rest
    first = np.nan if rest is None else np.ptp(rest[marks.MOUTH_CORNERS, 0])
    corners = moved[marks.MOUTH_CORNERS]
    return Smile(
        up=float(corners[:, 1].mean()),
        out=float((corners[1, 0] - corners[0, 0]) / 2),
        wider=float((left - right)[0] / first),
        lifted=float(moved[[0, 13], 1].mean()),
        dropped=float(-moved[[17, 14], 1].mean()),
        width=float((left - right)[0] / np.ptp(points[EYES, 0])),
        gap=float(points[13, 1] - points[14, 1]),
        row=float((apart > SEEN).mean() * inner),
        area=float(np.maximum(apart, 0).mean() * inner),
    )


def people(folder: Path, head: HeadModel, detector: str = "network") -> Iterator[tuple[str, Smile]]:
    """Iterate over the smiles in a folder of photos: (name, Smile).

    NAME_neutral and NAME_smiling are one person; other photos stand alone.

    Raises:
        InputError: no such folder, or no photo in it.
    """
    photos = sorted(Path(folder).glob("*.jpg"))
    if not photos:
        raise InputError(f"{folder}: no photos; give a folder of .jpg files")
    mean, identities, expressions = at_landmarks(head)
    known = {path.stem: path for path in photos}

    def seen(path):
        photo, faces = find_faces(path, detector=detector)
        return faces[0].points[: marks.FACE], photo.encoded.shape[1::-1]

    for name, path in known.items():
        if name.endswith("_neutral"):
            continue
        rest = known.get(name.removesuffix("_smiling") + "_neutral")
        try:
            points, size = seen(path)
            first = None if rest is None else seen(rest)
        except InputError:
            continue  # no face found: the detector's matter, not the smile's
        if first is not None:
            shape, moves = moves_between(
                mean, identities, HELD * expressions, first, (points, size)
            )
            yield name, smile_of(shape + moves, shape)
            continue
        view, identity, expression, _ = place(mean, identities, expressions, points, size)
        shape = mean + np.tensordot(identity, identities, 1)
        shape = shape + np.tensordot(expression, expressions, 1)
        yield name, smile_of(shape + offsets_from(shape, view, points))


def percentiles(smiles: Iterable[Smile]) -> Iterator[tuple[str, Smile]]:
    """Iterate over the SHARES of smiles with closed and with open lips, each measure by itself."""
    found = list(smiles)
    for kind, toothy in (("closed", False), ("open", True)):
        chosen = [smile for smile in found if (smile.gap > TOOTHY) == toothy]
        table = np.array([[getattr(smile, name) for name in NAMES] for smile in chosen])
        for share in SHARES if chosen else ():
            title = f"{len(chosen)} {kind}, {share}%"
            yield title, Smile(*map(float, np.percentile(table, share, axis=0)))


def played() -> Iterator[tuple[str, dict[str, float]]]:
    """Iterate over expressions that `shown` measures: named ones, keys, shapes that smile."""
    for name, mix in named_expressions().items():
        if not name.startswith("viseme:"):
            yield name, mix
    for name in SHAPES:
        yield name, {name + "Left": 1.0, name + "Right": 1.0}


def shown(head: HeadModel, expression: Mapping[str, float]) -> tuple[Smile, float]:
    """(Smile of the mean head with weights by name, mm2 of teeth seen from the front)."""
    vertices = head.vertices(head.mean, weights(expression))
    size, width = 900, 130.0
    teeth = visible(head, vertices, 0, ("teeth_upper", "teeth_lower"), size, width)
    smile = smile_of(head.landmarks(vertices), head.landmarks(head.mean))
    return smile, teeth * (width / size) ** 2


def line(title: str, smile: Smile, teeth: float | None = None) -> str:
    """One row of a Markdown table of smiles."""
    cells = [f"{getattr(smile, name):.2f}".replace("nan", "-") for name in NAMES]
    return f"| {title} | {' | '.join(cells)} | {'-' if teeth is None else round(teeth)} |"


def header() -> str:
    """The first two rows of that table."""
    return f"| | {' | '.join(NAMES)} | teeth |\n|{'---|' * (len(NAMES) + 2)}"
