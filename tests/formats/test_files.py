"""Files appear complete or not at all, with the mode that the umask leaves, under any name."""

import errno
import os
import stat
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from bakery.errors import InputError
from bakery.formats import files, place, video
from bakery.formats.files import DiskError, write_bytes
from bakery.formats.work import Work
from bakery.heads.file import save_arrays

needs_modes = pytest.mark.skipif(os.name == "nt", reason="Windows has no modes")


def mode(path):
    return stat.S_IMODE(path.stat().st_mode)


def save_file(path):
    write_bytes(path, b"data")


def save_head_arrays(path):
    save_arrays(path, {"a": np.arange(3)})


def save_video(path):
    with tempfile.TemporaryDirectory() as folder:
        part = Path(folder) / "part.mp4"
        part.write_bytes(video.encode([np.zeros((16, 16, 3), np.uint8)] * 2, ".mp4", 25.0))
        video.join(path, [part], ".mp4", 25.0, (16, 16), video.Note("test", "none"))


WRITERS = [save_file, save_head_arrays, save_video]


@needs_modes
@pytest.mark.parametrize("umask", [0o077, 0o027, 0o002], ids=oct)
def test_the_umask_is_left_alone_and_rules_every_mode(tmp_path, monkeypatch, umask):
    """Setting it to ask for it gave what other threads wrote meanwhile to everybody."""
    before = os.umask(umask)
    try:
        with monkeypatch.context() as patch:
            patch.delattr(os, "umask")  # nobody asks for it or sets it
            with place.staged(tmp_path / "a.avatar", False) as folder:
                save_file(folder / "avatar.json")
                with ThreadPoolExecutor(8) as pool:
                    list(pool.map(save_file, [folder / f"web{n % 4}" / f"{n}" for n in range(200)]))
            for number, save in enumerate(WRITERS):
                save(tmp_path / f"{number}.npz")
    finally:
        assert os.umask(before) == umask
    written = list(tmp_path.rglob("*"))
    assert len(written) == 1 + 1 + 4 + 200 + len(WRITERS)
    for path in written:
        assert mode(path) == (0o777 if path.is_dir() else 0o666) & ~umask, path


@pytest.mark.parametrize("save", WRITERS)
@pytest.mark.parametrize("size", [250, 255])
def test_long_names_are_written(tmp_path, save, size):
    """The names of what is written aside do not grow with the target's."""
    path = tmp_path / ("n" * (size - 4) + ".npz")
    save(path)
    assert os.listdir(tmp_path) == [path.name]
    if save is save_file:
        with place.staged(tmp_path / ("b" * size), False) as folder:
            save(folder / "avatar.json")
        assert len(os.listdir(tmp_path)) == 2


@pytest.mark.parametrize("save", WRITERS)
@pytest.mark.parametrize("name", ["n" * 256, "n" * 300, "ф" * 130, "deep/" * 900 + "n"])
def test_names_that_are_too_long_are_one_line(tmp_path, save, name):
    with pytest.raises(DiskError, match="give a shorter name"):
        save(tmp_path / name)
    with pytest.raises(DiskError, match="give a shorter name"):
        place.check_place(tmp_path / name, False)
    assert os.listdir(tmp_path) == []


@pytest.mark.parametrize("nameless", [True, False])
@pytest.mark.parametrize("save", WRITERS)
def test_what_fails_leaves_the_old_file_and_nothing_else(tmp_path, monkeypatch, save, nameless):
    if not nameless:
        monkeypatch.delattr(os, "O_TMPFILE", raising=False)
    path = tmp_path / "a.npz"
    path.write_bytes(b"old")
    for error in (OSError(errno.ENOSPC, "No space left on device"), KeyboardInterrupt()):

        def fail(*_, error=error):
            raise error

        for call in ("fsync", "replace"):
            with monkeypatch.context() as patch:
                patch.setattr(os, call, fail)
                with pytest.raises((DiskError, KeyboardInterrupt)) as caught:
                    save(path)
            if isinstance(error, OSError):
                assert str(caught.value).startswith(f"{path}: cannot be written (No space left")
            assert path.read_bytes() == b"old" and os.listdir(tmp_path) == [path.name]


