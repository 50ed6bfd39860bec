"""What kept work, recipes and records of a bake depend on; what a step refuses of another."""

import json
from dataclasses import fields, is_dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest

from bakery.bake import pipeline
from bakery.bake.options import BuildOptions
from bakery.bake.pipeline import Request, recipe
from bakery.types import Camera, Fit, Landmarks, Maker


@pytest.fixture
def request_of(portrait, tmp_path):
    photo, marks = portrait
    return Request(photo, tmp_path / "a.avatar", landmarks=marks)


def test_a_recipe_is_the_same_for_the_same_request(request_of, tmp_path):
    assert recipe(request_of) == recipe(replace(request_of, output=tmp_path / "b", strict=True))


def test_a_recipe_changes_with_everything_that_a_bundle_depends_on(request_of, portrait, tmp_path):
    other = tmp_path / "other.json"
    table = json.loads(portrait[1].read_text())
    table["faces"][0]["points"][0][0] += 1
    other.write_text(json.dumps(table))
    cases = [
        replace(request_of, landmarks=other),
        replace(request_of, generator="rendered"),
        replace(request_of, hair="none"),
        replace(request_of, keep_photo=True),
    ]
    found = {recipe(case) for case in (request_of, *cases)}
    assert len(found) == len(cases) + 1


def changed(value):
    if isinstance(value, bool):
        return not value
    if isinstance(value, (int, float)):
        return value + 1
    if isinstance(value, tuple):
        return (*value, value[0])
    return None


def variants(options):
    """Every record of options with one value changed."""
    for field in fields(options):
        value = getattr(options, field.name)
        if is_dataclass(value):
            for name, inner in variants(value):
                yield f"{field.name}.{name}", replace(options, **{field.name: inner})
        elif (other := changed(value)) is not None:
            try:
                yield field.name, replace(options, **{field.name: other})
            except Exception:  # a range that the changed value leaves
                continue


def test_every_option_is_in_the_recipe(request_of, monkeypatch):
    found = pipeline.one_face(request_of.photo, landmarks=request_of.landmarks)
    monkeypatch.setattr(pipeline, "one_face", lambda *given: found)
    known = {"as it is": recipe(request_of)}
    for name, options in variants(BuildOptions()):
        known[name] = recipe(replace(request_of, options=options))
    assert len(known) > 20 and len(set(known.values())) == len(known)


@pytest.mark.parametrize("what", ["version", "sha256"])
def test_new_weights_or_another_version_are_another_recipe(request_of, monkeypatch, what):
    before, found = recipe(request_of), pipeline.maker_of

    def maker(group, plug_in):
        made = found(group, plug_in)
        return replace(made, **{what: "new"}) if group == "generators" else made

    monkeypatch.setattr(pipeline, "maker_of", maker)
    assert recipe(request_of) != before


def test_a_maker_says_which_plug_in_made_something():
    from bakery.plugins import maker_of, plug_in

    network = maker_of("generators", plug_in("generators", "pagan"))
    assert network.name == "pagan" and len(network.sha256) == 64 and network.version
    assert network.source_type == "compositeWithTrainedAlgorithmicMedia"
    assert maker_of("generators", plug_in("generators", "rendered")) == Maker(
        "rendered", network.version, "", "compositeSynthetic"
    )


PLACED = Fit(
    "tiny", Camera(800.0, np.array([200.0, 240]), np.zeros(3), np.array([0, 0, -600.0]), 400, 480),
    np.zeros(3), np.zeros(52), np.zeros(2), np.zeros((9, 3)), np.zeros(4), np.zeros((468, 3)),
    np.zeros((478, 2)),
)  # fmt: skip


@pytest.fixture
def ran(monkeypatch):
    """The steps that a bake runs, in order; they do next to nothing, all around them is real."""
    steps = []

    def fit_portrait(*args):
        steps.append("fit")
        return PLACED, None

    def one_face(path, frame, given, number, detector, photo):
        steps.append("detect")
        points = np.random.default_rng(0).uniform(100, 300, (478, 2))
        return photo, Landmarks(np.array([100.0, 100, 200, 200]), 1.0, points, np.ones(478))

    def paint(photo, landmarks, fit, segmentation, head, generator, hair, options, kept, *rest):
        def make():
            steps.append("paint")
            return {"texture": np.zeros(3)}

        kept.one("neutral", make)

    monkeypatch.setattr(pipeline, "fit_portrait", fit_portrait)
    monkeypatch.setattr(pipeline, "one_face", one_face)
    monkeypatch.setattr(pipeline, "paint", paint)
    monkeypatch.setattr(pipeline, "load_head", lambda name: SimpleNamespace(digest=name))
    monkeypatch.setattr(pipeline, "plug_in", lambda group, name: name)
    monkeypatch.setattr(pipeline, "_maker", lambda group, name: {"name": name})
    monkeypatch.setattr(pipeline, "source_digest", lambda: "this version")
    for name in ("segment_portrait", "examine", "draw_masks", "_bundle"):
        monkeypatch.setattr(pipeline, name, lambda *args: [])
    return steps


@pytest.fixture
def again(request_of, ran, tmp_path):
    """The steps that a changed request runs in the work folder of the first one."""
    first = replace(request_of, landmarks=None, work=tmp_path / "work")

    def run(**changes):
        pipeline.build(first)
        ran.clear()
        pipeline.build(replace(first, **changes))
        return list(ran)

    return run


EVERY = ["detect", "fit", "paint"]


def test_a_bake_runs_every_step_once_and_then_none(again, ran, request_of, tmp_path):
    assert again() == []
    pipeline.build(replace(request_of, landmarks=None, work=tmp_path / "other"))
    assert ran == EVERY


@pytest.mark.parametrize(
    "changes, steps",
    [
        ({"head": "other"}, ["fit", "paint"]),
        ({"generator": "rendered"}, ["paint"]),
        ({"hair": "none"}, ["paint"]),
        ({"detector": "other"}, EVERY),
        ({"face": 1}, EVERY),
        ({"frame": 0}, EVERY),
        ({"keep_photo": True, "strict": True, "output": "b.avatar"}, []),
    ],
)
def test_what_a_step_is_made_from_makes_it_again(again, tmp_path, changes, steps):
    if "output" in changes:
        changes = changes | {"output": tmp_path / changes["output"]}
    assert again(**changes) == steps


def test_another_version_or_other_landmarks_make_all_again(again, portrait, monkeypatch):
    assert again(landmarks=portrait[1]) == EVERY
    versions = iter("12")
    monkeypatch.setattr(pipeline, "source_digest", lambda: next(versions))
    assert again() == EVERY


NEEDS = {"segment": ["fit", "paint"], "fit": ["fit", "paint"], "texture": ["paint"]}


@pytest.mark.parametrize("name, options", list(variants(BuildOptions())), ids=lambda x: str(x)[:40])
def test_every_option_makes_again_what_depends_on_it_and_no_more(again, name, options):
    assert again(options=options) == NEEDS.get(name.split(".")[0], [])
