"""Videos: what is written comes back; sound is carried over sample by sample; damage is named."""

import shutil
import struct
import subprocess

import cv2
import numpy as np
import pytest

from bakery.errors import InputError
from bakery.formats import mp4, video, webm

URL = "http://cv.iptc.org/newscodes/digitalsourcetype/compositeSynthetic"
NOTE = video.Note("Synthetic media: <a> & b", URL)
RATE = 25.0


def moving(count, first=0):
    """Pictures whose grey level says which they are."""
    for index in range(first, first + count):
        picture = np.full((64, 96, 3), 40 + 4 * index, np.uint8)
        picture[20:40, 3 * index : 3 * index + 12] = (200, 60, 30)
        yield picture


def parts(folder, kind, lengths=(10, 7, 8)):
    paths, first = [], 0
    for number, length in enumerate(lengths):
        path = folder / f"{number}{kind}"
        path.write_bytes(video.encode(moving(length, first), kind, RATE))
        paths.append(path)
        first += length
    return paths


def aac_entry(version=0):
    """A sound description of AAC, as MP4 (0) or QuickTime (1) has it."""
    esds = mp4.full(b"esds", b"\x03\x80\x80\x80\x22decoder")
    base = bytes(6) + struct.pack(">H", 1)
    if version == 0:
        return mp4.box(b"mp4a", base + bytes(8) + struct.pack(">HHIHH", 2, 16, 0, 44100, 0) + esds)
    body = struct.pack(">HHIHHHHHH", 1, 0, 0, 2, 16, 0xFFFE, 0, 44100, 0)
    wave = mp4.box(b"wave", mp4.box(b"frma", b"mp4a"), esds)
    return mp4.box(b"mp4a", base + body + bytes(16) + wave)


def clip_with_sound(path, seconds=2.0, version=0, skip=0.0):
    """An MP4 of one picture track and made-up AAC samples; returns the samples."""
    rng = np.random.default_rng(0)
    count = int(seconds * 44100 / 1024)
    samples = [rng.bytes(int(n)) for n in rng.integers(20, 200, count)]
    raw = path.with_suffix(".raw")
    raw.write_bytes(b"".join(samples))
    sizes = np.array([len(sample) for sample in samples])
    places = [(raw, int(at), int(n)) for at, n in zip(np.cumsum(sizes) - sizes, sizes)]
    sound = mp4.Track(
        "soun", aac_entry(version), 44100, np.full(count, 1024), places, np.ones(count, bool), skip
    )
    picture = mp4.read_tracks(parts(path.parent, ".mp4", (5,))[0])[0]
    with open(path, "wb") as file:
        mp4.write_mp4(file, [picture, sound], (96, 64), "x", "<x/>")
    return samples


def read_samples(track):
    out = []
    for path, offset, size in track.places:
        with open(path, "rb") as file:
            file.seek(offset)
            out.append(file.read(size))
    return out


@pytest.mark.parametrize("kind", [".mp4", ".webm"])
def test_parts_become_one_video(tmp_path, kind):
    out = tmp_path / f"out{kind}"
    video.join(out, parts(tmp_path, kind), kind, RATE, (96, 64), NOTE)
    clip = video.Clip(out)
    assert clip.rate == pytest.approx(RATE, rel=1e-3)
    frames = list(clip.frames())
    assert len(frames) == 25
    np.testing.assert_allclose([time for time, _ in frames], np.arange(25) / RATE, atol=2e-3)
    for index, (_, picture) in enumerate(frames):
        assert abs(picture[50:, 70:].mean() - (40 + 4 * index)) < 3
    data = out.read_bytes()
    assert URL.encode() in data and b"Synthetic media: " in data
    if kind == ".mp4":
        assert b"Synthetic media: &lt;a&gt; &amp; b" in data and data.find(b"moov") < data.find(
            b"mdat"
        )


@pytest.mark.parametrize("kind, coder", [(".mp4", "aac"), (".webm", "libopus")])
def test_other_programs_read_it(tmp_path, kind, coder):
    """Sound of a foreign program comes through ours and is decoded by the foreign one again."""
    if shutil.which("ffmpeg") is None:
        pytest.skip("needs the program ffmpeg, for checking only")
    clip, out = tmp_path / {".mp4": "clip.mov", ".webm": "clip.webm"}[kind], tmp_path / f"out{kind}"
    tone = ["-f", "lavfi", "-i", "sine=440:duration=3", "-c:a", coder]
    made = subprocess.run(["ffmpeg", "-v", "error", *tone, clip], capture_output=True, text=True)
    if made.returncode:
        pytest.skip(f"this ffmpeg has no {coder}")
    sound = video.read_sound(clip, kind)
    video.join(out, parts(tmp_path, kind), kind, RATE, (96, 64), NOTE, sound, 1.0)

    def decoded(stream, form):
        command = ["ffmpeg", "-v", "error", "-i", out, "-map", f"0:{stream}", "-f", form, "-"]
        done = subprocess.run(command, capture_output=True)
        assert done.returncode == 0 and done.stderr == b""
        return done.stdout

    lines = decoded("v", "framecrc").decode().splitlines()
    assert len([line for line in lines if not line.startswith("#")]) == 25
    wave = np.frombuffer(decoded("a", "s16le"), np.int16).astype(float)
    rate = 44100 if kind == ".mp4" else 48000
    assert len(wave) / rate == pytest.approx(1.0, abs=0.05)
    crossings = (np.diff(np.sign(wave)) != 0).sum() / 2 / (len(wave) / rate)
    assert crossings == pytest.approx(440, rel=0.03)


