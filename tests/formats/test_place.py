"""Folders appear complete or not at all, whatever happens meanwhile."""

import contextlib
import errno
import json
import os
import shutil
import signal
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from bakery.errors import InputError
from bakery.formats import place
from bakery.formats.work import Work, key_of, work_folder

MAKE = """
import sys, time
from pathlib import Path
from bakery.formats.place import staged
with staged(Path(sys.argv[1]), True) as folder:
    (folder / "avatar.json").write_text('{"files": [{"path": "big"}], "is": "%s"}' % sys.argv[2])
    (folder / "big").write_text("x" * 1000)
    print("ready", flush=True)
    time.sleep(float(sys.argv[3]))
"""


def manifest(text, *files):
    return json.dumps({"files": [{"path": name} for name in files], "is": text})


def told(target):
    """The text that a bundle was made with."""
    return json.loads((target / "avatar.json").read_text())["is"]


def make(target, text="new", overwrite=False):
    with place.staged(target, overwrite) as folder:
        (folder / "avatar.json").write_text(manifest(text))
        (folder / "web").mkdir()


def test_a_bundle_appears_and_is_replaced(tmp_path):
    target = tmp_path / "a b\n.avatar"
    make(target, "old")
    assert told(target) == "old"
    with pytest.raises(InputError, match="--overwrite"):
        make(target)
    make(target, "new", overwrite=True)
    assert told(target) == "new"
    assert os.listdir(tmp_path) == [target.name]


def test_failure_leaves_the_old_one(tmp_path):
    target = tmp_path / "a.avatar"
    make(target, "old")
    with pytest.raises(ZeroDivisionError), place.staged(target, True) as folder:
        (folder / "avatar.json").write_text("half")
        raise ZeroDivisionError
    assert told(target) == "old"
    assert os.listdir(tmp_path) == ["a.avatar"]


def test_other_folders_are_left_alone(tmp_path):
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "letter.txt").write_text("dear")
    (tmp_path / "file").write_text("x")
    (tmp_path / "link").symlink_to(tmp_path / "mine")
    for name in ("mine", "file", "link"):
        with pytest.raises(InputError, match="another name"):
            make(tmp_path / name, overwrite=True)
    assert (tmp_path / "mine" / "letter.txt").exists()


def test_files_that_somebody_put_into_a_bundle_are_not_lost(tmp_path):
    target = tmp_path / "a.avatar"
    make(target, "old")
    (target / ".DS_Store").write_bytes(b"litter")
    make(target, "new", overwrite=True)
    (target / "web" / "notes.txt").write_text("mine")
    with pytest.raises(InputError, match=r"web/notes\.txt: is none of the bundle's files"):
        make(target, "newer", overwrite=True)
    assert (target / "web" / "notes.txt").read_text() == "mine" and told(target) == "new"
    (target / "web" / "notes.txt").unlink()
    (target / "avatar.json").write_text("{")
    with pytest.raises(InputError, match="does not say which files"):
        make(target, "newer", overwrite=True)


