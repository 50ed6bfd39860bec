"""Work on all cores, in order. Threads are enough: numba, OpenCV and torch let go of the interpreter."""

import logging
import os
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor, wait
from contextlib import contextmanager
from functools import cache
from threading import Thread
from typing import TypeVar

Item = TypeVar("Item")
Result = TypeVar("Result")
log = logging.getLogger(__name__)
MOST = 8  # threads; each holds the buffers of its own picture


def side_by_side(work: Callable[[Item], Result], items: Iterable[Item]) -> Iterator[Result]:
    """Yield work(item) of each item, in order, while the next ones are in work.

    What is ahead is bounded, so that results do not pile up; an error of `work` comes out where its
    result would have.
    """
    threads = min(os.cpu_count() or 1, MOST)
    waiting: deque[Future[Result]] = deque()
    with ThreadPoolExecutor(threads) as pool:
        try:
            for item in items:
                waiting.append(pool.submit(work, item))
                if len(waiting) > 2 * threads:
                    yield waiting.popleft().result()
            while waiting:
                yield waiting.popleft().result()
        finally:
            for task in waiting:
                task.cancel()


def both(first: Callable[[], Item], second: Callable[[], Result]) -> tuple[Item, Result]:
    """first() and second(), the second on another thread if that one has time, else after the first.

    It never waits for a thread that is busy with somebody else's work. Errors are those of the first
    before those of the second.
    """
    with beside(second) as other:
        return first(), other()


@contextmanager
def beside(work: Callable[[], Result]) -> Iterator[Callable[[], Result]]:
    """Begin work() beside the block, as soon as the other thread has time.

    Blocks may lie in each other: their works are done one after the other, so that no more memory is
    held than by two. The block is given a function to call once: it returns the result, after doing
    the work itself where that was not begun. An error of `work` comes out there. Work that was begun
    ends before the block does, so that nothing is written after it.
    """
    task = _helper().submit(work)
    try:
        yield lambda: work() if task.cancel() else task.result()
    finally:
        if not task.cancel():
            wait([task])


@cache
def _helper() -> ThreadPoolExecutor:
    """One thread that stays: a new one each time would fill the caches of BLAS anew."""
    return ThreadPoolExecutor(1)


def ahead(work: Callable[..., object], *given: object) -> None:
    """Begin work(*given) beside what follows; who needs its outcome makes sure of it itself.

    So an error is not shown here: it comes again where the outcome is needed. If the program ends
    before, nobody needs it.
    """

    def trying() -> None:
        try:
            work(*given)
        except Exception:
            log.debug("work that was begun ahead failed", exc_info=True)

    Thread(target=trying, daemon=True).start()
