"""Takes played: what a frame shows, order, interruption, sound."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from PIL import Image

from bakery.errors import InputError
from bakery.formats.livelink import Take
from bakery.formats.sequence import sequence_of
from bakery.formats.video import Clip, Note
from bakery.geometry import camera as cameras
from bakery.geometry.color import to_encoded, to_linear
from bakery.motion import animate
from bakery.motion.animate import (
    AnimationPlayer,
    RenderSettings,
    parse_frames,
    write_frames,
    write_video,
)
from bakery.runtime.render import draw, over_gray, over_photo, portrait_at
from bakery.types import EXPRESSION_INDEX, EXPRESSIONS

NOTE = Note("a note", "http://cv.iptc.org/newscodes/digitalsourcetype/compositeSynthetic")
SMALL = RenderSettings(size=96)


def test_frames_come_in_order_and_are_those_of_the_reference(noise_avatar, short_take):
    player = AnimationPlayer(noise_avatar, short_take, SMALL)
    pictures = list(player.pictures(range(player.count)))
    assert len(pictures) == 12 and player.rate == 30
    for index in (0, 7, 11):
        expression, gaze = short_take.weights[index], short_take.eyes[index, 0]
        vertices = noise_avatar.head.vertices(noise_avatar.neutral, expression, gaze)
        frame = draw(noise_avatar, vertices, player.camera_of(index), expression, gaze)
        apart = np.abs(to_encoded(over_gray(frame)) * 255 - pictures[index])
        assert np.quantile(apart, 0.995) < 1 and (apart > 1.5).mean() < 1e-3


def test_the_head_turns_as_the_take_says(noise_avatar, short_take):
    """The nose moves to the subject's left, which is the picture's right, and down; roll tilts."""
    player = AnimationPlayer(noise_avatar, short_take, SMALL)
    points = noise_avatar.head.landmarks(noise_avatar.neutral)
    first, last = (cameras.project(points, player.camera_of(index)) for index in (0, 11))
    nose = (last - first)[1]
    assert nose[0] > 2 and nose[1] > 1
    brow, chin = last[10], last[152]
    assert brow[0] - chin[0] > (first[10] - first[152])[0] + 2  # top to the left shoulder
    photo = AnimationPlayer(noise_avatar, short_take, RenderSettings(view="photo", size=96))
    assert photo.camera_of(11) is photo.camera


def test_the_photo_lies_where_its_scaled_camera_sees_it(noise_avatar):
    """Each pixel says where in the photo it comes from: to a tenth of a pixel, at the far edge too."""
    height, width = noise_avatar.photo.shape[:2]
    rows, columns = np.mgrid[:height, :width] + 0.5
    told = np.stack([columns, rows, rows], -1).astype(np.float32) / 1000
    for scale in (0.61, 1.13):
        size = (round(width * scale / 2) * 2, round(height * scale / 2) * 2)
        camera = cameras.crop(noise_avatar.fit.camera, 0, 0, *size, scale)
        _, found = portrait_at(replace(noise_avatar, photo=told), camera)
        assert found.shape == (size[1], size[0], 3)
        places = to_encoded(found)[..., :2] * 1000 * scale
        wanted = np.stack(np.meshgrid(*(np.arange(n) + 0.5 for n in size)), -1)
        assert np.abs(places - wanted)[2:-2, 2:-2].max() < 0.1


def test_in_the_photo(noise_avatar, short_take):
    player = AnimationPlayer(noise_avatar, short_take, RenderSettings(view="photo", size=120))
    picture = next(player.pictures([5]))
    assert picture.shape == (120, 90, 3)
    expression, gaze = short_take.weights[5], short_take.eyes[5, 0]
    vertices = noise_avatar.head.vertices(noise_avatar.neutral, expression, gaze)
    frame = draw(noise_avatar, vertices, player.camera, expression, gaze)
    photo = cv2.resize(noise_avatar.photo, (90, 120), interpolation=cv2.INTER_AREA)
    expected = to_encoded(over_photo(player.portrait, frame, vertices, to_linear(photo)))
    assert np.quantile(np.abs(picture / 255 - expected), 0.99) < 1.5 / 255
    with pytest.raises(InputError, match="--keep-photo"):
        AnimationPlayer(replace(noise_avatar, photo=None), short_take, RenderSettings(view="photo"))


def test_ranges(noise_avatar, short_take):
    assert parse_frames("3:7") == (3, 7) and parse_frames("4:") == (4, None)
    assert parse_frames(None) == (0, None) and parse_frames(":5") == (0, 5)
    for wrong in ("7", "5:5", "-1:4", "a:b", "1:2:3"):
        with pytest.raises(InputError, match="--frames"):
            parse_frames(wrong)
    assert (
        AnimationPlayer(noise_avatar, short_take, RenderSettings(size=32, first=3, last=99)).count
        == 9
    )
    assert AnimationPlayer(noise_avatar, short_take, RenderSettings(size=32, rate=60)).count == 24
    with pytest.raises(InputError, match="has 12 frames"):
        AnimationPlayer(noise_avatar, short_take, RenderSettings(size=32, first=12))


@pytest.mark.parametrize("rate", [1, 12.5, 23.976, 24, 30, 60, 240])
@pytest.mark.parametrize("first, last", [(0, None), (30, None), (31, 90), (7, 999)])
def test_another_rate_shows_the_same_seconds(noise_avatar, rate, first, last):
    """Neither speed nor part of the take changes: a ramp is the same ramp in time."""
    share = np.arange(120) / 120  # 4 s at 30 a second
    rows = np.zeros((120, len(EXPRESSIONS)), np.float32)
    rows[:, EXPRESSION_INDEX["jawOpen"]] = share
    turns = np.stack([40 * share, 0 * share, 0 * share], 1)
    take = Take(np.arange(120) / 30, rows, turns, None)
    player = AnimationPlayer(
        noise_avatar, take, RenderSettings(size=32, rate=rate, first=first, last=last)
    )
    begin, end = first / 30, min(last or 120, 120) / 30
    assert abs(player.count / rate - (end - begin)) < 1 / rate + 1e-9
    times = (player.first + np.arange(player.count)) / rate
    assert begin - 1e-9 <= times[0] < begin + 1 / rate and times[-1] < end
    ramp = np.minimum(times, 119 / 30) / 4
    np.testing.assert_allclose(player.weights[:, EXPRESSION_INDEX["jawOpen"]], ramp, atol=1e-6)
    np.testing.assert_allclose(player.head[:, 0], 40 * ramp, atol=1e-6)


def test_sound_begins_where_the_pictures_do(noise_avatar, short_take, tmp_path, monkeypatch):
    begun = []
    monkeypatch.setattr(animate.video, "join", lambda *given: begun.append(given[-1]))
    for rate in (None, 24, 60):
        settings = RenderSettings(size=32, rate=rate, first=6)
        player = write_video(noise_avatar, short_take, settings, tmp_path / "a.mp4", NOTE, "k")
        assert begun[-1] == player.first / player.rate
        assert 0.2 <= begun[-1] < 0.2 + 1 / player.rate


def test_sizes(noise_avatar, short_take):
    """Videos need even sides and say so; pictures have the size that is asked for."""
    with pytest.raises(InputError, match="--size 101: .* give 100 or 102, or write PNG frames"):
        RenderSettings(size=101)
    for settings, shape in (
        (RenderSettings(size=101, film=False), (101, 101, 4)),
        (RenderSettings(size=101, film=False, view="photo"), (101, 76, 3)),  # 300x400
        (RenderSettings(size=102), (102, 102, 3)),
        (RenderSettings(size=102, view="photo"), (102, 76, 3)),
    ):
        assert (
            next(AnimationPlayer(noise_avatar, short_take, settings).pictures([3])).shape == shape
        )


def test_pictures_have_the_alpha_of_the_head(noise_avatar, short_take, tmp_path):
    """Laid over the grey of the videos, they are the frames of the videos."""
    work = tmp_path / "work"
    out = sequence_of(f"{tmp_path}/shot/f.%04d.png")
    settings = RenderSettings(size=97, film=False, first=4)
    made = write_frames(noise_avatar, short_take, settings, out, NOTE, "k", work=work)
    assert [path.name for path in out.found()] == [f"f.{n:04d}.png" for n in range(4, 12)]
    assert work.is_dir() and [path.name for path in tmp_path.iterdir()].count("shot") == 1
    video = AnimationPlayer(noise_avatar, short_take, RenderSettings(size=98, first=4))
    video.camera = made.camera
    for number, wanted in zip((4, 11), video.pictures([0, 7])):
        found = cv2.cvtColor(cv2.imread(str(out.path(number)), -1), cv2.COLOR_BGRA2RGBA) / 255
        alpha = found[..., 3:]
        assert alpha.min() == 0 and alpha.max() == 1
        assert not found[alpha[..., 0] == 0].any()
        over = to_encoded(to_linear(found[..., :3]) * alpha + 0.18 * (1 - alpha)) * 255
        assert np.abs(over - wanted).max() < 2.5  # colour and alpha are rounded, each to 8 bits
    data = out.path(4).read_bytes()
    assert b"Comment\0" in data and b"a note" in data and b"compositeSynthetic" in data
    with Image.open(out.path(4)) as picture:
        picture.verify()  # checksums of all chunks
        assert picture.info["Comment"] == "a note"


def test_interrupted_pictures_go_on(noise_avatar, short_take, tmp_path):
    def stop(step, done, total):
        if done == 7:
            raise KeyboardInterrupt

    out, again = sequence_of(f"{tmp_path}/a/"), sequence_of(f"{tmp_path}/b/")
    settings = RenderSettings(size=33, film=False)
    with pytest.raises(KeyboardInterrupt):
        write_frames(noise_avatar, short_take, settings, out, NOTE, "k", progress=stop)
    assert out.found() == []
    out.path(99).write_bytes(b"of an older, longer run")
    (out.folder / "notes.txt").write_text("mine")
    drawn = []
    for place in (out, again):
        write_frames(
            noise_avatar, short_take, settings, place, NOTE, "k",
            progress=lambda step, done, total: drawn.append(done),
        )  # fmt: skip
    assert drawn == [*range(7, 13), *range(13)]
    names = sorted(path.name for path in again.folder.iterdir())
    assert names == [f"frame.{n:05d}.png" for n in range(12)]
    assert sorted(path.name for path in out.folder.iterdir()) == sorted([*names, "notes.txt"])
    for one, other in zip(out.found(), again.found()):
        assert one.read_bytes() == other.read_bytes()


def frames_of(path):
    return [picture for _, picture in Clip(path).frames()]


@pytest.mark.parametrize("name", ["out.mp4", "out.webm"])
def test_an_interrupted_video_goes_on(noise_avatar, short_take, tmp_path, monkeypatch, name):
    monkeypatch.setattr(animate, "PART", 5)
    whole, output = tmp_path / ("whole-" + name), tmp_path / name
    write_video(noise_avatar, short_take, SMALL, whole, NOTE, "k")
    assert len(frames_of(whole)) == 12

    def stop(step, done, total):
        if done == 7:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_video(noise_avatar, short_take, SMALL, output, NOTE, "k", progress=stop)
    assert not output.exists()
    drawn = []
    write_video(
        noise_avatar, short_take, SMALL, output, NOTE, "k",
        progress=lambda step, done, total: drawn.append(done),
    )  # fmt: skip
    assert drawn == [5, 5, 6, 7, 8, 9, 10, 10, 11, 12]  # the first part was taken as it lay there
    assert output.read_bytes() == whole.read_bytes()
    assert sorted(p.name for p in tmp_path.iterdir()) == sorted([name, whole.name])


def test_other_input_takes_nothing_from_the_work_folder(noise_avatar, short_take, tmp_path):
    work = tmp_path / "work"
    write_video(noise_avatar, short_take, SMALL, tmp_path / "a.mp4", NOTE, "k", work=work)
    drawn = []
    write_video(
        noise_avatar, short_take, SMALL, tmp_path / "b.mp4", NOTE, "other", work=work,
        progress=lambda step, done, total: drawn.append(done),
    )  # fmt: skip
    assert drawn[0] == 0


def test_pictures_survive_the_encoder(noise_avatar, short_take, tmp_path):
    """Noise at 96 pixels is the worst that can be coded; plain grey must stay grey."""
    player = AnimationPlayer(noise_avatar, short_take, SMALL)
    drawn = list(player.pictures(range(12)))
    for name, floor in (("a.mp4", 24), ("a.webm", 24)):
        write_video(noise_avatar, short_take, SMALL, tmp_path / name, NOTE, "k")
        for one, other in zip(drawn, frames_of(tmp_path / name)):
            error = ((one.astype(float) - other) ** 2).mean()
            assert 10 * np.log10(255**2 / error) > floor
            corner = other[:6, :6].reshape(-1, 3).mean(0)
            assert np.ptp(corner) <= 1.5 and abs(corner.mean() - 118) < 2.5