def start(target, text, seconds):
    process = subprocess.Popen(
        [sys.executable, "-c", MAKE, str(target), text, str(seconds)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    process.stdout.readline()
    return process


def test_kill_leaves_the_old_one_and_the_next_run_cleans_up(tmp_path):
    target = tmp_path / "a.avatar"
    make(target, "old")
    process = start(target, "killed", 60)
    process.send_signal(signal.SIGKILL)
    process.wait()
    assert len(os.listdir(tmp_path)) == 2 and told(target) == "old"
    make(target, "new", overwrite=True)
    assert os.listdir(tmp_path) == ["a.avatar"]


def test_what_is_cleared_or_brought_back_is_said(tmp_path, caplog):
    caplog.set_level("INFO")
    target = tmp_path / "a.avatar"
    make(target, "old")
    assert caplog.messages == []
    process = start(target, "killed", 60)
    process.kill()
    process.wait()
    (left,) = tmp_path.glob(".bakery-*")
    make(target, "new", overwrite=True)
    assert caplog.messages == [f"{target}: cleared away {left.name}, which a killed run left"]
    caplog.clear()
    left.mkdir()
    target.rename(left / place.OLD)
    place.check_place(tmp_path / "b.avatar", False)  # another bundle's is not touched
    assert left.exists() and caplog.messages == []
    place.clean(target)
    assert f"{target}: the old bundle is back in its place" in caplog.messages
    assert told(target) == "new"
    with pytest.raises(ZeroDivisionError), work_folder(target) as work:
        work.put("x", "key", b"data")
        raise ZeroDivisionError
    caplog.clear()
    with work_folder(target) as work:
        assert any("goes on from the steps" in line for line in caplog.messages)


def test_a_place_that_cannot_be_written_is_refused_before_the_bake(tmp_path, monkeypatch):
    (tmp_path / "file").touch()
    for target in (tmp_path / "file" / "a.avatar", tmp_path / "file" / "deep" / "a.avatar"):
        with pytest.raises(InputError, match="cannot be written .*; "):
            place.check_place(target, True)
    place.check_place(tmp_path / "new" / "deep" / "a.avatar", False)
    assert os.listdir(tmp_path) == ["file"]
    asked = []
    monkeypatch.setattr(os, "access", lambda path, mode: asked.append(path))
    with pytest.raises(InputError, match=f"{tmp_path} is no folder that you may write to"):
        place.check_place(tmp_path / "new" / "deep" / "a.avatar", False)
    assert asked == [tmp_path]


def test_two_at_once_give_one_whole_bundle(tmp_path):
    target = tmp_path / "a.avatar"
    both = [start(target, text, 0.3) for text in ("one", "two")]
    assert [process.wait() for process in both] == [0, 0]
    assert told(target) in ("one", "two")
    assert (target / "big").exists() and os.listdir(tmp_path) == ["a.avatar"]


def test_without_exchange_a_killed_swap_is_undone(tmp_path, monkeypatch):
    """Where the system cannot exchange folders, the old one is put back by the next run."""
    target = tmp_path / "a.avatar"
    make(target, "old")
    hidden = tmp_path / (place.prefix(target) + "xyz")
    hidden.mkdir()
    (hidden / "lock").touch()
    shutil.move(target, hidden / "old")
    place.clean(target)
    assert told(target) == "old"
    monkeypatch.setattr(place, "_exchange", lambda one, other: False)
    make(target, "new", overwrite=True)
    assert told(target) == "new" and os.listdir(tmp_path) == ["a.avatar"]


def test_read_only_place_is_one_line(tmp_path, monkeypatch):
    def refuse(*arguments, **options):
        raise OSError(30, "Read-only file system")

    monkeypatch.setattr(place.tempfile, "mkdtemp", refuse)
    with pytest.raises(InputError, match="Read-only file system.*another disk"):
        make(tmp_path / "a.avatar")


def test_work_entries_are_known_by_key_and_hash(tmp_path):
    with work_folder(tmp_path / "a.avatar") as work:
        calls = []

        def step(key):
            return work.step("x", key, lambda: calls.append(key) or b"data", bytes.decode)

        assert step("one") == step("one") == "data" and calls == ["one"]
        step("two")
        assert calls == ["one", "two"]
        (work.folder / "x").write_bytes(b"dama")
        step("two")
        (work.folder / "x.key").write_bytes(b"{")
        step("two")
        assert calls == ["one", "two", "two", "two"]
        with work_folder(tmp_path / "a.avatar") as other:  # at once: not shared
            assert other.folder != work.folder
    assert os.listdir(tmp_path) == []


@pytest.mark.parametrize("overwrite", [True, False])
def test_a_place_that_is_taken_in_between(tmp_path, monkeypatch, overwrite):
    """Two first runs of one bundle end together: the later one replaces the other only if it may."""
    target, rename = tmp_path / "a.avatar", os.rename

    def late(source, goal):
        if Path(goal) == target and not target.exists():
            target.mkdir()
            (target / "avatar.json").write_text(manifest("other", "big"))
            (target / "big").write_text("other")
        rename(source, goal)

    monkeypatch.setattr(os, "rename", late)
    taken = pytest.raises(InputError, match="appeared while this was made")
    with (
        contextlib.nullcontext() if overwrite else taken,
        place.staged(target, overwrite) as folder,
    ):
        (folder / "avatar.json").write_text(manifest("mine", "big"))
        (folder / "big").write_text("mine")
    assert told(target) == (target / "big").read_text() == ("mine" if overwrite else "other")
    assert os.listdir(tmp_path) == [target.name]


def test_many_at_once_leave_nothing_behind(tmp_path):
    """Locks that are taken while others clear away: nobody loses a folder that is in use."""
    target = tmp_path / "a.avatar"

    def bake(number):
        with work_folder(target) as work:
            for step in range(5):
                work.put(f"{number}-{step}", "key", b"data")
                assert work.get(f"{number}-{step}", "key") == b"data"
            with place.staged(target, True) as folder:
                (folder / "avatar.json").write_text(manifest(str(number), "big"))
                (folder / "big").write_text(str(number))
        return number

    with ThreadPoolExecutor(8) as pool:
        assert list(pool.map(bake, range(60))) == list(range(60))
    assert told(target) == (target / "big").read_text()
    assert os.listdir(tmp_path) == [target.name]


def test_work_stays_after_a_failure_or_where_asked(tmp_path):
    with pytest.raises(ZeroDivisionError), work_folder(tmp_path / "a.avatar") as work:
        work.put("x", "key", b"data")
        raise ZeroDivisionError
    with work_folder(tmp_path / "a.avatar") as work:
        assert work.get("x", "key") == b"data"
    with pytest.raises(InputError), work_folder(tmp_path / "b.avatar") as work:
        work.put("x", "key", b"data")
        raise InputError("no face")
    assert not list(tmp_path.glob(".bakery*"))
    with work_folder(tmp_path / "a.avatar", tmp_path / "kept") as work:
        work.put("x", "key", b"data")
    assert Work(tmp_path / "kept").get("x", "key") == b"data"
    (tmp_path / "file").touch()
    with (
        pytest.raises(InputError, match="no folder"),
        work_folder(tmp_path / "b", tmp_path / "file"),
    ):
        pass


def test_keys_differ():
    assert key_of(1, {"a": 2}) == key_of(1, {"a": 2}) != key_of(1, {"a": 3})


def test_a_hidden_folder_that_stays_is_told(tmp_path, monkeypatch, caplog):
    monkeypatch.setattr(
        place.shutil, "rmtree", lambda *_, **__: None
    )  # as if it could not be opened
    with place.locked_folder(tmp_path / "a.avatar") as hidden:
        (hidden / "bundle").mkdir()
    assert hidden.exists() and caplog.messages == [f"{hidden}: cannot be removed; remove it"]


def test_a_disk_without_room_for_a_lock_keeps_no_folder(tmp_path, monkeypatch):
    def full(lock, blocking):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(place.FileLock, "acquire", full)
    with pytest.raises(InputError, match="a.avatar: cannot be written"):
        make(tmp_path / "a.avatar")
    assert os.listdir(tmp_path) == []
