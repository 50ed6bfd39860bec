"""`bakery build` of one and of many: names, folders, what is fresh, what fails."""

import json
import shutil
from pathlib import Path

import pytest

FEW = Path(__file__).parents[1] / "few.toml"
QUICK = [
    "--preset", "small", "--expressions", FEW, "--set", "texture.views=[0.0]",
    "--generator", "rendered", "--set", "bundle.formats=[]", "--hair", "none", "--complete", "none",
]  # fmt: skip


@pytest.fixture(scope="module")
def folder(portrait, tmp_path_factory):
    """Two portraits with their landmarks, a hidden file, a text, and a picture of nobody."""
    import numpy as np

    from bakery.formats.image import write_image

    photo, marks = portrait
    place = tmp_path_factory.mktemp("photos")
    for name in ("ada", "bob"):
        shutil.copy(photo, place / f"{name}.png")
        shutil.copy(marks, place / f"{name}.json")
    shutil.copy(photo, place / ".hidden.png")
    (place / "notes.txt").write_text("no picture")
    write_image(place / "sky.png", np.full((300, 300, 3), 0.6, np.float32))
    return place


def states(done):
    return {row["photo"].split("/")[-1]: row for row in map(json.loads, done.stdout.splitlines())}


@pytest.fixture(scope="module")
def baked(bakery, folder, tmp_path_factory):
    out = tmp_path_factory.mktemp("out") / "avatars"
    command = ["build", folder, "-o", out, "--landmarks", folder, "--jobs", 2, "--json", *QUICK]
    return out, command, bakery(*command)  # in two processes of their own


def test_a_folder_becomes_bundles_and_one_bad_photo_stops_no_other(baked, bakery):
    out, _, done = baked
    rows = states(done)
    assert sorted(path.name for path in out.iterdir()) == ["ada.avatar", "bob.avatar", "index.html"]
    assert "ada.avatar/preview.png" in (out / "index.html").read_text()
    assert rows["ada.png"]["state"] == rows["bob.png"]["state"] == "baked"
    assert rows["sky.png"]["state"] == "failed" and "sky.json" in rows["sky.png"]["error"]
    assert done.returncode == 1 and "2 baked, 0 fresh, 1 failed" in done.stderr
    assert "Traceback" not in done.stderr and ".hidden" not in done.stderr
    assert bakery("validate", out / "ada.avatar").returncode == 0


def test_fresh_bundles_are_skipped_and_stale_ones_need_overwrite(baked, bakery, folder):
    out, command, _ = baked
    before = (out / "ada.avatar" / "avatar.json").read_bytes()
    command = [1 if word == 2 else word for word in command]  # process
    rows = states(bakery(*command))
    assert rows["ada.png"]["state"] == rows["bob.png"]["state"] == "fresh"
    other = [*command, "--set", "mask.resolution=64"]
    rows = states(bakery(*other))
    assert rows["ada.png"]["state"] == "failed" and "--overwrite" in rows["ada.png"]["error"]
    assert (out / "ada.avatar" / "avatar.json").read_bytes() == before
    (out / "bob.avatar" / "face.exr").unlink()
    rows = states(bakery(*command, "--overwrite"))
    assert rows["ada.png"]["state"] == "fresh" and rows["bob.png"]["state"] == "baked"


def test_a_dry_run_of_many_says_what_the_run_would_do(baked, bakery):
    out, command, _ = baked
    command = [1 if word == 2 else word for word in command]
    done = bakery(*command, "-n")
    assert done.returncode == 1 and "1 of 3 portraits would fail; see above" in done.stderr
    assert "sky.png: would fail: " in done.stderr and "sky.json" in done.stderr
    assert done.stdout.count(": is fresh") == 2 and "photo " not in done.stdout
    done = bakery(*command, "-n", "--overwrite", "--set", "mask.resolution=64")
    assert done.returncode == 1 and done.stdout.count("photo ") == 2, done.stderr


