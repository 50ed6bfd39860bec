"""Takes: what a face does over time, read from and written as Live Link Face CSV.

The rules, which every reader of the project follows (`web/` has them in JavaScript):

 1. Text is UTF-8 with or without a byte order mark, quoted as RFC 4180 has it or not, any line
    ends; rows without a field are passed over. Row 1 is the header; rows count from 1, as lines do.
    Fields are separated by what gives the header most of them: comma, semicolon or tab. If it is
    not the comma, a comma is a decimal point.
 2. Columns go by name, in any order. Names are compared without case, blanks and underscores, and a
    final L or R after an underscore means Left or Right: EyeBlinkLeft = eyeBlinkLeft = eyeBlink_L.
 3. Timecode, BlendShapeCount and all 52 ARKit names must be there once; TongueOut, which the first
    iPhones did not measure, may be missing (0, reported). HeadYaw, HeadPitch and HeadRoll may be
    missing together (the head stays still), and so may the six of LeftEye and RightEye (gaze then
    follows from the eyeLook names). Visemes and what else stands in `targets.OTHERS` may be there
    too: the shapes that each is mixed of are added, to 1 at most. Other columns are left out and
    reported.
 4. Timecode is HH:MM:SS:FF.mmm: FF.mmm counts frames, of which a second has 60, or as many as the
    caller says, or as many as its ends prove (`timecode.find_base`; reported). A step back by more
    than 12 hours is midnight. A row whose time is not later than the last one's is left out and
    reported.
 5. A row of two fields (all others missing or empty) is a dropped frame: its values lie on the line,
    in time, between the nearest rows that have some; before the first and after the last of those
    they are equal to it. Reported.
 6. Any other row has as many fields as the header, and BlendShapeCount says how many columns there
    are besides Timecode and itself. Otherwise: an error that names the row.
 7. A value is a decimal number, such as 0.5 or -1.2e-3. Anything else, NaN and infinity too: an
    error that names row and column. Coefficients outside 0..1 are clamped (before rule 5) and
    reported. Angles are radians; more than 2 pi is an error, for it was written in degrees.
 8. Yaw is positive to the subject's right, pitch is positive down, roll is positive towards the
    subject's left shoulder: how eye angles and eyeLook coefficients of real takes go together
    (correlation 0.999 and 0.996); the sense of roll follows from eye roll = yaw pitch there.
 9. The rate is 1 / (median step of time), and the nearest of 24, 25, 30, 48, 50, 60 if within 2%.
10. Between rows, values change linearly in time, head angles by the shorter way round; before the
    first and after the last they hold.
"""

import re
import zlib
from dataclasses import dataclass

import numpy as np

from bakery.check import check_array
from bakery.errors import InputError
from bakery.formats import timecode
from bakery.formats.files import read_bytes
from bakery.formats.rows import fields_of, records, separator_of
from bakery.formats.targets import OTHERS, other_weights
from bakery.types import EXPRESSIONS

LARGEST = 256 * 2**20  # bytes, unpacked: an hour at 60 frames a second has 180 MB
RATES = (24, 25, 30, 48, 50, 60)
OPTIONAL = "TongueOut"
HEAD = ("HeadYaw", "HeadPitch", "HeadRoll")
EYES = tuple(f"{eye}Eye{angle}" for eye in ("Left", "Right") for angle in ("Yaw", "Pitch", "Roll"))
# The order in which the app writes; `format_take` does the same.
ORDER = tuple(
    """EyeBlinkLeft EyeLookDownLeft EyeLookInLeft EyeLookOutLeft EyeLookUpLeft EyeSquintLeft
    EyeWideLeft EyeBlinkRight EyeLookDownRight EyeLookInRight EyeLookOutRight EyeLookUpRight
    EyeSquintRight EyeWideRight JawForward JawRight JawLeft JawOpen MouthClose MouthFunnel
    MouthPucker MouthRight MouthLeft MouthSmileLeft MouthSmileRight MouthFrownLeft MouthFrownRight
    MouthDimpleLeft MouthDimpleRight MouthStretchLeft MouthStretchRight MouthRollLower
    MouthRollUpper MouthShrugLower MouthShrugUpper MouthPressLeft MouthPressRight MouthLowerDownLeft
    MouthLowerDownRight MouthUpperUpLeft MouthUpperUpRight BrowDownLeft BrowDownRight BrowInnerUp
    BrowOuterUpLeft BrowOuterUpRight CheekPuff CheekSquintLeft CheekSquintRight NoseSneerLeft
    NoseSneerRight TongueOut""".split()
)
NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
COUNT = re.compile(r"\d{1,6}", re.ASCII)


