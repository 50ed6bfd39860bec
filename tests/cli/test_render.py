"""`bakery render`: framing, alpha, OpenEXR, sequences, named expressions, what it refuses."""

import os
from dataclasses import replace

import cv2
import numpy as np
import pytest
from numpy.testing import assert_allclose

from bakery.errors import InputError
from bakery.formats import exr
from bakery.formats.targets import expression_weights
from bakery.geometry.color import to_encoded, to_linear
from bakery.runtime.render import Frame
from bakery.show import frame as frames
from bakery.types import EXPRESSION_INDEX


def scene(**wanted):
    return frames.Scene(**frames.parse(**{"size": 96} | wanted))


def opaque(picture):
    """[H, W] bool of a picture before pure green: where the head is."""
    return np.abs(picture - [0, 1, 0]).max(-1) > 0.02


@pytest.mark.parametrize("view", ["front", "40,0", "90,0", "180,0", "-120,30"])
def test_the_head_is_whole_in_every_view(avatar, view):
    """Only the neck meets an edge, and that is the lower one."""
    head = opaque(frames.render(avatar, scene(view=view, background="#00ff00"))[0])
    assert not head[0].any() and head.any(0)[10:-10].any()
    upper = head[: 2 * len(head) // 3]
    assert not upper[:, 0].any() and not upper[:, -1].any()
    face = opaque(
        frames.render(avatar, scene(view="90,0", framing="face", background="#00ff00"))[0]
    )
    assert face[:, 0].any(), "framed as a face, the back of the head is outside"


def test_alpha_is_straight_and_the_picture_before_gray_is_the_same(avatar):
    clear = frames.render(avatar, scene(view="30,0", background="none"))[0]
    gray = frames.render(avatar, scene(view="30,0"))[0]
    assert clear.shape == (96, 96, 4) and gray.shape == (96, 96, 3)
    alpha = clear[..., 3:]
    assert alpha[0, 0] == 0 and alpha[48, 48] == 1 and ((alpha > 0) & (alpha < 1)).any()
    laid = to_linear(clear[..., :3]) * alpha + 0.18 * (1 - alpha)
    assert_allclose(to_encoded(laid), gray, atol=1e-4)


def test_the_head_has_no_holes():
    """What is seen between an eye's cap and its lid is gray; the world around stays clear."""
    alpha = np.zeros((40, 40), np.float32)
    alpha[10:, 10:30] = 1
    alpha[20:23, 15:18] = [[0, 0.5, 0]] * 3
    color = np.full((40, 40, 3), 0.4, np.float32) * alpha[..., None]
    clear = frames._clear(Frame(color, alpha, alpha))
    assert (clear[10:, 10:30, 3] == 1).all() and clear[..., 3].sum() == 30 * 20
    assert_allclose(clear[20, 15], [0.18, 0.18, 0.18, 1])
    assert_allclose(clear[20, 16], [0.29, 0.29, 0.29, 1])


def test_exr_is_linear_and_premultiplied(avatar, tmp_path):
    wanted = frames.output_scene(tmp_path / "a.exr", scene())
    picture, _ = frames.draw_scene(avatar, wanted)
    frames.write(tmp_path / "a.exr", picture)
    (found,) = exr.read_exr(tmp_path / "a.exr").values()
    assert found.shape == (96, 96, 4) and found.dtype == np.float16
    color, alpha = found[..., :3].astype(np.float32), found[..., 3:].astype(np.float32)
    over = color + (1 - alpha) * 0.18
    assert_allclose(to_encoded(over), frames.render(avatar, scene())[0], atol=2e-3)  # half floats
    assert not color[alpha[..., 0] == 0].any()


def test_colour_behind_the_head(avatar):
    picture = frames.render(avatar, scene(background="#1e90ff"))[0]
    assert_allclose(picture[0, 0] * 255, [0x1E, 0x90, 0xFF], atol=0.1)


def test_photo_behind_the_head_only_in_its_own_view(avatar):
    own = frames.render(avatar, scene(view="photo", size=None))[0]
    named = frames.render(avatar, scene(view="photo", size=None, background="photo"))[0]
    assert_allclose(own, named)
    assert frames.render(avatar, scene(view="photo", background="none"))[0].shape[2] == 4
    with pytest.raises(InputError, match="--keep-photo"):
        frames.render(replace(avatar, photo=None), scene(view="photo", background="photo"))


@pytest.mark.parametrize("size", [17, 101, 200])
def test_size_is_exact(avatar, size):
    for view in ("front", "40,0"):
        assert frames.render(avatar, scene(view=view, size=size))[0].shape[:2] == (size, size)
    assert max(frames.render(avatar, scene(view="photo", size=size))[0].shape) == size


def test_named_expressions():
    laugh = expression_weights("laugh")
    assert laugh[EXPRESSION_INDEX["mouthSmileLeft"]] == np.float32(0.9)
    assert_allclose(expression_weights("laugh=0.5"), laugh / 2, atol=1e-7)
    both = expression_weights("laugh=0.5, wink")
    assert_allclose(both, np.minimum(laugh / 2 + expression_weights("wink"), 1), atol=1e-7)
    for wrong in ("giggle", "laugh=", "laugh=2", "laugh=nan", "laugh=a"):
        with pytest.raises(
            InputError, match="no expression 'giggle'|0 to 1|NAME=|strength|=VALUE|give"
        ):
            expression_weights(wrong)


def test_weights_win_over_a_named_expression():
    asked = frames.parse(expression="laugh=0.5", weights="jawOpen=0.9,mouthSmileLeft=0")
    wanted = expression_weights("laugh=0.5")
    wanted[EXPRESSION_INDEX["jawOpen"]], wanted[EXPRESSION_INDEX["mouthSmileLeft"]] = 0.9, 0
    assert_allclose(asked["expression"], wanted, atol=1e-7)


@pytest.mark.parametrize(
    "options, message",
    [
        ({"gaze": "90,0"}, "35 degrees aside and 30 up"),
        ({"gaze": "0,31"}, "35 degrees aside and 30 up"),
        ({"background": "pink"}, "#1e90ff"),
        ({"background": "#12345"}, "#1e90ff"),
        ({"background": "photo"}, "--view photo"),
        ({"expression": "giggle"}, "no expression 'giggle'; known: smile"),
    ],
)
def test_what_cannot_be_drawn(options, message):
    with pytest.raises(InputError, match=message):
        frames.parse(**options)


def test_endings(tmp_path):
    for name, background in (("a.tif", None), ("a", None), ("a.jpg", "none")):
        with pytest.raises(InputError, match=name):
            frames.output_scene(tmp_path / name, scene(background=background))


def test_turntable(bundle, bakery, avatar, tmp_path):
    """A sequence of N pictures, the first from the front, each a further step around the head."""
    ask = ["render", bundle, "-o", tmp_path / "a.png", "--size", "64", "--turntable", "4"]
    done = bakery(*ask, "--mask", tmp_path / "m.png", "--background", "none")
    assert done.returncode == 0, done.stderr
    names = [f"{stem}.{number:03d}.png" for stem in "am" for number in range(4)]
    assert sorted(os.listdir(tmp_path)) == names
    for number, yaw in enumerate((0, 90, 180, 270)):
        found = cv2.imread(str(tmp_path / names[number]), cv2.IMREAD_UNCHANGED)
        wanted = frames.render(
            avatar, scene(view=f"{(yaw + 180) % 360 - 180},0", size=64, background="none")
        )[0]
        assert found.shape == (64, 64, 4)
        assert np.abs(found[..., 3] / 255 - wanted[..., 3]).mean() < 0.003
    again = bakery(*ask)
    assert again.returncode == 1 and "--overwrite" in again.stderr
    assert bakery(*ask, "--overwrite", "--view", "photo").returncode == 1


def test_an_older_file_is_kept(bundle, bakery, tmp_path):
    (tmp_path / "photo.jpg").write_bytes(b"mine")
    done = bakery("render", bundle, "-o", tmp_path / "photo.jpg")
    assert done.returncode == 1 and "--overwrite" in done.stderr
    assert (tmp_path / "photo.jpg").read_bytes() == b"mine"
    done = bakery("render", bundle, "-o", tmp_path / "x.png", "--mask", tmp_path / "x.png")
    assert done.returncode == 2 and not (tmp_path / "x.png").exists()
