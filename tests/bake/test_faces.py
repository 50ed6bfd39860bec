"""Which face of a photo is meant: one that stands out, the one that is asked for, or a refusal."""

import json
from pathlib import Path

import numpy as np
import pytest

from bakery.bake.faces import LARGER, LESS_SURE, choose_face, find_faces, one_face
from bakery.bake.fitting import check_same_face, fit_portrait
from bakery.bake.options import BuildOptions
from bakery.bake.pipeline import Request, recipe
from bakery.errors import InputError
from bakery.formats import image, record
from bakery.formats.record import read_faces
from bakery.stages.fit import FitOptions
from bakery.types import Landmarks

BY_POINTS = BuildOptions(fit=FitOptions(photometric=False))


def of(size, score=0.95):
    """A face of some pixels; where it lies says nothing."""
    return Landmarks(np.array([5, 6, size, 0.9 * size]), score, np.zeros((478, 2)), np.ones(478))


@pytest.mark.parametrize(
    "faces",
    [
        [of(400)],
        [of(400), of(33, 0.6)],  # something on the wall
        [of(400, 0.9), of(150, 0.97)],  # somebody behind, as sharp
        [of(400), of(250), of(100)],
        [of(LARGER * 200), of(200)],
        [of(400, 0.9), of(200, 0.9 + LESS_SURE - 1e-6)],
    ],
)
def test_the_face_that_stands_out_is_taken(faces):
    assert choose_face("a.jpg", faces) is faces[0]


@pytest.mark.parametrize(
    "faces",
    [
        [of(400), of(390)],
        [of(400), of(400 / LARGER + 1)],
        [of(400), of(100), of(300)],
        [of(400, 0.62), of(150, 0.95)],  # a rock, and a person before it
    ],
)
def test_where_none_does_the_options_name_is_told(faces):
    with pytest.raises(InputError, match="choose one with --face N") as caught:
        choose_face("a.jpg", faces)
    assert str(caught.value).startswith(f"a.jpg: {len(faces)} faces (1 at (5, 6) of 400 pixels, ")
    assert "\n" not in str(caught.value)
    for number, face in enumerate(faces, 1):
        assert choose_face("a.jpg", faces, number) is face


def test_a_number_that_there_is_not():
    with pytest.raises(
        InputError, match=r"^a.jpg: has 2 face\(s\), no face 3; give a lower --face"
    ):
        choose_face("a.jpg", [of(400), of(100)], 3)


@pytest.fixture(scope="module")
def crowd(portrait, tmp_path_factory):
    """The painted portrait with itself behind it, a third as large; a function that writes points."""
    folder = tmp_path_factory.mktemp("crowd")
    one = (image.read_photo(portrait[0]).encoded * 255).round().astype(np.uint8)
    photo = np.full((480, 600, 3), 102, np.uint8)
    photo[:, :400] = one
    photo[100:260, 430:564] = one[::3, ::3]
    image.write_image(folder / "crowd.png", photo / 255.0)
    (large,) = read_faces(portrait[1])[1]
    small = Landmarks(
        large.box / 3 + [430, 100, 0, 0], 0.95, large.points / 3 + [430, 100], large.confidence
    )

    def points(name, size=1.0, chosen=None):
        """The landmarks' file; the one behind that many times as large."""
        middle = small.points.mean(0)
        there = (small.points - middle) * size + middle
        low, high = there.min(0), there.max(0)
        other = Landmarks(np.r_[low, high - low], 0.95, there, small.confidence)
        table = record.faces_to_table(600, 480, [other, large], chosen)  # the smaller one first
        (folder / name).write_bytes(record.dump(table))
        return folder / name

    return folder / "crowd.png", points


def test_somebody_behind_does_not_stop_a_bake(bakery, crowd, tmp_path):
    """Said in one line; `--face` takes the other one, and every step says the same."""
    photo, points = crowd
    given = ["--landmarks", points("two.json")]
    small, large = (round(float(face.box[2:].max())) for face in read_faces(given[1])[1])
    said = f"took the largest face ({large} pixels); left out 1 more ({small} pixels), see --face N"
    for command, out in (("fit", "a.json"), ("segment", "a.png"), ("build", "a.avatar")):
        dry = ["-n"] if command == "build" else []
        done = bakery(command, photo, *given, "-o", tmp_path / out, *dry)
        assert done.returncode == 0, done.stderr
        assert done.stderr.count("took the largest face") == 1
        assert any(line.endswith(f"crowd.png: {said}") for line in done.stderr.splitlines()), (
            done.stderr
        )
    done = bakery("fit", photo, *given, "-o", tmp_path / "one.json", "--face", "1")
    assert done.returncode == 0 and "left out" not in done.stderr
    assert placed(tmp_path / "one.json") == placed(tmp_path / "a.json")
    done = bakery("build", photo, *given, "-n", "--face", "3", "-o", tmp_path / "b.avatar")
    assert done.returncode == 1 and "has 2 face(s), no face 3" in done.stderr
    assert len(done.stderr.splitlines()) == 1


def placed(path):
    return json.loads(path.read_text())["landmarks_projected"]


