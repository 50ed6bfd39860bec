"""What a bake warns of, and makes of, portraits that no good avatar can come from (docs/failures.md)."""

from dataclasses import dataclass

import cv2
import numpy as np

from bakery.bake.pipeline import Request, build
from bakery.export.open import open_avatar
from bakery.formats.image import read_photo, write_image
from bakery.formats.mark import PAINTED
from bakery.heads.base import weights
from bakery.heads.report.shaded import labelled, tile
from bakery.runtime.contact_sheet import SMILE, portraits
from bakery.synth.failures import CASES, chosen, paint_case

SIDE = 200  # pixels of one picture of the sheet
COLUMNS = 2  # cases beside each other


@dataclass(frozen=True)
class Outcome:
    """One case."""

    name: str
    what: str
    findings: list  # of stages.assess.Finding
    picture: np.ndarray  # [SIDE, 3 * SIDE, 3] encoded: photo, avatar neutral, avatar smiling


def outcomes(head, folder, options, names=None):
    """Paint, bake and draw the cases.

    Args:
        head: head model that paints them.
        folder: Path, where photos and bundles go.
        options: BuildOptions.
        names: which of synth.failures.CASES; None for all.

    Yields:
        Outcome.

    Raises:
        InputError: a name is not one of CASES.
    """
    wanted = chosen(names)
    folder.mkdir(parents=True, exist_ok=True)
    for name in wanted:
        photo, bundle = folder / f"{name}.png", folder / f"{name}.avatar"
        write_image(photo, paint_case(head, name), mark=PAINTED)
        findings = build(Request(photo=photo, output=bundle, options=options, overwrite=True))
        avatar = open_avatar(bundle)
        poses = [(weights(named), (0, 0), 0.0) for named in ({}, SMILE)]
        shown = [picture / 255 for picture in portraits(avatar, poses, SIDE)]
        row = [labelled(_cut(read_photo(photo).encoded), name), *shown]
        yield Outcome(name, CASES[name].what, findings, np.concatenate(row, 1))


def _cut(image):
    """The head in a portrait [H, W, 3] as a square of SIDE pixels."""
    height, width = image.shape[:2]
    side = int(0.86 * width)
    top, left = int(0.52 * height - side / 2), (width - side) // 2
    square = image[top : top + side, left : left + side]
    return cv2.resize(square, (SIDE, SIDE), interpolation=cv2.INTER_AREA)


def sheet(found):
    """All Outcomes in one picture [H, W, 3] encoded."""
    return tile([outcome.picture for outcome in found], COLUMNS)


def table(found):
    """All Outcomes as a table in Markdown."""
    lines = ["| portrait | shows | warned of |", "|---|---|---|"]
    for outcome in found:
        said = "; ".join(f"**{f.code}**: {f.message}" for f in outcome.findings)
        lines.append(f"| {outcome.name} | {outcome.what} | {said or 'nothing'} |")
    return "\n".join(lines)
