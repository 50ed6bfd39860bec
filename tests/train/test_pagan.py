"""Training of the generator: samples, losses, a run that stops and goes on, several processes."""

import json
import subprocess
import sys
from dataclasses import replace

import cv2
import numpy as np
import pytest
import torch
from numpy.testing import assert_allclose

from bakery.errors import InputError, ModelError
from bakery.evaluate.metrics import ssim
from bakery.generators import pagan as inference
from bakery.generators.unet import INPUTS, Change, NetworkOptions, UNet
from bakery.heads.base import PARTS
from bakery.synth.pairs import PaintedPair, write_shard
from bakery.train import pagan
from bakery.train.pagan import data as pagan_data
from bakery.train.pagan import losses as pagan_losses
from bakery.train.pagan.data import UNIT, Cropping, Pairs, Samples, tensors
from bakery.train.pagan.export import export

SIDE = 64


@pytest.fixture(autouse=True)
def one_thread():
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(before)


def pair(subject, smile):
    """A face of two colours with an open mouth; the truth is a third brighter."""
    rng = np.random.default_rng([subject, smile])
    deformed = np.full((SIDE, SIDE, 3), 90 + 5 * subject, np.uint8)
    part = np.zeros((SIDE, SIDE), np.uint8)
    part[36:44, 24:40] = PARTS.index("mouth_cavity")
    landmarks = rng.uniform(16, 48, (478, 2)).astype(np.float32)
    return PaintedPair(
        photo=deformed,
        photo_face=np.full((SIDE, SIDE), 255, np.uint8),
        target=np.clip(deformed * 1.3, 0, 255).astype(np.uint8),
        deformed=deformed,
        normals=rng.integers(-127, 128, (SIDE, SIDE, 3)).astype(np.int8),
        depth=np.full((SIDE, SIDE), 200, np.uint8),
        gaze=np.zeros((SIDE, SIDE, 2), np.uint8),
        part=part,
        face=np.full((SIDE, SIDE), 255, np.uint8),
        strain=rng.integers(0, 256, (SIDE, SIDE, 2)).astype(np.uint8),
        folds=rng.integers(0, 256, (SIDE, SIDE, 2)).astype(np.uint8),
        landmarks=landmarks,
        expression=np.full(52, 0.1 * smile, np.float32),
        gaze_angles=np.zeros(2, np.float32),
        yaw=0.0,
        pitch=0.0,
        subject=subject,
        head="toy",
    )


@pytest.fixture(scope="module")
def shards(tmp_path_factory):
    folder = tmp_path_factory.mktemp("shards")
    pairs = [pair(subject, smile) for subject in range(4) for smile in (0, 1)]
    write_shard(folder / "pairs-00000.safetensors", pairs)
    return folder


def options(**changes):
    plain = dict(
        steps=4, batch=2, held_out=4, log_every=1, save_every=2, sheet_every=4,
        crop=Cropping(size=32), network=NetworkOptions(channels=(8, 8)),
    )  # fmt: skip
    return pagan.PaganOptions(**{**plain, **changes})


def losses_of(run):
    lines = (run / "stats.jsonl").read_text().splitlines()
    return {row["step"]: row["pixel"] for row in map(json.loads, lines)}


def test_every_fourth_subject_is_held_out(shards):
    pairs = Pairs([shards], Cropping(size=32), held_out=4)
    assert [len(folder) for folder in pairs.train] == [3]
    (person,) = pairs.held[0]
    assert {shard.number("subject")[row] for shard, row, _ in person} == {3}


def test_samples_are_their_seed_and_number(shards):
    pairs = Pairs([shards], Cropping(size=32))
    one, other = (Samples(pairs, seed, 10)[5] for seed in (0, 1))
    again = Samples(Pairs([shards], Cropping(size=32)), 0, 10)[5]
    assert all(torch.equal(one[name], again[name]) for name in one)
    assert any(not torch.equal(one[name], other[name]) for name in one)


