"""`bakery track` by its options: folders of frames, and what is refused."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from bakery.formats import video
from bakery.formats.image import write_image
from bakery.formats.livelink import read_take
from bakery.formats.video import Clip
from bakery.motion.fits import read_fits

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


def test_fits_beside_the_take(bakery, clip, tmp_path, head):
    """One row a frame; nothing replaced unasked, nothing written of a take that is refused."""
    film, _ = clip
    fits = tmp_path / "fits"
    command = ["track", film, "-o", tmp_path / "take.csv", "--fits", fits, "--gain", "0.5"]
    done = bakery(*command)
    assert done.returncode == 0 and f"wrote {fits}" in done.stderr, done.stderr
    assert sorted(path.name for path in fits.iterdir()) == ["frames.npz", "identity.npz"]
    read, take = read_fits(fits), read_take(tmp_path / "take.csv")
    assert len(read.seconds) == len(take.seconds) == FRAMES and read.found.all()
    assert (read.size == (200, 250)).all() and read.head == "makehuman"
    # It drifts by a pixel a frame; the fit of each frame goes with it.
    places = [read.fit(number, head).landmarks_projected.mean(0) for number in range(FRAMES)]
    drift = np.diff(np.array(places)[:, 0])
    assert abs(drift.mean() - 1) < 0.15
    (tmp_path / "take.csv").unlink()
    done = bakery(*command)
    assert done.returncode == 1 and "holds files already" in done.stderr
    assert len(done.stderr.splitlines()) == 1 and not (tmp_path / "take.csv").exists()
    done = bakery(*command[:4], "--fits", tmp_path / "new", "--neutral", "99")
    assert done.returncode == 1 and not (tmp_path / "new").exists()
    assert not (tmp_path / "take.csv").exists()


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
