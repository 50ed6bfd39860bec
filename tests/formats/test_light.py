"""Lights from names and files: what they are, and what is refused."""

import json
import tomllib

import numpy as np
import OpenImageIO as oiio
import pytest
from numpy.testing import assert_allclose

from bakery import preset
from bakery.errors import InputError
from bakery.formats import record
from bakery.formats.light import KIND, read_light
from bakery.geometry import harmonics, rotation
from bakery.geometry.color import LUMA


def directions(count=200, seed=0):
    out = np.random.default_rng(seed).normal(size=(count, 3))
    return out / np.linalg.norm(out, axis=1, keepdims=True)


def write_map(path, picture, channels=("R", "G", "B"), packing="piz", kind="float"):
    """An OpenEXR file as other programs write it."""
    spec = oiio.ImageSpec(picture.shape[1], picture.shape[0], len(channels), kind)
    spec.channelnames = channels
    spec.attribute("compression", packing)
    file = oiio.ImageOutput.create(str(path))
    file.open(str(path), spec)
    file.write_image(np.ascontiguousarray(picture, np.float32))
    file.close()


def test_a_constant_map_gives_constant_irradiance():
    light = harmonics.of_map(np.full((16, 32, 3), [0.2, 0.5, 0.9]))
    seen = harmonics.irradiance(directions(), light)
    # 16 rows stand for the sphere: second-order sums over them are off by a few thousandths.
    assert_allclose(seen, np.broadcast_to([0.2, 0.5, 0.9], seen.shape), rtol=6e-3)


@pytest.mark.parametrize(
    "row, column, toward",
    [(0, 5, [0, 1, 0]), (32, 64, [0, 0, 1]), (32, 96, [-1, 0, 0]), (32, 32, [1, 0, 0])],
)
def test_a_spot_of_a_map_is_a_lamp_there(row, column, toward):
    """Up is the top row, ahead the middle, the subject's right (-x) is to the right of it."""
    picture = np.zeros((64, 128, 3))
    picture[row, column] = 1
    found, lamp = harmonics.of_map(picture), harmonics.lamp(np.array(toward, float), np.ones(3))
    assert_allclose(found / found[0, 0], lamp / lamp[0, 0], atol=0.1)  # half a pixel is 1.4 degrees


def test_a_lamp_gives_a_facing_surface_its_colour():
    """Second order keeps 17/16 of a point's irradiance there (Ramamoorthi and Hanrahan 2001)."""
    toward = harmonics.direction(30, 20)
    seen = harmonics.irradiance(toward, harmonics.lamp(toward, np.array([0.3, 0.6, 0.9])))
    assert_allclose(seen, np.array([0.3, 0.6, 0.9]) * 17 / 16, rtol=1e-5)


@pytest.mark.parametrize("name", preset.names(KIND))
def test_presets_have_the_mean_that_they_ask_for_and_no_hole(name):
    light = read_light(name)
    stops = preset.load(KIND, name).get("exposure", 0)
    seen = harmonics.irradiance(directions(4000), light) @ LUMA
    assert seen.mean() == pytest.approx(2**stops, rel=0.05)  # of 4,000 random directions
    assert seen.min() > 0.05 * 2**stops


def test_neutral_is_white_from_everywhere():
    assert_allclose(harmonics.irradiance(directions(), read_light("neutral")), 1, rtol=1e-5)


def test_27_numbers_come_back_with_the_mean_1(tmp_path):
    rows = np.random.default_rng(1).normal(size=(9, 3)) * 0.2
    rows[0] += 3
    file = tmp_path / "light.json"
    file.write_text(json.dumps({"light": rows.tolist(), "exposure": 1}))
    found = read_light(str(file))
    assert_allclose(found / found[0, 0], rows / rows[0, 0], rtol=1e-9)
    assert harmonics.C0 * found[0] @ LUMA == pytest.approx(2, rel=1e-6)


def test_the_light_of_a_fit_turns_with_its_head(tmp_path, portrait, bakery):
    """It is stored relative to the camera, and read relative to the head."""
    photo, marks = portrait
    file = tmp_path / "fit.json"
    assert bakery("fit", photo, "--landmarks", marks, "-o", file).returncode == 0
    table = json.loads(file.read_text())
    table["camera"]["rotation"] = [0.1, 0.6, -0.05]
    file.write_text(json.dumps(table))
    fit, found = record.read_fit(file), read_light(str(file))
    turn = rotation.matrix(fit.camera.rotation)
    ours = harmonics.irradiance(directions(), found)
    theirs = harmonics.irradiance(directions() @ turn.T, fit.light)
    assert_allclose(ours / ours.mean(), theirs / theirs.mean(), rtol=1e-4, atol=1e-5)