@dataclass(frozen=True, eq=False)
class Take:
    """One recording of N rows; signs and units are the project's, not the file's."""

    seconds: np.ndarray  # [N] from the first row, increasing
    weights: np.ndarray  # [N, E] float32 0..1
    head: (
        np.ndarray
    )  # [N, 3] degrees: yaw to the subject's left, pitch up, roll to its left shoulder
    eyes: np.ndarray | None  # [N, 2 (left, right), 2] degrees: yaw to the left, pitch up
    start: float = 0.0  # time of day of the first row, seconds
    notes: tuple[str, ...] = ()  # what was mended while reading

    def __post_init__(self):
        count = len(self.seconds)
        check_array("Take.seconds", self.seconds, (None,))
        check_array("Take.weights", self.weights, (count, len(EXPRESSIONS)), low=0, high=1)
        check_array("Take.head", self.head, (count, 3))
        if self.eyes is not None:
            check_array("Take.eyes", self.eyes, (count, 2, 2))
        if count < 1 or (np.diff(self.seconds) <= 0).any():
            raise ValueError("Take.seconds: needs at least one row, and times that increase")

    @property
    def rate(self):
        """Frames a second."""
        if len(self.seconds) < 2:
            return 30.0
        rate = 1 / float(np.median(np.diff(self.seconds)))
        nearest = min(RATES, key=lambda known: abs(known - rate))
        return float(nearest) if abs(nearest / rate - 1) < 0.02 else rate

    def at(self, seconds):
        """Weights [n, E], head [n, 3] and eyes [n, 2, 2] or None at times [n] s (rule 10)."""
        seconds = np.clip(np.asarray(seconds, float), self.seconds[0], self.seconds[-1])
        after = np.clip(np.searchsorted(self.seconds, seconds), 1, max(len(self.seconds) - 1, 1))
        after = np.minimum(after, len(self.seconds) - 1)
        before = np.maximum(after - 1, 0)
        step = self.seconds[after] - self.seconds[before]
        share = np.where(
            step > 0, (seconds - self.seconds[before]) / np.where(step > 0, step, 1), 0
        )

        def mix(values):
            part = share.reshape((-1,) + (1,) * (values.ndim - 1))
            return values[before] + (values[after] - values[before]) * part

        weights = mix(self.weights).astype(np.float32)
        return weights, mix(self.head), None if self.eyes is None else mix(self.eyes)


def read_take(path, base: int | None = None) -> Take:
    """Read a take; a .gz is unpacked.

    Args:
        base: frames that a second of its time code has; None finds out.

    Raises:
        InputError: not such a file; says row and column.
    """
    return parse_take(path, _unpacked(path, read_bytes(path, LARGEST)), base)


def parse_take(name, data: bytes, base: int | None = None) -> Take:
    """A Take from the bytes of a file; see the rules above.

    Args:
        name: how messages call the file.
        base: see `read_take`.

    Raises:
        InputError: it breaks a rule.
    """
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError(
            f"{name}: not text (UTF-8); give the CSV that Live Link Face wrote"
        ) from None
    lines = list(records(name, text))
    if not lines:
        raise InputError(f"{name}: holds no rows; give the CSV that Live Link Face wrote")
    separator = separator_of(name, lines[0][1])
    header = [_shown(field) for field in fields_of(lines[0][1], separator)]
    columns, notes = _columns(name, header)
    stamps = [_stamp(name, *row, columns["timecode"]) for row in _rows(lines, separator)]
    base = base or _base(stamps, notes)
    time, values, dropped, repeated = [], [], [], []
    for (number, fields), (whole, frames) in zip(_rows(lines, separator), stamps):
        if frames >= base:
            raise _bad_stamp(name, number, fields[columns["timecode"]], base)
        now = whole + frames / base
        if time and now < time[-1] - timecode.DAY / 2:
            now += timecode.DAY
        if time and now <= time[-1]:
            repeated.append(number)
            continue
        filled = [place for place, field in enumerate(fields) if field]
        if len(filled) <= 2 and set(filled) <= {columns["timecode"], columns["blendshapecount"]}:
            dropped.append(len(time))
            values.append(None)
        else:
            values.append(_values(name, number, fields, header, columns))
        time.append(now)
    if len(time) == len(dropped):
        raise InputError(f"{name}: holds no frame with values; record the take again")
    if repeated:
        notes.append(f"{_listed(repeated)} left out: not later than the row before")
    return _take(np.array(time), values, dropped, columns, notes)


