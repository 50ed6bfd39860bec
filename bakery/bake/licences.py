"""The licences of bakery and of all that it needs, as the installed packages state them."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from importlib import metadata

# What a requirement begins with, and how it names an extra (PEP 508).
NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]*")
EXTRA = re.compile(r"""extra\s*==\s*["']([^"']+)["']""")
OF_DEVELOPERS = ("dev", "docs")  # extras that no user needs


@dataclass(frozen=True)
class Licence:
    """What one installed package says of itself."""

    package: str
    version: str
    licence: str
    asked_by: str  # the package that needs it; "" for the first


def licences(package: str = "bakery") -> list[Licence]:
    """Those of a package and of everything installed that it needs, its users' extras included, by name.

    Raises:
        PackageNotFoundError: the package is not installed.
    """
    found: dict[str, Licence] = {}
    waiting = [(package, "")]
    while waiting:
        name, by = waiting.pop(0)
        key = re.sub(r"[-_.]+", "-", name).lower()
        if key in found:
            continue
        try:
            about = metadata.distribution(name)
        except metadata.PackageNotFoundError:
            if not by:
                raise
            continue  # of an extra, or of another system
        own = str(about.metadata["Name"])
        found[key] = Licence(own, about.version, _licence(about), by)
        waiting += [(each, own) for each in _needs(about, extras=not by)]
    return sorted(found.values(), key=lambda each: (each.asked_by != "", each.package.lower()))


def _needs(about: metadata.Distribution, extras: bool) -> Iterator[str]:
    """Names of what a package requires, or may be asked to by extras for its users."""
    for line in about.requires or ():
        begin, extra = NAME.match(line), EXTRA.search(line)
        wanted = extra is None or (extras and extra.group(1) not in OF_DEVELOPERS)
        if begin and wanted:
            yield begin.group()


def _licence(about: metadata.Distribution) -> str:
    """An SPDX expression if there is one, else what the older fields say."""
    fields = about.metadata
    if "License-Expression" in fields:
        return str(fields["License-Expression"])
    told = [
        line.split(" :: ")[-1]
        for line in fields.get_all("Classifier") or ()
        if line.startswith("License :: ") and line != "License :: OSI Approved"
    ]
    if told:
        return ", ".join(told)
    text = str(fields["License"]).strip() if "License" in fields else ""
    return text.splitlines()[0][:60] if text else "not stated"
