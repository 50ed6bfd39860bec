"""The bones of head.glb, moved by three.js: head, jaw and eyes do what they are for."""

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bakery.export.skeleton import BONES, head_joints, jaw_hinge
from bakery.heads.base import GAZE_PITCH, GAZE_YAW

LOOKS = {  # degrees about y and x -> shapes
    (GAZE_YAW, 0): ("eyeLookOutLeft", "eyeLookInRight"),
    (-GAZE_YAW, 0): ("eyeLookInLeft", "eyeLookOutRight"),
    (0, GAZE_PITCH): ("eyeLookDownLeft", "eyeLookDownRight"),
    (0, -GAZE_PITCH): ("eyeLookUpLeft", "eyeLookUpRight"),
}


def quaternion(yaw, pitch):
    return Rotation.from_euler("YX", [yaw, pitch], degrees=True).as_quat().tolist()


@pytest.fixture(scope="module")
def posed(avatar, bundle, node, tmp_path_factory):
    """Places in mm by name of the pose: material -> [N, 3]."""
    _, angle = jaw_hinge(avatar.head, avatar.neutral)
    poses = {
        "rest": ({}, {}),
        "head": ({"head": quaternion(30, 0)}, {}),
        "jaw": ({"jaw": quaternion(0, np.degrees(angle))}, {}),
        "jawOpen": ({}, {"all": {"jawOpen": 1}}),
    }
    for (yaw, pitch), shapes in LOOKS.items():
        turn, lids = quaternion(yaw, pitch), dict.fromkeys(shapes, 1)
        eyes = {"leftEye": turn, "rightEye": turn}
        poses[f"bones {yaw} {pitch}"] = eyes, {"all": lids, "eyes": {}}  # shapes move the lids
        poses[f"shapes {yaw} {pitch}"] = {}, {"all": lids}
    path = tmp_path_factory.mktemp("bones") / "poses.json"
    path.write_text(json.dumps([{"bones": b, "shapes": s} for b, s in poses.values()]))
    told = json.loads(node(Path(__file__).parent / "bones.mjs", bundle / "head.glb", path))
    assert told["bones"] == list(BONES)
    return {
        name: {material: np.array(points) * 1000 for material, points in pose.items()}
        for name, pose in zip(poses, told["seen"])
    }


@pytest.mark.parametrize("angles", LOOKS)
def test_gaze_by_bones_is_gaze_by_shapes(posed, angles):
    """Eyeballs turned by bones, lids by shapes, lie where shapes alone put them."""
    name = f"{angles[0]} {angles[1]}"
    for material, points in posed[f"bones {name}"].items():
        np.testing.assert_allclose(
            points, posed[f"shapes {name}"][material], atol=0.1
        )  # mm; 1 is asked
    moved = np.linalg.norm(posed[f"bones {name}"]["eyes"] - posed["rest"]["eyes"], axis=1)
    assert moved.max() > 4


def test_the_head_turns_rigidly_and_the_shoulders_stay(posed, avatar):
    place = {joint.name: joint.place * 1000 for joint in head_joints(avatar.head, avatar.neutral)}
    turn = Rotation.from_euler("Y", 30, degrees=True).as_matrix()
    for material, rest in posed["rest"].items():
        rigid = (rest - place["head"]) @ turn.T + place["head"]
        face = rest[:, 1] > place["head"][1]
        np.testing.assert_allclose(posed["head"][material][face], rigid[face], atol=0.01)
    skin = posed["rest"]["skin"]
    low = skin[:, 1] < skin[:, 1].min() + 20
    assert low.any() and np.abs(posed["head"]["skin"] - skin)[low].max() < 0.01


def test_the_jaw_bone_opens_the_mouth_as_jawopen_does(posed):
    """Teeth within a third of a millimetre, skin within 6 mm of 38, 1 on average; the skull stays."""
    teeth = np.linalg.norm(posed["jaw"]["teeth"] - posed["jawOpen"]["teeth"], axis=1)
    assert teeth.max() < 0.5
    apart = np.linalg.norm(posed["jaw"]["skin"] - posed["jawOpen"]["skin"], axis=1)
    moved = np.linalg.norm(posed["jawOpen"]["skin"] - posed["rest"]["skin"], axis=1)
    assert apart.max() < 7 and apart.mean() < 1 and moved.max() > 25
    assert np.abs(posed["jaw"]["eyes"] - posed["rest"]["eyes"]).max() < 0.01
