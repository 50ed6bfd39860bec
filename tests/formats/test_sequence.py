"""Names of numbered pictures: what they mean, what is refused, what is there already."""

import pytest

from bakery.errors import InputError
from bakery.formats.sequence import check_output, sequence_of


@pytest.mark.parametrize(
    "output, name",
    [
        ("out/", "frame.00007.png"),
        ("out", "frame.00007.png"),
        ("shot.v003/", "frame.00007.png"),
        ("there.v1", "frame.00007.png"),
        ("out/f.%04d.png", "f.0007.png"),
        ("out/f.%4d.PNG", "f.0007.PNG"),
        ("out/f%d.png", "f7.png"),
        ("out/f_###_b.png", "f_007_b.png"),
    ],
)
def test_names(output, name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "there.v1").mkdir()
    found = sequence_of(output)
    assert found.path(7).name == name and found.path(123456).name != name
    folder = output.rstrip("/") if not output.lower().endswith(".png") else "out"
    assert found.folder.name == folder


def test_what_is_there(tmp_path):
    sequence = sequence_of(f"{tmp_path}/f[1].%03d.png")
    assert sequence.found() == [] and sequence_of(f"{tmp_path}/none/").found() == []
    for name in ("f[1].001.png", "f[1].1000.png"):
        (tmp_path / name).touch()
    for name in ("f[1].01.png", "f1.001.png", "f[1].001.png.key", "f[1].0x1.png"):
        (tmp_path / name).touch()
    assert [path.name for path in sequence.found()] == ["f[1].001.png", "f[1].1000.png"]
    assert str(sequence).endswith("f[1].###.png")


def test_what_is_refused(tmp_path):
    (tmp_path / "file").touch()
    for output, message in (
        ("a.png", "give a folder, or one number"), ("%d.%d.png", "one number"),
        ("a.%05x.png", "one number"), (f"{tmp_path}/file/a.#.png", "file: is a file"),
        ("a.avi", "give .webm .* or a folder"), ("a.jpg", "or frame.%05d.png for frames"),
    ):  # fmt: skip
        with pytest.raises(InputError, match=message):
            check_output(output)
    assert sequence_of("a.mp4") is None and check_output("a.webm") is None
