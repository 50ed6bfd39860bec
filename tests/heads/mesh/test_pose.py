"""Axes and units of a mesh, known answers; drawn and cast back; landmarks from files."""

import json

import numpy as np
import pytest

from bakery.errors import InputError
from bakery.geometry import rotation
from bakery.heads.mesh import draw, given, look, pose
from bakery.heads.mesh.read import Surface

TURNS = {
    "y": np.eye(3),
    "z": np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]]),  # as Blender has it: z up, -y ahead
    "x": rotation.matrix([0.3, -1.2, 0.4]) @ np.array([[0.0, 1, 0], [1, 0, 0], [0, 0, -1]]),
}


def test_similarity_is_found_exactly():
    rng = np.random.default_rng(0)
    points = rng.normal(size=(40, 3))
    turn, scale, shift = rotation.matrix([0.4, -2.0, 1.0]), 3.7, np.array([5.0, -6, 7])
    found = pose.similarity(points, scale * points @ turn.T + shift, rng.random(40) + 0.1)
    for mine, theirs in zip(found, (turn, scale, shift)):
        np.testing.assert_allclose(mine, theirs, atol=1e-9)


@pytest.mark.parametrize("unit", pose.UNITS)
@pytest.mark.parametrize("up", TURNS)
def test_any_unit_and_axes_come_to_head_space(head, skin, known, unit, up):
    scale, turn = 1 / pose.UNITS[unit], TURNS[up]
    file = Surface(scale * (skin.vertices + [40, 900, -7]) @ turn.T, skin.faces)
    seen = known(head, scale, turn)
    seen = pose.Seen(seen.points + scale * turn @ [40, 900, -7], seen.weight, "known")
    posed = pose.pose(file, seen, pose.shape_of(head))
    np.testing.assert_allclose(posed.surface.vertices, skin.vertices, atol=1e-6)
    assert f"unit: {unit} assumed" in " ".join(posed.about)


def test_axes_are_named(head, skin, known):
    posed = pose.pose(
        Surface(skin.vertices @ TURNS["z"].T, skin.faces),
        known(head, 1.0, TURNS["z"]),
        pose.shape_of(head),
    )
    assert "axes: z up, -y out of the face" in posed.about


def test_a_size_no_unit_explains_is_scaled(head, skin, known):
    posed = pose.pose(
        Surface(skin.vertices / 3e4, skin.faces), known(head, 1 / 3e4), pose.shape_of(head)
    )
    np.testing.assert_allclose(posed.surface.vertices, skin.vertices, atol=1e-6)
    assert "none fits" in " ".join(posed.about)


def test_a_wrong_unit_is_refused_and_a_right_one_kept(head, skin, known):
    seen, shape = known(head), pose.shape_of(head)
    with pytest.raises(InputError, match="--units m the outer eye corners are 8.29e"):
        pose.pose(skin, seen, shape, "m")
    large = Surface(1.6 * skin.vertices, skin.faces)
    posed = pose.pose(large, known(head, 1.6), shape, "mm")  # a giant, but told so
    assert np.ptp(posed.surface.vertices[:, 0]) == pytest.approx(1.6 * np.ptp(skin.vertices[:, 0]))


def test_a_mesh_that_is_inside_out_is_turned(head, skin, known):
    posed = pose.pose(
        Surface(skin.vertices, skin.faces[:, ::-1], skin.uv, skin.uv_faces[:, ::-1]),
        known(head),
        pose.shape_of(head),
    )
    np.testing.assert_array_equal(posed.surface.faces, skin.faces)
    np.testing.assert_array_equal(posed.surface.uv_faces, skin.uv_faces)


def test_axes_to_try_are_rotations():
    tried = list(draw.frames())
    assert len(tried) == 24
    for turn in tried:
        np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-12)
        assert np.linalg.det(turn) == pytest.approx(1)
    for turn in draw.frames("-z"):
        np.testing.assert_array_equal(turn[1], [0, 0, -1])


def test_what_is_drawn_is_cast_back(head, skin):
    """Points on the front of the face, 0.3 mm being a pixel."""
    view = draw.draw(skin, rotation.yaw_pitch(10, -5), np.array([0, -30.0, 0]), 110.0)
    points, plain = pose.shape_of(head), [1, 4, 9, 50, 280, 151, 152]
    places, weight = draw.cast(view, view.pixels(points))
    np.testing.assert_allclose(places[plain], points[plain], atol=0.5)
    assert (weight[plain] > 0.1).all()
    rays = view.rays(view.pixels(points))
    toward = (points - view.eye) / np.linalg.norm(points - view.eye, axis=1, keepdims=True)
    np.testing.assert_allclose(rays, toward, atol=1e-9)


def test_lines_of_sight_meet_where_the_point_is(head, skin):
    points = pose.shape_of(head)
    views = [
        draw.draw(skin, rotation.yaw_pitch(yaw, 0), np.array([0, -30.0, 0]), 110.0)
        for yaw in (-30, 0, 30)
    ]
    trust = np.ones((3, len(points)))
    seen = look.seen_in(views, [view.pixels(points) for view in views], trust, "")
    np.testing.assert_allclose(seen.rays.nearest(points), points, atol=1e-9)
    started = points + [0, 0, 9.0]
    for _ in range(60):
        started = seen.rays.nearest(started)
    np.testing.assert_allclose(started, points, atol=1e-3)


def test_points_from_a_file(head, skin, tmp_path):
    path = tmp_path / "points.json"
    points = head.landmarks(head.mean).astype(float)
    path.write_text(json.dumps({"points": points.tolist()}))
    seen = given.read_seen(path, skin)
    np.testing.assert_allclose(seen.points, points[:468])
    assert seen.rays is None and (seen.weight == 1).all()


@pytest.mark.parametrize(
    "table, words",
    [
        ({"points": [[0, 0, 0]]}, 'needs "points"'),
        ({"points": "no"}, 'needs "points"'),
        ({}, 'needs "points"'),
        ({"points": [[1e5, 0, 0]] * 478}, "do not lie on this mesh"),
        ({"points": [[1, "x", 0]] * 478}, 'needs "points"'),
    ],
)
def test_points_that_are_none(skin, tmp_path, table, words):
    path = tmp_path / "points.json"
    path.write_text(json.dumps(table))
    with pytest.raises(InputError, match=words):
        given.read_seen(path, skin)


def test_landmarks_of_the_drawn_picture(head, skin, tmp_path):
    from bakery.formats import record
    from bakery.types import Landmarks

    view = given.drawn(skin)
    pixels = view.pixels(head.landmarks(head.mean).astype(float))
    low, high = pixels.min(0), pixels.max(0)
    face = Landmarks(np.concatenate([low, high - low]), 1.0, pixels, np.ones(478))
    path = tmp_path / "face.json"
    path.write_bytes(record.dump(record.faces_to_table(draw.SIZE, draw.SIZE, [face])))
    seen = given.read_seen(path, skin)
    off = np.linalg.norm(seen.points - pose.shape_of(head), axis=1)[seen.weight > 0.5]
    assert np.median(off) < 0.5  # a pixel
    path.write_bytes(record.dump(record.faces_to_table(100, 100, [face])))
    with pytest.raises(InputError, match="100x100 pixels"):
        given.read_seen(path, skin)