def test_flipping_mirrors_pictures_and_normals(shards):
    pairs = Pairs([shards], Cropping(size=32))
    layers = pairs.decoded(*pairs.train[0][0][0][:2])
    plain, flipped = tensors(layers, SIDE), tensors(layers, SIDE, flip=True)
    assert torch.equal(plain["depth"].flip(-1), flipped["depth"])
    normals = plain["normals"].flip(-1).int()
    normals[0] = 256 - normals[0]  # 128 is zero
    assert torch.equal(normals, flipped["normals"].int())


def test_exact_crops_are_pieces_of_their_pair(shards, monkeypatch):
    """Every pixel of a crop is one of the pair's; a resampled one has others in between."""
    monkeypatch.setattr(pagan_data, "NOMINAL", SIDE)

    def pieces(exact):
        pairs = Pairs([shards], Cropping(size=32, exact=exact, color=0))
        samples = Samples(pairs, 0, 6)
        normals = [
            s["normals"].permute(1, 2, 0).reshape(-1, 3) for s in map(samples.__getitem__, range(6))
        ]
        seen = {tuple(row) for part in normals for row in part.tolist()}
        whole = {
            tuple(row)
            for person in pairs.train[0]
            for shard, k, _ in person
            for row in pairs.decoded(shard, k)["normals"].reshape(-1, 3).tolist()
        }
        flipped = {(256 - x if x else 0, y, z) for x, y, z in whole}
        return seen <= whole | flipped

    assert pieces(1.0) and not pieces(0.0)


def test_decoded_pairs_are_forgotten_in_time(shards):
    pairs = Pairs([shards], Cropping(size=32), memory=0)
    for person in pairs.train[0]:
        for shard, row, _ in person:
            pairs.decoded(shard, row)
    assert len(pairs._kept) == 1


def test_decoded_pairs_are_kept_in_a_folder(shards, tmp_path, monkeypatch):
    kept, plain = Pairs([shards], cache=tmp_path / "decoded"), Pairs([shards])
    rows = [row[:2] for person in plain.train[0] for row in person]
    for _ in range(2):  # decoded, then read
        for row in rows:
            one, other = kept.decoded(*row), plain.decoded(*row)
            assert one.keys() == other.keys()
            assert all(np.array_equal(one[name], other[name]) for name in one)
        kept = Pairs([shards], cache=tmp_path / "decoded")
        monkeypatch.setattr(kept, "_decode", None)
    assert len(list((tmp_path / "decoded").iterdir())) == len(rows)


def test_crops_show_where_the_loss_counts(tmp_path):
    """A pair whose loss counts in an eye alone: no whole frame, no crop of the mouth."""
    one = pair(0, 1)
    face = np.zeros_like(one.face)
    x, y = np.round(one.landmarks[pagan_data.EYES[0]].mean(0)).astype(int)
    face[y - 1 : y + 2, x - 1 : x + 2] = 255
    write_shard(tmp_path / "pairs-00000.safetensors", [replace(one, face=face)])
    pairs = Pairs([tmp_path], Cropping(size=16, mouth=0.5, eyes=0.2, whole=0.5), held_out=0)
    samples = [Samples(pairs, 0, 20)[k] for k in range(20)]
    assert not any(sample["whole"] for sample in samples)
    seen = [bool(sample["weight"].any()) for sample in samples]
    assert np.mean(seen) > 0.9  # the crop's place is drawn around it


def test_weight_counts_mouth_and_eyes_more(shards):
    pairs = Pairs([shards], Cropping(mouth_weight=4.0))
    layers = pairs.decoded(*pairs.train[0][0][0][:2])
    ring = layers["landmarks"][pagan_data.LIPS_OUTER]
    filled = np.zeros((SIDE, SIDE), np.uint8)
    cv2.fillPoly(filled, [np.round(ring).astype(np.int32)], 1)
    inside = cv2.erode(filled, np.ones((3, 3))) > 0
    assert inside.any()
    assert np.median(layers["weight"][inside]) >= 4 * pagan_data.UNIT
    assert layers["weight"].min() >= pagan_data.UNIT


