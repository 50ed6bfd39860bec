"""Generators against baselines: what must come out when nothing, or one known thing, changes."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from bakery.bake.fitting import fitted_neutral
from bakery.bake.subject import FittedSubject
from bakery.evaluate import generator
from bakery.evaluate.avatar.pairs import Pair
from bakery.evaluate.generator import motion as generator_motion
from bakery.evaluate.generator import painted as generator_painted
from bakery.evaluate.generator import speed as generator_speed
from bakery.formats.livelink import Take
from bakery.formats.portraits import landmarks_of
from bakery.formats.record import read_faces
from bakery.generators.identity import load_features
from bakery.generators.pagan import PaganGenerator
from bakery.generators.plain import PlainUNet
from bakery.generators.unet import INPUTS, NetworkOptions, UNet
from bakery.heads.base import PARTS
from bakery.stages.condition import SIZE
from bakery.synth.pairs import PaintedPair, write_shard
from bakery.types import EXPRESSION_INDEX, Generated


class Painter:
    """Brightens everything by a factor; 1 changes nothing."""

    def __init__(self, gain=1.0):
        self.gain = gain

    def generate(self, subject, conditions, interior_only=False):
        base = conditions.deformed_neutral
        ratio = np.full_like(base, self.gain)
        return Generated(base * ratio, ratio, np.zeros_like(base), np.zeros(base.shape[:2]))


@pytest.fixture(scope="module")
def twins(portrait):
    """The painted portrait as both photos of one person."""
    _, (face,) = read_faces(portrait[1])
    return Pair("painted", portrait[0], portrait[0], face.points, face.points, True)


@pytest.fixture(scope="module", autouse=True)
def fitted_once(fitted, twins):
    """Who is fitted and unwrapped in the same way twice is so once: nobody changes the subject."""
    with pytest.MonkeyPatch.context() as patch:
        points = landmarks_of(twins.neutral_points).points
        made = {(twins.neutral, points.tobytes(), SIZE): fitted}

        def fit(path, landmarks, head, size=SIZE, hair=None):
            key = path, landmarks.points.tobytes(), size
            if key not in made:
                made[key] = FittedSubject(path, landmarks, head, size=size, hair=hair)
            return made[key]

        patch.setattr(generator, "FittedSubject", fit)
        yield fit


@pytest.fixture(scope="module")
def result(twins, head):
    delta = np.zeros((generator.DELTA_TEXELS, generator.DELTA_TEXELS, 3), np.float32)
    return generator.measure(twins, head, {"same": Painter(), "bright": Painter(1.3)}, delta)


def test_no_change_scores_as_the_deformed_neutral(result):
    assert result.scores["same"] == result.scores["static"]
    assert result.scores["delta"].face_psnr == pytest.approx(result.scores["static"].face_psnr)
    assert result.scores["bright"].face_psnr < result.scores["same"].face_psnr - 3


def test_one_photo_twice_has_one_geometry(result):
    """What differs between the two figures is the target's identity and warp alone."""
    assert result.own_geometry["same"] == result.scores["same"]
    table = generator.summary([result])["all"]
    assert table["own_geometry"]["same"].items() <= table["same"].items()


def test_the_headline_is_the_neutral_photos_head(twins, aside, head, fitted_once):
    """Driven: the shape of the neutral photo; own geometry: that of the other photo's fit."""
    _, (turned,) = read_faces(aside[1])
    fitted = fitted_once(twins.neutral, landmarks_of(twins.neutral_points), head)
    driven, own = fitted.observe_both(aside[0], landmarks_of(turned.points))
    assert driven.fit.camera is own.fit.camera
    theirs = fitted_neutral(
        head, replace(own.fit, outline=fitted.neutral.fit.outline)
    )  # ears are the person's
    for seen, neutral in ((driven, fitted.shape), (own, theirs)):
        expected = fitted.head.vertices(neutral, seen.fit.expression, seen.fit.gaze)
        assert_allclose(seen.conditions.vertices, expected, atol=1e-4)
    assert np.abs(driven.conditions.vertices - own.conditions.vertices).max() > 0.1  # mm


def test_a_photo_warped_onto_itself_is_itself(result):
    # Bilinear resampling of a grain of 0.01, by triangles of zero displacement.
    assert result.scores["warp"].face_psnr > 40


def test_groups(result):
    table = generator.summary([result])
    assert table["all"] == table["teeth"]
    assert table["all"]["same"]["eyes_psnr"] == result.eyes["same"]


def test_a_change_that_is_none_is_lent_as_none(twins, head):
    delta = generator.smile_delta(twins, head)
    # The same photo twice: what is left is the unwrapping and drawing of the texture. 0.0105, 0.009
    # before tones at a slant were held closer.
    assert np.abs(np.median(delta)) < 0.012


def test_who_looks_alike(twins):
    own = generator.likeness(twins)
    assert own.shape == (generator.LOOKALIKE, generator.LOOKALIKE, 3)
    assert_allclose(own, generator.likeness(twins))


def test_identity_of_pictures_that_are_the_truth(result):
    rng = np.random.default_rng(0)
    noise = rng.random((64, 64, 3))
    one = replace(result, pictures=dict.fromkeys(result.pictures, noise), face=np.ones((64, 64)))
    other = replace(one, pictures=dict.fromkeys(result.pictures, noise[::-1, :, ::-1]))
    found = generator.identity([one, other], load_features())["same"]
    assert found["same"] == pytest.approx(1, abs=1e-5) and found["nearest"] == 1
    assert found["other"] < 0.999


