"""`bakery perform --over CLIP2`: the face in other footage, and what is refused."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from bakery.formats import video
from bakery.formats.video import Clip

SAMPLES = Path(__file__).resolve().parents[2] / "samples"
SIZE = 240, 300


def film(path, pictures, rate=25.0):
    path.parent.mkdir(exist_ok=True)
    part = path.with_name("part.mp4")
    pictures = [np.ascontiguousarray(picture) for picture in pictures]
    part.write_bytes(video.encode(iter(pictures), ".mp4", rate))
    size = pictures[0].shape[1::-1]
    video.join(path, [part], ".mp4", rate, size, video.Note("a", "b"))
    part.unlink()
    return path


def person(name, count):
    picture = cv2.imread(str(SAMPLES / f"{name}.jpg"))
    small = cv2.resize(picture, SIZE, interpolation=cv2.INTER_AREA)[..., ::-1]
    return [np.roll(small, shift, 1) for shift in range(count)]


@pytest.fixture(scope="module")
def clip(tmp_path_factory):
    return film(tmp_path_factory.mktemp("clip") / "acted.mp4", person("anna", 6))


@pytest.fixture(scope="module")
def footage(clip):
    """Somebody else, a wall, at 50 frames a second: 8 and 4 frames."""
    wall = np.full((*SIZE[::-1], 3), 150, np.uint8)
    return film(clip.with_name("footage.mp4"), person("dalia", 8) + [wall] * 4, 50.0)


@pytest.fixture(scope="module")
def fits(clip):
    return clip.with_name("fits")


def frames(path):
    return np.array([picture for _, picture in Clip(path).frames()], float)


def test_the_face_alone_is_changed(bundle, bakery, clip, footage, fits, tmp_path):
    out = tmp_path / "out.mp4"
    done = bakery("perform", bundle, clip, "-o", out, "--over", footage, "--fits", fits)
    assert done.returncode == 0, done.stderr
    assert "footage.mp4: shot 2 begins at frame 8" in done.stderr
    made, source = frames(out), frames(footage)
    assert made.shape[1:] == source.shape[1:] and Clip(out).rate == pytest.approx(50)
    assert len(made) == 12  # the clip lasts 0.24 s as well
    apart = np.abs(made - source).mean(-1)
    assert apart[8:].mean() < 3  # nobody is there; the codec changes a little
    assert apart[:8, :40].mean() < 3  # nor is hair on top
    height, width = apart.shape[1:]
    face = apart[:8, height // 3 : 3 * height // 4, width // 3 : 2 * width // 3]
    assert face.mean() > 6
    assert b"put into other footage" in out.read_bytes()


def test_frames_are_those_of_the_whole_and_vertical_sizes_even(
    bundle, bakery, clip, footage, fits, tmp_path
):
    films = {}
    for some in ("0:4", "1:3"):
        out = tmp_path / "a.mp4"
        command = ["perform", bundle, clip, "-o", out, "--over", footage, "--fits", fits]
        done = bakery(*command, "--frames", some, "--size", 202, "--overwrite")
        assert done.returncode == 0, done.stderr
        films[some] = frames(out)
    assert films["0:4"].shape == (4, 202, 162, 3)
    assert np.abs(films["0:4"][1:3] - films["1:3"]).mean() < 2  # they are encoded anew


def refused(done, message, folder):
    assert done.returncode != 0 and "Traceback" not in done.stderr
    assert message in done.stderr.splitlines()[-1], done.stderr
    assert list(folder.glob("*.mp4")) == []


def test_footage_of_nobody(bundle, bakery, clip, fits, tmp_path):
    sky = film(tmp_path / "clip" / "sky.mp4", [np.full((*SIZE[::-1], 3), 150, np.uint8)] * 3)
    done = bakery("perform", bundle, clip, "-o", tmp_path / "a.mp4", "--over", sky)
    refused(done, "sky.mp4: no face found", tmp_path)


def test_a_face_that_is_not_there(bundle, bakery, clip, footage, tmp_path):
    command = ["perform", bundle, clip, "-o", tmp_path / "a.mp4", "--over", footage]
    done = bakery(*command, "--over-face", 2)
    refused(done, "give a lower --over-face", tmp_path)
    done = bakery("perform", bundle, clip, "-o", tmp_path / "a.mp4", "--over-face", 2)
    refused(done, "--over-face: names a face of --over CLIP2", tmp_path)


def test_footage_that_is_not_there(bundle, bakery, clip, tmp_path):
    command = ["perform", bundle, clip, "-o", tmp_path / "a.mp4", "--over", tmp_path / "no.mp4"]
    refused(bakery(*command), "no.mp4: no such file", tmp_path)
