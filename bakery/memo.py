"""Results that are computed once and kept: the two ways, and no third.

A function of values that can be hashed, as names and paths, has `functools.cache`, or
`functools.lru_cache` where there may be many large results. A function of an object that cannot, as
a head full of arrays, has `once_per_object`: the result lives as long as the object, so nothing has
to be emptied, and nothing of an object that is gone is kept.
"""

from collections.abc import Callable
from functools import wraps
from threading import RLock
from typing import Concatenate, ParamSpec, TypeVar
from weakref import finalize

Thing = TypeVar("Thing")
More = ParamSpec("More")
Made = TypeVar("Made")


def once_per_object(
    make: Callable[Concatenate[Thing, More], Made],
    anchor: Callable[[Thing], object] | None = None,
) -> Callable[Concatenate[Thing, More], Made]:
    """A function of an object, computed once for each as long as it is alive.

    Args:
        make: the function; its result must not hold the object, which would never be let go then.
            What it takes besides goes by place and can be hashed: each has a result of its own.
        anchor: gives the part of an object that stands for it: objects that share it share the
            result. None takes the object itself. It must take weak references.
    """
    lock, kept = RLock(), dict[int, dict[tuple[object, ...], Made]]()

    @wraps(make)
    def found(thing: Thing, *more: More.args, **named: More.kwargs) -> Made:
        assert not named, "by place, so that one value has one key"
        part = thing if anchor is None else anchor(thing)
        key = id(part)  # alive, so that no other object has its number: reading needs no lock
        if key in kept and more in kept[key]:
            return kept[key][more]
        with lock:
            if key not in kept:
                kept[key] = {}
                finalize(part, kept.pop, key, None)
            if more not in kept[key]:
                kept[key][more] = make(thing, *more)
            return kept[key][more]

    return found
