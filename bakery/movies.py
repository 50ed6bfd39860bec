"""What `bakery animate`, `track` and `retarget` do over files."""

from bakery import __version__, steps
from bakery.drivers.retarget import parse_gain, retarget
from bakery.formats import bundle as files
from bakery.formats.files import digest_file
from bakery.formats.livelink import format_take, read_take
from bakery.formats.place import MANIFEST
from bakery.formats.video import Note
from bakery.runtime.animate import write_video

__all__ = ["animate", "format_take", "note_of", "retargeted"]


def retargeted(curves, gain=(), neutral=None):
    """A take from a file, changed as --gain and --neutral say."""
    return retarget(read_take(curves), parse_gain(gain), neutral)


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
    avatar = steps.open_avatar(bundle)
    key = [__version__, digest_file(bundle / MANIFEST)]
    made = write_video(
        avatar, take, show, output, note_of(manifest), key, sound, progress, work
    )  # fmt: skip
    return take, made
