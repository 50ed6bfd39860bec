"""Nothing that only some systems have is needed: Windows and macOS can import and write too."""

import ast
import os
import subprocess
import sys
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parents[1] / "bakery"
# Modules and functions of Python that Windows lacks; macOS lacks the last row.
MISSING = "fcntl grp posix pty pwd resource termios tty syslog crypt readline".split()
FUNCTIONS = """
    O_NONBLOCK O_DIRECTORY O_NOFOLLOW O_CLOEXEC fork fchmod fchown chown geteuid getuid getgid mkfifo
    statvfs sysconf killpg setsid wait3 wait4 nice pread pwrite
    sched_getaffinity sched_setaffinity posix_fallocate posix_fadvise copy_file_range sendfile
""".split()

CODE = """
import builtins, importlib, os, pkgutil, sys, tempfile
from pathlib import Path
import filelock
import bakery

def load_all():
    names = [found.name for found in pkgutil.walk_packages(bakery.__path__, "bakery.")]
    for name in names:
        if name != "bakery.__main__":
            importlib.import_module(name)
    return names

assert len(load_all()) > 150  # and everything that others wrote, which is tested by them
for name in [name for name in sys.modules if name.split(".")[0] == "bakery"]:
    del sys.modules[name]
platform, missing, functions = sys.argv[1], sys.argv[2].split(), sys.argv[3].split()
known = {name: getattr(os, name) for name in functions if hasattr(os, name)}
for name in known:
    delattr(os, name)
plain = builtins.__import__

def without(name, globals=None, *rest, **named):
    asker = str((globals or {}).get("__name__", ""))
    if name.split(".")[0] in missing and asker.split(".")[0] == "bakery":
        raise ImportError(f"{asker} imports {name}")
    return plain(name, globals, *rest, **named)

builtins.__import__ = without
here, sys.platform = sys.platform, platform
load_all()

from bakery.formats import files, place, work
with tempfile.TemporaryDirectory() as folder:
    target = Path(folder, "a.avatar")
    files.write_bytes(Path(folder, "a"), b"data")
    assert files.read_bytes(Path(folder, "a")) == b"data"
    os.unlink(Path(folder, "a"))
    # What Python itself and filelock do on other systems is theirs to test.
    vars(os).update(known)
    sys.platform = here
    place.FileLock = filelock.SoftFileLock  # a lock that every system has
    place._exchange = lambda one, other: False
    for text in (b'{"files": []}', b'{"files": [], "is": "new"}'):
        with work.work_folder(target) as steps, place.staged(target, True) as new:
            steps.put("x", "key", text)
            files.write_bytes(new / "avatar.json", steps.get("x", "key"))
            with work.work_folder(target) as others:
                assert others.folder != steps.folder
    assert files.read_bytes(target / "avatar.json") == text
    assert os.listdir(folder) == ["a.avatar"]
print("good")
"""


@pytest.mark.parametrize("platform", ["win32", pytest.param("darwin", marks=pytest.mark.slow)])
def test_every_module_can_be_imported_and_bundles_be_replaced(platform):
    command = [sys.executable, "-c", CODE, platform, " ".join(MISSING), " ".join(FUNCTIONS)]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0 and done.stdout == "good\n", done.stderr


def test_no_module_imports_what_a_system_lacks():
    """Not inside functions either, where the test above does not come."""
    for path in PACKAGE.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom):
                names = [node.module or ""]
            elif isinstance(node, ast.Import):
                names = [alias.name for alias in node.names]
            else:
                continue
            assert not {name.split(".")[0] for name in names} & set(MISSING), path


SUM = """
import bakery.__main__, hashlib
import numpy as np
rows = np.random.default_rng(0).normal(size=(9000, 190)).astype(np.float32)
print(hashlib.sha256((rows.T @ rows).tobytes()).hexdigest())
"""


def test_sums_of_the_command_do_not_depend_on_the_number_of_threads():
    """The photometric fit makes such a sum; with two threads of OpenBLAS its last bits differed."""
    made = {
        subprocess.run(
            [sys.executable, "-c", SUM], env=os.environ | {"OMP_NUM_THREADS": count},
            capture_output=True, text=True, check=True,
        ).stdout
        for count in ("1", "2", "4")
    }  # fmt: skip
    assert len(made) == 1
