"""`bakery hair`, and hair with volume as a kept part of a bake."""

import json
import struct
from pathlib import Path

import pytest

from bakery.bake.kept import Kept
from bakery.formats.record import read_textures

SAMPLES = Path(__file__).resolve().parents[2] / "samples"
ANNA = SAMPLES / "anna.jpg", SAMPLES / "anna.json"
FEW = Path(__file__).parents[1] / "few.toml"
SMALL = [
    "--preset", "small", "--expressions", FEW, "--set", "texture.views=[0.0]",
    "--generator", "rendered",
]  # fmt: skip


def test_a_file_of_hair(bakery, tmp_path):
    photo, marks = ANNA
    out = tmp_path / "hair.glb"
    done = bakery("hair", photo, "--landmarks", marks, *SMALL, "--hair", "cards", "-o", out)
    assert done.returncode == 0 and f"wrote {out}" in done.stderr, done.stderr
    data = out.read_bytes()
    length = struct.unpack_from("<I", data, 12)[0]
    table = json.loads(data[20 : 20 + length])
    materials = {one["name"]: one for one in table["materials"]}
    assert materials["hair_cap"].get("alphaMode", "OPAQUE") == "OPAQUE"
    cards = materials["hair_cards"]
    assert cards["alphaMode"] == "MASK" and cards["doubleSided"] and cards["alphaCutoff"] == 0.4
    high = [table["accessors"][p["attributes"]["POSITION"]]["max"][1]
            for p in table["meshes"][0]["primitives"]]  # fmt: skip
    assert 0.08 < max(high) < 0.25  # metres above the eyes


def test_no_hair_is_said(portrait, bakery, tmp_path):
    photo, marks = portrait
    out = tmp_path / "hair.glb"
    done = bakery("hair", photo, "--landmarks", marks, *SMALL, "--hair", "none", "-o", out)
    assert done.returncode == 1 and "--hair cards" in done.stderr and not out.exists()


@pytest.mark.slow
def test_textures_hold_hair(bakery, tmp_path):
    photo, marks = ANNA
    fit, out = tmp_path / "fit.json", tmp_path / "t.npz"
    given = [photo, "--landmarks", marks, *SMALL]
    assert bakery("fit", *given, "-o", fit).returncode == 0
    made = ["texture", *given, "--fit", fit, "-o", out, "--hair", "cards"]
    done = bakery(*made)
    assert done.returncode == 0, done.stderr
    assert len(read_textures(out).hair_mesh.faces) > 1000


def test_no_mesh_is_kept_too():
    assert Kept().one("hair", dict) == {}
