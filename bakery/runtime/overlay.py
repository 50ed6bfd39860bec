"""What was found in a photo, drawn over it; words on pictures."""

import cv2
import numpy as np

FONT = cv2.FONT_HERSHEY_SIMPLEX
STRIP, LETTERS = 0.075, 0.034  # of a picture's height: a caption's strip, its capital letters
DIM = 0.4  # what is left of the picture below a caption


def caption(picture: np.ndarray, text: str) -> np.ndarray:
    """The picture with a line of white text on a dark strip along its lower edge.

    Args:
        picture: [H, W, 3] uint8.
    """
    out = picture.copy()
    height, width = picture.shape[:2]
    top = height - round(STRIP * height)
    out[top:] = (out[top:] * DIM + 0.5).astype(np.uint8)
    scale, (across, up) = _letters(text, LETTERS * height)
    if across > 0.92 * width:
        scale, (across, up) = _letters(text, LETTERS * height * 0.92 * width / across)
    place = (round((width - across) / 2), round((top + height + up) / 2))
    cv2.putText(out, text, place, FONT, scale, (255, 255, 255), _stroke(scale), cv2.LINE_AA)
    return out


def _letters(text, capitals):
    """The font's scale for capitals of so many pixels; width and height of a text."""
    (_, unit), _ = cv2.getTextSize("H", FONT, 1.0, 1)
    scale = capitals / unit
    (across, up), _ = cv2.getTextSize(text, FONT, scale, _stroke(scale))
    return scale, (across, capitals)


def _stroke(scale):
    return max(1, round(1.4 * scale))
