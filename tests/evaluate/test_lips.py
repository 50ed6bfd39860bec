"""What is measured of mouths: known openings and widths, tones, and the means over photos."""

import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from bakery import landmarks as marks
from bakery.detectors import network
from bakery.errors import InputError
from bakery.evaluate.detection import lips, talk
from bakery.formats.image import read_photo
from bakery.formats.record import read_faces

SAMPLES = Path(__file__).parents[2] / "samples"


def face(gap=10.0, width=60.0, turn=0.0):
    """Points [478, 2] pixels of a face with 100 pixels between the outer eye corners."""
    points = np.zeros((478, 2))
    points[33], points[263] = (50, 60), (150, 60)
    x = np.linspace(100 - width / 2, 100 + width / 2, 11)
    for rows, y in (
        (marks.LIPS_INNER_UPPER, 140 - gap / 2),
        (marks.LIPS_INNER_LOWER, 140 + gap / 2),
    ):
        points[rows] = np.stack([x, 0 * x + y], 1)
    points[marks.MOUTH_CORNERS] = [[100 - width / 2, 140], [100 + width / 2, 140]]
    for cheek, middle in zip(lips.CHEEKS, (70, 130)):
        angle = np.linspace(0, 2 * np.pi, len(cheek), endpoint=False)
        points[list(cheek)] = np.stack([middle + 8 * np.cos(angle), 110 + 8 * np.sin(angle)], 1)
    c, s = np.cos(turn), np.sin(turn)
    return points @ np.array([[c, s], [-s, c]])


@pytest.mark.parametrize("turn", [0.0, 0.4, -1.0])
def test_opening_and_width_do_not_turn_with_the_face(turn):
    assert lips.opening(face(10, 60, turn)) == pytest.approx(10)
    assert lips.opening(face(-2, 60, turn)) == pytest.approx(-2)
    assert lips.width(face(10, 60, turn)) == pytest.approx(60)


@pytest.mark.parametrize(
    "colour, tone",
    [((0.93, 0.78, 0.68), "light"), ((0.72, 0.52, 0.38), "middle"), ((0.30, 0.19, 0.13), "dark")],
)
def test_tones_of_cheeks(colour, tone):
    image = np.zeros((200, 200, 3), np.float32)
    image[90:130, 50:150] = colour
    assert lips.tone_of(lips.tone_angle(image, face())) == tone


def test_a_face_beside_the_picture_has_no_tone():
    image = np.zeros((20, 20, 3), np.float32)
    assert lips.tone_of(lips.tone_angle(image, face() + 500)) == ""


def test_means_over_photos():
    image = np.full((200, 200, 3), 0.7, np.float32)
    rows = [
        lips.of_photo(image, face(0), face(3)),
        lips.of_photo(image, face(20, 60), face(14, 57)),
        lips.of_photo(image, face(), None),
    ]
    found = lips.summary(rows)
    assert found["opening_error"] == pytest.approx((0.03 + 0.06) / 2)
    assert found["smiles_opening_error"] == pytest.approx(0.06)
    assert found["closed"] == 1 and found["closed_seen"] == pytest.approx(0.03)
    assert found["wide"] == 1 and found["width_error"] == pytest.approx(0.05)
    assert (
        found["tone_ratio"] == pytest.approx(1)
        and sum(group["photos"] for group in found["tones"].values()) == 2
    )
    over = lips.summary([lips.of_photo(image, face(0), face(gap)) for gap in (3, -3)])
    assert over["closed_seen"] == pytest.approx(0) and over["closed_off"] == pytest.approx(0.03)
    nothing = lips.summary(rows[2:])
    assert nothing["opening_error"] is None and nothing["tone_ratio"] is None


def test_clips_are_named_by_their_points(tmp_path):
    with pytest.raises(InputError, match="no dense478.npz"):
        list(talk.clips(tmp_path))
    np.savez(tmp_path / "dense478.npz", names=np.array(["one"]), points=np.zeros((1, 2, 478, 2)))
    with pytest.raises(InputError, match="no clip one"):
        list(talk.clips(tmp_path))
    (tmp_path / "one.mpg").touch()
    ((path, points),) = talk.clips(tmp_path)
    assert path.name == "one.mpg" and points.shape == (2, 478, 2)


def test_a_clip_is_measured_frame_by_frame_and_followed(head, monkeypatch):
    """A sample that lies still: nothing is missed, nothing correlates, points are where they are."""
    photo = read_photo(SAMPLES / "anna.jpg").encoded[::2, ::2]
    picture = np.ascontiguousarray((photo * 255).astype(np.uint8))
    _, (face,) = read_faces(SAMPLES / "anna.json")
    steps = np.array([0.0, 1.0, 2.0])
    frames = [(k / 25, np.roll(picture, int(step), 1)) for k, step in enumerate(steps)]
    monkeypatch.setattr(talk, "Clip", lambda path: SimpleNamespace(frames=lambda: frames))
    reference = face.points / 2 + np.stack([steps, 0 * steps], 1)[:, None]
    reference[1, marks.LIPS_INNER_LOWER[1:-1]] += (0, 4)
    found = talk.measure(Path("anna.mpg"), reference, network.load(), head)
    assert found["clip"] == "anna" and found["frames"] == 3 and found["missed"] == 0
    assert found["error"] < 0.03 and abs(found["jaw"]) <= 1 and abs(found["correlation"]) <= 1


@pytest.mark.slow
def test_talking_people_are_seen_to_open_and_close(bakery, shared):
    """The requirements of docs/log-detect.md, with room for another processor's rounding."""
    clips = shared / "drivers" / "grid"
    if not clips.exists():
        pytest.skip("needs the talking clips of the shared test data")
    done = bakery("evaluate", "talk", clips)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout.splitlines()[-1])
    assert found["clips"] == 5 and found["missed"] == 0
    assert found["correlation"] > 0.97 and found["correlation_worst"] > 0.95
    assert found["closed_seen"] < 0.009
    # jawOpen - mouthClose of the take against the opening (docs/log-drive.md).
    assert found["jaw"] > 0.90 and found["jaw_worst"] > 0.85
