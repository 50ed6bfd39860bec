"""What `bakery animate`, `track` and `retarget` do over files."""

from dataclasses import replace
from pathlib import Path

from bakery import __version__
from bakery.errors import FitError, InputError, UsageProblem
from bakery.export import bundle as bundles
from bakery.export.open import open_avatar
from bakery.formats.files import digest_file
from bakery.formats.livelink import format_take, read_take
from bakery.formats.place import MANIFEST
from bakery.formats.sequence import Sequence
from bakery.formats.stills import Stills
from bakery.formats.video import Clip, Note
from bakery.heads.file import load_head
from bakery.motion.animate import write_frames, write_video
from bakery.motion.fits import write_fits
from bakery.motion.follow import follow
from bakery.motion.retarget import parse_gain, retarget
from bakery.motion.track import TrackOptions, solve, take_of
from bakery.plugins import plug_in

MOSTLY = 0.9  # share of the frames that a clip promises, roughly, which are not missed

__all__ = ["animate", "format_take", "note_of", "retargeted", "tracked"]


def retargeted(curves, gain=(), neutral=None, base=None):
    """A take from a file, changed as --gain and --neutral say; `base` as in `read_take`."""
    return retarget(read_take(curves, base), parse_gain(gain), neutral)


def opened(clip, rate=None):
    """A video file as a Clip, a folder of numbered frames as Stills.

    Args:
        rate: frames a second of a folder.

    Raises:
        InputError: nothing that can be read; a folder without a rate, or a video with one.
    """
    folder = Path(clip).is_dir()
    if folder and rate is None:
        raise UsageProblem(f"{clip}: a folder of frames; say how many make a second, as --rate 25")
    if not folder and rate is not None:
        raise UsageProblem(f"--rate {rate:g}: {clip} is no folder; a video says its own rate")
    return Stills(clip, rate) if folder else Clip(clip)


def tracked(
    clip,
    head="makehuman",
    gain=(),
    neutral=None,
    progress=None,
    options=None,
    rate=None,
    fits=None,
    detector="network",
):
    """The take of a clip, changed as --gain and --neutral say.

    Args:
        clip: video file, or a folder of numbered frames.
        head: head model, name or file.
        progress: called with (step, done, total).
        options: TrackOptions; None takes the usual ones.
        rate: frames a second of a folder; None for a video, which says its own.
        fits: folder to write the fits of the frames to, see `motion.fits`; None for none.
        detector: name of a plug-in.

    Raises:
        InputError: no clip, or no face in it; FitError: the face is too small.
    """
    video, factors, model = opened(clip, rate), parse_gain(gain), load_head(head)
    options, finder = options or TrackOptions(), plug_in("detectors", detector)
    report = progress or (lambda step, done, total: None)
    try:
        followed = follow(
            video.frames(), finder, options.follow,
            progress=lambda done: report("follow", done, max(video.count, done)),
        )  # fmt: skip
        count = len(followed.seconds)
        solved = solve(followed, model, options, progress=lambda done: report("fit", done, count))
        take = take_of(solved, options, followed.doubt)
    except (InputError, FitError) as error:
        said = str(error)  # what the readers say names the file
        raise type(error)(said if said.startswith(f"{clip}") else f"{clip}: {said}") from None
    if count < MOSTLY * video.count:
        note = f"{count} of about {video.count} frames can be read; the clip may be damaged"
        take = replace(take, notes=(note, *take.notes))
    take = retarget(take, factors, neutral)
    if fits is not None:
        write_fits(fits, solved)
    return take


def note_of(manifest):
    """What a video of an avatar says about itself."""
    return Note(
        "Synthetic media: an animated avatar of a person, made by bakery "
        f"{__version__}; not a recording of this person.",
        manifest["provenance"]["digitalSourceType"],
    )


def animate(
    bundle, curves, output, settings, gain=(), neutral=None, sound=None, progress=None, work=None,
    base=None,
):  # fmt: skip
    """Play a take with a bundle into a video, or into PNG files.

    Args:
        bundle: folder; curves: take; sound: clip or None.
        output: path of a video, or formats.sequence.Sequence.
        settings: motion.animate.RenderSettings.
        gain, neutral: see `motion.retarget`; base: see `formats.livelink.read_take`.
        progress: called with (step, done, total).
        work: folder for finished parts that is kept.

    Returns:
        the Take as read, and the motion.animate.AnimationPlayer that played it.

    Raises:
        BakeryError: what the user can mend.
    """
    take = retargeted(curves, gain, neutral, base)
    manifest = bundles.read_manifest(bundle)
    avatar = open_avatar(bundle)
    key = [__version__, digest_file(bundle / MANIFEST)]
    note = note_of(manifest)
    if isinstance(output, Sequence):
        if sound is not None:
            raise InputError("--sound: pictures carry none; drop it, or write a video")
        return take, write_frames(avatar, take, settings, output, note, key, progress, work)
    return take, write_video(avatar, take, settings, output, note, key, sound, progress, work)
