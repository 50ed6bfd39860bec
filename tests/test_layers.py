"""The list of parts in docs/architecture.md, kept true: imports point down, files stay short."""

import ast
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "bakery"
LAYERS = [
    {"errors", "memo", "parallel", "paths"}, {"check", "settings"}, {"types", "landmarks"}, {"plugins"}, {"geometry"}, {"preset"},
    {"formats"}, {"heads", "detectors", "generators"}, {"stages"}, {"hair"}, {"synth"},
    {"runtime"}, {"export"}, {"exporters"}, {"bake"}, {"testing", "show", "farm"}, {"motion"}, {"perform"}, {"train"}, {"evaluate"}, {"cli"},
    {"__main__"},
]  # fmt: skip
RANK = {part: rank for rank, parts in enumerate(LAYERS) for part in parts}
# A generator draws heads and is handed their conditions: these two plug-in points build on heads.
# Both kinds of networks are made of the same convolution blocks.
MEET = {("generators", "heads"), ("detectors", "heads"), ("generators", "detectors")}
LONGEST = 400  # lines


def imported(path):
    """Dotted names of all that a file imports."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom):
            start = "." * node.level + (node.module or "")
            yield from (f"{start}.{alias.name}" for alias in node.names)
        elif isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)


def used_parts(path):
    """The parts of the package that a file imports."""
    for root, part in (name.split(".")[:2] for name in imported(path) if "." in name):
        if root == "bakery" and part != "__version__":
            yield part


FILES = sorted(path for path in PACKAGE.rglob("*.py") if path != PACKAGE / "__init__.py")


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_imports_point_down(path):
    part = path.relative_to(PACKAGE).parts[0].removesuffix(".py")
    for used in used_parts(path):
        allowed = used == part or RANK[used] < RANK[part] or (part, used) in MEET
        assert allowed, f"{part} must not import {used}"


@pytest.mark.parametrize(
    "path",
    FILES + sorted((ROOT / "tests").rglob("*.py")),
    ids=lambda p: p.relative_to(ROOT).as_posix(),
)
def test_files_are_short(path):
    assert len(path.read_text(encoding="utf-8").splitlines()) <= LONGEST


def test_torch_stays_where_it_belongs():
    for path in FILES:
        part = path.relative_to(PACKAGE).parts[0].removesuffix(".py")
        if part in ("generators", "detectors", "train"):
            continue
        # Its first name, or, from one of ours, its last: neither is torch.
        for name in imported(path):
            assert not {name.split(".")[0], name.split(".")[-1]} & {"torch"}, path


NAMED = {"cv2": "opencv-contrib-python-headless", "PIL": "pillow"}  # packages by what is imported


def test_what_is_imported_at_once_is_a_dependency():
    """An extra, or a package of the developers, is imported where it is needed, behind a clear message."""
    told = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    have = {re.split(r"[<>=\[; ]", line)[0].lower() for line in told["dependencies"]}
    for path in FILES:
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
            if isinstance(node, ast.ImportFrom) and not node.level:
                names = [node.module]
            for root in (
                {name.split(".")[0] for name in names} - sys.stdlib_module_names - {"bakery"}
            ):
                assert NAMED.get(root, root).lower().replace("_", "-") in have, f"{path}: {root}"


BAKES = ("stages", "hair", "runtime", "export", "exporters", "bake", "show", "motion", "perform")


def test_a_bake_needs_nothing_of_what_builds_heads():
    """Heads are built by us, or brought by users: `heads/build` and `heads/mesh` are tools of their own."""
    for path in FILES:
        if path.relative_to(PACKAGE).parts[0] not in BAKES:
            continue
        for name in imported(path):
            assert not re.match(r"bakery\.heads\.(build|mesh)\b", name), f"{path}: {name}"


HELP_MAY_LOAD = {  # what `bakery --help` imports beyond click
    "bakery", "bakery.errors",
    *(f"bakery.cli{name}" for name in ("", ".entries", ".group", ".main")),
    "click._textwrap", "textwrap", "locale", "_locale", "errno",
}  # fmt: skip


def test_help_loads_nothing_slow():
    code = (
        "import click, sys; before = set(sys.modules); from bakery.cli.main import bakery; "
        "bakery.main(['--help'], standalone_mode=False); print(*(set(sys.modules) - before))"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    loaded = set(run.stdout.splitlines()[-1].split())
    assert "bakery.cli.main" in loaded and loaded <= HELP_MAY_LOAD, loaded - HELP_MAY_LOAD


def parts_on_disk():
    names = {path.name.removesuffix(".py") for path in PACKAGE.iterdir() if path.suffix == ".py"}
    names |= {path.name for path in PACKAGE.iterdir() if (path / "__init__.py").is_file()}
    return names - {"__init__", "__main__"}


def in_order(names):
    """Whether the parts stand in the order of LAYERS, none twice, none missing."""
    ranks = [RANK[name] for name in names]
    return ranks == sorted(ranks) and sorted(names) == sorted(parts_on_disk())


def test_layers_name_what_is_there():
    assert set(RANK) - {"__main__"} == parts_on_disk()


def test_the_packages_map_is_true():
    text = ast.get_docstring(ast.parse((PACKAGE / "__init__.py").read_text(encoding="utf-8")))
    rows = re.findall(r"^    ([a-z_, ]+?)  +\S", text, re.M)
    assert in_order([name.strip() for row in rows for name in row.split(",")])


def test_the_documents_map_is_true():
    text = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    table = text.split("## The parts")[1].split("Imports only point down")[0]
    cells = re.findall(r"^\| (`.*?) \|", table, re.M)
    names = [name for cell in cells for name in re.findall(r"`([a-z_]+)(?:\.py|/)`", cell)]
    assert in_order(names)
