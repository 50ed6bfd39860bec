"""Hair that hangs lags behind a head that turns, and comes after it, in pixiv's three-vrm."""

import json
from pathlib import Path

import numpy as np
import pytest

from bakery.plugins import plug_in


@pytest.fixture(scope="module")
def seen(hairdo, avatar, node, tmp_path_factory):
    from dataclasses import replace

    bob = hairdo(avatar.head, avatar.neutral)
    avatar = replace(avatar, textures=replace(avatar.textures, hair_mesh=bob))
    path = tmp_path_factory.mktemp("springs") / "a.vrm"
    plug_in("exporters", "vrm").export(avatar, path, 64)
    found = json.loads(node(Path(__file__).parent / "springs.mjs", path))
    return {name: np.array(value) for name, value in found.items()}


def test_a_bob_swings_and_hangs_as_it_was_made(seen):
    assert seen["joints"] >= 9
    away = np.linalg.norm(seen["rest"] - seen["start"], axis=1)
    assert away.max() < 0.004 and away.mean() < 0.001  # metres


def test_tips_lag_behind_a_turn_and_come_after_it(seen):
    c, s = np.cos(0.5), np.sin(0.5)
    turn = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    rigid = (seen["rest"] - seen["pivot"]) @ turn.T + seen["pivot"]
    below = seen["rest"][:, 1] < seen["pivot"][1] - 0.03
    late = np.linalg.norm(seen["turning"] - rigid, axis=1)
    settled = np.linalg.norm(seen["settled"] - rigid, axis=1)
    assert late[below].max() > 0.01 and late[~below].max() < late[below].max()
    assert settled.mean() < 0.003 and settled[below].mean() < 0.25 * late[below].mean()
