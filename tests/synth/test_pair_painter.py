"""Painted pairs: truth and conditions agree, seeds repeat, folds stay where nothing presses."""

from dataclasses import replace
from itertools import islice
from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from bakery.errors import InputError
from bakery.generators.folds import make_folds
from bakery.geometry import camera as cameras
from bakery.heads.base import PARTS, weights
from bakery.landmarks import FACE
from bakery.stages.condition import face_camera
from bakery.synth import quick
from bakery.synth.expressions import both_sides, draw_expression, draw_view
from bakery.synth.pairs import Shard
from bakery.synth.pairs import shards as pair_shards
from bakery.synth.pairs.painter import (
    PairOptions,
    draw_figure,
    mistaken_shape,
    paint_subject,
    registration,
)
from bakery.synth.scene import portrait_camera
from bakery.synth.skins import skins_of

ROUND = np.ones((3, 3), np.uint8)
SMALL = PairOptions(size=96, targets=2)


@pytest.fixture(scope="module")
def stage(head):
    return quick.make_stage(head, 256)


@pytest.fixture(scope="module")
def pairs(stage):
    return list(paint_subject(stage, [], (5, 3), SMALL))


def test_pairs_are_whole(pairs):
    for pair in pairs:
        assert pair.target.shape == pair.deformed.shape == (96, 96, 3)
        assert pair.subject == 3 and pair.head == "makehuman"
        seen = pair.part != 255
        assert 0.3 < seen.mean() < 0.95
        # Depth is shrunk, and so blurred over the rim; parts have names and are not.
        core, reach = (
            change(seen.astype(np.uint8), ROUND) > 0 for change in (cv2.erode, cv2.dilate)
        )
        assert (pair.depth[core] > 0).all() and (pair.depth[~reach] == 0).all()
        face = pair.face > 200
        # Truth and condition show the same person: on the face they differ by far less than two
        # people do (60 levels and more), though the condition's shape is as wrong as a fit's.
        off = np.abs(pair.target.astype(int) - pair.deformed)[face & (pair.part == 0)].mean()
        assert off < 25
        assert ((pair.landmarks > -10) & (pair.landmarks < 106)).all()
    np.testing.assert_array_equal(pairs[0].photo, pairs[1].photo)


def test_without_mistakes_the_silhouettes_agree(stage):
    pair = next(iter(paint_subject(stage, [], (5, 4), replace(SMALL, error=0.0))))
    lit = pair.target.sum(-1) > 0
    # Only pixels on the rim differ: the truth is drawn at twice the size.
    assert (lit != (pair.part != 255)).mean() < 0.03


def test_a_target_is_registered_with_its_truth(stage):
    rng = np.random.default_rng(0)
    figure, *_ = draw_figure(rng, stage, [], SMALL)
    lens = portrait_camera(96, 96, distance=900.0)
    wrong = mistaken_shape(rng, stage.head, figure.traits, figure.neutral, 1.0)
    camera = face_camera(SimpleNamespace(camera=lens), stage.head, wrong, 40.0)
    smile = weights({"jawOpen": 0.5, "mouthSmileLeft": 0.7, "mouthSmileRight": 0.7})
    marks = figure.head.landmarks(figure.head.vertices(figure.neutral, smile))
    offsets = registration(figure, stage.head, wrong, marks, 0.9 * smile, np.zeros(2), camera)
    kept = (stage.head.landmarks(wrong) - figure.head.landmarks(figure.neutral)) * [1, 1, 0]
    wanted = cameras.project(marks + kept, camera)[:FACE]

    def miss(neutral):
        found = stage.head.landmarks(stage.head.vertices(neutral, 0.9 * smile))
        return np.linalg.norm(cameras.project(found, camera)[:FACE] - wanted, axis=1).mean()

    # Depth mistaken by millimetres and a smile that is too weak, seen from the side.
    assert miss(wrong) > 0.7 and miss(wrong + offsets) < 0.15 * miss(wrong)


def test_same_seed_same_pictures(stage, pairs):
    again = next(iter(paint_subject(stage, [], (5, 3), SMALL)))
    np.testing.assert_array_equal(again.target, pairs[0].target)
    np.testing.assert_array_equal(again.deformed, pairs[0].deformed)


