"""Parts of a long step: kept as they come, used again, made again where anything changed."""

import numpy as np
import pytest

from bakery.bake.kept import Kept
from bakery.formats.work import Work

ITEMS = list(range(10))


def square(made):
    def make(item):
        made.append(item)
        return {"square": np.array([item * item], np.float16), "of": np.float32(item)}

    return make


def run(folder, key="key", items=ITEMS, stop=None, size=4):
    made, out = [], []
    series = Kept(Work(folder), key).series("part", square(made), items, size)
    for row in series:
        out.append((float(row["square"][0]), float(row["of"])))
        if stop is not None and len(out) == stop:
            series.close()
            break
    return made, out


def test_an_interrupted_series_goes_on_with_the_parts_that_lack(tmp_path):
    wanted = [(float(k * k), float(k)) for k in ITEMS]
    run(tmp_path, stop=9)  # two parts of four are complete, the third is not
    made, out = run(tmp_path)
    assert made == [8, 9] and out == wanted
    made, out = run(tmp_path)
    assert made == [] and out == wanted


def test_another_key_or_size_makes_all_again(tmp_path):
    run(tmp_path)
    assert run(tmp_path, key="other")[0] == ITEMS
    assert run(tmp_path, key="other", size=5)[0] == ITEMS
    assert run(tmp_path, key="other", size=5)[0] == []


def test_a_damaged_part_is_made_again(tmp_path):
    run(tmp_path)
    path = tmp_path / "part004.npz"
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(data)
    assert run(tmp_path)[0] == [4, 5, 6, 7]


def test_read_back_is_what_was_made(tmp_path):
    """Packing loses nothing: types, shapes and every bit come back."""
    rng = np.random.default_rng(0)
    arrays = {
        "half": rng.normal(size=(3, 5, 3)).astype(np.float16),
        "float": rng.normal(size=(7,)).astype(np.float32),
        "byte": rng.integers(0, 255, (4, 4), np.uint8),
        "none": np.zeros((0, 3)),
    }
    kept = Kept(Work(tmp_path), "key")
    assert kept.one("neutral", lambda: arrays) is arrays
    back = kept.one("neutral", lambda: pytest.fail("made again"))
    assert back.keys() == arrays.keys()
    for name, array in arrays.items():
        assert back[name].dtype == array.dtype and np.array_equal(back[name], array)


def test_nothing_is_kept_without_a_folder():
    made = []
    rows = list(Kept().series("part", square(made), ITEMS, 4))
    assert made == ITEMS and len(rows) == 10
    assert Kept().one("x", lambda: {"a": np.ones(1)})["a"] == 1


def test_an_error_comes_out_and_what_was_complete_stays(tmp_path):
    def make(item):
        if item == 6:
            raise ValueError("six")
        return {"a": np.float32(item)}

    with pytest.raises(ValueError, match="six"):
        list(Kept(Work(tmp_path), "key").series("part", make, ITEMS, 4))
    made = []
    list(Kept(Work(tmp_path), "key").series("part", square(made), ITEMS, 4))
    assert made == [4, 5, 6, 7, 8, 9]
