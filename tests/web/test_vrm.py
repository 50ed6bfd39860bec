"""The VRM in the library that most programs for the web load it with (pixiv's three-vrm)."""

import json
from pathlib import Path

import numpy as np
import pytest

from bakery.export.skeleton import to_body
from bakery.export.vrm import PRESETS
from bakery.formats.targets import expression_weights
from bakery.plugins import plug_in
from bakery.types import EXPRESSIONS

REQUIRED = {
    "hips", "spine", "head",
    *(f"{side}{bone}" for side in ("left", "right")
      for bone in ("UpperArm", "LowerArm", "Hand", "UpperLeg", "LowerLeg", "Foot")),
}  # fmt: skip


@pytest.fixture(scope="module")
def seen(avatar, node, tmp_path_factory):
    path = tmp_path_factory.mktemp("vrm") / "a.vrm"
    plug_in("exporters", "vrm").export(avatar, path, 256)
    return json.loads(node(Path(__file__).parent / "vrm.mjs", path))


def test_it_has_the_bones_of_a_person_upright_on_the_ground(seen):
    bones = seen["bones"]
    assert set(bones) >= REQUIRED
    heights = [bones[name][1] for name in ("leftFoot", "hips", "spine", "chest", "neck", "head")]
    assert heights == sorted(heights) and 0 < heights[0] < 0.2 and 1.4 < heights[-1] < 1.7
    assert bones["leftHand"][0] > 0.5 and bones["rightHand"][0] < -0.5
    assert bones["leftHand"][1] == bones["leftUpperArm"][1]  # T pose


def test_at_rest_the_head_is_where_the_avatar_has_it(seen, avatar):
    low, high = seen["box"]
    skin = avatar.neutral[avatar.head.part_vertices("skin")]
    np.testing.assert_allclose(low[1], to_body(skin)[:, 1].min(), atol=2e-3)
    np.testing.assert_allclose(high[2], to_body(skin)[:, 2].max(), atol=5e-3)  # lashes stand off


def test_expressions_move_the_shapes_that_they_mean(seen):
    found = seen["expressions"]
    assert set(found) == {*PRESETS, *EXPRESSIONS}
    for name in EXPRESSIONS:
        assert found[name] == {name: 1}
    for name, ours in PRESETS.items():
        wanted = expression_weights(ours) if ours else np.zeros(52)
        wanted = {
            EXPRESSIONS[k]: pytest.approx(wanted[k], abs=1e-4) for k in np.flatnonzero(wanted)
        }
        assert found[name] == wanted, name
    assert found["aa"] and found["ou"] and found["blink"]


def test_a_look_aside_moves_both_eyes_by_its_angle(seen):
    looks = seen["looks"]  # yaw to the subject's left, pitch down, degrees
    assert looks["15,0"] == {"eyeLookOutLeft": 0.5, "eyeLookInRight": 0.5}
    assert looks["-15,0"] == {"eyeLookInLeft": 0.5, "eyeLookOutRight": 0.5}
    assert looks["0,12"] == {"eyeLookDownLeft": 0.48, "eyeLookDownRight": 0.48}
    assert looks["0,-12"] == {"eyeLookUpLeft": 0.48, "eyeLookUpRight": 0.48}


def test_a_turned_head_bone_turns_the_head_and_leaves_the_shoulders(seen):
    """The face turns rigidly about the bone, what lies on the chest stays, the neck is between."""
    rest, turned = np.array(seen["rest"]), np.array(seen["turned"])
    pivot, angle = np.array(seen["bones"]["head"]), 0.5
    turn = np.array(
        [[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]]
    )
    rigid = (rest - pivot) @ turn.T + pivot
    face = rest[:, 1] > pivot[1]
    np.testing.assert_allclose(turned[face], rigid[face], atol=1e-5)
    moved = np.linalg.norm(turned - rest, axis=1)
    part = np.linalg.norm(rigid - rest, axis=1)
    assert (moved <= part + 1e-5).all()
    low = rest[:, 1] < rest[:, 1].min() + 0.02
    assert low.any() and moved[low].max() < 1e-5


def test_it_says_that_it_is_synthetic_and_permits_little(seen):
    meta = seen["meta"]
    assert "digitalsourcetype/composite" in meta["copyrightInformation"]
    assert meta["licenseUrl"] == "https://vrm.dev/licenses/1.0/" and meta["authors"]
    assert meta["avatarPermission"] == "onlyAuthor" and not meta["allowRedistribution"]
    assert not meta["allowPoliticalOrReligiousUsage"]
