"""What one sample bakes to, as pictures to look at and to hold on to.

Tolerances: half-float textures and another processor's rounding move a pixel by less than 0.02; on
edges of the drawn head a pixel may fall to the other side. The network in bfloat16 moves no pixel of
these pictures by more than 0.005 against single precision, so both are held to the same picture.
"""

from pathlib import Path

import cv2
import numpy as np
import pytest

from bakery.bake.faces import one_face
from bakery.bake.fitting import fit_portrait, own_head
from bakery.bake.kept import Kept
from bakery.bake.mask import draw_masks
from bakery.bake.targets import read_targets
from bakery.bake.textures import paint
from bakery.cli.options import build_options
from bakery.generators import pagan
from bakery.geometry.color import to_encoded
from bakery.hair.layer import HairLayer
from bakery.heads.base import weights
from bakery.heads.file import load_head
from bakery.plugins import plug_in
from bakery.runtime.avatar import Avatar
from bakery.runtime.contact_sheet import BLINK, SMILE, TALK
from bakery.runtime.render import draw, over_gray
from bakery.stages.condition import face_camera

SAMPLE = Path(__file__).resolve().parents[2] / "samples" / "anna.jpg"


class NeutralKept(Kept):
    """The neutral texture, which no generator paints, in memory; all else is made each time."""

    def __init__(self):
        super().__init__()
        self.arrays = {}

    def one(self, name, make):
        if name not in self.arrays:
            self.arrays[name] = make()
        return self.arrays[name]


@pytest.fixture(scope="module")
def bake():
    """A function (generator, targets, *settings) -> Avatar of samples/anna.jpg at 512 texels.

    From her own landmarks.
    """
    photo, face = one_face(SAMPLE, landmarks=SAMPLE.with_suffix(".json"))
    head, options = load_head("makehuman"), build_options("small", [])
    fit, segmentation = fit_portrait(SAMPLE, photo, face, head, options)
    own, neutral = own_head(head, fit)
    masks, kept = draw_masks(head, options), NeutralKept()

    def run(generator, targets, *settings):
        options = build_options("small", settings)
        given = photo, face, fit, segmentation, head, generator, HairLayer(), options
        textures = paint(*given, kept, wanted=targets)
        return Avatar(own, neutral, fit, textures, masks)

    return run


@pytest.fixture(scope="module")
def avatar(bake):
    """With 12 mouths, by the renderer."""
    return bake(plug_in("generators", "rendered"), read_targets(), "texture.mouths=12")


TARGETS = """
[keys.smile]
mouthSmileLeft = 0.8
mouthSmileRight = 0.8
cheekSquintLeft = 0.5
cheekSquintRight = 0.5
[keys.surprise]
browInnerUp = 1.0
jawOpen = 0.5
[gaze]
directions = [[-15, 0], [15, 0]]
[[mouths]]
[[mouths]]
jawOpen = 0.5
[[mouths]]
jawOpen = 0.2
mouthFunnel = 0.7
[[mouths]]
jawOpen = 0.3
mouthSmileLeft = 0.8
mouthSmileRight = 0.8
"""


# Single precision last: `make golden` keeps what was made last.
@pytest.fixture(
    scope="module",
    params=[
        pytest.param(True, marks=pytest.mark.slow, id="bfloat16"),
        pytest.param(False, id="float32"),
    ],
)
def painted(request, bake, tmp_path_factory):
    """By the default generator, in the precision of processors with bfloat16 and of the others."""
    path = tmp_path_factory.mktemp("targets") / "few.toml"
    path.write_text(TARGETS)
    return bake(pagan.load(half=request.param), read_targets(path), "texture.views=[0.0]")


def grid(pictures, columns, size=None):
    """Pictures side by side, [rows * h, columns * w, ...]."""
    pictures = [np.asarray(picture, np.float32) for picture in pictures]
    if size:
        pictures = [cv2.resize(p, (size, size), interpolation=cv2.INTER_AREA) for p in pictures]
    while len(pictures) % columns:
        pictures.append(np.zeros_like(pictures[0]))
    rows = [np.concatenate(pictures[k : k + columns], 1) for k in range(0, len(pictures), columns)]
    return np.concatenate(rows, 0)


def test_key_textures(avatar, golden):
    textures = [avatar.textures.neutral, *avatar.textures.keys]
    golden("keys", to_encoded(grid(textures, 4, 256)), 0.02, 0.01)


def test_gaze_textures(avatar, golden):
    golden("gaze", to_encoded(grid(avatar.textures.gaze, 4)), 0.03, 0.01)


def test_mouth_textures(avatar, golden):
    golden("mouths", to_encoded(grid(avatar.textures.mouths, 4)), 0.03, 0.01)


def test_masks(avatar, golden):
    golden("masks", grid(avatar.masks, 9, 96), 0.01, 0.001)


def expression_sheet(avatar):
    """Four expressions from three sides."""
    pictures = []
    for named in ({}, SMILE, TALK, BLINK):
        expression = weights(named)
        for yaw in (-40, 0, 40):
            camera = face_camera(avatar.fit, avatar.head, avatar.neutral, yaw, size=192, ratio=0.55)
            vertices = avatar.head.vertices(avatar.neutral, expression, (0.0, 0.0))
            frame = draw(avatar, vertices, camera, expression, np.zeros(2))
            pictures.append(to_encoded(over_gray(frame)))
    return grid(pictures, 6)


def test_expression_sheet(avatar, golden):
    golden("expressions", expression_sheet(avatar), 0.04, 0.02)


def test_mouths_and_keys_of_the_network(painted, golden):
    mouths = grid(painted.textures.mouths, 2)
    golden("pagan-mouths", to_encoded(mouths), 0.02, 0.01)
    golden("pagan-keys", to_encoded(grid(painted.textures.keys, 2, 256)), 0.02, 0.01)


def test_expression_sheet_of_the_network(painted, golden):
    golden("pagan-expressions", expression_sheet(painted), 0.04, 0.02)
