"""JSON and npz records: the same comes back, foreign files are refused in one line."""

import json
from dataclasses import replace

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
    for name in ("identity", "gaze", "light", "residual", "rest"):
        assert (getattr(back, name) == getattr(fit, name)).all(), name
    assert (back.expression.astype(np.float32) == fit.expression).all()
    assert (back.camera.rotation == fit.camera.rotation).all()
    assert record.dump(record.fit_to_table(back)) == record.dump(record.fit_to_table(fit))


def test_how_a_head_comes_to_rest_is_told_of_an_expression_alone(fit):
    assert "rest" not in record.fit_to_table(fit)
    moved = replace(fit, rest=np.random.default_rng(3).normal(size=(468, 3)))
    table = record.parse("fit", record.dump(record.fit_to_table(moved)))
    assert (record.fit_from_table("fit", table).rest == moved.rest).all()
    table["rest"] = table["rest"][:5]
    with pytest.raises(InputError, match="rest"):
        record.fit_from_table("fit", table)


def test_resting_weights_come_back_also_as_older_tables_have_them(fit):
    assert "resting" not in record.fit_to_table(fit)
    weights = np.zeros(len(EXPRESSIONS))
    weights[[EXPRESSIONS.index(name) for name in ("browDownLeft", "eyeLookDownRight")]] = 0.5, 0.25
    table = record.parse("fit", record.dump(record.fit_to_table(replace(fit, resting=weights))))
    assert table["resting"] == {"browDownLeft": 0.5, "eyeLookDownRight": 0.25}
    assert (record.fit_from_table("fit", table).resting == weights).all()
    for wrong in ({"browDownLeft": 2}, {"browDownMiddle": 0.5}, {"browDownLeft": "low"}, [0.5]):
        with pytest.raises(InputError):
            record.fit_from_table("fit", table | {"resting": wrong})
    del table["resting"]
    old = record.fit_from_table("fit", table | {"lids": [0.1, 0.2, 0.3, 0.4, 0.5, 0.6]}).resting
    shapes = (
        "eyeBlinkLeft eyeBlinkRight eyeSquintLeft eyeSquintRight eyeLookDownLeft eyeLookDownRight"
    )
    assert [old[EXPRESSIONS.index(name)] for name in shapes.split()] == [
        0.1, 0.2, 0.3, 0.4, 0.5, 0.6
    ]  # fmt: skip
    assert np.count_nonzero(old) == 6


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
        "faces": [{"box": [0, 0, 1, 1], "score": 1, "points": np.eye(478, 3).tolist()}],
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
        ('{"image": {"width": 1, "height": 1}, "faces": 7}', "another layout"),
        ('{"image": [], "faces": []}', "another layout"),
        ('{"image": {"width": 0, "height": 1}, "faces": []}', "0 pixels"),
        ('{"image": {"width": 1e300, "height": 1}, "faces": []}', "pixels"),
        ('{"image": {"width": NaN, "height": 1}, "faces": []}', "not valid JSON"),
    ],
)
def test_foreign_landmarks_are_refused(tmp_path, text, message):
    (tmp_path / "f.json").write_bytes(text.encode("latin-1"))
    with pytest.raises(InputError, match=message) as caught:
        record.read_faces(tmp_path / "f.json")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "change, message",
    [
        (lambda face: face["points"][7].__setitem__(0, 1e300), r"a point at \(1e\+300, "),
        (lambda face: face["points"][7].__setitem__(1, -9001.0), "a point at .*picture of 900x600"),
        (lambda face: face["points"][7].__setitem__(0, float("inf")), "not valid JSON|not finite"),
        (lambda face: face["points"][7].__setitem__(0, float("nan")), "not valid JSON"),
        (lambda face: face["points"][7].__setitem__(0, None), "float|not finite"),
        (lambda face: face.update(points=[[300.0, 200.0]] * 478), "in one place or line"),
        (lambda face: face.update(points=[[300.0, y] for y in range(478)]), "in one place or line"),
        (lambda face: face.update(points=[300.0] * 478), "another layout"),
        (lambda face: face.update(box=[0, 0, 1e300, 1]), "a point at"),
        (lambda face: face.update(box=[10, 10, 100, -5]), "no area"),
        (lambda face: face.update(box="abcd"), "string|convert|another"),
    ],
)
def test_points_that_are_no_face_are_refused(tmp_path, change, message):
    """Beyond ten picture sizes, in one place: the fit would divide by nothing or overflow."""
    rng = np.random.default_rng(1)
    face = {"box": [100, 100, 400, 400], "score": 0.9}
    face["points"] = (100 + 400 * rng.random((478, 2))).tolist()
    table = {"image": {"width": 900, "height": 600}, "faces": [face]}
    path = tmp_path / "f.json"
    path.write_text(json.dumps(table))
    assert len(record.read_faces(path)[1]) == 1
    face["points"][7] = [-8999.0, 8999.0]  # a face at the edge may have points far out
    path.write_text(json.dumps(table))
    assert len(record.read_faces(path)[1]) == 1
    change(face)
    for text in (json.dumps(table), json.dumps(table).replace("Infinity", "1e999")):
        path.write_text(text)
        with pytest.raises(InputError, match=message) as caught:
            record.read_faces(path)
        assert len(str(caught.value)) < 400 and "\n" not in str(caught.value)


