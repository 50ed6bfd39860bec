"""Live Link Face CSV: what is read, what is mended, what is refused; round trips."""

import gzip

import numpy as np
import pytest

from bakery.errors import InputError
from bakery.formats import livelink
from bakery.formats.livelink import EYES, HEAD, ORDER, format_take, parse_take, read_take
from bakery.types import EXPRESSION_INDEX, EXPRESSIONS

COLUMNS = ["Timecode", "BlendShapeCount", *ORDER, *HEAD, *EYES]


def row(frame, count=61, **values):
    """A row of a take at 30 frames a second, as a table by column."""
    seconds, frames = divmod(2 * frame, 60)
    table = dict.fromkeys(COLUMNS, 0.0) | values
    return table | {"Timecode": f"10:20:{30 + seconds}:{frames:02d}.250", "BlendShapeCount": count}


def text(rows, columns=COLUMNS):
    lines = [",".join(columns)]
    lines += [r if isinstance(r, str) else ",".join(str(r[c]) for c in columns) for r in rows]
    return "\n".join(lines).encode()


def of(take, name):
    return take.weights[:, EXPRESSION_INDEX[name]]


def test_names_decide_and_not_the_order():
    rows = [row(0, JawLeft=0.1, JawRight=0.7), row(1, JawLeft=0.2, EyeBlinkRight=1.0)]
    take = parse_take("a.csv", text(rows))
    assert sorted(map(str.lower, ORDER)) == sorted(map(str.lower, EXPRESSIONS))
    np.testing.assert_allclose(of(take, "jawLeft"), [0.1, 0.2])
    np.testing.assert_allclose(of(take, "jawRight"), [0.7, 0.0])
    np.testing.assert_allclose(take.seconds, [0, 1 / 30], atol=1e-9)
    assert take.rate == 30 and take.notes == ()
    assert take.start == 10 * 3600 + 20 * 60 + 30 + 0.25 / 60

    shuffled = list(np.random.default_rng(0).permutation(COLUMNS))
    other = parse_take("b.csv", text(rows, shuffled))
    np.testing.assert_array_equal(other.weights, take.weights)


def test_spellings_of_names():
    names = {"EyeBlinkLeft": "eyeBlink_L", "JawOpen": "jaw open", "TongueOut": "TONGUE_OUT"}
    header = ",".join(names.get(column, column) for column in COLUMNS)
    data = text([row(0, EyeBlinkLeft=0.5, JawOpen=0.25)]).decode().splitlines()
    take = parse_take("a.csv", ("\ufeff" + header + "\r\n\r\n" + data[1] + "\r\n").encode())
    assert of(take, "eyeBlinkLeft") == 0.5 and of(take, "jawOpen") == 0.25


def test_angles_have_the_signs_of_real_takes():
    """Eyes to the subject's right and down are positive in the file."""
    values = {"HeadYaw": 0.1, "HeadPitch": 0.2, "HeadRoll": 0.3, "LeftEyeYaw": 0.4}
    take = parse_take("a.csv", text([row(0, **values, RightEyePitch=0.5)]))
    np.testing.assert_allclose(take.head[0], np.degrees([-0.1, -0.2, 0.3]))
    np.testing.assert_allclose(take.eyes[0], np.degrees([[-0.4, 0], [0, -0.5]]))


def test_rotations_may_be_missing():
    columns = [c for c in COLUMNS if c not in HEAD + EYES]
    take = parse_take("a.csv", text([row(0, count=52)], columns))
    assert take.eyes is None and not take.head.any()


def test_dropped_frames_lie_on_the_line_and_values_are_clamped():
    rows = ["10:20:29:00.0,0", row(0, JawOpen=0.2), "10:20:30:02.25,0,,,", "10:20:30:04.25,0"]
    rows += [row(3, JawOpen=0.5), row(4, JawOpen=1.25, CheekPuff=-0.5), "10:20:30:10.25,0"]
    take = parse_take("a.csv", text(rows))
    np.testing.assert_allclose(of(take, "jawOpen"), [0.2, 0.2, 0.3, 0.4, 0.5, 1, 1.0], atol=1e-6)
    assert of(take, "cheekPuff").min() == 0
    assert "4 dropped" in take.notes[0] and "2 coefficients clamped" in take.notes[1]
    assert "cheekPuff -0.500" in take.notes[1]


