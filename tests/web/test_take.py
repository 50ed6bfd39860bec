"""A take in head.glb: what three.js plays is the take."""

import json
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bakery.export.glb_take import with_take
from bakery.formats.livelink import Take, format_take
from bakery.geometry import rotation

ROOT = Path(__file__).resolve().parents[2]
VALIDATE = (
    "require(process.argv[1]).validateBytes(new Uint8Array(require('fs').readFileSync(process.argv[2])"
    ")).then(r => console.log(JSON.stringify(r.issues)))"
)


@pytest.fixture(scope="module")
def take():
    """A second of all shapes, and a head that goes once around."""
    rng = np.random.default_rng(6)
    angles = np.stack([np.linspace(0, 360, 31), np.linspace(-20, 20, 31), np.zeros(31)], 1)
    weights = rng.random((31, 52)).astype(np.float32)
    return Take(np.arange(31) / 30, weights, angles, None)


@pytest.fixture(scope="module")
def talking(bundle, take, tmp_path_factory):
    path = tmp_path_factory.mktemp("take") / "a.glb"
    path.write_bytes(with_take((bundle / "head.glb").read_bytes(), take))
    return path


def test_three_plays_the_take(talking, take, node):
    times = [0.0, 0.25, 0.51, 0.98]  # at 1 it begins anew
    told = json.loads(node(Path(__file__).with_name("take.mjs"), talking, *times))
    assert told["name"] == "take" and told["length"] == pytest.approx(1)
    weights, head, _ = take.at(times)
    for seen, row, angles in zip(told["seen"], weights, head):
        assert len(seen["meshes"]) == 6  # skin, teeth, tongue, tear, lashes; eyes
        for mesh in seen["meshes"]:
            np.testing.assert_allclose(mesh, row, atol=1e-5)
        wanted = Rotation.from_matrix(rotation.yaw_pitch_roll(*angles))
        apart = (Rotation.from_quat(seen["head"]) * wanted.inv()).magnitude()
        assert np.degrees(apart) < 0.2  # between two frames the bone goes straight


def test_khronos_finds_nothing(talking):
    validator = ROOT / "node_modules" / "gltf-validator"
    if not validator.exists() or shutil.which("node") is None:
        pytest.skip("needs `npm install gltf-validator` in the checkout")
    command = ["node", "-e", VALIDATE, str(validator), str(talking)]
    said = json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
    assert said["numErrors"] == 0 and said["numWarnings"] == 0, said["messages"][:5]


def test_the_command_and_what_it_refuses(bakery, bundle, take, talking, tmp_path):
    (tmp_path / "take.csv").write_bytes(format_take(take))
    out = tmp_path / "a.glb"
    done = bakery("export", bundle, "--format", "glb", "--curves", tmp_path / "take.csv", "-o", out)
    assert done.returncode == 0, done.stderr
    data = out.read_bytes()
    document = json.loads(data[20 : 20 + int.from_bytes(data[12:16], "little")])
    (played,) = document["animations"]
    assert {one["target"]["path"] for one in played["channels"]} == {"weights", "rotation"}
    done = bakery(
        "export", bundle, "--format", "exr", "--curves", tmp_path / "take.csv", "-o", tmp_path / "e"
    )
    assert done.returncode == 2 and "--curves" in done.stderr
    done = bakery("export", bundle, "--format", "glb", "--curves", out, "-o", tmp_path / "b.glb")
    assert done.returncode == 1 and done.stderr.count("\n") == 1
    assert not (tmp_path / "b.glb").exists()
