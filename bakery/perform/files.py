"""What `bakery perform` does over files."""

from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path

from bakery import __version__
from bakery.bake import pipeline
from bakery.bake.batch import is_fresh
from bakery.errors import FitError, InputError
from bakery.export import bundle as bundles
from bakery.export.open import open_avatar
from bakery.formats import video
from bakery.formats.files import digest, digest_file
from bakery.formats.ingredient import note_of as ingredient_note
from bakery.formats.ingredient import read_ingredient
from bakery.formats.livelink import format_take
from bakery.formats.place import MANIFEST
from bakery.formats.video import Note
from bakery.formats.work import Work, key_of, work_folder
from bakery.generators.transfer import load
from bakery.heads.file import load_head
from bakery.motion.animate import AnimationPlayer, RenderSettings, film
from bakery.motion.files import note_of, opened
from bakery.motion.retarget import parse_gain, retarget
from bakery.motion.track import TrackOptions
from bakery.perform.footage import Footage
from bakery.perform.network import NetworkPlayer
from bakery.perform.performance import Performance, clip_key, fitted
from bakery.perform.replace import Replacement
from bakery.perform.transfer import TransferPlayer
from bakery.plugins import plug_in
from bakery.types import Ingredient

CONSENT = (
    "both people, in the portrait and in the clip, have to agree to this; the video says that it is "
    "synthetic"
)
MARK = " The movements are another person's, filmed; both have to agree to its use."
REPLACED = " The face was put into other footage; whoever is seen there has to agree too."
OVER = "over"  # folder of the footage's fits, in that of the clip's


@dataclass(frozen=True)
class Wanted:
    """What `bakery perform` was asked for."""

    by: str = "avatar"  # what paints the face: avatar, transfer or network
    over: str | Path | None = None  # "portrait", or footage; None is plain grey
    over_face: int | None = None  # of the footage, from 1
    settings: RenderSettings = RenderSettings()
    sized: bool = True  # whether the settings' size holds for footage too, which else keeps its own
    face: int | None = None  # of the clip, from 1
    rate: float | None = None  # frames a second of a folder of frames
    fits: Path | None = None  # folder that keeps the fits
    gain: tuple[str, ...] = ()
    neutral: int | None = None
    sound: bool = True
    overwrite: bool = False
    head: str = "makehuman"  # that is fitted to the clip, and baked of a portrait
    detector: str = "network"
    track: TrackOptions = TrackOptions()


@dataclass(frozen=True)
class Made:
    """What came of it."""

    frames: int
    rate: float  # frames a second
    notes: tuple[str, ...]


def perform(
    source: Path,
    clip: Path,
    output: Path,
    wanted: Wanted,
    progress: Callable[[str, int, int], None] | None = None,
    work: Path | None = None,
) -> Made:
    """Play a clip of a performer with a portrait into a video.

    Args:
        source: bundle, or photo, of which one is baked first.
        clip: video, or folder of numbered frames.
        output: .mp4 or .webm.
        progress: called with (step, done, total).
        work: folder for finished parts that is kept.

    Raises:
        BakeryError: what the user can mend.
    """
    kind = video.kind_of(output)
    gain = parse_gain(wanted.gain)
    pictures, head = opened(clip, wanted.rate), load_head(wanted.head)
    if isinstance(wanted.over, Path):
        _reopened(wanted)  # what cannot be read is told before the clip is followed
    finder = plug_in("detectors", wanted.detector)
    show = progress or (lambda step, done, total: None)
    with work_folder(output, work) as kept:
        bundle = baked(source, wanted, kept, show)
        manifest = bundles.read_manifest(bundle)
        avatar = open_avatar(bundle)
        place = wanted.fits or kept.folder / "fits"
        done = fitted(
            pictures, head, finder, place, wanted.track, wanted.face, show,
            wanted.overwrite or wanted.fits is None,
        )  # fmt: skip
        take = retarget(done.take, gain, wanted.neutral)
        footage = None
        if isinstance(wanted.over, Path):
            footage = _footage(clip, place, done, head, finder, wanted, show)
        settings = over_settings(wanted, footage)
        if wanted.by == "transfer":
            player: AnimationPlayer = TransferPlayer(
                avatar, take, settings, done, head, lambda: opened(clip, wanted.rate), load()
            )
        elif wanted.by == "network":
            player = NetworkPlayer(
                avatar, take, settings, head, plug_in("generators", "pagan"), str(source)
            )
        else:
            player = AnimationPlayer(avatar, take, settings)
        heard, notes = sound_of(clip, kind, kept, wanted, done)
        own = tuple(filter(None, map(read_ingredient, clips_of(clip, wanted))))
        notes += tuple(told for one in own if (told := ingredient_note(one)))
        shown: Replacement | AnimationPlayer = player
        over: object = wanted.over
        if footage is not None:
            asked = wanted.settings
            shown = Replacement(player, footage, asked.first, asked.last)
            notes += shown.notes(wanted.over)
            over = clip_key(footage.reopen(), head, wanted.track, wanted.over_face)
        key = key_of(
            __version__, digest_file(bundle / MANIFEST), clip_key(pictures, head, wanted.track, wanted.face),
            digest(format_take(take)), wanted.by, over, asdict(wanted.settings),
        )  # fmt: skip
        film(
            shown,
            output,
            marked(note_of(manifest), footage is not None, own),
            key,
            kept,
            heard,
            progress,
            wanted.settings.codec,
        )
    return Made(shown.count, shown.rate, notes)