@pytest.fixture
def calls(monkeypatch):
    """What is brought onto the disk and what is renamed, in order: ("sync" or "rename", name)."""
    noted = []

    def synced(path, inner=files.sync_path):
        noted.append(("sync", os.path.basename(path)))
        inner(path)

    def renamed(one, other, inner):
        noted.append(("rename", os.path.basename(other)))
        return inner(one, other)

    def fsynced(handle, inner=os.fsync):
        noted.append(("fsync", os.fstat(handle).st_ino))
        inner(handle)

    monkeypatch.setattr(files, "sync_path", synced)
    monkeypatch.setattr(place, "sync_path", synced)
    monkeypatch.setattr(os, "fsync", fsynced)
    for module, name in ((os, "replace"), (os, "rename"), (place, "_exchange")):
        inner = getattr(module, name)
        monkeypatch.setattr(module, name, lambda a, b, inner=inner: renamed(a, b, inner))
    return noted


@pytest.mark.parametrize("save", WRITERS)
def test_a_file_is_on_the_disk_before_it_has_its_name(tmp_path, calls, save):
    path = tmp_path / "a.npz"
    save(path)
    assert calls == [("fsync", path.stat().st_ino), ("rename", path.name)]


@pytest.mark.parametrize("exchange", [True, False])
def test_a_bundle_is_on_the_disk_before_it_has_its_place(tmp_path, calls, monkeypatch, exchange):
    if not exchange:
        monkeypatch.setattr(place, "_exchange", lambda one, other: False)
    for _ in range(2):
        calls.clear()
        with place.staged(tmp_path / "a.avatar", True) as folder:
            (folder / "web").mkdir()
            (folder / "avatar.json").write_text('{"files": [{"path": "web/page"}]}')
            (folder / "web" / "page").write_text("x")
        order = [call for call in calls if call[0] != "fsync"]
        swap = next(n for n, call in enumerate(order) if call[0] == "rename")
        assert {name for _, name in order[:swap]} == {"avatar.json", "page", "web", "bundle"}
        put = order.index(("rename", "a.avatar"))
        removed = [n for n, call in enumerate(order) if call == ("rename", "rest")]
        assert put < order.index(("sync", tmp_path.name)) < min(removed, default=len(order))


def test_what_can_be_made_again_is_not_waited_for(tmp_path, calls):
    Work(tmp_path).put("x", "key", b"data")
    assert [kind for kind, _ in calls] == ["rename", "rename"]


def test_a_device_or_folder_is_not_replaced(tmp_path):
    (tmp_path / "folder").mkdir()
    odd = [tmp_path / "folder"]
    if hasattr(os, "mkfifo"):
        os.mkfifo(tmp_path / "pipe")
        odd.append(tmp_path / "pipe")
    for path in odd:
        with pytest.raises(InputError, match="is no file; give another name"):
            write_bytes(path, b"data")
        assert not path.is_file() and path.exists()


@pytest.mark.skipif(sys.platform != "linux", reason="needs a disk that is always full")
def test_a_full_disk_says_what_could_not_be_written():
    with open("/dev/full", "wb") as full:
        done = subprocess.run(
            [sys.executable, "-m", "bakery", "--help"],
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
        )
    assert done.returncode == 1 and len(done.stderr.splitlines()) == 1, done.stderr
    assert "standard output" in done.stderr and "free some space" in done.stderr


nameless = pytest.mark.skipif(not hasattr(os, "O_TMPFILE"), reason="needs files without a name")


@nameless
def test_what_is_not_complete_has_no_name(tmp_path):
    with files.replacing(tmp_path / "a") as file:
        file.write(b"data")
        file.flush()
        assert os.listdir(tmp_path) == []
    assert (tmp_path / "a").read_bytes() == b"data"


