"""Video clips in, videos out: pictures by OpenCV, everything around them by `mp4` and `webm`.

Clips that OpenCV opens but cannot decode (AV1: its wheels lack a decoder) are read by PyAV where that is installed.

OpenCV's wheels bring FFmpeg. For Linux it stands under the LGPL with libvpx (BSD); the one for macOS
on ARM (5.0.0.93) holds libx264 and libx265 (GPL) too, as PyAV's and imageio-ffmpeg's do everywhere.
Nothing here uses those: the only codecs asked for are VP8, which libvpx codes, and MPEG-4 part 2,
which FFmpeg's own encoder does, and `encode` refuses any other outcome. VP8 plays in every browser
(7 ms a frame of 512x512 on one core) and MPEG-4 in players and editors (1 ms); VP9 takes 90 ms, for
OpenCV passes no speed to its encoder.
"""

import contextlib
import os
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np

from bakery import __version__
from bakery.errors import InputError, UsageProblem
from bakery.formats import mark, mp4, pyav, webm
from bakery.formats.files import replacing
from bakery.formats.place import scratch
from bakery.types import Ingredient

os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")  # FFmpeg prints on stderr by itself
KINDS = {".mp4": ("mp4v", ".mp4"), ".webm": ("VP80", ".ivf")}  # ending -> FourCC, of the parts
ALPHA = ".mov"  # kind that carries alpha, by PyAV alone
H264, AV1, PRORES, VP9 = "avc1", "av01", "ap4h", "VP90"
CODECS = ("usual", "av1")  # what may be asked for; see `codec_of`
LARGEST_SIDE = 4096  # pixels
BRANDS = {".mp4": b"isom", ALPHA: b"qt  "}  # what the first bytes of a file say it is
# OpenCV's change to YUV cuts off instead of rounding: grey 118 came back as (115, 117, 114).
LIFT = (1.0, 0.0, 1.0, 0.0)
INSTEAD = "write to the other kind, drop --sound, or pip install 'bakery[video]', which converts it"


@dataclass(frozen=True)
class Note:
    """What a video says about itself."""

    text: str
    source_type: str  # IPTC digital source type, a URL
    ingredients: tuple[Ingredient, ...] = ()  # clips that went in, with a mark of their own

    def properties(self) -> dict[str, str]:
        """By XMP's names: of what kind, and by which program."""
        return mark.Mark(self.source_type, f"bakery {__version__}").properties()

    def xmp(self) -> str:
        """The same as an XMP packet."""
        return mark.packet(self.properties(), self.text, self.ingredients)


@contextlib.contextmanager
def quiet():
    """OpenCV says nothing of its own: what matters becomes one line of ours."""
    level = cv2.utils.logging.setLogLevel(0)
    try:
        yield
    finally:
        cv2.utils.logging.setLogLevel(level)


class Clip:
    """A video file, frame by frame."""

    def __init__(self, path):
        """Open a video.

        Raises:
            InputError: no video that can be read, truncated, or too large.
        """
        path = Path(path)
        if not path.is_file():
            raise InputError(f"{path}: no such file; give a video such as clip.mp4")
        self.path = path
        if mp4.is_mp4(path):
            mp4.check_frames(path)
        with quiet():
            self.capture = cv2.VideoCapture(str(path), cv2.CAP_FFMPEG)
        sides = [self.capture.get(n) for n in (cv2.CAP_PROP_FRAME_WIDTH, cv2.CAP_PROP_FRAME_HEIGHT)]
        if not self.capture.isOpened() or min(sides) < 1:  # FFmpeg opens text as a video of nothing
            raise InputError(f"{path}: no video that can be read; give an MP4, MOV or WebM file")
        self.rate = float(self.capture.get(cv2.CAP_PROP_FPS)) or 30.0
        self.count = max(int(self.capture.get(cv2.CAP_PROP_FRAME_COUNT)), 0)  # a guess
        if not max(sides) <= LARGEST_SIDE:
            raise InputError(
                f"{path}: {sides[0]:.0f}x{sides[1]:.0f} pixels; at most {LARGEST_SIDE} a side are "
                "read; make it smaller"
            )
        if not np.isfinite(self.rate) or not 1 <= self.rate <= 1000:
            raise InputError(f"{path}: {self.rate:g} frames a second; convert it to a usual rate")

    def frames(self):
        """Yield (seconds, [H, W, 3] uint8 sRGB) of every frame, upright; times increase.

        Raises:
            InputError: there is none that can be read.
        """
        last = -1.0
        for now, picture in self._decoded():
            if now is None or not now > last:  # some files carry no times
                now = last + 1 / self.rate if last >= 0 else 0.0
            yield now, picture
            last = now
        if last < 0:
            more = (
                "" if pyav.available() else ", or pip install 'bakery[video]', which reads AV1 too"
            )
            raise InputError(f"holds no frame that can be read; convert it first{more}")

    def _decoded(self):
        """(seconds as the file has them, picture) of every frame."""
        good, picture = self.capture.read()
        if not good and pyav.available():
            yield from pyav.decode(self.path, LARGEST_SIDE)
        while good:
            seconds = self.capture.get(cv2.CAP_PROP_POS_MSEC) / 1000
            yield seconds, cv2.cvtColor(picture, cv2.COLOR_BGR2RGB)
            good, picture = self.capture.read()
        self.capture.release()


