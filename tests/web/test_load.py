"""What the module for embedding asks a server for, and what it does with a gaze that no eye has."""

import json
import shutil

import pytest


@pytest.fixture(scope="module")
def told(site, browser, serve, tmp_path_factory):
    """What load.mjs saw: avatars with and without the bundle's own list of files."""
    folder = tmp_path_factory.mktemp("addresses")
    shutil.copytree(site.folder, folder, dirs_exist_ok=True)
    for name in ("whole.avatar", "web-only.avatar", "whole", "web-only"):
        shutil.copytree(site.folder / "web", folder / name / "web")
        if name.startswith("whole"):
            (folder / name / "avatar.json").write_text(json.dumps({"files": []}))
    shutil.copytree(site.folder / "web", folder / "anna")
    (folder / "list-only").mkdir()
    (folder / "list-only" / "avatar.json").write_text(json.dumps({"files": []}))
    names = [path.name for path in folder.iterdir() if path.is_dir()]
    addresses = [f"/{name}/" for name in names] + ["/web-only.avatar", "/whole.avatar/web/", "/no/"]
    (folder / "addresses.json").write_text(json.dumps(addresses))
    return json.loads(browser("load.mjs", serve(folder), folder / "addresses.json"))


@pytest.mark.parametrize(
    "address",
    "/whole.avatar/ /whole.avatar/web/ /web-only.avatar/ /web-only.avatar /web/ /anna/ /whole/".split(),
)
def test_nothing_is_asked_for_in_vain(told, address):
    assert told["loaded"][address] == {"loaded": 52, "missed": []}


def test_other_names_are_found_at_the_second_try(told):
    found = told["loaded"]["/web-only/"]
    assert found == {"loaded": 52, "missed": ["/web-only/avatar.json"]}


def test_what_is_not_there_is_told(told):
    assert told["loaded"]["/no/"]["loaded"].startswith("true avatar.json: 404")
    assert told["loaded"]["/list-only/"]["loaded"].startswith("true web/avatar.json: 404")


def test_eyes_turn_as_far_as_eyes_do(told):
    assert told["gaze"] == [[35, 0], [-35, -30], [20, 10]]
