"""Bundles of other versions: older ones play, newer ones of 1.x are read as far as they are known."""

import json
import shutil
from pathlib import Path

import numpy as np
import pygltflib
import pytest

from bakery.errors import BundleError
from bakery.export import bundle as bundles
from bakery.export.manifest import ingredient_table
from bakery.export.open import open_avatar
from bakery.export.schema import seal
from bakery.export.validate import examine, problems
from bakery.formats.files import digest
from bakery.show.page import page
from bakery.types import EXPRESSIONS, Ingredient


def change(folder, alter):
    """Alter the manifest as another program would that knows of its digest."""
    path = folder / "avatar.json"
    manifest = json.loads(path.read_text())
    alter(manifest)
    path.write_bytes(seal(manifest))


def add_file(folder, name, data, role):
    """Put one more file into a bundle."""
    (folder / name).write_bytes(data)
    entry = {"path": name, "role": role, "bytes": len(data), "sha256": digest(data)}
    change(folder, lambda manifest: manifest["files"].append(entry))


def test_a_1_0_bundle_is_whole(old_bundle):
    assert problems(old_bundle) == []
    assert json.loads((old_bundle / "avatar.json").read_text())["asset"]["version"] == "1.0"


def test_a_1_0_bundle_holds_the_same_avatar(old_bundle, avatar):
    old, new = open_avatar(old_bundle), avatar
    for name in ("neutral", "keys", "source", "facing", "hair", "gaze", "mouths", "mouth_weights"):
        a, b = getattr(old.textures, name), getattr(new.textures, name)
        assert a.dtype == b.dtype and np.array_equal(a, b), name
    assert np.array_equal(old.masks, new.masks) and np.array_equal(old.neutral, new.neutral)
    assert np.array_equal(old.photo, new.photo)
    assert not len(old.textures.albedo) and len(new.textures.albedo) == 512


def test_a_1_0_bundle_works_with_every_command(old_bundle, bakery, tmp_path):
    take = tmp_path / "take.csv"
    head = "Timecode,BlendShapeCount," + ",".join(EXPRESSIONS)
    rows = [f"00:00:00:0{2 * k}.000,52," + ",".join(["0.1"] * 52) for k in range(3)]
    take.write_text("\n".join([head, *rows]) + "\n")
    for command in (
        ["validate", old_bundle],
        ["inspect", old_bundle],
        ["render", old_bundle, "-o", tmp_path / "a.png", "--size", "64"],
        ["render", old_bundle, "-o", tmp_path / "b.png", "--size", "64", "--light", "rim"],
        ["preview", old_bundle, "-o", tmp_path / "a.html"],
        ["preview", old_bundle, "--module", tmp_path / "site"],
        ["animate", old_bundle, "--curves", take, "-o", tmp_path / "a.mp4", "--size", "64"],
    ):
        done = bakery(*command)
        assert done.returncode == 0, (command, done.stderr)
    assert 'id="file:head.glb"' in (tmp_path / "a.html").read_text()
    assert (tmp_path / "site" / "web" / "head.glb").exists()


def test_a_page_names_the_private_head(bundle):
    """web/player.glb is for our player alone; the description says where it is."""
    text = page(bundle).decode()
    assert 'id="file:player.glb"' in text and "head.glb" not in json.dumps(
        json.loads((bundle / "web" / "avatar.json").read_text())
    )


def newer(manifest):
    """What version 1.9 may add: properties anywhere, roles of files."""
    manifest["asset"]["version"] = "1.9"
    manifest["strands"] = {"file": "strands.abc"}
    manifest["keys"][0]["emotion"] = "joy"
    manifest["fit"]["camera"]["distortion"] = [0.1]
    manifest["masks"]["falloff"] = 2


def test_a_newer_minor_version_is_read(copy, bakery, tmp_path):
    change(copy, newer)
    add_file(copy, "strands.abc", b"Ogawa", "strands")
    report = examine(copy)
    assert report.problems == []
    for word in ("strands", "emotion", "distortion", "falloff"):
        assert any(word in line for line in report.notes), (word, report.notes)
    assert open_avatar(copy).textures.neutral.shape == (512, 512, 3)
    done = bakery("validate", copy)
    assert done.returncode == 0 and "note: avatar.json: " in done.stdout
    assert b'id="description"' in page(copy)


