"""Ten mistakes that the tests once let through: each is made in a copy of the package, and must fail a test."""

import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
LINKED = ("tests", "presets", "samples", "pyproject.toml")

pytestmark = pytest.mark.slow


@dataclass(frozen=True)
class Mutant:
    """One line of one file changed, and the tests that must notice."""

    file: str  # below bakery/
    line: str  # as it is, once in the file
    wrong: str
    tests: str  # file of tests


MUTANTS = {
    "an array of the bundle is dropped": Mutant(
        "export/bundle.py",
        'coverage = {"source": textures.source, "facing": textures.facing}',
        'coverage = {"source": textures.source}',
        "tests/export/test_versions.py",
    ),
    "options of the segmentation are dropped": Mutant(
        "bake/pipeline.py",
        "segment_portrait(photo, landmarks, options) for photo, (landmarks, _)",
        "segment_portrait(photo, landmarks, BuildOptions()) for photo, (landmarks, _)",
        "tests/bake/test_pipeline.py",
    ),
    "strict is upside down": Mutant(
        "bake/fitting.py",
        "    if strict and lines:",
        "    if not strict and lines:",
        "tests/cli/test_strict.py",
    ),
    "one generator whatever is asked": Mutant(
        "cli/texture.py",
        'plug_in("generators", request["generator"])',
        'plug_in("generators", "rendered")',
        "tests/cli/test_steps.py",
    ),
    "another source type of IPTC": Mutant(
        "generators/pagan.py",
        'source_type = "compositeWithTrainedAlgorithmicMedia"',
        'source_type = "trainedAlgorithmicMedia"',
        "tests/bake/test_pipeline.py",
    ),
    "both eyes around one middle": Mutant(
        "stages/condition.py",
        "        direction = points - centers[which]",
        "        direction = points - centers[0]",
        "tests/stages/test_condition.py",
    ),
    "irises changed over": Mutant(
        "detectors/network.py",
        "            points=points.astype(np.float32),",
        "            points=points[np.r_[:468, 473:478, 468:473]].astype(np.float32),",
        "tests/detectors/test_landmarks.py",
    ),
    "yaw to the other side": Mutant(
        "stages/condition.py",
        "    return cameras.view(framed, yaw, pitch, pivot)",
        "    return cameras.view(framed, -yaw, pitch, pivot)",
        "tests/stages/test_condition.py",
    ),
    "an old bundle never has its place again": Mutant(
        "formats/place.py",
        "        if _settle(hidden, target):",
        "        if True:",
        "tests/formats/test_place.py",
    ),
    "what is kept is never taken": Mutant(
        "bake/kept.py",
        '        data = self.work.get(f"{name}.npz", key_of(self.key, *more))',
        "        data = None",
        "tests/bake/test_kept.py",
    ),
}


@pytest.fixture
def copy(tmp_path):
    """A copy of the package with its tests."""
    copy_linked(ROOT / "bakery", tmp_path / "bakery")
    for entry in LINKED:
        (tmp_path / entry).symlink_to(ROOT / entry)
    return tmp_path


def run_tests(copy, *tests):
    return subprocess.run(
        [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", *tests],
        cwd=copy,
        env=os.environ | {"PYTHONPATH": str(copy), "PYTHONDONTWRITEBYTECODE": "1"},
        capture_output=True,
        text=True,
    )


def test_without_a_mistake_none_fails(copy):
    run = run_tests(copy, *sorted({mutant.tests for mutant in MUTANTS.values()}))
    assert run.returncode == 0, run.stdout[-2000:]


@pytest.mark.parametrize("name", MUTANTS)
def test_a_mistake_fails_a_test(name, copy):
    mutant = MUTANTS[name]
    changed = copy / "bakery" / mutant.file
    text = changed.read_text()
    assert text.count(mutant.line) == 1, "the line has gone: mend the mutant"
    changed.unlink()
    changed.write_text(text.replace(mutant.line, mutant.wrong))
    run = run_tests(copy, mutant.tests)
    assert run.returncode == 1, f"no test noticed: {run.stdout[-2000:]}"


def copy_linked(source: Path, target: Path) -> None:
    """The folders of a tree anew, its files as links."""
    target.mkdir()
    for entry in source.iterdir():
        if entry.is_dir() and entry.name not in ("__pycache__", "node_modules"):
            copy_linked(entry, target / entry.name)
        elif entry.is_file():
            (target / entry.name).symlink_to(entry)
