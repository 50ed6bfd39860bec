"""Segmentation by the network that ships: painted people of known classes, what the rules add."""

import hashlib
import re
from dataclasses import replace

import cv2
import numpy as np
import pytest

from bakery import landmarks
from bakery.bake.options import BuildOptions
from bakery.detectors import portrait, segmenter
from bakery.errors import ModelError, UsageProblem
from bakery.evaluate import segmenting
from bakery.heads.file import load_head
from bakery.stages import segment as segments
from bakery.stages.segment import (
    LABELS,
    Segmentation,
    SegmentOptions,
    classes,
    kernels,
    network,
    segment,
)
from bakery.synth.portraits import PortraitOptions, random_portraits
from bakery.train.backgrounds import procedural_background

# A person of the seed that is measured with `bakery evaluate segment`, not of those learned from.
PERSON = [1000, 4]


@pytest.fixture(scope="module")
def people():
    """One painted person twice, with glasses and a hat: [(photo, points, labels)]."""
    options = PortraitOptions(glasses=1.0, hats=1.0, hands=0.0, things=0.0, hard=0.0)
    made = []
    for k, one in enumerate(random_portraits(load_head("makehuman"), PERSON, options)):
        share = one.alpha[..., None] / 255.0
        behind = procedural_background(np.random.default_rng(k), portrait.SIDE)
        picture = np.float32((one.image * share + behind * (1 - share)) / 255)
        made.append((picture, one.points, network.LABEL_OF[one.label]))
    return made


def seen(points):
    """The pixels of the photo [256, 256] that the network's crop covers."""
    side = portrait.SIDE
    rows, columns = np.indices((side, side)) + 0.5
    matrix = portrait.crop_matrix(points)
    across, down = (m[0] * columns + m[1] * rows + m[2] for m in matrix)
    return (np.minimum(across, down) > 0) & (np.maximum(across, down) < side)


def overlap(found, people, names):
    """IoU of some labels together, of all pictures, where the network looks."""
    members = [LABELS.index(name) for name in names]
    pairs = [
        (np.isin(f, members) & seen(points), np.isin(labels, members) & seen(points))
        for f, (_, points, labels) in zip(found, people)
    ]
    both, either = (sum(f(a, b).sum() for a, b in pairs) for f in (np.minimum, np.maximum))
    return both / either


def test_classes_of_painted_people(people):
    """The bars are about 0.1 below what was measured: these are two pictures of 256 pixels."""
    found = [segment(picture, points).labels for picture, points, _ in people]
    assert overlap(found, people, ("background",)) > 0.95
    assert overlap(found, people, ("glasses", "lens")) > 0.7
    assert overlap(found, people, ("clothes",)) > 0.85
    assert overlap(found, people, ("skin", "brows", "ears", "neck", "eyes", "lips", "beard")) > 0.85
    assert overlap(found, people, ("hat",)) > 0.85
    for name in ("lens", "brows", "neck", "hat"):
        assert (found[0] == LABELS.index(name)).any(), name


def test_what_steps_go_by(people):
    """Frames and hats are no skin; brows, ears and what a clear lens shows are."""
    picture, points, _ = people[0]
    result = segment(picture, points)
    assert result.regions.max() < len(segments.REGIONS)
    for name in ("glasses", "hat"):
        where = result.labels == LABELS.index(name)
        assert where.any() and result.skin[where].max() < 0.5, name
    hat = result.regions[result.labels == segments.HAT]  # glasses have a margin, also on a brim
    assert np.isin(hat, (segments.CLOTHES, segments.GLASSES)).all()
    assert (hat == segments.CLOTHES).mean() > 0.98
    brows = result.regions[result.labels == segments.BROWS]  # a frame may lie over them
    assert np.isin(brows, (segments.SKIN, segments.GLASSES)).all()
    assert (brows == segments.SKIN).mean() > 0.9
    through = result.regions[result.labels == segments.LENS]
    assert np.isin(through, (segments.GLASSES, segments.SKIN, segments.EYES)).all()
    assert (through != segments.GLASSES).mean() > 0.5, "a clear lens hides nothing"


def test_shadow_lies_on_skin(people):
    picture, points, _ = people[0]
    result = segment(picture, points)
    assert result.shadow.shape == picture.shape[:2] and result.shadow.dtype == np.float32
    assert (result.shadow[result.regions != segments.SKIN] == 0).all()
    assert segment(picture, points, SegmentOptions(method="colours")).shadow is None


