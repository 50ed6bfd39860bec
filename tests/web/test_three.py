"""What other programs make of the GLBs: three.js with the authors' own meshopt decoder."""

import json

import numpy as np
import pytest

from bakery.export.lod import shape_displacements
from bakery.export.web.glb import web_glb
from bakery.export.web.head import PIECES, surfaces
from bakery.formats import meshopt
from bakery.heads.base import PARTS, PROXIES, weights
from bakery.heads.lashes import with_lashes
from bakery.types import EXPRESSIONS


@pytest.fixture(scope="module")
def pieces(head):
    return surfaces(*with_lashes(head, head.mean))


def test_web_head_in_three(head, pieces, node, tmp_path):
    """All 52 names; a mix of shapes, posed by three's own arithmetic, is where the head model is."""
    (tmp_path / "player.glb").write_bytes(web_glb(pieces, EXPRESSIONS, "test"))
    mix = weights({"jawOpen": 0.7, "mouthSmileLeft": 0.5, "eyeBlinkRight": 1.0})
    (tmp_path / "weights.json").write_text(json.dumps(mix.tolist()))
    seen = json.loads(node(__file__.replace("test_three.py", "three.mjs"), tmp_path / "player.glb",
                           tmp_path / "weights.json", tmp_path))  # fmt: skip
    assert seen["names"] == list(EXPRESSIONS)
    assert seen["materials"] == list(PIECES) and seen["clear"] == ["tear", "lashes"]
    found = np.fromfile(tmp_path / "skin.f32", np.float32).reshape(-1, 3) * 1000
    skin = pieces[0]
    wanted = skin.vertices + np.tensordot(mix, skin.shapes, 1)
    # A shape below 5 micrometres is taken for rest, three of them are mixed; steps are 0.5 more.
    np.testing.assert_allclose(found, wanted, atol=0.02)


def test_whole_head_in_three(bundle, avatar, node, tmp_path):
    (tmp_path / "weights.json").write_text(json.dumps([0.0] * 52))
    seen = json.loads(node(__file__.replace("test_three.py", "three.mjs"), bundle / "head.glb",
                           tmp_path / "weights.json", tmp_path))  # fmt: skip
    assert seen["names"] == list(EXPRESSIONS) and seen["scenes"] == 1
    assert seen["materials"] == ["skin", "teeth", "tongue", "tear", "lashes", "eyes"]
    hidden = [PARTS.index(name) for name in PROXIES]
    shown = avatar.head.faces[~np.isin(avatar.head.face_part, hidden)]
    points = avatar.neutral[np.unique(shown)] / 1000
    np.testing.assert_allclose(seen["box"], [points.min(0), points.max(0)], atol=1e-6)  # metres


def test_proxies_in_three(bundle, avatar, node, tmp_path):
    """What bakery's players show in the place of mouth and eyes, where the head model has it."""
    mix = weights({"jawOpen": 0.7})
    (tmp_path / "weights.json").write_text(json.dumps(mix.tolist()))
    seen = json.loads(node(__file__.replace("test_three.py", "three.mjs"), bundle / "proxies.glb",
                           tmp_path / "weights.json", tmp_path))  # fmt: skip
    assert seen["names"] == list(EXPRESSIONS) and seen["materials"] == list(PROXIES)
    points = avatar.head.vertices(avatar.neutral, mix) / 1000
    points = points[np.unique(avatar.head.faces[avatar.head.part_faces(*PROXIES)])]
    np.testing.assert_allclose(seen["box"], [points.min(0), points.max(0)], atol=1e-5)


def test_streams_by_the_authors_decoder_and_ours(node, tmp_path):
    rng = np.random.default_rng(2)
    steps = rng.choice([0, 1, 5, 200], (777, 12), p=[0.7, 0.1, 0.1, 0.1])
    vertices = np.cumsum(steps, 0).astype(np.uint8)
    indices = rng.integers(0, 60_000, 900).astype(np.uint32)
    (tmp_path / "vertices.bin").write_bytes(meshopt.encode_vertices(vertices))
    (tmp_path / "indices.bin").write_bytes(meshopt.encode_indices(indices))
    seen = json.loads(
        node(__file__.replace("test_three.py", "streams.mjs"), tmp_path, 777, 12, 900)
    )
    for which in ("authors", "ours"):
        assert seen[which]["vertices"] == vertices.ravel().tolist()
        assert seen[which]["indices"] == indices.tolist()
    assert seen["cut"] == 2, "ours refuses streams that were cut short"


def test_displacements_are_those_of_the_head(head):
    """A surface's shapes: the head at weight 1 minus the head at rest, eyeballs turned rigidly."""
    shapes = shape_displacements(head, head.mean)
    skin = head.part_vertices("skin")
    jaw = EXPRESSIONS.index("jawOpen")
    np.testing.assert_allclose(shapes[jaw, skin], head.expression_basis[jaw, skin], atol=1e-4)
