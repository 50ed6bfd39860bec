"""The training of the segmentation network: batches, losses, runs that go on, what ships."""

import numpy as np
import pytest
import torch
from safetensors.torch import load_file, save_file

from bakery.detectors import portrait, segmenter
from bakery.errors import InputError
from bakery.synth import portrait_shards
from bakery.train import segment
from bakery.train.segment import augment, bank, beginning, camera, losses, real
from bakery.train.segment.outline import PERSON, UNSURE

SMALL = segment.SegmentTraining(
    steps=2, batch=2, real=0.0, held=2, backdrops=4, log_every=1, measure_every=2
)


@pytest.fixture(scope="module")
def pictures(painted):
    return bank.painted(painted, "cpu")


def batch_of(pictures, jitter=0.0):
    backdrops = torch.full_like(pictures.image, 90)
    return augment.cut(pictures, backdrops, jitter)


def test_crops_are_those_of_the_network(pictures):
    batch = batch_of(pictures)
    for k, points in enumerate(pictures.points.numpy()):
        matrix = portrait.crop_matrix(points)
        wanted = points @ matrix[:, :2].T + matrix[:, 2]
        np.testing.assert_allclose(batch.points[k], wanted, atol=0.02)
        label = segmenter.take(pictures.label[k].numpy(), matrix, nearest=True)
        known = batch.label[k].numpy() != UNSURE
        assert (batch.label[k].numpy() == label)[known].mean() > 0.98  # rounding at edges


def test_mirrored_pictures_keep_their_truth(pictures):
    torch.manual_seed(1)
    batch = batch_of(pictures)
    other = augment.mirrored(batch)
    drawn = segmenter.outlines(batch.points)
    turned = segmenter.outlines(other.points)
    flipped = 0
    for k in range(len(pictures)):
        if torch.equal(other.image[k], batch.image[k]):
            continue
        flipped += 1
        torch.testing.assert_close(other.label[k], batch.label[k].flip(-1))
        assert (turned[k] - drawn[k].flip(-1)).abs().mean() < 0.01
    assert 0 < flipped < len(pictures)


def test_things_and_shadows_change_picture_and_truth_together(pictures):
    torch.manual_seed(0)
    batch = batch_of(pictures)
    held = augment.with_things(batch, pictures.image, 1.0)
    changed = held.label != batch.label
    assert (held.label[changed] == portrait.THING).all() and changed.any()
    assert (held.shadow[held.label == portrait.THING] != 1).any()
    shaded = augment.with_shadows(batch, 1.0)
    new = (shaded.shadow == 1) & (batch.shadow != 1)
    darker = shaded.image.mean(1) < 0.8 * batch.image.mean(1)
    assert new.any() and darker[new].float().mean() > 0.95
    assert not (shaded.shadow == 1)[batch.label == portrait.BACKGROUND].any()
    untouched = augment.with_shadows(batch, 0.0)
    torch.testing.assert_close(untouched.image, batch.image)


def test_only_the_clothes_of_painted_people_change(pictures):
    torch.manual_seed(0)
    batch = batch_of(pictures)
    other = augment.dressed(batch, pictures.image, 1.0, 2)
    changed = (other.image - batch.image).abs().amax(1) > 1e-6
    assert not changed[2:].any() and changed[:2].any()
    assert (batch.label[changed] == portrait.CLOTH).all()


@pytest.mark.slow
def test_steps_learn(pictures):
    torch.manual_seed(0)
    batch, weight = batch_of(pictures.rows(slice(0, 2))), losses.weights("cpu")
    network, averaged = segmenter.SegmentNet(), segmenter.SegmentNet()
    optimizer = torch.optim.AdamW(network.parameters(), lr=3e-3)
    parts = [
        segment._step(network, averaged, optimizer, batch, weight, SMALL, "cpu") for _ in range(6)
    ]
    assert parts[-1]["cross"] < 0.85 * parts[0]["cross"]
    assert parts[-1]["person"] < parts[0]["person"]


@pytest.mark.parametrize("change", ["colored", "blurred", "shrunk", "noisy", "blocky"])
def test_cameras_keep_what_is_shown(pictures, change):
    torch.manual_seed(0)
    image = pictures.image.float() / 255
    out = getattr(camera, change)(image)
    assert out.shape == image.shape and torch.isfinite(out).all()
    for one, other in zip(out, image):
        flat = torch.corrcoef(torch.stack([one.mean(0).ravel(), other.mean(0).ravel()]))
        assert flat[0, 1] > 0.7


def test_the_right_answer_costs_nothing(pictures):
    batch = batch_of(pictures)
    weight = losses.weights("cpu")
    label = batch.label.masked_fill(batch.label == UNSURE, 0)
    right = torch.nn.functional.one_hot(label, len(portrait.CLASSES)).permute(0, 3, 1, 2) * 30.0
    shade = ((batch.shadow == 1).float() - 0.5) * 60
    parts = losses.loss_of(right, shade, batch, weight)
    assert all(float(value) < 1e-3 for value in parts.values()), parts
    wrong = losses.loss_of(right.roll(1, 1), -shade, batch, weight)
    assert float(wrong["cross"]) > 5 and float(wrong["dice"]) > 0.5
    assert float(wrong["person"]) > 1 and float(wrong["shadow"]) > 1