def test_two_alike_are_refused(bakery, crowd, tmp_path):
    photo, points = crowd
    given = [photo, "--landmarks", points("alike.json", 2.5)]
    for command in ("fit", "segment", "build"):
        done = bakery(command, *given, "-o", tmp_path / "a.avatar", "-n")
        assert done.returncode == 1 and "choose one with --face N" in done.stderr
        assert len(done.stderr.splitlines()) == 1 and not list(tmp_path.iterdir())
    done = bakery("fit", *given, "--face", "2", "-o", tmp_path / "a.json")
    assert done.returncode == 0, done.stderr
    assert np.mean(placed(tmp_path / "a.json"), 0)[0] > 400  # the one on the right


def test_the_file_says_which_one_is_meant(crowd, tmp_path):
    photo, points = crowd
    _, face = one_face(photo, landmarks=points("chosen.json", 2.5, chosen=2))
    assert face.points[:, 0].mean() > 400
    _, face = one_face(photo, landmarks=points("chosen.json", 2.5, chosen=2), number=1)
    assert face.points[:, 0].mean() < 400  # the option has the last word
    table = json.loads(points("chosen.json").read_text())
    for wrong in (0, 3, "2", True, 1.0, [1]):
        (tmp_path / "bad.json").write_text(json.dumps(table | {"face": wrong}))
        with pytest.raises(InputError, match="bad.json: face .* write it again") as caught:
            one_face(photo, landmarks=tmp_path / "bad.json")
        assert "\n" not in str(caught.value)


def test_the_choice_is_in_the_recipe(crowd, tmp_path):
    """The face that is taken counts, not how it was chosen."""
    photo, points = crowd
    path, chosen = points("half.json", 1.5), points("second.json", 1.5, chosen=2)

    def of(path, face=None):
        return recipe(Request(photo, tmp_path / "a", landmarks=path, face=face))

    assert of(path, 1) != of(path, 2)
    assert of(path) == of(path, 1) and of(chosen) == of(path, 2)


def test_detect_keeps_the_choice(bakery, tmp_path):
    """The detector sees one face in a sample: number 1 is written, number 2 refused."""
    sample = Path(__file__).parents[2] / "samples" / "anna.jpg"
    done = bakery("detect", sample, "--face", "1", "-o", tmp_path / "a.json")
    assert done.returncode == 0 and record.read_choice(tmp_path / "a.json") == 1
    done = bakery("detect", sample, "--face", "2", "-o", tmp_path / "b.json")
    assert done.returncode == 1 and "no face 2; give a lower --face" in done.stderr
    assert len(done.stderr.splitlines()) == 1 and not (tmp_path / "b.json").exists()
    done = bakery("detect", sample, "-o", tmp_path / "b.json")
    assert done.returncode == 0 and record.read_choice(tmp_path / "b.json") is None


def test_a_fit_of_another_face_is_refused(bakery, crowd, head, tmp_path):
    """A fit made with --face 2 goes with nothing that is made without it."""
    photo, path = crowd[0], crowd[1]("alike.json", 2.5)
    seen, second = one_face(photo, landmarks=path, number=2)
    fit, _ = fit_portrait(photo, seen, second, head, BY_POINTS)
    check_same_face("fit.json", fit, second)
    with pytest.raises(InputError, match="fit.json: a fit of another face .* give the --face"):
        check_same_face("fit.json", fit, one_face(photo, landmarks=path, number=1)[1])
    (tmp_path / "fit.json").write_bytes(record.dump(record.fit_to_table(fit)))
    done = bakery(
        "texture", photo, "--landmarks", path, "--fit", tmp_path / "fit.json", "--face", "1",
        "-o", tmp_path / "t.npz",
    )  # fmt: skip
    assert done.returncode == 1 and "a fit of another face" in done.stderr
    assert len(done.stderr.splitlines()) == 1 and not (tmp_path / "t.npz").exists()


@pytest.mark.parametrize(
    ("side", "refused"),
    [((0, 0.5), True), ((0, 0.53), True), ((0, 0.56), False), ((0.25, 1), False)],
)
def test_half_a_face_is_refused(tmp_path, side, refused):
    """Cut through the nose or an eye; where only the far cheek is missing a warning is enough."""
    whole = image.read_photo(Path(__file__).parents[2] / "samples" / "anna.jpg").encoded
    first, last = (round(share * whole.shape[1]) for share in side)
    image.write_image(tmp_path / "cut.png", whole[:, first:last])
    if refused:
        with pytest.raises(
            InputError, match="% of the face lie outside of the picture; at most 25"
        ):
            one_face(tmp_path / "cut.png")
    else:
        one_face(tmp_path / "cut.png")


@pytest.mark.parametrize("name", ["lisa/lisa1.jpg", "lisa/lisa2.jpg", "congress/val/S001145.jpg"])
def test_photos_with_things_like_faces_show_one(shared, name):
    """A painted landscape; a photo in whose backdrop the detector has seen a face of 33 pixels."""
    _, faces = find_faces(shared / "portraits" / name)
    assert choose_face(name, faces) is faces[0]
