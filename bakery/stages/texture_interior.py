"""Teeth, gums, tongue and the linings, painted in the light of the photo.

The photo shows none of them, so their reflectance is set and only the level of light is measured.
"""

import numpy as np

from bakery.geometry.color import LUMA
from bakery.geometry.noise import value_noise

# Linear reflectance. Teeth: shade A2 of dental guides is about L* 74; wet mucosa: published
# oral-tissue colours are near L* 50, a* 25.
SCLERA = 0.52
TEETH = np.array([0.66, 0.60, 0.49], np.float32)  # 1.25 times the sclera (PITFALLS 5: 1.2 to 1.4)
GUMS = np.array([0.36, 0.155, 0.15], np.float32)
TONGUE = np.array([0.34, 0.15, 0.145], np.float32)
LINING = np.array([0.22, 0.075, 0.07], np.float32)
SOCKET = np.array([0.40, 0.20, 0.17], np.float32)


def paint_interior(head, neutral, atlas, sclera, skin_tone):
    """Colours of the parts that no photo shows.

    Args:
        sclera: [3] linear, the white of the eye as photographed: it measures the light.
        skin_tone: [3] linear, for the sides of lashes.

    Returns:
        rows [n] of the atlas and colours [n, 3] linear.
    """
    light = float(sclera @ LUMA) / SCLERA
    paints = {
        "teeth_upper": TEETH,
        "teeth_lower": TEETH * 0.95,
        "gums_upper": GUMS,
        "gums_lower": GUMS,
        "tongue": TONGUE,
        "mouth_cavity": LINING,
        "eye_socket": SOCKET,
        "tear": SOCKET,
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
    lashes = np.flatnonzero(atlas.rows("lashes"))
    rows.append(lashes)
    colors.append(np.tile(0.06 * skin_tone, (len(lashes), 1)))
    return np.concatenate(rows), np.concatenate(colors).astype(np.float32)
