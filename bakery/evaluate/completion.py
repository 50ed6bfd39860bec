"""How well hidden skin is completed: regions of well-seen faces are hidden and filled in again.

Measured on the albedo in the atlas, where the photo showed it: the fit, the segmentation and the
light are those of the whole photo, which a hidden face would not have. Two figures of each region: the
PSNR of sRGB-encoded albedo, which rewards smooth guesses, and the energy of the luma in octaves, which
rewards grain of whatever shape. Neither sees pocks or doubled features: look at the pictures.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np

from bakery.bake.subject import photographed_skin
from bakery.evaluate.metrics import psnr
from bakery.formats.image import write_image
from bakery.formats.mark import MIXED
from bakery.formats.portraits import reference_points
from bakery.geometry.color import LUMA, to_encoded
from bakery.heads.base import HeadModel
from bakery.landmarks import OVAL
from bakery.stages.atlas import Atlas, uv_polygon
from bakery.stages.texture import METHODS
from bakery.stages.texture.complete import complete
from bakery.stages.texture.unwrap import PartialAlbedo
from bakery.train.regions import REGIONS, hidden_region

OCTAVES = 4  # at 1024 texels; the finest is one texel wide, one more at each doubling
LEAST = 0.005  # of the atlas: a region that the photo itself hides says nothing
FAINT = 1e-4  # of encoded luma: energy below it is rounding
Way = Callable[[PartialAlbedo, HeadModel, np.ndarray, Atlas], np.ndarray]


@dataclass(frozen=True)
class Score:
    """One region of one person, completed in one way."""

    psnr: float  # dB, sRGB-encoded albedo
    energy: list[float]  # of each octave, fine to coarse: over the truth's
    octaves: float  # mean |log2| of them


def octaves(luma: np.ndarray) -> list[np.ndarray]:
    """Bands [T, T] of a picture, fine to coarse."""
    count = OCTAVES + max(int(np.log2(len(luma) / 1024)), 0)
    levels = [luma, *(cv2.GaussianBlur(luma, (0, 0), 0.7 * 2**k) for k in range(count))]
    return [fine - coarse for fine, coarse in zip(levels, levels[1:])]


def score(found: np.ndarray, truth: np.ndarray, inside: np.ndarray) -> Score:
    """Compare completed with true albedo [T, T, 3] inside a region [T, T] bool."""
    a, b = (to_encoded(np.clip(albedo, 0, 1)) for albedo in (found, truth))
    b = np.where(inside[..., None], b, a)
    width = len(a) // 128 | 1  # the bands' filters must not reach across the border
    inner = cv2.erode(inside.astype(np.uint8), np.ones((width, width))) > 0
    energy = [
        max(float(one[inner].std()), FAINT) / max(float(other[inner].std()), FAINT)
        for one, other in zip(octaves(a @ LUMA), octaves(b @ LUMA))
    ]
    return Score(psnr(a, b, inside), energy, float(np.abs(np.log2(energy)).mean()))


def ways() -> dict[str, Way]:
    """What is compared: each method of `--complete`, on the same partial albedo."""

    def by(method: str) -> Way:
        return lambda partial, head, vertices, atlas: (
            complete(partial, head, vertices, atlas, method).albedo
        )

    return {method: by(method) for method in METHODS}


def measure(
    partial: PartialAlbedo,
    head: HeadModel,
    vertices: np.ndarray,
    atlas: Atlas,
    ways: dict[str, Way],
    regions: Sequence[str] = REGIONS,
) -> tuple[dict[str, dict[str, Score]], list[np.ndarray]]:
    """Hide regions of one person's albedo and complete them.

    Args:
        partial: what the photo shows; vertices: [V, 3] mm; atlas: of the skin.

    Returns:
        {region: {way: Score}}; a row of pictures a region: truth, what was left, each way.
    """
    scores: dict[str, dict[str, Score]] = {}
    rows = []
    oval = uv_polygon(head, OVAL, 1.0, atlas.size)
    for region in regions:
        hidden = hidden_region(region, head, atlas)
        inside = (hidden > 0.99) & (partial.seen > 0.9) & (oval > 0)
        if inside.mean() < LEAST:
            continue
        seen = partial.seen * (1 - hidden)
        left = replace(partial, seen=seen, albedo=partial.albedo * (seen > 0)[..., None])
        row = [partial.albedo, left.albedo * seen[..., None]]
        scores[region] = {}
        for name, way in ways.items():
            found = way(left, head, vertices, atlas)
            scores[region][name] = score(found, partial.albedo, inside)
            row.append(found)
        rows.append(np.concatenate([to_encoded(np.clip(one, 0, 1)) for one in row], 1))
    return scores, rows


def everybody(
    portraits: Path,
    head: HeadModel,
    ways: dict[str, Way],
    start: str = "london/val",
    resolution: int = 1024,
    pictures: Path | None = None,
    only: Sequence[str] = (),
    regions: Sequence[str] = REGIONS,
) -> Iterator[tuple[str, dict[str, dict[str, Score]]]]:
    """Measure every person of a set, of neutral photos where it tells them apart.

    Args:
        portraits: folder with dense478.npz.
        pictures: folder for PNGs, a row a region, or None.
        only: names of the photos, or none for all.
    """
    for path, points in sorted(reference_points(portraits, start).items()):
        if "smiling" in path.stem or (only and path.stem not in only):
            continue
        own, view = photographed_skin(path, points, head, resolution)
        scores, rows = measure(view.partial, own, view.vertices, view.on_skin, ways, regions)
        if pictures is not None:
            write_image(Path(pictures) / f"{path.stem}.png", np.concatenate(rows), mark=MIXED)
        yield path.stem, scores


def summary(results: Sequence[dict[str, dict[str, Score]]]) -> dict:
    """Means over people: {region: {way: figures}}; energies as geometric means."""
    out: dict = {}
    for region in REGIONS:
        shown = [result[region] for result in results if region in result]
        out[region] = {"people": len(shown)}
        for way in shown[0] if shown else ():
            of = [scores[way] for scores in shown]
            energy = np.exp(np.log([one.energy for one in of]).mean(0))
            out[region][way] = {
                "psnr": round(float(np.mean([one.psnr for one in of])), 2),
                "octaves": round(float(np.mean([one.octaves for one in of])), 3),
                "energy": [round(float(value), 2) for value in energy],
            }
    return out
