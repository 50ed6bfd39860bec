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

    def run():
        made = subprocess.run(
            [sys.executable, "-m", "bakery.cli.avatars_makefile", photos, out, bakery, ""],
            capture_output=True, text=True, check=True,
        )  # fmt: skip
        (tmp_path / "avatars.mk").write_text(made.stdout)
        return subprocess.run(
            ["make", "--keep-going", "-f", tmp_path / "avatars.mk", "all"],
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
    assert sorted(p.name for p in out.iterdir()) == ["a.avatar", "c.avatar"]


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
