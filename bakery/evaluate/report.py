"""The quality table over a folder of portraits: what is measured of which photo, and its means."""

import csv
from pathlib import Path

import numpy as np

from bakery.bake.faces import one_face
from bakery.bake.fitting import fit_portrait, fitted_neutral
from bakery.errors import BakeryError
from bakery.evaluate import together
from bakery.evaluate.avatar.pairs import Pair, quick
from bakery.evaluate.avatar.pairs import measure as measure_pair
from bakery.evaluate.fitting import (
    landmark_error,
    synthetic_error,
    synthetic_portrait,
)
from bakery.evaluate.mouths import lip_error, mean_lip_error
from bakery.formats.image import read_photo
from bakery.formats.portraits import landmarks_of, reference_points
from bakery.stages.fit import Face
from bakery.stages.fit.albedo import load_albedo

VALIDATION = "london/val"  # what nothing was trained or tuned on


def fits(portraits, head, detector=None, start=VALIDATION):
    """Fit every photo, by its reference points and, with a detector, by its own landmarks.

    Args:
        head: HeadModel.
        detector: name of a detector, or None.

    Yields:
        dict a photo: errors in percent of the outer-eye-corner distance, seconds of the fit; `mouth`,
        the lips without the warp (`mouths.lip_error`), and of a smiling photo `driven`, those of the
        person's neutral photo, moved by the smiling one's weights, and `together`, what both photos
        say of the person (`together.measure`).
    """
    shapes, faces = {}, {}
    for path, points in sorted(reference_points(portraits, start).items()):
        photo = read_photo(path)
        fit, _ = fit_portrait(path, photo, landmarks_of(points), head)
        shapes[path], faces[path] = fitted_neutral(head, fit), Face(photo, landmarks_of(points))
        row = {
            "name": path.stem,
            "kind": "smiling" if "smiling" in path.stem else "neutral",
            "given": landmark_error(fit, points),
            "mouth": lip_error(head, head.neutral(fit.identity), fit, points),
            "seconds": fit.seconds,
        }
        rest = path.with_name(path.name.replace("smiling", "neutral"))
        if rest != path and rest in shapes:
            row["driven"] = lip_error(head, shapes[rest], fit, points)
            row["together"] = together.measure(faces.pop(rest), faces.pop(path), head)
        if detector:
            try:
                _, face = one_face(path, detector=detector, photo=photo)
                own, _ = fit_portrait(path, photo, face, head)
                row["detected"] = landmark_error(own, points)
            except BakeryError as error:
                row["error"] = str(error)
        yield row


def fit_summary(rows):
    """Means over the rows of `fits`."""
    out = {"photos": len(rows), "failed": sum("error" in row for row in rows)}
    for kind in ("neutral", "smiling"):
        given = [row["given"]["all"] for row in rows if row["kind"] == kind]
        if given:
            out[f"given_{kind}_percent"] = round(float(np.mean(given)), 3)
    for name in ("mouth", "driven"):
        if of := [row[name] for row in rows if name in row]:
            out[name] = mean_lip_error(of)
    if two := [row["together"] for row in rows if "together" in row]:
        out["together"] = together.summary(two)
    own = [row["detected"]["without_contour"] for row in rows if "detected" in row]
    if own:
        out["detected_without_contour_percent"] = round(float(np.mean(own)), 3)
    out["seconds_median"] = round(float(np.median([row["seconds"] for row in rows])), 3)
    return out


def synthetic(truth, head, count, seed=0):
    """Fit painted heads of another model; surface to surface.

    Args:
        truth: HeadModel that is painted.
        head: HeadModel that is fitted.
        count: how many.

    Yields:
        dict a portrait: median distance in mm.
    """
    layout = load_albedo().layout
    rng = np.random.default_rng(seed)
    for number in range(count):
        subject = synthetic_portrait(truth, rng, number)
        fit, _ = fit_portrait("painted", subject.photo, subject.landmarks, head)
        yield {
            "name": f"{truth.name} {number}",
            "millimetres": round(synthetic_error(subject, fit, head, layout), 3),
            "seconds": fit.seconds,
        }


def pairs(portraits, start=VALIDATION):
    """The neutral and smiling photos of each person of london/val: list of Pair."""
    points = reference_points(portraits, start)
    smiles = {}
    if (table := Path(portraits) / "london" / "info.csv").is_file():
        with open(table, newline="") as file:
            smiles = {row["face_id"]: row["smile"] for row in csv.DictReader(file)}
    out = []
    for path in sorted(points):
        other = path.with_name(path.name.replace("neutral", "smiling"))
        if "neutral" in path.stem and other in points:
            name = path.stem.split("_")[0]
            teeth = smiles.get(name) == "teeth"
            out.append(Pair(name, path, other, points[path], points[other], teeth))
    return out


def avatars(portraits, head, generator, options, mouths=None, pictures=None, only=None):
    """Bake every person of `pairs` and render them back.

    Args:
        mouths: bake this many mouths only, for a look in between.
        pictures: folder for side-by-side pictures, or None.
        only: names of the people, or None for all.

    Yields:
        avatar_pairs.Result.
    """
    if mouths:
        options = quick(options, mouths)
    for pair in pairs(portraits):
        if not only or pair.name in only:
            yield measure_pair(pair, head, generator, options, pictures)
