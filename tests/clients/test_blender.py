"""head.glb and the USD file in Blender, which `make clients` installs as a Python module."""

import importlib.util
import json
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest

from bakery.export.lod import head_surfaces
from bakery.export.open import open_avatar
from bakery.export.skeleton import BONES
from bakery.heads.base import weights
from bakery.plugins import plug_in

POSE = {"jawOpen": 0.5, "mouthSmileLeft": 0.6, "eyeBlinkRight": 1.0}


@pytest.fixture(scope="module")
def avatar(bundle):
    if importlib.util.find_spec("bpy") is None:
        pytest.skip("needs bpy: make clients")
    return open_avatar(bundle)


@pytest.fixture(scope="module")
def seen(avatar, tmp_path_factory):
    """What Blender makes of each file: name -> (points by mesh, picture)."""
    folder = tmp_path_factory.mktemp("blender")
    (folder / "pose.json").write_text(json.dumps(POSE))
    found = {}
    for name in ("glb", "usd"):
        if name == "usd" and importlib.util.find_spec("pxr") is None:
            continue
        exporter = plug_in("exporters", name)
        file = folder / f"head{exporter.suffix}"
        exporter.export(avatar, file, 512)
        script = Path(__file__).with_name("blender.py")
        command = [sys.executable, script, file, folder / "pose.json", folder / name]
        done = subprocess.run(command, capture_output=True, text=True, timeout=300)
        assert done.returncode == 0, done.stderr[-2000:]
        found[name] = dict(np.load(folder / f"{name}.npz")), cv2.imread(str(folder / f"{name}.png"))
    return found


def test_shapes_move_what_they_move_here(seen, avatar):
    """Every vertex of the level that is shown, by the nearest of ours: Blender merges none."""
    ours = {
        piece.name: piece.vertices + np.tensordot(weights(POSE), piece.shapes, 1)
        for piece in head_surfaces(avatar.head, avatar.neutral)
    }
    for name, (points, _) in seen.items():
        assert sorted(points["bones"]) == sorted(BONES), name
        box = {
            "eyes": points["eyes_LOD0" if name == "glb" else "eyes"],
            "head": points["head_LOD0"] if name == "glb" else np.concatenate(
                [points[piece] for piece in ours if piece != "eyes"]
            ),
        }  # fmt: skip
        for part, places in box.items():
            places = places[:, [0, 2, 1]] * (1000, 1000, -1000)  # +z up, face to -y
            mine = np.concatenate(
                [ours[one] for one in ours if (one == "eyes") == (part == "eyes")]
            )
            # mm; each of three shapes may leave 0.1 at rest.
            np.testing.assert_allclose(places.min(0), mine.min(0), atol=0.3)
            np.testing.assert_allclose(places.max(0), mine.max(0), atol=0.3)
            assert len(places) == len(mine)


def test_both_files_show_the_same_picture(seen):
    if len(seen) < 2:
        pytest.skip("needs usd-core")
    one, other = (picture.astype(int) for _, picture in seen.values())
    assert one.std() > 20 and np.abs(one - other).mean() < 1
