"""Where skin, hair and clothes lie around a face, before any colour is looked at.

Everything is measured in the *face frame*: the photo turned upright and scaled so that the geometric
mean of the face's width and height is `FACE` pixels, with the middle of the face at `CENTER`.
A place in it has an angle from the top of the head, 0..180 degrees to either side, and a radius in
units of the face contour at that angle: 1 is on the contour, 2 twice as far out.
"""

from functools import cache

import cv2
import numpy as np

from bakery import landmarks
from bakery.errors import FitError

SIZE = 400  # rows and columns of the face frame
FACE = 140.0  # pixels, geometric mean of face width and height in the face frame
CENTER = (200.0, 190.0)  # column and row of the middle of the face contour

RADII = (*np.arange(16) / 10, 1.6, 1.8, 2.0, 2.3, 2.7)  # of the tables' rows
DIGITS = "0123456789abcdefghijklmnopqrstuvwxyz"  # probability 0 to 1 in steps of 1/35

# Shares of each class among the people of a training set, averaged over left and right. Rows are
# `RADII`, columns angles from the top of the head (0) to the chin (180) in steps of 7.5 degrees.
# What is missing to one is background.
_SKIN = """
    zzzzzzzzzzzzzzzzzzzzzzzzz
    zzzzzzzzzzzzzzzzzzzzzzzzz
    zzzzzzzzzzzzzzzzzzzzzzzzz
    zzzzzzzzzzzzzzzzzzzzzzzzz
    zzzzzzzzzzzzzzzzzzzzzzzzz
    zzzzzzzzzzzzzzzzzzzzzzzzz
    zzzzzzzzzzzzzzzzzzzzzzzzz
    yyzzzzzzzzzzzzzzzzzzzzzzz
    yyyzyyxwvwxyzzzyzzzzzzzzz
    yyyyxuqnmnqvxxwvvwxyyzzzz
    xxxwtmfa9agqutqmkmpuxyyyy
    wvvrlc5224blpmga78dnuxyyy
    ppnib410027deb73126grxyyy
    ddc8410001355321002amvxyy
    44321000000111000016isvvv
    11000000000000000015fquuu
    00000000000000000014eostt
    00000000000000000014ckpqq
    000000000000000000027ejlm
    0000000000000000000138cfg
    00000000000000000000147ab
"""
_HAIR = """
    0000000000000000000000000
    0000000000000000000000000
    0000000000000000000000000
    0000000000000000000000000
    0000000000000000000000000
    0000000000000000000000000
    0000000000000000000000000
    1100000000000000000000000
    1110112343210000000000000
    1111259cdc942222211100000
    22236dkoqoi83345544311111
    3448entvurk94456666421111
    aachoturolg84445566531111
    mmnqttojfc964333445542100
    vvvvsmga76543222234552110
    xxvrle8532222111223453100
    tsojc74211111111112342100
    jhe9531100000000111231100
    8753110000000000001111000
    2211000000000000000010111
    0000000000000000000000122
"""
_CLOTHES = """
    0000000000000000000000000
    0000000000000000000000000
    0000000000000000000000000
    0000000000000000000000000
    0000000000000000000000000
    0000000000000000000000000
    0000000000000000000000000
    0000000000000000000000000
    0000000000000000000000000
    0000000000000000000000000
    0000000000000000000000000
    0000000000000000000000000
    0000000000000000000000000
    0000000000000000000000011
    0000000000000000000111233
    0000000000000000001223344
    0000000000000000012576666
    0000000000000000027dfca98
    000000000000000015emokged
    00000000000000014cmtuqmji
    00000000000000028irxxvqnm
"""


@cache
def _tables():
    """[angles, radii, 3] float32: shares of skin, hair and clothes."""
    rows = [[[DIGITS.index(c) for c in row] for row in t.split()] for t in (_SKIN, _HAIR, _CLOTHES)]
    return np.ascontiguousarray(np.transpose(np.float32(rows) / 35, (2, 1, 0)))


def face_frame(points):
    """The similarity from photo pixels to the face frame.

    Args:
        points: [478, 2] pixels.

    Returns:
        [2, 3] matrix for column vectors (x, y, 1).

    Raises:
        FitError: the points have no extent.
    """
    across = points[landmarks.LEFT_EYE_OUTER] - points[landmarks.RIGHT_EYE_OUTER]
    width = np.linalg.norm(points[454] - points[234])
    height = np.linalg.norm(points[10] - points[152])
    if min(np.linalg.norm(across), width, height) < 1:
        raise FitError(
            "the landmarks make a face smaller than a pixel, 478 distinct points are needed; check "
            "the landmark file"
        )
    scale = FACE / np.sqrt(width * height)
    cos, sin = scale * across / np.linalg.norm(across)
    turn = np.array([[cos, sin], [-sin, cos]])
    contour = points[landmarks.OVAL] @ turn.T
    middle = (contour.min(0) + contour.max(0)) / 2
    return np.column_stack([turn, CENTER - middle])


def polar(contour):
    """Angle and radius of every pixel of the face frame.

    Args:
        contour: [36, 2] face contour in the face frame.

    Returns:
        angle [SIZE, SIZE] degrees from the top, 0..180 on both sides, and radius [SIZE, SIZE] in
        units of the contour.
    """
    rows, columns = np.mgrid[:SIZE, :SIZE].astype(np.float32) + 0.5
    x, y = columns - np.float32(CENTER[0]), np.float32(CENTER[1]) - rows
    edge_x, edge_y = contour[:, 0] - CENTER[0], CENTER[1] - contour[:, 1]
    length, angle = cv2.cartToPolar(y, x, angleInDegrees=True)  # 0 at the top, clockwise
    edge_angle = np.degrees(np.arctan2(edge_x, edge_y)) % 360
    by_degree = np.interp(
        np.arange(721) / 2, edge_angle, np.hypot(edge_x, edge_y), period=360
    ).astype(np.float32)
    radius = length / by_degree[(angle * 2).astype(np.int32)]
    return np.minimum(angle, 360 - angle), radius


def class_shares(angle, radius):
    """How often skin, hair and clothes are found at a place; see the module.

    Args:
        angle, radius: [H, W] float32 as from `polar`.

    Returns:
        [3, H, W] float32 shares of skin, hair and clothes.
    """
    steps = np.interp(np.arange(300) / 100, RADII, np.arange(len(RADII))).astype(np.float32)
    row = steps[np.minimum(radius * 100, 299).astype(np.int32)]
    shares = cv2.remap(
        _tables(), row, angle / np.float32(7.5), cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
    )
    return np.stack(cv2.split(shares))
