"""Measure again what a checkout alone can measure, and write it into docs/quality.md.

    .venv/bin/python docs/report.py            # or: make report; about ten minutes
    .venv/bin/python docs/report.py speed web  # these groups alone: make report ONLY="speed web"

Rows of groups that are not measured stay as they are, with their own date and commit.
"""

import json
import math
import os
import platform
import runpy
import subprocess
import sys
import tempfile
from collections.abc import Callable
from datetime import date
from pathlib import Path

import numpy as np

from bakery.types import EXPRESSIONS

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "quality.md"
SAMPLE = ROOT / "samples" / "anna.jpg"
BEGIN, END = "<!-- make report writes from here -->", "<!-- to here -->"
HEAD = "| what | requirement | measured | when, where |\n|---|---|---|---|\n"
Figures = dict[str, tuple[str, str]]  # what is measured -> its requirement, and the figure
MOVING = (
    "jawOpen",
    "mouthSmileLeft",
    "mouthSmileRight",
    "browInnerUp",
)  # in the take that is played


def bakery(*words: object) -> str:
    """Run the command line of this environment; what it printed."""
    command = [sys.executable, "-m", "bakery", *map(str, words)]
    return subprocess.run(command, check=True, cwd=ROOT, capture_output=True, text=True).stdout


def last(text: str) -> dict:
    """The last JSON line: the means of `bakery evaluate`."""
    found: dict = json.loads(text.strip().splitlines()[-1])
    return found


def speed(bundle: Path) -> Figures:
    """Times and memory of `make bench`."""
    got = runpy.run_path(str(ROOT / "tests" / "bench" / "bench.py"))["measure"](str(SAMPLE))
    return {
        "`bakery --help`": ("0.20 s", f"{got['help_s']:.2f} s"),
        "detect, warm, 1350x1350": ("100 ms", f"{got['detect_ms']:.0f} ms"),
        "fit, warm, photometric and all": ("500 ms", f"{got['fit_ms']:.0f} ms"),
        "its landmark-only stage": ("60 ms", f"{got['fit_landmarks_ms']:.0f} ms"),
        "whole `build` of samples/anna.jpg": ("40 s", f"{got['build_s']:.1f} s"),
        "peak memory of `build`": ("2.0 GiB", f"{got['build_gib']:.2f} GiB"),
    }


def web(bundle: Path) -> Figures:
    """How large the bundle for browsers is."""
    size = sum(path.stat().st_size for path in (bundle / "web").iterdir())
    return {"bundle for browsers, default preset": ("20 MB", f"{size / 1e6:.1f} MB")}


def player(bundle: Path) -> Figures:
    """docs/examples/player.py against `bakery render`."""
    from bakery.export.open import open_avatar
    from bakery.show import frame

    found = runpy.run_path(str(ROOT / "docs" / "examples" / "player.py"))
    picture, alpha = found["draw"](bundle, {"jawOpen": 0.4, "mouthSmileLeft": 0.6}, (30, 10))
    scene = frame.Scene(**frame.parse("jawOpen=0.4,mouthSmileLeft=0.6", view="30,10"))
    wanted, _ = frame.render(open_avatar(bundle), scene)
    apart = 255 * np.abs(found["encode"](picture) - wanted)[alpha > 0].mean()
    return {
        "player of 200 lines against `bakery render`, on the head": ("1.5 of 255", f"{apart:.5f}")
    }


def animate(bundle: Path) -> Figures:
    """Frames a second of a head with hair."""
    take = bundle.parent / "take.csv"
    rows = ["Timecode,BlendShapeCount," + ",".join(EXPRESSIONS)]
    for number in range(120):
        weight = 0.35 + 0.35 * math.sin(number / 7)
        values = (f"{weight if name in MOVING else 0:.3f}" for name in EXPRESSIONS)
        rows.append(f"00:00:{number // 60:02d}:{number % 60:02d}.000,52," + ",".join(values))
    take.write_text("\n".join(rows) + "\n")
    got = last(bakery("evaluate", "animate", bundle, "--curves", take))
    figure = f"{got['frames_per_second']:.0f} frames/s, {got['processor_ms']:.0f} ms of processor time a frame"
    return {"`animate` with hair, 512x512, VP8": ("30 frames/s", figure)}


def track(bundle: Path) -> Figures:
    """Painted people who play known curves."""
    got = last(bakery("evaluate", "track"))
    return {
        "tracking, mean absolute error of the 52 weights": ("0.06", f"{got['error']:.3f}"),
        "tracking, frames in which the face rests": ("0.03", f"{got['resting']:.3f}"),
        "tracking, jitter of a still face": ("0.005", f"{got['jitter']:.4f}"),
        "tracking, frames a second": ("15", f"{got['frames_per_second']:.0f}"),
    }


GROUPS: dict[str, Callable[[Path], Figures]] = {
    made.__name__: made for made in (speed, web, player, animate, track)
}


def where() -> str:
    """Today's date, what kind of machine this is, and the commit."""
    git = ["git", "describe", "--always", "--dirty=+", "--exclude=*"]
    done = subprocess.run(git, cwd=ROOT, capture_output=True, text=True)
    commit = done.stdout.strip() or "no checkout"
    return f"{date.today()}, {os.cpu_count()} cores {platform.machine()}, {commit}"


def written(page: str, figures: Figures, stamp: str) -> str:
    """A page with these figures in its table: new ones in place of old ones, the rest as it was."""
    before, rest = page.split(BEGIN)
    old, after = rest.split(END)
    rows = {line.split(" | ")[0][2:]: line for line in old.splitlines() if line.startswith("| ")}
    rows.pop("what", None)
    for name, (limit, figure) in figures.items():
        rows[name] = f"| {name} | {limit} | {figure} | {stamp} |"
    return before + BEGIN + "\n\n" + HEAD + "\n".join(rows.values()) + "\n\n" + END + after


def main(names: list[str]) -> None:
    unknown = set(names) - set(GROUPS)
    if unknown:
        sys.exit(f"no such group: {', '.join(sorted(unknown))}; known: {', '.join(GROUPS)}")
    with tempfile.TemporaryDirectory() as folder:
        bundle = Path(folder) / "anna.avatar"
        bakery("build", SAMPLE, "-q", "-o", bundle)
        for name in names or GROUPS:
            figures = GROUPS[name](bundle)
            PAGE.write_text(written(PAGE.read_text(encoding="utf-8"), figures, where()))
            print(*(f"{what}: {figure}" for what, (_, figure) in figures.items()), sep="\n")


if __name__ == "__main__":
    main(sys.argv[1:])
