"""Checks at public borders: shape, range, finite."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike


def check_array(
    name: str,
    array: ArrayLike,
    shape: Sequence[int | None],
    low: float | None = None,
    high: float | None = None,
) -> None:
    """Raise ValueError unless `array` has the shape, is finite and lies in the range.

    Args:
        name: how the message calls it.
        array: what was given.
        shape: one entry an axis; None means any length.
        low, high: inclusive limits; None means none.
    """
    array = np.asarray(array)
    check_shape(name, array, shape)
    if array.dtype.kind == "f" and not np.isfinite(array).all():
        raise ValueError(f"{name}: has values that are not finite")
    if array.size and low is not None and array.min() < low:
        raise ValueError(f"{name}: minimum {array.min()}, needs at least {low}")
    if array.size and high is not None and array.max() > high:
        raise ValueError(f"{name}: maximum {array.max()}, needs at most {high}")


def check_shape(name: str, array: ArrayLike, shape: Sequence[int | None]) -> None:
    """Raise ValueError unless `array` has the shape; see `check_array`."""
    have = np.shape(array)
    if len(have) != len(shape) or any(n not in (None, m) for n, m in zip(shape, have)):
        wanted = "[" + ", ".join("any" if n is None else str(n) for n in shape) + "]"
        raise ValueError(f"{name}: shape {list(have)}, needs {wanted}")
