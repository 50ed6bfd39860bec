"""The server of `bakery preview --serve`: many requests at once, HEAD, and a quiet end."""

import http.client
import os
import re
import signal
import socket
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager

import pytest

from bakery.errors import BundleError
from bakery.formats.files import digest, write_bytes
from bakery.show import serve


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A bundle whose page names its token; pages are counted, and never made two at a time."""
    busy = threading.Lock()
    serve_calls.clear()

    def page(folder, watch, derive, live):
        assert not live
        assert busy.acquire(blocking=False), "two pages are made at once"
        try:
            time.sleep(0.005)  # so that other threads come meanwhile
            if (folder / "avatar.json").read_bytes() == b"broken":
                raise BundleError("broken")
            serve_calls.append(watch)
            return f"page {watch}".encode()
        finally:
            busy.release()

    monkeypatch.setattr(serve, "page", page)
    (tmp_path / "avatar.json").write_bytes(b"0")
    return tmp_path


serve_calls = []


def token_of(data):
    return digest(data)[:16]


def test_requests_at_once_get_one_state(folder):
    shown = serve.Shown(folder)
    states = [str(number).encode() for number in range(20)]
    done = threading.Event()

    def ask(_):
        found = set()
        while not done.is_set():
            token, content = shown.refresh()
            assert content == f"page {token}".encode()
            found.add(token)
        return found

    with ThreadPoolExecutor(8) as pool:
        asked = [pool.submit(ask, n) for n in range(8)]
        for state in states:
            write_bytes(folder / "avatar.json", state)
            time.sleep(0.01)
        done.set()
        found = set().union(*(one.result() for one in asked))
    assert found <= set(map(token_of, states)) and token_of(states[-1]) == shown.refresh()[0]
    assert len(serve_calls) == len(set(serve_calls)), "a state's page was made twice"


@contextmanager
def serving(folder):
    with serve.make_server(folder, 0) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        try:
            yield server.server_address
        finally:
            server.shutdown()


def ask(address, method, path, **headers):
    connection = http.client.HTTPConnection(*address, timeout=10)
    connection.request(method, path, headers=headers)
    answer = connection.getresponse()
    table = {name: value for name, value in answer.getheaders() if name != "Date"}
    return answer.status, table, answer.read()


def test_head_is_get_without_the_body(folder):
    with serving(folder) as address:
        for path, wanted in (("/", b"page " + token_of(b"0").encode()), ("/version", None)):
            status, headers, data = ask(address, "GET", path)
            assert status == 200 and int(headers["Content-Length"]) == len(data) > 0
            assert wanted in (None, data)
            assert ask(address, "HEAD", path) == (status, headers, b"")
        assert ask(address, "HEAD", "/elsewhere")[::2] == (404, b"")
        assert ask(address, "HEAD", "/", Host="elsewhere.example")[::2] == (403, b"")
        assert ask(address, "POST", "/")[0] == 501


@pytest.mark.parametrize(
    ("hosts", "status"),
    [
        (["localhost"], 200),
        (["127.0.0.1:8080"], 200),  # a port that is forwarded
        ([], 403),
        (["evil.example", "localhost"], 403),
        (["localhost", "evil.example"], 403),
        (["127.0.0.1:evil.example"], 403),
        (["localhost:@evil.example"], 403),
        (["localhost:1 evil.example"], 403),
        (["localhost:-1"], 403),
        (["LOCALHOST.evil.example"], 403),
    ],
)
def test_only_this_machine_by_its_own_name_gets_the_page(folder, hosts, status):
    """A page of somebody else whose name was made to lead here must read nothing."""
    with serving(folder) as address, socket.create_connection(address) as line:
        names = "".join(f"Host: {host}\r\n" for host in hosts)
        line.sendall(f"GET /version HTTP/1.1\r\n{names}Connection: close\r\n\r\n".encode())
        answer = b"".join(iter(lambda: line.recv(1 << 16), b""))
    assert answer.split()[1] == str(status).encode()
    assert (token_of(b"0").encode() in answer) == (status == 200)


def test_a_broken_bundle_leaves_the_last_page(folder):
    with serving(folder) as address:
        (folder / "avatar.json").write_bytes(b"broken")
        assert ask(address, "GET", "/")[2] == f"page {token_of(b'0')}".encode()


def test_readers_who_go_away_are_not_mentioned(folder, capsys):
    with serving(folder) as address:
        for _ in range(5):
            with socket.create_connection(address) as line:
                line.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\1\0\0\0\0\0\0\0")  # reset
                line.sendall(b"GET / HTTP/1.0\r\nHost: localhost\r\n")
        assert ask(address, "HEAD", "/")[0] == 200
        time.sleep(0.1)
    assert capsys.readouterr().err == ""


@pytest.mark.skipif(os.name == "nt", reason="sends SIGINT to one process")
def test_ctrl_c_is_its_good_end(bundle):
    process = subprocess.Popen(
        [sys.executable, "-m", "bakery", "preview", str(bundle), "--serve", "--port", "0"],
        stderr=subprocess.PIPE, text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )  # fmt: skip
    line = process.stderr.readline()
    host, port = re.search(r"http://([\d.]+):(\d+)/ \(Ctrl-C ends\)", line).groups()
    status, headers, data = ask((host, int(port)), "HEAD", "/")
    assert status == 200 and int(headers["Content-Length"]) > 100_000 and data == b""
    process.send_signal(signal.SIGINT)
    assert process.communicate(timeout=60)[1] == "" and process.returncode == 0
