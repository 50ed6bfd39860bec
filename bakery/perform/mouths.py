"""The mouth of a frame: the target's own, bent onto what the performer's does (Olszewski 2017, section 5.4).

The paper redraws the mouth that its network inferred, which is soft, with the performer's by SIFT
flow. Here too the performer's sheet says where lips, teeth and tongue are, in the target's colours; the
target's own baked mouth is bent onto it, so that teeth keep their person. The flow is OpenCV's dense
inverse search, which takes milliseconds.

References:
    Kroeger et al., "Fast Optical Flow using Dense Inverse Search", ECCV 2016.
"""

import cv2
import numpy as np

from bakery.geometry.color import to_encoded, to_linear

DARK = 0.02  # sRGB-encoded, in ratios
FAR = 0.08  # of the sheet's width, the farthest that the flow may bend
STIFF = 0.03  # of the sheet's width, sigma by which the flow is smoothed
TONE = 0.08  # of the sheet's width, sigma above which light and shade are the performer's
GAIN = 1.6  # by which they may change the target's own
UNLIKE = 0.16  # sRGB-encoded: where the bent mouth is so far from the performer's, it is not taken


def refined(acted: np.ndarray, own: np.ndarray) -> np.ndarray:
    """The performer's mouth in the target's colours and with the detail of the target's own.

    Args:
        acted: [h, w, 3] sRGB-encoded 0..1, the performer's mouth in the frame, toned as the target's.
        own: [h, w, 3] linear, the mouth that the avatar shows in this pose.

    Returns:
        [h, w, 3] float32 linear.
    """
    width = acted.shape[1]
    sharp = to_encoded(np.clip(own, 0, 1)).astype(np.float32)
    made = np.asarray(acted, np.float32)
    flow = _flow(made, sharp)
    rows, columns = np.mgrid[: made.shape[0], :width].astype(np.float32)
    bent = cv2.remap(
        sharp, columns + flow[..., 0], rows + flow[..., 1], cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_REPLICATE,
    )  # fmt: skip
    want, have = (cv2.GaussianBlur(x, (0, 0), TONE * width) + DARK for x in (made, bent))
    toned = np.clip(bent * np.clip(want / have, 1 / GAIN, GAIN), 0, 1)
    soft = 0.02 * width
    apart = np.abs(cv2.GaussianBlur(toned, (0, 0), soft) - cv2.GaussianBlur(made, (0, 0), soft))
    share = np.exp(-((apart.max(-1) / UNLIKE) ** 2))[..., None]
    out: np.ndarray = to_linear(made + share * (toned - made))
    return out.astype(np.float32)


def _flow(made: np.ndarray, sharp: np.ndarray) -> np.ndarray:
    """Where [h, w, 2] pixels each place of `made` lies in `sharp`, as an offset."""
    width = made.shape[1]
    soft = cv2.GaussianBlur(sharp, (0, 0), 0.01 * width)
    one, other = (
        np.round(cv2.cvtColor(x, cv2.COLOR_RGB2GRAY) * 255).astype(np.uint8) for x in (made, soft)
    )
    search = cv2.DISOpticalFlow_create(cv2.DISOPTICAL_FLOW_PRESET_MEDIUM)
    flow = search.calc(one, other, None)
    length = np.linalg.norm(flow, axis=-1, keepdims=True)
    flow = flow * np.minimum(1, FAR * width / np.maximum(length, 1e-6))
    smooth: np.ndarray = cv2.GaussianBlur(flow, (0, 0), STIFF * width)
    return smooth
