"""No command replaces a file that it did not make, unless it is told to."""

import os
import shutil
from pathlib import Path

import click
import pytest

from bakery.cli import main as cli
from bakery.cli import places
from bakery.errors import InputError, UsageProblem
from bakery.formats.files import DiskError

SAMPLE = Path(__file__).parents[2] / "samples" / "chidi.jpg"
READ = {  # options that name a file or folder to read
    "network",
    "landmarks", "fitted", "textures", "masks", "photos", "dense", "backgrounds",
    "expressions", "skins", "pairs", "performers", "features", "portraits", "points", "wheel", "curves", "sound", "take",
    "bank", "file", "finder", "eye", "mouth", "real", "teacher", "weights", "meshes", "sign", "trust", "turned",
}  # fmt: skip
FILES = {
    "output",
    "mask",
    "preview",
    "picture",
    "to",
}  # to write: a file, or a folder where the command makes several files
FOLDERS = {"module", "pictures", "folder", "run", "work", "fits"}  # to write: always a folder
FILLED = {"synth samples", "synth failures"}  # whose --output is a folder of many files
GO_ON = {  # leave what is there alone
    "synth training", "synth pairs", "synth performers", "synth portraits", "synth skins",
    "train interiors", "train pairs", "farm",
}  # fmt: skip
BUNDLES = {"build", "bundle"}  # whose --output is a bundle
NAMES = {"name": "makehuman", "truth": "makehuman", "network": "finder"}  # arguments: no paths


def leaves(group=cli.bakery, words=()):
    """(words, click.Command) of every command that is no group."""
    context = click.Context(group)
    for name in group.list_commands(context):
        command = group.get_command(context, name)
        if isinstance(command, click.Group):
            yield from leaves(command, (*words, name))
        else:
            yield " ".join((*words, name)), command


COMMANDS = dict(leaves())


def path_options(command):
    return [
        parameter
        for parameter in command.params
        if isinstance(parameter, click.Option)
        and (isinstance(parameter.type, click.Path) or parameter.name == "output")
    ]


WRITES = [
    (name, option.name)
    for name, command in COMMANDS.items()
    for option in path_options(command)
    if option.name in FILES | FOLDERS
    and not (option.name == "masks")
]  # fmt: skip


def test_every_path_option_is_known_as_read_or_written():
    for name, command in COMMANDS.items():
        for option in path_options(command):
            assert option.name in READ | FILES | FOLDERS, f"{name} --{option.name}: add it above"
    assert {name for name, _ in WRITES} >= {"build", "render", "preview", "train gaze", "detect"}


def test_who_writes_can_be_told_to_overwrite():
    for name, option in WRITES:
        if option in {"run", "work"} or name in GO_ON:
            continue
        assert any(p.name == "overwrite" for p in COMMANDS[name].params), name


def line_of(name, option, place, folder, text="mine"):
    """A command line that gives every argument and required option, and `place` for the option."""
    words = name.split()
    source = folder / "source"
    source.mkdir(exist_ok=True)
    photo = shutil.copy(SAMPLE, source / "photo.jpg")
    (source / "file").write_text(text)
    for parameter in COMMANDS[name].params:
        given = None
        if parameter.name == option:
            given = place
        elif parameter.name in FILES | FOLDERS:
            given = folder / f"other{ending(name)}" if parameter.required else None
        elif isinstance(parameter, click.Argument):
            given = photo if parameter.name in ("photo", "photos") else source
            given = NAMES.get(parameter.name, given)
        elif parameter.name == "kind":
            given = "commands"
        elif parameter.required:
            given = {"count": 1, "name": "preview"}.get(parameter.name, source / "file")
            if getattr(parameter.type, "file_okay", True) is False:
                given = source
        if given is not None:
            flag = [] if isinstance(parameter, click.Argument) else [parameter.opts[-1]]
            words += [*flag, str(given)]
    return words


def ending(name):
    files = {
        "recover": ".exr",
        "albedo": ".exr",
        "build": ".avatar",
        "animate": ".mp4",
        "perform": ".mp4",
        "hair": ".glb",
    }
    return files.get(name, ".png")


def run(words):
    """Exit code of the program, in this process."""
    with pytest.raises(SystemExit) as ended:
        cli.main(list(map(str, words)))
    return ended.value.code


@pytest.mark.parametrize("name, option", WRITES, ids=lambda part: part)
def test_a_file_that_is_there_stays(name, option, tmp_path, capsys):
    """A file in the place of a file or folder, and files in the place of a folder that is filled."""
    mine = tmp_path / f"mine{ending(name)}"
    mine.write_text("mine")
    code = run(line_of(name, option, mine, tmp_path))
    said = capsys.readouterr().err
    assert code in (1, 2) and str(mine) in said and "Traceback" not in said, said
    assert "already there" in said or "no folder" in said, said
    assert len(said.splitlines()) == 1 and mine.read_text() == "mine"


@pytest.mark.parametrize(
    "name, option",
    [(name, option) for name, option in WRITES
     if option in FOLDERS or name in BUNDLES | FILLED],
    ids=lambda part: part,
)  # fmt: skip
def test_files_in_a_folder_stay(name, option, tmp_path, capsys):
    folder = tmp_path / "mine"
    folder.mkdir()
    (folder / "fit.json").write_text("mine")
    code = run(line_of(name, option, folder, tmp_path))
    said = capsys.readouterr().err
    assert code == 1 and len(said.splitlines()) == 1 and str(folder) in said, said
    assert "other files" in said or "holds files" in said, said
    assert os.listdir(folder) == ["fit.json"] and (folder / "fit.json").read_text() == "mine"


