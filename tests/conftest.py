"""Fixtures that every part's tests share."""

from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="session")
def shared():
    """The folder of real photographs and head models beside the checkout; skips without it."""
    folder = ROOT.parent / "shared"
    if not (folder / "portraits" / "dense478.npz").exists():
        pytest.skip("needs the shared test data beside the checkout")
    return folder


@pytest.fixture(scope="session")
def head():
    """The built-in head model."""
    from bakery.heads.file import load_head

    return load_head("makehuman")
