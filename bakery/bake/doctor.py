"""The checks of `bakery doctor`."""

import os
import platform
import shutil
import tempfile
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path

PACKAGES = (
    "torch numpy opencv-contrib-python-headless OpenEXR OpenImageIO numba pillow pygltflib "
    "fast-simplification safetensors jsonschema filelock scipy trimesh xatlas click"
).split()
ROOM = 2 * 2**30  # bytes that a bake of 1024 texels needs on disk, with its work folder


@dataclass(frozen=True)
class Check:
    """One check."""

    name: str
    good: bool
    what: str  # was found


def findings() -> list[Check]:
    """Run all checks: list of Check."""
    checks = [
        Check("python", True, f"{platform.python_version()} on {platform.platform()}"),
        Check(
            "processors",
            True,
            f"{len(os.sched_getaffinity(0))}"
            if hasattr(os, "sched_getaffinity")
            else f"{os.cpu_count()}",
        ),
    ]
    checks += [_package(name) for name in PACKAGES]
    for name, check in (
        ("disk", _disk),
        ("presets", _presets),
        ("head model", _head),
        ("detector", _detector),
        ("generator", _generator),
        ("rasteriser", _rasteriser),
        ("OpenEXR round trip", _exr),
    ):
        try:
            checks.append(Check(name, True, check()))
        except Exception as error:  # whatever it is, it is the finding
            checks.append(Check(name, False, " ".join(f"{type(error).__name__}: {error}".split())))
    return checks


def _package(name: str) -> Check:
    try:
        return Check(name, True, metadata.version(name))
    except metadata.PackageNotFoundError:
        return Check(name, False, "not installed")


def _disk() -> str:
    free = shutil.disk_usage(".").free
    if free < ROOM:
        raise OSError(f"{free / 2**30:.1f} GiB free here, a bake wants {ROOM / 2**30:.0f}")
    return f"{free / 2**30:.1f} GiB free here"


def _presets() -> str:
    from bakery import preset
    from bakery.bake.targets import read_targets

    targets = read_targets()
    known = preset.names("builds")
    return f"{', '.join(known)}; {len(targets.key_names)} keys, {len(targets.mouths)} mouths"


def _head() -> str:
    from bakery.heads.file import load_head

    head = load_head()
    return (
        f"{head.name}: {len(head.mean)} vertices, {len(head.identity_basis)} modes, {head.licence}"
    )


def _detector() -> str:
    from bakery.detectors.base import Detector
    from bakery.plugins import plug_in

    detector: Detector = plug_in("detectors", "network")
    return detector.name


def _generator() -> str:
    from bakery.generators.base import Generator
    from bakery.plugins import plug_in

    generator: Generator = plug_in("generators", "pagan")
    return generator.name


def _rasteriser() -> str:
    import numpy as np

    from bakery.geometry.raster import rasterize

    corners = np.array([[0.0, 0.0], [4.0, 0.0], [0.0, 4.0]])
    seen = rasterize(corners, None, np.array([[0, 1, 2]]), (4, 4))
    if (seen.face >= 0).sum() != 10:
        raise ValueError(f"a triangle covers {(seen.face >= 0).sum()} pixels, 10 expected")
    return "numba, compiled"


def _exr() -> str:
    import numpy as np

    from bakery.formats import exr

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "test.exr"
        picture = np.linspace(0, 1, 48).reshape(4, 4, 3).astype(np.float16)
        exr.write_exr(path, {"a": picture, "b": picture})
        back = exr.read_exr(path)
    if not (back["b"] == picture).all():
        raise ValueError("pixels changed")
    return "pixels come back"
