"""The whole head of a baked avatar back in its own photo: face, ears, hair and what lies between.

The avatar is drawn as `bakery render --view photo` draws it, before the photo's own plain backdrop,
so that nothing of the person's photo looks through it.
"""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

from bakery.bake.options import BuildOptions
from bakery.evaluate.avatar.pairs import bake
from bakery.evaluate.hair.drawing import HALF
from bakery.evaluate.hair.outlines import plain
from bakery.evaluate.metrics import psnr
from bakery.formats.image import write_image
from bakery.formats.mark import MIXED
from bakery.generators.base import Generator
from bakery.geometry.color import LUMA, to_encoded, to_linear
from bakery.geometry.fill import diffuse
from bakery.hair.base import Hair
from bakery.heads.base import HeadModel
from bakery.landmarks import CHIN
from bakery.runtime.avatar import Avatar
from bakery.show.frame import Scene, draw_scene
from bakery.stages.segment import HAIR
from bakery.train.segment import outline
from bakery.types import EXPRESSIONS

SIDE = 300  # pixels of the picture from behind: about as fine as heads are in portraits
SOLID = 0.98  # coverage of hair that nothing shows through
UPPER = 0.38  # of the way from the top of the head to the end of the neck
FEWEST = 200  # pixels that tell a contrast
DARKEST = 1e-3  # linear luminance; darker is noise
RIM = 0.02  # of the picture's longer side around the person, in which the backdrop is not trusted


def wholes(
    portraits: Path,
    starts: str,
    part: str,
    head: HeadModel,
    generator: Generator,
    hair: Hair,
    options: BuildOptions,
    limit: int | None = None,
    pictures: Path | None = None,
) -> Iterator[dict]:
    """Bake people and draw them back.

    Args:
        portraits, starts, part, limit: as of `outlines.silhouettes`.
        pictures: folder for PNGs, photo and avatar side by side, or None.

    Yields:
        {"photo", "psnr": dB of the whole head, "layer": the same without the hair that has volume,
        "share": how much of the true silhouette above the chin the avatar covers, "photographed",
        "behind": `contrast` of hair in the photo and of the avatar's from behind, None of too little}.
    """
    for path, points, photo, truth in plain(portraits, starts, part, limit):
        avatar, _, segmentation = bake(path, points, head, generator, options, hair)
        above = np.zeros(truth.person.shape, bool)
        above[: int(points[CHIN, 1].mean())] = True
        person = (truth.person == outline.PERSON) & above
        behind = backdrop(photo.encoded, truth.person)
        drawn, cover = before(avatar, behind)
        flat = replace(avatar, textures=replace(avatar.textures, hair_mesh=None))
        bald, skin = before(flat, behind)
        yield {
            "photo": path.stem,
            "psnr": round(psnr(drawn, photo.encoded, person | (cover & above)), 3),
            "layer": round(psnr(bald, photo.encoded, person | (skin & above)), 3),
            "share": round(float((person & cover).sum() / max(person.sum(), 1)), 4),
            "photographed": contrast(to_linear(photo.encoded), segmentation.labels == HAIR),
            "behind": contrast(*from_behind(avatar, flat)),
        }
        if pictures is not None:
            both = np.concatenate([photo.encoded, drawn], 1)
            write_image(Path(pictures) / f"{path.stem}.png", both, mark=MIXED)


def before(avatar: Avatar, behind: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """An avatar as photographed, before a picture.

    The photo is T_0 itself, whatever its expression: nothing is blended over it.

    Args:
        behind: [H, W, 3] sRGB-encoded, of the photo's size.

    Returns:
        [H, W, 3] sRGB-encoded, and where the avatar is [H, W] bool.
    """
    fit = avatar.fit
    scene = Scene(fit.expression, fit.gaze, None, "photo", None, False, background="none")
    layer, _ = draw_scene(avatar, scene)
    picture = layer[..., :3] + (1 - layer[..., 3:]) * to_linear(behind)
    return to_encoded(picture), layer[..., 3] > HALF


def from_behind(avatar: Avatar, bald: Avatar) -> tuple[np.ndarray, np.ndarray]:
    """The back of a head [SIDE, SIDE, 3] linear, and where its hair with volume is, bool.

    Only in the upper part: farther down locks lie over skin, and what is between them is no contrast of hair.

    Args:
        bald: the same without it.
    """
    none = np.zeros(len(EXPRESSIONS), np.float32)
    scene = Scene(none, None, None, (180.0, 0.0), SIDE, True, background="none")
    picture, head = (draw_scene(one, scene)[0] for one in (avatar, bald))
    hair = (picture[..., 3] > SOLID) & (np.abs(picture - head).max(-1) > 0)
    rows = np.flatnonzero((picture[..., 3] > HALF).any(1))
    hair[int(rows[0] + UPPER * len(rows)) :] = False
    return picture[..., :3], hair


def contrast(linear: np.ndarray, where: np.ndarray) -> float | None:
    """Standard deviation of the log of luminance well within a mask; None of a mask too small.

    Args:
        linear: [H, W, 3]; where: [H, W] bool.
    """
    inner = cv2.erode(where.astype(np.uint8), np.ones((5, 5), np.uint8)) > 0
    if inner.sum() < FEWEST:
        return None
    return round(float(np.log(np.maximum(linear[inner] @ LUMA, DARKEST)).std()), 3)


def backdrop(encoded: np.ndarray, person: np.ndarray) -> np.ndarray:
    """A photo [H, W, 3] without its person: the backdrop, carried on smoothly.

    Args:
        person: [H, W] uint8 of `train.segment.outline`.
    """
    size = 2 * round(RIM * max(person.shape)) + 1
    far = cv2.erode((person == outline.BACKDROP).astype(np.uint8), np.ones((size, size), np.uint8))
    smooth = cv2.GaussianBlur(encoded, (0, 0), RIM * max(person.shape) / 4)
    return diffuse(smooth, far.astype(np.float32))


def summary(rows: list[dict]) -> dict:
    """Means of `wholes`, and the worst."""
    if not rows:
        return {"photos": 0}
    means = {}
    for name in ("psnr", "layer", "share", "photographed", "behind"):
        found = [row[name] for row in rows if row[name] is not None]
        means[name] = round(float(np.mean(found)), 3) if found else None
    return (
        {"photos": len(rows)} | means | {"worst": min(rows, key=lambda row: row["psnr"])["photo"]}
    )
