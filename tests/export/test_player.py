"""docs/examples/player.py, which knows docs/bundle.md alone, draws what `bakery render` draws."""

import ast
import runpy
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import OpenEXR
import pytest

from bakery.export.open import open_avatar
from bakery.geometry import camera as cameras
from bakery.geometry.color import to_linear
from bakery.landmarks import EYES, LIPS
from bakery.runtime.framing import head_camera
from bakery.show import frame as frames

PLAYER = Path(__file__).resolve().parents[2] / "docs" / "examples" / "player.py"
SIZE = 160
LEVELS = 1.5  # of 255: the mean difference that a player may have
POSES = {
    "neutral": ({}, (0, 0), None),
    "talking": (
        {"jawOpen": 0.4, "mouthSmileLeft": 0.6, "browInnerUp": 0.5, "eyeBlinkLeft": 0.6},
        (30, 10),
        (12, 5),
    ),
    "tongue": ({"tongueOut": 0.8, "jawOpen": 0.5, "eyeLookUpLeft": 0.6}, (-50, -20), None),
}


@pytest.fixture(scope="module")
def player():
    return runpy.run_path(str(PLAYER))


def regions(avatar, scene, face, alpha):
    """Pixels [H, W] bool of each region of a drawn scene."""
    hair = avatar.textures.hair_mesh
    camera = head_camera(avatar.fit, avatar.head, avatar.neutral, *scene.view, SIZE, hair)
    vertices = avatar.head.vertices(avatar.neutral, scene.expression, scene.gaze)
    marks = cameras.project(avatar.head.landmarks(vertices), camera).astype(np.float32)
    found = {"face": face > 0.5}
    for name, rings in (("eyes", EYES), ("mouth", [LIPS])):
        mask = np.zeros((SIZE, SIZE), np.uint8)
        for ring in rings:
            cv2.fillConvexPoly(mask, cv2.convexHull(marks[ring]).round().astype(int), 1)
        found[name] = mask.astype(bool)
    if hair is not None:
        found["hair"] = (alpha > 0.5) & (face < 0.1)
    return found


@pytest.mark.parametrize(
    "pose, which",
    [
        ("neutral", "bundle"),
        ("talking", "hairy_bundle"),
        pytest.param("tongue", "hairy_bundle", marks=pytest.mark.slow),
    ],
)
def test_the_documents_alone_give_the_picture(pose, which, player, request):
    bundle = request.getfixturevalue(which)
    weights, view, gaze = POSES[pose]
    picture, alpha = player["draw"](bundle, weights, view, gaze, SIZE)
    avatar = open_avatar(bundle)
    scene = frames.Scene(
        **frames.parse(
            weights=",".join(f"{name}={value}" for name, value in weights.items()),
            gaze=gaze and f"{gaze[0]},{gaze[1]}",
            view=f"{view[0]},{view[1]}",
            size=SIZE,
        )
    )
    wanted, face = frames.render(avatar, scene)
    apart = 255 * np.abs(player["encode"](picture) - wanted).mean(-1)
    for name, inside in regions(avatar, scene, face, alpha).items():
        assert inside.sum() > 20, f"{name}: nothing of it is to be seen"
        assert apart[inside].mean() < LEVELS, name
    assert apart.mean() < 0.1  # what is left is rounding: 0.00003 of whole bundles


def test_it_needs_nothing_of_bakery():
    source = PLAYER.read_text(encoding="utf-8")
    assert len(source.splitlines()) <= 200
    imported = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            imported |= {name.name for name in node.names}
        elif isinstance(node, ast.ImportFrom):
            imported.add(node.module)
    assert imported <= {"json", "sys", "pathlib", "numpy", "OpenEXR"}


@pytest.mark.slow  # 9 s, at the usual size
def test_it_writes_a_picture_from_the_command_line(bundle, bakery, tmp_path):
    """The very command of its docstring, against `bakery render` of the usual size."""
    mine, theirs = tmp_path / "mine.exr", tmp_path / "theirs.png"
    arguments = [bundle, mine, '{"jawOpen": 0.6}', "[30, 0]", "[10, 0]"]
    subprocess.run([sys.executable, PLAYER, *arguments], check=True, timeout=300)
    pose = ["--weights", "jawOpen=0.6", "--view", "30,0", "--gaze", "10,0"]
    done = bakery("render", bundle, "-o", theirs, *pose)
    assert done.returncode == 0, done.stderr
    found = OpenEXR.File(str(mine)).parts[0].channels["RGB"].pixels.astype(np.float32)
    wanted = to_linear(cv2.imread(str(theirs))[..., ::-1] / np.float32(255))
    assert found.shape == wanted.shape and np.abs(found - wanted).mean() < 0.004
