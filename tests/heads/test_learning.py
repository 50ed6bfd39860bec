"""What is learned from photographs, on made-up ones."""

import numpy as np
import pytest

from bakery.errors import InputError
from bakery.heads import boundaries, embed
from bakery.heads.build.portraits import read_points
from bakery.heads.file import load_head


def test_points_of_a_folder(tmp_path):
    cv2 = pytest.importorskip("cv2")
    folder = tmp_path / "train"
    folder.mkdir()
    cv2.imwrite(str(folder / "a_neutral.png"), np.zeros((120, 160, 3), np.uint8))
    points = np.arange(2 * 478 * 3, dtype=float).reshape(2, 478, 3)
    names = np.array(["x/train/a_neutral.png", "x/other/a_neutral.png"])
    np.savez(tmp_path / "p.npz", names=names, points=points)
    found, sizes, chosen = read_points(tmp_path / "p.npz", folder)
    np.testing.assert_array_equal(found, points[:1, :, :2])
    assert sizes.tolist() == [[160, 120]] and chosen == ["x/train/a_neutral.png"]


def test_points_that_do_not_fit(tmp_path):
    np.savez(tmp_path / "p.npz", names=np.array(["a/b.jpg"]), points=np.zeros((1, 468, 2)))
    with pytest.raises(InputError, match=r"needs \[1, 478, 2 or 3\]"):
        read_points(tmp_path / "p.npz", tmp_path)
    np.savez(tmp_path / "q.npz", names=np.array(["a/b.jpg"]), points=np.zeros((1, 478, 2)))
    with pytest.raises(InputError, match="holds none"):
        read_points(tmp_path / "q.npz", tmp_path)
    (tmp_path / "r.npz").write_bytes(b"PK no archive")
    with pytest.raises(InputError, match="needs arrays"):
        read_points(tmp_path / "r.npz", tmp_path)


def test_mirror_points_pair_up():
    rng = np.random.default_rng(0)
    half = rng.uniform([0.05, -1], [1, 1], (234, 2))
    face = np.zeros((478, 2))
    face[:234], face[234:468] = half, half * [-1, 1]
    order = np.arange(478)
    a, b = face[33].copy(), face[33 + 234].copy()
    face[263], face[33 + 234] = b, face[263].copy()  # the outer corners are each other's images
    face[33] = a
    other = embed.mirror_points(face[None] * 300 + 500)
    assert (other[other] == order[:468]).all()
    assert other[33] == 263
    np.testing.assert_allclose(face[other] * [-1, 1], face[:468], atol=1e-9)


def test_shares_along_a_rim():
    face = np.zeros((1, 478, 2))
    rim = boundaries.LIPS[0]
    face[0, list(rim), 0] = np.linspace(100, 200, len(rim))
    np.testing.assert_allclose(
        boundaries.shares_along(face, rim), np.linspace(0, 1, len(rim))[1:-1]
    )


def test_rim_points_lie_on_the_rims():
    head = load_head()
    points = head.landmarks(head.mean)
    lips, lids = embed.skin_rims(head)
    groups = embed.sides(head)
    sides = {
        n: (groups[k][1], groups[k + 1][1]) for n, k in (("lips", 1), ("left", 3), ("right", 5))
    }
    faces = points[None, :, :2] * [1, -1]
    found = boundaries.pinned(head, faces, points[:468], (lips, lids), sides)
    for point, place in found.items():
        assert np.linalg.norm(place - points[point]) < 1.2, point


def test_one_smile_explains_many():
    learn = pytest.importorskip("bakery.heads.build.learn")
    rng = np.random.default_rng(1)
    half = rng.normal(size=(468, 2))
    mirror = np.arange(468)[::-1]
    smile = (half + half[mirror] * [-1, 1]) / 2
    helpers = rng.normal(size=(2, 468, 2))
    weights = rng.uniform(0.4, 1.0, 30)
    moves = weights[:, None, None] * smile + 0.2 * helpers[0] + rng.normal(size=(30, 468, 2)) * 0.05
    wide = weights > 0.6
    found, got, _, rest = learn.learn_smile(moves, helpers, mirror, wide)
    assert np.corrcoef(found.ravel(), smile.ravel())[0, 1] > 0.99
    assert np.corrcoef(got, weights)[0, 1] > 0.98
    assert got[wide].mean() == pytest.approx(learn.TOOTHY, abs=0.01)
    assert rest < 0.2


def test_amounts_of_smiles_are_told_by_the_corners():
    learn = pytest.importorskip("bakery.heads.build.learn")
    rng = np.random.default_rng(2)
    smile = rng.normal(size=(468, 2))
    amounts = np.array([0.2, 0.9, 1.4])
    moves = amounts[:, None, None] * smile
    moves[:, 0] += 5  # no corner of the mouth
    np.testing.assert_allclose(learn.smile_amounts(moves, smile), amounts)


def test_pairs_need_both_photos():
    recipe = pytest.importorskip("bakery.heads.build.recipe")
    names = ["t/1_smiling.jpg", "t/1_neutral.jpg", "t/2_neutral.jpg"]
    assert recipe.pairs_of(names).tolist() == [[1, 0]]
    with pytest.raises(InputError, match="NAME_neutral"):
        recipe.pairs_of(["t/1.jpg"])
