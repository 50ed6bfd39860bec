"""Sheets of a head model with painted skin: its shapes, and people drawn from its prior."""

from dataclasses import replace

import numpy as np

from bakery.heads.base import gaze_of
from bakery.heads.report.penetrate import singles
from bakery.heads.report.shaded import labelled, tile
from bakery.synth.render import dress, paint
from bakery.synth.scene import Scene, portrait_camera, studio_light
from bakery.synth.subject import Subject, random_subject

SIZE = 220  # pixels of one picture
QUALITY = 0.4  # of the shadows; these pictures are small
DETAIL = 2.5  # pixels a mm of the skin's chart, enough for SIZE


def shapes(head, yaw=0.0, columns=8):
    """All 52 shapes at weight 1 (`penetrate.singles`) on the mean head, with their names: [H, W, 3] encoded 0..1."""
    subject = Subject(
        5, np.zeros(1, np.float32), age=30, melanin=0.4, iris="blue", hair="bald", brow_density=0.8
    )
    wardrobe = dress(head, subject, DETAIL)
    camera = portrait_camera(SIZE, SIZE, yaw=yaw, filling=1.12, middle=(0.5, 0.36))
    pictures = []
    for name, expression in singles().items():
        # Both eyes are painted in one direction: the one that this shape turns its own eye to.
        gaze = gaze_of(expression)
        scene = Scene(
            camera, studio_light(), expression, gaze[np.abs(gaze).sum(1).argmax()], seed=1
        )
        picture = paint(wardrobe, scene, quality=QUALITY).encoded
        pictures.append(labelled(picture, name))
    return tile(pictures, columns)


def people(head, rng, count=24, columns=6):
    """People of the head's own prior in their own hair, every second one turned."""
    pictures = []
    for number in range(count):
        subject = random_subject(rng, head, spread=1.0)
        subject = replace(subject, beard=0.0)  # it would hide the shape
        yaw = (0.0, 30.0, 0.0, -30.0)[number % 4]
        scene = Scene(portrait_camera(300, 300, yaw=yaw, filling=0.72), studio_light(), seed=number)
        wardrobe = dress(head, subject, DETAIL, share=0.6)
        pictures.append(paint(wardrobe, scene, quality=QUALITY).encoded)
    return tile(pictures, columns)
