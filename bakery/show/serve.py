"""A local server of one page that loads itself again when its bundle was baked again."""

import contextlib
import hashlib
import logging
import queue
import re
import socket
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Lock

from bakery.errors import BakeryError, InputError
from bakery.formats.files import read_bytes
from bakery.formats.place import MANIFEST
from bakery.show.page import page

log = logging.getLogger(__name__)
HOST = "127.0.0.1"  # nobody else on the network sees the avatar
OWN = re.compile(r"(127\.0\.0\.1|localhost)(:[0-9]{1,5})?")  # any port: it may be forwarded
PATIENCE = 60.0  # seconds that a request may take to come, or an answer to be taken
PULSE = 5.0  # seconds of silence after which a stream says that it is there


class Shown:
    """The newest good page of a bundle; a bake that is under way does not disturb it."""

    def __init__(self, folder, derive=None, live=False):
        self.folder, self.derive, self.live = Path(folder), derive, live
        self.lock = Lock()  # each request has a thread of its own
        self.token, self.content = None, None
        self.refresh()

    def refresh(self) -> tuple[str, bytes]:
        """Read the bundle again if its manifest changed; the first time, errors are raised.

        Returns:
            token of the state, and the page of the same state.
        """
        with self.lock:
            try:
                token = hashlib.sha256(read_bytes(self.folder / MANIFEST)).hexdigest()[:16]
                if token != self.token:
                    self.content = page(self.folder, token, self.derive, self.live)
                    self.token = token
            except BakeryError as error:
                if self.content is None:
                    raise
                log.warning("%s: still showing the last one (%s)", self.folder, error)
            return self.token, self.content


class Server(ThreadingHTTPServer):
    """A server that says nothing about readers who went away."""

    def handle_error(self, request, client_address):
        log.debug("a request failed", exc_info=True)


def make_server(folder, port, derive=None, live=None):
    """A server for one bundle on this machine; call `serve_forever`.

    Args:
        folder: the bundle.
        port: 0 takes any free one.
        derive: see `page.page`.
        live: show.live.Live, whose poses the page plays; or None.

    Raises:
        BundleError: something is wrong with the bundle.
        InputError: the port is taken.
    """
    shown = Shown(folder, derive, live is not None)

    class Handler(BaseHTTPRequestHandler):
        """Three addresses: the page, the token of its state, and what comes live."""

        timeout = PATIENCE

        def do_GET(self):
            hosts = self.headers.get_all("Host", [])
            if len(hosts) != 1 or not OWN.fullmatch(hosts[0]):  # a foreign name that leads here
                self.send_error(403)
                return
            if self.path == "/live" and live and self.command == "GET":
                self.stream()
                return
            if self.path not in ("/", "/version"):
                self.send_error(404)
                return
            token, data = shown.refresh()
            kind = "text/html; charset=utf-8"
            if self.path == "/version":
                kind, data = "text/plain; charset=utf-8", token.encode()
            self.send_response(200)
            self.send_header("Content-Type", kind)
            self.send_header("Content-Length", str(len(data)))
            self.send_header("Cache-Control", "no-store")
            self.send_header("X-Content-Type-Options", "nosniff")
            self.end_headers()
            if self.command != "HEAD":
                self.wfile.write(data)

        do_HEAD = do_GET

        def stream(self):
            """Server-sent events, until the reader goes away."""
            self.connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self.send_response(200)
            self.send_header("Content-Type", "text/event-stream")
            self.send_header("Cache-Control", "no-store")
            self.send_header("X-Content-Type-Options", "nosniff")
            self.end_headers()
            with contextlib.suppress(ConnectionError), live.listening() as poses:
                while True:
                    try:
                        self.wfile.write(b"data: " + poses.get(timeout=PULSE) + b"\n\n")
                    except queue.Empty:
                        self.wfile.write(b":\n\n")  # a remark: finds out whether somebody reads

        def log_message(self, text, *values):
            log.debug(text, *values)

    try:
        return Server((HOST, port), Handler)
    except OSError as error:
        raise InputError(
            f"port {port}: cannot be used ({error.strerror}); give another --port"
        ) from None