def test_pixel_loss_is_the_mean_where_it_counts():
    a, b = torch.zeros(1, 3, 4, 4), torch.full((1, 3, 4, 4), 0.5)
    weight = torch.zeros(1, 1, 4, 4)
    weight[..., :2] = 16
    b[..., 2:] = 1
    assert_allclose(pagan_losses.pixel_loss(a, b, weight), 0.5)


def test_detail_loss_ignores_a_shift_of_tone_and_sees_an_edge():
    a = torch.rand(1, 3, 16, 16)
    weight = torch.ones(1, 1, 16, 16)
    assert pagan_losses.detail_loss(a + 0.1, a, weight, 2) < 1e-6
    edge = torch.zeros(1, 3, 16, 16)
    edge[..., 8:] = 1
    # At full size one column of 16 differs by 1, once for each of the 256 pixels' rows.
    assert_allclose(pagan_losses.detail_loss(edge, torch.zeros_like(edge), weight, 1), 1 / 16)


def test_structure_loss_is_what_is_measured():
    rng = np.random.default_rng(0)
    a, b = rng.random((2, 40, 40, 3), np.float32)
    inside = np.zeros((40, 40), bool)
    inside[8:-8, 8:-8] = True  # away from the border, where blurs end differently
    first, second, weight = (
        torch.from_numpy(np.float32(x.reshape(40, 40, -1).transpose(2, 0, 1)))[None]
        for x in (a, b, inside)
    )
    loss = pagan_losses.structure_loss(first, second, weight)
    assert_allclose(1 - loss, ssim(a, b, inside), atol=1e-4)  # float32
    assert pagan_losses.structure_loss(first, first, weight) < 1e-4


def test_restraint_is_cheap_inside_the_mouth():
    ratio = torch.zeros(1, 3, 8, 8)
    alpha = torch.full((1, 1, 8, 8), 0.5)
    change = Change(ratio, ratio, alpha, ratio)
    weight = torch.ones(1, 1, 8, 8)
    on_skin, rough = pagan_losses.restraint(change, weight, torch.ones(1, 1, 8, 8))
    inside, _ = pagan_losses.restraint(change, weight, torch.zeros(1, 1, 8, 8))
    assert_allclose(on_skin, 0.5)
    assert_allclose(inside, 0.05)
    assert rough == 0


def test_patches_of_the_mouth_are_judged():
    weight = torch.full((1, 1, 8, 24), float(UNIT))
    weight[..., 8:16] *= 4  # a mouth
    weight[..., 16:] = 0  # no face
    assert_allclose(pagan_losses.patch_weight(weight), [[[[0, 3, 0]]]])


def test_discriminator_learns_to_tell():
    torch.manual_seed(0)
    judge = pagan_losses.PatchDiscriminator(2, 8)
    adam = torch.optim.Adam(judge.parameters(), 5e-3)
    conditions, weight = torch.zeros(4, 2, 32, 32), torch.ones(4, 1, 4, 4)
    rough, flat = torch.rand(4, 3, 32, 32), torch.full((4, 3, 32, 32), 0.5)
    for _ in range(40):
        loss = pagan_losses.judged(judge(conditions, rough), True, weight)
        loss = loss + pagan_losses.judged(judge(conditions, flat), False, weight)
        adam.zero_grad()
        loss.backward()
        adam.step()
    assert loss < 0.9  # 2 log 2 = 1.39 when it cannot tell


