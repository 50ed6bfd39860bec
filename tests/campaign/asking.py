"""Requests that mean harm to the server of `bakery preview --serve`, mixed with good ones."""

import random
from collections.abc import Callable
from dataclasses import dataclass

MARKUP = b"<zq>"  # said in requests; an answer must not say it as it is
PATHS = (
    "/../secret.txt", "/../../secret.txt", "/%2e%2e/secret.txt", "/%2e%2e%2fsecret.txt",
    "/..%2fsecret.txt", "/%252e%252e%252fsecret.txt", "/..%c0%afsecret.txt", "/%c0%ae%c0%ae/secret.txt",
    "/..\\secret.txt", "/..%5csecret.txt", "/....//secret.txt", "/.%00./secret.txt", "/%00", "/\0",
    "/version\0", "/version%00", "/etc/passwd", "//etc/passwd", "/./../../../../../../../../etc/passwd",
    "file:///etc/passwd", "C:\\boot.ini", "/avatar.json", "/web/avatar.json", "/photo.png",
    "/own.avatar/avatar.json", "/index.html", "/live", "/live/", "/version/", "/version/../version",
    "/version;x", "/version%20", "/VERSION", "/%76ersion", "*", "", ".", "..", "/<zq>", "/%3Czq%3E",
    "/\u00e9", "/favicon.ico", "/.git/config", "/proc/self/environ", "\\", "?", "#",
    "http://localhost/secret.txt", "http://evil.com/", "https://127.0.0.1/", "localhost:80",
    "/" + "a" * 9000,
)  # fmt: skip
MAY = (
    "//",
    "///",
    "//version",
    "http://localhost/",
    "/?x=1",
    "/version?x=/../secret.txt",
    "/#a",
    "/./",
    "/%2f",
)
HOSTS = (
    "evil.com", "evil.com:{port}", "127.0.0.1.evil.com", "127.0.0.1.evil.com:{port}", "localhost.evil.com",
    "evil.com@127.0.0.1", "127.0.0.1@evil.com", "127.0.0.1:{port}@evil.com:80", "localhost:@evil.com",
    "127.0.0.1:evil.com", "127.0.0.1:{port}evil", "127.0.0.1, evil.com", "evil.com, 127.0.0.1",
    "2130706433", "0x7f000001", "017700000001", "127.1", "0.0.0.0:{port}", "[::1]:{port}",
    "[::ffff:127.0.0.1]:{port}", "192.168.0.1:{port}", "localhost#evil.com", "evil.com#localhost",
    "evil.com\\localhost", "localhost\0", "<zq>", "", " ", ":", ":{port}", "::", "xn--localhost",
    "localhost\x0b", "\u00e9vil", "evil.com\r\n localhost", "localhost:1\r\n evil.com", "a" * 60000,
    "127.0.0.1:-1", "127.0.0.1:{port} evil.com", "localhost:80:80",
)  # fmt: skip
METHODS = ("POST", "PUT", "DELETE", "PATCH", "OPTIONS", "TRACE", "CONNECT", "PROPFIND", "get", "Get", "G\0T",
           "<zq>", "GETGET", "__init__", "GET\u00e9", "A" * 5000, "stream", "M-SEARCH", "DEBUG",
           "LINK")  # fmt: skip


@dataclass(frozen=True)
class Request:
    """What is sent, and what may come.

    Attributes:
        name: of the kind of request.
        data: the bytes.
        wanted: "/" or "/version" must come; "may": right content or a refusal; "no": no content;
            "silent": as "no", or nothing at all.
        ended: whether the sending half is closed after it.
        torn: whether an answer may break off, for the server closes while something is unread.
    """

    name: str
    data: bytes
    wanted: str = "no"
    ended: bool = False
    torn: bool = False


