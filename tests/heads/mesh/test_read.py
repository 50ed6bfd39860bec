"""Mesh files: what is written comes back, seams are one again, and damage is named in one line."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from bakery.errors import InputError
from bakery.heads.mesh import read
from bakery.heads.mesh.read import Surface, pieces, read_surface, simplified, weld

KINDS = ("obj", "ply", "glb")


def same(found, wanted, digits):
    """Compare as sets of triangles: files may order vertices anew.

    By the nearest middle of a triangle: sorted, those that mirror each other would change places
    where rounding tells them apart.
    """
    a, b = (s.vertices[s.faces].mean(1) for s in (found, wanted))
    away, which = cKDTree(a).query(b)
    assert len(a) == len(b) and away.max() < 2 * 10.0**-digits
    assert len(np.unique(which)) == len(a)


@pytest.mark.parametrize("kind", KINDS)
def test_triangles_come_back(skin, export, tmp_path, kind):
    found = read_surface(export(tmp_path / f"head.{kind}", skin))
    assert len(found.vertices) == len(skin.vertices) and found.uv is None
    same(found, skin, 3)  # an OBJ has eight digits, the others float32


@pytest.mark.parametrize("kind", KINDS)
def test_uv_comes_back_and_its_seams_tear_nothing(skin, export, tmp_path, kind):
    found = read_surface(export(tmp_path / f"head.{kind}", skin, with_uv=True))
    assert len(found.vertices) == len(skin.vertices)
    assert len(found.uv) == len(skin.uv)
    mine = found.uv[found.uv_faces].mean(1)
    theirs = skin.uv[skin.uv_faces].mean(1)
    np.testing.assert_allclose(mine.min(0), theirs.min(0), atol=1e-5)
    np.testing.assert_allclose(mine.mean(0), theirs.mean(0), atol=1e-5)


def grid(n, z=0.0):
    x, y = np.meshgrid(np.arange(n), np.arange(n))
    points = np.stack([x, y, 0 * x + z], -1).reshape(-1, 3).astype(float)
    corner = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    faces = [[corner, corner + 1, corner + n + 1], [corner, corner + n + 1, corner + n]]
    return points, np.concatenate([np.stack(f, -1) for f in faces])


def test_only_what_meets_along_borders_is_welded():
    points, faces = grid(6)
    cut = faces.copy()
    right = points[faces].mean(1)[:, 0] > 2
    copies = np.flatnonzero(points[:, 0] == 2)
    number = np.arange(len(points))
    number[copies] = len(points) + np.arange(len(copies))
    cut[right] = number[faces[right]]
    torn = np.concatenate([points, points[copies]])
    # A card that stands on the sheet, its root where vertices of the sheet are.
    card = np.array([[1.0, 1, 0], [1, 2, 0], [1, 1, 3], [1, 2, 3]])
    start = len(torn)
    whole = np.concatenate([torn, card])
    both = np.concatenate([cut, [[start, start + 1, start + 3], [start, start + 3, start + 2]]])
    found = weld(whole, both)
    assert len(np.unique(found)) == 36 + 4
    assert sorted(np.bincount(pieces(found))) == [2, 50]


def test_pieces_are_numbered_by_size():
    one, two = grid(5), grid(9, 3.0)
    faces = np.concatenate([one[1], two[1] + len(one[0])])
    np.testing.assert_array_equal(pieces(faces), np.repeat([1, 0], [32, 128]))


def test_thinned_out_it_stays_where_it_was(skin):
    found = simplified(skin, 8000)
    assert 7000 < len(found.faces) <= 8000 and found.uv is None
    np.testing.assert_allclose(found.vertices.min(0), skin.vertices.min(0), atol=1.5)
    np.testing.assert_allclose(found.vertices.max(0), skin.vertices.max(0), atol=1.5)
    assert simplified(skin, len(skin.faces)) is skin


def sheet(path, change=lambda points, faces: None):
    points, faces = grid(24)
    points, faces = points.copy(), faces.copy()
    change(points, faces)
    lines = ["v " + " ".join(f"{x:g}" for x in p) for p in points]
    path.write_text("\n".join(lines + ["f " + " ".join(str(i + 1) for i in f) for f in faces]))
    return path


def spoil(points, faces):
    points[5, 1] = np.nan


def swell(points, faces):
    points *= 1e30


def wander(points, faces):
    faces[3, 1] = 99999


@pytest.mark.parametrize(
    "change, words",
    [(spoil, "not finite"), (swell, "units large"), (wander, "not a readable mesh")],
)
def test_bad_numbers_are_named(tmp_path, change, words):
    with pytest.raises(InputError, match=words) as raised:
        read_surface(sheet(tmp_path / "bad.obj", change))
    assert "\n" not in str(raised.value) and "bad.obj" in str(raised.value)


@pytest.mark.parametrize(
    "name, data, words",
    [
        ("empty.obj", b"", "no faces"),
        ("points.obj", b"v 0 0 0\nv 1 0 0\n", "no faces"),
        ("few.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "1 triangles with an area"),
        ("noise.ply", b"\x00\xff" * 50, "not a readable mesh"),
        ("cut.glb", b"glTF\x02\x00\x00\x00", "not a readable mesh"),
        ("text.gltf", b"{]", "not a readable mesh"),
        ("head.stl", b"solid", "no obj, ply, glb, gltf"),
    ],
)
def test_files_that_are_no_mesh(tmp_path, name, data, words):
    path = tmp_path / name
    path.write_bytes(data)
    with pytest.raises(InputError, match=words) as raised:
        read_surface(path)
    assert "\n" not in str(raised.value)


def test_missing_and_too_large(tmp_path, monkeypatch):
    with pytest.raises(InputError, match="no such file"):
        read_surface(tmp_path / "none.obj")
    path = sheet(tmp_path / "sheet.obj")
    monkeypatch.setattr(read, "MOST_FACES", 1000)
    with pytest.raises(InputError, match="1,058 faces, at most 1,000"):
        read_surface(path)
    path.write_text(path.read_text() + "\nf 1 2 26 25")
    monkeypatch.setattr(read, "MOST_FACES", 1059)  # the last is two
    with pytest.raises(InputError, match="1,060 triangles, at most 1,059"):
        read_surface(path)
    monkeypatch.setattr(read, "LARGEST_FILE", 1000)
    with pytest.raises(InputError, match="decimate the mesh first"):
        read_surface(path)


def test_faces_without_area_go(tmp_path):
    def flatten(points, faces):
        faces[:7, 2] = faces[:7, 1]

    assert len(read_surface(sheet(tmp_path / "flat.obj", flatten)).faces) == 2 * 23**2 - 7


def test_a_taken_part_keeps_its_uv(skin):
    kept = np.arange(0, len(skin.faces), 5)
    part = skin.take(kept)
    np.testing.assert_array_equal(part.vertices[part.faces], skin.vertices[skin.faces[kept]])
    np.testing.assert_array_equal(part.uv[part.uv_faces], skin.uv[skin.uv_faces[kept]])
    assert isinstance(part, Surface) and part.faces.max() + 1 == len(part.vertices)
