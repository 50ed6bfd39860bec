"""Draw docs/avatars.jpg: samples beside their avatars, each baked from its one picture.

    .venv/bin/python docs/avatars.py        # or: make picture

Bundles and single pictures are kept in build/avatars.
"""

import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np

ROOT = Path(__file__).parents[1]
BUILD = ROOT / "build" / "avatars"
ROWS = ("anna", "chidi", "dalia", "emil", "fumiko")
POSES = {  # the words of README's caption
    "neutral": [],
    "turned": ["--view", "40,0"],
    "smiling": ["--expression", "smile"],
    "talking": ["--view=-25,0", "--weights", "jawOpen=0.35,mouthFunnel=0.2,mouthUpperUpLeft=0.2"],
    "angry": ["--weights", "browDownLeft=0.9,browDownRight=0.9,noseSneerLeft=0.4,noseSneerRight=0.4"],
    "looking aside": ["--gaze", "24,0", "--view=20,0"],
}  # fmt: skip
SIZE = 260  # pixels of one picture


def bakery(*words: object) -> None:
    """Run the command line of this environment.

    Raises:
        subprocess.CalledProcessError: it failed; it has said why.
    """
    subprocess.run([Path(sys.executable).with_name("bakery"), *map(str, words)], check=True)


def row(name: str) -> np.ndarray:
    """The sample and its avatar in every pose [SIZE, (1 + poses) * SIZE, 3] uint8."""
    photo, bundle = ROOT / "samples" / f"{name}.jpg", BUILD / f"{name}.avatar"
    bakery("build", "--quiet", "--overwrite", "--skip-fresh", photo, "-o", bundle)
    picture = cv2.imread(str(photo))
    top = (picture.shape[0] - picture.shape[1]) // 4  # the head stands in the upper half
    pictures = [picture[top : top + picture.shape[1]]]
    for number, words in enumerate(POSES.values()):
        out = BUILD / f"{name}.{number}.png"
        bakery("render", "--quiet", "--overwrite", bundle, "-o", out, "--size", 2 * SIZE, *words)
        pictures.append(cv2.imread(str(out)))
    return np.concatenate(
        [cv2.resize(p, (SIZE, SIZE), interpolation=cv2.INTER_AREA) for p in pictures], 1
    )


def main() -> None:
    """Write the picture."""
    BUILD.mkdir(parents=True, exist_ok=True)
    sheet = np.concatenate([row(name) for name in ROWS])
    cv2.imwrite(str(ROOT / "docs" / "avatars.jpg"), sheet, [cv2.IMWRITE_JPEG_QUALITY, 90])


if __name__ == "__main__":
    main()
