"""The makefile that `make avatars` runs: odd names, one bad photo, what is fresh is skipped."""

import os
import subprocess
import sys

import pytest

BAKERY = """#!/bin/sh
# A stand-in for `bakery build FLAGS --overwrite -o BUNDLE -- PHOTO`: fails on photos named bad*.
while [ "$1" != "-o" ]; do shift; done
case "$4" in */bad*) echo "$4: cannot be used" >&2; exit 1;; esac
mkdir -p "$2" && cp "$4" "$2/avatar.json"
"""


@pytest.fixture
def bake(tmp_path):
    photos, out, bakery = tmp_path / "my photos", tmp_path / "out", tmp_path / "bakery"
    photos.mkdir()
    out.mkdir()
    bakery.write_text(BAKERY)
    bakery.chmod(0o755)

    def run(flags=""):
        made = subprocess.run(
            [sys.executable, "-m", "bakery.cli.avatars_makefile", photos, out, bakery, flags],
            capture_output=True, text=True,
        )  # fmt: skip
        if made.returncode:
            return made
        return subprocess.run(
            ["make", "--keep-going", "-f", out / ".avatars.mk", "all"],
            capture_output=True, text=True,
        )  # fmt: skip

    return photos, out, run


def test_odd_names_bake(bake):
    photos, out, run = bake
    names = ["plain.jpg", "two words.png", "cost$5.jpg", "#1 50%.jpeg", "zoë's.jpg", "-dash.jpg"]
    for name in names:
        (photos / name).write_text(name)
    assert run().returncode == 0
    for name in names:
        stem = name.rsplit(".", 1)[0]
        assert (out / f"{stem}.avatar" / "avatar.json").read_text() == name


def test_one_bad_photo_stops_only_its_own_target(bake):
    photos, out, run = bake
    for name in ("a.jpg", "bad.jpg", "c.jpg"):
        (photos / name).write_text(name)
    result = run()
    assert result.returncode != 0 and "cannot be used" in result.stderr
    assert sorted(p.name for p in out.glob("*.avatar")) == ["a.avatar", "c.avatar"]


def test_fresh_bundles_are_skipped_and_changed_photos_baked(bake):
    photos, out, run = bake
    for name in ("a.jpg", "b.jpg"):
        (photos / name).write_text("old")
    run()
    manifest = out / "a.avatar" / "avatar.json"
    before = manifest.stat().st_mtime_ns
    assert run().returncode == 0 and manifest.stat().st_mtime_ns == before
    (photos / "b.jpg").write_text("new")
    later = before / 1e9 + 10
    os.utime(photos / "b.jpg", (later, later))
    run()
    assert (out / "b.avatar" / "avatar.json").read_text() == "new"
    assert manifest.stat().st_mtime_ns == before


def test_other_flags_bake_again(bake):
    photos, out, run = bake
    (photos / "a.jpg").write_text("a")
    manifest = out / "a.avatar" / "avatar.json"
    times = []
    for flags in ("", "", "--preset small", " --preset small ", ""):
        assert run(flags).returncode == 0
        times.append(manifest.stat().st_mtime_ns)
    assert [later > sooner for sooner, later in zip(times, times[1:])] == [False, True, False, True]


def test_flags_reach_the_command_with_their_quotes(bake, tmp_path):
    photos, _, run = bake
    (photos / "a.jpg").write_text("a")
    log = tmp_path / "log"
    (tmp_path / "bakery").write_text(f"#!/bin/sh\nprintf '%s\\n' \"$@\" > '{log}'\n{BAKERY}")
    assert run("--set 'texture.views=[0.0, 40.0]'").returncode == 0
    assert log.read_text().splitlines()[:3] == ["build", "--set", "texture.views=[0.0, 40.0]"]


def test_nothing_to_bake_is_an_error(bake):
    photos, out, run = bake
    (photos / ".hidden.jpg").write_text("h")
    (photos / "notes.txt").write_text("n")
    result = run()
    assert result.returncode == 1 and "holds no portrait" in result.stderr
    assert len(result.stderr.splitlines()) == 1 and list(out.iterdir()) == []


def test_hidden_files_are_left_out(bake):
    photos, out, run = bake
    for name in (".hidden.jpg", "._a.jpg", "a.jpg"):
        (photos / name).write_text(name)
    assert run().returncode == 0
    assert [p.name for p in out.glob("*.avatar")] == ["a.avatar"]
    assert not (out / ".hidden.avatar").exists()
