"""Clips to takes and fits: known curves come back from their points; losses and noise; files."""

from dataclasses import fields, replace

import numpy as np
import pytest

from bakery.errors import FitError, InputError
from bakery.formats import record
from bakery.geometry import camera as cameras
from bakery.geometry import rotation
from bakery.heads.base import look, weights
from bakery.landmarks import face_size
from bakery.motion.fits import ClipFit, read_fits, write_fits
from bakery.motion.follow import Followed
from bakery.motion.track import TrackOptions, solve, steady, take_of, track
from bakery.synth.scene import portrait_camera
from bakery.types import EXPRESSION_INDEX

SIZE = 384
FEW = replace(TrackOptions(), identity_frames=6, rest_frames=12, identity_rounds=3)


def played(head, count=40, size=SIZE, seed=0):
    """Weights, gaze and head angles that begin at rest, and their points [N, 478, 2]."""
    rng = np.random.default_rng(seed)
    share = np.clip((np.arange(count) - 6) / (count - 7), 0, 1)
    wave = np.sin(np.pi * share) ** 2
    rows, gazes, turns, points = [], [], [], []
    neutral = head.neutral(rng.normal(0, 0.8, len(head.identity_basis)))
    for index in range(count):
        s, w = share[index], wave[index]
        gaze = np.array([14.0 * np.sin(4 * np.pi * s), 6.0 * np.sin(2 * np.pi * s)])
        mix = weights({"jawOpen": 0.7 * w, "browInnerUp": 0.7 * (s > 0.5) * w})
        blink = 1.0 if index in (18, 19, 20) else 0.0
        mix += weights({"eyeBlinkLeft": blink, "eyeBlinkRight": blink, "mouthSmileLeft": 0.6 * s**2,
                        "mouthSmileRight": 0.6 * s**2})  # fmt: skip
        turn = np.array([12.0, -5.0, 8.0]) * np.sin(2 * np.pi * s)
        expression = look(mix, gaze)
        camera = portrait_camera(size, size, turn[0], turn[1], 0.0, filling=0.6, distance=900)
        matrix = rotation.yaw_pitch_roll(*turn)
        camera = replace(camera, rotation=rotation.vector(matrix))
        vertices = head.vertices(neutral, expression, gaze)
        points.append(cameras.project(head.landmarks(vertices), camera))
        rows.append(expression)
        gazes.append(gaze)
        turns.append(turn)
    return np.array(rows), np.array(gazes), np.array(turns), np.array(points)


def followed(points, size=SIZE, missing=()):
    points = points.astype(np.float32).copy()
    points[list(missing)] = np.nan
    return Followed(np.arange(len(points)) / 30, points, size, size)


def of(rows, name):
    return rows[:, EXPRESSION_INDEX[name]]


def test_known_curves_come_back(head):
    """Points without error: what is left is the prior, which shrinks, and an unknown lens."""
    rows, gaze, turns, points = played(head)
    take = track(followed(points), head, FEW)
    error = np.abs(take.weights - rows)
    assert error.mean() < 0.015 < 0.03 < rows.mean()
    assert np.corrcoef(take.weights.ravel(), rows.ravel())[0, 1] > 0.9
    assert np.abs(of(take.weights, "jawOpen") - of(rows, "jawOpen")).max() < 0.2
    assert of(take.weights, "eyeBlinkLeft")[19] > 0.7 and of(take.weights, "eyeBlinkLeft")[15] < 0.2
    apart = take.head - turns
    assert np.abs(apart - apart.mean(0)).max() < 4 and np.abs(take.eyes[:, 0] - gaze).mean() < 4
    assert take.rate == 30 and take.notes == ()


def test_a_still_face_does_not_shake(head):
    """Points that tremble by 0.4% of the eye distance, as those of a still face under grain do."""
    _, _, _, points = played(head, 8)
    rng = np.random.default_rng(1)
    apart = np.linalg.norm(points[0, 33] - points[0, 263])
    still = points[:1] + rng.normal(0, 0.004 * apart, (30, 478, 2))
    take = track(followed(still), head, FEW)
    assert take.weights.std(0).mean() < 0.005
    assert take.head.std(0).max() < 0.5


def test_lost_frames_lie_between_their_neighbours(head):
    _, _, _, points = played(head)
    take = track(followed(points, missing=(0, 24, 25)), head, FEW)
    jaw = of(take.weights, "jawOpen")
    np.testing.assert_allclose(jaw[0], jaw[1], atol=1e-6)
    np.testing.assert_allclose(jaw[24], jaw[23] + (jaw[26] - jaw[23]) / 3, atol=1e-5)
    assert take.notes == ("3 frames without a face interpolated",)


def test_a_face_that_is_hard_to_see_is_told(head):
    _, _, _, points = played(head, 8)
    sure, unsure = (replace(followed(points), doubts=np.array([doubt])) for doubt in (0.03, 0.06))
    assert track(sure, head, FEW).notes == ()
    assert "unsure by 6% of its size, limit 4%" in track(unsure, head, FEW).notes[0]


def test_small_faces_are_refused(head):
    _, _, _, points = played(head, 8)
    with pytest.raises(FitError, match="pixels apart"):
        track(followed(points * 0.1), head, FEW)


def test_angles_and_their_matrix():
    for angles in ([0, 0, 0], [20, -10, 15], [-60, 40, -30]):
        turn = rotation.yaw_pitch_roll(*angles)
        np.testing.assert_allclose(rotation.angles_of(turn), angles, atol=1e-9)
    tilted = rotation.yaw_pitch_roll(0, 0, 20) @ [0, 1, 0]
    assert tilted[0] > 0.3  # +x is the subject's left


