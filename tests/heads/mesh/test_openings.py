"""Openings that are not there, or end in nothing: told apart."""

import numpy as np
import pytest

from bakery.geometry.mesh import boundary_loops
from bakery.heads.embed import skin_rims
from bakery.heads.mesh import openings
from bakery.heads.mesh.lining import lining
from bakery.heads.mesh.parts import built_in
from bakery.heads.mesh.read import Surface
from bakery.heads.mesh.transfer import own_shapes


@pytest.fixture(scope="module")
def outer(head):
    """The skin alone, open at lips and lids."""
    whole = Surface(head.mean.astype(float), head.faces)
    return whole.take(head.part_faces("skin"))


def filled(surface, rings):
    """The surface with some borders closed by a fan."""
    points, faces = [surface.vertices], [surface.faces]
    for k, ring in enumerate(rings):
        hub = np.full(len(ring), len(surface.vertices) + k)
        points.append(surface.vertices[ring].mean(0)[None])
        faces.append(np.stack([np.roll(ring, -1), ring, hub], -1))
    return Surface(np.concatenate(points), np.concatenate(faces))


def borders(surface):
    """Lip, left and right lid borders of the skin alone."""
    loops = [loop for loop in boundary_loops(surface.faces) if len(loop) > 50]
    front = [np.array(loop) for loop in loops if surface.vertices[loop, 2].mean() > 0]
    middle = [surface.vertices[loop, 0].mean() for loop in front]
    lips, right, left = np.abs(middle).argmin(), np.argmin(middle), np.argmax(middle)
    return front[lips], front[left], front[right]


def test_a_skin_with_holes_is_open(outer, laid):
    found = openings.find(outer, laid)
    assert not found.sealed and not found.inside.any()
    for ring, border in zip(found.rings, borders(outer)):
        assert set(ring) == set(border.tolist())


@pytest.mark.parametrize("number", range(3))
def test_what_is_filled_is_named(outer, laid, number):
    found = openings.find(filled(outer, [borders(outer)[number]]), laid)
    assert found.sealed == [openings.OPENINGS[number]]


def test_a_lining_meets_the_skin(head, outer, laid):
    """Moved lips take the front of the cavity along and leave its back."""
    shapes = own_shapes(laid)
    patch = built_in(laid, head.part_faces("skin"), laid.vertices, shapes)
    lifted = patch.mean + [0.0, 3.0, 0.0]
    patch = type(patch)(
        patch.parts, lifted, patch.faces, patch.uv, patch.uv_faces, patch.follow,
        patch.identity, patch.expression,
    )  # fmt: skip
    number = np.full(len(head.mean), -1)
    number[np.unique(head.faces[head.part_faces("skin")])] = np.arange(len(lifted))
    contour = tuple(number[half] for half in openings.guide(laid)[0])
    cavity = lining(0, contour, patch, laid, shapes)
    used = np.unique(head.faces[head.part_faces("mouth_cavity")])
    rim = np.isin(used, skin_rims(head)[0])
    moved = cavity.mean - laid.vertices[used]
    np.testing.assert_allclose(moved[rim], [[0, 3, 0]] * rim.sum(), atol=0.02)
    assert np.abs(moved[laid.vertices[used, 2] < -40]).max() < 0.3
    np.testing.assert_allclose(cavity.expression[:, rim], shapes[:, used[rim]], atol=0.02)