@pytest.fixture(scope="module")
def still(twins, head, fitted_once):
    """The fitted, and a take in which nothing moves."""
    fitted = fitted_once(twins.neutral, landmarks_of(twins.neutral_points), head)
    return fitted, Take(np.arange(4) / 30, np.zeros((4, 52), np.float32), np.zeros((4, 3)), None)


def test_nothing_flickers_when_nothing_moves(still):
    fitted, take = still
    found = [generator_motion.flicker(fitted, take, Painter(g), 0, 2) for g in (1.0, 1.2)]
    # Resampling at its own pixels: remap's 1/32 of a pixel.
    assert found[0]["conditions"] < 0.2 and found[1]["generated"] < 0.3


def test_a_painter_that_flickers_is_found_out(still):
    class Nervous(Painter):
        def generate(self, subject, conditions, interior_only=False):
            self.gain = 2.2 - self.gain
            return super().generate(subject, conditions, interior_only)

    fitted, take = still
    found = generator_motion.flicker(fitted, take, Nervous(1.0), 0, 3)
    assert found["generated"] > 5 and found["ratio"] > 10
    # Back and forth: the middle between the frames around is as far as the frames themselves.
    assert found["jitter"]["generated"] == pytest.approx(found["generated"], rel=0.1)


def test_light_that_comes_steadily_is_no_jitter(still):
    class Dawn(Painter):
        def generate(self, subject, conditions, interior_only=False):
            self.gain += 0.05
            return super().generate(subject, conditions, interior_only)

    fitted, take = still
    found = generator_motion.flicker(fitted, take, Dawn(0.8), 0, 4)
    assert found["generated"] > 2
    assert found["jitter"]["generated"] < 0.1 * found["generated"]


def network():
    return PaganGenerator(UNet(NetworkOptions(channels=(8, 8)), folded=True), half=False)


def test_painted_people_in_closed_form(tmp_path):
    """Deformed and truth differ by 20 levels on half of the picture: mean squared error 200."""
    part = np.full((64, 64), PARTS.index("skin"), np.uint8)
    face = np.zeros((64, 64), np.uint8)
    face[:, :32] = 255
    gray, even = (np.full((64, 64, c), v, np.uint8) for c, v in ((3, 100), (2, 128)))
    pair = PaintedPair(
        photo=gray, photo_face=face, target=gray, deformed=gray + 20,
        normals=np.zeros((64, 64, 3), np.int8), depth=np.full((64, 64), 100, np.uint8),
        gaze=np.zeros((64, 64, 2), np.uint8), part=part, face=face, strain=even, folds=even,
        landmarks=np.zeros((478, 2), np.float32), expression=np.zeros(52, np.float32),
        gaze_angles=np.zeros(2, np.float32), yaw=0.0, pitch=0.0, subject=7, head="toy",
    )  # fmt: skip
    write_shard(tmp_path / "pairs-00000.safetensors", [pair, pair])
    found = generator_painted.measure(tmp_path, {"network": network()})
    assert found["deformed"]["mse"] == pytest.approx(200, abs=0.1)  # shards lose nothing
    assert found["deformed"]["psnr"] == pytest.approx(10 * np.log10(255**2 / 200), abs=0.1)
    assert (found["pairs"], found["subjects"]) == (2, 1)
    assert set(found["network"]) == {"mse", "ssim", "psnr", "ssim_hard"}
    assert found["deformed"]["ssim"] == found["deformed"]["ssim_hard"]  # no outline is in sight
    assert generator_painted.measure(tmp_path, {"network": network()}, 1)["pairs"] == 1


def test_the_outline_is_feathered():
    part = np.full((250, 250), 255, np.uint8)
    part[50:200, 50:200] = PARTS.index("skin")
    soft = generator_painted.feathered(SimpleNamespace(part=part, face=np.full_like(part, 255)))
    assert soft[part == 255].max() == 0
    assert 0 < soft[125, 50] < soft[125, 51] < 0.6 and soft[125, 54] == 1  # 1.6% of the side
    assert soft[54:196, 54:196].min() == 1


def test_time_is_measured_of_every_size(monkeypatch):
    monkeypatch.setattr(generator_speed, "seconds_of_plain_unet", lambda size, count: 100.0 * count)
    found = generator_speed.measure(network(), 5, {(64, 64): 6, (32, 64): 3})
    assert found["plain_unet"] == 500
    assert found["all"] == pytest.approx(found["6 of 64x64"] + found["3 of 64x32"], abs=2e-3)


def test_what_the_network_was_given_is_noted(monkeypatch):
    generator, given = network(), []
    monkeypatch.setattr(generator_speed, "plug_in", lambda group, name: generator)
    layers = {name: np.zeros((32, 64, n), np.uint8) for name, n in INPUTS.items()}
    with generator_speed._noted("pagan", given):
        generator.paint(layers)
    generator.paint(layers)
    assert given == [(32, 64)]


def test_the_plain_network_has_the_published_size():
    """pix2pix's 512 variant with 13 input channels: 54.4 million parameters."""
    network = PlainUNet(sum(INPUTS.values()))
    assert round(sum(p.numel() for p in network.parameters()) / 1e6, 1) == 54.4


def test_teeth_that_come_to_light_count_as_conditions(still):
    fitted, take = still
    weights = np.zeros((4, 52), np.float32)
    weights[:, EXPRESSION_INDEX["jawOpen"]] = [0.3, 0.4, 0.5, 0.6]
    opening = replace(take, weights=weights)
    found = generator_motion.flicker(fitted, opening, Painter(1.0), 0, 4)
    assert found["conditions"] > found["bare"]
    # A painter that changes nothing shows the bare deformed neutral.
    assert found["bare_ratio"] == pytest.approx(1) and found["ratio"] < 1
