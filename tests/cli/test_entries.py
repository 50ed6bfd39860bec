"""Whether there may be plug-ins of a group, told without `importlib.metadata`."""

import shutil
import sys
import zipfile
from importlib.metadata import entry_points

import pytest
from click.testing import CliRunner

from bakery.cli.entries import may_have
from bakery.cli.group import help_width
from bakery.cli.main import bakery

GROUP = "bakery.commands"
FOUND = "[bakery.commands]\ngreet = a:b\n"
OTHER = "[console_scripts]\nbakery.commands = a:b\n"


@pytest.fixture
def site(tmp_path, monkeypatch):
    """A folder that is all there is on the path."""
    monkeypatch.setattr(sys, "path", [str(tmp_path)])
    return tmp_path


def put(folder, text):
    folder.mkdir(parents=True)
    (folder / "PKG-INFO").write_text("Metadata-Version: 2.1\nName: a\nVersion: 1\n")
    (folder / "METADATA").write_text("Metadata-Version: 2.1\nName: a\nVersion: 1\n")
    (folder / "entry_points.txt").write_text(text)


@pytest.mark.parametrize("text", [FOUND, OTHER])
@pytest.mark.parametrize("name", ["a-1.dist-info", "a.egg-info"])
def test_a_package_that_is_installed(site, name, text):
    """A wheel, also an editable one, or an old `setup.py develop`."""
    assert not may_have(GROUP)
    put(site / name, text)
    assert may_have(GROUP) is (text == FOUND) is bool(entry_points(group=GROUP))


def test_an_egg(site, monkeypatch):
    put(site / "a-1.egg" / "EGG-INFO", FOUND)
    assert not may_have(GROUP) and not entry_points(group=GROUP)
    monkeypatch.setattr(sys, "path", [str(site / "a-1.egg")])
    assert may_have(GROUP) and entry_points(group=GROUP)


def test_a_zip_is_left_to_importlib(site, monkeypatch):
    archive = site / "a-1.egg"
    with zipfile.ZipFile(archive, "w") as file:
        file.writestr("EGG-INFO/PKG-INFO", "Metadata-Version: 2.1\nName: a\nVersion: 1\n")
        file.writestr("EGG-INFO/entry_points.txt", FOUND)
    monkeypatch.setattr(sys, "path", [str(archive)])
    assert may_have(GROUP) and entry_points(group=GROUP)


def test_the_working_folder_and_folders_that_are_not_there(site, monkeypatch):
    put(site / "a-1.dist-info", FOUND)
    monkeypatch.setattr(sys, "path", [str(site / "none")])
    assert not may_have(GROUP)
    monkeypatch.chdir(site)
    monkeypatch.setattr(sys, "path", [""])
    assert may_have(GROUP)


@pytest.mark.parametrize("columns", ["", "20", "64", "79", "80", "200", "-3", "wide"])
def test_help_is_as_wide_as_click_makes_it(monkeypatch, columns):
    monkeypatch.setenv("COLUMNS", columns)
    assert help_width() == max(min(shutil.get_terminal_size().columns, 80) - 2, 50)
    assert "Commands:" in CliRunner().invoke(bakery, ["--help"]).output