def test_the_same_in_our_own_version_is_wrong(copy):
    change(copy, newer)
    change(copy, lambda manifest: manifest["asset"].update(version="1.1"))
    found = examine(copy)
    assert found.notes == []
    for word in ("strands", "emotion", "distortion", "falloff"):
        assert any(word in line for line in found.problems), (word, found.problems)


def test_what_is_known_is_checked_in_a_newer_version_too(copy):
    change(copy, newer)
    change(copy, lambda manifest: manifest["keys"][0]["weights"].update(jawOpen=3))
    assert any("greater than the maximum" in line for line in problems(copy))


@pytest.mark.parametrize("version", ["2.0", "0.9", "10.1"])
def test_another_major_version_is_refused_in_one_line(copy, version, bakery, tmp_path):
    change(copy, lambda manifest: manifest["asset"].update(version=version))
    for command in (
        ["validate", copy],
        ["inspect", copy],
        ["render", copy, "-o", tmp_path / "a.png"],
        ["preview", copy, "-o", tmp_path / "a.html"],
    ):
        done = bakery(*command)
        assert done.returncode == 1 and len(done.stderr.splitlines()) == 1, done.stderr
        assert f"version {version}; 1.x is read here" in done.stdout + done.stderr
    assert not list(tmp_path.glob("a.*"))


@pytest.mark.parametrize("version", ["1", "one", "", None, 1.1, ["1.1"], "1.-1", "1.1.1"])
def test_what_is_no_version_is_refused(copy, version):
    change(copy, lambda manifest: manifest["asset"].update(version=version))
    assert len(problems(copy)) >= 1
    with pytest.raises(BundleError):
        bundles.read_manifest(copy)


def test_extras_and_extensions_are_left_alone(copy):
    """Of any program: in the manifest's tables, and files that a player need not understand."""

    def alter(manifest):
        manifest["extras"] = {"anything": [1, {"deep": None}]}
        manifest["extensionsUsed"] = ["ACME_hair"]
        for table in (
            manifest["asset"], manifest["keys"][0], manifest["gaze"], manifest["mouths"],
            manifest["masks"], manifest["coverage"], manifest["hair"], manifest["lods"][0],
            manifest["head"], manifest["fit"], manifest["fit"]["camera"], manifest["provenance"],
            manifest["provenance"]["input"], manifest["files"][0], manifest["web"]["neutral"],
            manifest["channels"]["jawOpen"],
        ):  # fmt: skip
            table["extras"] = {"note": "mine"}
            table["extensions"] = {"ACME_hair": {"strands": 3}}

    change(copy, alter)
    add_file(copy, "hair.usd.exr", b"not one of ours", "other")
    report = examine(copy)
    assert report.problems == [] and report.notes == []
    assert open_avatar(copy).masks.shape == (52, 256, 256)


def test_an_extension_that_is_required_is_refused(copy):
    change(copy, lambda manifest: manifest.update(extensionsRequired=["ACME_hair"]))
    (found,) = problems(copy)
    assert "needs extensions that are not known here: ACME_hair" in found


MISTAKES = {
    "misspelt weight": lambda m: m["keys"][0]["weights"].update(jawOpne=0.5),
    "misspelt weight of a mouth": lambda m: m["mouths"]["weights"][0].update(mouthOpen=0.5),
    "misspelt weight of the fit": lambda m: m["fit"]["expression"].update(smile=0.5),
    "misspelt mask": lambda m: m["masks"]["channels"].update(
        jawOpne=m["masks"]["channels"].pop("jawOpen")
    ),
    "misspelt channel": lambda m: m["channels"].update(jawOpne=m["channels"].pop("jawOpen")),
    "misspelt expression": lambda m: m["expressions"].__setitem__(0, "browDown"),
    "short light": lambda m: m["fit"]["light"].pop(),
    "flat residual": lambda m: m["fit"]["residual"][0].pop(),
    "short landmarks": lambda m: m["fit"]["landmarks_projected"].pop(),
    "text as gaze": lambda m: m["fit"].update(gaze="left"),
    "no camera": lambda m: m["fit"].pop("camera"),
    "foreign source type": lambda m: m["provenance"].update(digitalSourceType="http://x.org/a"),
    "odd extension": lambda m: m.update(extensions={"hair": {}}),
    "flat extras": lambda m: m.update(extras=5),
    "no digest": lambda m: m.pop("sha256"),
    "too many mouths for the parts": lambda m: m["mouths"].update(columns=1, rows=1),
    "too few mouths for the parts": lambda m: m["mouths"]["parts"].append("mouths900_901"),
}


