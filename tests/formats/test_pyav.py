"""Videos by PyAV, where it is installed: what browsers and QuickTime ask for, and sound in time."""

import math
import struct
import wave
from fractions import Fraction

import numpy as np
import pytest

from bakery.errors import InputError
from bakery.formats import mp4, pyav, video

NOTE = video.Note("Synthetic media", "http://cv.iptc.org/newscodes/digitalsourcetype/x")
RATE = 25.0
LATE = 0.03  # seconds: a frame of AAC or Opus is 21 ms or 20 ms


@pytest.fixture(scope="module")
def av():
    return pytest.importorskip("av")


def test_without_it_nothing_changes(monkeypatch):
    monkeypatch.setattr(pyav, "available", lambda: False)
    assert video.codec_of(".mp4") == "mp4v" and video.codec_of(".webm") == "VP80"
    monkeypatch.setattr(pyav, "available", lambda: True)
    assert video.codec_of(".mp4") == "avc1" and video.codec_of(".webm") == "VP90"


def moving(count, first=0):
    for index in range(first, first + count):
        picture = np.full((64, 96, 3), 40 + 2 * index, np.uint8)
        picture[20:40, index : index + 12] = (200, 60, 30)
        yield picture


@pytest.fixture
def film(av, tmp_path):
    """A video of three parts; with a sound, if one is given."""

    def make(sound=None, kind=".mp4", start=0.0, lengths=(10, 7, 8)):
        parts, first = [], 0
        for number, length in enumerate(lengths):
            parts.append(tmp_path / f"part{number}")
            parts[-1].write_bytes(
                video.encode(moving(length, first), kind, RATE, video.codec_of(kind))
            )
            first += length
        heard = None if sound is None else video.read_sound(sound, kind, tmp_path)
        made = tmp_path / f"film{kind}"
        video.join(made, parts, kind, RATE, (96, 64), NOTE, heard, start)
        return made

    return make


def test_parts_become_one_video_that_players_know(av, film):
    made = film()
    data = made.read_bytes()
    assert data.find(b"moov") < data.find(b"mdat")  # it plays while it loads
    with av.open(str(made)) as clip:
        stream = clip.streams.video[0]
        coder = stream.codec_context
        assert (coder.name, coder.profile, coder.pix_fmt) == ("h264", "High", "yuv420p")
        assert (coder.colorspace, coder.color_range, coder.has_b_frames) == (1, 1, False)
        assert stream.average_rate == 25
        frames = [frame.to_ndarray(format="rgb24") for frame in clip.decode(stream)]
    assert len(frames) == 25
    for found, wanted in zip(frames, moving(25)):
        assert abs(int(found[5, 5, 1]) - int(wanted[5, 5, 1])) <= 2  # in 16..235 a level is 1.16


def test_the_same_pictures_give_the_same_bytes(av):
    for encode in (pyav.encode_h264, pyav.encode_vp9, pyav.encode_prores):
        assert encode(moving(5), RATE) == encode(moving(5), RATE)


def fading(count):
    """Pictures of one colour with an alpha that grows to the right."""
    alpha = np.tile(np.linspace(0, 255, 96).astype(np.uint8), (64, 1))
    return [np.dstack([np.full((64, 96, 3), 60 + n, np.uint8), alpha]) for n in range(count)]


def test_alpha_goes_through_prores(av, tmp_path):
    parts = [tmp_path / "a", tmp_path / "b"]
    for part in parts:
        part.write_bytes(video.encode(fading(3), ".mov", RATE, video.codec_of(".mov")))
    made = tmp_path / "film.mov"
    sound = video.read_sound(tone(tmp_path / "tone.wav", loud_at=0.0), ".mov", tmp_path)
    video.join(made, parts, ".mov", RATE, (96, 64), NOTE, sound)
    assert made.read_bytes()[4:12] == b"ftypqt  " and b"DigitalSourceType" in made.read_bytes()
    with av.open(str(made)) as clip:
        stream = clip.streams.video[0]
        coder = stream.codec_context
        assert (coder.name, coder.profile, coder.colorspace) == ("prores", "4444", 1)
        assert stream.average_rate == 25 and clip.streams.audio[0].codec_context.name == "aac"
        frames = [
            frame.to_ndarray(format="rgba", src_colorspace="ITU709", dst_colorspace="ITU709")
            for frame in clip.decode(stream)
        ]
    assert len(frames) == 6
    for found, wanted in zip(frames, [*fading(3), *fading(3)]):
        np.testing.assert_allclose(found[..., 3].astype(int), wanted[..., 3], atol=1)
        seen = wanted[..., 3] > 30
        np.testing.assert_allclose(found[seen].astype(int), wanted[seen], atol=3)


