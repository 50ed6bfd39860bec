"""The built page is what its sources say, and its sources fit their types."""

import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
VIEWER = ROOT / "bakery" / "runtime" / "viewer"
ASSETS = ROOT / "bakery" / "assets" / "viewer"


def test_built_files_are_current(node, tmp_path):
    """`make viewer` gives these bytes."""
    node(VIEWER / "build.mjs", tmp_path)
    built = sorted(path.name for path in tmp_path.iterdir())
    assert built == sorted(path.name for path in ASSETS.iterdir())
    for name in built:
        assert (tmp_path / name).read_bytes() == (ASSETS / name).read_bytes(), (
            f"{name}: make viewer"
        )


def test_types(node):
    compiler = VIEWER / "node_modules" / ".bin" / "tsc"
    if not compiler.exists():
        pytest.skip("needs `npm ci` in bakery/runtime/viewer")
    done = subprocess.run(
        [shutil.which("node"), str(compiler.resolve()), "--noEmit", "-p", "tsconfig.json"],
        cwd=VIEWER, capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout


def test_sources_are_short():
    for path in [*VIEWER.glob("src/**/*.js"), *VIEWER.glob("*.mjs")]:
        assert len(path.read_text(encoding="utf-8").splitlines()) <= 400, path.name
