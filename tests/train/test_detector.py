"""Training of the detector: targets, losses, and a run that stops and goes on."""

import json

import cv2
import numpy as np
import pytest
import torch
from numpy.testing import assert_allclose

from bakery.detectors import network
from bakery.errors import InputError, ModelError
from bakery.train import augment, dataset, detector
from bakery.train import faces as faces_module
from bakery.train import photos as photos_module
from bakery.train.backgrounds import Backgrounds, procedural_background
from bakery.train.detector import losses as detector_losses


def face_points(size=120.0, seed=3):
    rng = np.random.default_rng(seed)
    half = rng.uniform((0.02, -0.9), (0.9, 0.9), (234, 2))
    half[33] = (0.5, -0.3)
    points = np.empty((478, 3))
    points[:234, :2], points[234:468, :2] = half * (-1, 1), half
    points[263, :2], points[33, :2] = points[267, :2], points[33, :2]
    points[468:473, :2] = (-0.5, -0.3) + rng.uniform(-0.05, 0.05, (5, 2))
    points[473:, :2] = points[468:473, :2] * (-1, 1)
    points[:, 2] = (points[:, :2] ** 2).sum(1) * 0.2
    return (points * size * 0.22 + (size / 2, size / 2, 0)).astype(np.float32)


@pytest.fixture(autouse=True)
def one_thread():
    """Tiny batches: two threads would mostly wait for each other."""
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(before)


@pytest.fixture(scope="module")
def photos(tmp_path_factory):
    """A folder of three pictures with points and the dense478 file that names them."""
    folder = tmp_path_factory.mktemp("photos")
    names, points = [], []
    rng = np.random.default_rng(0)
    for i in range(3):
        names.append(f"{i}_neutral.png")
        picture = rng.integers(0, 255, (120, 120, 4), np.uint8)  # alpha spares the graph cut
        cv2.imwrite(str(folder / names[-1]), picture)
        points.append(face_points(seed=3 + i))
    np.savez(folder / "dense.npz", names=np.array(names), points=np.stack(points))
    return folder


def options(**changes):
    plain = dict(steps=2, batch=2, background_count=3, log_every=1, save_every=1, workers=0)
    return detector.DetectorOptions(**{**plain, **changes})


@pytest.fixture(scope="module")
def runs(photos, tmp_path_factory):
    """A folder with a run of two steps of each network."""
    folder = tmp_path_factory.mktemp("runs")
    for name in ("points", "finder"):
        list(detector.train(folder / name, photos, photos / "dense.npz", options(network=name)))
    return folder


def test_run_goes_on_where_it_stopped(photos, runs):
    run = runs / "finder"
    longer = options(network="finder", steps=3)
    (figures,) = detector.train(run, photos, photos / "dense.npz", longer)
    assert figures["step"] == 3
    lines = (run / "stats.jsonl").read_text().splitlines()
    assert [json.loads(line)["step"] for line in lines] == [1, 2, 3]


def test_export_can_be_loaded(runs, tmp_path):
    path = tmp_path / "network.safetensors"
    detector.export(runs / "finder", runs / "points", path)
    assert network.load(path).name == "network"
    assert path.stat().st_size < 10e6


def test_other_options_are_refused(photos, runs):
    with pytest.raises(InputError, match="other rate"):
        list(detector.train(runs / "points", photos, photos / "dense.npz", options(rate=1.0)))
    with pytest.raises(InputError, match="one of finder, points"):
        options(network="other")


def test_loss_that_is_not_finite_stops_the_run(photos, tmp_path, monkeypatch):
    broken = torch.tensor(float("nan"))
    monkeypatch.setattr(detector, "_bfloat16_pays", lambda _: False)
    monkeypatch.setattr(detector, "_loss", lambda *_: (broken, {}))
    with pytest.raises(ModelError, match="not finite at step 1"):
        list(detector.train(tmp_path, photos, photos / "dense.npz", options(network="finder")))


