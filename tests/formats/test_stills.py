"""Folders of numbered frames: order, times, and what is refused in one line."""

import numpy as np
import pytest

from bakery.errors import InputError
from bakery.formats.image import write_image
from bakery.formats.stills import Stills


def fill(folder, names, size=(100, 120)):
    folder.mkdir(exist_ok=True)
    for value, name in enumerate(names):
        write_image(folder / name, np.full((*size, 3), 10 * value, np.uint8))
    return folder


def test_frames_come_by_number_with_their_times(tmp_path):
    """Not by name: 9 before 10; the last number counts; what is no picture is passed over."""
    names = [f"shot2.{n}.png" for n in range(8, 13)]
    folder = fill(tmp_path, names)
    (folder / "notes.txt").write_text("none")
    (folder / ".shot2.99.png").write_text("hidden")
    (folder / "more").mkdir()
    clip = Stills(folder, 25)
    assert [path.name for path in clip.places] == names and clip.count == 5 and clip.rate == 25
    seen = list(clip.frames())
    np.testing.assert_allclose([seconds for seconds, _ in seen], np.arange(5) / 25)
    assert [int(picture[0, 0, 0]) for _, picture in seen] == [0, 10, 20, 30, 40]
    assert seen[0][1].shape == (100, 120, 3) and seen[0][1].dtype == np.uint8


def test_pixels_are_the_files(tmp_path):
    picture = np.random.default_rng(0).integers(0, 256, (96, 100, 3), np.uint8)
    write_image(tmp_path / "0001.png", picture)
    ((_, seen),) = Stills(tmp_path, 30).frames()
    np.testing.assert_array_equal(seen, picture)


@pytest.mark.parametrize(
    "names, message",
    [
        ([], "a folder without a PNG or JPEG"),
        (["a.1.png", "a.2.png", "a.5.png"], r"frame 3 is missing \(2 of 1 to 5 are\)"),
        (["a.1.png", "a.01.png"], "a.01.png and a.1.png are both frame 1"),
        (["a.1.png", "b.2.png"], "several kinds, such as a.1.png and b.2.png"),
        (["a.1.png", "a.2.jpg"], "several kinds, such as a.1.png and a.2.jpg"),
        (["a.1.png", "cover.png"], "cover.png: a picture without a number"),
    ],
)
def test_what_is_no_sequence(tmp_path, names, message):
    with pytest.raises(InputError, match=message) as caught:
        Stills(fill(tmp_path / "in", names), 25)
    assert "\n" not in str(caught.value) and str(tmp_path / "in") in str(caught.value)


def test_pictures_that_do_not_go_together(tmp_path):
    fill(tmp_path, ["a.1.png", "a.2.png"])
    fill(tmp_path, ["a.3.png"], (100, 130))
    with pytest.raises(InputError, match="a.3.png: 130x100 pixels, the frames before have 120x100"):
        list(Stills(tmp_path, 25).frames())
    (tmp_path / "a.2.png").write_bytes(b"x")
    with pytest.raises(InputError, match="a.2.png: not a picture"):
        list(Stills(tmp_path, 25).frames())


@pytest.mark.parametrize("rate", [0, -1, 2000, float("nan")])
def test_rates(tmp_path, rate):
    with pytest.raises(InputError, match="frames a second; needs 1 to 1000"):
        Stills(fill(tmp_path / "in", ["1.png"]), rate)
