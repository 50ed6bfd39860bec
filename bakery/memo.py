"""Results that are computed once and kept: the two ways, and no third.

A function of values that can be hashed, as names and paths, has `functools.cache`, or
`functools.lru_cache` where there may be many large results. A function of an object that cannot, as
a head full of arrays, has `once_per_object`: the result lives as long as the object, so nothing has
to be emptied, and nothing of an object that is gone is kept.
"""

from collections.abc import Callable
from functools import wraps
from threading import RLock
from typing import TypeVar
from weakref import finalize

Thing = TypeVar("Thing")
Made = TypeVar("Made")


def once_per_object(
    make: Callable[[Thing], Made], anchor: Callable[[Thing], object] | None = None
) -> Callable[[Thing], Made]:
    """A function of one object, computed once for each as long as it is alive.

    Args:
        make: the function; its result must not hold the object, which would never be let go then.
        anchor: gives the part of an object that stands for it: objects that share it share the
            result. None takes the object itself. It must take weak references.
    """
    lock, kept = RLock(), dict[int, Made]()

    @wraps(make)
    def found(thing: Thing) -> Made:
        part = thing if anchor is None else anchor(thing)
        key = id(part)
        if key in kept:  # alive, so that no other object has its number: no lock is needed
            return kept[key]
        with lock:
            if key not in kept:
                kept[key] = make(thing)
                finalize(part, kept.pop, key, None)
            return kept[key]

    return found