def _footage(clip, place, done, head, finder, wanted, show):
    """The footage that a face is put into; the clip itself is not followed twice."""

    reopen = partial(_reopened, wanted)
    same = wanted.over.resolve() == Path(clip).resolve()
    if same and wanted.over_face in (None, wanted.face):
        there = done
    else:
        try:
            there = fitted(
                reopen(), head, finder, place / OVER, wanted.track, wanted.over_face, show,
                wanted.overwrite or wanted.fits is None,
            )  # fmt: skip
        except (InputError, FitError) as error:
            raise type(error)(str(error).replace("--face", "--over-face")) from None
    longest = wanted.settings.size if wanted.sized else None
    return Footage(there, head, reopen, longest)


def baked(source: Path, wanted: Wanted, kept: Work, show: Callable[[str, int, int], None]) -> Path:
    """The bundle that is played: the one given, or one baked of a photo into the work folder."""
    if Path(source).is_dir():
        return Path(source)
    request = pipeline.Request(
        Path(source), kept.folder / "portrait.avatar", head=wanted.head, keep_photo=True,
        detector=wanted.detector, overwrite=True,
    )  # fmt: skip
    if not is_fresh(request):
        pipeline.build(request, show)
    return request.output


def _reopened(wanted):
    """What the face is put into, opened."""
    return opened(wanted.over, wanted.rate if wanted.over.is_dir() else None)


def over_settings(wanted: Wanted, footage: Footage | None = None) -> RenderSettings:
    """How the head is drawn, by what it is put into; footage decides about frames and keeps its hair."""
    if footage is not None:
        return RenderSettings(rate=footage.performance.take.rate, hair=False)
    if wanted.over is None:
        return wanted.settings
    return replace(wanted.settings, view="photo")


def sound_of(clip: Path, kind: str, kept: Work, wanted: Wanted, done: Performance):
    """The clip's sound for a kind of video, or None, and what is told of the clip."""
    if not wanted.sound or wanted.rate is not None:
        return None, done.notes
    try:
        return video.read_sound(clip, kind, kept.folder), done.notes
    except InputError as error:
        said = str(error).removeprefix(f"{clip}: ")
        return None, (*done.notes, f"left without sound: {said}")


def clips_of(clip: Path, wanted: Wanted) -> list[Path]:
    """The clips that go into a film, each once."""
    over = [wanted.over] if isinstance(wanted.over, Path) else []
    return [clip, *(one for one in over if one.resolve() != Path(clip).resolve())]


def marked(note: Note, footage: bool = False, own: tuple[Ingredient, ...] = ()) -> Note:
    """What a video of an avatar says about itself, whose movements it shows, and what it is put into.

    Args:
        own: the marks that the clips carry already.
    """
    return replace(note, text=note.text + MARK + (REPLACED if footage else ""), ingredients=own)
