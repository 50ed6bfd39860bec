"""Plug-ins: found by entry points, made once, each told from every other version of itself."""

from functools import cache
from importlib.metadata import EntryPoint, entry_points
from typing import Any

from bakery.errors import no_such
from bakery.types import Maker


def known(group: str) -> dict[str, EntryPoint]:
    """The plug-ins of a group, such as "generators", by name."""
    return {entry.name: entry for entry in entry_points(group=f"bakery.{group}")}


@cache
def plug_in(group: str, name: str) -> Any:
    """A plug-in, made.

    Raises:
        UsageProblem: there is none of this name.
    """
    found = known(group)
    if name not in found:
        raise no_such(f"no {group.removesuffix('s')}", name, sorted(found))
    return found[name].load()()


def maker_of(group: str, made: Any) -> Maker:
    """Which plug-in made something: its name, its package's version, the digest of its data."""
    entry = known(group).get(made.name)
    return Maker(
        made.name,
        entry.dist.version if entry and entry.dist else "",
        made.sha256,
        getattr(made, "source_type", ""),
    )