def test_without_it_mov_is_refused_in_a_line(monkeypatch):
    monkeypatch.setattr(pyav, "available", lambda: False)
    with pytest.raises(InputError, match=r"bakery\[video\]"):
        video.kind_of("a.mov")


@pytest.mark.parametrize("kind, encode", [(".mp4", pyav.encode_h264), (".ivf", pyav.encode_vp9)])
def test_colours_come_back(av, tmp_path, kind, encode):
    wanted = [(118, 118, 118), (20, 20, 20), (200, 150, 130), (90, 60, 50), (30, 200, 30)]
    pictures = [np.tile(np.uint8(color), (64, 64, 1)) for color in wanted]
    (tmp_path / f"a{kind}").write_bytes(encode(pictures, 30000 / 1001))
    with av.open(str(tmp_path / f"a{kind}")) as clip:
        rate = clip.streams.video[0].average_rate  # an IVF file says none
        assert kind == ".ivf" or float(rate) == pytest.approx(30000 / 1001)
        found = [
            frame.to_ndarray(format="rgb24", src_colorspace="ITU709", dst_colorspace="ITU709")[
                30, 30
            ]
            for frame in clip.decode(video=0)
        ]
    np.testing.assert_allclose(found, wanted, atol=3)  # 8 bits of YUV in video range


def tone(path, seconds=3.0, loud_at=2.0, rate=44100):
    """A WAV that is silent, then a tone of 440 Hz."""
    times = np.arange(int(seconds * rate)) / rate
    samples = np.where(times >= loud_at, 12000 * np.sin(2 * math.pi * 440 * times), 0)
    with wave.open(str(path), "wb") as file:
        file.setnchannels(1), file.setsampwidth(2), file.setframerate(rate)
        file.writeframes(samples.astype("<i2").tobytes())
    return path


def heard(av, path):
    """Samples [n] and their rate, as a player plays them: after what it leaves out."""
    with av.open(str(path)) as clip:
        stream = clip.streams.audio[0]
        rate, found = stream.rate, []
        for frame in clip.decode(stream):
            found.append((frame.time, frame.to_ndarray()[0]))
    out = np.zeros(int((found[-1][0] + 1) * rate))
    for time, samples in found:
        at = round(time * rate)
        if at >= 0:
            out[at : at + len(samples)] = samples
    return out, rate


