"""`bakery preview --serve` under requests that mean harm, and bundles that do (hostile_bundles.py).

The server has two addresses, the page and its version. They alone are answered by 200, with exactly the right
bytes, and to nobody who came by another name of the host: so a page from elsewhere cannot read them. What a
request says is told in a table: whether it may, must or must not get content.
"""

import hashlib
import random
import re
import shutil
import signal
import socket
import struct
import subprocess
import sys
import time
from pathlib import Path

import asking
import base
import hostile_bundles

MUST = "10,000 hostile requests and 200 hostile bundles: 0 answered wrongly, less than 50 MiB more memory"
GROWN = 50  # MiB
PASSWORDS = b"root:x:0:0"  # of /etc/passwd
HEADERS = {"server", "date", "content-type", "content-length", "cache-control", "x-content-type-options",
           "connection"}  # fmt: skip
REFUSED = {400, 403, 404, 405, 411, 413, 414, 417, 431, 501, 505}
PARTIAL = 12  # unfinished requests that are kept open
CHECKED = 100  # requests after which the server has to answer a good one


def run(
    inputs: base.Inputs, place: Path, count: int, bundles: int = 200, seed: int = 4
) -> base.Row:
    """Send `count` requests, and show so many hostile bundles.

    Args:
        place: a folder to work in.
    """
    row, began = base.Row("page and --serve", MUST), time.monotonic()
    place = place / "server"
    folder = place / "served" / "own.avatar"
    shutil.copytree(inputs.bundle, folder)
    (folder.parent / "secret.txt").write_text(hostile_bundles.SECRET)
    (folder.parent / "index.html").write_text(hostile_bundles.SECRET)
    row.note = _requests(row, folder, place, count, random.Random(seed))
    middle = time.monotonic()
    row.note += "; " + hostile_bundles.show(row, inputs.bundle, place / "bundles", bundles, seed)
    row.seconds = time.monotonic() - began
    row.note += f"; {middle - began:.0f} s and {row.seconds - (middle - began):.0f} s"
    return row


def _requests(row: base.Row, folder: Path, place: Path, count: int, rng: random.Random) -> str:
    from bakery.show.page import page

    token = hashlib.sha256((folder / "avatar.json").read_bytes()).hexdigest()[:16]
    content = {"/": page(folder, token), "/version": token.encode()}
    said = place / "server.log"
    line = [sys.executable, "-m", "bakery", "preview", str(folder), "--serve", "--port", "0"]
    with said.open("wb") as log:
        server = subprocess.Popen(
            line, stdout=log, stderr=log, cwd=place,
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
        )  # fmt: skip
    try:
        port = _port(said, server)
        make = asking.Maker(rng, port)
        open_ones: list[socket.socket] = []
        first = grown = 0.0
        for number in range(count):
            request = make.any()
            row.cases += 1
            trouble = _judged(request, _asked(port, request, rng), content)
            if trouble:
                row.fail(f"{request.name}: {request.data[:120]!r}: {trouble}")
            if number % 10 == 3:
                _leave_open(port, open_ones, rng)
            if number % CHECKED == CHECKED - 1 or number == count - 1:
                for path in content:
                    if trouble := _judged(
                        good := make.good(path), _asked(port, good, rng), content
                    ):
                        row.fail(f"after {number + 1} requests, {path}: {trouble}")
                grown = _memory(server.pid) - (first or _memory(server.pid))
                first = first or _memory(server.pid)  # once it has answered some
        for each in open_ones:
            each.close()
        if server.poll() is not None:
            row.fail(f"the server ended with exit code {server.returncode}")
        if grown > GROWN:
            row.fail(f"the server grew by {grown:.0f} MiB")
        server.send_signal(signal.SIGINT)
        if server.wait(60):
            row.fail(f"Ctrl-C ended the server with exit code {server.returncode}")
    finally:
        server.kill()
        server.wait()
    more = said.read_text("utf-8", "replace").splitlines()[1:]
    if more:
        row.fail(f"the server said {len(more)} lines more, as: {more[-1][:200]}")
    return f"{row.cases} requests, {len(content['/']) / 2**20:.1f} MiB a page; memory grew by {grown:.1f} MiB"


