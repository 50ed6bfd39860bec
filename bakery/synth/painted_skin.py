"""Skin painted from pigments (`bakery.synth.skin`), laid on a head's atlas."""

import numpy as np

from bakery.geometry.sample import bilinear
from bakery.memo import once_per_object
from bakery.synth.chart import SIDES, chart_of
from bakery.synth.hair import hair_color
from bakery.synth.noise import gradient_noise
from bakery.synth.skin import brow_mask, design_skin, shade_inputs

DENSITY = 2.0  # pixels a mm of the chart
RESTING = 0.55  # of the lines of age: in the quick painter's light they look deeper


@once_per_object
def _chart(head):
    return chart_of(head, DENSITY)


def painted(stage, traits):
    """A subject's skin.

    Args:
        stage: quick.Stage.
        traits: synth.subject.Subject.

    Returns:
        albedo [T, T, 3] float32, roughness [T, T] float32, resting relief [N] mm at the skin's rows.
    """
    atlas, head = stage.atlas, stage.head
    chart = _chart(head)
    points = atlas.at(head.mean)[stage.skin_rows]
    maps = design_skin(chart, traits, chart.blank())
    albedo, rough, _, cavity, _ = shade_inputs(chart, maps, traits, points, hair_color(traits))
    albedo = albedo * cavity[:, None]
    flat = chart.pixels(chart.flat(points))
    height = RESTING * bilinear(maps.relief, flat)[:, 0]
    fine, _ = gradient_noise(points, 1.2, traits.seed + 9, octaves=2, gain=0.7)
    brows = sum(chart.sample(brow_mask(chart, side, 0.8), points) for side in SIDES)
    hairs, _ = gradient_noise(points, (2.6, 0.55, 2.0), traits.seed + 10, octaves=2, gain=0.8)
    coverage = np.clip(brows * traits.brow_density * (0.75 + 1.1 * hairs), 0, 0.95)[:, None]
    albedo = albedo * (1 - coverage) + 0.5 * hair_color(traits) * coverage

    def picture(values):
        out = np.zeros((len(atlas.index),) + values.shape[1:], np.float32)
        out[stage.skin_rows] = values
        return atlas.fill_gutter(atlas.paint(out))

    return (
        picture(np.clip(albedo, 0.004, 0.95)),
        picture(rough),
        (height + 0.06 * fine).astype(np.float32),
    )
