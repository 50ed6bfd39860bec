"""What one frame changes of an avatar's own textures: skin and mouth that something else painted."""

from dataclasses import dataclass

import cv2
import numpy as np


@dataclass(frozen=True, eq=False)
class Painted:
    """Skin and mouth of one frame; the reference and the fast player draw it alike."""

    ratio: np.ndarray  # [h, w, 3] float32 linear: T_0 times it is the skin of the frame
    share: np.ndarray  # [h, w] float32 0..1: how much of that is shown; the rest is equation 4's
    # Of both in the atlas: left, top, width, height, 0..1.
    window: tuple[float, float, float, float]
    mouth: np.ndarray  # [m, n, 3] float32 linear: of the mouth proxy, sized as the baked pictures

    def onto(self, skin: np.ndarray, neutral: np.ndarray, hair: np.ndarray | None) -> None:
        """Lay the skin of the frame onto one that is blended already.

        Args:
            skin: [T, T, C >= 3] float32 linear, with hair on it; its first three channels are changed.
            neutral: [T, T, 3] T_0 without hair.
            hair: [T, T, 4] layer that lies on `skin`, premultiplied; None: none lies there.
        """
        size = len(skin)
        rows, columns, matrix = self.texels(size)
        to = columns.stop - columns.start, rows.stop - rows.start
        flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        ratio = cv2.warpAffine(self.ratio, matrix, to, flags=flags, borderMode=cv2.BORDER_REPLICATE)
        share = cv2.warpAffine(self.share, matrix, to, flags=flags)[..., None]
        made = neutral[rows, columns] * ratio
        if hair is not None:
            layer = hair[rows, columns]
            made = made * (1 - layer[..., 3:]) + layer[..., :3]
        here = skin[rows, columns, :3]
        here += share * (made - here)

    def texels(self, size: int) -> tuple[slice, slice, np.ndarray]:
        """Rows and columns of an atlas of `size` texels that the window touches, and the matrix [2, 3]
        from those texels to the pixels of `ratio`."""
        (left, top, width, height), (h, w) = self.window, self.ratio.shape[:2]
        first = [max(int(np.floor(edge * size)), 0) for edge in (left, top)]
        last = [min(int(np.ceil(edge * size)), size) for edge in (left + width, top + height)]
        scale = np.array([w / (width * size), h / (height * size)])
        start = (np.array(first) + 0.5 - np.array([left, top]) * size) * scale - 0.5
        matrix = np.array([[scale[0], 0, start[0]], [0, scale[1], start[1]]])
        return slice(first[1], last[1]), slice(first[0], last[0]), matrix
