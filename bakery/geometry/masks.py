"""Masks [H, W] and what lies around and within them."""

import cv2
import numpy as np


def disk(radius: float) -> np.ndarray:
    """The kernel of a disc of that radius, pixels: [n, n] uint8, a pixel at least."""
    size = 2 * int(radius) + 1
    return cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))


def opened(mask: np.ndarray, radius: float) -> np.ndarray:
    """A mask [H, W] without what is narrower than a disc of that radius, pixels: bool."""
    wide: np.ndarray = cv2.morphologyEx(mask.astype(np.uint8), cv2.MORPH_OPEN, disk(radius)) > 0
    return wide


def beside(mask: np.ndarray) -> np.ndarray:
    """Two pixels around a mask [H, W], and it: bool."""
    near: np.ndarray = cv2.dilate(mask.astype(np.uint8), np.ones((5, 5), np.uint8)) > 0
    return near


def touching(mask: np.ndarray, other: np.ndarray) -> np.ndarray:
    """The patches of a mask [H, W] that come within two pixels of another: bool."""
    _, patch = cv2.connectedComponents(mask.astype(np.uint8))
    found: np.ndarray = mask & np.isin(patch, patch[beside(other)])
    return found