def kind_of(path):
    """The ending of a video that can be written: ".mp4", ".webm", or with PyAV ".mov".

    Raises:
        InputError: another one.
    """
    ending = Path(path).suffix.lower()
    if ending == ALPHA:
        if not pyav.available():
            raise InputError(
                f"{path}: .mov (ProRes 4444, with alpha) needs PyAV: pip install 'bakery[video]'"
            )
        return ending
    if ending not in KINDS:
        raise InputError(
            f"{path}: videos are written as .webm (plays in browsers) or .mp4 (players, editors)"
        )
    return ending


def codec_of(kind, asked=CODECS[0]):
    """How a video of a kind is coded here: a FourCC; H.264 and VP9 where PyAV is installed.

    Args:
        asked: of CODECS; "av1" is for .mp4, by PyAV.

    Raises:
        InputError: AV1 cannot be had.
    """
    if asked == "av1":
        if kind != ".mp4":
            raise UsageProblem(f"--codec av1: is written into .mp4 files, not into {kind}")
        if not pyav.available():
            raise InputError("--codec av1: needs PyAV: pip install 'bakery[video]'")
        return AV1
    if kind == ALPHA or pyav.available():
        return {".mp4": H264, ".webm": VP9, ALPHA: PRORES}[kind]
    return KINDS[kind][0]


def encode(pictures, kind, rate, codec=None):
    """Encode pictures as a part of a video that can be joined with others.

    Args:
        pictures: [H, W, 3] uint8 sRGB each, sides even; for ALPHA [H, W, 4] too.
        kind: ending of the whole, see `kind_of`.
        rate: frames a second.
        codec: from `codec_of`; None is what OpenCV codes.

    Returns:
        bytes.

    Raises:
        InputError: this OpenCV lacks the codec.
    """
    by_pyav = {
        H264: pyav.encode_h264,
        AV1: pyav.encode_av1,
        VP9: pyav.encode_vp9,
        PRORES: pyav.encode_prores,
    }
    if codec in by_pyav:
        return by_pyav[codec](pictures, rate)
    four, ending = KINDS[kind]
    with scratch() as folder:
        path = str(folder / f"part{ending}")
        writer = None
        for picture in pictures:
            if writer is None:
                size = picture.shape[1::-1]
                code = cv2.VideoWriter_fourcc(*four)
                with quiet():  # it complains of "VP80" and takes it
                    writer = cv2.VideoWriter(path, cv2.CAP_FFMPEG, code, rate, size)
                if not writer.isOpened():
                    raise InputError(
                        f"this OpenCV writes no {kind}; choose the other kind of video"
                    )
            writer.write(cv2.add(cv2.cvtColor(picture, cv2.COLOR_RGB2BGR), LIFT))
        writer.release()
        if (made := _codec(path, kind)) != four:
            raise InputError(f"this OpenCV codes {kind} as {made}; choose the other kind of video")
        return Path(path).read_bytes()


def _codec(path, kind):
    """FourCC of what a part holds."""
    if kind == ".mp4":
        return mp4.read_tracks(path)[0].entry[4:8].decode("latin-1")
    with open(path, "rb") as file:
        return file.read(12)[8:].decode("latin-1")