def test_midnight_repeated_rows_and_unknown_columns():
    first, second = row(0), row(1, JawOpen=1.0)
    first["Timecode"], second["Timecode"] = "23:59:59:58.0", "00:00:00:00.0"
    again = second | {"JawOpen": 0.5}
    columns = COLUMNS + ["Mood"]
    rows = [r | {"Mood": "good", "BlendShapeCount": 62} for r in (first, second, again)]
    take = parse_take("a.csv", text(rows, columns))
    np.testing.assert_allclose(take.seconds, [0, 2 / 60], atol=1e-6)
    assert of(take, "jawOpen")[1] == 1
    assert "Mood" in take.notes[0] and "1 row (4) left out" in take.notes[1]


def put(column, value, count=61):
    return text([row(0), row(1, count=count, **{column: value})])


WRONG = {
    "nan": (put("JawOpen", "NaN"), "row 3, column JawOpen: 'NaN' is no number"),
    "infinite": (put("JawOpen", "1e999"), "row 3, column JawOpen: '1e999'"),
    "underscore": (put("JawOpen", "1_0"), "row 3, column JawOpen: '1_0'"),
    "hex": (put("JawOpen", "0x1"), "row 3, column JawOpen"),
    "empty": (put("JawOpen", ""), "row 3, column JawOpen: '' is no number"),
    "degrees": (put("HeadYaw", "35.0"), "row 3, column HeadYaw: 35 radians"),
    "count": (put("JawOpen", 0, count=52), "row 3, column BlendShapeCount: '52', but the header has 61"),
    "short": (text([row(0), "10:20:31:00.0,61,0.5"]), "row 3: 3 fields, the header has 63"),
    "time": (text(["10:20:31:60.0,0"]), "row 2, column Timecode: '10:20:31:60.0'"),
    "no time": (text([row(0), "now,0"]), "row 3, column Timecode: 'now'"),
    "missing": (text([row(0)], COLUMNS[3:]), "lacks column Timecode, BlendShapeCount, EyeBlinkLeft"),
    "one angle": (text([row(0)], [c for c in COLUMNS if c != "HeadRoll"]), "lacks column HeadRoll"),
    "twice": (text([row(0)], [*COLUMNS, "JawOpen"]), "column JawOpen is there twice"),
    "bars": (text([row(0)]).replace(b",", b"|"), "row 1: fields are separated by '|'; separate them"),
    "one word": (b"jawOpen\n0.5\n", "row 1: holds one field; separate them by comma"),
    "open quote": (put("JawOpen", '"0.5'), "row 3: a quote is not closed"),
    "power": (put("JawOpen", 0, count="6\u00b9"), "BlendShapeCount: '6\u00b9'"),
    "many digits": (put("JawOpen", 0, count="6" * 5000), "BlendShapeCount: '666"),
    "arabic": (put("JawOpen", "\u0660.\u0665"), "column JawOpen: '\u0660.\u0665' is no number"),
    "only dropped": (text(["10:20:31:00.0,0"]), "no frame with values"),
    "header alone": (text([]), "no frame with values"),
    "blank": (b"\n \n", "holds no rows"),
    "picture": (b"\x89PNG\xff\xfe", "not text"),
}  # fmt: skip


@pytest.mark.parametrize("case", WRONG)
def test_wrong_takes_are_refused_by_row_and_column(case):
    data, message = WRONG[case]
    with pytest.raises(InputError, match="a.csv") as caught:
        parse_take("a.csv", data)
    assert message in str(caught.value) and "\n" not in str(caught.value)


def counted(base, rate, seconds=3.0, first=0.0):
    """A take whose time code counts `base` frames a second, recorded at `rate`; a ramp of the jaw."""
    rows = []
    for k in range(round(seconds * rate)):
        whole, frames = divmod(first + k * base / rate, base)
        code = f"10:20:{30 + int(whole):02d}:{frames:06.3f}"
        rows.append(row(0, JawOpen=k / (seconds * rate)) | {"Timecode": code})
    return rows


@pytest.mark.parametrize("base", [24, 25, 30, 48, 50])
@pytest.mark.parametrize("share", [1, 0.5, 2])
def test_the_base_of_the_time_code_is_found(base, share):
    """Counted by the camera's frames, by half and by double of them (FF.500); begun anywhere."""
    take = parse_take("a.csv", text(counted(base, base * share, first=base / 3)))
    assert len(take.seconds) == round(3 * base * share)
    np.testing.assert_allclose(np.diff(take.seconds), 1 / (base * share), atol=1e-4)
    assert take.rate == base * share or base * share not in livelink.RATES
    assert take.notes == (f"time code read at {base} frames a second",)


