"""Teeth, gums, tongue and the linings, painted in the light of the photo.

The photo shows none of them, so their reflectance is set and only the level of light is measured.
"""

import numpy as np

from bakery.geometry.color import LUMA
from bakery.geometry.noise import value_noise

# On the toothy smiles of london/train, lit teeth have 1.45 times the luminance of the sclera (median
# of 25, quartiles 1.1 and 1.9) and this tint over their luminance. 1.7 before the lips' shade, which
# takes about 15% from incisors. The limits keep a badly seen sclera from making them dark or glaring.
TEETH_OVER_SCLERA = 1.7
TEETH_TINT = np.array([1.12, 0.975, 0.89], np.float32)
TEETH_LUMINANCE = (0.30, 0.75)  # linear, of a well exposed photo
TEETH_OVER_SKIN = 2.2  # at least; the darkest skins of london/train have 2 to 7
# Wet mucosa against teeth in the same light: published oral-tissue colours lie near L* 50, a* 25.
GUMS = np.array([0.50, 0.21, 0.20], np.float32)
TONGUE = np.array([0.38, 0.17, 0.165], np.float32)
LINING = np.array([0.25, 0.085, 0.08], np.float32)
SOCKET = np.array([0.45, 0.23, 0.19], np.float32)


def teeth_luminance(sclera, skin_tone):
    """Linear luminance of teeth in the light of the photo, from the white of the eye [3].

    The lower limit follows the skin [3] down, or teeth would glow in a dark photo.
    """
    low, high = TEETH_LUMINANCE
    low = min(low, TEETH_OVER_SKIN * float(skin_tone @ LUMA))
    return float(np.clip(TEETH_OVER_SCLERA * (sclera @ LUMA), low, high))


def paint_interior(head, neutral, atlas, sclera, skin_tone):
    """Colours of the parts that no photo shows.

    Args:
        sclera: [3] linear, the white of the eye as photographed: it measures the light.
        skin_tone: [3] linear.

    Returns:
        rows [n] of the atlas and colours [n, 3] linear.
    """
    light = teeth_luminance(sclera, skin_tone)
    paints = {
        "teeth_upper": TEETH_TINT,
        "teeth_lower": TEETH_TINT * 0.95,
        "gums_upper": GUMS,
        "gums_lower": GUMS,
        "tongue": TONGUE,
        "mouth_cavity": LINING,
        "eye_socket": SOCKET,
    }
    points = atlas.at(neutral)
    rows, colors = [], []
    for part, reflectance in paints.items():
        mine = np.flatnonzero(atlas.rows(part))
        if not len(mine):
            continue
        mottle = 0.06 * value_noise(points[mine], 3.0, 11) + 0.05 * value_noise(
            points[mine], 0.8, 12
        )
        if part.startswith("teeth"):
            mottle *= 0.35
        rows.append(mine)
        colors.append(light * reflectance * np.exp(mottle)[:, None])
    return np.concatenate(rows), np.concatenate(colors).astype(np.float32)
