"""Fixtures that every part's tests share."""

from pathlib import Path

import cv2
import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[1]
GOLDEN = Path(__file__).with_name("golden")


def pytest_addoption(parser):
    parser.addoption(
        "--update-golden", action="store_true", help="store today's pictures as the golden ones"
    )


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


@pytest.fixture
def golden(request, tmp_path):
    """Compare a picture [H, W, 3] 0..1 with the stored one of that name.

    atol is in 0..1, outliers the share of values that may lie beyond it. On failure both pictures
    are left in tmp_path.
    """

    def compare(name, picture, atol, outliers):
        path = GOLDEN / f"{name}.png"
        levels = np.round(np.clip(picture, 0, 1) * 255).astype(np.uint8)[..., ::-1]
        if request.config.getoption("--update-golden"):
            path.parent.mkdir(parents=True, exist_ok=True)
            cv2.imwrite(str(path), levels)
            return
        assert path.exists(), f"{path} is missing; `make golden` stores it"
        stored = cv2.imread(str(path))
        assert stored.shape == levels.shape, f"{name}: {levels.shape}, golden {stored.shape}"
        miss = np.abs(stored.astype(float) - levels) / 255
        beyond = (miss > atol).mean()
        if beyond > outliers:
            kept = tmp_path / f"{path.stem}_now.png"
            cv2.imwrite(str(kept), levels)
            worst = np.unravel_index(miss.argmax(), miss.shape)
            pytest.fail(
                f"{name}: {beyond:.2%} of values beyond {atol:.3f} (allowed {outliers:.2%}), "
                f"worst {miss.max():.3f} at {worst[:2]}; now {kept}, golden {path}"
            )

    return compare
