"""What one sample bakes to, as pictures to look at and to hold on to.

Tolerances: half-float textures and another processor's rounding move a pixel by less than 0.02; on
edges of the drawn head a pixel may fall to the other side.
"""

from pathlib import Path

import cv2
import numpy as np
import pytest

from bakery.bake.faces import one_face
from bakery.bake.fitting import fit_portrait, own_head
from bakery.bake.mask import draw_masks
from bakery.bake.textures import paint
from bakery.cli.options import build_options
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


@pytest.fixture(scope="module")
def avatar():
    """samples/anna.jpg at 512 texels, from her own landmarks, with 12 mouths."""
    options = build_options("small", ["texture.mouths=12"])
    photo, face = one_face(SAMPLE, landmarks=SAMPLE.with_suffix(".json"))
    head = load_head("makehuman")
    fit, segmentation = fit_portrait(SAMPLE, photo, face, head, options)
    generator = plug_in("generators", "rendered")
    textures = paint(photo, face, fit, segmentation, head, generator, HairLayer(), options)
    own, neutral = own_head(head, fit)
    return Avatar(own, neutral, fit, textures, draw_masks(head, options))


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


def test_expression_sheet(avatar, golden):
    """Four expressions from three sides."""
    pictures = []
    for named in ({}, SMILE, TALK, BLINK):
        expression = weights(named)
        for yaw in (-40, 0, 40):
            camera = face_camera(avatar.fit, avatar.head, avatar.neutral, yaw, size=192, share=0.55)
            vertices = avatar.head.vertices(avatar.neutral, expression, (0.0, 0.0))
            frame = draw(avatar, vertices, camera, expression, np.zeros(2))
            pictures.append(to_encoded(over_gray(frame)))
    golden("expressions", grid(pictures, 6), 0.04, 0.02)
