"""What kept work, recipes and records of a bake depend on; what a step refuses of another."""

import contextlib
import json
from dataclasses import is_dataclass, replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from bakery.bake import faces, pipeline
from bakery.bake.options import BuildOptions
from bakery.bake.pipeline import Request, recipe
from bakery.errors import UsageProblem
from bakery.export.consent import Consent
from bakery.formats.record import read_faces
from bakery.heads.file import save_head
from bakery.settings import listing, settings_of
from bakery.types import Camera, Fit, Landmarks, Maker

FEW = Path(__file__).parents[1] / "few.toml"
CONSENT = Consent("Ada agreed", "a" * 64)


@pytest.fixture
def request_of(portrait, tmp_path):
    photo, marks = portrait
    return Request(photo, tmp_path / "a.avatar", landmarks=marks)


def test_a_recipe_is_the_same_for_the_same_request(request_of, tmp_path):
    assert recipe(request_of) == recipe(replace(request_of, output=tmp_path / "b", strict=True))


def test_a_recipe_changes_with_everything_that_a_bundle_depends_on(
    request_of, portrait, head, tmp_path
):
    other = tmp_path / "other.json"
    table = json.loads(portrait[1].read_text())
    table["faces"][0]["points"][0][0] += 1
    other.write_text(json.dumps(table))
    large = tmp_path / "large.npz"
    save_head(large, replace(head, mean=head.mean * np.float32(1.1)))
    more = tmp_path / "more.toml"
    more.write_text(FEW.read_text() + "[[mouths]]\njawOpen = 0.5\n")
    cases = [
        replace(request_of, landmarks=other),
        replace(request_of, head=str(large)),
        replace(request_of, generator="rendered"),
        replace(request_of, hair="none"),
        replace(request_of, expressions=FEW),
        replace(request_of, expressions=more),
        replace(request_of, keep_photo=True),
        replace(request_of, consent=CONSENT),
        replace(request_of, consent=replace(CONSENT, sha256="b" * 64)),  # of another file
    ]
    found = {recipe(case) for case in (request_of, *cases)}
    assert len(found) == len(cases) + 1


def test_a_recipe_knows_a_file_of_expressions_by_its_content(request_of, tmp_path):
    copy = tmp_path / "copy.toml"
    copy.write_bytes(FEW.read_bytes())
    known = [recipe(replace(request_of, expressions=path)) for path in (FEW, copy)]
    assert known[0] == known[1]


def others(value, allowed):
    """Values to put in a value's place: those of them that its field takes are variants of it."""
    if isinstance(value, bool):
        return [not value]
    if isinstance(value, str):
        return [word for word in allowed.choices if word != value]
    if isinstance(value, int):
        return [value + 1, value - 1]
    if isinstance(value, float):
        return sorted({value + 1, value - 1, value / 2} - {value})  # half of 0 is no change
    return [
        (*value[:place], *entry, *value[place + 1 :])
        for place, old in enumerate(value)
        for entry in [(), *((new,) for new in others(old, allowed))]  # left out, or another
    ]


def variants(options, prefix=""):
    """Every record of options with one value changed: [(key as in --set, options)]."""
    made = []
    for name, (kind, allowed) in settings_of(type(options)).items():
        value = getattr(options, name)
        if is_dataclass(kind):
            inner = variants(value, f"{prefix}{name}.")
            made += [(key, replace(options, **{name: one})) for key, one in inner]
            continue
        for other in others(value, allowed):
            with contextlib.suppress(UsageProblem):  # a range that the changed value leaves
                made.append((prefix + name, replace(options, **{name: other})))
    return made


VARIANTS = variants(BuildOptions())


def test_every_option_has_a_variant():
    """A bound that lets none of the changes through would take an option out of the tests below."""
    assert {name for name, _ in VARIANTS} == {key for key, *_ in listing(BuildOptions())}


def test_every_option_is_in_the_recipe(request_of, monkeypatch):
    found = pipeline.one_face(request_of.photo, landmarks=request_of.landmarks)
    monkeypatch.setattr(pipeline, "one_face", lambda *given: found)
    known = {recipe(replace(request_of, options=options)) for _, options in VARIANTS}
    known.add(recipe(request_of))
    assert len(known) == len(VARIANTS) + 1


@pytest.mark.parametrize("what", ["version", "sha256"])
@pytest.mark.parametrize("group", ["generators", "detectors", "hair"])
def test_new_weights_or_another_version_are_another_recipe(
    request_of, portrait, monkeypatch, group, what
):
    """The detector's too, where it finds the face: a file of landmarks says who made it."""
    _, found = read_faces(portrait[1])
    monkeypatch.setattr(faces, "detect_faces", lambda *given: found)
    asked, real = replace(request_of, landmarks=None), pipeline.maker_of
    before = recipe(asked)

    def maker(of, plug_in):
        made = real(of, plug_in)
        return replace(made, **{what: "new"}) if of == group else made

    for part in (pipeline, faces):
        monkeypatch.setattr(part, "maker_of", maker)
    assert recipe(asked) != before


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
        ({"expressions": FEW}, ["paint"]),
        ({"detector": "other"}, EVERY),
        ({"face": 1}, EVERY),
        ({"frame": 0}, EVERY),
        ({"keep_photo": True, "strict": True, "output": "b.avatar", "consent": CONSENT}, []),
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


@pytest.mark.parametrize(
    "group, steps", [("detectors", EVERY), ("generators", ["paint"]), ("hair", ["paint"])]
)
def test_new_weights_make_again_what_they_made(again, monkeypatch, group, steps):
    weights = iter("12")  # of the first bake and of the second

    def maker(of, name):
        return {"name": name, "sha256": next(weights) if of == group else ""}

    monkeypatch.setattr(pipeline, "_maker", maker)
    assert again() == steps


# What changed options make again, by the table or the key; others change the packing alone.
NEEDS = {"segment": EVERY[1:], "fit": EVERY[1:], "texture": EVERY[2:], "texture.neutral": EVERY[1:]}


@pytest.mark.parametrize("name, options", VARIANTS, ids=[name for name, _ in VARIANTS])
def test_every_option_makes_again_what_depends_on_it_and_no_more(again, name, options):
    assert again(options=options) == NEEDS.get(name, NEEDS.get(name.split(".")[0], []))


def test_the_options_reach_every_step_that_looks_at_the_photo(
    request_of, ran, monkeypatch, tmp_path
):
    """Segmentation and fit are given what the user asked for, not what is usual."""
    given = {}

    def noted(name, result):
        def step(*args):
            given[name] = next(arg for arg in args if isinstance(arg, BuildOptions))
            return result

        return step

    monkeypatch.setattr(pipeline, "segment_portrait", noted("segment", None))
    monkeypatch.setattr(pipeline, "fit_portrait", noted("fit", (PLACED, None)))
    usual = request_of.options
    asked = replace(usual, segment=replace(usual.segment, method="colours"))
    pipeline.build(replace(request_of, landmarks=None, work=tmp_path / "work", options=asked))
    assert given == {"segment": asked, "fit": asked}
