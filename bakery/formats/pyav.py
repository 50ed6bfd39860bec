"""H.264, AV1, VP9, ProRes and AAC by PyAV, an extra: video that browsers, phones, QuickTime and editors play.

PyAV's wheels hold libx264 and libx265, which stand under the GPL; so it is never a dependency, and
who installs it decides. Without it videos are what `formats.video` says.
"""

import contextlib
import importlib.util
import io
import os
from collections.abc import Iterable, Iterator
from fractions import Fraction
from pathlib import Path

import numpy as np

from bakery.errors import InputError

MISSING = (
    "MPEG-4 part 2, which players and editors show, and no browser: pip install 'bakery[video]' "
    "writes H.264"
)
# One thread and no look ahead over parts: the same bytes everywhere, parts that join.
H264 = {"preset": "veryfast", "crf": "16", "bf": "0", "x264-params": "keyint=150:scenecut=0"}
# As fast as it goes, and no frame that is not shown: IVF has a frame a picture.
VP9 = {"deadline": "realtime", "cpu-used": "8", "crf": "18", "b": "0", "lag-in-frames": "0",
       "auto-alt-ref": "0", "g": "150"}  # fmt: skip
# One thread again, and pictures in the order in which they are shown: their times need no second table.
AV1 = {"preset": "8", "crf": "20", "svtav1-params": "lp=1:pred-struct=1:keyint=150"}
PRORES = {"profile": "4444", "vendor": "apl0", "alpha_bits": "16"}
os.environ.setdefault(
    "SVT_LOG", "1"
)  # SVT-AV1 tells its settings on stderr; errors alone are wanted
LARGEST_TERM = 240 * 1001  # of a rate as a fraction; 30000/1001 is one
SOUND = {".mp4": ("mp4", "aac", "fltp"), ".webm": ("webm", "libopus", "flt")}
RATE = 48000  # Hz of transcoded sound; Opus has no other


def available() -> bool:
    """Whether PyAV is installed."""
    return importlib.util.find_spec("av") is not None


def encode_h264(pictures: Iterable[np.ndarray], rate: float) -> bytes:
    """Encode pictures [H, W, 3] uint8 sRGB, sides even, as an MP4 file of one H.264 track.

    High profile, 4:2:0, BT.709 in video range, without B-frames, the first picture a key frame.
    """
    return _encode(pictures, rate, "mp4", "libx264", "yuv420p", H264)


def encode_av1(pictures: Iterable[np.ndarray], rate: float) -> bytes:
    """Encode pictures [H, W, 3] uint8 sRGB, sides even and 64 at least, as an MP4 file of one AV1 track.

    Main profile, 4:2:0, BT.709 in video range, by SVT-AV1 (BSD-3-Clause-Clear).
    """
    return _encode(pictures, rate, "mp4", "libsvtav1", "yuv420p", AV1)


def encode_vp9(pictures: Iterable[np.ndarray], rate: float) -> bytes:
    """Encode pictures [H, W, 3] uint8 sRGB, sides even, as an IVF file of VP9, 4:2:0, BT.709."""
    return _encode(pictures, rate, "ivf", "libvpx-vp9", "yuv420p", VP9)


def encode_prores(pictures: Iterable[np.ndarray], rate: float) -> bytes:
    """Encode pictures [H, W, 3 or 4] uint8 sRGB as a QuickTime file of one ProRes 4444 track.

    10 bits, 4:4:4, BT.709 in video range; alpha of 16 bits, colour not multiplied by it, opaque where
    the pictures have none. Every frame is a key frame.
    """
    return _encode(pictures, rate, "mov", "prores_ks", "yuva444p10le", PRORES)


def _encode(pictures, rate, container, name, pixels, options) -> bytes:
    import av

    stream, file = None, io.BytesIO()
    with av.open(file, "w", format=container) as out:
        for picture in pictures:
            if stream is None:
                stream = out.add_stream(name, rate=Fraction(rate).limit_denominator(LARGEST_TERM))
                stream.height, stream.width = picture.shape[:2]
                stream.pix_fmt = pixels
                coder = stream.codec_context
                coder.thread_count, coder.options = 1, options
                coder.colorspace = coder.color_primaries = 1  # BT.709
                coder.color_trc, coder.color_range = 13, 1  # sRGB; 16 to 235
            given = "rgb24" if picture.shape[2] == 3 else "rgba"
            frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(picture), given).reformat(
                format=pixels,
                src_colorspace="ITU709",
                dst_colorspace="ITU709",
                src_color_range="JPEG",
                dst_color_range="MPEG",
                interpolation="AREA",
            )
            out.mux(stream.encode(frame))
        if stream is not None:
            out.mux(stream.encode())
    return file.getvalue()


def decode(path: Path, largest: int) -> Iterator[tuple[float | None, np.ndarray]]:
    """Yield (seconds, [H, W, 3] uint8 sRGB) of every picture of a clip's first video track, upright.

    Ends where nothing more can be decoded, as OpenCV does.

    Args:
        largest: pixels on a side that are read.

    Raises:
        InputError: a picture is larger.
    """
    import av

    with contextlib.suppress(av.FFmpegError, OSError), av.open(str(path)) as clip:
        if not clip.streams.video:
            return
        stream = clip.streams.video[0]
        stream.thread_type = "AUTO"
        for frame in clip.decode(stream):
            if max(frame.width, frame.height) > largest:
                raise InputError(
                    f"{path}: a frame has more than {largest} pixels on a side; make it smaller"
                )
            upright = np.rot90(frame.to_ndarray(format="rgb24"), round(frame.rotation / 90))
            yield frame.time, np.ascontiguousarray(upright)


def transcode_sound(path: Path, kind: str, target: Path) -> bool:
    """Write the first sound track of any clip as AAC (".mp4") or Opus (".webm"), from second 0 on.

    Args:
        target: file to write, of that kind.

    Returns:
        Whether there is sound.

    Raises:
        InputError: the clip cannot be read.
    """
    import av

    form, coder, samples = SOUND[kind]
    try:
        with av.open(str(path)) as clip, av.open(str(target), "w", format=form) as out:
            if not clip.streams.audio:
                return False
            source = clip.streams.audio[0]
            layout = "mono" if source.channels == 1 else "stereo"
            made = out.add_stream(coder, rate=RATE, layout=layout)
            resampler = av.AudioResampler(format=samples, layout=layout, rate=RATE)
            for frame in _from_zero(clip.decode(source), resampler, layout, samples):
                out.mux(made.encode(frame))
            out.mux(made.encode())
    except (av.FFmpegError, OSError, ValueError) as error:
        why = " ".join(str(error).split())[:80]
        raise InputError(f"{path}: its sound cannot be read ({why}); convert it first") from None
    return True


def _from_zero(frames, resampler, layout: str, samples: str) -> Iterator[object]:
    """Resampled frames without gaps of time; silence where the sound begins after the pictures."""
    import av

    first = True
    for frame in frames:
        if first and frame.time and frame.time > 0:
            shape = (1, round(frame.time * RATE) * (2 if layout == "stereo" else 1))
            if samples.endswith("p"):
                shape = (2 if layout == "stereo" else 1, round(frame.time * RATE))
            silence = av.AudioFrame.from_ndarray(np.zeros(shape, np.float32), samples, layout)
            silence.sample_rate, silence.pts = RATE, None
            yield silence
        first = False
        for made in resampler.resample(frame):
            made.pts = None
            yield made
    for made in resampler.resample(None):
        made.pts = None
        yield made