def _port(log: Path, server: subprocess.Popen) -> int:
    for _ in range(600):
        if found := re.search(r"http://127\.0\.0\.1:(\d+)/", log.read_text("utf-8", "replace")):
            return int(found[1])
        if server.poll() is not None:
            break
        time.sleep(0.1)
    raise SystemExit(f"the server does not begin: {base.said(log)}")


def _memory(pid: int) -> float:
    """MiB that a process has in memory."""
    return int(re.search(r"VmRSS:\s+(\d+)", Path(f"/proc/{pid}/status").read_text())[1]) / 1024


def _asked(port: int, request: asking.Request, rng: random.Random) -> bytes | None:
    """All that comes back; None if nothing ends the answer in time."""
    out = b""
    try:
        with socket.create_connection(("127.0.0.1", port), timeout=20) as line:
            try:
                if rng.random() < 0.1 and len(request.data) > 2:  # in two packets
                    cut = rng.randrange(1, len(request.data))
                    line.sendall(request.data[:cut])
                    time.sleep(0.002)
                    line.sendall(request.data[cut:])
                else:
                    line.sendall(request.data)
                if request.ended:
                    line.shutdown(socket.SHUT_WR)
            except (BrokenPipeError, ConnectionResetError, OSError):
                pass  # it had seen enough; what it said comes still
            while data := line.recv(2**18):
                out += data
    except ConnectionResetError:
        pass
    except TimeoutError:
        return None
    return out


def _leave_open(port: int, open_ones: list[socket.socket], rng: random.Random) -> None:
    """A request that is not finished, and the end of an old one: orderly, or by a reset."""
    line = socket.create_connection(("127.0.0.1", port), timeout=20)
    whole = b"GET / HTTP/1.1\r\nHost: localhost\r\nX: " + bytes(60)
    line.sendall(whole[: rng.randrange(len(whole))])
    open_ones.append(line)
    if len(open_ones) > PARTIAL:
        old = open_ones.pop(rng.randrange(PARTIAL))
        if rng.random() < 0.5:
            old.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        old.close()


def _judged(request: asking.Request, answer: bytes | None, content: dict[str, bytes]) -> str:
    """What is wrong with an answer, or ""."""
    if answer is None:
        return "no end of the answer within 20 s"
    for wrong in (hostile_bundles.SECRET.encode(), PASSWORDS, b"Traceback (most"):
        if wrong in answer:
            return f"the answer holds {wrong.decode()}"
    if not answer:
        return "" if request.wanted == "silent" or request.torn else "no answer"
    if not answer.startswith(b"HTTP/1."):
        return _old_answer(request, answer, content)
    head, _, body = answer.partition(b"\r\n\r\n")
    lines = head.split(b"\r\n")
    status = int(lines[0].split()[1])
    others = {one.partition(b":")[0].decode("latin-1").lower() for one in lines[1:]} - HEADERS
    if others:
        return f"answers with the headers {sorted(others)}"
    if asking.MARKUP in body:
        return "the answer says markup of the request as it is"
    if status != 200:
        if any(part in body for part in content.values()):
            return f"content with status {status}"
        if request.wanted.startswith("/"):
            return f"status {status}"
        return "" if status in REFUSED else f"status {status}"
    if request.wanted in ("no", "silent"):
        return "content, which it must not get"
    right = [content[request.wanted]] if request.wanted in content else [*content.values(), b""]
    if request.data.startswith(b"HEAD"):
        right = [b""]
    if body in right or request.torn and any(part.startswith(body) for part in right):
        return ""
    return f"{len(body)} wrong bytes"


def _old_answer(request: asking.Request, answer: bytes, content: dict[str, bytes]) -> str:
    """Of HTTP/0.9, which has no head: content or a page that tells an error."""
    if answer in content.values():
        return "" if request.wanted == "may" else "content, which it must not get"
    known = answer.lstrip().startswith(b"<!DOCTYPE HTML>") and b"Error code" in answer
    return "" if known and asking.MARKUP not in answer else f"an unknown answer {answer[:80]!r}"
