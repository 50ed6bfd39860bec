"""Training of the detector: targets, losses, and a run that stops and goes on."""

import json

import cv2
import numpy as np
import pytest
import torch
from numpy.testing import assert_allclose

from bakery import landmarks as marks
from bakery.detectors import closeups, network
from bakery.errors import InputError, ModelError
from bakery.train import augment, dataset, degrade, detector
from bakery.train import faces as faces_module
from bakery.train import photos as photos_module
from bakery.train import runs as runs_module
from bakery.train.backgrounds import Backgrounds, procedural_background
from bakery.train.detector import bank, batches
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


def sources(photos):
    return bank.Sources(((photos, photos / "dense.npz"),))


@pytest.fixture(scope="module")
def pictures(photos, tmp_path_factory):
    """A bank of a few photographs and scenes."""
    folder = tmp_path_factory.mktemp("bank")
    small = {"photo": 6, "quick": 2, "careful": 2, "scene": 4}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(bank, "SHARD", small)
        chosen = bank.BankOptions(photo=6, quick=0, careful=0, scene=4, background_count=3, held=3)
        runs_module.keep_options(folder, chosen)
        bank.gather(folder, sources(photos))
        painter = bank.Painter(folder, sources(photos), chosen)
        for kind in ("photo", "scene"):
            np.savez(bank.shard_path(folder, kind, 0), **painter.shard(kind, 0))
    return folder