def test_a_run_learns_and_ships(shards, tmp_path):
    run = tmp_path / "run"
    rows = list(pagan.train(run, [shards], options(steps=60, rate=1e-2, log_every=10)))
    assert rows[-1]["pixel"] < 0.5 * rows[0]["pixel"]
    assert rows[-1][f"{shards.name}_psnr"] > rows[-1][f"{shards.name}_before"] + 3
    assert cv2.imread(str(run / "samples" / "000060.png")).shape[1] == 4 * 512
    figures = export([run], tmp_path / "w.safetensors")
    assert figures["steps"] == [60]
    assert inference.load(tmp_path / "w.safetensors").network.options.channels == (8, 8)


@pytest.mark.slow
def test_the_mean_of_two_runs(shards, tmp_path):
    for name, rate in (("one", 1e-2), ("other", 2e-2)):
        list(pagan.train(tmp_path / name, [shards], options(steps=4, rate=rate)))
    found = []
    for names in (("one",), ("other",), ("one", "other")):
        export([tmp_path / name for name in names], tmp_path / "w.safetensors")
        network = inference.load(tmp_path / "w.safetensors").network
        found.append(network.head.weight.detach())  # no normalisation is folded into it
    assert not torch.equal(found[0], found[1])
    assert_allclose(found[2], (found[0] + found[1]) / 2, atol=1e-4)  # half precision
    deep = NetworkOptions(channels=(8, 8, 8))
    list(pagan.train(tmp_path / "deep", [shards], options(steps=1, network=deep)))
    with pytest.raises(InputError, match="different networks"):
        export([tmp_path / "one", tmp_path / "deep"], tmp_path / "w.safetensors")


@pytest.mark.slow
def test_a_run_begins_where_another_ended(shards, tmp_path):
    list(pagan.train(tmp_path / "one", [shards], options(steps=20, rate=1e-2)))
    export([tmp_path / "one"], tmp_path / "w.safetensors")
    begun = options(steps=1, rate=1e-9, begin=str(tmp_path / "w.safetensors"))
    list(pagan.train(tmp_path / "two", [shards], begun))
    export([tmp_path / "two"], tmp_path / "again.safetensors")
    one, two = (
        inference.load(tmp_path / name).network.state_dict()
        for name in ("w.safetensors", "again.safetensors")
    )
    for name, value in one.items():
        assert_allclose(two[name], value, atol=1e-4)  # half precision, and a step of 1e-9


def test_a_run_may_look_at_more_than_the_weights_it_begins_with(shards, tmp_path):
    few = NetworkOptions(channels=(8, 8), inputs=("photo", "normals"))
    list(pagan.train(tmp_path / "one", [shards], options(steps=20, rate=1e-2, network=few)))
    export([tmp_path / "one"], tmp_path / "w.safetensors")
    small = inference.load(tmp_path / "w.safetensors").network
    wide = NetworkOptions(channels=(8, 8), inputs=("photo", "normals", "strain"))
    large = UNet(wide, folded=True)
    large.load_state_dict(pagan.widened(small, wide))
    x = torch.rand(1, 8, 16, 16)
    assert_allclose(large(x).detach(), small(x[:, :6]).detach(), atol=1e-6)  # blind to it as yet
    other = NetworkOptions(channels=(8, 8), inputs=("normals", "photo"))
    with pytest.raises(InputError, match="must begin with"):
        begin = str(tmp_path / "w.safetensors")
        list(pagan.train(tmp_path / "two", [shards], options(network=other, begin=begin)))


