"""The texture step: what is told of ahead, what is kept, what a plug-in may give back."""

import threading
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from bakery.bake import textures
from bakery.bake.faces import one_face
from bakery.bake.fitting import fit_portrait, own_head
from bakery.bake.kept import Kept
from bakery.bake.options import BuildOptions
from bakery.cli.options import build_options
from bakery.errors import ModelError
from bakery.formats.work import Work
from bakery.hair.layer import HairLayer
from bakery.heads.file import load_head
from bakery.stages.generate import generate
from bakery.types import Generated


def test_a_generator_that_can_gets_ready_while_the_neutral_is_made(monkeypatch):
    """`paint` tells it of the head before anything is painted."""
    told = threading.Event()
    generator = SimpleNamespace(get_ready=lambda head: told.set())

    def prepare(*args):
        assert told.wait(5)
        raise StopIteration("enough")

    monkeypatch.setattr(textures, "prepare", prepare)
    monkeypatch.setattr(textures, "mattes_of", lambda *args: None)
    monkeypatch.setattr(textures, "made_from", lambda *args: "")
    monkeypatch.setattr(textures, "own_head", lambda head, fit: (head, None))
    nobody = SimpleNamespace(gaze=np.zeros(2), encoded=None, points=None)
    with pytest.raises(StopIteration, match="enough"):
        textures.paint(nobody, nobody, nobody, None, None, generator, HairLayer(), BuildOptions())


def test_what_a_generator_gives_back_is_checked():
    """A plug-in is named, and what is wrong with its picture is said."""
    seen = SimpleNamespace(part=np.zeros((4, 6), np.uint8))
    picture = np.ones((4, 6, 3), np.float32)
    good = Generated(picture, picture, picture, np.ones((4, 6), np.float32))

    def painter(made):
        return SimpleNamespace(name="other", generate=lambda *args: made)

    assert generate(painter(good), None, seen) is good
    for wrong, message in (
        (Generated(picture[:3], picture, picture, good.alpha), "image: shape"),
        (Generated(picture, picture * np.nan, picture, good.alpha), "not finite"),
        (Generated(picture, picture, picture, picture), "alpha: shape"),
        (None, "NoneType"),
    ):
        with pytest.raises(ModelError, match=f"generator 'other': .*{message}.*--generator"):
            generate(painter(wrong), None, seen)


def test_completed_skin_is_kept_until_the_neutral_is(tmp_path, monkeypatch):
    """Interrupted at the hair, a bake goes on from the skin, with the same numbers; then it is dropped."""
    sample = Path(__file__).resolve().parents[2] / "samples" / "anna.jpg"
    photo, face = one_face(sample, landmarks=sample.with_suffix(".json"))
    options = build_options("small", [])
    head = load_head("makehuman")
    fit, segmentation = fit_portrait(sample, photo, face, head, options)
    own, neutral = own_head(head, fit)
    seen = [textures.PhotoView(photo, face, fit, segmentation)]

    def bake(hair, kept):
        return textures.unwrapped(seen, own, neutral, hair, options.texture, kept)

    def stop(*args):
        raise KeyboardInterrupt

    whole = bake(HairLayer(), None)
    assert whole.subject.texture.dtype == np.float32  # all that follows takes half the time then
    kept = Kept(Work(tmp_path), "key")
    with pytest.raises(KeyboardInterrupt):
        bake(SimpleNamespace(layer=stop), kept)
    assert {path.name for path in tmp_path.iterdir()} == {"skin0.npz", "skin0.npz.key"}
    monkeypatch.setattr("bakery.stages.texture.neutral.complete", stop)
    then = bake(HairLayer(), kept)
    for name in ("source", "facing", "hair"):
        np.testing.assert_array_equal(getattr(then, name), getattr(whole, name))
    np.testing.assert_array_equal(then.subject.texture, whole.subject.texture)
    kept.drop("skin0")
    kept.drop("skin0")  # there need not be any
    assert list(tmp_path.iterdir()) == []
