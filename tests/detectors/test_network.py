"""The network detector: geometry with stub networks, weights, and what is no face."""

import numpy as np
import pytest
import torch
from numpy.testing import assert_allclose
from safetensors.torch import save_file

from bakery.detectors import frames, network
from bakery.detectors.blocks import FinderNet, PointsNet, fold, unfold
from bakery.errors import ModelError

SHAPE = np.random.default_rng(0).uniform(-0.35, 0.35, (478, 2)).astype(np.float32)
SHAPE[33], SHAPE[263] = (-0.2, -0.1), (0.2, -0.1)


class StubFinder:
    """One face of 48 pixels of the level, upright, in one cell of every level that has it."""

    def __init__(self, cell=(3, 5)):
        self.cell = cell

    def __call__(self, x):
        out = torch.zeros(1, 6, x.shape[2] // 8, x.shape[3] // 8)
        out[:, 0] = -9
        out[:, 4] = 1
        i, j = self.cell
        if i < out.shape[2] and j < out.shape[3]:
            out[0, 0, i, j] = 9
            out[0, 1, i, j] = 0.25
        return out


class StubPoints:
    """Always the same shape in the crop."""

    crop_size = 128

    def __init__(self, presence=9.0):
        self.presence = presence

    def __call__(self, x):
        n = len(x)
        shape = torch.from_numpy(SHAPE).expand(n, -1, -1).clone()
        return shape, torch.full((n, 478), -4.0), torch.full((n,), self.presence)


def test_levels_reach_small_and_whole_frame_faces():
    options = network.NetworkOptions()
    sizes = network.level_sizes((1350, 900, 3), options)
    assert sizes[-1][1] == round(1350 / 3.2)
    assert 96 <= max(sizes[0]) <= 116
    assert network.level_sizes((50, 40, 3), options) == [(77, 96)]
    small, scale = network.level(np.zeros((50, 40, 3), np.uint8), (77, 96))
    assert small.shape == (96, 77, 3)
    assert_allclose(scale, [77 / 40, 96 / 50])


def test_levels_know_where_they_lie_though_odd_rows_are_left_out():
    """A bright spot of an odd picture is where its level's scale says."""
    height, width = 1351, 1087
    spot = np.array([900.0, 1150.0])  # x, y
    y, x = np.mgrid[:height, :width] + 0.5
    value = 255 * np.exp(-((x - spot[0]) ** 2 + (y - spot[1]) ** 2) / (2 * 40.0**2))
    picture = np.repeat(value.astype(np.uint8)[..., None], 3, 2)
    for size in network.level_sizes(picture.shape, network.NetworkOptions()):
        level, scale = network.level(picture, size)
        mass = level[..., 0].astype(float)
        y, x = np.mgrid[: level.shape[0], : level.shape[1]] + 0.5
        seen = np.array([(mass * x).sum(), (mass * y).sum()]) / mass.sum()
        assert_allclose(seen / scale, spot, atol=0.5)  # photo pixels


def test_finder_peak_lands_on_its_photo_pixels():
    detector = network.NetworkDetector(StubFinder(), StubPoints())
    picture = np.zeros((320, 320, 3), np.uint8)  # one level of 100 pixels
    sizes = network.level_sizes(picture.shape, detector.options)
    ((_, frame),) = detector.peaks(*network.level(picture, sizes[0]))
    assert_allclose(frame.center, [(5.5 + 0.25) * 8 * 3.2, 3.5 * 8 * 3.2])
    assert_allclose(frame.size, 48 * 3.2)
    assert frame.roll == 0


def test_points_come_back_through_the_crop():
    detector = network.NetworkDetector(StubFinder(), StubPoints())
    frame = frames.FaceFrame(np.array([100.0, 120.0]), 64.0, 0.3)
    points, errors, presence = detector.place(np.zeros((320, 320, 3), np.uint8), [frame])
    side = 64.0 * frames.CROP_MARGIN
    assert_allclose(points[0], SHAPE * side @ frames.rotation(0.3).T + frame.center, atol=1e-3)
    assert_allclose(errors, np.exp(-4.0) * side, rtol=1e-4)
    assert presence[0] > 0.99


def test_confidence_falls_with_the_expected_error(monkeypatch):
    monkeypatch.setattr(
        network, "look_closer", lambda image, points, errors, looks: (points, errors)
    )
    detector = network.NetworkDetector(StubFinder(), StubPoints())
    (face,) = detector.detect(np.zeros((320, 320, 3), np.uint8))
    assert_allclose(face.confidence, np.exp(-np.exp(-4.0) / 0.4 / 0.1), rtol=1e-4)
    assert_allclose(face.box[2:], np.ptp(face.points[:468], axis=0), rtol=1e-5)


def test_absent_faces_are_not_reported():
    detector = network.NetworkDetector(StubFinder(), StubPoints(presence=-1.0))
    assert detector.detect(np.zeros((320, 320, 3), np.uint8)) == []


def test_folding_changes_nothing():
    torch.manual_seed(0)
    for kind in (FinderNet, PointsNet):
        trained = kind()
        image = torch.rand(2, 3, 128, 128)
        for module in trained.modules():
            if isinstance(module, torch.nn.BatchNorm2d):
                torch.nn.init.uniform_(module.weight, 0.5, 1.5)
        trained.train()
        trained(image)
        trained.eval()
        folded = kind(folded=True)
        folded.load_state_dict(fold(trained))
        first, second = trained(image), folded.eval()(image)
        if kind is FinderNet:
            first, second = (first,), (second,)
        for a, b in zip(first, second):
            assert_allclose(a.detach(), b.detach(), atol=1e-4)  # float32 in another order


def test_unfolding_is_the_way_back():
    folded = FinderNet(folded=True)
    trained = FinderNet()
    trained.load_state_dict(unfold(trained, folded.state_dict()))
    for name, value in fold(trained.eval()).items():
        assert_allclose(value, folded.state_dict()[name], atol=1e-6)


def test_load_refuses_bad_weights(tmp_path):
    with pytest.raises(ModelError, match="no such weights"):
        network.load(tmp_path / "none.safetensors")
    path = tmp_path / "bad.safetensors"
    path.write_bytes(b"not weights")
    with pytest.raises(ModelError, match="damaged"):
        network.load(path)
    save_file({"finder.x": torch.zeros(1)}, path)
    with pytest.raises(ModelError, match="another network"):
        network.load(path)


@pytest.fixture(scope="module")
def shipped():
    return network.load()


def test_shipped_weights_are_small():
    assert network.WEIGHTS.stat().st_size < 10e6


def pictures_without_faces():
    rng = np.random.default_rng(1)
    y, x = np.mgrid[:300, :400]
    yield "flat", np.full((300, 400, 3), 180, np.uint8)
    yield "noise", rng.integers(0, 256, (300, 400, 3), np.uint8)
    yield "gradient", np.stack([x * 255 // 400, y * 255 // 300, 0 * x], -1).astype(np.uint8)
    yield "checks", np.repeat(((x // 25 + y // 25) % 2 * 255)[..., None], 3, 2).astype(np.uint8)
    disk = (np.hypot(x - 200, y - 150) < 90) * 200 + 20
    yield "disk", np.repeat(disk[..., None], 3, 2).astype(np.uint8)
    yield "tiny", np.full((3, 5, 3), 90, np.uint8)


@pytest.mark.parametrize("name, image", list(pictures_without_faces()))
def test_no_face_where_there_is_none(shipped, name, image):
    assert shipped.detect(image) == []
