"""The shipped detector on painted people whose points are known, part by part of the face.

Errors are shares of the distance of the outer eye corners. A mean over 478 points hides an iris: the
ten of both, left for right, are 1.4 of 100 points. Limits lie a third or more above the worst of six
samples as measured; painted faces are not those it was trained for, photographs give two thirds.
"""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from bakery import landmarks as marks
from bakery.cli.evaluate import evaluate
from bakery.detectors import network
from bakery.evaluate.detection import point_error
from bakery.evaluate.detection import stress as detection_stress
from bakery.evaluate.detection.stress import placed, stress
from bakery.formats.image import read_photo
from bakery.formats.record import read_faces
from bakery.stages.detect import detect_faces

SAMPLES = sorted((Path(__file__).resolve().parents[2] / "samples").glob("*.jpg"))
NOSE = np.array([1, 2, 4, 5, 6, 48, 64, 97, 98, 129, 168, 195, 197, 278, 294, 326, 327, 358])
IRISES = np.arange(marks.FACE, marks.FACE + 10)
LIMITS = {  # part: its points, mean error that is allowed (measured, the worst sample)
    "jaw": (marks.OVAL, 0.075),  # 0.048: half of it lies under hair
    "right brow": (marks.BROW_RIGHT, 0.05),  # 0.034
    "left brow": (marks.BROW_LEFT, 0.05),  # 0.030
    "right eye": (marks.EYE_RIGHT, 0.045),  # 0.027
    "left eye": (marks.EYE_LEFT, 0.045),  # 0.031
    "right iris": (IRISES[:5], 0.035),  # 0.021; its radius is 0.06 to 0.07
    "left iris": (IRISES[5:], 0.035),  # 0.022
    "nose": (NOSE, 0.055),  # 0.039
    "outer lips": (marks.LIPS_OUTER, 0.04),  # 0.027
    "inner lips": (marks.LIPS_INNER, 0.04),  # 0.023
}


def sample(path):
    """A painted portrait [H, W, 3] uint8 and its true points [478, 2]."""
    _, (truth,) = read_faces(path.with_suffix(".json"))
    return np.round(read_photo(path).encoded * 255).astype(np.uint8), truth.points


@pytest.fixture(scope="module")
def errors():
    """Error [478] of each sample, by name."""
    found, detector = {}, network.load()
    for path in SAMPLES:
        picture, truth = sample(path)
        (face,) = detect_faces(picture, detector)
        distance = np.linalg.norm(face.points - truth, axis=1)
        found[path.stem] = distance / marks.face_size(truth)
    return found


@pytest.mark.parametrize("part", LIMITS)
def test_each_part_is_where_it_was_painted(errors, part):
    points, limit = LIMITS[part]
    assert len(errors) == 6
    far = {name: error[points].mean().round(3) for name, error in errors.items()}
    assert max(far.values()) < limit, far


def test_no_point_is_far_off(errors):
    """Measured: 0.099, at the jaw. The eye is 0.3 wide, the mouth 0.6."""
    assert max(error.max() for error in errors.values()) < 0.14


def test_the_limits_tell_left_from_right():
    """What they are for: the irises changed over, each ring turned by a step, all points mirrored."""
    _, truth = sample(SAMPLES[0])
    size = marks.face_size(truth)

    def broken(wrong):
        error = np.linalg.norm(wrong - truth, axis=1) / size
        return {part for part, (points, limit) in LIMITS.items() if error[points].mean() > limit}

    swapped = truth.copy()
    swapped[IRISES] = truth[np.roll(IRISES, 5)]
    assert broken(swapped) == {"right iris", "left iris"}
    turned = truth.copy()
    for first in (marks.FACE + 1, marks.FACE + 6):
        turned[first : first + 4] = np.roll(truth[first : first + 4], 1, 0)
    assert broken(turned) == {"right iris", "left iris"}
    mirrored = truth * [-1, 1] + [2 * truth[168, 0], 0]
    assert broken(mirrored) >= {part for part in LIMITS if part not in ("nose", "jaw")}


@pytest.mark.parametrize(
    "change",
    [
        "36 px face in 900x700",
        "96 px face in 1350x1350",
        "roll +30",
        "chin and forehead cut",
        "two faces",
    ],
)
def test_small_tilted_cut_and_double_faces_are_found(change):
    """Measured on this sample: all found, none too many, errors of 0.021 to 0.026."""
    (result,) = stress([sample(SAMPLES[0])], network.load(), changes=[change])
    assert result.right_count == result.photos == 1
    assert result.found == result.faces == (2 if change == "two faces" else 1)
    assert result.error_worst < 0.045, result


def large_and_small(large):
    """A face of some pixels beside one of 60 in 900x900."""
    image, points = sample(SAMPLES[0])
    picture, one = placed(image, points, large, 0, np.array([450, 350]), canvas())
    small, other = placed(image, points, 60, 0, np.array([80, 800]), canvas())
    picture[750:, :160] = small[750:, :160]
    return picture, one, other


def canvas():
    return np.full((900, 900, 3), 110, np.uint8)


def test_small_faces_behind_a_portrait_are_not_searched():
    """A quarter of the picture makes a portrait; beside smaller faces all sizes are searched."""
    picture, one, _ = large_and_small(400)
    (face,) = network.load().detect(picture)
    assert point_error(face.points, one).mean() < 0.03
    picture, one, other = large_and_small(200)
    found = sorted(network.load().detect(picture), key=lambda face: -face.box[2])
    errors = [point_error(face.points, true).mean() for face, true in zip(found, (one, other))]
    assert len(found) == 2 and max(errors) < 0.05


def test_stress_is_measured_by_a_command(tmp_path, monkeypatch):
    """`bakery evaluate detect --stress` of a folder of portraits with reference points."""
    _, truth = sample(SAMPLES[0])
    (tmp_path / "own").mkdir()
    shutil.copy(SAMPLES[0], tmp_path / "own" / "anna.jpg")
    np.savez(tmp_path / "dense478.npz", names=["own/anna.jpg"], points=truth[None])
    name = "roll -30"
    monkeypatch.setattr(detection_stress, "CHANGES", {name: detection_stress.CHANGES[name]})
    done = CliRunner().invoke(evaluate, ["detect", str(tmp_path), "--stress", "--set", "own"])
    assert done.exit_code == 0, done.output
    (line,) = done.output.splitlines()
    assert json.loads(line)["found"] == 1 and json.loads(line)["error"] < 0.045