@pytest.mark.parametrize("rate", [1, 5, 10, 15, 24, 25, 30, 60])
def test_sixtieths_stay_sixtieths(rate):
    take = parse_take("a.csv", text(counted(60, rate)))
    np.testing.assert_allclose(np.diff(take.seconds), 1 / rate, atol=1e-4)
    assert take.notes == ()


def test_ninety_rows_are_three_seconds():
    """FF 0 to 29, the rows of three seconds, whole frames; holes and tremor do not hide the base."""
    rows = [row(0) | {"Timecode": f"10:20:{30 + k // 30}:{k % 30:02d}"} for k in range(90)]
    take = parse_take("a.csv", text(rows))
    assert len(take.seconds) == 90 and take.rate == 30
    assert take.seconds[-1] == pytest.approx(89 / 30)
    del rows[28:33], rows[70]
    assert parse_take("a.csv", text(rows)).seconds[-1] == pytest.approx(89 / 30)
    rng = np.random.default_rng(0)
    shaken = counted(30, 30, seconds=5)
    for k, one in enumerate(shaken):
        whole, frames = divmod(k + rng.uniform(0, 0.3), 30)
        one["Timecode"] = f"10:20:{30 + int(whole)}:{frames:06.3f}"
    shaken = [shaken[0], *(one for one in shaken[1:-1] if rng.random() > 0.1), shaken[-1]]
    assert parse_take("a.csv", text(shaken)).seconds[-1] == pytest.approx(149 / 30, abs=0.02)


def test_the_base_can_be_given():
    short = [row(0) | {"Timecode": f"10:20:30:{k:02d}"} for k in range(20)]
    take = parse_take("a.csv", text(short))
    assert take.rate == 60 and "too short to tell" in take.notes[0]
    take = parse_take("a.csv", text(short), base=30)
    assert take.rate == 30 and take.notes == ()
    assert parse_take("a.csv", text(counted(120, 120)), base=120).rate == pytest.approx(
        120, rel=1e-3
    )
    with pytest.raises(InputError, match="row 2, column Timecode: '10:20:30:30'; .* FF below 30"):
        parse_take("a.csv", text([row(0) | {"Timecode": "10:20:30:30"}]), base=30)


def test_a_take_without_a_tongue():
    columns = [c for c in COLUMNS if c != "TongueOut"]
    take = parse_take("a.csv", text([row(0, count=60, JawOpen=0.5)], columns))
    assert of(take, "tongueOut") == 0 and of(take, "jawOpen") == 0.5
    assert take.notes == ("no column TongueOut; taken as 0",)


def test_quotes_and_other_separators():
    """As spreadsheets write it: quotes, a comment over two lines, decimal commas, empty rows."""
    rows = [row(0, JawOpen=0.25), row(1, JawOpen=0.75)]
    wanted = parse_take("a.csv", text(rows))
    plain = text(rows).decode()
    quoted = "\r\n".join(
        ",".join(f'"{field}"' for field in line.split(",")) for line in plain.splitlines()
    )
    extra = [c | {"Note": '"a ""smile"",\nand more"', "BlendShapeCount": 62} for c in rows]
    for other in (
        "\ufeff" + quoted + "\r\n",
        quoted.replace(",", " ; ") + "\r\n" + 62 * ";",
        plain.replace(",", "\t"),
        plain.replace(",", ";").replace(".", ","),
        text(extra, [*COLUMNS, "Note"]).decode(),
    ):
        take = parse_take("b.csv", other.encode())
        np.testing.assert_allclose(take.weights, wanted.weights)
        np.testing.assert_allclose(take.seconds, wanted.seconds)
    damaged = text([extra[0], extra[1] | {"JawOpen": "x"}], [*COLUMNS, "Note"])
    with pytest.raises(InputError, match="row 4, column JawOpen: 'x'"):  # rows count as lines do
        parse_take("b.csv", damaged)


def test_a_head_that_turns_past_its_back():
    """From 179 to -179 degrees are 2 degrees, not 358; the file holds angles within half a turn."""
    turns = np.radians([170, 179, -179, -170])
    rows = [row(k, HeadRoll=f"{turn:.8f}") for k, turn in enumerate(turns)]
    rows.insert(2, "10:20:30:03.25,0")
    take = parse_take("a.csv", text(rows))
    np.testing.assert_allclose(take.head[:, 2], [170, 179, 180, 181, 190], atol=1e-5)
    assert take.at([2.5 / 30])[1][0, 2] == pytest.approx(185.5, abs=0.01)
    again = parse_take("a.csv", format_take(take))
    np.testing.assert_allclose(again.head, take.head, atol=1e-6)


