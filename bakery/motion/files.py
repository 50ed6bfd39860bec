"""What `bakery animate`, `track` and `retarget` do over files."""

from bakery import __version__
from bakery.bake.plugins import plug_in
from bakery.errors import FitError, InputError
from bakery.export import bundle as files
from bakery.export.open import open_avatar
from bakery.formats.files import digest_file
from bakery.formats.livelink import format_take, read_take
from bakery.formats.place import MANIFEST
from bakery.formats.video import Clip, Note
from bakery.heads.file import load_head
from bakery.motion.animate import write_video
from bakery.motion.retarget import parse_gain, retarget
from bakery.motion.track import follow, track

__all__ = ["animate", "format_take", "note_of", "retargeted", "tracked"]


def retargeted(curves, gain=(), neutral=None):
    """A take from a file, changed as --gain and --neutral say."""
    return retarget(read_take(curves), parse_gain(gain), neutral)


def tracked(clip, head="makehuman", gain=(), neutral=None, progress=None):
    """The take of a clip, changed as --gain and --neutral say.

    Args:
        clip: video file.
        head: head model, name or file.
        progress: called with (step, done, total).

    Raises:
        InputError: no video, or no face in it; FitError: the face is too small.
    """
    video, factors = Clip(clip), parse_gain(gain)
    show = progress or (lambda step, done, total: None)
    try:
        followed = follow(
            video.frames(), plug_in("detectors", "network"),
            progress=lambda done: show("follow", done, max(video.count, done)),
        )  # fmt: skip
        count = len(followed.seconds)
        take = track(followed, load_head(head), progress=lambda done: show("fit", done, count))
    except (InputError, FitError) as error:
        raise type(error)(f"{clip}: {error}") from None
    return retarget(take, factors, neutral)


def note_of(manifest):
    """What a video of an avatar says about itself."""
    return Note(
        "Synthetic media: an animated avatar of a person, made by bakery "
        f"{__version__}; not a recording of this person.",
        manifest["provenance"]["digitalSourceType"],
    )


def animate(
    bundle, curves, output, show, gain=(), neutral=None, sound=None, progress=None, work=None
):
    """Play a take with a bundle into a video.

    Args:
        bundle: folder; curves: take; output: video; sound: clip or None.
        show: runtime.animate.Show.
        gain, neutral: see `drivers.retarget`.
        progress: called with (step, done, total).
        work: folder for finished parts that is kept.

    Returns:
        the Take as read, and the runtime.animate.Stage that played it.

    Raises:
        BakeryError: what the user can mend.
    """
    take = retargeted(curves, gain, neutral)
    manifest = files.read_manifest(bundle)
    avatar = open_avatar(bundle)
    key = [__version__, digest_file(bundle / MANIFEST)]
    made = write_video(
        avatar, take, show, output, note_of(manifest), key, sound, progress, work
    )  # fmt: skip
    return take, made
