"""What is installed for bakery, under which licences, and pinned by which hashes."""

import json
import re
import tomllib
from importlib import metadata
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from bakery.bake.licences import licences

ROOT = Path(__file__).resolve().parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]


def test_every_package_that_bakery_needs_is_listed_with_its_licence():
    found = {canonicalize_name(each.package): each for each in licences()}
    assert next(iter(found)) == "bakery" and found["bakery"].licence == "Apache-2.0"
    for line in PROJECT["dependencies"]:
        name = canonicalize_name(Requirement(line).name)
        assert found[name].asked_by == "bakery" and found[name].version == metadata.version(name)
    assert "Apache-2.0" in found["torch"].licence and "BSD" in found["scipy"].licence
    assert found["sympy"].asked_by == "torch"  # what those need is there as well


def test_what_only_developers_need_is_not():
    assert not {"pytest", "hypothesis", "ruff"} & {each.package for each in licences()}


def test_no_licence_of_what_users_need_is_the_gpl():
    """The LGPL of libheif and libde265, in the extra heic, is no GPL; they are linked to, and can be changed."""
    for each in licences():
        said = each.licence.replace("GNU Lesser General Public License", "LGPL")
        assert not re.search(r"(?<!L)GPL|GNU General", said.replace("LGPLv3", "LGPL")), each


def test_an_unknown_package_is_told():
    with pytest.raises(metadata.PackageNotFoundError):
        licences("no-such-package")


def test_the_command_lists_them(bakery):
    done = bakery("doctor", "--licences")
    assert done.returncode == 0 and re.search(r"^torch +\S+ +Apache-2.0", done.stdout, re.M)
    done = bakery("doctor", "--licences", "--json")
    assert {"package", "version", "licence", "asked_by"} == set(json.loads(done.stdout)[0])


def test_the_lock_pins_every_dependency_with_hashes():
    text = (ROOT / "docs" / "requirements.lock").read_text("utf-8")
    pinned = {}
    for block in re.split(r"\n(?=\S)", text):
        name, version = re.match(r"([A-Za-z0-9._-]+)==(\S+)", block).groups()
        pinned.setdefault(canonicalize_name(name), []).append(version)
        assert re.search(r"--hash=sha256:[0-9a-f]{64}", block), name
    assert "://" not in text  # no host of ours
    for line in PROJECT["dependencies"]:
        wanted = Requirement(line)
        versions = pinned[canonicalize_name(wanted.name)]
        assert all(wanted.specifier.contains(version) for version in versions), line