def random_take(count=40):
    rng = np.random.default_rng(3)
    weights = rng.random((count, 52)).astype(np.float32)
    head, eyes = rng.normal(0, 10, (count, 3)), rng.normal(0, 10, (count, 2, 2))
    return livelink.Take(np.arange(count) / 30, weights, head, eyes, start=86399.5)


def test_round_trip(tmp_path):
    """Ten digits and thousandths of a sixtieth of a second, over midnight."""
    take = random_take()
    (tmp_path / "take.csv").write_bytes(format_take(take))
    back = read_take(tmp_path / "take.csv")
    np.testing.assert_allclose(back.weights, take.weights, atol=1e-7)
    np.testing.assert_allclose(back.head, take.head, atol=1e-8)
    np.testing.assert_allclose(back.eyes, take.eyes, atol=1e-8)
    np.testing.assert_allclose(back.seconds, take.seconds, atol=1.1e-3 / 60)
    assert format_take(back).splitlines()[5] == format_take(take).splitlines()[5]


def test_packed_takes(tmp_path):
    path = tmp_path / "take.csv.gz"
    data = gzip.compress(format_take(random_take()))
    path.write_bytes(data)
    assert len(read_take(path).seconds) == 40
    path.write_bytes(data[:-40])
    with pytest.raises(InputError, match="truncated .gz"):
        read_take(path)
    path.write_bytes(data[:30] + b"\xff\xff" + data[32:])
    with pytest.raises(InputError, match=".gz"):
        read_take(path)


def test_a_packed_bomb_is_not_unpacked(tmp_path, monkeypatch):
    monkeypatch.setattr(livelink, "LARGEST", 10_000)
    path = tmp_path / "take.csv.gz"
    path.write_bytes(gzip.compress(b"0" * 20_000))
    with pytest.raises(InputError, match="unpacks to more"):
        read_take(path)


def test_between_rows_values_lie_on_the_line():
    take = parse_take(
        "a.csv", text([row(0, JawOpen=0.0), row(1, JawOpen=0.6), row(3, JawOpen=0.0)])
    )
    weights, head, eyes = take.at([-1, 0, 0.5 / 30, 2 / 30, 9])
    np.testing.assert_allclose(
        weights[:, EXPRESSION_INDEX["jawOpen"]], [0, 0, 0.3, 0.3, 0], atol=1e-6
    )
    assert head.shape == (5, 3) and eyes.shape == (5, 2, 2)
    alone = parse_take("a.csv", text([row(0, JawOpen=0.6)]))
    assert alone.at([0, 1])[0][:, EXPRESSION_INDEX["jawOpen"]].tolist() == pytest.approx([0.6, 0.6])
    assert alone.rate == 30


def test_real_takes(shared):
    """The app's own files: every row counts, three frames are missing in between."""
    folder = shared / "drivers" / "livelinkface"
    take = read_take(folder / "alex_rom_3.csv.gz")
    assert len(take.seconds) == 4030 and take.rate == 30
    assert take.seconds[-1] == pytest.approx(134.38, abs=0.01)
    left = take.weights[:, EXPRESSION_INDEX["eyeLookOutLeft"]]
    left = left - take.weights[:, EXPRESSION_INDEX["eyeLookInLeft"]]
    assert np.corrcoef(left, take.eyes[:, 0, 0])[0, 1] > 0.99


def test_visemes_are_added_to_the_shapes_that_they_are_mixed_of():
    columns = [*COLUMNS, "viseme_aa", "mouthSmile"]
    rows = [
        row(0, 63, viseme_aa=1.0, mouthSmile=0.0),
        row(1, 63, viseme_aa=0.5, mouthSmile=2.0, JawOpen=0.9, MouthSmileLeft=0.3),
    ]
    take = parse_take("a.csv", text(rows, columns))
    np.testing.assert_allclose(of(take, "jawOpen"), [0.6, 1.0], atol=1e-6)  # to 1 at most
    np.testing.assert_allclose(of(take, "mouthLowerDownLeft"), [0.2, 0.1], atol=1e-6)
    np.testing.assert_allclose(of(take, "mouthSmileLeft"), [0, 1], atol=1e-6)
    assert take.notes == ()
