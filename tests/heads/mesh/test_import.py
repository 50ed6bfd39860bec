"""The built-in head's skin, exported without its shapes and imported again: they come back."""

import numpy as np
import pytest
from click.testing import CliRunner

from bakery.cli.heads import heads
from bakery.errors import InputError
from bakery.heads.base import PARTS, PROXIES
from bakery.heads.file import load_head, save_head
from bakery.heads.mesh.assemble import MeshOptions, import_mesh
from bakery.heads.mesh.pose import similarity
from bakery.heads.mesh.read import Surface
from bakery.heads.report.numbers import face_texels
from bakery.heads.report.penetrate import DEEP, Contacts
from bakery.landmarks import FACE
from bakery.types import EXPRESSION_INDEX, EXPRESSIONS

Z_UP = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])


def imported(head, path, known, scale=1.0, turn=None, **options):
    return import_mesh(
        path, head, lambda *_: known(head, scale, turn), "again", MeshOptions(**options)
    )


@pytest.fixture(scope="module")
def again(head, skin, known, export, tmp_path_factory):
    """The skin without uv, in metres, z up: HeadModel, lines about it."""
    path = tmp_path_factory.mktemp("mesh") / "skin.obj"
    export(path, Surface(0.001 * skin.vertices @ Z_UP.T, skin.faces))
    return imported(head, path, known, 0.001, Z_UP, licence="CC0-1.0")


def shapes_off(found, head, numbers):
    """How far shapes are off [E, V] mm, and where vertices went: the mesh's come first, in order."""
    n = len(numbers)
    turn, scale, _ = similarity(found.mean[:n].astype(float), head.mean[numbers], np.ones(n))
    assert scale == pytest.approx(1, abs=1e-3)
    moved = found.expression_basis[:, :n] @ turn.T
    return np.linalg.norm(moved - head.expression_basis[:, numbers], axis=2)


def check_shapes(found, head, numbers):
    """Registration finds lips and lids to some tenths of a millimetre; shapes reach 38 mm."""
    off = shapes_off(found, head, numbers)
    wanted = np.linalg.norm(head.expression_basis[:, numbers], axis=2)
    for k, name in enumerate(EXPRESSIONS):
        assert np.percentile(off[k], 99) < 0.5, name
        if wanted[k].max() > 1:
            assert np.sqrt((off[k] ** 2).sum() / (wanted[k] ** 2).sum()) < 0.1, name


@pytest.mark.slow
def test_it_says_what_it_assumed(again):
    about = "\n".join(again[1])
    for words in ("unit: m assumed", "z up, -y out of the face", "the file's triangles", "no uv"):
        assert words in about


@pytest.mark.slow
def test_its_shapes_come_back(again, head, numbers):
    check_shapes(again[0], head, numbers)


@pytest.mark.slow
def test_its_people_come_back(again, head, numbers):
    found = again[0].identity_basis[:, : len(numbers)]
    wanted = head.identity_basis[:, numbers]
    assert np.sqrt(((found - wanted) ** 2).sum() / (wanted**2).sum()) < 0.05


@pytest.mark.slow
def test_its_landmarks_come_back(again, head):
    off = again[0].landmarks(again[0].mean) - head.landmarks(head.mean)
    off = np.linalg.norm(off - np.median(off, axis=0), axis=1)
    assert np.median(off) < 0.1 and off.max() < 1.5


@pytest.mark.slow
def test_it_is_a_whole_head(again, tmp_path):
    found = again[0]
    missing = {name for k, name in enumerate(PARTS) if not (found.face_part == k).any()}
    assert missing == {"lashes", "tear"}  # both are made for each person
    assert set(found.uv_rectangles) == {*PROXIES, "cards"}
    assert found.licence == "CC0-1.0" and found.source == "skin.obj"
    assert face_texels(found) > 200_000  # the built-in head has 365,000
    save_head(tmp_path / "again.npz", found)
    back = load_head(tmp_path / "again.npz")
    np.testing.assert_allclose(back.expression_basis, found.expression_basis, atol=0.02)
    assert len(back.landmark_faces) == FACE + 10


@pytest.mark.slow
@pytest.mark.parametrize("name", ["", "jawOpen", "mouthPucker", "eyeBlinkLeft", "mouthSmileLeft"])
def test_nothing_reaches_into_anything(again, name):
    found, weights = again[0], np.zeros(len(EXPRESSIONS))
    if name:
        weights[EXPRESSION_INDEX[name]] = 1
    for pair, depth in Contacts(found).depths(found.vertices(found.mean, weights), weights).items():
        assert depth.max(initial=0) <= DEEP, pair


