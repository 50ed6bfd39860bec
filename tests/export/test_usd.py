"""The head as USD, read by OpenUSD itself: valid, and every vertex where the head has it."""

import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bakery.export.lod import MATERIALS, head_surfaces
from bakery.export.skeleton import BONES, head_joints
from bakery.export.usd_take import with_take
from bakery.formats.livelink import Take, format_take
from bakery.geometry import rotation
from bakery.heads.base import weights
from bakery.plugins import plug_in
from bakery.testing import refuses
from bakery.types import EXPRESSIONS

HAIR = {"hair_cap", "hair_cards", "hair_fringe"}


@pytest.fixture(scope="module")
def pxr():
    return pytest.importorskip("pxr", reason="needs usd-core, the extra usd")


@pytest.fixture(scope="module")
def avatar(hairy):
    return hairy


@pytest.fixture(scope="module")
def made(pxr, avatar, tmp_path_factory):
    path = tmp_path_factory.mktemp("usd") / "a.usdz"
    plug_in("exporters", "usd").export(avatar, path, 256)
    return path


@pytest.fixture
def stage(made):
    """The file, opened; what a test changes stays with the test."""
    from pxr import Usd

    found = Usd.Stage.Open(str(made))
    found.SetEditTarget(found.GetSessionLayer())
    return found


def problems(stage):
    """What all of OpenUSD's validators say, as `usdchecker` does."""
    from pxr import UsdValidation

    registry = UsdValidation.ValidationRegistry()
    context = UsdValidation.ValidationContext(registry.GetOrLoadAllValidators())
    return [error.GetMessage() for error in context.Validate(stage)]


def test_usdchecker_finds_nothing(stage):
    assert problems(stage) == []
    looks = stage.GetDefaultPrim().GetVariantSets().GetVariantSet("look")
    for look in looks.GetVariantNames():
        looks.SetVariantSelection(look)
        assert problems(stage) == []


def test_usdchecker_would_find_something(stage):
    from pxr import Usd, UsdGeom

    broken = Usd.Stage.Open(stage.Flatten())
    broken.ClearDefaultPrim()
    UsdGeom.Mesh.Define(broken, "/avatar/skin/nested")
    assert len(problems(broken)) >= 2


def test_the_file_says_how_it_is_to_be_read(stage, made):
    from pxr import UsdGeom

    assert UsdGeom.GetStageUpAxis(stage) == "Y" and UsdGeom.GetStageMetersPerUnit(stage) == 1
    told = stage.GetRootLayer().customLayerData
    assert (
        told["generator"].startswith("bakery") and "digitalsourcetype" in told["digitalSourceType"]
    )
    with zipfile.ZipFile(made) as archive:
        assert archive.namelist()[0] == "avatar.usdc" and len(archive.namelist()) == 7


def skinned(stage, shapes=(), turn=None):
    """Points [V, 3] mm of each mesh as UsdSkel deforms them; `turn`: a bone and degrees about +y."""
    from pxr import Gf, Sdf, Usd, UsdGeom, UsdSkel, Vt

    pose = UsdSkel.Animation.Get(stage, "/avatar/skeleton/pose")
    known = list(pose.GetBlendShapesAttr().Get())
    pose.GetBlendShapeWeightsAttr().Set(
        Vt.FloatArray([float(dict(shapes).get(name, 0)) for name in known])
    )
    if turn:
        rotations = list(pose.GetRotationsAttr().Get())
        number = [path.rpartition("/")[2] for path in pose.GetJointsAttr().Get()].index(turn[0])
        rotations[number] = Gf.Quatf(Gf.Rotation(Gf.Vec3d(0, 1, 0), turn[1]).GetQuat())
        pose.GetRotationsAttr().Set(Vt.QuatfArray(rotations))
    flat = Usd.Stage.Open(stage.Flatten())
    root = UsdSkel.Root.Get(flat, Sdf.Path("/avatar"))
    assert UsdSkel.BakeSkinning(root, Gf.Interval.GetFullInterval())
    found = {}
    for prim in flat.Traverse():
        if prim.IsA(UsdGeom.Mesh):
            points = UsdGeom.Mesh(prim).GetPointsAttr().Get(Usd.TimeCode.EarliestTime())
            found[prim.GetName()] = np.array(points) * 1000
    return found


