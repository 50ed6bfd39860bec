"""A face that comes live: packets of Live Link Face, handed on to the pages that are open.

The first subject that is heard has the avatar until it was silent for LET_GO; packets that come
later than a newer one are left out.
"""

import contextlib
import json
import logging
import queue
import socket
import time
from collections.abc import Iterator
from threading import Lock, Thread

import numpy as np

from bakery.errors import InputError
from bakery.formats.livelink import take_of
from bakery.formats.livelink_udp import LARGEST, Packet, parse_packet

log = logging.getLogger(__name__)
LET_GO = 2.0  # seconds
BACK = 1.0  # seconds; a larger step back in time is midnight, or the app began anew
ATTEND = 0.25  # seconds after which the thread looks whether it is to end
WAITING = 240  # poses that a page may lie behind, 4 s; older ones are left out
DIGITS = 4


class Live:
    """Takes packets by UDP in a thread of its own, from `with` to its end."""

    def __init__(self, host: str, port: int) -> None:
        """Bind an address of this machine; port 0 takes any free one.

        Raises:
            InputError: it cannot be had.
        """
        self.subject, self.heard, self.newest = "", -LET_GO, -np.inf
        self.count = 0  # of the poses that were handed on
        self.pages: list[queue.Queue[bytes]] = []
        self.lock = Lock()
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self.socket.bind((host, port))
            self.socket.settimeout(ATTEND)
        except OSError as error:
            self.socket.close()
            why = error.strerror or error
            raise InputError(
                f"{host}, UDP port {port}: cannot be used ({why}); give another --livelink or --listen"
            ) from None
        self.address = self.socket.getsockname()

    def __enter__(self) -> "Live":
        Thread(target=self._run, daemon=True).start()
        return self

    def __exit__(self, *_: object) -> None:
        self.socket.close()

    @contextlib.contextmanager
    def listening(self) -> Iterator["queue.Queue[bytes]"]:
        """A queue of what `hear` hands on from now on: JSON, a pose each."""
        mine: queue.Queue[bytes] = queue.Queue(WAITING)
        with self.lock:
            self.pages.append(mine)
        try:
            yield mine
        finally:
            with self.lock:
                self.pages.remove(mine)

    def hear(self, data: bytes, now: float) -> bool:
        """Take one packet.

        Args:
            now: seconds of a clock that only goes forward.

        Returns:
            Whether it was handed on.
        """
        try:
            packet = parse_packet(data)
        except InputError as error:
            log.debug("%s", error)
            return False
        if packet is None:
            return False
        if packet.subject != self.subject:
            if now - self.heard < LET_GO:
                return False
            self.subject, self.newest = packet.subject, -np.inf
        if 0 <= self.newest - packet.seconds < BACK:
            return False
        self.heard, self.newest = now, packet.seconds
        self.count += 1
        self._hand_on(_described(packet, self.count))
        return True

    def _hand_on(self, text: bytes) -> None:
        with self.lock:
            for page in self.pages:
                with contextlib.suppress(queue.Full, queue.Empty):
                    if page.full():
                        page.get_nowait()
                    page.put_nowait(text)

    def _run(self) -> None:
        while True:
            try:
                data = self.socket.recv(LARGEST)
            except TimeoutError:
                continue
            except OSError:  # closed: the end
                return
            self.hear(data, time.monotonic())


def _described(packet: Packet, number: int) -> bytes:
    """A pose as the page reads it: degrees and signs as a Take has them."""
    take = take_of(np.zeros(1), packet.values[None])
    return json.dumps(
        {
            "number": number,
            "at": time.time() * 1000,  # as the page's own clock
            "subject": packet.subject[:80],
            "weights": _numbers(take.weights[0]),
            "head": _numbers(take.head[0]),
            "eyes": _numbers(take.eyes[0].mean(0)),
        },
        separators=(",", ":"),
    ).encode()


def _numbers(values: np.ndarray) -> list[float]:
    return [round(float(value), DIGITS) for value in values]