def test_smoothing_keeps_blinks_and_takes_noise():
    rng = np.random.default_rng(0)
    noise = rng.normal(0, 0.01, (200, 1))
    assert steady(noise, 1.6, 0.06).std() < 0.6 * noise.std()
    blink = np.zeros((40, 1))
    blink[18:22] = 1
    np.testing.assert_allclose(steady(blink, 1.6, 0.06), blink, atol=1e-3)
    ramp = np.linspace(0, 1, 40)[:, None]
    np.testing.assert_allclose(steady(ramp, 1.6, 0.06)[6:-6], ramp[6:-6], atol=0.01)
    np.testing.assert_array_equal(steady(noise, 0, 0.06), noise)


def test_a_clip_is_named_once(tmp_path, monkeypatch):
    """What the reader says of a clip names it already; what the tracker says does not."""
    from bakery.formats import video
    from bakery.motion.files import tracked

    path = tmp_path / "grey.mp4"
    path.write_bytes(video.encode([np.full((128, 128, 3), 118, np.uint8)] * 2, ".mp4", 25.0))
    with pytest.raises(InputError, match="no face found") as caught:
        tracked(path)
    assert str(caught.value).count(str(path)) == 1

    def unreadable(clip):
        raise InputError(f"{clip.path}: holds no frame that can be read; convert it first")
        yield

    monkeypatch.setattr(video.Clip, "frames", unreadable)
    with pytest.raises(InputError, match="holds no frame") as caught:
        tracked(path)
    assert str(caught.value).count(str(path)) == 1
    with pytest.raises(InputError, match="^no head model 'yours'"):
        tracked(path, head="yours")


@pytest.fixture(scope="module")
def clip(head):
    """Followed points of a clip, two frames of it without a face, and what was solved of them."""
    _, _, _, points = played(head, 24)
    seen = followed(points, missing=(10, 11))
    return points, seen, solve(seen, head, FEW)


def test_fits_come_back(clip, tmp_path):
    _, _, fits = clip
    write_fits(tmp_path / "fits", fits)
    back = read_fits(tmp_path / "fits")
    for field in fields(ClipFit):
        np.testing.assert_array_equal(getattr(back, field.name), getattr(fits, field.name))
    assert isinstance(back.head, str) and isinstance(back.focal, float)
    assert sorted(path.name for path in (tmp_path / "fits").iterdir()) == [
        "frames.npz", "identity.npz",
    ]  # fmt: skip
    before = (tmp_path / "fits" / "frames.npz").read_bytes()
    write_fits(tmp_path / "again", back)
    assert (tmp_path / "again" / "frames.npz").read_bytes() == before


def test_each_row_lies_on_the_face(clip, head):
    """Points without error, an unknown lens and head: 5% of the eye distance; a still head is 9% off."""
    points, seen, fits = clip
    for number in (0, 7, 18, 23):
        fit = fits.fit(number, head)
        apart = np.linalg.norm(fit.landmarks_projected - points[number], axis=1).mean()
        assert apart < 0.05 * face_size(points[number])
        assert fit.camera.width == seen.width and fit.head_sha256 == head.digest
    assert fits.found.tolist() == seen.found.tolist() and fits.found.sum() == 22
    middle = (fits.translation[9] * 2 + fits.translation[12]) / 3
    np.testing.assert_allclose(fits.translation[10], middle, atol=1e-9)  # bridged


def test_the_take_is_made_of_them(clip, head):
    _, seen, fits = clip
    take, whole = take_of(fits, FEW, seen.doubt), track(seen, head, FEW)
    np.testing.assert_array_equal(take.weights, whole.weights)
    np.testing.assert_array_equal(take.head, whole.head)
    assert take.notes == whole.notes == ("2 frames without a face interpolated",)


def test_what_does_not_go_together_is_refused(clip, head, tmp_path):
    _, _, fits = clip
    write_fits(tmp_path / "one", fits)
    write_fits(tmp_path / "two", replace(fits, identity=fits.identity + 1))
    (tmp_path / "one" / "frames.npz").rename(tmp_path / "two" / "frames.npz")
    with pytest.raises(
        InputError, match="of two clips; write both again with `bakery track --fits`"
    ):
        read_fits(tmp_path / "two")
    with pytest.raises(InputError, match="frames.npz: no such file"):
        read_fits(tmp_path / "one")
    with pytest.raises(InputError, match="a fit of another head"):
        replace(fits, head_sha256="other").fit(0, head)


@pytest.mark.parametrize(
    "change, message",
    [
        ({"gaze": np.zeros((3, 2))}, "ClipFit.gaze"),
        ({"seconds": np.zeros(24)}, "times that increase"),
        ({"found": np.zeros(24)}, "24 truth values"),
        ({"expression": np.full((24, 52), 2.0)}, "ClipFit.expression"),
        ({"translation": np.full((24, 3), np.nan)}, "ClipFit.translation"),
        ({"seconds": None}, "lacks seconds"),
    ],
)
def test_damaged_rows_are_refused_in_one_line(clip, tmp_path, change, message):
    _, _, fits = clip
    write_fits(tmp_path, fits)
    rows = record.read_arrays(tmp_path / "frames.npz") | change
    rows = {name: value for name, value in rows.items() if value is not None}
    record.write_arrays(tmp_path / "frames.npz", rows)
    with pytest.raises(InputError, match=message) as caught:
        read_fits(tmp_path)
    assert "\n" not in str(caught.value) and str(tmp_path) in str(caught.value)
