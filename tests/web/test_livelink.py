"""The page reads takes as Python does: the same values, the same refusals."""

import json

import numpy as np
import pytest

from bakery.errors import InputError
from bakery.formats.livelink import EYES, HEAD, ORDER, parse_take
from bakery.formats.targets import OTHERS
from bakery.types import EXPRESSIONS

NAMES = [*ORDER, *HEAD, *EYES]


def text(rows=5, names=NAMES, change=None):
    """A take as the app writes it; `change` may alter its rows (lists of fields)."""
    rng = np.random.default_rng(4)
    table = [["Timecode", "BlendShapeCount", *names]]
    for row in range(rows):
        numbers = [f"{value:.6f}" for value in rng.random(len(names))]
        table.append([f"23:59:59:{row * 2:02d}.250", str(len(names)), *numbers])
    if change:
        change(table)
    return "\n".join(",".join(fields) for fields in table) + "\n"


def at(row, column, value):
    def change(table):
        table[row][column] = value

    return change


def dropped(table):
    table[3] = [*table[3][:2]]


def backwards(table):
    table[2][0] = table[1][0]


def midnight(table):
    table[4][0], table[5][0] = "00:00:00:01.000", "00:00:00:03.500"


def counted(base, step=1.0, rows=70):
    """A take whose time code counts `base` frames a second, in steps of `step` frames."""

    def change(table):
        for k, row in enumerate(table[1:]):
            whole, frames = divmod(k * step, base)
            row[0] = f"10:00:{int(whole):02d}:{frames:06.3f}"

    return text(rows, change=change)


def holes(table):
    """Base 30: rows are missing, at the end of a second too, and others have no values."""
    for k, row in enumerate(table[1:]):
        row[0] = f"10:00:{k // 30:02d}:{k % 30:02d}"
    table[20] = table[20][:2]
    del table[28:34], table[50]


def remark(table):
    """A column that nobody knows, quoted, over two lines, with all that means something."""
    table[0].append('"A ""good""\n note"')
    for row in table[1:]:
        row[1] = str(len(NAMES) + 1)
        row.append('"1,5; ""\r\n\r\n"')


def speech(table):
    """A column for each name of other programs, some too large, and one shape that comes to over 1."""
    rng = np.random.default_rng(7)
    table[0] += list(OTHERS)
    for row in table[1:]:
        row[1] = str(len(NAMES) + len(OTHERS))
        row += [f"{value:.4f}" for value in rng.uniform(-0.2, 1.2, len(OTHERS))]


def backs(table):
    for k, row in enumerate(table[1:]):
        row[2 + NAMES.index("HeadRoll")] = f"{((k * 1.1 + 4) % 6.28) - 3.14:.6f}"


def as_text(separator, quote="", point="."):
    return "\n".join(
        separator.join(quote + field.replace(".", point) + quote for field in line.split(","))
        for line in text().splitlines()
    )


def shuffled(table):
    order = np.random.default_rng(9).permutation(len(NAMES)) + 2
    table[:] = [[*row[:2], *(row[k] for k in order)] for row in table]


