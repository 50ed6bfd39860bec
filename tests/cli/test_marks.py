"""Every file that commands write says that it is synthetic, and from which portrait; consent."""

import json
from pathlib import Path

import pytest

from bakery.formats import mark
from bakery.formats.files import digest_file
from bakery.types import EXPRESSIONS

COVERED = {".npz", ".json"}  # arrays and tables of a bundle: its manifest speaks for them
PREFIX = mark.IPTC + "composite"
SAMPLES = Path(__file__).parents[2] / "samples"


def unmarked(folder, photo):
    """The files of a folder that do not say what they are, or say it of another portrait."""
    wrong = []
    for path in sorted(Path(folder).rglob("*")):
        if path.is_dir() or path.suffix in COVERED or path.stem == "photo":
            continue
        said = mark.found(path)
        if said is None or not said.source_type.startswith(PREFIX) or said.photo != photo:
            wrong.append(path.name)
    return wrong


@pytest.fixture(scope="module")
def take(tmp_path_factory):
    path = tmp_path_factory.mktemp("take") / "take.csv"
    head = "Timecode,BlendShapeCount," + ",".join(EXPRESSIONS)
    rows = [f"00:00:00:0{2 * k}.000,52," + ",".join(["0.1"] * 52) for k in range(3)]
    path.write_text("\n".join([head, *rows]) + "\n")
    return path


def test_every_file_of_a_bundle_is_marked(bundle, portrait):
    assert unmarked(bundle, digest_file(portrait[0])) == []
    said = mark.found(bundle / "avatar.json")
    assert said is not None and said.photo == digest_file(portrait[0])
    assert mark.found(bundle / "photo.png") is None, "the portrait itself is not synthetic"


@pytest.mark.parametrize(
    "command",
    [
        *(["render", "BUNDLE", "-o", f"OUT/a.{kind}", "--size", "64"] for kind in ("png", "jpg", "webp", "exr")),
        ["recover", "BUNDLE", "jawOpen", "-o", "OUT/a.exr"],
        ["preview", "BUNDLE", "-o", "OUT/page.html"],
        *(["export", "BUNDLE", "--format", name, "-o", f"OUT/a.{kind}"] for name, kind in
          (("glb", "glb"), ("vrm", "vrm"), ("proxies", "glb"), ("preview", "png"))),
        pytest.param(["export", "BUNDLE", "--format", "glb-lit", "-o", "OUT/a.glb"], marks=pytest.mark.slow),
        *(["export", "BUNDLE", "--format", name, "-o", "OUT/files"] for name in ("textures", "web", "exr")),
    ],
    ids=lambda words: " ".join(words[:5]).replace("BUNDLE ", ""),
)  # fmt: skip
def test_every_file_that_a_command_writes_is_marked(command, bundle, portrait, bakery, tmp_path):
    words = [w.replace("OUT", str(tmp_path)) if w != "BUNDLE" else bundle for w in command]
    done = bakery(*words)
    assert done.returncode == 0, done.stderr
    assert any(path.is_file() for path in tmp_path.rglob("*"))
    assert unmarked(tmp_path, digest_file(portrait[0])) == []


@pytest.mark.parametrize("name", ["a.mp4", "a.webm", "frames/a.%04d.png"])
def test_films_and_frames_are_marked(name, bundle, take, bakery, tmp_path):
    (tmp_path / "frames").mkdir()
    done = bakery("animate", bundle, "--curves", take, "-o", tmp_path / name, "--size", "64")
    assert done.returncode == 0, done.stderr
    paths = [path for path in tmp_path.rglob("*") if path.is_file() and path.suffix != ".lock"]
    assert paths
    for path in paths:
        said = mark.found(path)
        assert said is not None and said.source_type.startswith(PREFIX), path.name


def test_inspect_shows_the_mark_of_a_file(bundle, bakery, tmp_path):
    done = bakery("inspect", bundle / "preview.png", "--json")
    said = json.loads(done.stdout)
    assert said["source type"].startswith(PREFIX) and len(said["made from"]) == 64
    assert "source type" in bakery("inspect", bundle / "face.exr").stdout
    (tmp_path / "a.txt").write_text("nothing")
    done = bakery("inspect", tmp_path / "a.txt")
    assert done.returncode == 0 and "none" in done.stdout


@pytest.mark.parametrize("given", ["", "a <b>", "x" * 20_000, "a\u202eb"])
def test_consent_that_no_manifest_may_hold_is_refused(given, portrait, bakery, tmp_path):
    done = bakery("build", portrait[0], "-o", tmp_path / "a.avatar", "--consent", given)
    assert done.returncode == 1 and done.stderr.count("\n") == 1, done.stderr
    assert not (tmp_path / "a.avatar").exists()


@pytest.mark.parametrize("path", sorted(SAMPLES.glob("*.jpg")), ids=lambda path: path.name)
def test_samples_are_marked_as_painted(path):
    said = mark.found(path)
    assert said is not None and said.source_type == mark.IPTC + "algorithmicMedia"
    assert said.photo == ""