class Maker:
    """Requests by a seeded generator; each kind is as frequent as the others."""

    def __init__(self, rng: random.Random, port: int):
        self.rng, self.port = rng, port
        self.host = f"127.0.0.1:{port}"
        self.kinds: tuple[Callable[[], Request], ...] = (
            self.good, self.good, self.path, self.path, self.may, self.by_host, self.by_host, self.two_hosts,
            self.origin, self.method, self.overlong, self.headers, self.body, self.old, self.noise,
            self.ranges, self.cut, self.half, self.pipelined,
        )  # fmt: skip

    def any(self) -> Request:
        return self.rng.choice(self.kinds)()

    def _line(
        self,
        path: str,
        *more: str,
        method: str = "GET",
        host: str | None = "",
        version: str = "1.1",
    ) -> bytes:
        """A request; host "" is the right one, None leaves it out."""
        lines = [f"{method} {path} HTTP/{version}"]
        if host is not None:
            lines.append(
                f"Host: {host or self.rng.choice((self.host, f'localhost:{self.port}', 'localhost'))}"
            )
        return "\r\n".join([*lines, *more, "", ""]).encode("latin-1", "replace")

    def _place(self) -> str:
        return self.rng.choice(("/", "/version", "/version", "/version"))  # a page is long

    def good(self, path: str | None = None) -> Request:
        path, method = (
            path or self._place(),
            self.rng.choice(("GET", "GET", "HEAD")) if not path else "GET",
        )
        return Request(
            "good", self._line(path, method=method, version=self.rng.choice(("1.0", "1.1"))), path
        )

    def path(self) -> Request:
        path = self.rng.choice(PATHS)
        if self.rng.random() < 0.3:  # some letters of it encoded, once or twice
            pick = self.rng.random()
            path = "".join(
                f"%{ord(c):02x}" if c != "/" and self.rng.random() < pick else c for c in path
            )
        if self.rng.random() < 0.2:
            path = self.rng.choice(("/version/", "/web/", "/%2e/", "/a/..")) + path
        return Request("path", self._line(path))

    def may(self) -> Request:
        if (
            self.rng.random() < 0.3
        ):  # another port is no other site: so comes who forwards one to ours
            host = self.rng.choice(("localhost:1", "127.0.0.1:65535", "LOCALHOST", "localhost."))
            return Request("port", self._line(self._place(), host=host), "may")
        return Request("other name of the page", self._line(self.rng.choice(MAY)), "may")

    def by_host(self) -> Request:
        host = self.rng.choice((None, *HOSTS))
        data = self._line(
            self._place(), host="x" if host == "" else host and host.format(port=self.port)
        )
        return Request("host", data.replace(b"Host: x\r\n", b"Host:\r\n") if host == "" else data)

    def two_hosts(self) -> Request:
        hosts = [f"Host: {self.host}", "Host: evil.com"]
        self.rng.shuffle(hosts)
        return Request("two hosts", self._line(self._place(), *hosts, host=None))

    def origin(self) -> Request:
        """It is answered, for a browser does not show the answer to who asked: no header allows it."""
        place = self._place()
        origin = self.rng.choice(
            ("http://evil.com", "null", f"http://evil.com:{self.port}", "file://", "<zq>")
        )
        more = (
            f"Origin: {origin}",
            "Referer: http://evil.com/",
            "Access-Control-Request-Method: GET",
        )
        return Request("origin", self._line(place, *more), place)

    def method(self) -> Request:
        return Request("method", self._line(self._place(), method=self.rng.choice(METHODS)))

    def overlong(self) -> Request:
        size = self.rng.choice((65_530, 65_537, 100_000, 1_000_000))
        if self.rng.random() < 0.5:
            return Request("long line", self._line("/" + "a" * size), torn=True)
        return Request("long header", self._line("/version", "X: " + "a" * size), "may", torn=True)

    def headers(self) -> Request:
        if self.rng.random() < 0.3:
            lines = [f"X-{k}: y" for k in range(self.rng.choice((90, 101, 5000)))]
            return Request("many headers", self._line("/version", *lines), "may", torn=True)
        odd = self.rng.choice(
            (
                ": x",
                "no colon",
                " folded",
                "X\0: y",
                "X: \0\r",
                "\u00e9: \u00e9",
                "X : y",
                "Host: a\nb",
            )
        )
        line = f"{odd}\r\nHost: {self.host}" if self.rng.random() < 0.5 else odd
        return Request(
            "odd header",
            self._line("/version", line, host=None if "\r" in line else ""),
            "may",
            torn=True,
        )

    def body(self) -> Request:
        length = self.rng.choice(
            ("-1", "0", "9" * 30, "1e9", "0x10", "abc", "5\r\nContent-Length: 6", "+3", " ")
        )
        chunk = self.rng.choice(
            (
                "5\r\nhello\r\n0\r\n\r\n",
                "-5\r\nx",
                "ffffffffffffffff\r\nx",
                "zz\r\n",
                "5;<zq>\r\nhel",
            )
        )
        more = self.rng.choice((f"Content-Length: {length}", "Transfer-Encoding: chunked",
                                "Expect: 100-continue",
                                f"Transfer-Encoding: chunked\r\nContent-Length: {length}"))  # fmt: skip
        method = self.rng.choice(("GET", "POST", "HEAD"))
        wanted = "no" if method == "POST" else "may"
        return Request(
            "body", self._line("/version", more, method=method) + chunk.encode(), wanted, torn=True
        )

    def old(self) -> Request:
        """HTTP/0.9, and versions that are none."""
        version = self.rng.choice(
            ("2.0", "3", "1", "1.1.1", "-1.1", "1.x", "", "\u00b2.0", "9" * 20 + ".1", "0.9")
        )
        if self.rng.random() < 0.5:
            more = self.rng.choice(("", f"Host: {self.host}\r\n"))
            return Request(
                "0.9",
                f"GET {self._place()}\r\n{more}\r\n".encode(),
                "may" if more else "no",
                ended=True,
            )
        return Request("version", self._line("/version", version=version), "may")

    def noise(self) -> Request:
        data = self.rng.choice((
            b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n",
            b"\x16\x03\x01\x02\0\x01\0\x01\xfc\x03\x03" + self.rng.randbytes(200),
            self.rng.randbytes(self.rng.randrange(1, 400)), b"\r\n" * 9, b"\0" * 70,
            b"GET\r\n\r\n", b" / HTTP/1.1\r\n\r\n",
            b"GET  HTTP/1.1\r\n\r\n", b"GET / HTTP/1.1 x\r\n\r\n", b"\xff\xfe\r\n\r\n", b"SSH-2.0-x\r\n", b"",
        ))  # fmt: skip
        return Request("noise", data, "silent", ended=True, torn=True)

    def ranges(self) -> Request:
        """Not supported: the whole comes."""
        wanted = self.rng.choice(
            ("bytes=0-9", "bytes=-5", "bytes=9-1", "bytes=0-,0-,0-", "bytes=" + "0-1," * 999, "x=1")
        )
        place = self._place()
        return Request("range", self._line(place, f"Range: {wanted}", "If-None-Match: *"), place)

    def cut(self) -> Request:
        """A request that ends in its middle; without a right Host it is none."""
        data = self._line("/version")
        return Request(
            "cut", data[: self.rng.randrange(len(data) - 2)], "may", ended=True, torn=True
        )

    def half(self) -> Request:
        place = self._place()
        return Request("half closed", self._line(place), place, ended=True)

    def pipelined(self) -> Request:
        """The first is answered, and the line closed."""
        second = self._line("/../secret.txt", host="evil.com")
        return Request("two requests", self._line("/version") + second, "may", torn=True)
