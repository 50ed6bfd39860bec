"""Which uv can be used, and what xatlas makes where there is none."""

from dataclasses import replace

import numpy as np
import pytest

from bakery.geometry.raster import rasterize
from bakery.heads.mesh import unwrap
from bakery.heads.mesh.read import pieces
from bakery.heads.mesh.search import Nearest
from bakery.heads.mesh.transfer import Pairs


@pytest.fixture(scope="module")
def marked(head, skin):
    return Nearest(skin.vertices, skin.faces).query(head.landmarks(head.mean)[:468])[0]


@pytest.fixture(scope="module")
def pairs(head, skin, numbers):
    """Every face and vertex corresponds to itself."""
    own = head.part_faces("skin", "eye_socket", "mouth_cavity")
    vertex_face = np.zeros(len(numbers), int)
    corner = np.zeros((len(numbers), 3))
    order = np.argsort(head.face_part[own], kind="stable")[::-1]  # of a rim the skin decides
    for k in range(3):
        at = skin.faces[order, k]
        vertex_face[at] = own[order]
        corner[at] = np.eye(3)[k]
    return Pairs(own, vertex_face, corner, np.ones(len(numbers)))


def overlap(uv, uv_faces):
    area = np.abs(unwrap._areas(uv, uv_faces)).sum() * unwrap.SIZE**2
    seen = rasterize(uv * unwrap.SIZE, None, uv_faces, (unwrap.SIZE,) * 2).face >= 0
    return 1 - seen.sum() / area


def test_the_head_s_own_uv_can_be_used(skin, marked):
    assert unwrap.unusable(skin, marked) is None


def test_uv_that_cannot_is_told_why(skin, marked):
    assert "no uv" in unwrap.unusable(replace(skin, uv=None, uv_faces=None), marked)
    assert "outside 0..1" in unwrap.unusable(replace(skin, uv=skin.uv * 3), marked)
    half = skin.uv * [2, 1] % 1
    assert "on itself" in unwrap.unusable(
        replace(skin, uv=np.abs(skin.uv * [2, 1] - [1, 0])), marked
    )
    assert unwrap.unusable(replace(skin, uv=half), marked) is not None
    assert "no area" in unwrap.unusable(replace(skin, uv=0 * skin.uv + 0.5), marked)
    assert "are needed" in unwrap.unusable(replace(skin, uv=0.2 * skin.uv), marked)
    torn = replace(skin, uv=skin.uv[skin.uv_faces.ravel()])
    torn = replace(torn, uv_faces=np.arange(len(torn.uv)).reshape(-1, 3))
    assert "several charts" in unwrap.unusable(torn, marked)


def test_a_carried_layout_keeps_the_face_in_one_chart(head, skin, marked, pairs, laid, monkeypatch):
    monkeypatch.setattr(unwrap, "RELAXED", 2)  # stretch is looked at in test_import.py
    part = np.array(["skin"] * len(skin.faces))
    hint = unwrap.carried(skin.vertices, skin.faces, part, pairs, laid)
    uv, uv_faces, charts = unwrap.unwrap(skin.vertices[skin.faces], hint)
    assert uv.min() >= 0 and uv.max() <= 1 and len(uv_faces) == len(skin.faces)
    assert overlap(uv, uv_faces) < 0.005
    assert len(np.unique(pieces(uv_faces)[marked])) == 1
    assert charts < 40  # xatlas left alone makes 122, and 40 of the face


def test_without_a_hint_xatlas_does_it_all(head):
    """The tongue: a closed strip of 448 triangles."""
    faces = head.faces[head.part_faces("tongue")]
    uv, uv_faces, charts = unwrap.unwrap(head.mean[faces].astype(float))
    assert charts >= 1 and len(uv_faces) == len(faces)
    assert uv.min() >= 0 and uv.max() <= 1
    assert overlap(uv, uv_faces) < 0.01


@pytest.mark.parametrize("bad", [np.inf, np.nan, 1e30])
def test_what_xatlas_would_hang_on_is_refused(bad):
    corners = np.random.default_rng(0).random((4, 3, 3))
    corners[1, 2, 0] = bad
    with pytest.raises(ValueError, match="would not end"):
        unwrap.unwrap(corners)


def test_a_folded_layout_is_unfolded():
    """A flat grid whose middle was turned inside out lies flat again, its rim where it was."""
    n = 21
    x, y = np.meshgrid(np.linspace(0, 1, n), np.linspace(0, 1, n))
    flat = np.stack([x, y], -1).reshape(-1, 2)
    corner = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    faces = np.concatenate([
        np.stack([corner, corner + 1, corner + n + 1], -1),
        np.stack([corner, corner + n + 1, corner + n], -1),
    ])  # fmt: skip
    points = np.concatenate([100 * flat, np.zeros((n * n, 1))], 1)
    folded = flat.copy()
    near = np.abs(flat - 0.5).max(1) < 0.16
    folded[near] = 1 - folded[near]
    assert (unwrap._areas(folded, faces) <= 0).any()
    uv, right = unwrap.unfolded(folded, points, faces, np.ones(n * n))
    assert right.all() and (unwrap._areas(uv, faces) > 0).all()
    np.testing.assert_allclose(uv, flat, atol=0.01)  # the least stretch is none
