"""A baked bundle: whole, private, reproducible; every kind of damage is found."""

import json
import shutil

import numpy as np
import pytest

from bakery.export import bundle as bundles
from bakery.export.schema import seal
from bakery.export.validate import problems

SMALL = ["--preset", "small", "--set", "texture.mouths=3", "--set", "texture.views=[0.0]"]


@pytest.fixture
def copy(bundle, tmp_path):
    return shutil.copytree(bundle, tmp_path / "copy.avatar")


def test_it_is_whole(bundle, bakery):
    assert problems(bundle) == []
    done = bakery("validate", bundle, "--json")
    assert done.returncode == 0 and json.loads(done.stdout)["valid"]
    manifest = bundles.read_manifest(bundle)
    assert len(manifest["keys"]) == 6 and len(manifest["gaze"]["parts"]) == 20
    assert len(manifest["lods"]) == 4 and len(manifest["channels"]) == 52


def test_it_says_what_painted_it(bundle):
    """The default generator is a trained network; that of `rendered` stands in test_steps."""
    said = bundles.read_manifest(bundle)["provenance"]
    assert said["generator"] == "pagan"
    assert said["digitalSourceType"] == (
        "http://cv.iptc.org/newscodes/digitalsourcetype/compositeWithTrainedAlgorithmicMedia"
    )


