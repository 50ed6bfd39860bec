"""Fixtures that every part's tests share."""

import contextlib
import gc
import io
import logging
import os
import pickle
import runpy
import shutil
import signal
import subprocess
import sys
import tempfile
import traceback
import warnings
from pathlib import Path

if (
    "PYTEST_XDIST_WORKER" in os.environ
):  # before numpy: who shares the cores waits for no second one
    os.environ |= dict.fromkeys(
        ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS"), "1"
    )

import numpy as np
import pytest
from filelock import FileLock
from hypothesis import HealthCheck, settings

from bakery.formats import image, record
from bakery.types import Landmarks

ROOT = Path(__file__).resolve().parents[1]
GOLDEN = ROOT / "tests" / "golden"
REJECTED = ROOT / ".work" / "golden"  # both pictures of a failure lie there
# The same cases at every run, and no clock: a busy machine must not fail a test.
settings.register_profile(
    "suite", derandomize=True, deadline=None, max_examples=30, database=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
)  # fmt: skip
settings.load_profile("suite")
SMALL = ["--preset", "small", "--set", "texture.mouths=3", "--set", "texture.views=[0.0]"]

# The files that take longest, in about that order: workers that begin with them end together. The first
# ones make what others share (bundle, fitted), each on its own worker, so that nobody waits for it.
LONGEST = """
    web/test_page.py evaluate/test_generator.py cli/test_resume.py cli/test_steps.py
    cli/test_build.py golden/test_golden.py test_plugin.py cli/test_sign.py cli/test_export.py
    evaluate/test_teeth.py cli/test_generate.py formats/test_signing.py bake/test_pipeline.py
    cli/test_perform.py cli/test_perform_over.py fuzz/test_fuzz.py export/test_player.py
    test_testing.py cli/test_marks.py export/test_hair_mesh.py stages/test_hair_volume.py
    stages/test_texture_complete.py web/test_parity.py train/segment/test_segment.py
    train/test_pagan.py export/test_damage.py synth/test_pair_painter.py synth/test_portraits.py
    synth/test_failures.py cli/test_bundle.py test_systems.py runtime/test_hair_shown.py
    cli/test_step_inputs.py web/test_stream.py cli/test_albedo.py web/test_load.py
    synth/test_synth_commands.py export/test_versions.py stages/test_segment.py
    stages/test_texture_albedo.py heads/mesh/test_transfer.py stages/test_hair_curls.py
    cli/test_motion.py formats/test_place_faults.py web/test_take.py export/test_lit.py
    heads/mesh/test_import.py
""".split()


def pytest_collection_modifyitems(items):
    rank = {ROOT / "tests" / name: number for number, name in enumerate(LONGEST)}
    items.sort(key=lambda item: rank.get(item.path, len(rank)))


def pytest_collection_finish():
    """What was imported stays to the end: no collection of garbage looks through it again."""
    gc.freeze()


def pytest_sessionfinish():
    """At the end all can be let go again, or libraries say that objects were left."""
    gc.unfreeze()


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


@pytest.fixture(scope="session")
def hairdo():
    """A function (head, neutral, style, seed, color) -> HairMesh, made once; see tests/hairdo.py."""
    make, made = runpy.run_path(str(ROOT / "tests" / "hairdo.py"))["hairdo"], {}

    def found(head, neutral, *how, **named):
        key = head.mean.tobytes(), neutral.tobytes(), repr((how, named))
        if key not in made:
            made[key] = make(head, neutral, *how, **named)
        return made[key]

    return found


@pytest.fixture(scope="session")
def authority(tmp_path_factory):
    """An Authority of tests/authority.py; skips without the extra c2pa."""
    pytest.importorskip("c2pa", reason="needs c2pa-python, the extra c2pa")
    made = runpy.run_path(str(ROOT / "tests" / "authority.py"))
    return made["Authority"](tmp_path_factory.mktemp("authority"))


@pytest.fixture(scope="session")
def signer(authority):
    """A Signer that the authority certifies."""
    return authority.signer()


