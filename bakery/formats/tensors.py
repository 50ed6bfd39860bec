"""Learned arrays as safetensors, and the one line that says why they cannot be read."""

import contextlib
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np

from bakery.errors import ModelError, lacks_memory
from bakery.formats.files import write_bytes


@contextlib.contextmanager
def reading(what: str, path: Path, remedy: str) -> Iterator[None]:
    """While a file is read: what is wrong with it becomes one line.

    Raises:
        ModelError: it is missing or damaged, or an array is missing or has a wrong shape (ValueError).
        MemoryError: there is not enough.
    """
    from safetensors import SafetensorError

    try:
        yield
    except (OSError, SafetensorError, KeyError, ValueError) as error:
        raise ModelError(f"{what} {path} cannot be read ({error}); {remedy}") from error
    except BaseException as error:
        if lacks_memory(error):  # safetensors panics then, in Rust: that is no Exception
            raise MemoryError from error
        raise


def write_tensors(
    arrays: Mapping[str, np.ndarray], path: Path, about: dict[str, str] | None = None
) -> None:
    """Write arrays as safetensors, which takes them in order alone.

    Args:
        about: texts that the file carries besides.

    Raises:
        DiskError: see `files.write_bytes`.
    """
    from safetensors.numpy import save

    ordered = {key: np.ascontiguousarray(value) for key, value in arrays.items()}
    write_bytes(path, save(ordered, about))
