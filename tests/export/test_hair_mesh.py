"""Hair with volume in a bundle: all of it comes back, damage is noticed, other programs show it."""

import json
import re
import shutil
import subprocess
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest

from bakery.errors import BundleError
from bakery.export import hair_mesh, hostile
from bakery.export.bundle import list_files, read_manifest
from bakery.export.hair import MATERIALS, hair_levels, surfaces
from bakery.export.open import open_avatar
from bakery.export.schema import seal
from bakery.export.validate import problems
from bakery.export.web.glb import web_glb
from bakery.export.web.head import surfaces as web_surfaces
from bakery.formats import exr, record
from bakery.geometry.mesh import face_normals
from bakery.types import EXPRESSIONS, HairMesh

VALIDATOR = Path(__file__).resolve().parents[2] / "node_modules" / "gltf-validator"
VALIDATE = """
const v = require(process.argv[1]), fs = require('fs');
v.validateBytes(new Uint8Array(fs.readFileSync(process.argv[2])), {maxIssues: 0})
 .then(r => console.log(JSON.stringify(r.issues)));
"""


@pytest.fixture
def own(hairy_bundle, tmp_path):
    """A copy that a test may change."""
    return shutil.copytree(hairy_bundle, tmp_path / "own.avatar")


@pytest.fixture(scope="module")
def mesh(hairy):
    return hairy.textures.hair_mesh


def seal_anew(folder, **changes):
    """As the author of a bundle can: sizes and hashes fit whatever is in the files."""
    manifest = json.loads((folder / "avatar.json").read_text()) | changes
    (folder / "avatar.json").write_bytes(seal(manifest | {"files": list_files(folder)}))


def test_it_comes_back_to_the_bit(hairy_bundle, hairy, avatar, hairdo):
    assert problems(hairy_bundle) == []
    wanted = hairdo(hairy.head, hairy.neutral)
    for field in fields(HairMesh):
        found, put = (getattr(mesh, field.name) for mesh in (hairy.textures.hair_mesh, wanted))
        assert found.dtype == put.dtype, field.name
        np.testing.assert_array_equal(found, put, err_msg=field.name)
    assert avatar.textures.hair_mesh is None


def test_a_bundle_without_it_says_nothing_of_it(bundle):
    manifest = read_manifest(bundle)
    assert "hair_mesh" not in manifest and not any("hair" in lod for lod in manifest["lods"])
    names = {entry["path"] for entry in manifest["files"]}
    assert not names & {hair_mesh.MESH, hair_mesh.ATLAS, "web/hair_cards.webp"}


def test_inspect_counts_the_cards(hairy_bundle, hairy, bakery):
    done = bakery("inspect", hairy_bundle, "--json")
    assert done.returncode == 0, done.stderr
    mesh = hairy.textures.hair_mesh
    assert json.loads(done.stdout)["hair cards"] == len(np.unique(mesh.card)) - 1


