"""The generator on painted people that it was not trained on, measured as paGAN's table 1 is."""

from itertools import islice

import numpy as np

from bakery.evaluate.metrics import mse, psnr, ssim
from bakery.generators.interior import FRAME_SCALE, interior_shade
from bakery.generators.pagan import NOMINAL
from bakery.generators.strain import strain_plane
from bakery.generators.unet import input_layers
from bakery.geometry.color import to_encoded, to_linear
from bakery.heads.file import load_head
from bakery.parallel import side_by_side
from bakery.synth.pairs import iterate


def measure(folder, networks, most=None):
    """Mean figures over the pairs of a folder of shards; outside the face all is black.

    Args:
        networks: {name: generators.pagan.PaganGenerator}.
        most: this many pairs only.

    Returns:
        {name of a network, or "deformed": {"mse", "ssim", "psnr"}, "pairs": n, "subjects": n}.

    References:
        paGAN, table 1.
    """
    found, subjects = {}, set()
    pairs, head = islice(iterate(folder), most), load_head()
    for subject, scores in side_by_side(lambda pair: _scores(pair, networks, head), pairs):
        subjects.add(subject)
        for name, score in scores.items():
            found.setdefault(name, []).append(score)
    means = {
        name: dict(zip(("mse", "ssim", "psnr"), np.mean(rows, 0).round(4).tolist()))
        for name, rows in found.items()
    }
    return means | {"pairs": len(found["deformed"]), "subjects": len(subjects)}


def _scores(pair, networks, head):
    """The subject of a pair, and {name: figures} of its target in every way."""
    face = pair.face[..., None] / np.float32(255)
    truth = pair.target / np.float32(255) * face
    ways = _pictures(pair, networks, head)
    return pair.subject, {name: _score(picture * face, truth) for name, picture in ways}


def _pictures(pair, networks, head):
    """(name, picture [S, S, 3] sRGB-encoded) of a pair's target in every way."""
    yield "deformed", pair.deformed / np.float32(255)
    side = pair.part.shape[0]
    shade = interior_shade(pair, FRAME_SCALE * side)
    strain = strain_plane(head, pair.expression, pair.landmarks, (side, side))
    layers = input_layers(pair, pair.photo, shade, strain)
    base = to_linear(layers["deformed"] / np.float32(255))
    for name, network in networks.items():
        change = network.paint_scaled(layers, FRAME_SCALE * side / NOMINAL)
        alpha = change[..., 6:]
        made = base * np.exp(change[..., :3]) * (1 - alpha) + change[..., 3:6] * alpha
        yield name, to_encoded(np.clip(made, 0, 1))


def _score(picture, truth):
    whole = np.ones(truth.shape[:2], bool)
    return (
        mse(picture, truth, whole) * 255**2,
        ssim(picture, truth, whole),
        psnr(picture, truth, whole),
    )
