"""The generator on painted people that it was not trained on, measured as paGAN's table 1 is."""

import numpy as np

from bakery.evaluate.metrics import mse, psnr, ssim
from bakery.generators.interior import FRAME_SCALE
from bakery.generators.pagan import NOMINAL
from bakery.generators.unet import input_layers
from bakery.geometry.color import to_encoded, to_linear
from bakery.synth.pairs import iterate


def measure(folder, generator, most=None):
    """Mean figures over the pairs of a folder of shards; outside the face all is black.

    Args:
        generator: generators.pagan.PaganGenerator.
        most: this many pairs only.

    Returns:
        {"deformed" or "network": {"mse", "ssim", "psnr"}, "pairs": n, "subjects": n}.
    """
    found, subjects = {"deformed": [], "network": []}, set()
    for number, pair in enumerate(iterate(folder)):
        if number == most:
            break
        side = pair.part.shape[0]
        layers = input_layers(pair, pair.photo, FRAME_SCALE * side)
        change = generator.paint_scaled(layers, FRAME_SCALE * side / NOMINAL)
        alpha = change[..., 6:]
        base = to_linear(layers["deformed"] / np.float32(255))
        made = base * np.exp(change[..., :3]) * (1 - alpha) + change[..., 3:6] * alpha
        face = pair.face[..., None] / 255
        truth = pair.target / 255 * face
        for name, picture in (
            ("deformed", pair.deformed / 255),
            ("network", to_encoded(np.clip(made, 0, 1))),
        ):
            whole = np.ones(face.shape[:2], bool)
            shown = picture * face
            error = mse(shown, truth, whole) * 255**2
            found[name].append((error, ssim(shown, truth, whole), psnr(shown, truth, whole)))
        subjects.add(pair.subject)
    means = {
        name: dict(zip(("mse", "ssim", "psnr"), np.mean(rows, 0).round(4).tolist()))
        for name, rows in found.items()
    }
    return means | {"pairs": len(found["network"]), "subjects": len(subjects)}
