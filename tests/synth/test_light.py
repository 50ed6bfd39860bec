"""Lamps and shadows with known answers."""

import numpy as np

from bakery.synth.light import Environment, Lamp, ShadowMap, shine_on, sphere_directions, transfer

SQUARE = np.array([[-50, -50, 0], [50, -50, 0], [50, 50, 0], [-50, 50, 0]], float)
FACES = np.array([[0, 1, 2], [0, 2, 3]])


def test_open_surface_sees_half_the_sky():
    """A flat sheet under an even dome shows its albedo: the transfer of a constant radiance is 1."""
    normals = np.tile([0.0, 0, 1], (4, 1))
    carried, openness = transfer(SQUARE, normals, FACES, count=400)
    even = np.zeros((9, 3))
    even[0] = 1 / 0.282095
    np.testing.assert_allclose(carried @ even, 1, atol=0.03)  # 400 directions
    np.testing.assert_allclose(openness, 1, atol=0.03)


def test_shadow_falls_behind_the_sheet():
    shadow = ShadowMap(SQUARE, FACES, np.array([0, 0, 1.0]), 128)
    points = np.array([[0, 0, -20], [0, 0, 20], [70, 0, -20]], np.float32)
    np.testing.assert_allclose(shadow.lit(points, 0.5, 1.0), [0, 1, 1])


def test_lamp_lights_what_faces_it():
    """Second-order harmonics of a lamp: most where the surface faces it, least behind."""
    lamp = Lamp(np.array([0, 0, 1.0]), np.ones(3), 10.0)
    light = Environment((lamp,), np.zeros((9, 3))).irradiance()
    front, back = shine_on(np.array([[0, 0, 1.0], [0, 0, -1.0]]), light)[:, 0]
    assert 0.9 < front < 1.1 and back < 0.1  # order 2 carries 94% of a clamped cosine


def test_sphere_directions_are_even():
    np.testing.assert_allclose(sphere_directions(500).mean(0), 0, atol=2e-3)
