"""Head models on disk: what is written comes back, and every kind of damage has its message."""

import numpy as np
import pytest

from bakery.errors import InputError, ModelError
from bakery.heads.file import ARRAYS, find_head, list_heads, load_head, save_arrays, save_head


def read(path):
    with np.load(path) as file:
        return {key: file[key] for key in file.files}


def test_what_is_written_comes_back(tiny, tmp_path):
    save_head(tmp_path / "tiny.npz", tiny)
    back = load_head(tmp_path / "tiny.npz")
    assert (back.name, back.licence, back.source) == (tiny.name, tiny.licence, tiny.source)
    np.testing.assert_array_equal(back.mean, tiny.mean)
    np.testing.assert_array_equal(back.faces, tiny.faces)
    np.testing.assert_array_equal(back.face_part, tiny.face_part)
    np.testing.assert_allclose(back.identity_basis, tiny.identity_basis, atol=1e-3)  # float16
    np.testing.assert_allclose(back.expression_basis, tiny.expression_basis, atol=1e-3)
    assert back.uv_rectangles["mouth_sheet"] == pytest.approx([0.1, 0.2, 0.3, 0.4])


def test_same_head_same_bytes(tiny, tmp_path):
    save_head(tmp_path / "a.npz", tiny)
    save_head(tmp_path / "b.npz", tiny)
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()


def change(key, value):
    def damage(arrays):
        arrays[key] = value(arrays[key])

    return damage


def set_at(index, value):
    def act(array):
        array = array.copy()
        array[index] = value
        return array

    return act


DAMAGE = {
    "lacks uv_faces": lambda arrays: arrays.pop("uv_faces"),
    "mean has shape": change("mean", lambda a: a[:, :2]),
    "identity has shape": change("identity", lambda a: a[:, :-1]),
    "faces points outside": change("faces", set_at((0, 0), 999)),
    "uv_faces points outside": change("uv_faces", set_at((0, 0), -1)),
    "landmark_faces points outside": change("landmark_faces", set_at(5, 77)),
    "mean has values that are not finite": change("mean", set_at((0, 0), np.nan)),
    "identity has values that are not finite": change("identity", set_at((0, 0, 0), np.inf)),
    "uv reaches from": change("uv", set_at((0, 0), 1.5)),
    "unknown part 'beard'": change("part_names", set_at(0, "beard")),
    "has 51 expressions": change("expression_names", lambda a: a[:51]),
    "does not sum to 1": change("landmark_barycentric", set_at((0, 0), 0.9)),
    "expression_start does not rise": change("expression_start", set_at(3, 99)),
    "no skin or no eyeballs": change("follow", lambda a: np.zeros_like(a)),
    "mean holds <U1, needs numbers with a point": change("mean", lambda a: np.full(a.shape, "x")),
    "faces holds float64, needs whole numbers": change("faces", lambda a: a.astype(float)),
    "part_names holds int64, needs text": change("part_names", lambda a: np.arange(len(a))),
    r"identity has shape \[\], needs a list": change("identity", lambda a: np.float16(0)),
    r"part_names has shape \[1, 15\], needs a list": change("part_names", lambda a: a[None]),
    r"name has shape \[2\], needs one text": change("name", lambda a: np.array(["a", "b"])),
    "has 500001 vertices, at most 500000": change(
        "mean", lambda a: np.zeros((500_001, 3), np.float32)
    ),
}


@pytest.mark.parametrize("message", DAMAGE)
def test_damage_has_its_message(tiny, tmp_path, message):
    path = tmp_path / "tiny.npz"
    save_head(path, tiny)
    arrays = read(path)
    DAMAGE[message](arrays)
    save_arrays(path, arrays)
    with pytest.raises(ModelError, match=message) as caught:
        load_head(path)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("key", ARRAYS)
def test_any_array_may_be_anything(tiny, tmp_path, key):
    """Whatever stands under a name: a head, or a ModelError in one line."""
    path = tmp_path / "tiny.npz"
    save_head(path, tiny)
    arrays = read(path)
    good = arrays[key]
    for wrong in (
        np.zeros((), good.dtype),
        np.zeros((0, 3), good.dtype),
        good[..., None],
        np.concatenate([good.ravel()] * 2),
        np.full(good.shape, -1.5),
        np.full(good.shape, 2**63, np.uint64),
        np.full(good.shape, True),
        np.full(good.shape, "x"),
        np.full(good.shape, np.inf),
    ):
        save_arrays(path, arrays | {key: wrong})
        try:
            load_head(path)
        except ModelError as error:
            assert "\n" not in str(error)


def test_truncated_file(tiny, tmp_path):
    path = tmp_path / "tiny.npz"
    save_head(path, tiny)
    path.write_bytes(path.read_bytes()[:-400])
    with pytest.raises(ModelError, match="not a readable head model"):
        load_head(path)
    path.write_bytes(b"")
    with pytest.raises(ModelError):
        load_head(path)
    path.write_bytes(b"OBJ file, no archive")
    with pytest.raises(ModelError, match="damaged, or no .npz file") as caught:
        load_head(path)
    assert "pickle" not in str(caught.value)


def test_names_are_looked_up(tiny, tmp_path, monkeypatch):
    monkeypatch.setenv("BAKERY_HEADS", str(tmp_path))
    save_head(tmp_path / "mine.npz", tiny)
    save_head(tmp_path / "makehuman.npz", tiny)
    assert find_head("mine") == tmp_path / "mine.npz"
    assert find_head("makehuman").parent != tmp_path, "a built-in head wins"
    assert set(list_heads()) >= {"mine", "makehuman"}
    with pytest.raises(InputError, match="known: makehuman, mine"):
        load_head("yours")


def test_all_arrays_are_written(tiny, tmp_path):
    save_head(tmp_path / "tiny.npz", tiny)
    assert tuple(read(tmp_path / "tiny.npz")) == tuple(ARRAYS)


def test_a_built_in_head_is_read_once_and_a_file_each_time(head, tmp_path):
    """What is made of a head is kept with it, so that the next portrait finds it made."""
    assert load_head() is load_head("makehuman")
    save_head(tmp_path / "a.npz", head)
    assert load_head(tmp_path / "a.npz") is not load_head(tmp_path / "a.npz")