@pytest.mark.parametrize("packing, kind", [("piz", "float"), ("zip", "half"), ("none", "float")])
def test_a_map_of_any_packing_is_read(tmp_path, packing, kind):
    picture = np.full((8, 16, 4), 0.25)
    picture[:, 8:, 0] = 0.5  # the subject's right is red
    write_map(tmp_path / "map.exr", picture, ("R", "G", "B", "A"), packing, kind)
    red, blue = harmonics.irradiance(np.array([[-1.0, 0, 0], [1, 0, 0]]), read_light(str(tmp_path / "map.exr")))[:, [0, 2]].T  # fmt: skip
    assert red[0] > 1.5 * red[1] and blue[0] == pytest.approx(blue[1], rel=1e-3)


SKY = "sky = [1, 1, 1]\nground = [1, 1, 1]\n"


@pytest.mark.parametrize(
    "name, text, words",
    [
        ("a.json", '{"light": [[1, 2, 3]]}', ("light", "nine rows")),
        ("a.json", '{"lamp": 1}', ("light", "nine rows")),
        ("a.json", json.dumps({"light": [[-1] * 3] * 9}), ("no light", "black")),
        ("a.json", json.dumps({"light": [[1e9] * 3] * 9}), ("light", "at most")),
        ("a.json", '{"light": [[NaN, 1, 1], 2]}', ("a.json",)),
        ("a.toml", "sky = [1, 1, 1]\n", ("ground", "three numbers")),
        ("a.toml", SKY + "lamps = 3\n", ("lamps",)),
        ("a.toml", SKY + "[[lamps]]\nazimuth = 3\n", ("elevation", "a number")),
        ("a.toml", SKY + "exposure = 99\n", ("exposure", "stops")),
        ("a.toml", SKY + "moon = 1\n", ("moon", "lamps")),
        ("a.toml", "sky = [0, 0, 0]\nground = [0, 0, 0]\n", ("black",)),
        ("a.exr", "no picture", ("a.exr", "OpenEXR")),
    ],
)
def test_a_file_that_is_no_light_is_refused(tmp_path, name, text, words):
    (tmp_path / name).write_text(text)
    with pytest.raises(InputError) as error:
        read_light(str(tmp_path / name))
    assert "\n" not in str(error.value) and all(word in str(error.value) for word in words)


@pytest.mark.parametrize(
    "picture, channels, word",
    [
        (np.ones((8, 8, 3)), ("R", "G", "B"), "twice as wide"),
        (np.ones((8, 16, 1)), ("Y",), "R, G and B"),
        (np.full((8, 16, 3), np.nan), ("R", "G", "B"), "no light has"),
        (np.full((8, 16, 3), -1.0), ("R", "G", "B"), "no light has"),
        (np.zeros((8, 16, 3)), ("R", "G", "B"), "black"),
    ],
)
def test_a_picture_that_is_no_map_is_refused(tmp_path, picture, channels, word):
    write_map(tmp_path / "a.exr", picture, channels)
    with pytest.raises(InputError, match=word):
        read_light(str(tmp_path / "a.exr"))


def test_an_unknown_name_lists_the_lights():
    with pytest.raises(InputError, match="did you mean 'sunset'"):
        read_light("sunste")


def test_the_command_refuses_in_one_line(bundle, bakery, tmp_path):
    done = bakery("render", bundle, "-o", tmp_path / "a.png", "--light", "moon")
    assert done.returncode == 2 and "moon" in done.stderr and "Traceback" not in done.stderr
    options = ["--light", "rim", "--background", "photo", "--view", "photo"]
    done = bakery("render", bundle, "-o", tmp_path / "a.png", *options)
    assert done.returncode == 1 and "its own light" in done.stderr


def test_preset_files_say_what_they_are():
    for name in preset.names(KIND):
        assert preset.about(KIND, name) and tomllib.loads(
            preset.find(f"{KIND}/{name}.toml").read_text()
        )
