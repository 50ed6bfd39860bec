"""Coarser surfaces keep place, uv and shapes; the file passes Khronos' validator."""

import json
import subprocess
from pathlib import Path

import numpy as np
import pytest

from bakery.export.glb import Surface, write_glb
from bakery.export.lod import RATIOS, head_surfaces, simplify
from bakery.export.manifest import levels_of_detail
from bakery.formats.image import encode_image
from bakery.geometry.mesh import closest_barycentric
from bakery.geometry.raster import rasterize
from bakery.heads.lashes import with_lashes
from bakery.types import EXPRESSIONS

VALIDATOR = Path(__file__).resolve().parents[2] / "node_modules" / "gltf-validator"
VALIDATE = """
const v = require(process.argv[1]), fs = require('fs');
v.validateBytes(new Uint8Array(fs.readFileSync(process.argv[2])), {maxIssues: 20})
 .then(r => console.log(JSON.stringify(r.issues)));
"""


def dome(side=40):
    """A bent sheet whose uv and shapes are known functions of the place: [side^2] vertices."""
    y, x = np.mgrid[0 : 1 : side * 1j, 0 : 1 : side * 1j].reshape(2, -1)
    vertices = np.stack([100 * x, -100 * y, 30 * np.sin(3 * x) * np.cos(2 * y)], 1)
    index = np.arange(side * side).reshape(side, side)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, :-1], index[1:, 1:]
    faces = np.concatenate(
        [np.stack([a, c, b], -1).reshape(-1, 3), np.stack([b, c, d], -1).reshape(-1, 3)]
    )
    shapes = np.zeros((len(EXPRESSIONS), len(vertices), 3), np.float32)
    shapes[0, :, 2] = 10 * x
    shapes[1, :5, 1] = 3
    normals = np.tile([0.0, 0.0, 1.0], (len(vertices), 1))
    return Surface("skin", vertices.astype(np.float32), normals, np.stack([x, y], 1), faces, shapes)


@pytest.mark.parametrize("share", [0.5, 0.2])
def test_uv_and_shapes_follow_the_place(share):
    surface = dome()
    coarse = simplify(surface, share)
    assert len(coarse.faces) <= 1.1 * share * len(surface.faces)
    np.testing.assert_allclose(coarse.uv[:, 0], coarse.vertices[:, 0] / 100, atol=1e-4)
    np.testing.assert_allclose(coarse.uv[:, 1], -coarse.vertices[:, 1] / 100, atol=1e-4)
    np.testing.assert_allclose(coarse.shapes[0, :, 2], coarse.vertices[:, 0] / 10, atol=1e-3)
    low, high = coarse.vertices.min(0), coarse.vertices.max(0)
    np.testing.assert_allclose([low[:2], high[:2]], [[0, -100], [100, 0]], atol=1e-3)  # border


def test_closest_point_of_a_triangle():
    triangle = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    points = np.array([[0.2, 0.3, 5.0], [2, 0, 0], [-1, -1, 0], [1, 1, 0], [0.5, -3, 1]])
    expected = [[0.5, 0.2, 0.3], [0, 1, 0], [1, 0, 0], [0, 0.5, 0.5], [0.5, 0.5, 0]]
    found = closest_barycentric(points, np.tile(triangle, (5, 1, 1)))
    np.testing.assert_allclose(found, expected, atol=1e-12)


def issues_of(path):
    """What Khronos' validator finds; skips where it is not installed."""
    if not VALIDATOR.exists():
        pytest.skip("needs `npm install gltf-validator` in the checkout")
    run = subprocess.run(
        ["node", "-e", VALIDATE, str(VALIDATOR), str(path)], capture_output=True, text=True
    )
    assert run.returncode == 0, run.stderr
    return json.loads(run.stdout)


def test_glb_is_valid_and_named(tmp_path):
    import pygltflib

    surface = dome()
    texture = encode_image(np.full((16, 16, 3), 0.5), ".jpg")
    path = tmp_path / "head.glb"
    cards = encode_image(np.full((4, 8, 4), 0.5), ".png")
    tear, lashes = (Surface(**{**dome(8).__dict__, "name": name}) for name in ("tear", "lashes"))
    levels = [[surface, tear, lashes], [simplify(surface, 0.2)]]
    write_glb(path, levels, EXPRESSIONS, texture, cards, "bakery test")
    document = pygltflib.GLTF2().load(str(path))
    assert document.meshes[0].extras["targetNames"] == list(EXPRESSIONS)
    assert all(len(p.targets) == 52 for mesh in document.meshes for p in mesh.primitives)
    clear = {one.name: one for one in document.materials if one.alphaMode == "BLEND"}
    assert set(clear) == {"tear", "lashes"} and all(one.doubleSided for one in clear.values())
    assert all(one.pbrMetallicRoughness.baseColorTexture.index == 1 for one in clear.values())
    first = path.read_bytes()
    write_glb(path, levels, EXPRESSIONS, texture, cards, "bakery test")
    assert path.read_bytes() == first
    assert issues_of(path)["numErrors"] == 0


def eyeball_pixels(surfaces, weights):
    """Pixels of the eyes seen from the front, 5 a mm."""
    vertices = [s.vertices + np.tensordot(weights, s.shapes, 1) for s in surfaces]
    starts = np.cumsum([0] + [len(v) for v in vertices])
    faces = np.concatenate([s.faces + start for s, start in zip(surfaces, starts)])
    owner = np.concatenate([np.full(len(s.faces), s.name == "eyes") for s in surfaces])
    points = np.concatenate(vertices)
    pixels = np.stack([300 + 5 * points[:, 0], 150 - 5 * points[:, 1]], 1)
    face = rasterize(pixels, 600 - points[:, 2], faces, (300, 600)).face
    return int(owner[face[face >= 0]].sum())


def test_the_coarsest_head_opens_and_shuts_its_eyes(head):
    surfaces = head_surfaces(head, head.mean)
    surfaces = [surface for surface in surfaces if surface.name in ("skin", "eyes")]
    rest, shut = np.zeros(len(EXPRESSIONS)), np.zeros(len(EXPRESSIONS))
    shut[[EXPRESSIONS.index("eyeBlinkLeft"), EXPRESSIONS.index("eyeBlinkRight")]] = 1
    fine = eyeball_pixels(surfaces, rest)
    coarse = [simplify(surface, RATIOS[-1]) for surface in surfaces]
    assert sum(len(surface.faces) for surface in coarse) < 2000
    # Straight edges in place of curved lids: a fifth more or less of the eye.
    assert eyeball_pixels(coarse, rest) == pytest.approx(fine, rel=0.2)
    assert eyeball_pixels(coarse, shut) < 0.01 * fine


def test_cards_stay_whole_and_are_left_out_at_last(head):
    """Alpha lies at the borders of a card, which a simplification may not move."""
    levels = levels_of_detail(*with_lashes(head, head.mean))
    sizes = [{piece.name: len(piece.faces) for piece in level} for level in levels]
    assert sizes[0]["lashes"] == sizes[1]["lashes"] == sizes[2]["lashes"] > 200
    assert "lashes" not in sizes[-1] and "tear" not in sizes[-1]
    cards = [piece for piece in levels[0] if piece.name in ("lashes", "tear")]
    uv = np.concatenate([piece.uv for piece in cards])  # in the picture of their own
    np.testing.assert_allclose([uv.min(0), uv.max(0)], [[0, 0], [1, 1]], atol=1e-5)
