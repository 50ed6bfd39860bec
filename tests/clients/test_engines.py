"""head.glb in engines for browsers, which `make clients` installs: alike in shape and colour."""

import json
import shutil
import subprocess
from pathlib import Path

import cv2
import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
VIEWER = ROOT / "bakery" / "runtime" / "viewer" / "node_modules"
MODULES = ROOT / ".work" / "clients" / "node_modules"
POSE = {"jawOpen": 0.5, "mouthSmileLeft": 0.6, "eyeBlinkRight": 1.0}
MOST = 5.0  # of 255, on average over the head


@pytest.fixture(scope="module")
def seen(bundle, tmp_path_factory):
    chromium = next(filter(None, map(shutil.which, ("chromium", "chromium-browser"))), None)
    playwright = VIEWER / "playwright-core" / "index.mjs"
    if not (MODULES.is_dir() and playwright.exists() and chromium and shutil.which("node")):
        pytest.skip("needs chromium, node and engines: make clients")
    folder = tmp_path_factory.mktemp("engines")
    shutil.copy(bundle / "head.glb", folder)
    (folder / "pose.json").write_text(json.dumps(POSE))
    script = Path(__file__).with_name("engines.mjs")
    done = subprocess.run(
        ["node", script, playwright, chromium, MODULES, folder],
        capture_output=True, text=True, timeout=400,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-3000:]
    pictures = {path.stem: cv2.imread(str(path)).astype(int) for path in folder.glob("*.png")}
    return json.loads(done.stdout), pictures


@pytest.mark.parametrize("name", ["three", "babylon", "playcanvas", "model-viewer"])
def test_it_loads_without_a_word(seen, name):
    assert seen[0][name] == []


@pytest.mark.parametrize(
    "name, like",
    [("babylon", "three"), ("playcanvas", "three"), ("model-viewer", "three-rest")],
)
def test_pictures_are_alike(seen, name, like):
    """model-viewer has no word for shapes, so it shows the head at rest."""
    one, other = seen[1][name], seen[1][like]
    head = np.abs(other - other[2, 2]).max(2) > 8
    assert 0.1 < head.mean() < 0.6
    assert np.abs(one - other)[head].mean() < MOST


def test_shapes_are_seen(seen):
    one, other = seen[1]["three"], seen[1]["three-rest"]
    assert np.abs(one - other).max() > 50
