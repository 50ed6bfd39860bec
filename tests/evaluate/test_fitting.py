import shutil

import numpy as np

from bakery.evaluate import fitting, report
from bakery.formats.record import read_faces
from bakery.geometry import rotation
from bakery.heads.file import load_head


def test_similarity_recovers_itself():
    rng = np.random.default_rng(0)
    points = rng.normal(size=(30, 3))
    turn = rotation.matrix([0.3, -0.5, 0.2])
    scale, found, shift = fitting.similarity(points, 1.7 * points @ turn.T + [1, 2, 3])
    np.testing.assert_allclose(scale, 1.7)
    np.testing.assert_allclose(found, turn, atol=1e-12)
    np.testing.assert_allclose(shift, [1, 2, 3])


def test_closest_points_of_a_triangle():
    vertices = np.array([[0, 0, 0], [4, 0, 0], [0, 4, 0]], float)
    points = np.array([[1, 1, 2], [-1, -1, 0], [2, -3, 0], [4, 4, 0], [9, 0, 0]], float)
    closest, distance = fitting.closest_points(points, vertices, np.array([[0, 1, 2]]))
    np.testing.assert_allclose(closest, [[1, 1, 0], [0, 0, 0], [2, 0, 0], [2, 2, 0], [4, 0, 0]])
    np.testing.assert_allclose(distance, [2, 2**0.5, 3, 8**0.5, 5])


def test_a_moved_and_scaled_copy_has_no_surface_error():
    rng = np.random.default_rng(1)
    grid = np.stack(np.meshgrid(np.arange(12.0), np.arange(12.0)), -1).reshape(-1, 2)
    vertices = np.column_stack([grid, np.sin(grid[:, 0]) + 0.3 * grid[:, 1] ** 1.5])
    corner = np.arange(11)[:, None] * 12 + np.arange(11)
    faces = np.concatenate(
        [
            np.stack([corner, corner + 1, corner + 12], -1).reshape(-1, 3),
            np.stack([corner + 1, corner + 13, corner + 12], -1).reshape(-1, 3),
        ]
    )
    moved = 1.2 * vertices @ rotation.matrix([0.1, 0.2, 0.3]).T + [3, 1, 2]
    start = rng.choice(len(vertices), 20)
    error = fitting.surface_error(moved, vertices, faces, moved[start], vertices[start])
    assert error.max() < 1e-6


def test_a_pair_of_photos_tells_of_lips_and_of_the_person(portrait, aside, tmp_path):
    """Rows of `evaluate fit`: the warp left out, the neutral head driven, two photos together."""
    points = []
    (tmp_path / "val").mkdir()
    for (photo, marks), kind in ((portrait, "neutral"), (aside, "smiling")):
        shutil.copy(photo, tmp_path / "val" / f"ada_{kind}.png")
        _, (face,) = read_faces(marks)
        points.append(face.points)
    names = ["val/ada_neutral.png", "val/ada_smiling.png"]
    np.savez(tmp_path / "dense478.npz", names=names, points=np.array(points))
    rows = list(report.fits(tmp_path, load_head("makehuman"), start="val"))
    assert [row["kind"] for row in rows] == ["neutral", "smiling"]
    assert "driven" not in rows[0] and "together" not in rows[0]
    found = report.fit_summary(rows)
    # The model's own mean head: weights of its lips are nearly none, from both sides.
    for name, count in (("mouth", 2), ("driven", 1)):
        assert found[name]["closed"] == count and found[name]["gap_worst"] < 0.5, name
        assert found[name]["opening"] < 0.5 and found[name]["width"] < 2, name
    assert found["together"]["alone"] < 2.0 and found["together"]["held_both"] < 1.0


def test_a_head_fits_its_own_synthetic_portrait():
    head = load_head("makehuman")
    row = next(report.synthetic(head, head, count=1))
    assert row["millimetres"] < 1.5