@pytest.mark.slow
def test_a_run_may_have_more_channels_than_the_weights_it_begins_with(shards, tmp_path):
    few = NetworkOptions(channels=(8, 8))
    list(pagan.train(tmp_path / "one", [shards], options(steps=20, rate=1e-2, network=few)))
    export([tmp_path / "one"], tmp_path / "w.safetensors")
    small = inference.load(tmp_path / "w.safetensors").network
    wide = NetworkOptions(channels=(12, 8))
    large = UNet(wide, folded=True)
    large.load_state_dict(pagan.widened(small, wide))
    x = torch.rand(1, sum(INPUTS.values()), 16, 16)
    assert_allclose(large(x).detach(), small(x).detach(), atol=1e-5)  # order of the sums
    torch.nn.functional.mse_loss(large(x), torch.zeros(1, 7, 16, 16)).backward()
    assert large.head.weight.grad[:, 8:].abs().min() > 0  # what is new can learn
    for other in (NetworkOptions(channels=(4, 8)), NetworkOptions(channels=(8, 8, 8))):
        with pytest.raises(InputError, match="as many levels"):
            pagan.widened(small, other)
    # A picture's three outputs are no log-ratio, though they would fit in.
    plain = UNet(NetworkOptions(channels=(8, 8), head="plain"), folded=True)
    with pytest.raises(InputError, match="head plain"):
        pagan.widened(plain, few)


@pytest.mark.slow
def test_a_stopped_run_goes_on_with_the_same_curve(shards, tmp_path):
    whole, parts = tmp_path / "whole", tmp_path / "parts"
    chosen = options(steps=4, adversarial_from=1, judge_alone=1, judge_channels=8)
    list(pagan.train(whole, [shards], chosen))
    stopped = pagan.train(parts, [shards], chosen)
    for _ in range(2):  # stopped behind its checkpoint of step 2
        next(stopped)
    stopped.close()
    list(pagan.train(parts, [shards], chosen))
    one, other = losses_of(whole), losses_of(parts)
    assert set(one) == set(other) == {1, 2, 3, 4}
    assert_allclose(list(one.values()), list(other.values()), atol=2e-6)  # as they are logged


def test_other_options_are_refused(shards, tmp_path):
    list(pagan.train(tmp_path, [shards], options(steps=1)))
    with pytest.raises(InputError, match="other rate"):
        list(pagan.train(tmp_path, [shards], options(steps=1, rate=0.5)))


@pytest.mark.parametrize(
    "changes, message",
    [
        (lambda: {"network": NetworkOptions(head="round")}, "head: 'round'; one of change, plain"),
        (lambda: {"network": NetworkOptions(inputs=("smell",))}, r"inputs\[0\]: 'smell'; one of"),
        (lambda: {"crop": Cropping(size=30)}, "multiple of 4"),
    ],
)
def test_options_that_cannot_be(changes, message):
    with pytest.raises(InputError, match=message):
        options(**changes())


def test_a_loss_that_is_not_finite_stops_the_run(shards, tmp_path, monkeypatch):
    monkeypatch.setattr(pagan_losses, "pixel_loss", lambda *_: torch.tensor(float("nan")))
    with pytest.raises(ModelError, match="not finite at step 1"):
        list(pagan.train(tmp_path, [shards], options()))


def test_no_pairs_are_an_error(tmp_path):
    with pytest.raises(InputError, match="holds no shards"):
        list(pagan.train(tmp_path / "run", [tmp_path], options()))
    with pytest.raises(InputError, match="no run of"):
        export([tmp_path / "nothing"], tmp_path / "w.safetensors")


@pytest.mark.slow
def test_two_processes_train_one_network(shards, tmp_path):
    """torchrun with two processes: one log, one checkpoint, the batch shared out."""
    settings = [
        f"--set={setting}"
        for setting in (
            "batch=1", "log_every=1", "save_every=2", "threads=1", "held_out=0",
            "crop.size=32", "network.channels=[8, 8]",
        )
    ]  # fmt: skip
    command = [
        sys.executable, "-m", "torch.distributed.run", "--standalone", "--nproc-per-node", "2",
        "-m", "--", "bakery", "train", "pagan", "--run", str(tmp_path), "--pairs", str(shards),
        "--steps", "2", *settings,
    ]  # fmt: skip
    done = subprocess.run(command, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr[-2000:]
    assert set(losses_of(tmp_path)) == {1, 2}
    assert (tmp_path / "checkpoint.safetensors").exists()