def test_colours_know_the_regions_alone(people):
    picture, points, _ = people[0]
    result = segment(picture, points, SegmentOptions(method="colours"))
    assert result.labels.max() < len(segments.REGIONS)
    np.testing.assert_array_equal(result.labels, result.regions)


def test_the_photo_s_size_does_not_matter(people):
    """Four times as many pixels, and a margin that moves the face: the same classes."""
    picture, points, _ = people[0]
    small = segment(picture, points).labels
    large = cv2.resize(picture, None, fx=2, fy=2, interpolation=cv2.INTER_CUBIC)
    large = cv2.copyMakeBorder(large, 30, 0, 50, 0, cv2.BORDER_REPLICATE)
    moved = segment(np.clip(large, 0, 1), points * 2 + [50, 30]).labels[30:, 50:][::2, ::2]
    middle = (slice(30, -30), slice(30, -30))  # resampled edges move by less than a pixel
    assert (moved[middle] == small[middle]).mean() > 0.95


def test_every_class_has_a_label_and_a_region():
    assert len(network.LABEL_OF) == len(portrait.CLASSES)
    same = {"cloth": "clothes", "frame": "glasses"}
    assert [LABELS[k] for k in network.LABEL_OF] == [same.get(n, n) for n in portrait.CLASSES]
    labels = np.arange(len(LABELS), dtype=np.uint8)[None]
    regions = Segmentation(labels, np.zeros(labels.shape, np.float32)).regions
    assert regions.max() < len(segments.REGIONS)
    np.testing.assert_array_equal(
        regions[0, : len(segments.REGIONS)], np.arange(len(segments.REGIONS))
    )


def test_pixels_are_settled_as_plain_numpy_settles_them():
    rng = np.random.default_rng(0)
    model, part = (rng.normal(0.3, 0.4, (40, 30, n)).astype(np.float32) for n in (4, 3))
    planes = rng.integers(0, 256, (40, 30, 4)).astype(np.uint8)
    regions, skin = np.empty((40, 30), np.uint8), np.empty((40, 30), np.float32)
    kernels.settle(model, part, planes, regions, skin)
    refined = model[..., 3] + sum(model[..., k] * part[..., k] for k in range(3))
    rim, face, hair, clothes = np.moveaxis(planes, -1, 0)
    wanted = np.where(hair > clothes, np.uint8(classes.HAIR), np.uint8(classes.CLOTHES))
    wanted[np.maximum(hair, clothes) < 85] = classes.BACKGROUND
    wanted[(refined > 0.5) | (face > 127)] = classes.SKIN
    np.testing.assert_array_equal(regions, wanted)
    byte = np.float32(1 / 255)
    soft = np.maximum(np.clip((refined - 0.55) / 0.3, 0, 1), face * byte) * rim * byte
    np.testing.assert_array_equal(skin, soft)


def test_labels_are_named_in_their_regions_the_last_one_stays():
    rng = np.random.default_rng(1)
    planes = rng.integers(0, 256, (40, 30, 4)).astype(np.uint8)
    planes[:20] //= 2  # in no mask
    regions = rng.integers(0, 9, (40, 30)).astype(np.uint8)
    fits, told = rng.random((4, 9)) < 0.5, np.uint8([9, 12, 0, 10])
    labels, wanted = regions.copy(), regions.copy()
    kernels.name(planes, told, fits, regions, labels)
    for k, label in enumerate(told):
        wanted[(planes[..., k] > 127) & fits[k][regions]] = label
    np.testing.assert_array_equal(labels, wanted)


def test_bits_of_things_are_not_believed():
    """A small or doubtful thing goes to what is next likely; a large sure one stays."""
    points = np.tile([200.0, 190.0], (478, 1))
    points[landmarks.LEFT_EYE_OUTER], points[landmarks.RIGHT_EYE_OUTER] = [240, 190], [160, 190]
    radius = np.hypot(*(np.indices((400, 400)) - 200)) / 80
    small = np.full((400, 400, 3), 0.5, np.float32)
    for size, sureness, kept in ((6, 0.97, False), (60, 0.6, False), (60, 0.97, True)):
        shares = np.zeros((len(portrait.CLASSES), 400, 400), np.float32)
        shares[portrait.SKIN] = 1
        place = (slice(180, 180 + size), slice(180, 180 + size))
        shares[portrait.THING][place], shares[portrait.SKIN][place] = sureness, 1 - sureness
        network._settle_classes(shares, small, points, radius)
        top = shares.argmax(0)
        assert (top == portrait.THING).any() == kept, (size, sureness)
        assert np.isin(top, (portrait.SKIN, portrait.THING)).all()