def take_of(seconds: np.ndarray, values: np.ndarray) -> Take:
    """A Take of numbers as the app has them, by the rules above; none of them dropped.

    Args:
        seconds: [N] increasing.
        values: [N, 61] ORDER, HEAD and EYES.
    """
    columns = {name.lower(): place for place, name in enumerate((*ORDER, *HEAD, *EYES))}
    return _take(np.asarray(seconds, float), list(values), [], columns, [])


def _rows(lines, separator):
    """(number, fields) of the records behind the header; a decimal comma becomes a point."""
    for number, line in lines[1:]:
        fields = fields_of(line if separator == "," else line.replace(",", "."), separator)
        if any(fields):
            yield number, fields


def _stamp(name, row, fields, place):
    """Whole seconds and frames of a row (rule 4)."""
    text = fields[place] if place < len(fields) else ""
    found = timecode.parse(text)
    if found is None:
        raise _bad_stamp(name, row, text, timecode.BASE)
    return found


def _bad_stamp(name, row, text, base):
    return InputError(
        f"{name}: row {row}, column Timecode: '{text[:40]}'; needs HH:MM:SS:FF.mmm, FF below {base}"
    )


def _base(stamps, notes):
    base, note = timecode.find_base(*np.array(stamps, float).reshape(-1, 2).T)
    notes += [note] if note else []
    return base


def _unpacked(path, data):
    if not data.startswith(b"\x1f\x8b"):
        return data
    try:
        unpacker = zlib.decompressobj(wbits=31)
        text = unpacker.decompress(data, LARGEST)
    except zlib.error:
        raise InputError(f"{path}: a damaged .gz; copy or download it again") from None
    if unpacker.unconsumed_tail:
        raise InputError(f"{path}: unpacks to more than {LARGEST >> 20} MiB; cut the take")
    if not unpacker.eof:
        raise InputError(f"{path}: a truncated .gz; copy or download it again")
    return text


def plain(name):
    """A column's name as it is compared (rule 2)."""
    name = re.sub(r"_L$", "Left", re.sub(r"_R$", "Right", name.strip()))
    return re.sub(r"[\s_]", "", name).lower()


def _shown(field):
    """A column's name on one line, for messages."""
    return "".join(c for c in " ".join(field.split()) if c.isprintable())


def _some(names):
    return ", ".join(names[:6]) + (f" and {len(names) - 6} more" if names[6:] else "")


def _columns(name, header):
    """Place of each known column by its plain name; and notes."""
    known = ["Timecode", "BlendShapeCount", *ORDER, *HEAD, *EYES]
    taken = {*map(str.lower, known), *map(plain, OTHERS)}
    places, others = {}, []
    for place, field in enumerate(header):
        key = plain(field)
        if key not in taken:
            others.append(field or "(no name)")
        elif key in places:
            raise InputError(f"{name}: row 1: column {field} is there twice; remove one")
        else:
            places[key] = place
    wanted = [column for column in known[: 2 + len(ORDER)] if column != OPTIONAL]
    missing = [column for column in wanted if column.lower() not in places]
    for group in (HEAD, EYES):
        lacking = [column for column in group if column.lower() not in places]
        missing += lacking if len(lacking) < len(group) else []
    if missing:
        raise InputError(
            f"{name}: row 1: lacks column {_some(missing)}; give a CSV as Live Link Face writes it"
        )
    notes = [f"column {_some(others)} left out: not known"] if others else []
    if OPTIONAL.lower() not in places:
        notes.append(f"no column {OPTIONAL}; taken as 0")
    return places, notes


