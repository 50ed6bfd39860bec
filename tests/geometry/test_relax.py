"""Smooth values on a mesh: harmonic between what is fixed, steps spread, constants kept."""

import numpy as np
import pytest

from bakery.geometry.relax import Surface


@pytest.fixture(scope="module")
def strip():
    """A flat grid of 21 x 5 vertices, 1 mm apart."""
    x, y = np.meshgrid(np.arange(21.0), np.arange(5.0))
    vertices = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], 1)
    a = (np.arange(4)[:, None] * 21 + np.arange(20)).ravel()
    faces = np.concatenate([np.stack([a, a + 1, a + 22], 1), np.stack([a, a + 22, a + 21], 1)])
    return vertices, Surface(vertices, faces)


def test_areas_add_up(strip):
    assert strip[1].area.sum() == pytest.approx(20 * 4)


def test_between_what_is_fixed_it_is_harmonic(strip):
    vertices, surface = strip
    x = vertices[:, 0]
    fixed = (x == 0) | (x == 20)
    found = surface.relaxed((x == 20)[:, None], np.zeros(len(x)), fixed, 100.0)[:, 0]
    near = [found[surface.near[a:b]].mean() for a, b in zip(surface.start, surface.start[1:])]
    np.testing.assert_allclose(found[~fixed], np.array(near)[~fixed], atol=4e-3)  # 80 sweeps
    assert found[x == 0].max() == 0 and found[x == 20].min() == 1


def test_a_step_is_spread_over_the_reach(strip):
    vertices, surface = strip
    x = vertices[:, 0]
    found = surface.relaxed((x > 10)[:, None], np.ones(len(x)), np.zeros(len(x), bool), 3.0)[:, 0]
    assert (np.diff(found.reshape(5, 21), axis=1) >= -1e-5).all()
    assert found[x == 4].max() < 0.2 and found[x == 16].min() > 0.8
    assert 0.3 < found[x == 10].mean() < 0.5 and found[x == 9].mean() > 0.15


def test_constants_stay(strip):
    vertices, surface = strip
    same = np.full((len(vertices), 2), 0.7)
    found = surface.relaxed(same, np.ones(len(same)), np.zeros(len(same), bool), 5.0)
    np.testing.assert_allclose(found, same, atol=1e-6)
