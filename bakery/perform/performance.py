"""A clip fitted, shot by shot: who is there, where the head is and what it does in each frame.

A folder keeps it, so that no clip is followed twice (`docs/fits.md`):

    clip.npz       key, seconds [N], starts [S], faces [S], notes
    shot_001/ ...  the fits of each shot with a face (`motion.fits`); of a clip of one shot the folder
                   itself holds them
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from bakery import __version__
from bakery.bake.faces import choose_face
from bakery.detectors.base import Detector
from bakery.errors import FitError, InputError
from bakery.formats import record
from bakery.formats.files import digest_file
from bakery.formats.livelink import Take
from bakery.formats.stills import Stills
from bakery.formats.video import Clip
from bakery.formats.work import key_of
from bakery.heads.base import HeadModel
from bakery.motion.fits import ClipFit, read_fits, write_fits
from bakery.motion.follow import Followed, follow
from bakery.motion.track import TrackOptions, solve, take_of
from bakery.perform.shots import shots
from bakery.types import EXPRESSIONS, Landmarks

CLIP = "clip.npz"
# A frame is blurred or covered if the points network doubts it by so many times its usual doubt, and
# by so much of the eye distance: its neighbours say better what the face does.
BLURRED, DOUBTFUL = 2.5, 0.05
Report = Callable[[str, int, int], None]


@dataclass(frozen=True, eq=False)
class Shot:
    """One shot of a clip: frames from one cut to the next."""

    first: int  # frame of the clip
    last: int  # one behind the last
    fits: ClipFit | None  # None: no face is seen in it


@dataclass(frozen=True, eq=False)
class Performance:
    """What the performer of a clip of N frames does."""

    seconds: np.ndarray  # [N] as the clip says, increasing
    shots: tuple[Shot, ...]
    take: Take  # of the whole clip; the face rests where none is seen
    notes: tuple[str, ...]  # cuts, and frames that were bridged

    def shot_of(self, frame: int) -> Shot:
        """The shot that a frame of the clip, from 0, belongs to."""
        starts = [shot.first for shot in self.shots]
        return self.shots[int(np.searchsorted(starts, frame, "right")) - 1]


def clip_key(clip: Clip | Stills, head: HeadModel, options: TrackOptions, face: int | None) -> str:
    """What a Performance is made from."""
    paths = clip.places if isinstance(clip, Stills) else [clip.path]
    pictures = [digest_file(path) for path in paths]
    return key_of(__version__, pictures, clip.rate, head.digest, repr(options), face)


def fitted(
    clip: Clip | Stills,
    head: HeadModel,
    detector: Detector,
    folder: Path,
    options: TrackOptions | None = None,
    face: int | None = None,
    report: Report = lambda step, done, total: None,
    overwrite: bool = False,
) -> Performance:
    """Follow and fit the performer of a clip, or take that from a folder that has it.

    Args:
        folder: where the fits are kept.
        options: TrackOptions; None takes the usual ones.
        face: which face of the first frame of each shot, from 1; None takes the one that stands out.
        report: called with (step, done, total).
        overwrite: whether fits of something else in that folder are replaced.

    Raises:
        InputError: no face, or several and none stands out, or fits of something else are there;
            FitError: the face is too small.
    """
    options = options or TrackOptions()
    key = clip_key(clip, head, options, face)
    kept = _kept(folder, key)
    if kept is None:
        if (folder / CLIP).is_file() and not overwrite:
            raise InputError(
                f"{folder}: holds fits of another clip, or of other settings; give another folder, or "
                "--overwrite"
            )
        try:
            made = _follow(clip, detector, options, face, report)
            _solve(folder, key, made, head, options, report)
        except (InputError, FitError) as error:
            said = str(error)  # what the readers say names the file
            here = f"{clip.path}"
            raise type(error)(said if said.startswith(here) else f"{here}: {said}") from None
        kept = _kept(folder, key)
    seconds, found, notes = kept
    takes = [_rests(seconds[shot.first : shot.last]) if shot.fits is None
             else take_of(shot.fits, options) for shot in found]  # fmt: skip
    return Performance(seconds, found, _joined(seconds, takes), notes)


def _follow(clip, detector, options, face, report):
    """(first frame, seconds [n], Followed or None) of each shot."""

    def choose(faces: list[Landmarks]) -> Landmarks:
        order = sorted(faces, key=lambda one: -float(one.box[2] * one.box[3]))
        return choose_face(clip.path, order, face)

    made, first, missing = [], 0, None
    for shot in shots(clip.frames()):
        seconds: list[float] = []

        def seen(shot=shot, seconds=seconds):
            for now, picture in shot:
                seconds.append(now)
                yield now, picture

        def show(done, first=first):
            report("follow", first + done, max(clip.count, first + done))

        try:
            followed = follow(seen(), detector, options.follow, show, choose)
            made.append((first, np.array(seconds), sure(followed)))
        except InputError as error:
            if "no face found" not in str(error):
                raise
            missing = error
            made.append((first, np.array(seconds), None))
        first += len(seconds)
    if all(followed is None for _, _, followed in made):
        raise missing or InputError("holds no frame")
    return made


def sure(followed: Followed) -> Followed:
    """The points of a clip without those of frames that are blurred or covered: they are bridged."""
    doubts = followed.doubts
    bad = doubts > max(BLURRED * followed.doubt, DOUBTFUL)
    if not bad.any() or bad[followed.found].all():
        return followed
    return replace(followed, points=np.where(bad[:, None, None], np.nan, followed.points))


def _solve(folder, key, made, head, options, report):
    """Fit each shot, and keep all in the folder."""
    count = sum(len(seconds) for _, seconds, _ in made)
    notes, few, faces = [], [], []
    for number, (first, seconds, followed) in enumerate(made, 1):
        fits = None
        if followed is not None:
            try:
                fits = solve(
                    followed, head, options, lambda done, first=first: report("fit", first + done, count)
                )  # fmt: skip
                notes += _told(fits, options, followed.doubt, first)
            except FitError as error:
                few.append(error)
        place = folder if len(made) == 1 else folder / f"shot_{number:03d}"
        if fits is not None:
            write_fits(place, fits)
        faces.append(fits is not None)
        if len(made) > 1:
            what = f"shot {number} begins at frame {first} ({seconds[0] - made[0][1][0]:.2f} s)"
            notes.append(
                what + (": fitted anew" if fits is not None else ": no face is seen in it")
            )
    if few and len(few) == sum(followed is not None for _, _, followed in made):
        raise few[0]
    table = {
        "key": np.array(key),
        "seconds": np.concatenate([seconds for _, seconds, _ in made]),
        "starts": np.array([first for first, _, _ in made]),
        "faces": np.array(faces),
        "notes": np.array("\n".join(notes)),
    }
    record.write_arrays(folder / CLIP, table)


def _told(fits, options, doubt, first):
    notes = list(take_of(fits, options, doubt).notes)
    lost = np.flatnonzero(~fits.found)
    if len(lost):
        runs = np.split(lost, np.flatnonzero(np.diff(lost) > 1) + 1)
        named = [
            f"{r[0] + first}" if len(r) == 1 else f"{r[0] + first}-{r[-1] + first}" for r in runs
        ]
        more = f" and {len(named) - 8} more" * (len(named) > 8)
        notes.append(f"face hidden or blurred in frames {', '.join(named[:8])}{more}")
    return notes


def _kept(folder, key):
    """(seconds, shots, notes) that a folder keeps for a key, or None.

    Raises:
        InputError: what lies there is damaged.
    """
    if not (folder / CLIP).is_file():
        return None
    table = record.read_arrays(folder / CLIP, ("key", "seconds", "starts", "faces", "notes"))
    if str(table["key"]) != key:
        return None
    if not _whole(table):
        raise InputError(f"{folder / CLIP}: is damaged; delete it, and the clip is followed anew")
    starts, count = table["starts"].tolist(), len(table["seconds"])
    found = []
    for number, (first, last) in enumerate(zip(starts, [*starts[1:], count]), 1):
        place = folder if len(starts) == 1 else folder / f"shot_{number:03d}"
        fits = read_fits(place) if table["faces"][number - 1] else None
        found.append(Shot(first, last, fits))
    notes = tuple(str(table["notes"]).splitlines())
    return table["seconds"].astype(np.float64), tuple(found), notes


def _whole(table):
    """Whether arrays of a clip.npz go together."""
    seconds, starts, faces = table["seconds"], table["starts"], table["faces"]
    if seconds.ndim != 1 or seconds.dtype.kind != "f" or not np.isfinite(seconds).all():
        return False
    if starts.ndim != 1 or starts.dtype.kind != "i" or faces.dtype != bool or not len(starts):
        return False
    rises = np.diff([*starts, len(seconds)]) > 0
    return starts[0] == 0 and bool(rises.all()) and faces.shape == starts.shape


def _rests(seconds):
    """The take of a shot in which no face is seen."""
    count = len(seconds)
    weights = np.zeros((count, len(EXPRESSIONS)), np.float32)
    return Take(seconds - seconds[0], weights, np.zeros((count, 3)), np.zeros((count, 2, 2)))


def _joined(seconds, takes):
    """One Take of the shots' takes."""
    weights, head, eyes = (
        np.concatenate([getattr(take, name) for take in takes]) for name in ("weights", "head", "eyes")
    )  # fmt: skip
    return Take(seconds - seconds[0], weights, head, eyes)
