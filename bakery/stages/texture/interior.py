"""Teeth, gums, tongue and the linings, painted in the light of the photo.

The photo shows teeth at most (`texture.teeth`): the reflectance of the others is set, and only the light is
measured.
"""

import numpy as np

from bakery.geometry.color import LUMA
from bakery.geometry.noise import value_noise

# The shade of the lips takes about 15% from incisors (generators.shade, generators.interior).
SHADED = 0.85
# Gums over likely teeth, a tenth less than five people of congress/train who bare them have, for their gloss:
# over the luminance of such teeth 1.12, 0.51, 0.40 (medians), where the tint of teeth is 1.21, 0.96, 0.79.
GUMS = np.array([0.84, 0.48, 0.46], np.float32)
# Wet mucosa against teeth in the same light: published oral-tissue colours lie near L* 50, a* 25.
TONGUE = np.array([0.38, 0.17, 0.165], np.float32)
LINING = np.array([0.25, 0.085, 0.08], np.float32)
SOCKET = np.array([0.45, 0.23, 0.19], np.float32)


def paint_interior(head, neutral, atlas, teeth, usual):
    """Colours of the parts that no photo shows.

    Args:
        teeth: [3] linear, their colour where light falls on them, in the light of the photo.
        usual: [3] linear, the same of other people's in that light: it measures the light.

    Returns:
        rows [n] of the atlas and colours [n, 3] linear.
    """
    light = float(usual @ LUMA) / SHADED
    paints = {
        "teeth_upper": teeth / SHADED,
        "teeth_lower": teeth * (0.95 / SHADED),
        "gums_upper": usual * GUMS / SHADED,
        "gums_lower": usual * GUMS / SHADED,
        "tongue": light * TONGUE,
        "mouth_cavity": light * LINING,
        "eye_socket": light * SOCKET,
    }
    points = atlas.at(neutral)
    rows, colors = [], []
    for part, color in paints.items():
        mine = np.flatnonzero(atlas.rows(part))
        if not len(mine):
            continue
        mottle = 0.06 * value_noise(points[mine], 3.0, 11) + 0.05 * value_noise(
            points[mine], 0.8, 12
        )
        if part.startswith("teeth"):
            mottle *= 0.35
        rows.append(mine)
        colors.append(color * np.exp(mottle)[:, None])
    return np.concatenate(rows), np.concatenate(colors).astype(np.float32)