def read_sound(path, kind, folder=None):
    """The sound of a clip, for a video of a kind: as it is, or by PyAV as a browser plays it.

    Args:
        folder: where transcoded sound may be kept for `join`; None transcodes nothing.

    Returns:
        mp4.Track or webm.Blocks; None if it has no sound.

    Raises:
        InputError: the kind of video cannot hold it.
    """
    path = Path(path)
    kind = ".mp4" if kind == ALPHA else kind  # the same boxes
    if not path.is_file():
        raise InputError(f"{path}: no such file; give the clip whose sound is wanted")
    if folder is not None and pyav.available():
        target = Path(folder) / f"sound{kind}"
        if not _plays(path, kind):
            if not pyav.transcode_sound(path, kind, target):
                return None
            return webm.read_sound(target) if kind == ".webm" else mp4.read_tracks(target)[0]
    if mp4.is_mp4(path):
        sounds = _sounds(path)
        if sounds and kind != ".mp4":
            raise InputError(f"{path}: its sound fits into .mp4 only; {INSTEAD}")
        return sounds[0] if sounds else None
    if webm.is_webm(path):
        sound = webm.read_sound(path)
        if sound is not None and kind != ".webm":
            raise InputError(f"{path}: its sound fits into .webm only; {INSTEAD}")
        return sound
    raise InputError(
        f"{path}: sound is taken from MP4, MOV and WebM; convert it, or "
        "pip install 'bakery[video]' to read any kind"
    )


def _sounds(path):
    tracks = [track for track in mp4.read_tracks(path) if track.kind == "soun" and track.places]
    return [track for track in tracks if track.entry[4:8] in mp4.SOUND]


def _plays(path, kind):
    """Whether a clip's sound goes into a video of a kind as it is, and browsers play it there."""
    try:
        if mp4.is_mp4(path):
            return kind == ".mp4" and [t.entry[4:8] for t in _sounds(path)][:1] == [b"mp4a"]
        return kind == ".webm" and webm.is_webm(path) and webm.read_sound(path) is not None
    except InputError:  # nothing that is understood here; PyAV understands more
        return False


def join(path, parts, kind, rate, size, note, sound=None, start=0.0):
    """Join the parts of a video, with a note and perhaps sound.

    Args:
        path: where to write; replaced at once when complete.
        parts: files with what `encode` returned, in order.
        rate: frames a second; size: (width, height) pixels.
        note: Note.
        sound: from `read_sound`.
        start: seconds of the sound that are left out at its beginning.
    """
    with replacing(path) as file:
        if kind in (".mp4", ALPHA):
            _join_mp4(file, parts, size, note, sound, start, BRANDS[kind])
        else:
            _join_webm(file, parts, rate, size, note, sound, start)


def _join_mp4(file, parts, size, note, sound, start, brand):
    tracks, delays = [mp4.joined([mp4.read_tracks(part)[0] for part in parts])], [0.0]
    if sound is not None:
        heard, delay = mp4.cut(sound, start, start + tracks[0].seconds)
        if heard.places:
            tracks.append(heard)
            delays.append(delay)
    mp4.write_mp4(file, tracks, size, note.text, note.xmp(), delays, brand)


def _join_webm(file, parts, rate, size, note, sound, start):
    read = [webm.read_ivf(part) for part in parts]
    count = sum(len(part.places) for part in read)
    video = webm.Blocks(
        read[0].codec, b"", np.arange(count) / rate,
        [place for part in read for place in part.places],
        np.concatenate([part.sync for part in read]),
    )  # fmt: skip
    seconds = count / rate
    if sound is not None:
        heard = np.flatnonzero((sound.seconds >= start) & (sound.seconds < start + seconds))
        places = [sound.places[n] for n in heard]
        sound = replace(
            sound, seconds=sound.seconds[heard] - start, places=places, sync=sound.sync[heard]
        )
    tags = {"COMMENT": note.text} | note.properties()
    if note.ingredients:
        said = (f"{mark.URN}{one.sha256} {mark.named(one)}" for one in note.ingredients)
        tags["INGREDIENTS"] = ", ".join(said)
    webm.write_webm(file, video, sound, size, seconds, tags)
