"""Side by side, yet in order."""

import logging
import threading
import time

import pytest

from bakery.parallel import ahead, beside, both, side_by_side


def test_order_is_kept():
    def slow_if_even(k):
        time.sleep(0.01 * (k % 2 == 0))
        return k * k

    assert list(side_by_side(slow_if_even, range(20))) == [k * k for k in range(20)]


def test_an_error_comes_where_its_result_would_have():
    def fails_at_three(k):
        if k == 3:
            raise ValueError("three")
        return k

    found = []
    with pytest.raises(ValueError, match="three"):
        found.extend(side_by_side(fails_at_three, range(100)))
    made = side_by_side(fails_at_three, range(100))
    assert [next(made) for _ in range(3)] == [0, 1, 2]


def test_what_is_ahead_is_bounded(monkeypatch):
    monkeypatch.setattr("os.cpu_count", lambda: 2)
    started, lock = [], threading.Lock()

    def note(k):
        with lock:
            started.append(k)
        return k

    made = side_by_side(note, range(100))
    assert next(made) == 0
    time.sleep(0.05)
    assert len(started) <= 6
    made.close()
    assert len(started) <= 6


def test_both_are_done_side_by_side():
    meet = threading.Barrier(2, timeout=10)
    assert [side >= 0 for side in both(meet.wait, meet.wait)] == [True, True]


def test_a_busy_helper_is_not_waited_for():
    """While the other thread works for somebody else, both are done here."""
    done = threading.Event()
    other = threading.Thread(target=lambda: both(lambda: done.wait(10), lambda: done.wait(10)))
    other.start()
    time.sleep(0.05)
    here = threading.get_ident()
    assert both(threading.get_ident, threading.get_ident) == (here, here)
    done.set()
    other.join()


def test_an_error_of_either_comes_out_and_the_helper_goes_on():
    def fails():
        raise ValueError("either")

    for pair in ((fails, int), (int, fails), (fails, fails)):
        with pytest.raises(ValueError, match="either"):
            both(*pair)
    assert both(int, str) == (0, "")


def test_work_goes_on_beside_the_block_and_ends_before_it():
    met, done = threading.Barrier(2, timeout=10), []

    def work():
        met.wait()
        time.sleep(0.05)
        done.append(1)
        return "made"

    with beside(work) as made:
        met.wait()
        assert made() == "made"
    with beside(work):
        met.wait()
    assert done == [1, 1]


def test_work_beside_a_block_that_was_not_begun_is_done_where_it_is_asked():
    """One work after the other, in any depth, and never waiting for a thread that waits."""
    started, go, here = threading.Event(), threading.Event(), threading.get_ident()

    def first():
        started.set()
        return go.wait(10)

    with beside(first) as one, beside(threading.get_ident) as two:
        assert started.wait(10)
        assert two() == here
        go.set()
        assert one()
    with beside(lambda: both(threading.get_ident, threading.get_ident)) as pair:
        assert len(set(pair())) == 1


def test_an_error_beside_the_block_comes_out_where_its_result_is_asked():
    with beside(lambda: 1 // 0) as made, pytest.raises(ZeroDivisionError):
        made()
    with pytest.raises(ValueError, match="the block's own"), beside(lambda: 1 // 0):
        raise ValueError("the block's own")


def test_what_fails_ahead_says_nothing(capfd, caplog, monkeypatch):
    """It is tried again where it is needed."""
    # A handler that an earlier test left would write to a stream that is closed by now.
    monkeypatch.setattr(logging.getLogger(), "handlers", [caplog.handler])
    done = threading.Event()

    def fails(number):
        done.set()
        raise ValueError(number)

    with caplog.at_level("DEBUG", "bakery.parallel"):
        ahead(fails, 3)
        assert done.wait(5)
        for thread in threading.enumerate():
            if thread.daemon and thread is not threading.current_thread():
                thread.join(1)
    assert [record.levelname for record in caplog.records] == ["DEBUG"]
    assert capfd.readouterr().err == ""