@pytest.mark.parametrize("name", [hair_mesh.MESH, hair_mesh.ATLAS])
def test_a_changed_byte_and_a_missing_file_are_noticed(own, name):
    path = own / name
    data = path.read_bytes()
    (entry,) = (one for one in read_manifest(own)["files"] if one["path"] == name)
    assert entry["role"] == "hair"
    for at in (0, len(data) // 2, len(data) - 1):
        path.write_bytes(data[:at] + bytes([data[at] ^ 1]) + data[at + 1 :])
        assert "SHA-256" in hostile.file_problem(own, entry)
        with pytest.raises(BundleError, match=name):
            open_avatar(own)
    path.unlink()
    seal_anew(own)
    assert problems(own) == [f"{name}: missing from the list of files"]
    with pytest.raises(BundleError, match=f"lacks {name}"):
        open_avatar(own)


BAD = {
    "a corner that is none": (
        lambda mesh: {"faces": mesh.faces + np.int32(len(mesh.vertices))}, "HairMesh.faces"),
    "a place that is no number": (
        lambda mesh: {"vertices": mesh.vertices * np.float32(np.nan)}, "not finite"),
    "uv beyond the atlas": (lambda mesh: {"uv": mesh.uv + np.float32(1)}, "HairMesh.uv"),
    "a kind that is none": (lambda mesh: {"kind": mesh.kind + np.uint8(3)}, "HairMesh.kind"),
    "numbers of another kind": (lambda mesh: {"card": mesh.card.astype(np.float64)}, "float64"),
    "one array shorter": (lambda mesh: {"levels": mesh.levels[1:]}, "HairMesh.levels"),
    "more than any hair has": (lambda mesh: {"more": np.zeros(hair_mesh.LARGEST)}, "MiB"),
}  # fmt: skip


@pytest.mark.parametrize("case", BAD)
def test_arrays_that_do_not_go_together_are_refused(own, case, mesh):
    change, message = BAD[case]
    record.write_arrays(own / hair_mesh.MESH, hair_mesh.arrays(mesh) | change(mesh))
    seal_anew(own)
    with pytest.raises(BundleError, match=re.escape(message)) as found:
        open_avatar(own)
    assert "\n" not in str(found.value)


def test_what_is_refused_is_one_line_for_its_user(own, bakery, tmp_path, mesh):
    change, message = BAD["uv beyond the atlas"]
    record.write_arrays(own / hair_mesh.MESH, hair_mesh.arrays(mesh) | change(mesh))
    seal_anew(own)
    (found,) = problems(own)
    assert message in found and "\n" not in found
    done = bakery("render", own, "-o", tmp_path / "a.png", "--size", "32")
    assert done.returncode == 1 and len(done.stderr.splitlines()) == 1
    assert message in done.stderr and "Traceback" not in done.stderr


def test_an_array_that_is_missing_is_named(own, mesh):
    less = {name: array for name, array in hair_mesh.arrays(mesh).items() if name != "hang"}
    record.write_arrays(own / hair_mesh.MESH, less)
    seal_anew(own)
    (found,) = problems(own)
    assert "hang" in found
    with pytest.raises(BundleError, match="hang"):
        open_avatar(own)


def test_the_atlas_has_its_parts_and_marks(own):
    parts = exr.read_exr(own / hair_mesh.ATLAS)
    headers = {part.name: part for part in exr.read_header(own / hair_mesh.ATLAS)}
    assert {name: (one.channels, one.color) for name, one in headers.items()} == hair_mesh.PARTS
    exr.write_exr(own / hair_mesh.ATLAS, parts)  # all marked as colour
    seal_anew(own)
    assert any("'source' is not marked as data" in line for line in problems(own))


def test_a_table_of_other_numbers_is_a_finding(own):
    stated = read_manifest(own)["hair_mesh"]
    seal_anew(own, hair_mesh=stated | {"cards": stated["cards"] + 1})
    (found,) = problems(own)
    assert "cards" in found and hair_mesh.MESH in found


def test_levels_of_the_glb_follow_those_of_the_mesh(hairy_bundle, hairy, glb):
    mesh = hairy.textures.hair_mesh
    document, _ = glb[0]((hairy_bundle / "head.glb").read_bytes())
    meshes = {one["name"]: one for one in document["meshes"]}
    materials = {one["name"]: one for one in document["materials"]}
    modes = [materials[name].get("alphaMode", "OPAQUE") for name in MATERIALS]
    assert modes == ["OPAQUE", "MASK", "BLEND"]
    assert materials["hair_cards"]["alphaCutoff"] == pytest.approx(0.4)
    assert all(materials[name]["doubleSided"] for name in MATERIALS)
    lods = read_manifest(hairy_bundle)["lods"]
    for number, lod in enumerate(lods):
        assert lod["hair"]["node"] == f"hair_LOD{number}"
        primitives = meshes[lod["hair"]["node"]]["primitives"]
        assert not any("targets" in one for one in primitives)
        corners = [document["accessors"][one["indices"]]["count"] for one in primitives]
        assert sum(corners) == 3 * lod["hair"]["triangles"]
        level = min(number, 2)
        shown = (mesh.levels >> level & 1).astype(bool) & ((mesh.kind == 0) | (number < 3))
        assert lod["hair"]["triangles"] == shown.sum()
    (scene,) = document["scenes"]
    roots = [document["nodes"][node] for node in scene["nodes"]]
    assert [node["name"] for node in roots] == ["root", "head_LOD0", "eyes_LOD0", "hair_LOD0"]
    for node in roots[1:]:
        others = [document["nodes"][k]["name"] for k in node["extensions"]["MSFT_lod"]["ids"]]
        assert others == [node["name"][:-1] + digit for digit in "123"] and node["skin"] == 0


def test_surfaces_keep_the_order_from_the_skull_outwards(hairdo, head):
    """Triangle by triangle; one that faces away from its normals is turned over."""
    mesh = hairdo(head, head.mean)
    cap, cards, fringe = surfaces(mesh, 0)
    for kind, piece in enumerate((cap, cards, fringe)):
        corners = mesh.vertices[mesh.faces[mesh.kind == kind]]
        found = piece.vertices[piece.faces]
        turned = (found[:, 0] != corners[:, 0]).any(1)
        corners[turned] = corners[turned][:, ::-1]
        np.testing.assert_array_equal(found, corners)
        uv = mesh.uv[mesh.faces[mesh.kind == kind]]
        uv[turned] = uv[turned][:, ::-1]
        np.testing.assert_array_equal(piece.uv[piece.faces], uv)
        ahead = (face_normals(piece.vertices, piece.faces) * piece.normals[piece.faces].sum(1)).sum(
            1
        )
        assert ahead.min() >= -1e-6
    assert [[piece.name for piece in level] for level in hair_levels(mesh, 4)] == [
        *[list(MATERIALS)] * 3, ["hair_cap"],
    ]  # fmt: skip
    bare = replace(mesh, levels=np.zeros_like(mesh.levels))
    assert hair_levels(bare, 4) == [[], [], [], []]


def test_the_packed_mesh_is_the_same_for_every_program(hairy_bundle, hairy, head, hairdo, glb):
    """Level and cards of each primitive; and nothing of it without hair."""
    mesh = hairy.textures.hair_mesh
    document, _ = glb[0]((hairy_bundle / "web" / "player.glb").read_bytes())
    (found,) = (one for one in document["meshes"] if one["name"] == "hair")
    for primitive in found["primitives"]:
        about = primitive["extras"]
        shown = (mesh.levels >> about["level"] & 1).astype(bool)
        triangles = document["accessors"][primitive["indices"]]["count"] // 3
        if about["cards"]:
            assert sum(about["cards"]) == triangles == (shown & (mesh.kind > 0)).sum()
            assert len(about["cards"]) == len(np.unique(mesh.card[shown & (mesh.kind > 0)]))
        else:
            assert triangles == (shown & (mesh.kind == 0)).sum()
    assert len(found["primitives"]) == 6
    plain = web_glb(web_surfaces(head, head.mean, 0.05), EXPRESSIONS, "x")
    assert [one["name"] for one in glb[0](plain)[0]["meshes"]] == ["head"]


@pytest.mark.parametrize("name", ["head.glb", "web/player.glb"])
def test_khronos_finds_nothing(hairy_bundle, name):
    if not VALIDATOR.exists():
        pytest.skip("needs `npm install gltf-validator` in the checkout")
    command = ["node", "-e", VALIDATE, VALIDATOR, hairy_bundle / name]
    run = subprocess.run(list(map(str, command)), capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    said = json.loads(run.stdout)
    assert said["numErrors"] == 0 and said["numWarnings"] == 0, said


def test_assimp_reads_the_hair(hairy_bundle, hairy):
    if shutil.which("assimp") is None:
        pytest.skip("needs assimp")
    run = subprocess.run(
        ["assimp", "info", hairy_bundle / "head.glb"], capture_output=True, text=True, timeout=300
    )
    assert run.returncode == 0 and "hair_LOD0 (mesh" in run.stdout.replace("\u2574", " ")
    mesh = hairy.textures.hair_mesh
    high = np.array(re.search(r"Maximum point +\((.*?)\)", run.stdout)[1].split(), float)
    assert high[1] == pytest.approx(mesh.vertices[:, 1].max() / 1000, abs=2e-6)


def test_f3d_draws_the_hair(hairy_bundle, bundle, tmp_path):
    """VTK's reader: the head gets wider, where the bob hangs."""
    import cv2

    if not (shutil.which("f3d") and shutil.which("xvfb-run")):
        pytest.skip("needs f3d")
    widths = []
    for folder in (bundle, hairy_bundle):
        picture = tmp_path / f"{folder.name}.png"
        command = ["xvfb-run", "-a", "f3d", "--resolution=300,300", f"--output={picture}"]
        subprocess.run([*command, str(folder / "head.glb")], check=True, timeout=300)
        drawn = cv2.imread(str(picture)).astype(int)
        shown = np.abs(drawn - drawn[2, 2]).max(2) > 8
        rows = np.flatnonzero(shown.any(1))
        middle = shown[rows[0] + np.ptp(rows) // 2]
        widths.append(np.ptp(np.flatnonzero(middle)) / np.ptp(rows))
    assert widths[1] > 1.15 * widths[0]
