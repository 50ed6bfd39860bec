"""What kept work, recipes and records of a bake depend on; what a step refuses of another."""

import json
from dataclasses import fields, is_dataclass, replace

import pytest

from bakery.bake import pipeline
from bakery.bake.estimate import estimate
from bakery.bake.options import BuildOptions
from bakery.bake.pipeline import Request, recipe
from bakery.types import Maker


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


def test_estimates_grow_with_what_is_asked():
    small = BuildOptions()
    large = replace(small, texture=replace(small.texture, resolution=4096))
    few = replace(small, texture=replace(small.texture, mouths=10))
    assert estimate(few).seconds < estimate(large).seconds
    assert estimate(small).gibibytes < estimate(large).gibibytes


def test_a_maker_says_which_plug_in_made_something():
    from bakery.plugins import maker_of, plug_in

    network = maker_of("generators", plug_in("generators", "pagan"))
    assert network.name == "pagan" and len(network.sha256) == 64 and network.version
    assert network.source_type == "compositeWithTrainedAlgorithmicMedia"
    assert maker_of("generators", plug_in("generators", "rendered")) == Maker(
        "rendered", network.version, "", "compositeSynthetic"
    )
