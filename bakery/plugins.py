"""Plug-ins: found by entry points, made once, each told from every other version of itself."""

from functools import cache
from importlib.metadata import EntryPoint, entry_points
from typing import Any

from bakery.errors import ModelError, no_such
from bakery.types import Maker

# What the Protocol of a group asks for (tests/test_plugin.py compares); heads and commands have none.
ASKED = {
    "detectors": ("name", "sha256", "detect"),
    "generators": ("name", "source_type", "sha256", "generate"),
    "hair": ("name", "sha256", "layer", "mesh"),
    "exporters": ("name", "sha256", "suffix", "place", "export"),
}


def known(group: str) -> dict[str, EntryPoint]:
    """The plug-ins of a group, such as "generators", by name."""
    return {entry.name: entry for entry in entry_points(group=f"bakery.{group}")}


def loaded(group: str, name: str) -> Any:
    """What an entry point names, not called.

    Raises:
        UsageProblem: there is none of this name.
        ModelError: its package cannot be imported; who made it is named.
    """
    found, kind = known(group), group.removesuffix("s")
    if name not in found:
        raise no_such(f"no {kind}", name, sorted(found))
    try:
        return found[name].load()
    except (ImportError, AttributeError, SyntaxError) as error:
        package = _package(found[name])
        reason = " ".join(f"{type(error).__name__}: {error}".split())[:160]
        raise ModelError(
            f"{kind} '{name}' of {package} cannot be loaded ({reason}); mend or uninstall {package}"
        ) from None


@cache
def plug_in(group: str, name: str) -> Any:
    """A plug-in, made: what its entry point names, called.

    Raises:
        UsageProblem, ModelError: see `loaded`; or it lacks what its group asks for.
    """
    made = loaded(group, name)()
    lacks = [word for word in ASKED.get(group, ()) if not hasattr(made, word)]
    if lacks:
        raise ModelError(
            f"{group.removesuffix('s')} '{name}' of {_package(known(group)[name])} lacks "
            f"{', '.join(lacks)}: made for another version of bakery? See docs/plug-ins.md"
        )
    return made


def _package(entry: EntryPoint) -> str:
    return entry.dist.name if entry.dist else "an unknown package"


def maker_of(group: str, made: Any) -> Maker:
    """Which plug-in made something: its name, its package's version, the digest of its data."""
    entry = known(group).get(made.name)
    return Maker(
        made.name,
        entry.dist.version if entry and entry.dist else "",
        made.sha256,
        getattr(made, "source_type", ""),
    )