@pytest.mark.parametrize("name", ["jawOpen", "eyeBlinkLeft", "mouthSmileRight", "eyeLookUpLeft"])
def test_blend_shapes_move_the_head_as_its_model_does(stage, avatar, name):
    one = weights({name: 1.0})
    wanted = head_surfaces(avatar.head, avatar.neutral)
    found = skinned(stage, {name: 1.0})
    assert set(found) == set(MATERIALS) | HAIR
    for piece in wanted:
        np.testing.assert_allclose(
            found[piece.name], piece.vertices + np.tensordot(one, piece.shapes, 1), atol=0.11
        )  # mm: what moves less than 0.1 is at rest


def test_bones_turn_what_they_carry(stage, avatar):
    rest = {piece.name: piece.vertices for piece in head_surfaces(avatar.head, avatar.neutral)}
    turned = skinned(stage, turn=("head", 30.0))
    place = {joint.name: joint.place * 1000 for joint in head_joints(avatar.head, avatar.neutral)}
    c, s = np.cos(np.radians(30)), np.sin(np.radians(30))
    rotation = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    rigid = (rest["eyes"] - place["head"]) @ rotation.T + place["head"]
    np.testing.assert_allclose(turned["eyes"], rigid, atol=0.01)
    low = rest["skin"][:, 1] < rest["skin"][:, 1].min() + 20
    assert np.abs(turned["skin"] - rest["skin"])[low].max() < 0.01


def test_bones_and_names(stage):
    from pxr import UsdSkel

    joints = UsdSkel.Skeleton.Get(stage, "/avatar/skeleton").GetJointsAttr().Get()
    assert [path.rpartition("/")[2] for path in joints] == list(BONES)
    pose = UsdSkel.Animation.Get(stage, "/avatar/skeleton/pose")
    assert list(pose.GetBlendShapesAttr().Get()) == list(EXPRESSIONS)


def test_each_look_has_its_pictures(stage):
    from pxr import UsdGeom, UsdShade

    looks = stage.GetDefaultPrim().GetVariantSets().GetVariantSet("look")
    assert looks.GetVariantNames() == ["lit", "photo"] and looks.GetVariantSelection() == "photo"
    for look in looks.GetVariantNames():
        looks.SetVariantSelection(look)
        for prim in stage.Traverse():
            if not prim.IsA(UsdGeom.Mesh):
                continue
            material, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()
            assert material.GetPath().name == f"{prim.GetName()}_{look}"
        skin = stage.GetPrimAtPath(f"/avatar/materials/skin_{look}")
        files = {
            child.GetAttribute("inputs:file").Get().resolvedPath.rpartition("/")[2].strip("]")
            for child in skin.GetChildren()
            if child.HasAttribute("inputs:file")
        }
        lamps = {"albedo.jpg", "roughness.jpg", "normal.png"}
        assert files == (lamps if look == "lit" else {"photo.jpg"})  # resolved: in the package


def test_the_guide_does_what_it_says(made, tmp_path, monkeypatch):
    from pxr import Usd, UsdShade, UsdSkel

    guide = (Path(__file__).parents[2] / "docs/guides/usd.md").read_text()
    code = guide.split("```python")[1].split("```")[0]
    (tmp_path / "head.usdz").write_bytes(made.read_bytes())
    monkeypatch.chdir(tmp_path)
    exec(code, {})
    stage = Usd.Stage.Open("posed.usda")
    pose = UsdSkel.Animation.Get(stage, "/avatar/skeleton/pose")
    row = pose.GetBlendShapeWeightsAttr().Get(1.5)
    assert dict(zip(EXPRESSIONS, row))["jawOpen"] == pytest.approx(0.4)
    skin = stage.GetPrimAtPath("/avatar/skin")
    material, _ = UsdShade.MaterialBindingAPI(skin).ComputeBoundMaterial()
    assert material.GetPath().name == "skin_lit" and problems(stage) == []


