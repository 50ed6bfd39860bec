"""What is computed once for an object."""

import gc
from dataclasses import dataclass

import numpy as np
import pytest

from bakery.memo import once_per_object
from bakery.parallel import side_by_side


@dataclass(eq=False)
class Thing:
    value: int
    mean: np.ndarray | None = None


def counted(anchor=None):
    """A kept function that says its object's value, and the list of what it was computed of."""
    calls = []

    def make(thing):
        calls.append(thing.value)
        return [thing.value]

    return once_per_object(make, anchor), calls


def test_each_object_has_its_own():
    value_of, calls = counted()
    one, two = Thing(value=1), Thing(value=2)
    assert [value_of(thing) for thing in (one, two, one, two)] == [[1], [2], [1], [2]]
    assert value_of(one) is value_of(one)
    assert calls == [1, 2]


def test_objects_share_what_stands_for_them():
    value_of, calls = counted(anchor=lambda thing: thing.mean)
    mean = np.zeros(3)
    one, two = Thing(mean=mean, value=1), Thing(mean=mean, value=2)
    assert value_of(one) is value_of(two)
    assert value_of(Thing(mean=mean.copy(), value=3)) == [3]
    assert calls == [1, 3]


def test_what_it_takes_besides_has_its_own():
    calls = []

    @once_per_object
    def scaled(thing, factor, name="a"):
        calls.append((thing.value, factor, name))
        return [thing.value * factor]

    one, two = Thing(value=1), Thing(value=2)
    assert [scaled(one, 3), scaled(one, 5), scaled(two, 3), scaled(one, 3)] == [[3], [5], [6], [3]]
    assert scaled(one, 3) is scaled(one, 3) and scaled(one, 3, "b") is not scaled(one, 3)
    assert calls == [(1, 3, "a"), (1, 5, "a"), (2, 3, "a"), (1, 3, "b")]
    with pytest.raises(AssertionError, match="by place"):
        scaled(one, factor=3)


def test_what_is_gone_is_let_go():
    """A new object may get an old one's number: it must not get its result."""
    value_of, calls = counted()
    for value in range(100):
        assert value_of(Thing(value=value)) == [value]
        gc.collect(0)
    assert calls == list(range(100))


def test_threads_compute_it_once():
    value_of, calls = counted()
    thing = Thing(value=7)
    assert list(side_by_side(lambda _: value_of(thing), range(200))) == [[7]] * 200
    assert calls == [7]


def test_as_a_property():
    class Shape:
        value = 4

        @property
        @once_per_object
        def double(self):
            """Twice the value."""
            return [2 * self.value]

    shape = Shape()
    assert shape.double is shape.double and shape.double == [8]
    assert Shape.double.__doc__ == "Twice the value."
