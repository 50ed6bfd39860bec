"""Records and files by rule: whatever is written comes back, whatever is read ends in one error."""

import json
import math
import warnings
from dataclasses import fields

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as some
from hypothesis.extra import numpy as arrays

from bakery.errors import BakeryError, InputError
from bakery.formats import exr, image_header, livelink, npz, record
from bakery.types import EXPRESSIONS, LANDMARKS, Camera, Fit, Landmarks, Maker, Textures

FINITE = some.floats(allow_nan=False, allow_infinity=False)
UNIT = some.floats(0, 1)
SIDE = some.integers(1, 12)


def floats(shape, values=FINITE, dtype=np.float64):
    """Arrays of a shape; most entries are alike, as is quick and shrinks well."""
    return arrays.arrays(dtype, shape, elements=values)


def same(one, other):
    """Equal to the bit, so that -0.0 and nan count."""
    one, other = np.asarray(one), np.asarray(other)
    return (
        one.dtype == other.dtype and one.shape == other.shape and one.tobytes() == other.tobytes()
    )


# --- JSON ---

TEXT = some.text(some.characters(exclude_categories=("Cs",)), max_size=20)
JSON = some.recursive(
    some.none() | some.booleans() | some.integers() | FINITE | TEXT,
    lambda inner: some.lists(inner, max_size=4) | some.dictionaries(TEXT, inner, max_size=4),
    max_leaves=12,
)


@given(some.dictionaries(TEXT, JSON, max_size=5))
def test_json_comes_back(table):
    data = record.dump(table)
    assert record.parse("a.json", data) == table
    assert record.dump(record.parse("a.json", data)) == data


@given(
    some.binary(max_size=60)
    | some.text(max_size=40).map(lambda text: text.encode("utf-8", "replace"))
)
def test_any_bytes_are_json_or_an_error(data):
    try:
        assert isinstance(record.parse("a.json", data), dict)
    except InputError as error:
        assert "\n" not in str(error)


@given(arrays.arrays(some.sampled_from([np.float16, np.float32, np.float64]), SIDE, elements=None))
def test_numbers_read_back_the_same(values):
    """The shortest text of a number in its own precision."""
    values = values[np.isfinite(values)]
    back = np.array(json.loads(json.dumps(record.numbers(values))), values.dtype)
    np.testing.assert_array_equal(back, values)


@some.composite
def fits(draw):
    far = some.floats(-1e7, 1e7)  # record.FARTHEST
    camera = Camera(
        draw(some.floats(1e-6, 1e7)),
        draw(floats(2, far)),
        draw(floats(3)),
        draw(floats(3, far)),
        draw(some.integers(1, 65536)),
        draw(some.integers(1, 65536)),
    )
    return Fit(
        draw(TEXT), camera, draw(floats(SIDE)), draw(floats(len(EXPRESSIONS), UNIT)),
        draw(floats(2)), draw(floats((9, 3))), draw(floats(SIDE)), draw(floats((468, 3))),
        draw(floats((LANDMARKS, 2), some.floats(-1e6, 1e6))), draw(some.floats(0, 1e6)),
        draw(some.sampled_from(["exif", "default"])),
        draw(some.dictionaries(TEXT, FINITE, max_size=3)), draw(TEXT),
    )  # fmt: skip


@given(fits())
def test_fits_come_back(fit):
    """To the bit, but for what is written with four decimals."""
    table = record.fit_to_table(fit)
    back = record.fit_from_table("fit.json", record.parse("fit.json", record.dump(table)))
    for item in fields(Fit):
        ours, theirs = getattr(fit, item.name), getattr(back, item.name)
        if item.name in ("landmarks_projected", "seconds"):
            np.testing.assert_allclose(theirs, ours, atol=5.1e-5)
        elif item.name == "camera":
            assert all(
                np.array_equal(getattr(ours, f.name), getattr(theirs, f.name))
                for f in fields(Camera)
            )
        else:
            assert np.array_equal(ours, theirs), item.name
    assert record.fit_to_table(back) == table


