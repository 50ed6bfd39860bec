"""How well a resting face comes of a smiling photo: against the person's neutral photo.

The avatar's texture is made of the smiling photo. It is drawn at rest, in the camera and gaze of the
neutral photo, and compared with it: with the smiling photo's own head, as a user gets it, and with the
head of the neutral photo's fit, which shows the texture alone; that also brought to the neutral photo's
exposure and white balance, which no smiling photo tells. How far its lids are open is compared with what
the neutral photo's points say, and where brows and mouth lie with the neutral photo's fit.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from bakery import landmarks as marks
from bakery.bake.options import BuildOptions
from bakery.bake.subject import FittedSubject
from bakery.evaluate.avatar import CROP, compare, mean_score
from bakery.evaluate.avatar.pairs import Pair
from bakery.evaluate.generator import paint_all
from bakery.evaluate.report import pairs
from bakery.formats.image import write_image
from bakery.formats.mark import MIXED
from bakery.formats.portraits import landmarks_of
from bakery.geometry.color import to_encoded, to_linear
from bakery.hair.cards import CardHair
from bakery.stages.fit.rest import SHOWN, lids_open
from bakery.train import rest_shape
from bakery.train.rest_shape import aligned, rested_landmarks, still

FIGURES = ("scores", "exposed", "driven")  # of Result
DARK = 2e-3  # linear; below it no ratio is told
GROUPS = {"brows": marks.BROWS, **rest_shape.GROUPS}  # of landmarks
KEPT = "as photographed"  # the texture of the smile, without anything taken out


@dataclass(frozen=True)
class Result:
    """One person's resting face made of the smiling photo."""

    name: str
    teeth: bool  # whether the smile shows teeth
    scores: dict  # way -> avatar.Score, in the neutral photo's fit; "warp": by the true landmarks
    exposed: dict  # the same, exposed as the neutral photo is
    driven: dict  # as `scores`, with the smiling photo's own head
    lids: dict  # way, or "truth" -> how far lids are open, of the width of an eye
    shape: dict  # way -> group of landmarks -> mm across the line of sight off the neutral photo's, rms
    pictures: dict  # way -> [CROP, CROP, 3] sRGB-encoded


def ways() -> dict[str, BuildOptions]:
    """The texture as photographed and, as `bakery build` makes it, at rest."""
    made = BuildOptions()
    kept = replace(made, texture=replace(made.texture, neutral="keep"))
    return {KEPT: kept, "rest": made}


def exposed_alike(made: np.ndarray, truth: np.ndarray, face: np.ndarray) -> np.ndarray:
    """A picture [H, W, 3] with the median exposure and white balance of the truth, sRGB-encoded.

    Args:
        face: [H, W] 0..1, where they are compared; nothing is changed where there is none.
    """
    inside = face > 0.5
    if not inside.any():
        return made
    one, other = (np.log(np.maximum(to_linear(part[inside]), DARK)) for part in (truth, made))
    return to_encoded(to_linear(made) * np.exp(np.median(one - other, 0)))


def measure(pair: Pair, head, ways: dict[str, BuildOptions]) -> Result:
    """Make one person's resting face in several ways.

    Args:
        ways: {name: options of the bake}.
    """
    scores: dict = {}
    exposed: dict = {}
    driven: dict = {}
    # The points' y goes down.
    lids = {"truth": lids_open(np.asarray(pair.neutral_points)[:, :2] * [1, -1])}
    shape: dict = {}
    pictures: dict = {}
    for name, options in ways.items():
        smiling = landmarks_of(pair.smiling_points)
        fitted = FittedSubject(pair.smiling, smiling, head, options, CROP, hair=CardHair())
        own, target = fitted.observe_both(pair.neutral, landmarks_of(pair.neutral_points))
        lids[name] = lids_open(fitted.head.landmarks(fitted.subject.neutral))
        shape[name] = _apart(head, fitted.head.landmarks(fitted.shape), target.fit)
        face, truth = target.face / 255, target.picture
        pictures.setdefault("photo", fitted.neutral.picture)
        for table, seen in ((driven, own), (scores, target)):
            made = paint_all(fitted, seen, {}, head)
            for way, drawn in ((name, "static"), ("warp", "warp")):
                table[way] = compare(made[drawn], truth, target.points, face)
            if table is scores:
                for way, drawn in ((name, "static"), ("warp", "warp")):
                    alike = exposed_alike(made[drawn], truth, face)
                    exposed[way] = compare(alike, truth, target.points, face)
                pictures |= {name: made["static"], "warp": made["warp"]}
        pictures["truth"] = truth
    return Result(pair.name, pair.teeth, scores, exposed, driven, lids, shape, pictures)


def _apart(head, found, fit):
    """{group: mm} of landmarks [478, 3] at rest off those that a resting photo's fit shows, by what is still."""
    truth = rested_landmarks(head, fit, SHOWN)
    by = still(head)
    by[marks.BROWS] = False
    off = (aligned(found[: marks.FACE], truth, by) - truth)[:, :2]
    return {name: float(np.sqrt((off[group] ** 2).sum(1).mean())) for name, group in GROUPS.items()}


def everybody(
    portraits: Path, head, ways, pictures: Path | None = None, only=None
) -> Iterator[Result]:
    """Measure every person of london/val.

    Args:
        portraits: folder of portraits, see `report.pairs`.
        pictures: folder for side-by-side PNGs, or None.
        only: names of the people, or None for all.
    """
    for pair in pairs(portraits):
        if only and pair.name not in only:
            continue
        result = measure(pair, head, ways)
        if pictures is not None:
            row = np.concatenate(list(result.pictures.values()), 1)
            write_image(Path(pictures) / f"{pair.name}.png", np.clip(row, 0, 1), mark=MIXED)
        yield result


def summary(results: list[Result]) -> dict:
    """Means over all people and over those who show teeth: {group: {way: figures}}.

    And how far lids are open in the mean, with the root mean square of what that is off from the truth, and
    the root mean square of where brows, lips, their corners and the jaw are off, mm.
    """
    groups = {"all": results, "teeth": [result for result in results if result.teeth]}
    return {
        name: {
            figure: {
                way: vars(mean_score([getattr(result, figure)[way] for result in group]))
                for way in group[0].scores
            }
            for figure in FIGURES
        }
        | {
            "lids": _of_lids([result.lids for result in group]),
            "shape": _of_shapes([result.shape for result in group]),
        }
        for name, group in groups.items()
        if group
    }


def _of_lids(found: list[dict]) -> dict:
    """{way: [mean, root mean square off the truth]} of several people."""
    values = {way: np.array([one[way] for one in found]) for way in found[0]}
    return {
        way: [float(each.mean()), float(np.sqrt(((each - values["truth"]) ** 2).mean()))]
        for way, each in values.items()
    }


def _of_shapes(found: list[dict]) -> dict:
    """{way: {group: root mean square, mm}} of several people."""
    return {
        way: {
            name: float(np.sqrt(np.mean([one[way][name] ** 2 for one in found]))) for name in GROUPS
        }
        for way in found[0]
    }