@pytest.mark.slow
def test_lips_and_lids_part_and_close(again):
    found = again[0]
    rest = found.landmarks(found.mean)
    for name, upper, lower, apart in (("jawOpen", 13, 14, 20.0), ("eyeBlinkLeft", 386, 374, -0.3)):
        moved = rest + found.landmarks(found.expression_basis[EXPRESSION_INDEX[name]])
        gap = moved[upper, 1] - moved[lower, 1]
        assert gap > apart if apart > 0 else gap < apart, name


def run(*arguments):
    return CliRunner().invoke(heads, [str(a) for a in arguments], catch_exceptions=False, obj={})


def test_command_refuses_in_one_line_and_writes_nothing(tmp_path):
    (tmp_path / "no.obj").write_text("v 0 0 0\n")
    with pytest.raises(InputError, match="no faces"):
        run("import", "mesh", tmp_path / "no.obj", "-o", tmp_path / "out.npz")
    assert [path.name for path in tmp_path.iterdir()] == ["no.obj"]
    (tmp_path / "out.npz").write_bytes(b"")
    with pytest.raises(InputError, match="already there"):
        run("import", "mesh", tmp_path / "no.obj", "-o", tmp_path / "out.npz")
    assert "Invalid value" in run("import", "mesh", "x.obj", "-o", "y.npz", "--units", "ell").output


def test_command_draws_the_picture_for_landmarks(skin, export, tmp_path):
    path, picture = export(tmp_path / "skin.ply", skin), tmp_path / "skin.png"
    run("import", "mesh", path, "-o", tmp_path / "out.npz", "--picture", picture)
    assert picture.stat().st_size > 10_000 and not (tmp_path / "out.npz").exists()


@pytest.mark.slow
@pytest.mark.parametrize("kind, with_uv", [("obj", True), ("ply", False), ("glb", True)])
def test_every_kind_of_file_gives_its_shapes_back(
    head, skin, numbers, known, export, tmp_path, kind, with_uv
):
    path = export(tmp_path / f"skin.{kind}", skin, with_uv)
    found, about = imported(head, path, known)
    assert ("uv: the file's own" in about) == with_uv
    assert abs(len(found.mean) - len(load_head().mean)) < 400  # lashes alone are missing
    shape = found.landmarks(found.expression_basis[EXPRESSION_INDEX["jawOpen"]])
    wanted = head.landmarks(head.expression_basis[EXPRESSION_INDEX["jawOpen"]])
    np.testing.assert_allclose(
        shape[:FACE], wanted[:FACE], atol=1.0
    )  # of 38; vertices are reordered


@pytest.mark.slow
def test_the_built_in_triangles_can_be_laid_over(head, skin, known, export, tmp_path):
    path = export(tmp_path / "skin.obj", Surface(1.1 * skin.vertices, skin.faces))
    found, about = imported(head, path, known, 1.1, topology="built-in")
    assert any(line.startswith("skin: the built-in head's triangles") for line in about)
    wanted = 1.1 * head.landmarks(head.expression_basis[EXPRESSION_INDEX["jawOpen"]])
    shape = found.landmarks(found.expression_basis[EXPRESSION_INDEX["jawOpen"]])
    np.testing.assert_allclose(shape[:FACE], wanted[:FACE], atol=1.0)


@pytest.mark.slow
def test_our_own_detector_finds_the_face(head, skin, numbers, export, tmp_path):
    """On a mesh without eyes, from the outside; all that is left is where it sees lids and lips."""
    from bakery.heads.mesh.look import look
    from bakery.plugins import plug_in

    path = export(tmp_path / "skin.glb", Surface(0.1 * skin.vertices @ Z_UP.T, skin.faces))
    detector = plug_in("detectors", "network")
    found, about = import_mesh(
        path, head, lambda s, h, up: look(s, detector.detect, h, up), "again", MeshOptions()
    )
    assert any("the file's triangles" in line for line in about)
    off = shapes_off(found, head, numbers)
    for name in ("jawOpen", "mouthSmileLeft", "eyeBlinkLeft", "eyeBlinkRight", "mouthPucker"):
        assert np.percentile(off[EXPRESSION_INDEX[name]], 99) < 1.5, name
