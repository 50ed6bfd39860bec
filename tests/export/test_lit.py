"""The lit variant of head.glb: relief, tangents, materials, by known answers; the file by its judge."""

import json
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from bakery.export import lit
from bakery.export.glb import Surface
from bakery.export.lod import head_surfaces
from bakery.export.tangents import with_tangents
from bakery.formats.targets import OTHERS
from bakery.geometry.mesh import vertex_normals
from bakery.plugins import plug_in
from bakery.stages.atlas import make_atlas, uv_polygon
from bakery.testing import refuses
from bakery.types import EXPRESSIONS

VALIDATOR = Path(__file__).resolve().parents[2] / "node_modules" / "gltf-validator"
VALIDATE = (
    "require(process.argv[1]).validateBytes(new Uint8Array(require('fs').readFileSync(process.argv[2])"
    ")).then(r => console.log(JSON.stringify(r.issues)))"
)
SIDE = 256


def plate(mirrored=False):
    """A square of two triangles that faces +z, u to the right, v down; or u to the left."""
    vertices = np.array([[0, 0, 0], [1, 0, 0], [1, -1, 0], [0, -1, 0]], np.float32)
    uv = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], np.float32)
    if mirrored:
        uv[:, 0] = 1 - uv[:, 0]
    turn = np.array([[0, 0, 1], [0, 1, 0], [-1, 0, 0]], np.float32)  # a quarter about +y
    normals = np.tile(np.array([0, 0, 1], np.float32), (4, 1))
    return Surface(
        "skin", vertices, normals, uv, np.array([[0, 2, 1], [0, 3, 2]]),
        (vertices @ turn.T - vertices)[None], (normals @ turn.T - normals)[None],
    )  # fmt: skip


@pytest.mark.parametrize("mirrored", [False, True])
def test_tangents_go_along_u_and_turn_with_a_shape(mirrored):
    piece, sign = with_tangents(plate(mirrored)), -1 if mirrored else 1
    np.testing.assert_allclose(piece.tangents, np.tile([sign, 0, 0, sign], (4, 1)), atol=1e-6)
    up = np.cross(piece.normals, piece.tangents[:, :3]) * piece.tangents[:, 3:]
    np.testing.assert_allclose(up, np.tile([0, 1, 0], (4, 1)), atol=1e-6)  # against v
    turned = piece.tangents[:, :3] + piece.twists[0]
    np.testing.assert_allclose(turned, np.tile([0, 0, -sign], (4, 1)), atol=1e-6)


def test_tangents_of_the_head_lie_across_its_normals(head):
    skin = with_tangents(head_surfaces(head, head.mean)[0])
    along = skin.tangents[:, :3]
    np.testing.assert_allclose(np.linalg.norm(along, axis=1), 1, atol=1e-5)
    np.testing.assert_allclose((along * skin.normals).sum(1), 0, atol=1e-5)
    assert set(np.unique(skin.tangents[:, 3])) <= {-1.0, 1.0}


def test_the_normals_of_a_known_relief(head):
    """A height that grows with x by c a mm tilts each normal by the slope along the surface."""
    c, atlas = 0.2, make_atlas(head, SIDE).take("skin")
    height = atlas.paint(atlas.at(head.mean)[:, 0] * np.float32(c))
    found = lit.relief_normals(head, head.mean, height)
    normal = atlas.paint(atlas.at(vertex_normals(head.mean, head.faces)))
    normal /= np.maximum(np.linalg.norm(normal, axis=2, keepdims=True), 1e-6)
    slope = c * np.sqrt(np.clip(1 - normal[..., 0] ** 2, 0, 1))
    face = uv_polygon(head, np.array([50, 280, 425, 205]), 0.9, SIDE) > 0  # both cheeks
    tilt = np.degrees(np.arccos(found[..., 2]) - np.arctan(slope))[face]
    assert face.sum() > 100 and np.abs(tilt).mean() < 0.5
    # Towards lower ground: u grows with x on the face, so the normals lean against u.
    assert (found[face][:, 0] < 0).all()
    np.testing.assert_allclose(np.linalg.norm(found, axis=2), 1, atol=1e-5)


