"""JSON and npz records: the same comes back, foreign files are refused in one line."""

import json

import numpy as np
import pytest

from bakery.errors import InputError
from bakery.formats import record
from bakery.types import EXPRESSIONS, Camera, Fit, Landmarks


@pytest.fixture
def fit():
    rng = np.random.default_rng(0)
    return Fit(
        head="toy",
        camera=Camera(
            1800.5, np.array([400.0, 300.0]), rng.normal(size=3), rng.normal(size=3), 800, 600
        ),
        identity=rng.normal(size=7),
        expression=rng.random(52).astype(np.float32),
        gaze=np.array([3.0, -2.0]),
        light=rng.normal(size=(9, 3)),
        albedo=np.zeros(0),
        residual=rng.normal(size=(468, 3)),
        landmarks_projected=rng.random((478, 2)) * 800,
        seconds=0.12345,
        focal_source="exif",
        diagnostics={"rms": 1.5},
    )


def test_fit_comes_back(fit):
    table = record.parse("fit", record.dump(record.fit_to_table(fit)))
    assert list(table["expression"]) == list(EXPRESSIONS)
    assert np.shape(table["light"]) == (9, 3) and len(table["landmarks_projected"]) == 478
    back = record.fit_from_table("fit", table)
    for name in ("identity", "gaze", "light", "residual"):
        assert (getattr(back, name) == getattr(fit, name)).all(), name
    assert (back.expression.astype(np.float32) == fit.expression).all()
    assert (back.camera.rotation == fit.camera.rotation).all()
    assert record.dump(record.fit_to_table(back)) == record.dump(record.fit_to_table(fit))


def test_faces_come_back(tmp_path):
    rng = np.random.default_rng(1)
    face = Landmarks(np.array([1.0, 2, 3, 4]), 0.9, rng.random((478, 2)) * 99, rng.random(478))
    (tmp_path / "f.json").write_bytes(record.dump(record.faces_to_table(800, 600, [face])))
    size, (back,) = record.read_faces(tmp_path / "f.json")
    assert size == (800, 600)
    np.testing.assert_allclose(back.points, face.points, atol=6e-4)  # three decimals are written
    np.testing.assert_allclose(back.confidence, face.confidence, atol=6e-5)


def test_points_with_depth_are_taken(tmp_path):
    """Other programs write [x, y, z]."""
    table = {
        "image": {"width": 9, "height": 9},
        "faces": [{"box": [0, 0, 1, 1], "score": 1, "points": np.ones((478, 3)).tolist()}],
    }
    (tmp_path / "f.json").write_text(json.dumps(table))
    assert record.read_faces(tmp_path / "f.json")[1][0].points.shape == (478, 2)


@pytest.mark.parametrize(
    "text, message",
    [
        ("", "empty"),
        ("{", "not valid JSON"),
        ("[" * 100_000, "not valid JSON"),
        ("[]", "without a table"),
        ("\x00\xff", "not valid JSON"),
        ('{"image": {}}', "lacks"),
        ('{"image": {"width": 1, "height": 1}, "faces": [{"box": [0]}]}', "lacks"),
        ('{"image": {"width": 1, "height": 1}, "faces": 7}', "not iterable"),
        ('{"image": {"width": NaN, "height": 1}, "faces": []}', "not valid JSON"),
    ],
)
def test_foreign_landmarks_are_refused(tmp_path, text, message):
    (tmp_path / "f.json").write_bytes(text.encode("latin-1"))
    with pytest.raises(InputError, match=message) as caught:
        record.read_faces(tmp_path / "f.json")
    assert "\n" not in str(caught.value)


def test_damaged_fit_is_refused(tmp_path, fit):
    good = record.fit_to_table(fit)
    for change in (
        {"light": [[1, 2, 3]]},
        {"expression": {"smile": 1}},
        {"expression": {"jawOpen": 7}},
        {"camera": good["camera"] | {"focal": 0}},
        {"camera": good["camera"] | {"width": 10**9}},
        {"identity": "abc"},
    ):
        (tmp_path / "fit.json").write_bytes(record.dump(good | change))
        with pytest.raises(InputError):
            record.read_fit(tmp_path / "fit.json")


def test_arrays_come_back_and_are_reproducible(tmp_path):
    arrays = {
        "a": np.arange(6).reshape(2, 3),
        "b": np.ones(3, np.float16),
        "s": np.array(["x", "yy"]),
    }
    one = record.write_arrays(tmp_path / "a.npz", arrays)
    two = record.write_arrays(tmp_path / "b.npz", arrays)
    assert one == two
    back = record.read_arrays(tmp_path / "a.npz", ["a"])
    assert all((back[key] == arrays[key]).all() for key in arrays)
    with pytest.raises(InputError, match="lacks c"):
        record.read_arrays(tmp_path / "a.npz", ["c"])
    (tmp_path / "a.npz").write_bytes((tmp_path / "a.npz").read_bytes()[:-30])
    with pytest.raises(InputError, match="damaged"):
        record.read_arrays(tmp_path / "a.npz")