def test_without_hair_and_without_usd_core(made, avatar, tmp_path, monkeypatch):
    from pxr import Usd

    bald = replace(avatar, textures=replace(avatar.textures, hair_mesh=None))
    exporter = plug_in("exporters", "usd")
    exporter.export(bald, tmp_path / "b.usdz", 64)
    stage = Usd.Stage.Open(str(tmp_path / "b.usdz"))
    assert not stage.GetPrimAtPath("/avatar/hair_cap") and problems(stage) == []
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    refuses(lambda: exporter.export(bald, tmp_path / "c.usdz", 64), "usd-core", "bakery[usd]")
    assert not (tmp_path / "c.usdz").exists()


@pytest.fixture(scope="module")
def take():
    """Four frames at 24 a second: the jaw opens, the head turns and nods."""
    rows = np.zeros((4, len(EXPRESSIONS)), np.float32)
    rows[:, EXPRESSIONS.index("jawOpen")] = [0, 0.2, 0.5, 0.9]
    head = np.array([[0, 0, 0], [10, 0, 0], [20, 8, 0], [30, 0, 0]], np.float32)
    return Take(np.arange(4) / 24 + 2.0, rows, head, None)


def test_a_take_plays(made, take, avatar, tmp_path):
    from pxr import Usd, UsdSkel

    data = with_take(made.read_bytes(), take)
    assert data == with_take(made.read_bytes(), take)  # the same bytes each time
    path = tmp_path / "talking.usdz"
    path.write_bytes(data)
    stage = Usd.Stage.Open(str(path))
    assert problems(stage) == []
    assert (stage.GetStartTimeCode(), stage.GetEndTimeCode()) == (0, 3)
    assert stage.GetTimeCodesPerSecond() == 24
    pose = UsdSkel.Animation.Get(stage, "/avatar/skeleton/pose")
    assert pose.GetBlendShapeWeightsAttr().GetTimeSamples() == [0, 1, 2, 3]
    jaw = list(pose.GetBlendShapesAttr().Get()).index("jawOpen")
    found = [pose.GetBlendShapeWeightsAttr().Get(code)[jaw] for code in range(4)]
    np.testing.assert_allclose(found, take.weights[:, EXPRESSIONS.index("jawOpen")], atol=1e-6)
    head = [str(joint).endswith("/head") for joint in pose.GetJointsAttr().Get()].index(True)
    for code, angles in enumerate(take.head):
        turn = pose.GetRotationsAttr().Get(code)[head]
        w, xyz = turn.GetReal(), np.array(turn.GetImaginary())
        angle = 2 * np.arccos(np.clip(w, -1, 1))
        found = angle * xyz / max(np.linalg.norm(xyz), 1e-9)
        wanted = rotation.vector(rotation.yaw_pitch_roll(*angles)).ravel()
        np.testing.assert_allclose(found, wanted, atol=1e-5)


def test_a_take_is_put_in_by_the_command(pxr, bakery, bundle, take, tmp_path):
    from pxr import Usd

    (tmp_path / "take.csv").write_bytes(format_take(take))
    out = tmp_path / "a.usdz"
    done = bakery("export", bundle, "--format", "usd", "--curves", tmp_path / "take.csv", "-o", out)
    assert done.returncode == 0, done.stderr
    stage = Usd.Stage.Open(str(out))
    assert stage.GetEndTimeCode() == 3 and problems(stage) == []
    assert bakery("inspect", out).returncode == 0
    done = bakery("export", bundle, "--format", "vrm", "--curves", tmp_path / "take.csv",
                  "-o", tmp_path / "a.vrm")  # fmt: skip
    assert done.returncode == 2 and "--curves goes into .glb and .usdz files" in done.stderr
