"""Packets of Live Link Face: known ones, and damaged ones of every length."""

import runpy
from pathlib import Path

import numpy as np
import pytest

from bakery.errors import InputError
from bakery.formats.livelink import EYES, HEAD, ORDER, take_of
from bakery.formats.livelink_udp import parse_packet
from bakery.types import EXPRESSION_INDEX

OURS = runpy.run_path(str(Path(__file__).parents[1] / "livelink_packets.py"))
packet = OURS["packet"]


def test_a_known_packet():
    values = {"JawOpen": 0.5, "TongueOut": 1.0, "HeadYaw": 0.25, "RightEyeRoll": -0.1,
              "JawLeft": 0.25, "MouthRight": 0.75}  # fmt: skip
    found = parse_packet(packet(values, frame=600, part=0.5, rate=(30000, 1001), subject="Zoë"))
    assert found.subject == "Zoë"
    assert found.seconds == pytest.approx(600.5 * 1001 / 30000)
    wanted = np.array([values.get(name, 0) for name in (*ORDER, *HEAD, *EYES)], np.float32)
    np.testing.assert_array_equal(found.values, wanted)


def test_a_packet_is_a_row_of_a_take():
    """Signs and units as those of the CSV; weights beyond 1 are clamped."""
    values = {"JawOpen": 0.5, "MouthSmileLeft": 1.25, "HeadYaw": 0.1, "HeadPitch": 0.2,
              "HeadRoll": 0.3, "LeftEyeYaw": 0.2, "RightEyePitch": -0.1}  # fmt: skip
    take = take_of(np.zeros(1), parse_packet(packet(values)).values[None])
    assert take.weights[0, EXPRESSION_INDEX["jawOpen"]] == 0.5
    assert take.weights[0, EXPRESSION_INDEX["mouthSmileLeft"]] == 1
    assert take.weights.sum() == 1.5
    np.testing.assert_allclose(take.head[0], np.degrees([-0.1, -0.2, 0.3]), atol=1e-5)
    np.testing.assert_allclose(take.eyes[0], np.degrees([[-0.2, 0], [0, 0.1]]), atol=1e-5)


def test_no_face():
    assert parse_packet(packet(None)) is None


def test_every_cut_is_refused():
    whole, bare = packet({"JawOpen": 0.5}), len(packet(None))
    for length in range(len(whole)):
        if length == bare:
            continue  # what an app that sees no face sends
        with pytest.raises(InputError):
            parse_packet(whole[:length])


def test_random_bytes_are_refused_or_read():
    rng = np.random.default_rng(1)
    whole = np.frombuffer(packet({"JawOpen": 0.5}), np.uint8)
    for _ in range(500):
        data = whole.copy()
        data[rng.integers(0, len(data), 3)] = rng.integers(0, 256, 3)
        try:
            found = parse_packet(data.tobytes())
        except InputError as error:
            assert "\n" not in str(error)
        else:
            assert found is None or np.isfinite(found.values).all()


@pytest.mark.parametrize(
    "data, word",
    [
        (b"\x07" + packet({})[1:], "version 7"),
        (packet({}, count=71), "71 values"),
        (packet({"JawOpen": float("nan")}), "none"),
        (packet({"HeadYaw": 30.0}), "turn"),
        (packet({}, rate=(0, 1)), "none"),
    ],
)
def test_what_is_refused_says_why(data, word):
    with pytest.raises(InputError, match=word):
        parse_packet(data)
