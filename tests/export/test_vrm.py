"""The VRM as a file: what Khronos' validator says, hair, weights of the bones."""

import json
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from bakery.export.skeleton import joint_weights, joints
from bakery.plugins import plug_in

VALIDATOR = Path(__file__).resolve().parents[2] / "node_modules" / "gltf-validator"
VALIDATE = (
    "require(process.argv[1]).validateBytes(new Uint8Array(require('fs').readFileSync(process.argv[2])"
    ")).then(r => console.log(JSON.stringify(r.issues)))"
)


@pytest.fixture(scope="module")
def made(hairy, tmp_path_factory):
    path = tmp_path_factory.mktemp("vrm") / "a.vrm"
    plug_in("exporters", "vrm").export(hairy, path, 256)
    return path


def test_khronos_finds_nothing(made):
    if not VALIDATOR.exists() or shutil.which("node") is None:
        pytest.skip("needs `npm install gltf-validator` in the checkout")
    command = ["node", "-e", VALIDATE, str(VALIDATOR), str(made)]
    said = json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
    assert said["numErrors"] == 0 and said["numWarnings"] == 0, said["messages"][:5]


def test_hair_hangs_on_the_same_bones(made):
    data = made.read_bytes()
    table = json.loads(data[20 : 20 + int.from_bytes(data[12:16], "little")])
    nodes = {node["name"]: node for node in table["nodes"] if "mesh" in node}
    assert set(nodes) == {"head", "hair"} and nodes["head"]["skin"] == nodes["hair"]["skin"] == 0
    for primitive in table["meshes"][nodes["hair"]["mesh"]]["primitives"]:
        assert {"JOINTS_0", "WEIGHTS_0"} <= set(primitive["attributes"])
        assert "targets" not in primitive
    assert table["images"][-1]["name"] == "thumbnail"


def test_each_vertex_is_carried_whole_and_the_face_by_the_head(head):
    carried = joint_weights(head, head.mean, head.mean)
    np.testing.assert_allclose(carried.sum(1), 1, atol=1e-6)
    assert carried.min() >= 0
    points = head.landmarks(head.mean)
    face = joint_weights(head, head.mean, points)
    np.testing.assert_allclose(face[:, 2], 1)  # the chin too
    below = head.mean[:, 1] < points[152, 1] - 80
    assert below.any() and carried[below, 2].max() < 0.3


def test_bones_stand_before_what_hangs_on_them(head):
    bones = joints(head, head.mean)
    seen = set()
    for bone in bones:
        assert bone.parent is None or bone.parent in seen
        seen.add(bone.name)
    assert [bone.name for bone in bones if bone.parent is None] == ["hips"]