@pytest.fixture(scope="session")
def fitted(portrait, head, once):
    """The painted portrait as a FittedSubject, by its landmarks; tests must not change it."""
    from bakery.bake.subject import FittedSubject
    from bakery.formats.record import read_faces

    def fit(folder):
        _, (face,) = read_faces(portrait[1])
        subject = FittedSubject(portrait[0], face, head)
        (folder / "subject.pickle").write_bytes(pickle.dumps(subject))

    return pickle.loads((once("fitted", fit) / "subject.pickle").read_bytes())


@pytest.fixture(scope="session")
def process():
    """A function (*arguments, **options of subprocess.run) that runs `bakery` in its own process.

    For what only a process shows: another environment, and that nothing is carried over.
    """

    def run(*arguments, **options):
        command = [sys.executable, "-m", "bakery", *map(str, arguments)]
        return subprocess.run(command, capture_output=True, text=True, **options)

    return run


@pytest.fixture(scope="session")
def bakery():
    """A function (*arguments, cwd, timeout) that runs `bakery` in this process: 3 s sooner.

    It gives what `process` gives: descriptors 1 and 2 are taken, so that what OpenCV prints is
    seen as well, and warnings are printed as Python does by itself.
    """
    return _called


def _called(*arguments, cwd=".", timeout=None):
    from bakery.cli.main import main

    arguments = list(map(str, arguments))
    with contextlib.ExitStack() as stack:
        stack.enter_context(contextlib.chdir(cwd))
        stack.enter_context(_limited(timeout))
        stack.enter_context(_own_log())
        stack.enter_context(_own_warnings())
        out, err = (stack.enter_context(_taken(name)) for name in ("stdout", "stderr"))
        try:
            main(arguments)
        except SystemExit as end:
            code = end.code
        except Exception:
            traceback.print_exc()
            code = 1
    return subprocess.CompletedProcess(arguments, code, "".join(out), "".join(err))


@contextlib.contextmanager
def _taken(name):
    """What is written to sys.stdout or sys.stderr, or below it: a list that holds it at the end."""
    number, before, texts = {"stdout": 1, "stderr": 2}[name], getattr(sys, name), []
    before.flush()
    kept = os.dup(number)
    with tempfile.TemporaryFile() as file:
        os.dup2(file.fileno(), number)
        setattr(sys, name, open(number, "w", encoding="utf-8", closefd=False))
        try:
            yield texts
        finally:
            with contextlib.suppress(ValueError):  # closed: the reader went away
                getattr(sys, name).flush()
            setattr(sys, name, before)
            os.dup2(kept, number)
            os.close(kept)
            file.seek(0)
            texts.append(io.TextIOWrapper(file, encoding="utf-8").read())


class Hang(BaseException):
    """No Exception: what reads a file would make an error of its own of it."""


@contextlib.contextmanager
def _limited(seconds):
    """Raise Hang after some seconds; None is no limit."""
    if seconds is None:
        yield
        return

    def late(*_):
        raise Hang(f"not done after {seconds} s")

    before = signal.signal(signal.SIGALRM, late)
    signal.alarm(seconds)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


@contextlib.contextmanager
def _own_log():
    """No handlers at the start, and what pytest had at the end."""
    root = logging.getLogger()
    before, level = root.handlers, root.level
    root.handlers = []
    try:
        yield
    finally:
        root.handlers = before
        root.setLevel(level)


@contextlib.contextmanager
def _own_warnings():
    """Warnings as a new process has them: printed once for each place, those for developers not."""
    with warnings.catch_warnings():
        warnings.resetwarnings()
        # pytest's own collects them.
        warnings.showwarning = lambda *given: sys.stderr.write(warnings.formatwarning(*given[:4]))
        for kind in (DeprecationWarning, PendingDeprecationWarning, ImportWarning, ResourceWarning):
            warnings.simplefilter("ignore", kind)
        yield


