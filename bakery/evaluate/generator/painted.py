"""The generator on painted people that it was not trained on, measured as paGAN's table 1 is.

Outside the face all is black, and the mask of the fitted geometry is feathered, as paGAN section 7 masks
its pictures: where a fitted outline lies a pixel beside the true one, a hard edge would measure the fit.
"""

from itertools import islice

import cv2
import numpy as np

from bakery.evaluate.metrics import mse, psnr, ssim
from bakery.generators.channels import NONE
from bakery.generators.interior import FRAME_SCALE, interior_shade
from bakery.generators.pagan import NOMINAL
from bakery.generators.unet import input_channels
from bakery.geometry.color import to_encoded, to_linear
from bakery.geometry.fill import smoothstep
from bakery.parallel import side_by_side
from bakery.synth.pairs import iterate

FEATHER = 0.016  # of the picture's side: 8 pixels of 512
FIGURES = ("mse", "ssim", "psnr", "ssim_hard")


def measure(folder, networks, most=None):
    """Mean figures over the pairs of a folder of shards; outside the face all is black.

    Args:
        networks: {name: generators.pagan.PaganGenerator}.
        most: this many pairs only.

    Returns:
        {name of a network, or "deformed": {figure: mean}, "pairs": n, "subjects": n}; "ssim_hard" is
        that of the mask without the feather.

    References:
        paGAN, table 1.
    """
    found, subjects = {}, set()
    pairs = islice(iterate(folder), most)
    for subject, scores in side_by_side(lambda pair: _scores(pair, networks), pairs):
        subjects.add(subject)
        for name, score in scores.items():
            found.setdefault(name, []).append(score)
    means = {
        name: dict(zip(FIGURES, np.mean(rows, 0).round(4).tolist())) for name, rows in found.items()
    }
    return means | {"pairs": len(found["deformed"]), "subjects": len(subjects)}


def feathered(pair):
    """The face of a pair [S, S] 0..1, fading out before the outline of what the conditions draw."""
    drawn = (pair.part != NONE).astype(np.uint8)
    inside = cv2.distanceTransform(drawn, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    return pair.face / np.float32(255) * smoothstep(0, FEATHER * len(drawn), inside)


def _scores(pair, networks):
    """The subject of a pair, and {name: figures} of its target in every way."""
    truth, whole = pair.target / np.float32(255), np.ones(pair.face.shape, bool)
    soft, hard = feathered(pair)[..., None], pair.face[..., None] / np.float32(255)
    found = {}
    for name, picture in _pictures(pair, networks):
        ours, true = picture * soft, truth * soft
        found[name] = (
            mse(ours, true, whole) * 255**2,
            ssim(ours, true, whole),
            psnr(ours, true, whole),
            ssim(picture * hard, truth * hard, whole),
        )
    return pair.subject, found


def _pictures(pair, networks):
    """(name, picture [S, S, 3] sRGB-encoded) of a pair's target in every way."""
    yield "deformed", pair.deformed / np.float32(255)
    side = pair.part.shape[0]
    shade = interior_shade(pair, FRAME_SCALE * side)
    expressed = {"strain": pair.strain, "folds": pair.folds}
    channels = input_channels(pair, pair.photo, shade, expressed)
    base = to_linear(channels["deformed"] / np.float32(255))
    for name, network in networks.items():
        change = network.paint_scaled(channels, FRAME_SCALE * side / NOMINAL)
        alpha = change[..., 6:]
        made = base * np.exp(change[..., :3]) * (1 - alpha) + change[..., 3:6] * alpha
        yield name, to_encoded(np.clip(made, 0, 1))
