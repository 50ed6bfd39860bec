"""Results of a long step, kept part by part, so that an interrupted bake loses seconds."""

from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from dataclasses import fields
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from bakery.formats import npz, record
from bakery.formats.work import Work, key_of
from bakery.parallel import side_by_side

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

Arrays = dict[str, np.ndarray]
Item = TypeVar("Item")
Record = TypeVar("Record", bound="DataclassInstance")


class Kept:
    """Named arrays in a work folder, each part with the key of what it was made from.

    A part that was just made is used as it is, not read back: packing loses nothing, so a bake that
    goes on gives the same bytes as one that was never interrupted.
    """

    def __init__(self, work: Work | None = None, key: str = "") -> None:
        """Keep parts in a folder.

        Args:
            work: the folder; None keeps nothing.
            key: of everything that all parts are made from.
        """
        self.work, self.key = work or Work(None), key

    def read(self, name: str, *more: object) -> Arrays | None:
        """A part, or None if there is none for this key."""
        data = self.work.get(f"{name}.npz", key_of(self.key, *more))
        return record.unpack_arrays(f"{name}.npz", data) if data else None

    def write(self, name: str, arrays: Arrays, *more: object) -> None:
        """Keep a part."""
        if self.work.folder is not None:
            self.work.put(f"{name}.npz", key_of(self.key, *more), npz.pack_arrays(arrays))

    def one(self, name: str, make: Callable[[], Arrays]) -> Arrays:
        """A part, made unless it is kept."""
        arrays = self.read(name)
        if arrays is None:
            arrays = make()
            self.write(name, arrays)
        return arrays

    def record(self, name: str, kind: type[Record], make: Callable[[], Record]) -> Record:
        """A part that is a dataclass of arrays, made unless it is kept."""

        def arrays() -> Arrays:
            made = make()
            return {field.name: getattr(made, field.name) for field in fields(made)}

        return kind(**self.one(name, arrays))

    def drop(self, name: str) -> None:
        """Keep a part no longer: another one holds what was made of it."""
        self.work.drop(f"{name}.npz")

    def series(
        self, name: str, make: Callable[[Item], Arrays], items: Sequence[Item], size: int
    ) -> Generator[Arrays, None, None]:
        """Iterate over make(item) of each item, `size` of them a part; what lacks is made side by side."""
        starts = range(0, len(items), size)
        kept = {first: self.read(f"{name}{first:03d}", size) for first in starts}
        lacking = [first for first in starts if kept[first] is None]
        missing = (item for first in lacking for item in items[first : first + size])
        made = side_by_side(make, missing)
        for first in starts:
            count = len(items[first : first + size])
            arrays = kept.pop(first)
            if arrays is not None:
                yield from _rows(arrays, count)
                continue
            rows = []
            for _ in range(count):
                rows.append(next(made))
                yield rows[-1]
            self.write(f"{name}{first:03d}", _stacked(rows), size)


def _stacked(rows: Iterable[Arrays]) -> Arrays:
    rows = list(rows)
    return {name: np.stack([row[name] for row in rows]) for name in rows[0]}


def _rows(arrays: Arrays, count: int) -> Iterator[Arrays]:
    yield from ({name: array[k] for name, array in arrays.items()} for k in range(count))