def test_pictures_without_points_are_refused(photos, tmp_path):
    cv2.imwrite(str(tmp_path / "other.png"), np.zeros((9, 9, 3), np.uint8))
    with pytest.raises(InputError, match="no picture with points"):
        photos_module.read_photos(tmp_path, photos / "dense.npz")


def test_rendered_pictures_bring_points_and_mask(tmp_path):
    picture = np.full((480, 480, 4), 255, np.uint8)
    picture[:100, :, 3] = 0
    cv2.imwrite(str(tmp_path / "a.png"), picture)
    points = face_points(480)
    (tmp_path / "a.json").write_text(json.dumps({"points": points[:, :2].tolist()}))
    (photo,) = photos_module.read_rendered(tmp_path)
    assert_allclose(photo.points[:, :2], points[:, :2], rtol=1e-5)
    assert photo.mask[:100].max() == 0 and photo.mask[100:].min() == 255
    (tmp_path / "b.json").write_text(json.dumps({"points": []}))
    with pytest.raises(InputError, match="478 points"):
        photos_module.read_rendered(tmp_path)


def test_mirror_swaps_the_sides():
    order = faces_module.mirror_order(np.stack([face_points(seed=s) for s in (3, 4)]))
    assert (order[order] == np.arange(478)).all()
    points = face_points(seed=3)[:, :2] - (60, 0)
    assert np.median(np.abs(points[order] * (-1, 1) - points)) < 1


def test_samples_depend_on_their_number_alone(photos):
    faces = faces_module.Faces(
        photos_module.read_photos(photos, photos / "dense.npz"), Backgrounds((), count=3)
    )
    for kind in (dataset.PointsSamples, dataset.FinderSamples):
        one, two = kind(faces, 0, 9)[5], kind(faces, 0, 9)[5]
        for a, b in zip(one, two):
            assert_allclose(a, b)


def test_finder_target_marks_the_cell_of_the_center():
    target = dataset.finder_target([(np.array([44.0, 20.0]), 48.0, 0.5)], 8)
    assert target[0].max() == target[0, 2, 5] == 1
    assert_allclose(target[1:6, 2, 5], [0, 0, 0, np.cos(0.5), np.sin(0.5)], atol=1e-6)
    assert dataset.finder_target([], 8)[0].max() == 0


def test_borders_spare_the_faces():
    picture = np.zeros((100, 100, 3), np.uint8)
    rng = np.random.default_rng(0)
    for _ in range(20):
        cut = dataset.cut_borders(rng, picture.copy(), 1.0, [(np.array([50, 50]), 60)])
        assert cut[26:74, 26:74].max() == 0


def test_point_errors_are_in_eye_distances():
    target = torch.rand(2, 478, 2)
    target[:, 33], target[:, 263] = torch.tensor([0.0, 0.0]), torch.tensor([0.4, 0.0])
    distances, eyes = detector_losses.point_errors(target + torch.tensor([0.0, 0.04]), target)
    assert_allclose(distances, 0.1, rtol=1e-4)
    assert_allclose(eyes, 0.4)


def test_perfect_finder_has_no_loss():
    target = torch.from_numpy(dataset.finder_target([(np.array([44.0, 20.0]), 48.0, 0.1)], 8))
    sure = torch.where(target[:1] > 0.99, 20.0, -20.0)
    loss, _ = detector_losses.finder_loss(torch.cat([sure, target[1:6]])[None], target[None])
    assert float(loss) < 1e-6


def test_rate_rises_stays_and_falls():
    plan = options(steps=1000, rate=1.0, decay_from=0.5)
    assert_allclose([detector.rate_at(s, plan) for s in (100, 200, 501, 751)], [0.5, 1, 1, 0.5])


@pytest.mark.parametrize("step", [augment.light, augment.tone, augment.saturation, augment.blur,
                                  augment.noise, augment.compress, augment.photograph])  # fmt: skip
def test_augmentations_keep_shape_and_type(step):
    image = procedural_background(np.random.default_rng(0), 64)
    for seed in range(6):
        out = step(np.random.default_rng(seed), image)
        assert out.shape == image.shape and out.dtype == np.uint8
