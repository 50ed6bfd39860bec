"""`bakery perform`: shots fitted anew, fits kept, consent and mark; what it refuses, in one line."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from bakery.formats import record, video
from bakery.formats.video import Clip

SAMPLES = Path(__file__).resolve().parents[2] / "samples"
SIZE = 300, 376


def film(path, pictures):
    part = path.with_name("part.mp4")
    part.write_bytes(video.encode(map(np.ascontiguousarray, pictures), ".mp4", 25.0))
    video.join(path, [part], ".mp4", 25.0, SIZE, video.Note("a", "b"))
    part.unlink()
    return path


@pytest.fixture(scope="module")
def clip(tmp_path_factory):
    """Two painted people, 6 frames of each, drifting to the right."""
    pictures = []
    for name in ("anna", "chidi"):
        picture = cv2.imread(str(SAMPLES / f"{name}.jpg"))
        small = cv2.resize(picture, SIZE, interpolation=cv2.INTER_AREA)[..., ::-1]
        pictures += [np.roll(small, shift, 1) for shift in range(6)]
    return film(tmp_path_factory.mktemp("clip") / "two.mp4", pictures)


@pytest.fixture(scope="module")
def played(bundle, bakery, clip):
    """What was said, the video, and the folder of the fits."""
    out, fits = clip.with_name("out.mp4"), clip.with_name("fits")
    done = bakery("perform", bundle, clip, "-o", out, "--size", 64, "--fits", fits)
    assert done.returncode == 0, done.stderr
    return done, out, fits


def test_a_portrait_plays_a_clip(played):
    done, out, fits = played
    assert "12 frames, 0.5 s" in done.stderr
    assert "both people, in the portrait and in the clip, have to agree" in done.stderr
    assert "shot 2 begins at frame 6 (0.24 s): fitted anew" in done.stderr
    frames = [picture for _, picture in Clip(out).frames()]
    assert len(frames) == 12 and frames[0].shape == (64, 64, 3)
    data = out.read_bytes()
    assert b"Synthetic media" in data and b"another person's, filmed" in data
    assert sorted(path.name for path in fits.iterdir()) == ["clip.npz", "shot_001", "shot_002"]


def test_fits_that_are_kept_are_taken(played, bundle, bakery, clip, tmp_path, monkeypatch):
    """No clip is followed twice: the same video comes of the fits alone."""
    monkeypatch.setattr("bakery.perform.performance.follow", None)
    _, out, fits = played
    again = tmp_path / "again.mp4"
    done = bakery("perform", bundle, clip, "-o", again, "--size", 64, "--fits", fits)
    assert done.returncode == 0, done.stderr
    assert again.read_bytes() == out.read_bytes()


def test_fits_of_other_settings_are_refused(played, bundle, bakery, clip, tmp_path):
    _, _, fits = played
    before = (fits / "clip.npz").read_bytes()
    command = ["perform", bundle, clip, "-o", tmp_path / "a.mp4", "--fits", fits]
    refused(bakery(*command, "--set", "steps=4"), "holds fits of another clip", tmp_path)
    assert (fits / "clip.npz").read_bytes() == before


@pytest.mark.parametrize(
    "changes",
    [
        {"starts": np.array([0, 40])},
        {"starts": np.array([3, 6])},
        {"faces": np.array([True])},
        {"seconds": np.zeros((2, 2))},
        {"starts": np.array(["a", "b"])},
    ],
)
def test_damaged_fits_are_refused(played, bundle, bakery, clip, tmp_path, changes):
    table = record.read_arrays(played[2] / "clip.npz")
    record.write_arrays(tmp_path / "clip.npz", table | changes)
    done = bakery("perform", bundle, clip, "-o", tmp_path / "a.mp4", "--fits", tmp_path)
    said = done.stderr.splitlines()[-1]
    assert done.returncode == 1 and "clip.npz" in said and "Traceback" not in done.stderr, said
    assert not (tmp_path / "a.mp4").exists()


def refused(done, message, folder):
    """One line after the note of consent, and nothing written."""
    assert done.returncode == 1 and "Traceback" not in done.stderr
    assert message in done.stderr.splitlines()[-1], done.stderr
    assert list(folder.glob("*.mp4")) == []


def test_a_clip_of_nobody(bundle, bakery, tmp_path):
    (tmp_path / "clip").mkdir()
    sky = film(tmp_path / "clip" / "sky.mp4", [np.full((*SIZE[::-1], 3), 150, np.uint8)] * 3)
    done = bakery("perform", bundle, sky, "-o", tmp_path / "a.mp4")
    refused(done, "sky.mp4: no face found", tmp_path)


def test_a_face_that_is_not_there(bundle, bakery, clip, tmp_path):
    done = bakery("perform", bundle, clip, "-o", tmp_path / "a.mp4", "--face", 3)
    refused(done, "has 1 face(s), no face 3", tmp_path)


def test_one_frame_is_enough(bundle, bakery, clip, tmp_path):
    (tmp_path / "clip").mkdir()
    picture = next(iter(Clip(clip).frames()))[1]
    short = film(tmp_path / "clip" / "short.mp4", [picture])
    done = bakery("perform", bundle, short, "-o", tmp_path / "a.mp4", "--size", 64)
    assert done.returncode == 0 and "1 frames" in done.stderr, done.stderr


def test_into_the_portrait(bundle, bakery, clip, tmp_path):
    """The shared bundle keeps its photo; what is written then has the photo's shape."""
    out = tmp_path / "a.mp4"
    command = ["perform", bundle, clip, "-o", out, "--over", "portrait", "--size", 120]
    done = bakery(*command, "--frames", "2:5", "--no-sound")
    assert done.returncode == 0, done.stderr
    assert [picture.shape for _, picture in Clip(out).frames()] == [(120, 100, 3)] * 3