@pytest.fixture(scope="module", autouse=True)
def few_crops():
    """A bank of ten pictures has no more to tell in 128 crops than in four."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(detector, "CROPS", 4)
        yield


def options(**changes):
    plain = dict(minutes=0.02, batch=2, log_every=1)
    return detector.DetectorOptions(**{**plain, **changes})


@pytest.fixture(scope="module")
def runs(pictures, head, tmp_path_factory):
    """A folder with a run of about a second of each network."""
    folder = tmp_path_factory.mktemp("runs")
    for name in detector.NETWORKS:
        assert list(detector.train(folder / name, pictures, head, options(network=name)))
    return folder


def test_a_shard_depends_on_its_number_alone(photos, pictures, monkeypatch):
    monkeypatch.setattr(bank, "SHARD", {"photo": 6, "quick": 2, "careful": 2, "scene": 4})
    chosen = bank.BankOptions(photo=6, scene=4, background_count=3, held=3)
    again = bank.Painter(pictures, sources(photos), chosen)
    for kind in ("scene", "photo"):
        with np.load(bank.shard_path(pictures, kind, 0)) as kept:
            for name, value in again.shard(kind, 0).items():
                np.testing.assert_array_equal(kept[name], value)
    other = again.shard("photo", 1)["pictures"]
    with np.load(bank.shard_path(pictures, "photo", 0)) as kept:
        assert np.abs(other.astype(int) - kept["pictures"]).mean() > 1


@pytest.mark.slow
def test_a_bank_goes_on_and_keeps_to_its_options(photos, tmp_path):
    chosen = bank.BankOptions(photo=0, quick=0, careful=0, scene=2, background_count=3, held=3)
    (first,) = bank.paint_bank(tmp_path, sources(photos), chosen, 1)
    assert first.exists() and not list(bank.paint_bank(tmp_path, sources(photos), chosen, 1))
    with pytest.raises(InputError, match="other seed"):
        list(bank.paint_bank(tmp_path, sources(photos), bank.BankOptions(held=3, seed=1,
                             background_count=3), 1))  # fmt: skip


def test_people_are_learned_from_or_measured_not_both(pictures):
    learned, kept = bank.split_photos(pictures, 3)
    assert [photo.name for photo in learned] == ["0_neutral", "1_neutral"]
    assert [photo.name for photo in kept] == ["2_neutral"]


@pytest.mark.slow
def test_run_goes_on_where_it_stopped(pictures, head, runs):
    run = runs / "finder"
    before = [json.loads(line)["step"] for line in (run / "stats.jsonl").read_text().splitlines()]
    longer = options(network="finder", minutes=0.04)
    figures = list(detector.train(run, pictures, head, longer))
    assert figures[0]["step"] == before[-1] + 1
    assert not list(detector.train(run, pictures, head, longer))  # its time is over


@pytest.mark.slow
def test_export_can_be_loaded(runs, tmp_path):
    path = tmp_path / "network.safetensors"
    detector.export({name: runs / name for name in ("finder", "points")}, path)
    assert network.load(path).name == "network"
    assert path.stat().st_size < 10e6
    path = tmp_path / "closeups.safetensors"
    detector.export({name: runs / name for name in ("eye", "mouth")}, path)
    eye, mouth = closeups.networks(path)
    assert eye.rows.shape[0] == 2 and mouth.rows.shape[0] == 1
    assert set(marks.LIPS) <= set(mouth.rows[0]) and not mouth.network.training


@pytest.mark.slow
def test_other_options_are_refused(pictures, head, runs):
    with pytest.raises(InputError, match="other rate"):
        list(detector.train(runs / "points", pictures, head, options(rate=1.0)))
    with pytest.raises(InputError, match="one of finder, points"):
        options(network="other")


def test_an_empty_bank_is_refused(head, tmp_path):
    with pytest.raises(InputError, match="is no bank"):
        list(detector.train(tmp_path / "run", tmp_path, head, options()))
    runs_module.keep_options(tmp_path, bank.BankOptions())
    with pytest.raises(InputError, match="no pictures"):
        list(detector.train(tmp_path / "run", tmp_path, head, options()))


def test_loss_that_is_not_finite_stops_the_run(pictures, head, tmp_path, monkeypatch):
    broken = torch.zeros((), requires_grad=True) * float("nan")
    monkeypatch.setattr(detector.Trained, "loss", lambda *_: (broken, {}))
    with pytest.raises(ModelError, match="not finite at step 1"):
        list(detector.train(tmp_path, pictures, head, options(network="finder")))


def test_crops_show_their_points(head):
    """A dot painted at each of a few points comes out where the target says, turned or mirrored."""
    maps = batches.transform(
        torch.tensor([0.3, -0.4]), torch.tensor([0.5, 0.6]),
        torch.tensor([[0.1, 0.0], [0.0, 0.05]]), torch.tensor([False, True]),
    )  # fmt: skip
    place = torch.tensor([[[0.12, 0.02]], [[0.02, 0.1]]])
    v, u = torch.meshgrid(*[(torch.arange(200) + 0.5) / 200 - 0.5] * 2, indexing="ij")
    away = ((u - place[..., :1, None]) ** 2 + (v - place[..., 1:, None]) ** 2)[:, 0]
    pictures = (
        (255 * torch.exp(-away / (2 * 0.01**2))).to(torch.uint8)[..., None].repeat(1, 1, 1, 3)
    )
    crops = batches.cut(pictures, maps, 96)[:, 0]
    mass = (crops - 0.1).clamp_min(0)
    v, u = torch.meshgrid(*[(torch.arange(96) + 0.5) / 96 - 0.5] * 2, indexing="ij")
    seen = torch.stack([(mass * axis).sum((1, 2)) / mass.sum((1, 2)) for axis in (u, v)], -1)
    assert_allclose(seen, batches.into(maps, place)[:, 0], atol=0.01)


def test_degraded_pictures_keep_their_shape_and_depend_on_the_seed():
    image = torch.rand(5, 3, 48, 48, generator=torch.Generator().manual_seed(2))
    one, two, other = (
        degrade.photograph(image.clone(), torch.Generator().manual_seed(seed)) for seed in (0, 0, 1)
    )
    assert one.shape == image.shape and one.min() >= 0 and one.max() <= 1
    assert_allclose(one, two)
    assert (one - other).abs().mean() > 0.01


def test_blocks_of_cosines_come_back_at_a_fine_step():
    image = torch.rand(1, 3, 20, 28, generator=torch.Generator().manual_seed(2))
    assert_allclose(degrade.coded(image, 1e-5), image, atol=1e-4)
    flat = degrade.coded(torch.full((1, 1, 16, 16), 0.5), 0.1)
    assert flat.std() == 0 and abs(float(flat.mean()) - 0.5) < 0.1


def lips(gap, width=0.4):
    """The rims of a network that gives lips alone: points [1, n, 2] and their rows."""
    rows = np.concatenate([marks.LIPS_INNER_UPPER, marks.LIPS_INNER_LOWER[1:-1], [61, 291]])
    x = np.linspace(-width / 2, width / 2, 11)
    upper, lower = np.stack([x, 0 * x - gap / 2], 1), np.stack([x, 0 * x + gap / 2], 1)
    corners = [[-width / 2, 0], [width / 2, 0]]
    points = np.concatenate([upper, lower[1:-1], corners])
    return torch.tensor(points[None], dtype=torch.float32), detector_losses.LipRows.among(rows)


def test_an_opening_is_an_error_of_its_own():
    shut, rows = lips(0.0)
    ajar, _ = lips(0.02)
    wide, _ = lips(0.2)
    wider, _ = lips(0.22)
    error = detector_losses.lip_errors
    assert float(error(shut, shut, rows)) == 0
    # Lips that touch count twice; which way the error goes does not matter.
    assert_allclose(error(ajar, shut, rows), 2 * 0.02, rtol=1e-5)
    assert_allclose(error(wider, wide, rows), 0.02, rtol=1e-5)
    assert_allclose(error(wide, wider, rows), 0.02, rtol=1e-5)
    narrow, _ = lips(0.2, 0.36)
    assert_allclose(error(narrow, wide, rows), 0.5 * 0.04, rtol=1e-4)
    turned = torch.tensor([[0.0, -1.0], [1.0, 0.0]])
    assert_allclose(error(ajar @ turned.T, shut @ turned.T, rows), 2 * 0.02, rtol=1e-4)


def test_lips_stay_parted_as_photographed():
    """A morph may not open lips whose photo shows them shut."""
    rng = np.random.default_rng(0)
    photo = np.zeros((478, 3), np.float32)
    photo[:, :2] = rng.uniform(-0.5, 0.5, (478, 2))
    x = np.linspace(-0.2, 0.2, 11)
    for rows in (marks.LIPS_INNER_UPPER, marks.LIPS_INNER_LOWER, marks.LIPS_OUTER_UPPER):
        photo[rows, 0], photo[rows, 1] = x, 0.2
    morphed = photo.copy()
    morphed[marks.LIPS_INNER_LOWER[1:-1], 1] += 0.08
    for share, opening in ((1.0, 0.0), (0.0, 0.0)):
        shape = morphed.copy()
        faces_module.part_lips(shape, photo, share)
        gap = shape[marks.LIPS_INNER_LOWER, 1] - shape[marks.LIPS_INNER_UPPER, 1]
        assert_allclose(gap, opening, atol=1e-6)
    shape = photo.copy()
    faces_module.part_lips(shape, morphed, 0.5)
    gap = shape[marks.LIPS_INNER_LOWER, 1] - shape[marks.LIPS_INNER_UPPER, 1]
    assert_allclose(gap[1:-1], 0.04, atol=1e-6)


def test_pictures_without_points_are_refused(photos, tmp_path):
    cv2.imwrite(str(tmp_path / "other.png"), np.zeros((9, 9, 3), np.uint8))
    with pytest.raises(InputError, match="no picture with points"):
        photos_module.read_photos(tmp_path, photos / "dense.npz")


def test_mirror_swaps_the_sides():
    order = faces_module.mirror_order(np.stack([face_points(seed=s) for s in (3, 4)]))
    assert (order[order] == np.arange(478)).all()
    points = face_points(seed=3)[:, :2] - (60, 0)
    assert np.median(np.abs(points[order] * (-1, 1) - points)) < 1


def test_samples_depend_on_their_number_alone(photos):
    faces = faces_module.Faces(
        photos_module.read_photos(photos, photos / "dense.npz"), Backgrounds((), count=3)
    )
    one, two = (dataset.FinderSamples(faces, 0, 9)[5] for _ in "ab")
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


def test_perfect_finder_has_no_loss():
    target = torch.from_numpy(dataset.finder_target([(np.array([44.0, 20.0]), 48.0, 0.1)], 8))
    sure = torch.where(target[:1] > 0.99, 20.0, -20.0)
    loss, _ = detector_losses.finder_loss(torch.cat([sure, target[1:6]])[None], target[None])
    assert float(loss) < 1e-6


def test_rate_rises_stays_and_falls():
    plan = options(rate=1.0, decay_from=0.5)
    found = [
        detector.rate_at(*at, plan) for at in ((150, 0.0), (300, 0.4), (900, 0.75), (999, 1.0))
    ]
    assert_allclose(found, [0.5, 1, 0.5, 0], atol=1e-9)


def test_tones_keep_shape_and_type():
    image = procedural_background(np.random.default_rng(0), 64)
    for seed in range(6):
        out = augment.tone(np.random.default_rng(seed), image)
        assert out.shape == image.shape and out.dtype == np.uint8
