"""Teeth beside the true ones, measured."""

from functools import partial
from pathlib import Path

from bakery.bake.subject import FittedSubject
from bakery.cli.options import build_options
from bakery.evaluate import teeth
from bakery.evaluate.detection import lips
from bakery.formats.record import read_faces
from bakery.generators.pagan import load
from bakery.landmarks import LIPS_INNER


def test_some_photos_are_spread_over_all():
    photos = [Path(str(k)) for k in range(10)]
    assert teeth.spread(photos, None) == teeth.spread(photos, 12) == photos
    assert teeth.spread(photos, 3) == [photos[0], photos[4], photos[9]]


def test_means_leave_out_what_was_not_seen():
    row = {way: {"psnr": 20.0, "gradient": 1.0} for way in teeth.WAYS}
    other = {way: {"psnr": 22.0, "gradient": 0.5, "light": 0.9} for way in teeth.WAYS}
    assert teeth.summary([row, other])["hidden"] == {"psnr": 21, "gradient": 0.75, "light": 0.9}


def test_a_painted_face_is_measured(portrait, head, tmp_path, monkeypatch):
    small = partial(FittedSubject, options=build_options("small", []))
    monkeypatch.setattr(teeth, "FittedSubject", small)
    _, (face,) = read_faces(portrait[1])
    points = face.points.copy()
    points[LIPS_INNER[1:10], 1] += 0.15 * lips.width(points)  # as if its lips were open
    assert lips.gap(points) > teeth.OPEN * lips.width(points)
    found = teeth.measure(portrait[0], points, head, load(), tmp_path)
    assert set(found) == set(teeth.WAYS)
    assert all(0 < row["psnr"] < 60 and row["gradient"] > 0 for row in found.values())
    assert len(list(tmp_path.glob("*.png"))) == 1
