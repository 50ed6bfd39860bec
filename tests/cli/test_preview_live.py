"""`bakery preview --livelink`: what is refused."""

import socket


def test_it_needs_a_server(bakery, bundle):
    done = bakery("preview", bundle, "-o", "a.html", "--livelink", 11111)
    assert done.returncode == 2 and "--serve" in done.stderr


def test_a_port_that_is_taken(bakery, bundle):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        done = bakery("preview", bundle, "--serve", "--livelink", taken.getsockname()[1])
    assert done.returncode == 1 and done.stderr.count("\n") == 1 and "--livelink" in done.stderr