def test_one_fresh_bundle_is_skipped_if_asked(baked, bakery, folder):
    """What a farm calls: once more is no error, but a stale bundle is."""
    out, _, _ = baked
    one = ["build", folder / "bob.png", "-o", out / "bob.avatar", "--landmarks", folder, *QUICK]
    before = (out / "bob.avatar" / "avatar.json").stat().st_mtime_ns
    done = bakery(*one, "--skip-fresh", "--json")
    assert done.returncode == 0 and states(done)["bob.png"]["state"] == "fresh", done.stderr
    assert (out / "bob.avatar" / "avatar.json").stat().st_mtime_ns == before
    assert bakery(*one).returncode == 1
    done = bakery(*one, "--skip-fresh", "--set", "mask.resolution=64")
    assert done.returncode == 1 and "--overwrite" in done.stderr


def test_without_o_the_bundle_stands_beside_the_photo(bakery, portrait, tmp_path):
    shutil.copy(portrait[0], tmp_path / "my portrait.png")
    done = bakery("build", tmp_path / "my portrait.png", "--landmarks", portrait[1], *QUICK)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "my portrait.avatar" / "avatar.json").is_file()
    done = bakery("build", tmp_path / "my portrait.png", "--landmarks", portrait[1], *QUICK)
    assert done.returncode == 1 and "--overwrite" in done.stderr


@pytest.mark.parametrize(
    "arguments, code, message",
    [
        (["empty"], 1, "a folder without a picture"),
        (["one.png", "-o", "x.glb"], 2, "a bundle is a folder"),
        (["one.png", "two.png", "-o", "out", "--work", "w"], 2, "--work"),
        (["one.png", "--jobs", "0"], 2, "jobs"),
        (["nowhere.png"], 1, "no such file"),
        (["one.png", "sub/one.png", "-o", "out"], 1, "both become"),
    ],
)
def test_what_is_refused_is_one_line(bakery, portrait, tmp_path, arguments, code, message):
    (tmp_path / "empty").mkdir()
    (tmp_path / "sub").mkdir()
    for name in ("one.png", "two.png", "sub/one.png"):
        shutil.copy(portrait[0], tmp_path / name)
    done = bakery("build", *arguments, cwd=tmp_path)
    assert done.returncode == code and message in done.stderr, done.stderr
    assert "Traceback" not in done.stderr
    assert not list(tmp_path.rglob("*.avatar"))


def test_photos_of_one_name_keep_their_ending(tmp_path):
    from bakery.bake.batch import places

    photos = [tmp_path / "ada.png", tmp_path / "ada.jpg", tmp_path / "bob.png"]
    assert [bundle.name for _, bundle in places(photos, tmp_path)] == [
        "ada.png.avatar", "ada.jpg.avatar", "bob.avatar",
    ]  # fmt: skip


def test_a_process_that_dies_is_named_and_stops_no_other(portrait, tmp_path, monkeypatch):
    """What was in work with it is tried again, alone."""
    from concurrent.futures import Future
    from concurrent.futures.process import BrokenProcessPool

    from bakery.bake import batch

    class Pool:
        """Dies when the deadly photo is in work, as a process pool does: with all that it holds."""

        def __init__(self, *given):
            self.dead = False

        __enter__ = lambda self: self  # noqa: E731
        __exit__ = lambda self, *given: None  # noqa: E731

        def submit(self, work, request):
            future = Future()
            self.dead |= request.photo.name == "deadly.png"
            if self.dead:
                future.set_exception(BrokenProcessPool())
            else:
                future.set_result(batch.Outcome(str(request.photo), "", "baked"))
            return future

    monkeypatch.setattr(batch, "ProcessPoolExecutor", Pool)
    names = ["a.png", "deadly.png", "b.png", "c.png"]
    common = batch.Request(tmp_path / "a.png", tmp_path / "a.avatar")
    asked = batch.requests_of([(tmp_path / n, tmp_path / f"{n}.avatar") for n in names], common)
    found = {made.photo.split("/")[-1]: made for made in batch.bake_all(asked, 2)}
    assert set(found) == set(names)
    assert found["deadly.png"].state == "failed" and "--jobs" in found["deadly.png"].error
    assert all(found[name].state == "baked" for name in names if name != "deadly.png")
