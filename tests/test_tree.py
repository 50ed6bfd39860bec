"""What git keeps: the top level as it was fixed, and pictures and arrays only where they belong.

A stray picture or array at the top level could be made from somebody's photograph.
"""

import re
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
TOP = {
    ".ci", ".gitignore", "CHANGELOG.md", "LICENSE", "Makefile", "README.md", "bakery", "docs",
    "presets", "pyproject.toml", "samples", "tests",
}  # fmt: skip
BINARY = re.compile(
    r"\.(png|jpe?g|webp|gif|avif|heic|exr|tiff?|hdr|npy|npz|pkl|pt|pth|safetensors|glb|gltf|obj|ply|mp4|webm|zip)$",
    re.IGNORECASE,
)
KEPT = (
    r"bakery/assets/.+\.(npz|safetensors)",
    r"docs/(avatars|failures)\.jpg",
    r"docs/heads/[a-z-]+\.jpg",
    r"samples/[a-z]+\.jpg",
    r"tests/golden/.+\.png",
)


@pytest.fixture(scope="module")
def tracked() -> list[str]:
    if not (ROOT / ".git").exists():
        pytest.skip("not a git checkout")
    listed = subprocess.run(
        ["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=True
    )
    return listed.stdout.split("\0")[:-1]


def stray(names: list[str]) -> list[str]:
    """Those of the files that have no place."""
    return [
        name
        for name in names
        if name.split("/")[0] not in TOP
        or (BINARY.search(name) and not any(re.fullmatch(kind, name) for kind in KEPT))
    ]


def test_nothing_stray_is_tracked(tracked):
    assert len(tracked) > 500  # the listing itself works
    assert stray(tracked) == []


def test_stray_files_are_seen():
    wrong = ["cheek.png", "region.npy", "runs/a.txt", "docs/face.jpg", "tests/crop.PNG"]
    assert stray([*wrong, "README.md", "samples/anna.jpg"]) == wrong
