"""Chains of bones for hair that hangs, by known answers."""

import numpy as np
import pytest

from bakery.export.skeleton import to_body
from bakery.export.springs import LINKS, chain_joints, chain_weights, hair_chains, spring_table

PIVOT = np.array([0.0, -40.0, -70.0])


def curtain(angles, length, radius=90.0):
    """Points of a cylinder around the pivot, from 60 mm above it to `length` below."""
    angle, height = np.meshgrid(np.radians(angles), np.arange(60.0, -length - 0.1, -4.0))
    points = [radius * np.sin(angle), height, radius * np.cos(angle)]
    return PIVOT + np.stack(points, -1).reshape(-1, 3)


def test_short_hair_has_none():
    assert hair_chains(curtain(np.arange(0, 360, 5), 30), PIVOT) == []
    assert hair_chains(np.zeros((0, 3)), PIVOT) == []


def test_chains_stand_where_hair_hangs():
    chains = hair_chains(curtain(np.arange(70, 291, 5), 120), PIVOT)
    assert [chain.angle for chain in chains] == [90, 135, 180, 225, 270]
    for chain in chains:
        np.testing.assert_allclose(chain.places[:, 1] - PIVOT[1], np.linspace(0, -118, 4), atol=3)
        away = chain.places[:, [0, 2]] - PIVOT[[0, 2]]
        angle = np.radians(chain.angle)
        towards = away @ (np.sin(angle), np.cos(angle))
        np.testing.assert_allclose(towards, 90, atol=6)  # a little inside of the arc


def test_weights_go_from_the_head_to_the_tips_without_a_step():
    points = curtain(np.arange(70, 291, 5), 120)
    chains = hair_chains(points, PIVOT)
    weights = chain_weights(chains, points, PIVOT)
    assert weights.shape == (len(points), LINKS * len(chains)) and weights.min() >= 0
    total = weights.sum(1)
    assert total.max() <= 1 + 1e-9 and not total[points[:, 1] >= PIVOT[1]].any()
    middle = np.abs(np.degrees(np.arctan2(points[:, 0], points[:, 2] - PIVOT[2]))) > 95
    np.testing.assert_allclose(total[(points[:, 1] < PIVOT[1] - 30) & middle], 1)
    column = weights.reshape(-1, len(np.arange(70, 291, 5)), weights.shape[1])
    assert np.abs(np.diff(column, axis=0)).max() < 0.35  # 4 mm on
    assert np.abs(np.diff(column, axis=1)).max() < 0.12  # 5 degrees on


def test_bones_and_their_table():
    chains = hair_chains(curtain(np.arange(160, 201, 5), 120), PIVOT)
    (chain,) = chains
    links = chain_joints(chains)
    assert [joint.name for joint in links] == [f"hair_180_{k}" for k in range(4)]
    assert [joint.parent for joint in links] == ["head", *[f"hair_180_{k}" for k in range(3)]]
    np.testing.assert_allclose(links[0].place, to_body(chain.places[0]))
    places = {"head": to_body(PIVOT), "neck": to_body(PIVOT - (0, 100, 20)),
              "chest": np.array([0, 1.22, 0])}  # fmt: skip
    number = {name: k for k, name in enumerate([*places, *(joint.name for joint in links)])}
    table = spring_table(chains, number, places, 0.14)
    assert [one["node"] for one in table["springs"][0]["joints"]] == [3, 4, 5, 6]
    sphere = table["colliders"][0]["shape"]["sphere"]
    assert sphere["radius"] == pytest.approx(0.063)
    centre = places["head"] + sphere["offset"]
    away = np.linalg.norm(chain.places[0] / 1000 - (centre - to_body(np.zeros(3))))
    assert away > sphere["radius"]  # the skull does not push hair off at rest
