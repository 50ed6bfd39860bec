"""`bakery doctor --warm`: the first bake compiles nothing any more."""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

SAMPLE = Path(__file__).resolve().parents[2] / "samples" / "fumiko.jpg"


@pytest.mark.slow
def test_it_says_that_all_is_ready_and_leaves_nothing(bakery, tmp_path, monkeypatch):
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr(tempfile, "tempdir", None)  # read the variable again
    done = bakery("doctor", "--warm", cwd=tmp_path)
    assert done.returncode == 0 and done.stdout == ""
    assert done.stderr.startswith("ready: ") and len(done.stderr.splitlines()) == 1
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_a_bake_after_it_compiles_nothing(tmp_path):
    """Of another portrait, with its own warnings, at the default size: a minute and a half."""
    kept = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / "numba")}

    def compiled(*words):
        line = [sys.executable, "-m", "bakery", *words]
        subprocess.run(line, env=kept, check=True, capture_output=True, timeout=600)
        return {path.name for path in (tmp_path / "numba").rglob("*.nbc")}

    ready = compiled("doctor", "--warm")
    assert len(ready) > 30
    assert compiled("build", str(SAMPLE), "-o", str(tmp_path / "a.avatar")) == ready