@pytest.fixture(scope="session")
def installed(tmp_path_factory):
    """The environment of a process in which the package of plug-ins, tests/plugin, is installed."""
    folder = tmp_path_factory.mktemp("site")
    about = folder / "bakery_example-1.2.dist-info"
    about.mkdir()
    example = ROOT / "tests" / "plugin"
    shutil.copy(example / "bakery_example.py", folder)
    shutil.copy(example / "entry_points.txt", about)
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: bakery-example\nVersion: 1.2\n")
    return os.environ | {"PYTHONPATH": os.pathsep.join([str(folder), *sys.path])}


@pytest.fixture(scope="session")
def once(tmp_path_factory):
    """A function (name, make) -> folder that make(folder) filled, once for all workers of xdist."""
    base = tmp_path_factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:
        base = base.parent

    def share(name, make):
        folder = base / name
        with FileLock(base / f"{name}.lock"):
            if not folder.exists():
                half = tmp_path_factory.mktemp(name)
                make(half)
                half.rename(folder)
        return folder

    return share


@pytest.fixture(scope="session")
def portrait(once):
    """A plain shaded head on grey, 400x480, with its landmarks: photo path, landmarks path."""
    folder = once("portrait", _paint)
    return folder / "painted.png", folder / "painted.json"


@pytest.fixture(scope="session")
def aside(once):
    """The same head turned by 40 degrees, in weaker light: photo path, landmarks path."""
    folder = once("aside", lambda folder: _paint(folder, "aside", 40.0, 0.7))
    return folder / "aside.png", folder / "aside.json"


def _paint(folder, name="painted", yaw=0.0, gain=1.0):
    from bakery.geometry import camera as cameras
    from bakery.geometry import rotation
    from bakery.geometry.color import to_encoded
    from bakery.geometry.mesh import vertex_normals
    from bakery.geometry.raster import rasterize
    from bakery.geometry.sample import interpolate
    from bakery.heads.file import load_head
    from bakery.types import Camera

    head = load_head()
    vertices = head.mean
    camera = Camera(
        800.0, np.array([200.0, 240.0]), rotation.vector(rotation.yaw_pitch(yaw, 0)),
        np.array([0, 20.0, -600.0]), 400, 480,
    )  # fmt: skip
    points = cameras.to_camera(vertices, camera)
    faces = head.faces[head.part_faces("skin", "eye_left", "eye_right")]
    seen = rasterize(
        cameras.project_camera(points, camera), -points[:, 2], faces, (480, 400), cull=True
    )
    normals = interpolate(seen, vertex_normals(vertices, head.faces)[faces])
    shade = gain * np.clip(0.25 + 0.45 * normals[..., 2:] + 0.1 * normals[..., 1:2], 0.05, 1)
    picture = np.where(seen.face[..., None] >= 0, shade * [0.75, 0.52, 0.42], 0.4)
    grain = np.random.default_rng(0).normal(0, 0.01, picture.shape)
    image.write_image(folder / f"{name}.png", to_encoded(picture + grain))
    marks = cameras.project(head.landmarks(vertices), camera)
    low, high = marks.min(0), marks.max(0)
    face = Landmarks(np.concatenate([low, high - low]), 1.0, marks, np.ones(478))
    (folder / f"{name}.json").write_bytes(record.dump(record.faces_to_table(400, 480, [face])))


@pytest.fixture(scope="session")
def bundle(bakery, portrait, once):
    """A bundle of the painted portrait; tests must not change it."""
    photo, marks = portrait

    def bake(folder):
        out = folder / "painted.avatar"
        done = bakery("build", photo, "--landmarks", marks, "-o", out, *SMALL, "--keep-photo")
        assert done.returncode == 0, done.stderr

    return once("bundle", bake) / "painted.avatar"


@pytest.fixture(scope="session")
def avatar(bundle):
    """The bundle of the painted portrait, opened; tests must not change it."""
    from bakery.export.open import open_avatar

    return open_avatar(bundle)


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
            image.write_image(REJECTED / f"{name}-found.png", picture)
            pytest.fail(
                f"{name}: no golden picture; look at {REJECTED}/{name}-found.png, then `make golden`"
            )
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