def _values(name, row, fields, header, columns):
    """The known numbers of a row, in the order of `columns` (rules 6 and 7)."""
    if len(fields) != len(header):
        raise InputError(
            f"{name}: row {row}: {len(fields)} fields, the header has {len(header)}; mend or remove the row"
        )
    count = fields[columns["blendshapecount"]]
    if not COUNT.fullmatch(count) or int(count) != len(header) - 2:
        raise InputError(
            f"{name}: row {row}, column BlendShapeCount: '{count[:40]}', but the header has "
            f"{len(header) - 2} columns of values; mend or remove the row"
        )
    out = []
    for key, place in columns.items():
        if key in ("timecode", "blendshapecount"):
            continue
        if not NUMBER.fullmatch(fields[place]) or not np.isfinite(value := float(fields[place])):
            raise InputError(
                f"{name}: row {row}, column {header[place]}: '{fields[place][:40]}' is no number; "
                "mend or remove the row"
            )
        if abs(value) > 2 * np.pi and key in _ANGLES:
            raise InputError(
                f"{name}: row {row}, column {header[place]}: {value:g} radians; angles in degrees "
                "must be converted"
            )
        out.append(value)
    return out


_ANGLES = {column.lower() for column in HEAD + EYES}


def _take(time, values, dropped, columns, notes):
    have = np.setdiff1d(np.arange(len(time)), dropped)
    keys = [key for key in columns if key not in ("timecode", "blendshapecount")]
    known = dict(zip(keys, np.array([values[row] for row in have]).T))
    known.setdefault(OPTIONAL.lower(), np.zeros(len(have)))
    weights = np.stack([known[expression.lower()] for expression in EXPRESSIONS], 1)
    outside = np.maximum(weights - 1, -weights)
    if dropped:
        notes.append(f"{len(dropped)} dropped frames interpolated")
    if outside.max() > 0:
        row, worst = np.unravel_index(outside.argmax(), outside.shape)
        notes.append(
            f"{(outside > 0).sum()} coefficients clamped to 0..1, the farthest "
            f"{EXPRESSIONS[worst]} {weights[row, worst]:.3f}"
        )

    def fill(rows):
        """Values of all times from those of the rows that have some: [n, ...] to [N, ...]."""
        flat = rows.reshape(len(have), -1).T
        return np.stack([np.interp(time, time[have], column) for column in flat], 1)

    head = np.zeros((len(time), 3))
    if "headyaw" in known:
        turns = np.degrees(np.stack([known[key.lower()] for key in HEAD], 1)) * [-1, -1, 1]
        head = fill(np.unwrap(turns, axis=0, period=360))
    eyes = None
    if "lefteyeyaw" in known:
        angles = np.stack([known[key.lower()] for key in EYES], 1).reshape(-1, 2, 3)
        eyes = fill(-np.degrees(angles[..., :2])).reshape(-1, 2, 2)
    weights = np.clip(weights, 0, 1)
    for key, mix in zip(map(plain, OTHERS), other_weights()):
        if key in known:
            weights += np.clip(known[key], 0, 1)[:, None] * mix
    weights = fill(np.minimum(weights, 1)).astype(np.float32)
    return Take(time - time[0], weights, head, eyes, float(time[0] % timecode.DAY), tuple(notes))


def _listed(numbers):
    listed = ", ".join(map(str, numbers[:6])) + (" ..." if numbers[6:] else "")
    return f"{len(numbers)} row{'s' if numbers[1:] else ''} ({listed})"


def format_take(take):
    """The bytes of a take as the app writes them."""
    eyes = np.zeros((len(take.seconds), 2, 2)) if take.eyes is None else take.eyes
    index = {expression.lower(): place for place, expression in enumerate(EXPRESSIONS)}
    columns = [take.weights[:, index[column.lower()]] for column in ORDER]
    turns = take.head - 360 * np.round(take.head / 360)  # what passed the back of the head
    columns += list(np.radians(turns * [-1, -1, 1]).T)
    if take.eyes is not None:
        for eye in range(2):
            columns += [*np.radians(-eyes[:, eye]).T, np.zeros(len(eyes))]
    names = ["Timecode", "BlendShapeCount", *ORDER, *HEAD, *(EYES if take.eyes is not None else ())]
    lines = [",".join(names)]
    for time, row in zip(take.seconds, np.stack(columns, 1)):
        numbers = ",".join(f"{value + 0.0:.10f}" for value in row)
        lines.append(f"{timecode.written(take.start + time)},{len(row)},{numbers}")
    return ("\n".join(lines) + "\n").encode()
