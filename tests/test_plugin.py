"""A package of plug-ins: each kind keeps to its contract, and bakery uses it by name."""

import json
import sys
from importlib.metadata import EntryPoint
from pathlib import Path

import cv2
import numpy as np
import pytest

from bakery import plugins, testing
from bakery.detectors.base import Detector
from bakery.errors import ModelError
from bakery.exporters.base import Exporter
from bakery.generators.base import Generator
from bakery.hair.base import Hair

HERE = Path(__file__).parent / "plugin"
FEW = Path(__file__).parent / "few.toml"
QUICK = ["--preset", "small", "--expressions", FEW, "--set", "texture.views=[0.0]"]


@pytest.fixture(scope="module")
def example():
    sys.path.insert(0, str(HERE))
    try:
        import bakery_example

        yield bakery_example
    finally:
        sys.path.remove(str(HERE))


def test_the_detector(example):
    testing.check_detector(example.MirrorDetector())


def test_the_detector_sees_the_mirror_image_mirrored(example):
    """The mean of both is symmetric by how it is made; the network by itself is not."""
    detector, network = example.MirrorDetector(), example.load()
    picture = np.round(testing.painted().photo.encoded * 255).astype(np.uint8)

    def apart(one):
        (face,) = one.detect(picture)
        (mirror,) = one.detect(np.ascontiguousarray(picture[:, ::-1]))
        points = mirror.points[detector.order] * [-1, 1] + [picture.shape[1], 0]
        return np.abs(points - face.points).max()

    assert apart(detector) < 1e-3 < apart(network)  # pixels; float32 of some hundred of them


def test_the_generator(example):
    testing.check_generator(example.StillGenerator())


def test_the_head(example):
    testing.check_head(example.large_head())


def test_the_hair(example):
    testing.check_hair(example.RedHair())


def test_the_exporter(example, avatar):

    testing.check_exporter(example.PointsExporter(), avatar)


def test_a_bake_with_all_of_them(bakery, process, portrait, installed, tmp_path):
    """By name, on the command line; the bundle says what made it, down to the version."""
    photo, marks = portrait
    out = tmp_path / "a.avatar"
    chosen = ["--generator", "still", "--hair", "red", "--head", "large"]
    chosen += ["--set", 'bundle.formats=["glb", "points"]', "--complete", "none"]
    done = process("build", photo, "--landmarks", marks, "-o", out, *QUICK, *chosen, env=installed)
    assert done.returncode == 0, done.stderr
    manifest = json.loads((out / "avatar.json").read_text())
    assert manifest["provenance"]["generator"] == "still" and manifest["head"]["name"] == "large"
    points = (out / "exports" / "points.obj").read_text().splitlines()
    assert manifest["extras"] == {"points": len(points)}
    assert [e["role"] for e in manifest["files"] if e["path"].startswith("exports/")] == ["other"]
    assert bakery("validate", out).returncode == 0  # without the package
    assert bakery("render", out, "-o", tmp_path / "a.png", "--size", 64).returncode == 0


def test_a_detector_by_name(process, installed, tmp_path):
    sample = Path(__file__).parents[1] / "samples" / "bela.jpg"
    done = process("detect", sample, "-o", "-", "--detector", "mirrored", env=installed)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["detector"]["name"] == "mirrored"
    assert json.loads(done.stdout)["detector"]["version"] == "1.2"


def test_a_clip_is_followed_by_a_detector_that_only_detects(process, installed, tmp_path):
    sample = cv2.imread(str(Path(__file__).parents[1] / "samples" / "bela.jpg"))
    small = cv2.resize(sample, None, fx=0.3, fy=0.3, interpolation=cv2.INTER_AREA)
    (tmp_path / "in").mkdir()
    for number in range(2):
        cv2.imwrite(str(tmp_path / "in" / f"{number}.png"), np.roll(small, number, 1))
    command = ["track", tmp_path / "in", "--rate", "25", "-o", tmp_path / "take.csv"]
    done = process(*command, "--detector", "mirrored", env=installed)
    assert done.returncode == 0, done.stderr
    assert "2 frames, 25 a second" in done.stderr and "without a face" not in done.stderr


def test_a_command(bakery, process, installed):
    assert process("greet", "ada", env=installed).stdout == "hello ada\n"
    listed = process("--help", env=installed).stdout
    assert "Commands of other packages" in listed and "See bakery-example." in listed
    asked = {"_BAKERY_COMPLETE": "zsh_complete", "COMP_WORDS": "bakery gr", "COMP_CWORD": "1"}
    assert process(env=installed | asked).stdout.split() == [
        "plain",
        "greet",
        "See",
        "bakery-example.",
    ]
    done = process("gret", env=installed)
    assert done.returncode == 2 and "Did you mean 'greet'?" in done.stderr
    assert bakery("greet").returncode == 2  # without the package


def test_a_plug_in_that_cannot_be_loaded_is_one_line(process, portrait, installed, tmp_path):
    done = process(
        "build", portrait[0], "-o", tmp_path / "a", "--generator", "broken", env=installed
    )
    assert done.returncode == 1 and len(done.stderr.splitlines()) == 1, done.stderr
    assert "generator 'broken' of bakery-example cannot be loaded" in done.stderr
    done = process("build", portrait[0], "-o", tmp_path / "a", "--generator", "stil", env=installed)
    assert done.returncode == 2 and "did you mean 'still'?" in done.stderr


@pytest.mark.parametrize("group", plugins.ASKED)
def test_what_is_asked_of_a_plug_in_is_its_protocol(group):
    kind = {"detectors": Detector, "generators": Generator, "hair": Hair, "exporters": Exporter}
    protocol = kind[group]
    methods = {name for name in vars(protocol) if not name.startswith("_")}
    assert set(plugins.ASKED[group]) == set(protocol.__annotations__) | methods


def test_a_plug_in_of_another_version_is_one_line(monkeypatch):
    class Old:
        """Hair as it was before it had volume."""

        name, sha256 = "old", ""
        layer = None

    monkeypatch.setattr(plugins, "loaded", lambda group, name: Old)
    entry = EntryPoint("old", "old_hair:Old", "bakery.hair")
    monkeypatch.setattr(plugins, "known", lambda group: {"old": entry})
    with pytest.raises(ModelError, match="^hair 'old' of an unknown package lacks mesh: "):
        plugins.plug_in("hair", "old")