GOOD = {
    "plain": text(),
    "shuffled": text(change=shuffled),
    "no head or eyes": text(names=list(ORDER)),
    "other spelling": text(change=at(0, 2, "eye_blink_L")),
    "outside": text(change=at(2, 10, "1.75")),
    "below": text(change=at(2, 10, "-0.5")),
    "exponent": text(change=at(2, 10, "+2.5e-1")),
    "dropped": text(change=dropped),
    "repeated time": text(change=backwards),
    "midnight": text(change=midnight),
    "base 24": counted(24),
    "base 25, half": counted(25, 0.5),
    "base 30": counted(30),
    "base 30, double": counted(30, 2.0),
    "base 48": counted(48, 1.0, 120),
    "base 50": counted(50, 2.0),
    "base 60 at 60": counted(60, 1.0, 130),
    "base 60 at 24": counted(60, 2.5),
    "short": counted(30, 1.0, 20),
    "holes": text(70, change=holes),
    "speech": text(change=speech),
    "past the back": text(9, change=backs),
    "no tongue": text(names=[name for name in NAMES if name != "TongueOut"]),
    "quotes": as_text(",", '"').replace("\n", "\r\n"),
    "quotes and blanks": as_text(" , ", '"'),
    "semicolons": as_text(";", point=","),
    "tabs": as_text("\t", '"'),
    "remark": text(change=remark),
    "empty rows": text().replace("\n", "\n,,,\n \n"),
    "windows": "\ufeff" + text().replace("\n", "\r\n"),
}
BAD = {
    "nan": text(change=at(2, 7, "nan")),
    "empty": text(change=at(2, 7, "")),
    "infinite": text(change=at(2, 7, "1e999")),
    "count": text(change=at(3, 1, "52")),
    "short row": text(change=lambda table: table[3].pop()),
    "time code": text(change=at(2, 0, "25:00:00:00.000")),
    "frames": text(change=at(2, 0, "10:00:00:60.000")),
    "degrees": text(change=at(2, 2 + NAMES.index("HeadYaw"), "12.5")),
    "missing column": text(names=NAMES[1:]),
    "half of the head": text(names=[name for name in NAMES if name != "HeadRoll"]),
    "twice": text(change=at(0, 3, "EyeBlinkLeft")),
    "two lines of a header": text(change=at(0, 5, '"EyeLook\nInLeft"')).replace("In", "Out"),
    "bars": as_text("|"),
    "blanks between": as_text(" "),
    "open quote": text(change=at(2, 7, '"0.5')),
    "quote inside": text(change=at(2, 7, '0".5"')),
    "decimal comma": text(change=at(2, 7, "0,5")),
    "two decimal commas": as_text(";").replace(";0.", ";0,5.", 1),
    "digits of another script": text(change=at(2, 7, "\u0660.\u0665")),
    "long count": text(change=at(2, 1, "6" * 400)),
    "no rows": text(rows=0),
    "nothing": "\n",
}


@pytest.fixture(scope="module")
def theirs(node, tmp_path_factory):
    """What the JavaScript reader says of every text."""
    folder = tmp_path_factory.mktemp("takes")
    (folder / "takes.json").write_text(json.dumps(GOOD | BAD))
    (folder / "names.json").write_text(json.dumps(EXPRESSIONS))
    script = __file__.replace("test_livelink.py", "livelink.mjs")
    return json.loads(node(script, folder / "takes.json", folder / "names.json"))


@pytest.mark.parametrize("name", GOOD)
def test_the_same_values(theirs, name):
    ours, seen = parse_take("take.csv", GOOD[name].encode()), theirs[name]
    assert "error" not in seen, seen
    np.testing.assert_allclose(seen["seconds"], ours.seconds, atol=1e-9)
    np.testing.assert_allclose(seen["weights"], ours.weights, atol=1e-6)
    np.testing.assert_allclose(seen["head"], ours.head, atol=1e-4)
    assert (seen["eyes"] is None) == (ours.eyes is None)
    if ours.eyes is not None:
        np.testing.assert_allclose(seen["eyes"], ours.eyes.mean(1), atol=1e-4)
    times = np.linspace(-0.1, ours.seconds[-1] + 0.1, 7)
    between = ours.at(times)
    np.testing.assert_allclose(seen["between"], between[0], atol=1e-5)
    np.testing.assert_allclose(seen["turned"], between[1], atol=1e-4)
    assert [note for note in seen["notes"] if "clamped" not in note] == [
        note for note in ours.notes if "clamped" not in note
    ]
    assert len(seen["notes"]) == len(ours.notes)


@pytest.mark.parametrize("name", BAD)
def test_the_same_refusals(theirs, name):
    with pytest.raises(InputError) as refused:
        parse_take("take.csv", BAD[name].encode())
    assert "error" in theirs[name], f"the page took it; Python says: {refused.value}"
    # Row and column are named alike; numbers may be written differently.
    assert theirs[name]["error"].split(";")[0][:60] == str(refused.value).split(";")[0][:60]
