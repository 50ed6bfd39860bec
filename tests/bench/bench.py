"""Measure speed and memory; `make bench` prints a table and appends a line to results.csv.

python tests/bench/bench.py samples/anna.jpg
"""

import csv
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import cv2
import numpy as np

from bakery import __version__
from bakery.bake.faces import one_face
from bakery.bake.fitting import segment_portrait
from bakery.bake.options import BuildOptions
from bakery.formats.image import read_photo
from bakery.heads.file import load_head
from bakery.plugins import plug_in
from bakery.stages.detect import detect_faces
from bakery.stages.fit import FitOptions, fit

RESULTS = Path(__file__).with_name("results.csv")
LIMITS = {  # what the project promises, on two cores
    "help_s": 0.20,
    "detect_ms": 100,
    "fit_ms": 500,
    "fit_landmarks_ms": 60,
    "build_s": 40,
    "build_gib": 2.0,
}


def best(work, count):
    """Shortest of `count` runs, seconds; the first run is not counted."""
    work()
    seconds = []
    for _ in range(count):
        start = time.perf_counter()
        work()
        seconds.append(time.perf_counter() - start)
    return min(seconds)


def measure(sample):
    """All figures of LIMITS."""
    run = [sys.executable, "-m", "bakery"]
    figures = {
        "help_s": best(
            lambda: subprocess.run([*run, "--help"], capture_output=True, check=True), 10
        )
    }
    photo = read_photo(sample)
    scale = 1350 / max(photo.encoded.shape[:2])
    picture = cv2.resize(photo.encoded, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    picture = np.clip(picture, 0, 1)
    detector = plug_in("detectors", "network")
    figures["detect_ms"] = 1000 * best(lambda: detect_faces(picture, detector), 10)

    photo, face = one_face(sample)
    head = load_head("makehuman")
    skin = segment_portrait(photo, face, BuildOptions()).skin
    figures["fit_ms"] = 1000 * best(lambda: fit(photo, face, head, skin=skin), 5)
    plain = FitOptions(photometric=False, warp=False)
    figures["fit_landmarks_ms"] = 1000 * best(lambda: fit(photo, face, head, plain), 5)

    with tempfile.TemporaryDirectory() as folder:
        start = time.perf_counter()
        subprocess.run([*run, "build", sample, "-q", "-o", f"{folder}/a.avatar"], check=True)
        figures["build_s"] = time.perf_counter() - start
    peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss
    figures["build_gib"] = peak / (2**30 if sys.platform == "darwin" else 2**20)
    return figures


def main(sample):
    figures = measure(sample)
    for name, value in figures.items():
        print(f"{name:<18}{value:8.3f}   at most {LIMITS[name]:g}")
    fresh = not RESULTS.exists()
    with open(RESULTS, "a", newline="") as file:
        writer = csv.writer(file)
        if fresh:
            writer.writerow(["version", "sample", *figures])
        writer.writerow([__version__, Path(sample).stem, *(f"{v:.3f}" for v in figures.values())])


if __name__ == "__main__":
    main(sys.argv[1])