def test_damaged_fit_is_refused(tmp_path, fit):
    good = record.fit_to_table(fit)
    for change in (
        {"light": [[1, 2, 3]]},
        {"expression": {"smile": 1}},
        {"expression": {"jawOpen": 7}},
        {"camera": good["camera"] | {"focal": 0}},
        {"camera": good["camera"] | {"width": 10**9}},
        {"camera": good["camera"] | {"center": [1e308, 0]}},
        {"camera": good["camera"] | {"translation": [0, 0, -1e30]}},
        {"identity": "abc"},
        {"expression": [0.1] * 52},
        {"camera": 5},
    ):
        (tmp_path / "fit.json").write_bytes(record.dump(good | change))
        with pytest.raises(InputError) as caught:
            record.read_fit(tmp_path / "fit.json")
        assert "str instance" not in str(caught.value)


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


def small_textures():
    """Textures of 4 texels a side, 2 keys, 3 gazes and 5 mouths, by the names of their arrays."""
    shapes = {
        "neutral": (4, 4, 3), "keys": (2, 4, 4, 3), "key_weights": (2, 52), "source": (4, 4),
        "facing": (4, 4), "hair": (4, 4, 4), "gaze": (3, 2, 6, 3), "gaze_directions": (3, 2),
        "mouths": (5, 2, 3, 3), "mouth_landmarks": (5, 40, 2), "mouth_weights": (5, 52),
        "albedo": (4, 4, 3),
    }  # fmt: skip
    arrays = {name: np.full(shape, 0.5, np.float16) for name, shape in shapes.items()}
    about = {"key_names": np.array(["a", "b"]), "maker": np.array('{"name": "m"}')}
    return arrays | about | {"made_from": np.array("")}


@pytest.mark.parametrize("name", sorted(set(small_textures()) - {"maker", "made_from"}))
def test_textures_that_do_not_go_together_are_refused(tmp_path, name):
    """Each array with an axis more, with a row less, and as one value."""
    path, good = tmp_path / "t.npz", small_textures()
    record.write_arrays(path, good)
    assert record.read_textures(path).key_names == ("a", "b")
    for wrong in (good[name][None], good[name][:-1], np.array(good[name].flat[0])):
        record.write_arrays(path, good | {name: wrong})
        with pytest.raises(InputError, match="shape|another layout") as caught:
            record.read_textures(path)
        assert "\n" not in str(caught.value) and "bakery texture" in str(caught.value)


@pytest.mark.parametrize("weight", [-0.1, 1.1, np.nan])
def test_weights_of_textures_lie_between_0_and_1(tmp_path, weight):
    good = small_textures()
    good["mouth_weights"][2, 7] = weight
    record.write_arrays(tmp_path / "t.npz", good)
    with pytest.raises(InputError, match="mouth_weights"):
        record.read_textures(tmp_path / "t.npz")


def small_hair():
    """A cap and a card of one face each, by the names of their fields."""
    return {
        "vertices": np.float32([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 1]]),
        "faces": np.int32([[0, 1, 2], [1, 3, 2]]), "uv": np.float32([[0, 0], [1, 0], [0, 1], [1, 1]]),
        "kind": np.uint8([0, 1]), "card": np.int32([-1, 0]), "levels": np.uint8([7, 1]),
        "hang": np.float32([0, 0, 0, 1]), "texture": np.ones((2, 2, 4), np.float16),
        "direction": np.ones((2, 2, 2), np.float16), "root_to_tip": np.ones((2, 2), np.float16),
        "source": np.ones((2, 2), np.uint8),
    }  # fmt: skip


def with_hair(**changed):
    hair = small_hair() | changed
    return small_textures() | {f"hair_mesh_{name}": array for name, array in hair.items()}


def test_hair_with_volume_stands_beside_the_textures(tmp_path):
    record.write_arrays(tmp_path / "t.npz", with_hair())
    textures = record.read_textures(tmp_path / "t.npz")
    for name, array in small_hair().items():
        np.testing.assert_array_equal(getattr(textures.hair_mesh, name), array)
    again = record.textures_to_arrays(textures)
    assert set(again) == set(with_hair())
    record.write_arrays(tmp_path / "t.npz", small_textures())
    assert record.read_textures(tmp_path / "t.npz").hair_mesh is None


@pytest.mark.parametrize(
    "name, value",
    [
        ("faces", np.int32([[0, 1, 4], [1, 3, 2]])), ("kind", np.uint8([0, 3])),
        ("card", np.int32([-1])), ("hang", np.float32([0, 0, 0, 2])),
        ("vertices", np.full((4, 3), np.nan, np.float32)), ("source", np.ones((3, 2), np.uint8)),
        ("levels", np.float32([7, 1])),
    ],
)  # fmt: skip
def test_hair_that_does_not_go_together_is_refused(tmp_path, name, value):
    record.write_arrays(tmp_path / "t.npz", with_hair(**{name: value}))
    with pytest.raises(InputError, match=name):
        record.read_textures(tmp_path / "t.npz")


def test_hair_that_lacks_an_array_is_refused(tmp_path):
    arrays = with_hair()
    del arrays["hair_mesh_hang"]
    record.write_arrays(tmp_path / "t.npz", arrays)
    with pytest.raises(InputError, match="hang"):
        record.read_textures(tmp_path / "t.npz")