def test_relief_is_of_bare_skin_alone(head):
    rng = np.random.default_rng(2)
    texture = 0.3 * np.exp(0.05 * rng.standard_normal((SIDE, SIDE, 1))) * np.ones(3)
    covered = np.zeros((SIDE, SIDE), np.float32)
    covered[: SIDE // 8] = 1
    height = lit.relief(head, texture.astype(np.float32), covered)
    cheek = uv_polygon(head, np.array([50, 205, 187]), 0.8, SIDE) > 0
    assert 0.5 < height[cheek].std() / (0.05 * lit.DEPTH) < 1.1
    darker = np.corrcoef(height[cheek], np.log(texture[cheek][:, 0]))[0, 1]
    assert darker > 0.9  # dark lies deep
    for ring, _ in lit.SMOOTH:
        assert np.abs(height[uv_polygon(head, ring, 1.0, SIDE) > 0]).max() < 1e-5
    assert np.abs(height[: SIDE // 8]).max() < 1e-5


@pytest.fixture(scope="module", params=["glb-lit", "glb-full"])
def made(hairy, tmp_path_factory, request):
    path = tmp_path_factory.mktemp("lit") / "a.glb"
    plug_in("exporters", request.param).export(hairy, path, 1024)
    return path


def test_the_full_one_has_visemes_too(made, glb, request):
    full = "glb-full" in request.node.name
    document, _ = glb[0](made.read_bytes())
    heads = [mesh for mesh in document["meshes"] if mesh["name"].startswith("head_LOD")]
    names = [*EXPRESSIONS, *OTHERS] if full else list(EXPRESSIONS)
    assert len(heads) == 4 and all(mesh["extras"]["targetNames"] == names for mesh in heads)


def test_every_primitive_has_both_materials(made, glb):
    document, _ = glb[0](made.read_bytes())
    named = document["extensions"]["KHR_materials_variants"]["variants"]
    assert [variant["name"] for variant in named] == ["photo", "lit"]
    materials = document["materials"]
    for primitive in (one for mesh in document["meshes"] for one in mesh["primitives"]):
        photo, lamp = primitive["extensions"]["KHR_materials_variants"]["mappings"]
        assert (photo["variants"], lamp["variants"]) == ([0], [1])
        assert photo["material"] == primitive["material"]  # programs without variants show it
        one, other = materials[photo["material"]], materials[lamp["material"]]
        assert other["name"] == f"{one['name']}_lit"
        assert "KHR_materials_unlit" not in other.get("extensions", {})
        assert ("normalTexture" in other) == (one["name"] == "skin")
        assert ("TANGENT" in primitive["attributes"]) == (one["name"] == "skin")
        assert "normalTexture" not in one
    skin = next(one for one in materials if one["name"] == "skin_lit")
    share = skin["extensions"]["KHR_materials_specular"]["specularFactor"]
    assert share == pytest.approx((0.4 / 2.4) ** 2 / 0.04, abs=1e-3)


def test_hair_is_there_from_both_sides_once_each(made, glb):
    document, _ = glb[0](made.read_bytes())
    hair = [one for one in document["materials"] if one["name"].startswith("hair")]
    assert len(hair) == 6 and not any(one.get("doubleSided") for one in hair)


def test_it_is_a_good_file_of_less_than_ten_megabytes(made):
    assert made.stat().st_size < 10e6
    if not VALIDATOR.exists() or shutil.which("node") is None:
        pytest.skip("needs `npm install gltf-validator` in the checkout")
    command = ["node", "-e", VALIDATE, str(VALIDATOR), str(made)]
    said = json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
    assert said["numErrors"] == 0 and said["numWarnings"] == 0, said["messages"][:5]


@pytest.mark.parametrize("name", ["glb-lit", "usd"])
def test_a_bundle_without_albedo_is_refused(name, avatar, tmp_path):
    if name == "usd":
        pytest.importorskip("pxr", reason="needs usd-core, the extra usd")
    bare = replace(avatar.textures, albedo=np.zeros((0, 0, 3), np.float16))
    old = replace(avatar, textures=bare)
    exporter = plug_in("exporters", name)
    refuses(lambda: exporter.export(old, tmp_path / "a", 64), "albedo", "bake")
    assert list(tmp_path.iterdir()) == []


def test_pictures_are_of_the_size_that_is_asked(avatar):
    pictures = lit.lit_pictures(avatar, 128)
    sides = {
        name: cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR).shape[:2]
        for name, data in vars(pictures).items()
    }
    assert sides == {"color": (128, 128), "roughness": (64, 64), "normal": (128, 128)}