def test_head_passes_khronos_validator(bundle):
    import subprocess
    from pathlib import Path

    validator = Path(__file__).resolve().parents[2] / "node_modules" / "gltf-validator"
    if not validator.exists():
        pytest.skip("needs `npm install gltf-validator` in the checkout")
    script = (
        "require(process.argv[1]).validateBytes(new Uint8Array(require('fs').readFileSync("
        "process.argv[2]))).then(r => console.log(r.issues.numErrors))"
    )
    done = subprocess.run(
        ["node", "-e", script, str(validator), str(bundle / "head.glb")],
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert done.stdout.strip() == "0"


def test_nothing_private_is_in_it(bundle, portrait):
    """No path, name of the photo, user or time; the text of every file is searched."""
    for path in bundle.rglob("*"):
        if path.is_file():
            data = path.read_bytes()
            for word in (b"painted.png", str(portrait[0].parent).encode(), b"Exif\0", b"DateTime"):
                assert word not in data, (path.name, word)


def test_avatar_comes_back(avatar):
    assert avatar.textures.neutral.shape == (512, 512, 3)
    assert avatar.masks.shape == (52, 256, 256)
    assert avatar.photo.shape == (480, 400, 3)
    assert np.isfinite(avatar.textures.neutral.astype(np.float32)).all()


def damage(name):
    def change(folder):
        path = folder / name
        data = bytearray(path.read_bytes())
        data[len(data) // 2] ^= 1
        path.write_bytes(data)

    return change


def edit(change):
    def apply(folder):
        manifest = json.loads((folder / "avatar.json").read_text())
        change(manifest)
        (folder / "avatar.json").write_bytes(seal(manifest))

    return apply


def link(folder):
    (folder / "face.exr").rename(folder.parent / "elsewhere.exr")
    (folder / "face.exr").symlink_to(folder.parent / "elsewhere.exr")


CASES = {
    "bit": (damage("mouth.exr"), "mouth.exr: its SHA-256"),
    "cut": (lambda f: (f / "head.glb").write_bytes(b"glTF"), "head.glb: 4 bytes"),
    "missing": (lambda f: (f / "masks.exr").unlink(), "masks.exr: missing"),
    "extra": (lambda f: (f / "web" / "virus.exe").touch(), "virus.exe'.*: not in the list"),
    "link": (link, "face.exr: a link"),
    "no manifest": (lambda f: (f / "avatar.json").unlink(), "it has no avatar.json"),
    "no json": (lambda f: (f / "avatar.json").write_text("{"), "avatar.json: not valid JSON"),
    "deep json": (lambda f: (f / "avatar.json").write_text("[" * 99999), "not valid JSON"),
    "no keys": (edit(lambda m: m.pop("keys")), "'keys' is a required property"),
    "traversal": (edit(lambda m: m["files"][0].update(path="../x")), "does not match"),
    "absolute": (edit(lambda m: m["files"][0].update(path="/etc/passwd")), "does not match"),
    "weight": (
        edit(lambda m: m["keys"][0]["weights"].update(jawOpen=3)),
        "greater than the maximum",
    ),
    "order": (edit(lambda m: m["expressions"].reverse()), "not the 52 ARKit names in order"),
    "gaze": (edit(lambda m: m["gaze"]["directions"].pop()), "directions differ"),
    "uv": (edit(lambda m: m["uv"].update(mouth_sheet=[0.9, 0, 0.5, 0.1])), "out of the atlas"),
    "part": (edit(lambda m: m["keys"][0].update(part="nose")), "lacks part 'nose'"),
    "camera": (edit(lambda m: m["fit"]["camera"].update(focal=-1)), "fit/camera/focal: "),
}


@pytest.mark.parametrize("case", CASES)
def test_damage_is_found(copy, case):
    import re

    change, message = CASES[case]
    change(copy)
    found = problems(copy)
    assert any(re.search(message, line) for line in found), found
    assert not any("\n" in line for line in found)


def test_validate_of_a_file_names_the_command_for_files(bundle, bakery):
    done = bakery("validate", bundle / "avatar.json")
    assert done.returncode == 1 and "is a file" in done.stderr and "inspect" in done.stderr
    assert len(done.stderr.splitlines()) == 1 and not done.stdout


def test_validate_and_readers_refuse_damage_in_one_line(copy, bakery, tmp_path):
    damage("face.exr")(copy)
    done = bakery("validate", copy)
    assert done.returncode == 1 and "SHA-256" in done.stdout and "problem" in done.stderr
    done = bakery("render", copy, "-o", tmp_path / "a.png")
    assert done.returncode == 1 and len(done.stderr.splitlines()) == 1
    assert not (tmp_path / "a.png").exists()
    for command in ("inspect", "validate", "render"):
        extra = ["-o", tmp_path / "a.png"] if command == "render" else []
        done = bakery(command, tmp_path / "nowhere", *extra)
        assert done.returncode == 1 and "Traceback" not in done.stderr


def test_what_file_managers_leave_behind_is_no_damage(copy):
    for name in (".DS_Store", "web/._avatar.json", "Thumbs.db", "web/desktop.ini"):
        (copy / name).write_bytes(b"x")
    assert problems(copy) == []
    others = ["DS_Store", "thumbs.exe", "web/.hidden", "desktop.ini.lnk", "a._b"]
    for name in others:
        (copy / name).write_bytes(b"x")
    assert sorted(line.split(":")[0] for line in problems(copy)) == sorted(map(repr, others))
    (copy / "._link").symlink_to(copy / "face.exr")
    assert any("'._link': a link" in line for line in problems(copy))


@pytest.mark.parametrize("what", ["missing", "pipe", "link", "folder", "changed"])
def test_inspect_of_a_bundle_without_its_texture(copy, bakery, what):
    import os

    face = copy / "face.exr"
    face.rename(copy.parent / "elsewhere.exr")
    if what == "pipe":
        os.mkfifo(face)
    elif what == "link":
        face.symlink_to(copy.parent / "elsewhere.exr")
    elif what == "folder":
        face.mkdir()
    elif what == "changed":
        face.write_bytes(b"")
    done = bakery("inspect", copy, timeout=60)
    assert done.returncode == 1 and done.stdout == ""
    assert len(done.stderr.splitlines()) == 1 and "face.exr: " in done.stderr


def test_inspect(bundle, bakery):
    table = json.loads(bakery("inspect", bundle, "--json").stdout)
    assert table["resolution"] == 512 and table["gaze"] == 20
    assert "coverage" in bakery("inspect", bundle).stdout


def test_render(bundle, bakery, tmp_path):
    import cv2

    fit = tmp_path / "fit.json"
    fit.write_text(json.dumps(bundles.read_manifest(bundle)["fit"]))  # as `bakery fit` writes it
    for options, size in (
        (
            ["--weights", "jawOpen=0.6,mouthSmileLeft=0.8", "--gaze", "10,-5", "--size", "96"],
            (96, 96),
        ),
        (["--view", "-30,10", "--size", "64", "--textures", "static"], (64, 64)),
        (["--view", "photo", "--mask", tmp_path / "m.png"], (480, 400)),
        (["--view", "photo", "--size", 240], (240, 200)),
        (["--fit", fit], (480, 400)),
    ):
        done = bakery("render", bundle, "-o", tmp_path / "a.png", "--overwrite", *options)
        assert done.returncode == 0, done.stderr
        assert cv2.imread(str(tmp_path / "a.png")).shape[:2] == size
    mask = cv2.imread(str(tmp_path / "m.png"), cv2.IMREAD_UNCHANGED)
    assert mask.shape == (480, 400) and 0.1 < (mask > 127).mean() < 0.8
    for wrong in (["--weights", "smile=1"], ["--weights", "jawOpen"], ["--weights", "jawOpen=9"],
                  ["--weights", "jawOpen=1,jawOpen=1"], ["--gaze", "left"], ["--gaze", "90,0"],
                  ["--gaze", "0,-60"], ["--view", "top"], ["--view", "200,0"]):  # fmt: skip
        done = bakery("render", bundle, "-o", tmp_path / "b.png", *wrong)
        assert done.returncode == 2 and len(done.stderr.splitlines()) == 1, done.stderr


def test_recover_single_expressions(bundle, bakery, tmp_path):
    """Where a shape does not act, its texture is the neutral one."""
    from bakery.formats import exr

    out = tmp_path / "facs.exr"
    done = bakery("recover", bundle, "jawOpen", "mouthSmileLeft", "-o", out)
    assert done.returncode == 0, done.stderr
    made = exr.read_exr(out)
    assert list(made) == ["jawOpen", "mouthSmileLeft"]
    neutral = exr.read_exr(bundle / "face.exr")["neutral"].astype(np.float32)
    for texture in made.values():
        same = np.abs(texture.astype(np.float32) - neutral).max(-1) < 2e-3
        assert 0.2 < same.mean() < 0.999
    done = bakery("recover", bundle, "smile", "-o", tmp_path / "b.exr")
    assert done.returncode == 2 and len(done.stderr.splitlines()) == 1
    assert bakery("recover", bundle, "-o", out).returncode == 1  # is already there