@some.composite
def faces(draw):
    """Faces that lie in a picture of 640x480."""
    points = draw(floats((LANDMARKS, 2), some.floats(-500, 1000)))
    points[0], points[1] = (100, 100), (300, 300)  # they span something
    box = np.array([*points.min(0), *np.ptp(points, 0)])
    made = Maker(draw(TEXT), draw(TEXT), draw(TEXT))
    return Landmarks(box, draw(UNIT), points, draw(floats(LANDMARKS, UNIT)), made)


@given(faces())
def test_faces_come_back_as_they_were_written(face):
    """Three decimals of a pixel; a file that was read writes the same bytes."""
    data = record.dump(record.faces_to_table(640, 480, [face]))
    size, (back,) = record.faces_from_table("a", record.parse("a", data))
    assert size == (640, 480) and back.maker == face.maker
    np.testing.assert_allclose(back.points, face.points, atol=5.1e-4)
    np.testing.assert_allclose(back.confidence, face.confidence, atol=5.1e-5)
    assert record.dump(record.faces_to_table(640, 480, [back])) == data


# --- npz ---

NAMES = some.text(some.characters(codec="ascii", categories=("L", "N")), min_size=1, max_size=8)
KINDS = some.sampled_from(["f2", "f4", "f8", "i1", "i4", "i8", "u1", "u4", "?", "U5"])


@given(some.dictionaries(NAMES, arrays.arrays(KINDS, arrays.array_shapes(min_dims=0, min_side=0))))
def test_arrays_come_back_to_the_bit(table):
    data = bytes(npz.pack_arrays(table))
    back = npz.unpack_arrays(data)
    assert list(back) == list(table)
    assert all(same(back[name], table[name]) for name in table)
    assert bytes(npz.pack_arrays(back)) == data


@some.composite
def textures(draw):
    """Textures of any bits, of a few sizes."""
    side, keys, mouths = draw(SIDE), draw(some.integers(1, 3)), draw(some.integers(1, 3))
    rng = np.random.default_rng(draw(some.integers(0, 2**32)))
    known = len(EXPRESSIONS)

    def half(*shape):
        return rng.integers(0, 2**16, shape, np.uint16).view(np.float16)

    return Textures(
        half(side, side, 3), half(keys, side, side, 3), tuple(draw(NAMES) for _ in range(keys)),
        rng.random((keys, known)), rng.integers(0, 256, (side, side), np.uint8), half(side, side),
        half(side, side, 4), half(2, 3, 4, 3), rng.normal(size=(2, 2)), half(mouths, 2, 3, 3),
        rng.normal(size=(mouths, 4, 2)), rng.random((mouths, known), np.float32),
        Maker(draw(TEXT), "1", "", "compositeSynthetic"), draw(some.text("0123456789abcdef")),
    )  # fmt: skip


@given(textures())
def test_textures_come_back_to_the_bit(made):
    data = npz.pack_arrays(record.textures_to_arrays(made))
    back = record.textures_from_arrays(npz.unpack_arrays(bytes(data)))
    for item in fields(Textures):
        ours, theirs = getattr(made, item.name), getattr(back, item.name)
        assert same(ours, theirs) if isinstance(ours, np.ndarray) else ours == theirs, item.name


# --- EXR ---


@some.composite
def parts(draw):
    """Pictures of one size by name, each of its own number of channels, any half-float bits."""
    names = draw(some.lists(NAMES, min_size=1, max_size=3, unique=True))
    size = draw(SIDE), draw(SIDE)
    out = {}
    for name in names:
        channels = draw(some.sampled_from([(), (3,), (4,)]))
        out[name] = draw(arrays.arrays(np.uint16, (*size, *channels))).view(np.float16)
    return out


