"""Videos by PyAV in a browser: picture and sound."""

import json
import math
import wave
from pathlib import Path

import numpy as np
import pytest

from bakery.formats import video

NOTE = video.Note("Synthetic media", "http://cv.iptc.org/newscodes/digitalsourcetype/x")


def tone(path, loud_at, rate=44100):
    times = np.arange(2 * rate) / rate
    samples = np.where(times >= loud_at, 12000 * np.sin(2 * math.pi * 440 * times), 0)
    with wave.open(str(path), "wb") as file:
        file.setnchannels(1), file.setsampwidth(2), file.setframerate(rate)
        file.writeframes(samples.astype("<i2").tobytes())
    return path


def test_a_browser_plays_picture_and_sound(browser, serve, tmp_path):
    pytest.importorskip("av")
    pictures = [np.full((64, 96, 3), 4 * n, np.uint8) for n in range(50)]
    source = tone(tmp_path / "tone.wav", loud_at=0.7)
    films = {"film.mp4": "usual", "film.webm": "usual", "av1.mp4": "av1"}
    for name, asked in films.items():
        kind = Path(name).suffix
        part = tmp_path / f"part-{name}"
        part.write_bytes(video.encode(pictures, kind, 25.0, video.codec_of(kind, asked)))
        sound = video.read_sound(source, kind, tmp_path)
        video.join(tmp_path / name, [part], kind, 25.0, (96, 64), NOTE, sound)
    seen = json.loads(browser("video.mjs", serve(tmp_path), *films))
    assert set(seen) == set(films)
    for found in seen.values():
        assert (found["done"], found["width"], found["height"]) == (True, 96, 64)
        assert abs(found["seconds"] - 2) < 0.1
        # A frame of sound, 21 ms; decodeAudioData may keep what a player leaves out at the start.
        assert abs(found["loud"] - 0.7) < 0.05
