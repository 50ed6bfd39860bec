"""Landmarks that are no face: a fit, or one line; never numpy's own words."""

import json

import numpy as np
import pytest

from bakery.bake.fitting import fit_portrait
from bakery.bake.options import BuildOptions
from bakery.errors import BakeryError
from bakery.formats import image, record
from bakery.stages.fit import FitOptions

BY_POINTS = BuildOptions(fit=FitOptions(photometric=False))  # a tenth of the time
TURN = np.linspace(0, 2 * np.pi, 478)
RNG = np.random.default_rng(0)
SHAPES = {  # points of the painted portrait -> others
    "random": lambda points: RNG.random((478, 2)) * [400, 480],
    "all but one in a place": lambda points: np.vstack([points[:1], [points[1]] * 477]),
    "a circle": lambda points: 200 + 100 * np.stack([np.cos(TURN), np.sin(TURN)], 1),
    "beside the photo": lambda points: points + 3000,
    "partly beside": lambda points: points + [150, 0],
    "tiny": lambda points: points * 0.01,
    "huge": lambda points: (points - 200) * 8,
    "coarse": lambda points: np.round(points / 50) * 50,
    "in reverse": lambda points: points[::-1],
    "upside down": lambda points: points * [1, -1] + [0, 480],
    "in a line": lambda points: points * [1, 0] + [0, 200],
}


@pytest.mark.filterwarnings("ignore:Mean of empty slice", "ignore:invalid value encountered")
@pytest.mark.parametrize("shape", SHAPES)
def test_any_points_fit_or_are_refused_in_one_line(portrait, head, shape):
    path, marks = portrait
    table = json.loads(marks.read_text())
    (face,) = table["faces"]
    points = SHAPES[shape](np.array(face["points"]))
    low, high = points.min(0), points.max(0)
    face |= {"points": points.tolist(), "box": [*low, *np.maximum(high - low, 1)]}
    photo = image.read_photo(path)
    try:
        _, (found,) = record.faces_from_table("marks.json", table)
        fit, _ = fit_portrait(path, photo, found, head, BY_POINTS)
    except BakeryError as error:
        assert "\n" not in str(error) and len(str(error)) < 300
    else:
        assert np.isfinite(fit.landmarks_projected).all() and fit.camera.focal > 0
