"""Learns the skin database from neutral photos: what completes skin that a photo does not show."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bakery.bake.subject import photographed_skin
from bakery.formats.files import digest_file
from bakery.formats.portraits import reference_points
from bakery.formats.tensors import write_tensors
from bakery.heads.base import HeadModel
from bakery.stages.atlas import make_atlas
from bakery.stages.texture.correlations import (
    FEATURES,
    WINDOWS,
    Correlations,
    correlations,
    windows_of,
)
from bakery.stages.texture.database import SkinDatabase, blended, database_of
from bakery.train import correlations as by_window
from bakery.train import rest, tone
from bakery.train.albedo import ATTRIBUTION
from bakery.train.regions import hidden_region

TRAINING = "london/train"
RESOLUTION = 1024  # of the atlas: its finest octave is what studio photos still show
LEVELS = 127  # of a stored mode


@dataclass(frozen=True, eq=False)
class Seen:
    """What is learned of one photo."""

    correlations: Correlations
    tone: np.ndarray  # [S, S, 3] log of linear albedo on the chart
    trust: np.ndarray  # [S, S] 0..1


def of_photos(portraits: Path, head) -> Iterator[Seen]:
    """Each neutral photo of london/train."""
    for path, points in sorted(reference_points(portraits, TRAINING, "neutral").items()):
        own, view = photographed_skin(path, points, head, RESOLUTION)
        yield seen_of(view.partial.albedo, view.partial.seen, own, view.on_skin)


def seen_of(albedo: np.ndarray, seen: np.ndarray, head, on_skin) -> Seen:
    """What is learned of one partial albedo [T, T, 3], seen as [T, T] says."""
    on_chart = rest.on_chart(
        albedo, seen, np.zeros(0), head, rest.RestOptions(size=tone.DEFAULTS.size)
    )
    return Seen(
        correlations(albedo, seen, windows_of(head, on_skin)), on_chart.color, on_chart.trust
    )


def learn(found: list[Seen]) -> SkinDatabase:
    """A SkinDatabase of people."""
    gram = by_window.learn([one.correlations for one in found])
    mean, modes = tone.learn(
        np.stack([one.tone for one in found]), np.stack([one.trust for one in found])
    )
    return database_of(gram, mean, modes)


def hidden_windows(name: str, head: HeadModel) -> np.ndarray:
    """Windows [W] bool that lie in a hidden region (`regions`)."""
    atlas = make_atlas(head, tone.DEFAULTS.size).take("skin")
    windows = windows_of(head, atlas)
    hidden = hidden_region(name, head, atlas).reshape(-1)[atlas.index]
    inside = windows.number >= 0
    share = np.bincount(windows.number[inside], weights=hidden[inside], minlength=WINDOWS**2)
    out: np.ndarray = share > 0.9 * np.maximum(windows.size, 1)
    return out


def left_out_error(found: list[Seen], head: HeadModel) -> dict[str, float]:
    """Mean |log2| of predicted over true amplitudes of octaves, of people who were left out."""
    hidden = {name: hidden_windows(name, head) for name in ("mouth", "forehead")}
    errors: dict[str, list] = {name: [] for name in hidden}
    known = [one.correlations for one in found]
    blank = np.zeros((1, 1, 3), np.float32)
    for index, one in enumerate(known):
        others = by_window.learn(known[:index] + known[index + 1 :])
        database = database_of(others, blank, blank[None])
        for name, windows in hidden.items():
            left = Correlations(one.gram * ~windows[:, None, None], one.known * ~windows)
            made = blended(left, database)
            both = windows * one.known * made.known
            if (both > 0).sum() < 4:
                continue
            truth, guess = ((part.energy() * both[:, None]).sum(0) for part in (one, made))
            errors[name].append(np.abs(np.log2(guess / truth)).mean() / 2)
    return {name: round(float(np.mean(values)), 3) for name, values in errors.items() if values}


def save(database: SkinDatabase, path: Path) -> None:
    """Write a database as safetensors: upper triangles, halves, modes in bytes."""
    single = len(database.gram) // 2
    windows = np.flatnonzero(database.known[:single].any(0))
    rows, columns = np.triu_indices(FEATURES)
    upper = database.gram[:single, windows][:, :, rows, columns]
    scale = np.abs(database.tone_modes).max((1, 2, 3)) / LEVELS
    arrays = {
        "upper": upper.astype(np.float16),
        "windows": windows.astype(np.int32),
        "tone": database.tone.astype(np.float16),
        "tone_modes": np.round(database.tone_modes / scale[:, None, None, None]).astype(np.int8),
        "tone_scale": scale.astype(np.float32),
    }
    write_tensors(arrays, path)


def model_card(database: SkinDatabase, metrics: dict, path: Path, commit: str) -> dict:
    """What the database is, as a JSON table; `path` is the saved one, whose digest goes in."""
    return {
        "name": "skin database",
        "purpose": "tones and feature correlations of skin, to complete what a photo does not show",
        "method": "fit and unwrap neutral photos; principal components of log albedo on the chart of "
        "the albedo basis; mean products of oriented features of four octaves in windows of the chart, "
        f"each entry the average of {by_window.DEFAULTS.people} people who are alike; everybody as "
        "is and mirrored; deterministic, no seed",
        "data": "london/train, neutral",
        "attribution": ATTRIBUTION,
        "licence": "CC-BY-4.0",
        "limits": "62 adults in one studio; no octave finer than 0.3 mm; few beards",
        "entries": len(database.gram) // 2,
        "tones": len(database.tone_modes),
        "metrics": metrics,
        "commit": commit,
        "sha256": digest_file(path),
    }
