"""`bakery track` by its options: folders of frames, and what is refused."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from bakery.formats import video
from bakery.formats.image import write_image
from bakery.formats.video import Clip

SAMPLES = Path(__file__).resolve().parents[2] / "samples"
FRAMES = 6


@pytest.fixture(scope="module")
def clip(tmp_path_factory):
    """A painted portrait that drifts to the right: a film, and the folder of its frames as decoded."""
    folder = tmp_path_factory.mktemp("clip")
    picture = cv2.imread(str(SAMPLES / "anna.jpg"))
    small = cv2.resize(picture, (200, 250), interpolation=cv2.INTER_AREA)[..., ::-1]
    part = folder / "part.mp4"
    frames = (np.ascontiguousarray(np.roll(small, shift, 1)) for shift in range(FRAMES))
    part.write_bytes(video.encode(frames, ".mp4", 25.0))
    film = folder / "anna.mp4"
    video.join(film, [part], ".mp4", 25.0, (200, 250), video.Note("a", "b"))
    (folder / "frames").mkdir()
    for number, (_, frame) in enumerate(Clip(film).frames()):
        write_image(folder / "frames" / f"f.{number + 98}.png", frame)  # 98, 99, 100: by number
    return film, folder / "frames"


def test_a_folder_of_frames_is_the_film_of_them(bakery, clip, tmp_path):
    film, frames = clip
    done = bakery("track", film, "-o", tmp_path / "film.csv")
    assert done.returncode == 0, done.stderr
    done = bakery("track", frames, "--rate", "25", "-o", tmp_path / "frames.csv")
    assert done.returncode == 0, done.stderr
    assert f"{FRAMES} frames, 25 a second" in done.stderr
    assert (tmp_path / "frames.csv").read_bytes() == (tmp_path / "film.csv").read_bytes()


def test_what_is_refused_of_folders(bakery, clip, tmp_path):
    film, frames = clip
    (tmp_path / "empty").mkdir()
    out = ["-o", tmp_path / "x.csv"]
    for command, code, message in (
        ([frames], 2, "say how many make a second, as --rate 25"),
        ([film, "--rate", "25"], 2, "is no folder; a video says its own rate"),
        ([frames, "--rate", "0"], 2, "--rate"),
        ([tmp_path / "empty", "--rate", "25"], 1, "a folder without a PNG or JPEG"),
        ([tmp_path / "none", "--rate", "25"], 2, "is no folder"),
        ([film, "--set", "follow.bridge=-1"], 2, "follow.bridge"),
    ):
        done = bakery("track", *command, *out)
        assert done.returncode == code and message in done.stderr, (command, done.stderr)
        assert "Traceback" not in done.stderr and not (tmp_path / "x.csv").exists()
        assert code == 2 or len(done.stderr.splitlines()) == 1
