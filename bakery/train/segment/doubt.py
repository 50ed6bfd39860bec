"""Photos whose labels by the tool were looked at and found wrong, and where that is."""

import json
from pathlib import Path

import cv2
import numpy as np

from bakery import landmarks as marks
from bakery.detectors import portrait
from bakery.stages.segment.frame import draw_polygon

LIST = Path(__file__).with_name("doubt.json")  # {name of a photo of congress/train: [fault, ...]}

# What readers write down; each says which pixels are then believed by nobody.
FAULTS = {
    "collar": "a collar, the neck or the jaw is called hair",
    "locks": "hair beside the neck or on the shoulders is called something else",
    "bald": "bare skin above the brows is called hair",
    "top": "hair of the head is called skin or background",
    "ears": "an ear is missed, or is none",
    "eyewear": "glasses are missed, broken, or are none",
    "brow": "brows or eyes are covered, or are none",
    "beard": "a beard is called something else, or is none",
    "neck": "clothes are called skin, or skin clothes",
    "outline": "the person is cut, or has some of the backdrop",
    "lips": "the mouth is off",
}
NEAR_EARS = 0.4  # of the eye distance around an ear's root
LOW_HAIR = 0.3  # of the squared eye distance: less hair than that below the nose is a collar
ABOVE_COLLAR = 0.4  # of the eye distance below the chin: clothes above it may be a neck
WHITE = 55.0  # CIELAB, lightness below which nothing of a white shirt lies
OF_SKIN = 8.0  # CIELAB, hue off the face's own up to which clothes there may be skin


def read() -> dict[str, list[str]]:
    """The faults of each photo by its name without ending."""
    return json.loads(LIST.read_text())


def collars(image: np.ndarray, label: np.ndarray, points: np.ndarray) -> np.ndarray:
    """What is doubted in all photos [H, W] bool: readers found it wrong in every sixth, and smaller in more.

    Bits of hair below the nose are collars, and clothes of the skin's hue beside the chin are neck.

    Args:
        image: [H, W, 3] uint8 sRGB.
        label, points: as in `where`.
    """
    rows = np.arange(len(label))[:, None] + 0.5
    unit = marks.face_size(points)
    low = (label == portrait.HAIR) & (rows > points[2, 1])
    if low.sum() > LOW_HAIR * unit**2:
        low[:] = False
    hue = cv2.cvtColor(image.astype(np.float32) / 255, cv2.COLOR_RGB2LAB)[..., 1:]
    skin = (label == portrait.SKIN) & (rows > points[marks.EYE_CORNERS, 1].mean())
    high = (label == portrait.CLOTH) & (rows < points[152, 1] + ABOVE_COLLAR * unit)
    if skin.any():
        high &= np.linalg.norm(hue - np.median(hue[skin], 0), axis=-1) < OF_SKIN
    return low | high


def tails(image: np.ndarray, label: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Dark clothes beside the neck of people who all wear white [H, W] bool: tied hair, seen behind it.

    Args:
        image: [H, W, 3] uint8 sRGB.
        label, points: as in `where`.
    """
    rows = np.arange(len(label))[:, None] + 0.5
    lightness = cv2.cvtColor(image.astype(np.float32) / 255, cv2.COLOR_RGB2LAB)[..., 0]
    dark: np.ndarray = (label == portrait.CLOTH) & (lightness < WHITE) & (rows > points[2, 1])
    return dark


def where(fault: str, label: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Where a fault of `FAULTS` may be: [H, W] bool.

    Args:
        label: [H, W] uint8 into portrait.CLASSES.
        points: [478, 2] pixels.

    Raises:
        KeyError: no such fault.
    """
    rows, columns = (axis + 0.5 for axis in np.ogrid[: label.shape[0], : label.shape[1]])
    unit = marks.face_size(points)
    brows, eyes, chin = (
        points[marks.BROWS, 1].min(),
        points[marks.EYE_CORNERS, 1].mean(),
        points[152],
    )
    nose = points[2, 1]
    ears = [np.hypot(rows - y, columns - x) < NEAR_EARS * unit for x, y in points[[234, 454]]]

    def called(*classes):
        return np.isin(label, classes)

    skin = called(portrait.SKIN, portrait.EARS, portrait.NECK)
    hair, backdrop = called(portrait.HAIR), called(portrait.BACKGROUND)
    aside = np.abs(columns - chin[0]) > 0.4 * unit
    face = np.zeros(label.shape, np.uint8)
    draw_polygon(face, points[marks.OVAL, :2], 1)
    under = rows > brows - 0.2 * unit
    found: np.ndarray = {
        "collar": hair & (rows > nose),
        "locks": ~(hair | backdrop) & (rows > nose) & aside,
        "bald": hair & (rows < eyes),
        "top": skin & ((rows < brows) | (face == 0)),
        "ears": (ears[0] | ears[1]) & (skin | hair),
        "eyewear": under & (rows < nose) & ~backdrop,
        "brow": np.broadcast_to(under & (rows < eyes + 0.2 * unit), label.shape),
        "beard": (rows > nose) & (skin | hair | called(portrait.BEARD)),
        "neck": (rows > chin[1]) & (skin | called(portrait.CLOTH)),
        "outline": (face == 0) & ~called(portrait.EARS),
        "lips": called(portrait.LIPS, portrait.MOUTH),
    }[fault]
    return found