@pytest.mark.slow
def test_a_run_goes_on_where_it_was(painted, tmp_path):
    sources = segment.Sources(painted)
    whole = list(segment.train(tmp_path / "whole", sources, SMALL))
    half = segment.SegmentTraining(**(vars(SMALL) | {"steps": 1}))
    list(segment.train(tmp_path / "parts", sources, half))
    rest = list(segment.train(tmp_path / "parts", sources, SMALL))
    assert [f["step"] for f in whole] == [1, 2] and [f["step"] for f in rest] == [2]
    assert 0 <= whole[-1]["held_iou"] <= 1
    segment.export(tmp_path / "whole", tmp_path / "w.safetensors")
    assert (tmp_path / "w.safetensors").stat().st_size < 4e6
    stored = load_file(tmp_path / "w.safetensors")
    assert all(v.dtype == torch.float16 for v in stored.values())
    segmenter.load(tmp_path / "w.safetensors")
    segment.export(tmp_path / "whole", tmp_path / "mean.safetensors", portrait.WEIGHTS)
    mean, shipped = load_file(tmp_path / "mean.safetensors"), load_file(portrait.WEIGHTS)
    for name, value in mean.items():
        middle = (stored[name].float() + shipped[name].float()) / 2
        torch.testing.assert_close(value.float(), middle, rtol=2e-3, atol=1e-3)
    with pytest.raises(InputError, match="other batch"):
        list(segment.train(tmp_path / "whole", sources, segment.SegmentTraining(steps=2)))


def test_a_run_begins_with_weights_that_ship():
    """Normalised or not, the network answers as the folded one does."""
    stack = torch.rand(2, 3 + len(segmenter.OUTLINES), 64, 64, generator=torch.manual_seed(0))
    network = segmenter.SegmentNet()
    beginning.begin(network, portrait.WEIGHTS, stack)
    with torch.no_grad():
        truth = segmenter.load(portrait.WEIGHTS)(stack)[0]
        for mode in (False, True):
            answer = network.train(mode)(stack)[0]
            torch.testing.assert_close(answer, truth, rtol=1e-3, atol=2e-3)


@pytest.mark.slow
def test_time_ends_a_run_and_real_photos_join(painted, congress, tmp_path):
    lines = list(real.pack([(congress, "train", "", True)], tmp_path / "real.npz"))
    assert any(line["left_out"] is None for line in lines)
    options = segment.SegmentTraining(
        **(vars(SMALL) | {"real": 0.5, "steps": 10**6, "mirror": 0.1, "measure_every": 10**6})
    )
    sources = segment.Sources(painted, tmp_path / "real.npz")
    figures = list(segment.train(tmp_path / "run", sources, options, minutes=1e-4))
    assert len(figures) <= 2
    assert (tmp_path / "run" / segment.CHECKPOINT).exists()


def test_rates_fall_to_zero():
    options = segment.SegmentTraining()
    assert segment.rate_at(100, 0.0, options) == pytest.approx(options.rate / 2)
    assert segment.rate_at(10**4, 0.4, options) == options.rate
    assert segment.rate_at(10**4, 1.0, options) == 0


def test_a_run_without_checkpoint_ships_nothing(tmp_path):
    with pytest.raises(InputError, match="train first"):
        segment.export(tmp_path, tmp_path / "w.safetensors")


def test_real_portraits_come_back_and_are_mostly_true(painted, congress, tmp_path):
    table = portrait_shards.read(painted)
    lines = list(real.pack([(congress, "train", "", True)], tmp_path / "real.npz"))
    kept = [k for k, line in enumerate(lines) if line["left_out"] is None]
    found = real.read(tmp_path / "real.npz")
    assert found["image"].shape == (len(kept), portrait.SIDE, portrait.SIDE, 3)
    right, wrong, told, true = 0, 0, 0, 0
    surely = {  # what each may be; a hand and what lies under hair look like skin
        portrait.SKIN: (portrait.SKIN, portrait.THING),
        portrait.NECK: (portrait.NECK, portrait.SKIN, portrait.THING),
        portrait.EARS: (portrait.EARS, portrait.SKIN, portrait.THING),
        portrait.HAIR: (portrait.HAIR, portrait.HAT),
        portrait.CLOTH: (portrait.CLOTH,),
    }
    shown = set()
    for row, k in enumerate(kept):
        matrix = real.kept_matrix(table["points"][k])
        truth = segmenter.take(table["label"][k], matrix, nearest=True)
        known = found["person"][row] != UNSURE
        same = (found["person"][row] == PERSON) == (truth != portrait.BACKGROUND)
        right, wrong = right + (same & known).sum(), wrong + (~same & known).sum()
        for label, allowed in surely.items():
            where = found["label"][row] == label
            if where.sum() > 50:
                shown.add(label)
                told, true = told + where.sum(), true + np.isin(truth, allowed)[where].sum()
    assert {portrait.SKIN, portrait.NECK, portrait.CLOTH} <= shown
    assert right / (right + wrong) > 0.97
    # The tool's own labels are as good as the tool: what it says of one ear under hair may be wrong.
    assert true / told > 0.9


def test_a_teacher_fills_only_what_nobody_knew(congress, tmp_path):
    list(real.pack([(congress, "train", "", True)], tmp_path / "real.npz"))
    network = segmenter.SegmentNet(folded=True)
    torch.nn.init.zeros_(network.head.weight)
    torch.nn.init.zeros_(network.head.bias)
    network.head.bias.data[portrait.CLOTH] = 20.0  # sees cloth everywhere
    save_file(network.state_dict(), tmp_path / "teacher.safetensors")
    before = bank.photographed(tmp_path / "real.npz", "cpu")
    after = bank.photographed(tmp_path / "real.npz", "cpu", tmp_path / "teacher.safetensors")
    filled = after.label != before.label
    assert filled.any() and (before.label[filled] == UNSURE).all()
    assert (after.label[filled] == portrait.CLOTH).all()
    assert (after.person[filled] == PERSON).all()  # cloth on the backdrop is not believed


def test_other_files_are_refused(tmp_path):
    path = tmp_path / "real.npz"
    np.savez(path, other=np.zeros(3))
    with pytest.raises(InputError, match="not written by"):
        real.read(path)
