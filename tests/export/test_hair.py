"""Hair as glTF surfaces: what each level of detail shows."""

import json

import numpy as np

from bakery.export.hair import MATERIALS, surfaces, write_hair
from bakery.types import HairMesh


def quads():
    """A cap and three cards of a quad each; the coarse level shows the cap and the last card."""
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], np.float32)
    corners = np.array([[0, 1, 2], [0, 2, 3]], np.int32)
    one, side = np.ones((4, 4)), 4
    return HairMesh(
        np.concatenate([square + [0, 0, k] for k in range(4)]).astype(np.float32),
        np.concatenate([corners + 4 * k for k in range(4)]).astype(np.int32),
        np.tile(square[:, :2], (4, 1)), np.repeat([0, 1, 1, 2], 2).astype(np.uint8),
        np.repeat([-1, 0, 1, 2], 2).astype(np.int32), np.repeat([3, 1, 1, 3], 2).astype(np.uint8),
        np.zeros(16, np.float32), np.zeros((side, side, 4), np.float16),
        np.zeros((side, side, 2), np.float16), one.astype(np.float16), one.astype(np.uint8),
    )  # fmt: skip


def test_each_kind_is_a_surface():
    found = surfaces(quads(), 0)
    assert [piece.name for piece in found] == list(MATERIALS)
    assert [len(piece.faces) for piece in found] == [2, 4, 2]
    cards = found[1]
    assert cards.vertices[cards.faces][:, 0, 2].tolist() == [1, 1, 2, 2]  # inside out
    np.testing.assert_allclose(np.linalg.norm(cards.normals, axis=1), 1, atol=1e-6)


def test_a_kind_that_a_level_does_not_show_is_left_out():
    assert [piece.name for piece in surfaces(quads(), 1)] == ["hair_cap", "hair_fringe"]


def test_a_file_of_its_own_says_how_each_kind_is_drawn(tmp_path):
    write_hair(tmp_path / "hair.glb", quads(), "bakery")
    data = (tmp_path / "hair.glb").read_bytes()
    document = json.loads(data[20 : 20 + int.from_bytes(data[12:16], "little")])
    modes = [material.get("alphaMode", "OPAQUE") for material in document["materials"]]
    assert modes == ["OPAQUE", "MASK", "BLEND"]
    assert all(material["doubleSided"] for material in document["materials"])
    assert len(document["meshes"][0]["primitives"]) == 3 and len(document["images"]) == 1