def test_a_sheet_that_is_there_stays(tmp_path, capsys):
    (tmp_path / "makehuman-people.jpg").write_text("mine")
    assert run(["heads", "sheet", "makehuman", "-o", tmp_path]) == 1
    assert "makehuman-people.jpg: is already there" in capsys.readouterr().err
    assert os.listdir(tmp_path) == ["makehuman-people.jpg"]


@pytest.mark.parametrize("name, option", WRITES, ids=lambda part: part)
def test_nothing_is_written_into_a_bundle(name, option, tmp_path, capsys):
    inside = tmp_path / "a.avatar"
    inside.mkdir()
    (inside / "avatar.json").write_text("{}")
    for overwrite in ([], ["--overwrite"]):
        if overwrite and not any(p.name == "overwrite" for p in COMMANDS[name].params):
            continue
        place = inside / f"preview{ending(name)}"
        code = run([*line_of(name, option, place, tmp_path), *overwrite])
        said = capsys.readouterr().err
        assert code == 2 and "lies in the bundle" in said, said
    assert os.listdir(inside) == ["avatar.json"]


@pytest.mark.parametrize(
    "name, option", [each for each in WRITES if each[1] == "output"], ids=lambda part: part
)
def test_a_place_that_cannot_be_written_is_told_at_once(name, option, tmp_path, capsys):
    (tmp_path / "file").write_text("x")
    for folder, stem in ((tmp_path / "file", "x"), (tmp_path, "x" * 300), (Path("/proc"), "x")):
        place = folder / f"{stem}{ending(name)}"
        code = run(line_of(name, option, place, tmp_path))
        said = capsys.readouterr().err
        assert code in (1, 2) and len(said.splitlines()) == 1 and "Traceback" not in said, said
        causes = ("no folder", "cannot be written", "too long")
        assert any(cause in said for cause in causes), said


def test_an_input_is_never_written(tmp_path, capsys):
    photo = tmp_path / "a.jpg"
    shutil.copy(SAMPLE, photo)
    before = photo.read_bytes()
    for words in (
        ["detect", photo, "-o", photo, "--overwrite"],
        ["generate", photo, "-o", photo, "--overwrite"],
        ["generate", photo, "-o", tmp_path / "b.png", "--mask", tmp_path / "b.png"],
        ["generate", photo, "-o", tmp_path / "b.png", "--mask", tmp_path / "x" / ".." / "b.png"],
        ["retarget", photo, "-o", photo, "--overwrite"],
        ["mask", "--preset", photo, "-o", photo, "--overwrite"],
    ):
        assert run(words) in (1, 2)
        said = capsys.readouterr().err
        assert "is also" in said or "is no folder" in said, said
        assert photo.read_bytes() == before
    link = tmp_path / "link.jpg"
    link.symlink_to(photo)
    assert run(["generate", link, "-o", photo, "--overwrite"]) == 2
    assert os.listdir(tmp_path) != [] and photo.read_bytes() == before


def test_endings_are_told_before_the_work(tmp_path, capsys):
    for words in (
        ["generate", SAMPLE, "-o", tmp_path / "g.exr"],
        ["generate", SAMPLE, "-o", tmp_path / "g.png", "--mask", tmp_path / "m.tif"],
        ["generate", SAMPLE, "--curves", SAMPLE, "-o", tmp_path / "g.avi"],
        ["recover", tmp_path, "-o", tmp_path / "g.png"],
        ["synth", "sheet", tmp_path, "-o", tmp_path / "g.gif"],
    ):
        assert run(words) in (1, 2)
        said = capsys.readouterr().err
        assert "names no file that ends in" in said or "videos are written as" in said, said


def test_may_write(tmp_path):
    places.may_write(None, False)
    new = tmp_path / "deep" / "er" / "new.json"
    places.may_write(new, False)
    assert os.listdir(tmp_path) == []
    (tmp_path / "old.json").write_text("old")
    with pytest.raises(InputError, match="already there; --overwrite"):
        places.may_write(tmp_path / "old.json", False)
    places.may_write(tmp_path / "old.json", True)
    (tmp_path / "dangling").symlink_to(tmp_path / "nothing")
    with pytest.raises(InputError, match="already there"):
        places.may_write(tmp_path / "dangling", False)
    with pytest.raises(InputError, match="is a folder"):
        places.may_write(tmp_path, True)
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(InputError, match="no ordinary file"):
        places.may_write(tmp_path / "pipe", True)
    with pytest.raises(UsageProblem, match="is also the input"):
        places.may_write(tmp_path / "old.json", True, inputs=[tmp_path / "old.json"])
    with pytest.raises(DiskError, match="shorter name"):
        places.may_write(tmp_path / ("x" * 256), True)


def test_a_folder_nobody_may_write_to(tmp_path, monkeypatch):
    def refuse(**_):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(places.tempfile, "TemporaryFile", refuse)
    with pytest.raises(DiskError, match="Permission denied.*write elsewhere"):
        places.may_write(tmp_path / "a.json", False)


def test_runs_go_on_in_their_own_folders_only(tmp_path):
    places.may_go_on(None)
    places.may_go_on(tmp_path / "new", marks=["options.json"])
    (tmp_path / "letter.txt").write_text("dear")
    with pytest.raises(InputError, match="a folder of other files"):
        places.may_go_on(tmp_path, marks=["options.json"])
    (tmp_path / "options.json").write_text("{}")
    places.may_go_on(tmp_path, marks=["options.json"])


def test_an_unreadable_file_is_no_wrong_usage():
    """Whoever reads a photo that may not be read says so, and the exit code is 1."""
    for name, command in COMMANDS.items():
        for parameter in command.params:
            if isinstance(parameter.type, click.Path):
                assert not parameter.type.readable, name
