"""Fixtures that every part's tests share."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, settings

from bakery.formats import image, record
from bakery.types import Landmarks

ROOT = Path(__file__).resolve().parents[1]
GOLDEN = ROOT / "tests" / "golden"
REJECTED = ROOT / ".work" / "golden"  # both pictures of a failure lie there
# The same cases at every run, and no clock: a busy machine must not fail a test.
settings.register_profile(
    "suite", derandomize=True, deadline=None, max_examples=60, database=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
)  # fmt: skip
settings.load_profile("suite")
SMALL = ["--preset", "small", "--set", "texture.mouths=3", "--set", "texture.views=[0.0]"]


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


def run(*arguments, **options):
    """Run `bakery`; returns the finished process with its text."""
    return subprocess.run(
        [sys.executable, "-m", "bakery", *map(str, arguments)],
        capture_output=True,
        text=True,
        **options,
    )


@pytest.fixture(scope="session")
def bakery():
    return run


@pytest.fixture(scope="session")
def portrait(tmp_path_factory):
    """A plain shaded head on grey, 400x480, with its landmarks: photo path, landmarks path."""
    from bakery.geometry import camera as cameras
    from bakery.geometry.color import to_encoded
    from bakery.geometry.mesh import vertex_normals
    from bakery.geometry.raster import rasterize
    from bakery.geometry.sample import interpolate
    from bakery.heads.file import load_head
    from bakery.types import Camera

    folder = tmp_path_factory.mktemp("portrait")
    head = load_head()
    vertices = head.mean
    camera = Camera(
        800.0, np.array([200.0, 240.0]), np.zeros(3), np.array([0, 20.0, -600.0]), 400, 480
    )
    points = cameras.to_camera(vertices, camera)
    faces = head.faces[head.part_faces("skin", "eye_left", "eye_right")]
    seen = rasterize(
        cameras.project_camera(points, camera), -points[:, 2], faces, (480, 400), cull=True
    )
    normals = interpolate(seen, vertex_normals(vertices, head.faces)[faces])
    shade = np.clip(0.25 + 0.45 * normals[..., 2:] + 0.1 * normals[..., 1:2], 0.05, 1)
    picture = np.where(seen.face[..., None] >= 0, shade * [0.75, 0.52, 0.42], 0.4)
    grain = np.random.default_rng(0).normal(0, 0.01, picture.shape)
    image.write_image(folder / "painted.png", to_encoded(picture + grain))
    marks = cameras.project(head.landmarks(vertices), camera)
    low, high = marks.min(0), marks.max(0)
    face = Landmarks(np.concatenate([low, high - low]), 1.0, marks, np.ones(478))
    (folder / "painted.json").write_bytes(record.dump(record.faces_to_table(400, 480, [face])))
    return folder / "painted.png", folder / "painted.json"


@pytest.fixture(scope="session")
def bundle(bakery, portrait, tmp_path_factory):
    """A bundle of the painted portrait; tests must not change it."""
    photo, marks = portrait
    out = tmp_path_factory.mktemp("bundle") / "painted.avatar"
    done = bakery("build", photo, "--landmarks", marks, "-o", out, *SMALL, "--keep-photo")
    assert done.returncode == 0, done.stderr
    return out


@pytest.fixture
def golden():
    """A function (name, picture, tolerance, outliers) that compares with tests/golden/NAME.png.

    Args of it:
        picture: [H, W] or [H, W, 3], 0..1.
        tolerance: allowed difference of a pixel, 0..1.
        outliers: share of the pixels that may differ more.
    """

    def compare(name, picture, tolerance, outliers):
        path = GOLDEN / f"{name}.png"
        picture = np.clip(np.asarray(picture, np.float32), 0, 1)
        if picture.ndim == 2:
            picture = np.repeat(picture[..., None], 3, 2)
        if os.environ.get("UPDATE_GOLDEN"):
            image.write_image(path, picture)
            return
        if not path.exists():
            pytest.skip(f"no golden picture {name} yet; `make golden` stores it")
        wanted = image.read_photo(path).encoded
        assert picture.shape == wanted.shape, "another size; look at it, then `make golden`"
        error = np.abs(picture - wanted).max(-1)
        share = float((error > tolerance).mean())
        if share > outliers:
            image.write_image(REJECTED / f"{name}-found.png", picture)
            image.write_image(REJECTED / f"{name}-wanted.png", wanted)
            row, column = np.unravel_index(error.argmax(), error.shape)
            pytest.fail(
                f"{name}: {share:.2%} of the pixels differ by more than {tolerance:.3f} (allowed "
                f"{outliers:.2%}), most by {error.max():.3f} at row {row}, column {column}; see "
                f"{REJECTED}"
            )

    return compare