@pytest.mark.parametrize("version", [0, 1])
def test_sound_is_carried_over(tmp_path, version):
    """From second 0.5 on, as long as the pictures last; AAC of QuickTime is described as MP4's."""
    clip, out = tmp_path / "clip.mp4", tmp_path / "out.mp4"
    samples = clip_with_sound(clip, version=version, skip=2048 / 44100)
    sound = video.read_sound(clip, ".mp4")
    assert read_samples(sound) == samples and sound.entry == aac_entry()
    assert sound.skip == pytest.approx(2048 / 44100)
    video.join(out, parts(tmp_path, ".mp4"), ".mp4", RATE, (96, 64), NOTE, sound, 0.5)
    back = video.read_sound(out, ".mp4")
    begin = int((0.5 + 2048 / 44100) * 44100 // 1024)
    heard = read_samples(back)
    assert heard == samples[begin : begin + len(heard)]
    assert back.seconds - back.skip == pytest.approx(1.0, abs=1024 / 44100)
    # The first sample begins before 0.5 s; what comes too early is skipped, to the unit.
    assert begin * 1024 / 44100 + back.skip == pytest.approx(0.5 + 2048 / 44100, abs=1 / 44100)


def test_sound_shorter_than_the_pictures(tmp_path):
    clip_with_sound(tmp_path / "clip.mp4", seconds=0.5)
    sound = video.read_sound(tmp_path / "clip.mp4", ".mp4")
    out = tmp_path / "out.mp4"
    video.join(out, parts(tmp_path, ".mp4"), ".mp4", RATE, (96, 64), NOTE, sound)
    assert video.read_sound(out, ".mp4").seconds == pytest.approx(0.5, abs=0.03)
    video.join(out, parts(tmp_path, ".mp4"), ".mp4", RATE, (96, 64), NOTE, sound, 9.0)
    assert video.read_sound(out, ".mp4") is None


def opus_clip(path, codec="A_OPUS"):
    """A WebM of VP8 and made-up sound; returns the packets."""
    packets = [bytes([n]) * (20 + n) for n in range(100)]
    raw = path.with_suffix(".raw")
    raw.write_bytes(b"".join(packets))
    sizes = np.array([len(p) for p in packets])
    places = [(raw, int(at), int(n)) for at, n in zip(np.cumsum(sizes) - sizes, sizes)]
    entry = webm.element(0x63A2, b"OpusHead") + webm.element(0xE1, webm.element(0x9F, b"\x02"))
    sound = webm.Blocks(codec, entry, np.arange(100) * 0.02, places, np.ones(100, bool))
    picture = webm.read_ivf(parts(path.parent, ".webm", (5,))[0])
    with open(path, "wb") as file:
        webm.write_webm(file, picture, sound, (96, 64), 2.0, {})
    return packets


def test_sound_of_webm(tmp_path):
    packets = opus_clip(tmp_path / "clip.webm")
    sound = video.read_sound(tmp_path / "clip.webm", ".webm")
    assert read_samples(sound) == packets and b"OpusHead" in sound.entry
    out = tmp_path / "out.webm"
    video.join(out, parts(tmp_path, ".webm"), ".webm", RATE, (96, 64), NOTE, sound, 0.5)
    back = video.read_sound(out, ".webm")
    assert read_samples(back) == packets[25:75]
    np.testing.assert_allclose(back.seconds, np.arange(50) * 0.02, atol=6e-4)
    assert len(list(video.Clip(out).frames())) == 25


def test_sound_that_does_not_fit_or_is_not_there(tmp_path):
    opus_clip(tmp_path / "clip.webm")
    clip_with_sound(tmp_path / "clip.mp4")
    opus_clip(tmp_path / "odd.webm", "A_PCM/INT/LIT")
    (tmp_path / "take.csv").write_text("Timecode\n")
    for name, kind, message in (
        ("clip.webm", ".mp4", "fits into .webm only"), ("clip.mp4", ".webm", "fits into .mp4 only"),
        ("odd.webm", ".webm", "A_PCM"), ("take.csv", ".mp4", "taken from MP4, MOV and WebM"),
        ("nothing.mp4", ".mp4", "no such file"),
    ):  # fmt: skip
        with pytest.raises(InputError, match=message):
            video.read_sound(tmp_path / name, kind)
    silent = parts(tmp_path, ".mp4", (5,))[0]
    assert video.read_sound(silent, ".mp4") is None


@pytest.mark.parametrize("name", ["clip.mp4", "clip.webm"])
def test_damaged_clips_end_in_one_line(tmp_path, name):
    """Flipped bytes and cuts: an InputError, or sound that lies inside the file; never a crash."""
    path = tmp_path / name
    (clip_with_sound if name.endswith("mp4") else opus_clip)(path)
    data, rng = path.read_bytes(), np.random.default_rng(0)
    kind, refused = path.suffix, 0
    for _ in range(150):
        broken = bytearray(data)
        for _ in range(rng.integers(1, 8)):
            broken[rng.integers(4, 3000)] = rng.integers(256)
        if rng.random() < 0.3:
            broken = broken[: rng.integers(16, len(broken))]
        path.write_bytes(broken)
        try:
            sound = video.read_sound(path, kind)
        except InputError as error:
            refused += 1
            assert "\n" not in str(error)
        else:
            for _, offset, size in sound.places if sound is not None else []:
                assert 0 <= offset and size >= 0
    assert refused > 10


def test_a_truncated_mp4_is_counted(tmp_path):
    """Cut behind ten of its frames; the index at its beginning names all of them."""
    path = tmp_path / "cut.mp4"
    video.join(path, parts(tmp_path, ".mp4"), ".mp4", RATE, (96, 64), NOTE)
    places = mp4.read_tracks(path)[0].places
    path.write_bytes(path.read_bytes()[: places[9][1] + places[9][2] + 3])
    for read in (video.Clip, mp4.read_tracks):
        with pytest.raises(InputError, match="cut.mp4: a truncated MP4: 10 of the 25 frames that"):
            read(path)
    clip_with_sound(path)
    kept = sorted(offset for _, offset, _ in video.read_sound(path, ".mp4").places)
    path.write_bytes(path.read_bytes()[: kept[-3]])
    with pytest.raises(InputError, match="truncated MP4: .* pieces of sound"):
        video.read_sound(path, ".mp4")


SOUND = webm.element(0x83, b"\x02") + webm.element(0x86, b"A_OPUS")
NUMBER = webm.element(0xD7, b"\x01")
HUGE = (1 << 40 | 1 << 56).to_bytes(8, "big")  # a size, bytes
WRONG = {
    "no number": (webm.element(0xAE, SOUND), "215"),
    "terabytes": (b"\xae" + HUGE + NUMBER + SOUND, "not described"),
    "a long number": (webm.element(0xAE, NUMBER, webm.element(0x83, bytes(900)), SOUND), "number"),
    "ends early": (webm.element(0xAE, NUMBER, SOUND, b"\xec\x83x") + b"yz", "not described"),
    "no end": (webm.element(0xAE, NUMBER, SOUND, b"\x86\xff"), "no end|number"),
}  # fmt: skip


@pytest.mark.parametrize("case", WRONG)
def test_damaged_descriptions_of_sound(tmp_path, case):
    entry, message = WRONG[case]
    path = tmp_path / "clip.webm"
    head = webm.element(0x1A45DFA3, webm.element(0x4282, b"webm"))
    tracks = webm.element(webm.TRACKS, entry + webm.element(0xEC, bytes(99)))
    path.write_bytes(head + webm.element(webm.SEGMENT, tracks))
    with pytest.raises(InputError, match=f"a damaged WebM .*({message})"):
        video.read_sound(path, ".webm")


@pytest.mark.parametrize("kind, other", [(".mp4", "VP80"), (".webm", "mp4v")])
def test_only_the_codecs_that_are_named(tmp_path, monkeypatch, kind, other):
    """Some wheels hold GPL encoders; whatever OpenCV does with a code, the outcome is looked at."""
    assert [code for code, _ in video.KINDS.values()] == ["mp4v", "VP80"]
    video.encode(moving(2), kind, RATE)
    monkeypatch.setattr(video, "_codec", lambda path, kind: other)
    with pytest.raises(InputError, match=f"this OpenCV codes {kind} as {other}"):
        video.encode(moving(2), kind, RATE)


def test_clips_that_cannot_be_read(tmp_path):
    (tmp_path / "a.mp4").write_bytes(b"no video at all")
    for name in ("a.mp4", "nothing.mp4"):
        with pytest.raises(InputError, match=name):
            video.Clip(tmp_path / name)
    (tmp_path / "a.jpg").write_bytes(b"x")  # FFmpeg opens it, as a video of 0x0 pixels
    with pytest.raises(InputError, match="no video that can be read"):
        video.Clip(tmp_path / "a.jpg")
    with pytest.raises(InputError, match=".webm .plays in browsers"):
        video.kind_of("out.avi")


def test_turned_clips_come_upright(tmp_path):
    """Phones write the picture lying down with a turn in the header."""
    path = parts(tmp_path, ".mp4", (3,))[0]
    data = path.read_bytes()
    turned = struct.pack(">9i", 0, 0x10000, 0, -0x10000, 0, 0, 0, 0, 0x40000000)
    at = data.find(b"tkhd")
    where = data.find(mp4.MATRIX, at)
    path.write_bytes(data[:where] + turned + data[where + 36 :])
    _, picture = next(video.Clip(path).frames())
    assert picture.shape == (96, 64, 3)
    assert cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY).std() > 5
