"""Do key textures keep the photo's own detail: pores and stubble where skin does not fold."""

import numpy as np

from bakery.geometry.color import LUMA
from bakery.stages.atlas import make_atlas
from bakery.stages.texture.complete import OBSERVED

BLOCK = 64  # texels a side of the pieces whose spectra are taken
FINE = 1 / 8  # cycles a texel, from which on a spectrum counts as detail
STILL = 0.05  # an edge of the mesh that gets shorter or longer by no more does not fold skin
REST = 0.9  # share of a piece's texels that must be still and photographed


def keep(avatar):
    """How much of the neutral texture's detail each key has, in skin that does not fold.

    Args:
        avatar: runtime.avatar.Avatar.

    Returns:
        {key: {"ratio": amplitude of the key's spectrum above FINE over the neutral's, all pieces
        together; "lowest", "highest": of single pieces, 5th and 95th percentile; "pieces": n}}.
    """
    textures, head = avatar.textures, avatar.head
    size = textures.neutral.shape[0]
    atlas = make_atlas(head, size).take("skin")
    photographed = textures.source == OBSERVED
    before = _luminance(textures.neutral)
    out = {}
    for name, weights, texture in zip(textures.key_names, textures.key_weights, textures.keys):
        moved = head.vertices(avatar.neutral, weights, (0.0, 0.0))
        stretch = edge_stretch(avatar.neutral, moved, head.faces)
        still = atlas.paint(stretch[atlas.face] < STILL, False) & photographed
        after = _luminance(texture)
        pairs = [(amplitude(before[p]), amplitude(after[p])) for p in _pieces(still)]
        if pairs:
            old, new = np.array(pairs).T
            low, high = np.percentile(new / old, [5, 95])
            whole = np.sqrt((new**2).sum() / (old**2).sum())
            out[name] = {"ratio": float(whole), "lowest": float(low), "highest": float(high)}
            out[name]["pieces"] = len(pairs)
    return out


def edge_stretch(rest, moved, faces):
    """Largest change of an edge of each face [F], a share of its length at rest."""
    longest = np.zeros(len(faces))
    for a, b in ((0, 1), (1, 2), (2, 0)):
        before, after = (
            np.linalg.norm(points[faces[:, a]] - points[faces[:, b]], axis=1)
            for points in (rest, moved)
        )
        longest = np.maximum(longest, np.abs(after / np.maximum(before, 1e-9) - 1))
    return longest


def amplitude(piece):
    """Root of the spectrum's power above FINE of a piece [n, n], in its own unit."""
    window = np.hanning(len(piece))
    spectrum = np.fft.fft2((piece - piece.mean()) * np.outer(window, window))
    frequency = np.fft.fftfreq(len(piece))
    fine = np.hypot(frequency[:, None], frequency[None]) > FINE
    return float(np.sqrt((np.abs(spectrum[fine]) ** 2).sum()) / len(piece) ** 2)


def _luminance(texture):
    """Log of the luminance: a change of shading is a step there, not a gain of contrast."""
    return np.log(np.maximum(np.asarray(texture, np.float32) @ LUMA, 1e-3))


def _pieces(still):
    """Slices of the pieces, side by side, that are still."""
    count = len(still) // BLOCK
    share = still[: count * BLOCK, : count * BLOCK].reshape(count, BLOCK, count, BLOCK).mean((1, 3))
    for row, column in np.argwhere(share >= REST):
        yield np.s_[row * BLOCK : (row + 1) * BLOCK, column * BLOCK : (column + 1) * BLOCK]
