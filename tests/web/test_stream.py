"""A recorded stream of Live Link Face drives the page in a browser."""

import json
import runpy
import socket
import threading
import time
from pathlib import Path

import numpy as np
import pytest

from bakery.formats.livelink import take_of
from bakery.formats.livelink_udp import parse_packet
from bakery.show.live import Live
from bakery.show.serve import make_server
from bakery.types import EXPRESSIONS

OURS = runpy.run_path(str(Path(__file__).parents[1] / "livelink_packets.py"))
COUNT, RATE = 180, 60
BUSY = 150  # milliseconds until a frame is handed on; 15 to 25 alone on two cores, and 50 are asked


def replay(live, packets):
    """Send packets at RATE once the page listens, and has drawn its first picture."""
    until = time.monotonic() + 60
    while not live.pages and time.monotonic() < until:
        time.sleep(0.02)
    time.sleep(3)
    start = time.monotonic()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as phone:
        for number, data in enumerate(packets):
            time.sleep(max(start + number / RATE - time.monotonic(), 0))
            phone.sendto(data, live.address)


@pytest.fixture(scope="module")
def streamed(browser, bundle):
    packets = [
        OURS["packet"](row, frame=10 + number)
        for number, row in enumerate(OURS["recording"](COUNT))
    ]
    with Live("127.0.0.1", 0) as live, make_server(bundle, 0, live=live) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        threading.Thread(target=replay, args=(live, packets), daemon=True).start()
        url = f"http://127.0.0.1:{server.server_address[1]}/"
        seen = json.loads(browser("stream.mjs", url, COUNT))
        server.shutdown()
    last = parse_packet(packets[-1])
    return seen, take_of(np.zeros(1), last.values[None])


def test_no_packet_is_lost_and_all_are_in_order(streamed):
    seen, _ = streamed
    assert seen["numbers"] == list(range(1, COUNT + 1))
    assert seen["log"] == []


def test_the_avatar_ends_as_the_last_packet_says(streamed):
    seen, take = streamed
    assert (take.weights[0] > 0.05).sum() > 6
    np.testing.assert_allclose(seen["head"], take.head[0], atol=0.01)
    # Shapes of the gaze follow the eyes' angles; all others are the packet's.
    others = [k for k, name in enumerate(EXPRESSIONS) if not name.startswith("eyeLook")]
    np.testing.assert_allclose(
        np.array(seen["weights"])[others], take.weights[0, others], atol=1e-3
    )


def test_it_is_drawn_at_once(streamed):
    seen, _ = streamed
    assert np.median(seen["delays"]) < BUSY
    assert seen["note"].startswith("phone: ")