@pytest.mark.parametrize("case", MISTAKES)
def test_mistakes_are_found(copy, case):
    if case == "no digest":
        manifest = json.loads((copy / "avatar.json").read_text())
        del manifest["sha256"]
        (copy / "avatar.json").write_text(json.dumps(manifest))
    else:
        change(copy, MISTAKES[case])
    found = problems(copy)
    assert found and not any("\n" in line for line in found)


@pytest.mark.parametrize("kind", ["trainedAlgorithmicMedia", "digitalCapture", "print"])
def test_any_source_type_of_iptc_will_do(copy, kind):
    source = f"http://cv.iptc.org/newscodes/digitalsourcetype/{kind}"
    change(copy, lambda manifest: manifest["provenance"].update(digitalSourceType=source))
    assert problems(copy) == []


def test_ingredients_of_a_portrait_stand_in_the_manifest(copy):
    """As a photo with marks of its own makes them; see tests/formats/test_jumbf.py."""
    ai = "http://cv.iptc.org/newscodes/digitalsourcetype/trainedAlgorithmicMedia"
    whole = Ingredient(
        "a" * 64, ai, "b" * 64, "Painter 3", (ai, "http://c2pa.org/digitalsourcetype/empty")
    )
    for found in (whole, Ingredient("a" * 64, ai), Ingredient("a" * 64, store="b" * 64)):
        table = ingredient_table(found)
        good = {"ingredients": [table]}
        change(copy, lambda manifest, good=good: manifest["provenance"].update(good))
        assert problems(copy) == []
    for wrong in ({}, table | {"place": "Rome"}, table | {"digitalSourceType": "AI"}):
        bad = {"ingredients": [wrong]}
        change(copy, lambda manifest, bad=bad: manifest["provenance"].update(bad))
        assert problems(copy) != []


def test_models_say_which_generator_it_was(bundle):
    provenance = bundles.read_manifest(bundle)["provenance"]
    assert set(provenance["models"]) == {"generator", "detector"}
    assert provenance["models"]["generator"]["version"]


def test_schemas_compile_in_strict_mode_and_accept_the_bundle(bundle, old_bundle, tmp_path):
    """By ajv, which most programs in JavaScript use."""
    import subprocess

    root = Path(__file__).resolve().parents[2]
    if not (shutil.which("node") and (root / "node_modules" / "ajv").is_dir()):
        pytest.skip("needs node, and `npm install ajv` in the checkout")
    script = """
      const { default: Ajv } = require('ajv/dist/2020');
      const read = (path) => JSON.parse(require('fs').readFileSync(path));
      const [schema, ...files] = process.argv.slice(1);
      const check = new Ajv({ strict: true, allErrors: true }).compile(read(schema));
      console.log(JSON.stringify(files.map((path) => (check(read(path)) ? [] : check.errors))));
    """
    misspelt = json.loads((bundle / "avatar.json").read_text())
    misspelt["keys"][0]["weights"]["jawOpne"] = 0.5
    (tmp_path / "misspelt.json").write_text(json.dumps(misspelt))
    for name, of in (("avatar-1", "avatar.json"), ("avatar-web-1", "web/avatar.json")):
        schema = root / "bakery" / "assets" / "schema" / f"{name}.schema.json"
        given = [bundle / of, old_bundle / of, tmp_path / "misspelt.json"]
        done = subprocess.run(
            ["node", "-e", script, str(schema), *map(str, given)],
            capture_output=True, text=True, cwd=root,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
        new, old, wrong = json.loads(done.stdout)
        assert new == [] and old == [] and wrong != []


def test_the_morph_target_of_a_glb_brings_the_tongue_out(bundle):
    """Level 0 of head.glb: some vertex of tongueOut moves 15 mm forward, and the jaw makes way."""
    gltf = pygltflib.GLTF2().load(str(bundle / "head.glb"))
    out = EXPRESSIONS.index("tongueOut")
    forward, down = [], []
    for primitive in gltf.meshes[0].primitives:
        accessor = gltf.accessors[primitive.targets[out]["POSITION"]]
        forward.append((accessor.max or [0, 0, 0])[2])
        down.append((accessor.min or [0, 0, 0])[1])
    assert max(forward) > 0.015 and min(down) < -0.002