def test_missing_and_damaged_weights(tmp_path, monkeypatch, people):
    """One line that says what to do; by colours the photo is labelled all the same."""
    picture, points, _ = people[0]
    for content in (None, b"no weights"):
        path = tmp_path / "segmenter.safetensors"
        if content:
            path.write_bytes(content)
        monkeypatch.setattr(portrait, "WEIGHTS", path)
        segmenter.shipped.cache_clear()
        with pytest.raises(ModelError, match="segment.method=colours") as told:
            segment(picture, points)
        assert "\n" not in str(told.value) and str(path) in str(told.value)
        assert segment(picture, points, SegmentOptions(method="colours")).skin.max() > 0.9
    segmenter.shipped.cache_clear()


def test_keys_know_the_weights_and_the_method(tmp_path, monkeypatch):
    of_network = segments.made_by(SegmentOptions())
    assert of_network == hashlib.sha256(portrait.WEIGHTS.read_bytes()).hexdigest()
    assert segments.made_by(SegmentOptions(method="colours")) == ""
    other = tmp_path / "other.safetensors"
    other.write_bytes(b"x")
    monkeypatch.setattr(portrait, "WEIGHTS", other)
    assert segments.made_by(SegmentOptions()) != of_network


def test_the_card_is_of_these_weights():
    card = portrait.WEIGHTS.with_suffix(".md").read_text(encoding="utf-8")
    (digest,) = re.findall(r"SHA-256 ([0-9a-f]{64})", card)
    assert digest == hashlib.sha256(portrait.WEIGHTS.read_bytes()).hexdigest()
    assert portrait.WEIGHTS.stat().st_size <= 4e6


def test_a_method_that_there_is_not():
    with pytest.raises(UsageProblem, match="one of network, colours"):
        replace(BuildOptions().segment, method="colors")


def test_glasses_measured_are_glasses(people):
    """What the figures of `evaluate segment` count is what the stage calls glasses."""
    assert [network.LABEL_OF[k] for k in segmenting.GROUPS["glasses"]] == [
        segments.GLASSES,
        segments.LENS,
    ]


@pytest.mark.parametrize(
    "light, label, side, hidden",
    [
        (0.2, segments.SKIN, "left", True),  # encoded 0.2 is a 34th of the light
        (0.6, segments.SKIN, "left", False),  # a third: dark, but the person's own
        (1.0, segments.HAIR, "left", True),
        (1.0, segments.HAIR, "both", False),  # nothing could stand in for it
        (1.0, segments.GLASSES, "left", False),
    ],
)
def test_one_side_is_hidden_where_it_shows_nothing(light, label, side, hidden):
    size = 80
    rows, columns = np.indices((size, size)) - (size - 1) / 2
    radius = np.hypot(rows, columns) / 36
    where = columns < 0 if side == "left" else np.ones_like(columns, bool)
    where = where & (rows < 10)
    labels = np.where(where, label, segments.SKIN)
    small = np.where(where[..., None], light, 1.0).repeat(3, 2).astype(np.float32)
    found = network._hidden_side(labels, small, radius)
    assert found.any() == hidden
    if hidden:
        inside = where & (radius < 0.9)
        assert found[inside].mean() > 0.9 and not found[~where & (columns > 8)].any()
    assert not found[radius >= 1].any()


def test_the_surest_class_is_argmax():
    """Also where two are as sure: the first."""
    rng = np.random.default_rng(3)
    shares = np.round(rng.random((15, 40, 50)), 1).astype(np.float32)
    found = network.surest(shares)
    assert found.dtype == np.uint8
    np.testing.assert_array_equal(found, shares.argmax(0))


def test_clothes_go_on_where_the_network_sees_no_more(people):
    """Below the crop the photo shows what the crop's border shows."""
    picture, points, _ = people[0]
    tall = cv2.copyMakeBorder(picture, 0, 90, 0, 0, cv2.BORDER_REPLICATE)
    below = segment(tall, points).labels[picture.shape[0] + 2 :]
    border = seen(points).any(1).nonzero()[0].max()
    within = segment(tall, points).labels[min(border, picture.shape[0] - 1)]
    rows = below[(below != segments.BACKGROUND).any(1)]
    assert len(rows) > 5, "what lies around the face is labelled beyond the crop"
    assert (rows[3] == within).mean() > 0.8