@given(parts())
def test_pixels_come_back_to_the_bit(tmp_path_factory, pictures):
    """Infinite, not a number, subnormal, minus zero: half floats are stored as they are."""
    path = tmp_path_factory.getbasetemp() / "any.exr"
    exr.write_exr(path, pictures)
    back = exr.read_exr(path)
    assert list(back) == list(pictures)
    assert all(same(back[name], pictures[name]) for name in pictures)
    headers = {part.name: (part.height, part.width) for part in exr.read_header(path)}
    assert headers == {name: picture.shape[:2] for name, picture in pictures.items()}


@given(some.binary(max_size=200))
def test_any_bytes_behind_its_signature_are_no_exr(tmp_path_factory, data):
    path = tmp_path_factory.getbasetemp() / "none.exr"
    path.write_bytes(b"\x76\x2f\x31\x01" + data)
    for read in (exr.read_header, exr.read_exr):
        with pytest.raises(BakeryError):
            read(path)


# --- takes ---


@some.composite
def takes(draw):
    count = draw(some.integers(1, 6))
    steps = draw(some.lists(some.floats(0.002, 30), min_size=count - 1, max_size=count - 1))
    seconds = np.concatenate([[0], np.cumsum(steps)])
    turns = some.floats(-359, 359)  # degrees; more than a turn is no angle of a head
    eyes = draw(some.none() | floats((count, 2, 2), turns))
    start = draw(some.floats(0, 86399))
    weights = draw(floats((count, len(EXPRESSIONS)), some.floats(0, 1, width=32), np.float32))
    return livelink.Take(seconds, weights, draw(floats((count, 3), turns)), eyes, start)


@given(takes())
def test_takes_come_back(take):
    """Ten digits, times to a thousandth of a sixtieth of a second; turns to a whole one."""
    back = livelink.parse_take("a.csv", livelink.format_take(take), base=60)
    np.testing.assert_allclose(back.weights, take.weights, atol=6e-8)
    np.testing.assert_allclose(back.seconds, take.seconds, atol=1.01e-3 / 60)
    # Steps above half a turn are read as the shorter way round, as a head moves.
    apart = (back.head - take.head + 180) % 360 - 180
    np.testing.assert_allclose(apart, 0, atol=1e-8)
    assert (back.eyes is None) == (take.eyes is None)
    if take.eyes is not None:
        np.testing.assert_allclose(back.eyes, take.eyes, atol=1e-8)
    again = livelink.parse_take("a.csv", livelink.format_take(back), base=60)
    np.testing.assert_allclose(again.weights, back.weights, atol=6e-8)


@given(
    some.text(max_size=60) | some.text('0123456789:.,;\t\n"TimecodeBlendShapeCount', max_size=200)
)
def test_any_text_is_a_take_or_an_error(text):
    try:
        livelink.parse_take("a.csv", text.encode("utf-8", "replace"))
    except InputError as error:
        assert "\n" not in str(error)


@given(some.floats(0, 1e6))
def test_time_codes_come_back(seconds):
    from bakery.formats import timecode

    whole, frames = timecode.parse(timecode.written(seconds))
    error = math.fmod(whole + frames / 60 - seconds, 86400)
    assert min(abs(error), 86400 - abs(error)) <= 0.51e-3 / 60 + 1e-9


# --- pictures ---

STARTS = [
    b"", b"\xff\xd8\xff", b"\xff\xd8\xff\xe0\0\x10JFIF", b"\x89PNG\r\n\x1a\n", b"GIF89a", b"BM", b"P6 ",
    b"II*\0", b"MM\0*", b"RIFF\x20\0\0\0WEBP", b"\0\0\0\x0cjP  \r\n\x87\n", b"\0\0\0\x18ftypheic", b"%PDF",
]  # fmt: skip


@given(some.sampled_from(STARTS), some.binary(max_size=300))
def test_any_bytes_are_no_photo(start, data):
    """Nothing but InputError, in one line, whatever follows the first bytes of a format."""
    with warnings.catch_warnings(), pytest.raises(InputError) as caught:
        warnings.simplefilter("error")  # Pillow's would be a second line
        image_header.read_header("a.jpg", start + data)
    assert "\n" not in str(caught.value)
