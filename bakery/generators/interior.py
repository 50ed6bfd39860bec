"""A first shading of eyes and mouth from conditioning channels alone, for the network to start from.

On the deformed neutral teeth are flat and white; a network that starts from them paints them flat too
(after 1,000 steps of training: a white patch between the lips, though 3 dB better there than shaded
teeth). So it starts from teeth with edges, in the shade of lips and lids.

The constants belong to the weights: what is changed here must be trained again. Unlike the rendered
generator (`shade`) this knows no light and no camera, for training pairs carry neither.
"""

import cv2
import numpy as np

from bakery.generators.channels import FAR, NEAR
from bakery.generators.shade import BLUR, EYES, is_part
from bakery.geometry.color import LUMA
from bakery.geometry.fill import around, smoothstep
from bakery.heads.base import MOUTH

FRAME_SCALE = 2.42 / 512  # pixels a mm over the side of a frame: 165 mm take 78% of it
FROM_ABOVE = np.array([0.0, 0.45, 0.89], np.float32)  # where studio light comes from, mostly
RELIEF = 2.5  # mm: coarser shading of teeth is the network's own to say
# Exponent of the relief of painted teeth. Of 12 people of congress/train the gradient between the lips is
# 0.79 of the photo's at 1, 0.85 at 1.5, 0.90 at 2, for 0.09 and 0.21 dB.
EDGES = 1.5
# The same of the shaded texture, of which most shows through: it has its own relief once already. Of ten people of
# congress/val the gradient is 0.70 of the photo's at 0, 0.86 at 0.75, 1.02 at 1.5, for 0.24 and 0.64 dB.
GAPS = 0.6
LIDS, LIPS = 1.1, 5.0  # mm over which lids and lips shade what is behind them
AMBIENT = 0.45  # share of the light that comes from everywhere


def interior_shade(channels, per_mm):
    """Factor [H, W] float32 on linear light: 1 on skin, less in eyes and mouth.

    Args:
        channels: channels.Channels, or anything with the same fields.
        per_mm: pixels a mm at the face.
    """
    part, normals, depth = channels.part, channels.normals, channels.depth
    out = np.ones(part.shape, np.float32)
    eyes, mouth = is_part(part, *EYES), is_part(part, *MOUTH)
    # Light is computed around eyes and mouth alone, as far as its blurs reach.
    if eyes.any():
        window = around(eyes, BLUR * max(LIDS * per_mm, 0.6) + LIDS * per_mm + 1)
        shut = eyes[window]
        out[window] = np.where(shut, _under_lids(shut, per_mm), 1)
    if mouth.any():
        window = around(mouth, BLUR * max(LIPS * per_mm, 1.0) + 2)
        part, mouth = part[window], mouth[window]
        # mm to the camera
        ahead = FAR + (depth[window].astype(np.float32) - 1) * ((NEAR - FAR) / 254)
        behind = float(np.median(ahead[_rim(part, mouth)])) - ahead
        facing = np.clip(normals[window].astype(np.float32) / 127 @ FROM_ABOVE, 0, 1)
        light = _between_lips(mouth, behind, per_mm) * (AMBIENT + (1 - AMBIENT) * facing)
        out[window] = np.where(mouth, light, out[window])
    return out


def teeth_relief(part, shade, per_mm):
    """Log light [H, W] of the edges and gaps of teeth, without their tone; 0 elsewhere.

    A network that minimises a pixel's error leaves the gaps between teeth out, for it cannot know
    where a person's teeth stand; painted over with one colour they are a white bar.

    Args:
        part: [H, W] uint8 into PARTS.
        shade: [H, W] of `interior_shade`.
        per_mm: pixels a mm at the face.
    """
    teeth = is_part(part, "teeth_upper", "teeth_lower")
    out = np.zeros(part.shape, np.float32)
    if not teeth.any():
        return out
    radius = max(RELIEF * per_mm, 0.6)
    window = around(teeth, BLUR * radius)
    inside = teeth[window]
    weight = inside.astype(np.float32)
    light = np.log(np.maximum(shade[window], 0.02)) * weight
    mean = cv2.GaussianBlur(light, (0, 0), radius) / np.maximum(
        cv2.GaussianBlur(weight, (0, 0), radius), 1e-3
    )
    out[window] = np.where(inside, light - mean, 0)
    return out


def teeth_toned(color, alpha, shaded, part):
    """Colour [H, W, 3] that is painted over teeth, in the mean colour that the shaded texture's teeth have.

    The photo says more of that than the network knows: it makes teeth yellower than real ones, greenish in
    bluish light, and those of a wide smile lighter than those of a narrow one. What differs from tooth
    to tooth stays; so do other colours than teeth's, as lips before them.

    Args:
        color: [H, W, 3] linear; alpha: [H, W] 0..1.
        shaded: [H, W, 3] linear, the deformed neutral in the shade of the lips.
        part: [H, W] uint8 into PARTS.
    """
    teeth = is_part(part, "teeth_upper", "teeth_lower")
    own = color[teeth]
    # Pale is what teeth are; what is redder than them is a lip or the tongue that hides them.
    pale = smoothstep(2.2, 1.4, own[:, 0] / np.maximum(own[:, 1], 1e-4))
    weight = alpha[teeth] * pale * (own @ LUMA)  # what is seen best says most
    if weight.sum() < 1e-3:
        return color
    change = (weight @ shaded[teeth]) / np.maximum(weight @ own, 1e-6)
    out = color.copy()
    out[teeth] = own * (1 + pale[:, None] * (change - 1))
    return out


def _under_lids(eyes, per_mm):
    """Light under the lids: the upper one hides about half of the sky from the strip below it."""
    radius = max(LIDS * per_mm, 0.6)
    covered = cv2.GaussianBlur((~eyes).astype(np.float32), (0, 0), radius)
    shift = np.float32([[1, 0, 0], [0, 1, 0.9 * radius]])
    covered = cv2.warpAffine(
        covered, shift, eyes.shape[::-1], flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
    )
    return 1 - 0.62 * smoothstep(0.15, 1.0, covered)


def _between_lips(mouth, behind, per_mm):
    """Light between the lips, `behind` mm behind them: less near a lip and deep inside."""
    opening = mouth.astype(np.float32)
    near = cv2.GaussianBlur(opening, (0, 0), max(1.2 * per_mm, 0.6))
    far = cv2.GaussianBlur(opening, (0, 0), max(LIPS * per_mm, 1.0))
    deep = 1 / (1 + (np.maximum(behind, 0) / 17.0) ** 2)
    return (
        (0.55 + 0.45 * smoothstep(0.25, 0.95, near)) * (0.75 + 0.25 * smoothstep(0.1, 0.6, far)) * deep
    )  # fmt: skip


def _rim(part, mouth):
    """Pixels of skin next to the mouth's interior; the interior itself where there are none."""
    near = cv2.dilate(mouth.astype(np.uint8), np.ones((5, 5))) > 0
    rim = near & is_part(part, "skin")
    return rim if rim.any() else mouth
