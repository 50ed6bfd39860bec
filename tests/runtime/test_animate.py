"""Takes played: what a frame shows, order, interruption, sound."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from bakery.errors import InputError
from bakery.formats.video import Clip, Note
from bakery.geometry import camera as cameras
from bakery.geometry.color import to_encoded, to_linear
from bakery.motion import animate
from bakery.motion.animate import Show, Stage, parse_frames, write_video
from bakery.runtime.render import draw, over_gray, over_photo, portrait_at

NOTE = Note("a note", "http://cv.iptc.org/newscodes/digitalsourcetype/compositeSynthetic")
SMALL = Show(size=96)


def test_frames_come_in_order_and_are_those_of_the_reference(noise_avatar, short_take):
    stage = Stage(noise_avatar, short_take, SMALL)
    pictures = list(stage.pictures(range(stage.count), threads=3))
    assert len(pictures) == 12 and stage.rate == 30
    for index in (0, 7, 11):
        expression, gaze = short_take.weights[index], short_take.eyes[index, 0]
        vertices = noise_avatar.head.vertices(noise_avatar.neutral, expression, gaze)
        frame = draw(noise_avatar, vertices, stage.camera_of(index), expression, gaze)
        apart = np.abs(to_encoded(over_gray(frame)) * 255 - pictures[index])
        assert np.quantile(apart, 0.995) < 1 and (apart > 1.5).mean() < 1e-3


def test_the_head_turns_as_the_take_says(noise_avatar, short_take):
    """The nose moves to the subject's left, which is the picture's right, and down; roll tilts."""
    stage = Stage(noise_avatar, short_take, SMALL)
    points = noise_avatar.head.landmarks(noise_avatar.neutral)
    first, last = (cameras.project(points, stage.camera_of(index)) for index in (0, 11))
    nose = (last - first)[1]
    assert nose[0] > 2 and nose[1] > 1
    brow, chin = last[10], last[152]
    assert brow[0] - chin[0] > (first[10] - first[152])[0] + 2  # top to the left shoulder
    photo = Stage(noise_avatar, short_take, Show(view="photo", size=96))
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
    stage = Stage(noise_avatar, short_take, Show(view="photo", size=120))
    picture = next(stage.pictures([5]))
    assert picture.shape == (120, 90, 3)
    expression, gaze = short_take.weights[5], short_take.eyes[5, 0]
    vertices = noise_avatar.head.vertices(noise_avatar.neutral, expression, gaze)
    frame = draw(noise_avatar, vertices, stage.camera, expression, gaze)
    photo = cv2.resize(noise_avatar.photo, (90, 120), interpolation=cv2.INTER_AREA)
    expected = to_encoded(over_photo(stage.portrait, frame, vertices, to_linear(photo)))
    assert np.quantile(np.abs(picture / 255 - expected), 0.99) < 1.5 / 255
    with pytest.raises(InputError, match="--keep-photo"):
        Stage(replace(noise_avatar, photo=None), short_take, Show(view="photo"))


def test_ranges(noise_avatar, short_take):
    assert parse_frames("3:7") == (3, 7) and parse_frames("4:") == (4, None)
    assert parse_frames(None) == (0, None) and parse_frames(":5") == (0, 5)
    for wrong in ("7", "5:5", "-1:4", "a:b", "1:2:3"):
        with pytest.raises(InputError, match="--frames"):
            parse_frames(wrong)
    assert Stage(noise_avatar, short_take, Show(size=32, first=3, last=99)).count == 9
    assert Stage(noise_avatar, short_take, Show(size=32, rate=60)).count == 23
    with pytest.raises(InputError, match="has 12 frames"):
        Stage(noise_avatar, short_take, Show(size=32, first=12))


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
    stage = Stage(noise_avatar, short_take, SMALL)
    drawn = list(stage.pictures(range(12)))
    for name, floor in (("a.mp4", 24), ("a.webm", 24)):
        write_video(noise_avatar, short_take, SMALL, tmp_path / name, NOTE, "k")
        for one, other in zip(drawn, frames_of(tmp_path / name)):
            error = ((one.astype(float) - other) ** 2).mean()
            assert 10 * np.log10(255**2 / error) > floor
            corner = other[:6, :6].reshape(-1, 3).mean(0)
            assert np.ptp(corner) <= 1.5 and abs(corner.mean() - 118) < 2.5
