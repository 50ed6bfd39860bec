"""A face that comes live: order, subjects, and packets through a socket."""

import json
import runpy
import socket
from pathlib import Path

import pytest

from bakery.show.live import LET_GO, Live
from bakery.testing import refuses
from bakery.types import EXPRESSION_INDEX

OURS = runpy.run_path(str(Path(__file__).parents[1] / "livelink_packets.py"))
packet = OURS["packet"]


@pytest.fixture
def live():
    with Live("127.0.0.1", 0) as found:
        yield found


def test_poses_come_in_order_and_late_ones_not_at_all(live):
    with live.listening() as poses:
        heard = [
            live.hear(packet({"JawOpen": f / 100}, frame=f), 0.01 * f) for f in (5, 6, 8, 7, 8, 9)
        ]
        assert heard == [True, True, True, False, False, True]
        seen = [json.loads(poses.get_nowait()) for _ in range(4)]
    assert [one["number"] for one in seen] == [1, 2, 3, 4]
    jaws = [one["weights"][EXPRESSION_INDEX["jawOpen"]] for one in seen]
    assert jaws == pytest.approx([0.05, 0.06, 0.08, 0.09])
    assert poses.empty() and not live.pages


def test_midnight_and_a_new_start_are_no_lateness(live):
    day = 24 * 3600 * 60
    assert live.hear(packet({}, frame=day - 1), 1.0)
    assert live.hear(packet({}, frame=0), 1.02)


def test_one_subject_has_the_avatar_until_it_is_silent(live):
    assert live.hear(packet({}, frame=10, subject="one"), 10.0)
    assert not live.hear(packet({}, frame=90, subject="other"), 10.1)
    assert live.hear(packet({}, frame=11, subject="one"), 10.2)
    assert live.hear(packet({}, frame=5, subject="other"), 10.2 + LET_GO)


def test_what_is_no_face_is_passed_over(live):
    assert not live.hear(b"", 0.0)
    assert not live.hear(b"GET / HTTP/1.1", 0.0)
    assert not live.hear(packet(None), 0.0)
    assert live.count == 0


def test_a_page_that_does_not_read_gets_the_newest(live, monkeypatch):
    monkeypatch.setattr("bakery.show.live.WAITING", 3)
    with live.listening() as poses:
        for frame in range(10):
            live.hear(packet({}, frame=frame), frame / 60)
        assert [json.loads(poses.get_nowait())["number"] for _ in range(3)] == [8, 9, 10]


def test_through_a_socket(live):
    with live.listening() as poses, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as phone:
        phone.sendto(packet({"HeadYaw": 0.1}, subject="<b>me</b>"), live.address)
        pose = json.loads(poses.get(timeout=10))
    assert pose["subject"] == "<b>me</b>"  # the page shows it as text
    assert pose["head"] == pytest.approx([-5.7296, 0, 0], abs=1e-3)


def test_an_address_that_cannot_be_had(live):
    refuses(lambda: Live("127.0.0.1", live.address[1]), "UDP port", "--livelink")
    refuses(lambda: Live("192.0.2.1", 0), "192.0.2.1", "--listen")
