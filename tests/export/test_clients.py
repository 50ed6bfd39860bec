"""head.glb and proxies.glb in programs that others wrote: assimp and f3d, besides three.js in tests/web."""

import json
import re
import shutil
import subprocess

import cv2
import numpy as np
import pytest

from bakery.export.skeleton import BONES
from bakery.types import EXPRESSIONS


def program(*names):
    """Skips where one of the programs is missing; .ci/run installs them."""
    for name in names:
        if shutil.which(name) is None:
            pytest.skip(f"needs {name}")


def run(*arguments, **options):
    done = subprocess.run(
        list(map(str, arguments)), capture_output=True, text=True, timeout=300, **options
    )
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
    return done.stdout


@pytest.fixture(scope="module")
def box(avatar):
    """Corners of the head as bakery has it, metres: all that head.glb shows."""
    faces = avatar.head.part_faces(
        "skin", "eye_socket", "mouth_cavity", "eye_left", "eye_right", "teeth_upper",
        "teeth_lower", "gums_upper", "gums_lower", "tongue", "tear", "lashes",
    )  # fmt: skip
    points = avatar.neutral[np.unique(avatar.head.faces[faces])] / 1000
    return points.min(0), points.max(0)


def without_lods(path, glb, out):
    """A copy without MSFT_lod: Debian's assimp 5.2.5 is a debug build, which ends itself when it
    copies a scene with any extension of a node, as its export does (mended in assimp 5.3)."""
    split, join = glb
    document, rest = split(path.read_bytes())
    for node in document["nodes"]:
        node.pop("extensions", None)
    document["extensionsUsed"].remove("MSFT_lod")
    out.write_bytes(join(document, rest))
    return out


def test_every_accessor_has_bytes(bundle, glb):
    """What neither view nor sparse values hold is zero by the standard, and refused by programs."""
    for name in ("head.glb", "proxies.glb"):
        document, rest = glb[0]((bundle / name).read_bytes())
        for accessor in document["accessors"]:
            assert "bufferView" in accessor or "sparse" in accessor
        assert len(document["scenes"]) == 1
        resting = [a for a in document["accessors"] if a.get("max") == a.get("min") == [0, 0, 0]]
        assert len({accessor["count"] for accessor in resting}) == len(resting)  # one each
        views = {accessor["bufferView"] for accessor in resting}
        (shared,) = (document["bufferViews"][view] for view in views)
        assert shared["byteLength"] >= 12 * max(accessor["count"] for accessor in resting)
        start = 8 + shared["byteOffset"]  # behind the header of the chunk
        assert not any(rest[start : start + shared["byteLength"]])


def test_the_head_shows_no_proxies(bundle, glb):
    """Engines that draw all scenes of a file would lay them over mouth and eyes."""
    head, _ = glb[0]((bundle / "head.glb").read_bytes())
    proxies, _ = glb[0]((bundle / "proxies.glb").read_bytes())
    carried = {"mouth_sheet", "eye_cap_left", "eye_cap_right"}
    names = {one["name"] for key in ("nodes", "meshes", "materials") for one in head[key]}
    assert not names & carried
    assert {mesh["name"] for mesh in proxies["meshes"]} == carried
    assert [mesh["name"] for mesh in head["meshes"]] == [
        f"{what}_LOD{level}" for what in ("head", "eyes") for level in range(4)
    ]
    assert [len(mesh["primitives"]) for mesh in head["meshes"]] == [5, 5, 5, 3, 1, 1, 1, 1]
    listed = json.loads((bundle / "avatar.json").read_text())["files"]
    assert {one["role"] for one in listed if one["path"] == "proxies.glb"} == {"proxies"}


def test_assimp_reads_the_head(bundle, box):
    program("assimp")
    said = run("assimp", "info", bundle / "head.glb")
    lod = json.loads((bundle / "avatar.json").read_text())["lods"][0]
    assert int(re.search(r"Faces: +(\d+)", said)[1]) == lod["triangles"] + lod["eyes"]["triangles"]
    for bone in BONES:
        assert re.search(rf"{bone}\W", said), bone
    for word, corner in zip(("Minimum", "Maximum"), box):
        found = np.array(re.search(rf"{word} point +\((.*?)\)", said)[1].split(), float)
        np.testing.assert_allclose(found, corner, atol=2e-6)  # it prints micrometres


def test_assimp_reads_the_proxies(bundle):
    program("assimp")
    said = run("assimp", "info", bundle / "proxies.glb")
    for name in ("mouth_sheet", "eye_cap_left", "eye_cap_right"):
        assert name in said


def test_assimp_carries_all_shapes_over(bundle, glb, box, tmp_path):
    """To FBX with their names, to glTF with their sizes, and every vertex where it was."""
    program("assimp")
    source = without_lods(bundle / "head.glb", glb, tmp_path / "head.glb")
    run("assimp", "export", source, tmp_path / "a.fbx", "-ffbxa")
    names = re.findall(
        r'"SubDeformer::(\w+)", "BlendShapeChannel"', (tmp_path / "a.fbx").read_text()
    )
    for name in EXPRESSIONS:
        assert names.count(name) == 6, name  # skin, eyes, teeth, tongue, tear line, lashes
    assert len(names) == 6 * 52
    run("assimp", "export", source, tmp_path / "a.gltf", "-fgltf2")
    document = json.loads((tmp_path / "a.gltf").read_text())
    primitives = [piece for mesh in document["meshes"] for piece in mesh["primitives"]]
    assert [len(primitive["targets"]) for primitive in primitives] == [52] * 6
    assert all("JOINTS_0" in primitive["attributes"] for primitive in primitives)
    places = [document["accessors"][p["attributes"]["POSITION"]] for p in primitives]
    np.testing.assert_allclose(np.min([place["min"] for place in places], 0), box[0], atol=1e-6)
    np.testing.assert_allclose(np.max([place["max"] for place in places], 0), box[1], atol=1e-6)


def test_f3d_draws_the_head(bundle, tmp_path):
    """VTK's reader: a head before an even background, upright, about as wide as it should be."""
    program("f3d", "xvfb-run")
    picture = tmp_path / "a.png"
    command = ["xvfb-run", "-a", "f3d", "--resolution=300,300", f"--output={picture}"]
    run(*command, bundle / "head.glb")
    drawn = cv2.imread(str(picture)).astype(int)
    head = np.abs(drawn - drawn[2, 2]).max(2) > 8
    rows, columns = np.flatnonzero(head.any(1)), np.flatnonzero(head.any(0))
    assert 0.1 < head.mean() < 0.6
    # 182 mm by 298 mm; the neck's front edge lies nearer to the camera than the crown.
    assert np.ptp(columns) / np.ptp(rows) == pytest.approx(182 / 298, rel=0.15)