def test_keys_from_their_views(stage):
    options = replace(SMALL, keys=True)
    assert options.count == 6 * 3 and SMALL.count == 2
    made = list(islice(paint_subject(stage, [], (5, 3), options), 4))
    assert [pair.yaw for pair in made] == [0, 40, -40, 0]
    np.testing.assert_array_equal(made[0].expression, made[2].expression)
    assert (made[3].expression != made[0].expression).any() and made[0].expression.max() > 0.5


def test_folds_show_under_compression_only(head, stage):
    neutral = head.mean
    points = stage.atlas.at(neutral)[stage.skin_rows]
    folds = make_folds(head, neutral, points, np.random.default_rng(1), 60)
    assert folds.depths(neutral).max() == 0
    raised = head.vertices(neutral, both_sides({"browInnerUp": 1.0, "browOuterUp": 1.0}))
    relief = folds.relief(folds.depths(raised))
    marks = head.landmarks(neutral)
    forehead = np.linalg.norm(points - marks[151], axis=1) < 25
    chin = np.linalg.norm(points - marks[199], axis=1) < 15
    assert relief[forehead].min() < -0.1  # mm deep
    assert np.abs(relief[chin]).max() < 0.02


def test_older_skin_folds_deeper(head, stage):
    points = stage.atlas.at(head.mean)[stage.skin_rows]
    smile = head.vertices(head.mean, both_sides({"mouthSmile": 0.9, "cheekSquint": 0.6}))
    depth = []
    for age in (20, 75):
        total = 0.0
        for seed in range(3):
            folds = make_folds(head, head.mean, points, np.random.default_rng(seed), age)
            total += np.abs(folds.relief(folds.depths(smile))).mean()
        depth.append(total)
    assert depth[1] > 1.3 * depth[0]


def test_expressions_are_possible():
    rng = np.random.default_rng(0)
    drawn = [draw_expression(rng) for _ in range(200)]
    table = np.stack([expression for expression, _ in drawn])
    assert table.min() >= 0 and table.max() <= 1
    assert (np.abs([gaze for _, gaze in drawn]) <= [32, 22]).all()
    smiling = table @ weights({"mouthSmileLeft": 1.0}) > 0.3
    assert 0.1 < smiling.mean() < 0.7
    views = np.array([draw_view(rng) for _ in range(200)])
    assert (np.abs(views) <= [45, 25]).all() and (np.abs(views[:, 0]) > 30).mean() > 0.1


def test_blink_hides_the_eyes(stage, pairs):
    """A shut eye shows none of its ball in the truth, whoever it belongs to."""
    from bakery.synth.pairs.painter import draw_figure

    figure, camera, _ = draw_figure(np.random.default_rng(2), stage, [], SMALL)
    _, kind = quick.paint(figure, both_sides({"eyeBlink": 1.0}), np.zeros(2), camera, 1)
    assert kind[0, 0] == -1  # nobody in the corner
    assert not np.isin(kind, [PARTS.index("eye_left"), PARTS.index("eye_right")]).any()


@pytest.mark.slow
def test_shards_go_on(head, tmp_path, monkeypatch):
    monkeypatch.setattr(pair_shards, "SUBJECTS", 1)
    monkeypatch.setattr(pair_shards.skins, "TEXELS", 256)
    options = replace(SMALL, size=64)
    first = list(pair_shards.write([head], tmp_path, 3, 1, options=options))
    assert [path.name for path in first] == [
        "pairs-00000.safetensors", "pairs-00001.safetensors"
    ]  # fmt: skip
    assert len(Shard(first[0])) == 2
    before = first[1].read_bytes()
    first[1].unlink()
    assert list(pair_shards.write([head], tmp_path, 3, 1, options=options)) == first[1:]
    assert first[1].read_bytes() == before


def test_nothing_to_paint_with_is_an_error(head, tmp_path):
    with pytest.raises(InputError, match="at least 1"):
        list(pair_shards.write([head], tmp_path, 0))
    with pytest.raises(InputError, match="no skins of head makehuman"):
        skins_of(tmp_path, head)