@nameless
def test_a_system_that_gives_no_name_later_gets_a_copy(tmp_path, monkeypatch):
    def refused(*_, **__):
        raise PermissionError(errno.EPERM, "Operation not permitted")

    for number, save in enumerate(WRITERS):
        save(tmp_path / f"{number}-linked.npz")
    monkeypatch.setattr(os, "link", refused)
    for number, save in enumerate(WRITERS):
        save(tmp_path / f"{number}-copied.npz")
    assert len(os.listdir(tmp_path)) == 2 * len(WRITERS)
    for linked in tmp_path.glob("*-linked.npz"):
        copied = linked.with_name(linked.name.replace("linked", "copied"))
        assert copied.read_bytes() == linked.read_bytes() and mode(copied) == mode(linked)


KILLED = """
import os, signal, sys
from bakery.formats.{module} import {function}
with {function}({arguments}) as made:
    assert made
    os.kill(os.getpid(), signal.SIGKILL)
"""


def killed(folder, **what):
    """A process that is killed while it writes."""
    code = KILLED.format(**what)
    env = os.environ | {"TMPDIR": str(folder)}
    done = subprocess.run([sys.executable, "-c", code], cwd=folder, env=env, capture_output=True)
    assert done.returncode == -9, done.stderr


@nameless
def test_a_killed_run_leaves_no_half_file(tmp_path):
    killed(tmp_path, module="files", function="replacing", arguments="'a'")
    assert os.listdir(tmp_path) == []


@nameless
def test_a_name_left_by_a_killed_run_goes_with_the_next_file(tmp_path, monkeypatch):
    """Killed between the two names: the campaign had it once in 1,204 kills."""

    class Killed(BaseException):
        pass

    def killed(*_):
        raise Killed

    with monkeypatch.context() as patch:
        patch.setattr(os, "replace", killed)
        patch.setattr(os, "unlink", killed)
        with pytest.raises(Killed):
            write_bytes(tmp_path / "a", b"first")
    assert len(os.listdir(tmp_path)) == 1
    write_bytes(tmp_path / "a", b"second")
    assert os.listdir(tmp_path) == ["a"] and (tmp_path / "a").read_bytes() == b"second"


@nameless
def test_a_file_that_another_run_put_into_its_place_leaves_no_second_name(tmp_path):
    """Of many writers: one renames the other's file, which then finds its own there."""
    path = tmp_path / "a"
    with open(files._nameless(tmp_path), "w+b") as file:
        file.write(b"mine")
        file.flush()
        handle = file.fileno()
        os.link(files.OPEN_FILES.format(handle), path, src_dir_fd=handle)
        assert files._placed(file, path)
    assert os.listdir(tmp_path) == ["a"] and path.read_bytes() == b"mine"


@nameless
def test_many_writers_of_one_file_leave_one_of_theirs(tmp_path):
    texts = [str(number).encode() * 1000 for number in range(300)]
    with ThreadPoolExecutor(8) as pool:
        list(pool.map(lambda text: write_bytes(tmp_path / "a", text, sync=False), texts))
    assert os.listdir(tmp_path) == ["a"] and (tmp_path / "a").read_bytes() in texts


@pytest.mark.skipif(os.name == "nt", reason="sends SIGKILL")
def test_the_next_run_clears_away_the_scratch_of_a_killed_one(tmp_path, monkeypatch):
    killed(tmp_path, module="place", function="scratch", arguments="")
    left = os.listdir(tmp_path)
    assert len(left) == 1
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    with place.scratch() as mine:
        assert os.listdir(tmp_path) == [mine.name] != left
        with place.scratch() as other:  # that of a run that lives stays
            assert sorted(os.listdir(tmp_path)) == sorted([mine.name, other.name])
    assert os.listdir(tmp_path) == []
