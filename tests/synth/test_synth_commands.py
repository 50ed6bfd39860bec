"""`bakery synth` from the outside: pairs, skins, sheets."""

import json
from dataclasses import replace
from functools import partial

import pytest
from click.testing import CliRunner

from bakery.cli.synth import synth
from bakery.errors import InputError
from bakery.formats import mark
from bakery.formats.image import read_photo
from bakery.geometry.camera import crop
from bakery.synth import failures, samples
from bakery.synth.pairs import Shard
from bakery.synth.pairs import painter as pair_painter
from bakery.synth.pairs import shards as pair_shards
from bakery.synth.render import paint


def run(*arguments):
    return CliRunner().invoke(synth, [str(a) for a in arguments], catch_exceptions=False, obj={})


def test_pairs_and_their_sheet(tmp_path, monkeypatch):
    monkeypatch.setattr(pair_shards.skins, "TEXELS", 256)
    usual = pair_painter.PairOptions

    def short(**options):
        return replace(usual(**options), targets=2)

    monkeypatch.setattr(pair_painter, "PairOptions", short)
    done = run("pairs", "-n", 2, "--size", 96, "--seed", 3, "-o", tmp_path / "pairs")
    assert done.exit_code == 0
    path = tmp_path / "pairs" / "pairs-00000.safetensors"
    assert done.stdout.split() == [str(path)]
    shard = Shard(path)
    assert len(shard) == 2 and shard.about["seed"] == 3 and shard[0].target.shape == (96, 96, 3)
    done = run("sheet", tmp_path / "pairs", "-o", tmp_path / "sheet.png", "--whole")
    assert done.exit_code == 0
    assert read_photo(tmp_path / "sheet.png").encoded.shape == (96, 2 * 3 * 96, 3)
    with pytest.raises(InputError, match="--overwrite"):
        run("sheet", tmp_path / "pairs", "-o", tmp_path / "sheet.png")


def test_what_is_not_there_is_said(tmp_path):
    with pytest.raises(InputError, match="holds no shards"):
        run("sheet", tmp_path, "-o", tmp_path / "sheet.png")
    with pytest.raises(InputError, match="neutral.jpg"):
        run("skins", tmp_path, "-o", tmp_path / "skins")
    with pytest.raises(InputError, match="no skins of head makehuman"):
        run("pairs", "-n", 1, "-o", tmp_path / "pairs", "--skins", tmp_path)
    assert not (tmp_path / "pairs").exists()
    assert run("pairs", "-n", 0, "-o", tmp_path).exit_code == 2


def test_failures_are_painted(tmp_path, monkeypatch):
    monkeypatch.setattr(failures, "SIZE", (96, 120))
    quick = partial(failures.paint_case, detail=2.0, share=0.1, supersample=1, quality=0.2)
    monkeypatch.setattr(failures, "paint_case", quick)
    done = run("failures", "hand", "-o", tmp_path)
    assert done.exit_code == 0 and done.stdout.split() == [str(tmp_path / "hand.jpg")]
    assert read_photo(tmp_path / "hand.jpg").encoded.shape == (120, 96, 3)
    assert mark.found(tmp_path / "hand.jpg") == mark.PAINTED


def test_samples_are_painted(tmp_path, monkeypatch):
    def quick(wardrobe, scene):
        small = crop(scene.camera, 0, 0, 96, 120, 96 / scene.camera.width)
        return paint(wardrobe, replace(scene, camera=small), supersample=1, quality=0.2)

    monkeypatch.setattr(samples, "dress", partial(samples.dress, detail=2.0, share=0.1))
    monkeypatch.setattr(samples, "paint", quick)
    done = run("samples", "anna", "-o", tmp_path)
    assert done.exit_code == 0 and done.stdout.split() == [str(tmp_path / "anna.jpg")]
    assert mark.found(tmp_path / "anna.jpg") == mark.PAINTED
    table = json.loads((tmp_path / "anna.json").read_text())
    assert len(table["faces"][0]["points"]) == 478
    with pytest.raises(InputError, match="no such case; known: smile"):
        run("failures", "beard", "-o", tmp_path, "--overwrite")