@pytest.mark.parametrize("kind", [".mp4", ".webm"])
@pytest.mark.parametrize("start", [0.0, 1.5])
def test_any_sound_is_laid_under_it_in_time(av, film, tmp_path, kind, start):
    made = film(tone(tmp_path / "a.wav"), kind, start, lengths=(25, 25, 25))
    samples, rate = heard(av, made)
    loud = np.flatnonzero(np.abs(samples) > 0.1)
    assert abs(loud[0] / rate - (2.0 - start)) < LATE
    steady = samples[loud[0] + rate // 10 : loud[0] + rate // 2]
    crossings = np.count_nonzero(np.diff(np.signbit(steady)))
    assert crossings / 2 / (len(steady) / rate) == pytest.approx(440, rel=0.02)


def test_sound_that_begins_late_stays_late(av, film, tmp_path):
    """A clip whose sound has its first sample at 0.8 s, as phones write it."""
    source = tone(tmp_path / "a.wav", seconds=1.0, loud_at=0.0)
    late = tmp_path / "late.mkv"
    with av.open(str(source)) as read, av.open(str(late), "w", format="matroska") as out:
        made = out.add_stream("pcm_s16le", rate=44100, layout="mono")
        for frame in read.decode(audio=0):
            frame.pts = frame.pts + round(0.8 * 44100)
            out.mux(made.encode(frame))
        out.mux(made.encode())
    samples, rate = heard(av, film(late, lengths=(25, 25)))
    assert abs(np.flatnonzero(np.abs(samples) > 0.1)[0] / rate - 0.8) < LATE


def test_aac_of_an_mp4_is_carried_over_as_it_is(av, film, tmp_path):
    source = film(tone(tmp_path / "a.wav"), lengths=(25, 25, 25)).rename(tmp_path / "source.mp4")
    first = [track for track in mp4.read_tracks(source) if track.kind == "soun"][0]
    again = film(source, lengths=(25, 25, 25))
    second = [track for track in mp4.read_tracks(again) if track.kind == "soun"][0]
    assert not (tmp_path / "sound.mp4").stat().st_mtime > again.stat().st_mtime
    data, other = source.read_bytes(), again.read_bytes()
    assert [data[at : at + n] for _, at, n in first.places] == [
        other[at : at + n] for _, at, n in second.places
    ]


def test_what_has_no_sound_or_is_no_clip(av, film, tmp_path):
    silent = film().rename(tmp_path / "silent.mp4")
    assert not [t for t in mp4.read_tracks(film(silent)) if t.kind == "soun"]
    (tmp_path / "a.txt").write_text("no sound")
    with pytest.raises(InputError, match="cannot be read") as caught:
        video.read_sound(tmp_path / "a.txt", ".mp4", tmp_path)
    assert "\n" not in str(caught.value)


def test_a_webm_is_vp9_of_all_frames(av, film):
    with av.open(str(film(kind=".webm"))) as clip:
        stream = clip.streams.video[0]
        frames = list(clip.decode(stream))
        assert stream.codec_context.name in ("vp9", "libvpx-vp9") and len(frames) == 25
        assert [frame.key_frame for frame in frames].count(True) == 3  # one a part


PLAIN = struct.pack(">9i", 0x10000, 0, 0, 0, 0x10000, 0, 0, 0, 0x40000000)  # QuickTime's matrix
QUARTER = struct.pack(">9i", 0, 0x10000, 0, -0x10000, 0, 0, 0, 0, 0x40000000)


@pytest.mark.parametrize(
    "codec, pixels, name",
    [("libx265", "yuv420p10le", "a.mov"), ("libx264", "yuv420p", "a.mp4"), ("libvpx-vp9", "yuv420p", "a.webm"),
     ("libsvtav1", "yuv420p10le", "b.mp4"), ("libsvtav1", "yuv420p", "b.webm")],
)  # fmt: skip
def test_clips_of_phones_are_read_in_time(av, tmp_path, codec, pixels, name):
    """10 bits, HEVC, AV1, which OpenCV lacks, and frames that come when they come."""
    times = np.cumsum([0, 40, 40, 120, 40, 20, 80, 200, 40])  # milliseconds
    with av.open(str(tmp_path / name), "w") as out:
        stream = out.add_stream(codec, rate=30)
        stream.width, stream.height, stream.pix_fmt = 160, 96, pixels
        stream.codec_context.time_base = Fraction(1, 1000)
        for time in times:
            picture = np.zeros((96, 160, 3), np.uint8)
            picture[:48, :80] = 200
            frame = av.VideoFrame.from_ndarray(picture, "rgb24")
            frame.pts, frame.time_base = int(time), Fraction(1, 1000)
            out.mux(stream.encode(frame))
        out.mux(stream.encode())
    frames = list(video.Clip(tmp_path / name).frames())
    np.testing.assert_allclose([seconds for seconds, _ in frames], times / 1000, atol=1e-3)
    assert all(np.abs(seen[24, 40].astype(int) - 200).max() < 6 for _, seen in frames)
    if name.endswith(".webm"):
        return
    data = (tmp_path / name).read_bytes()  # and held upright
    at = data.index(PLAIN, data.index(b"tkhd"))
    (tmp_path / name).write_bytes(data[:at] + QUARTER + data[at + len(PLAIN) :])
    _, turned = next(video.Clip(tmp_path / name).frames())
    assert turned.shape == (160, 96, 3) and turned[40, 80].min() > 190 and turned[40, 20].max() < 20


def test_av1_of_three_parts_is_one_video(av, tmp_path):
    parts, first = [], 0
    for number, length in enumerate((10, 7, 8)):
        parts.append(tmp_path / f"part{number}")
        data = video.encode(moving(length, first), ".mp4", RATE, video.codec_of(".mp4", "av1"))
        assert data == video.encode(moving(length, first), ".mp4", RATE, video.AV1)  # same bytes
        parts[-1].write_bytes(data)
        first += length
    made = tmp_path / "film.mp4"
    video.join(made, parts, ".mp4", RATE, (96, 64), NOTE)
    data = made.read_bytes()
    assert data.find(b"moov") < data.find(b"mdat") and b"av1C" in data
    assert b"DigitalSourceType" in data
    with av.open(str(made)) as clip:
        stream = clip.streams.video[0]
        coder = stream.codec_context
        assert (coder.codec.canonical_name, coder.pix_fmt) == ("av1", "yuv420p")
        assert (coder.colorspace, coder.color_range, stream.average_rate) == (1, 1, 25)
        shown = list(clip.decode(stream))
        assert [frame.pts * frame.time_base for frame in shown] == [
            Fraction(k, 25) for k in range(25)
        ]
        frames = [frame.to_ndarray(format="rgb24") for frame in shown]
    for found, wanted in zip(frames, moving(25)):
        assert abs(int(found[5, 5, 1]) - int(wanted[5, 5, 1])) <= 3
        box = found[22:38, :, 0].astype(int) - found[22:38, :, 2] > 60
        assert 8 * 16 < box.sum() < 16 * 16  # the red box, where it is seen


def test_a_damaged_clip_ends_where_it_is_damaged(av, tmp_path):
    data = bytearray(video.encode(moving(25), ".mp4", RATE, video.AV1))
    (tmp_path / "a.mp4").write_bytes(data)
    with pytest.raises(InputError, match="more than 64 pixels"):
        list(pyav.decode(tmp_path / "a.mp4", 64))
    _, at, size = mp4.read_tracks(tmp_path / "a.mp4")[0].places[8]
    data[at : at + size] = bytes([0xFF]) * size
    (tmp_path / "a.mp4").write_bytes(data)
    assert 0 < len(list(video.Clip(tmp_path / "a.mp4").frames())) < 25
    (tmp_path / "b.mp4").write_bytes(b"nothing")
    assert list(pyav.decode(tmp_path / "b.mp4", 64)) == []


def test_av1_without_pyav_says_what_reads_it(av, tmp_path, monkeypatch):
    (tmp_path / "a.mp4").write_bytes(video.encode(moving(3), ".mp4", RATE, video.AV1))
    monkeypatch.setattr(pyav, "available", lambda: False)
    with pytest.raises(InputError, match=r"convert it first, or pip install 'bakery\[video\]'"):
        list(video.Clip(tmp_path / "a.mp4").frames())


def test_av1_is_smaller(av):
    rng = np.random.default_rng(3)
    still = rng.integers(0, 255, (16, 16, 3), np.uint8)
    pictures = [np.roll(np.kron(still, np.ones((16, 16, 1), np.uint8)), k, 1) for k in range(20)]
    assert len(pyav.encode_av1(pictures, RATE)) < 0.8 * len(pyav.encode_h264(pictures, RATE))


def test_av1_where_it_cannot_be_had(monkeypatch, bakery, tmp_path):
    with pytest.raises(InputError, match="into .mp4 files, not into .webm"):
        video.codec_of(".webm", "av1")
    monkeypatch.setattr(pyav, "available", lambda: False)
    for out, code in (("a.webm", 2), ("a.mp4", 1), ("frames/", 2)):
        done = bakery(
            "animate", "x.avatar", "--curves", "x.csv", "--codec", "av1", "-o", tmp_path / out
        )
        assert done.returncode == code and "--codec av1" in done.stderr, done.stderr
    assert not list(tmp_path.iterdir())
