"""Skins unwrapped from photographs."""

import cv2
import numpy as np
import pytest

from bakery.errors import InputError
from bakery.heads.file import load_head
from bakery.synth import quick, skins
from bakery.train.skins import unwrap_folder


def test_no_photos_is_an_error(tmp_path):
    with pytest.raises(InputError, match="neutral.jpg"):
        list(unwrap_folder(tmp_path, load_head("makehuman"), tmp_path / "skins"))


def test_mixed_skin_is_between_its_people(tmp_path, monkeypatch):
    """Two plain skins of two tones give a third tone between them, not one beyond."""
    monkeypatch.setattr(skins, "TEXELS", 64)
    head = load_head("makehuman")
    stage = quick.make_stage(head, 64)
    for name, level in (("a", 0.3), ("b", 0.5)):
        skins.save(tmp_path / f"{head.name}-{name}.npz", np.full((64, 64, 3), level, np.float32))
    paths = skins.skins_of(tmp_path, head)
    assert [path.name for path in paths] == [f"{head.name}-a.npz", f"{head.name}-b.npz"]
    for seed in range(6):
        mixed = skins.mixed(np.random.default_rng(seed), paths, stage.rest)
        # The tone's own random pigment is a factor exp(-0.14 m - ...) of one standard deviation.
        assert 0.3 * 0.5 < mixed.mean() < 0.5 * 2.0
        assert mixed.std(axis=(0, 1)).max() < 0.02  # plain skins have no features to mix


def test_skins_are_sorted_by_tone(tmp_path):
    for name, level in (("a", 0.5), ("b", 0.05), ("c", 0.2), ("d", 0.4)):
        skins.save(tmp_path / f"toy-{name}.npz", np.full((64, 64, 3), level, np.float32))
    tones = skins.by_tone(sorted(tmp_path.glob("*.npz")))
    assert [[path.stem[-1] for path in tone] for tone in tones] == [["b", "c"], ["d"], ["a"]]


@pytest.mark.slow
def test_unwrapped_skin_is_the_painted_one(tmp_path):
    """The tint of a painted portrait's skin comes back from its photo; its exposure need not."""
    from bakery.formats.image import write_image
    from bakery.synth.pairs.painter import PairOptions, draw_figure, photograph

    head = load_head("makehuman")
    stage = quick.make_stage(head, skins.TEXELS)
    rng = np.random.default_rng(3)
    figure, camera, balance = draw_figure(rng, stage, [], PairOptions())
    photo, _, _ = photograph(rng, figure, camera, balance, 256)
    grown = cv2.copyMakeBorder(photo.encoded, 200, 200, 200, 200, cv2.BORDER_CONSTANT, value=0.4)
    write_image(tmp_path / "x_neutral.jpg", grown, 95)
    (path,) = unwrap_folder(tmp_path, head, tmp_path / "skins")
    assert list(unwrap_folder(tmp_path, head, tmp_path / "skins")) == []
    found = skins.load(path)
    places = head.landmark_uv()[[50, 280, 205, 425]] * skins.TEXELS  # cheeks
    true, got = (
        np.median([a[int(y), int(x)] for x, y in places], 0) for a in (figure.albedo, found)
    )
    ratio = np.log2(got / true)
    # Exposure is not known from a photo; the tint is.
    assert np.ptp(ratio) < 0.6
