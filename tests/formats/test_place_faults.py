"""Whatever fails while a bundle is replaced: its place holds the whole old one or the whole new one."""

import contextlib
import errno
import json
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from bakery.errors import InputError
from bakery.formats import place

FILES = ("big", "web/page")  # of a bundle, besides its manifest
CALLS = ("rename", "rmdir", "unlink", "fsync", "open", "scandir")  # of `os`; where faults come


@pytest.fixture(autouse=True)
def quick(monkeypatch):
    """What these tests ask about is the order of the calls, not the disk."""
    monkeypatch.setattr(os, "fsync", lambda handle: None)


class Fault:
    """Strikes at the n-th call that touches the disk, before or after the call does its work."""

    def __init__(self, patch, strike, number, after=False):
        self.strike, self.left, self.after = strike, number, after
        for name in CALLS:
            patch.setattr(os, name, self.wrapped(getattr(os, name)))
        patch.setattr(place, "_exchange", self.wrapped(place._exchange))

    def wrapped(self, call):
        def act(*given, **named):
            self.left -= 1
            mine = self.left == 0
            if mine and not self.after:
                self.strike()
            result = call(*given, **named)
            if mine and self.after:
                self.strike()
            return result

        return act


def fill(folder, text):
    (folder / "web").mkdir()
    for name in FILES:
        (folder / name).write_text(text)
    table = {"files": [{"path": name} for name in FILES], "is": text}
    (folder / "avatar.json").write_text(json.dumps(table))


def write(target, text):
    with place.staged(target, True) as folder:
        fill(folder, text)


def no_exchange(patch):
    patch.setattr(place, "_exchange", lambda one, other: False)


def whole(target):
    """The text of a bundle in which nothing is missing."""
    held = {path.relative_to(target).as_posix() for path in target.rglob("*")}
    assert held == {"avatar.json", "web", *FILES}
    text = json.loads((target / "avatar.json").read_text())["is"]
    assert {(target / name).read_text() for name in FILES} == {text}
    return text


def check_after(target):
    """Whole, now or once the next run began; and nothing is left over when one went well."""
    if not target.exists():
        place.clean(target)
    found = whole(target)
    assert found in ("old", "new")
    write(target, "next")
    assert whole(target) == "next"
    place.clean(target)
    assert os.listdir(target.parent) == [target.name]
    return found


def test_a_folder_that_a_kill_left_before_its_lock_is_cleared_away_at_once(tmp_path):
    """Found by the campaign, after some 2,000 kills."""
    (tmp_path / f"{place.prefix(tmp_path / 'a.avatar')}x").mkdir()
    place.clean(tmp_path / "a.avatar")
    assert os.listdir(tmp_path) == []


def test_who_makes_a_folder_while_others_clear_away_gets_one_that_stays(tmp_path):
    """Folders without a lock are anybody's: their maker makes another one then."""
    target = tmp_path / "a.avatar"
    code = (
        "import sys, time\nfrom pathlib import Path\nfrom bakery.formats import place\n"
        "end = time.monotonic() + 4\n"
        "while time.monotonic() < end:\n    place.clean(Path(sys.argv[1]))\n"
    )
    cleaners = [subprocess.Popen([sys.executable, "-c", code, target]) for _ in range(2)]
    made, end = 0, time.monotonic() + 3
    while time.monotonic() < end:
        with place.locked_folder(target) as folder:
            (folder / "mine").write_text("kept")
            time.sleep(0.001)
            assert (folder / "mine").read_text() == "kept"
        made += 1
    assert [cleaner.wait() for cleaner in cleaners] == [0, 0] and made > 50
    place.clean(target)
    assert os.listdir(tmp_path) == []


@pytest.mark.parametrize("after", [False, True], ids=["before", "after"])
@pytest.mark.parametrize("exchange", [True, False], ids=["exchange", "renames"])
@pytest.mark.parametrize("error", [OSError(errno.EIO, "broken"), KeyboardInterrupt()], ids=repr)
def test_every_fault_leaves_a_whole_bundle(tmp_path, error, exchange, after):
    target = tmp_path / "a.avatar"

    def strike():
        raise error

    found, number, fault = set(), 0, None
    while fault is None or fault.left <= 0:  # else there was no such call any more
        number += 1
        write(target, "old")
        with pytest.MonkeyPatch.context() as patch:
            if not exchange:
                no_exchange(patch)
            with contextlib.suppress(InputError, KeyboardInterrupt):
                with place.staged(target, True) as folder:
                    fill(folder, "new")
                    fault = Fault(patch, strike, number, after)
        found.add(check_after(target))
    assert number > 10 and found == {"old", "new"}


def test_both_renames_fail_and_the_next_run_gives_the_old_one_back(tmp_path, monkeypatch):
    """The one case in which nothing stands in the place: the way back fails too."""
    target = tmp_path / "a.avatar"
    write(target, "old")
    rename = os.rename

    def only_away(source, to):
        if os.path.basename(to) == target.name:
            raise OSError(errno.EACCES, "refused")
        rename(source, to)

    with monkeypatch.context() as patch:
        no_exchange(patch)
        patch.setattr(os, "rename", only_away)
        with pytest.raises(InputError, match="cannot be written"):
            write(target, "new")
        assert not target.exists()
    with pytest.raises(InputError, match="--overwrite"):  # it is back before it is looked for
        place.check_place(target, overwrite=False)
    assert check_after(target) == "old"


KILL = """
import os, sys
from pathlib import Path
import pytest
sys.path.insert(0, sys.argv[2])
from test_place_faults import Fault, check_after, fill, no_exchange, place, write

os.fsync = lambda handle: None
target, patch, found = Path(sys.argv[1]), pytest.MonkeyPatch(), set()
for exchange in (True, False):
    number, code = 0, 9
    while code:
        number += 1
        write(target, "old")
        child = os.fork()
        if not child:
            if not exchange:
                no_exchange(patch)
            with place.staged(target, True) as folder:
                fill(folder, "new")
                Fault(patch, lambda: os._exit(9), number)
            os._exit(0)
        code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
        assert code in (0, 9)
        found.add(check_after(target))
    assert number > 10
assert found == {"old", "new"}
print("whole")
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="kills a copy of the process at each call")
def test_every_kill_leaves_a_whole_bundle(tmp_path):
    command = [sys.executable, "-c", KILL, str(tmp_path / "a.avatar"), str(Path(__file__).parent)]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.stdout == "whole\n", done.stderr
