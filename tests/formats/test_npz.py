"""Arrays from strangers: every reader refuses what is wrong in one line, before memory is taken."""

import io
import tracemalloc
import warnings
import zipfile

import numpy as np
import pytest

from bakery.errors import InputError, ModelError
from bakery.export.hostile import header_problem
from bakery.formats import npz, record
from bakery.formats.portraits import POINTS, reference_points
from bakery.heads.file import load_head

GOOD = {"a": np.arange(600).reshape(20, 30), "s": np.array(["x", "yy"]), "e": np.zeros((0, 3))}


def plain(array, **options):
    buffer = io.BytesIO()
    np.lib.format.write_array(buffer, np.asarray(array), **options)
    return buffer.getvalue()


def header(text):
    """A .npy of any header, with the data of four bytes."""
    text = text.encode("latin-1")
    return npz.START + len(text).to_bytes(2, "little") + text + bytes(4)


def packed(*members, method=zipfile.ZIP_DEFLATED):
    buffer = io.BytesIO()
    with warnings.catch_warnings(), zipfile.ZipFile(buffer, "w", method) as archive:
        warnings.simplefilter("ignore")  # the second array of a name
        for name, data in members:
            archive.writestr(name, data)
    return buffer.getvalue()


def patched(data, entry, offset, value):
    """Bytes changed in the zip's local header (`PK34`) or directory (`PK12`)."""
    data = bytearray(data)
    at = data.find(entry) + offset
    data[at : at + len(value)] = value
    return bytes(data)


LOCAL, DIRECTORY = b"PK\x03\x04", b"PK\x01\x02"
NUMBERS = ("a.npy", plain(np.arange(1000)))
WHOLE = packed(NUMBERS)
SHAPE = "{{'descr': '{}', 'fortran_order': False, 'shape': {}, }}"
CASES = {
    "empty archive's end": (b"PK\x05\x06" + bytes(5), "damaged, or no .npz"),
    "text": (b"this is no archive", "damaged, or no .npz"),
    "one array": (NUMBERS[1], "damaged, or no .npz"),
    "a pickle": (b"\x80\x04\x95\x05\x00\x00\x00\x00\x00\x00\x00K\x01.", "damaged, or no .npz"),
    "cut": (WHOLE[:-30], "damaged, or no .npz"),
    "corrupt deflate": (patched(WHOLE, LOCAL, 60, b"\xff" * 40), "damaged, or no .npz"),
    "wrong sum": (
        patched(packed(NUMBERS, method=zipfile.ZIP_STORED), b"NUMPY", 200, b"\x77"),
        "damaged, or no .npz",
    ),
    "encrypted": (
        patched(patched(WHOLE, LOCAL, 6, b"\1"), DIRECTORY, 8, b"\1"), "'a' is encrypted"
    ),
    "unknown method": (
        patched(patched(WHOLE, LOCAL, 8, b"\x63"), DIRECTORY, 10, b"\x63"), "packed by method 99"
    ),
    "bzip2": (packed(NUMBERS, method=zipfile.ZIP_BZIP2), "packed by method 12"),
    "lzma": (packed(NUMBERS, method=zipfile.ZIP_LZMA), "packed by method 14"),
    "twice": (packed(NUMBERS, NUMBERS), "holds 'a' twice"),
    "twice by its ending": (packed(NUMBERS, ("a", b"x")), "holds 'a' twice"),
    "another file": (packed(("run.exe", b"MZ")), "holds 'run.exe', which is no array"),
    "pickled": (packed(("a.npy", plain(np.array([{}]), allow_pickle=True))), "holds objects"),
    "a table": (packed(("a.npy", plain(np.zeros(2, "i4,f4")))), "damaged, or no .npz"),
    "terabytes": (packed(("a.npy", header(SHAPE.format("<f8", (10**12,))))), "promises 8000000000"),
    "too many to count": (
        packed(("a.npy", header(SHAPE.format("<f8", (2**62, 2**62))))), "promises"
    ),
    "huge text": (packed(("a.npy", header(SHAPE.format("<U100000000", (1,))))), "promises 400000000"),
    "below zero": (packed(("a.npy", header(SHAPE.format("<i1", (-2, -2))))), "promises 4"),
    "too short": (packed(("a.npy", NUMBERS[1][:-8])), "promises 8000 bytes, 7992 follow"),
    "shape of text": (packed(("a.npy", header(SHAPE.format("<i1", "'x'")))), "damaged"),
    "code": (packed(("a.npy", header("__import__('os').abort()"))), "damaged, or no .npz"),
    "deep header": (packed(("a.npy", header("[" * 5000))), "damaged, or no .npz"),
    "version 2": (packed(("a.npy", plain(np.zeros(2), version=(2, 0)))), "no array of numpy"),
    "bomb": (lambda: packed(("a.npy", bytes(2**29 + 1))), "unpacks to 512 MiB, at most 512"),
    "many": (packed(*((f"{n}.npy", b"") for n in range(1001))), "holds 1001 arrays"),
}  # fmt: skip


def test_arrays_come_back():
    for data in (npz.pack_arrays(GOOD), packed(*((f"{k}.npy", plain(v)) for k, v in GOOD.items()))):
        back = npz.unpack_arrays(data)
        assert list(back) == list(GOOD)
        for name, array in GOOD.items():
            assert back[name].dtype == array.dtype and np.array_equal(back[name], array)
            assert back[name].flags.writeable
    assert npz.pack_arrays(GOOD) == npz.pack_arrays(GOOD)


@pytest.mark.parametrize("order", "<>")
def test_text_that_is_no_letters_is_refused(order):
    """Python fails with a SystemError on numbers above U+10FFFF (found by the fuzzer)."""
    whole = np.array(["skin", "\U0010ffff"], f"{order}U8")
    assert npz.unpack_arrays(packed(("a.npy", plain(whole))))["a"].tolist() == whole.tolist()
    broken = plain(whole)[:-4] + np.array([0x110000], f"{order}u4").tobytes()
    with pytest.raises(npz.NpzError, match="'a' holds damaged text"):
        npz.unpack_arrays(packed(("a.npy", broken)))


@pytest.mark.parametrize("case", CASES)
def test_every_reader_refuses_in_one_line(tmp_path, case):
    data, message = CASES[case]
    data = data() if callable(data) else data
    for name in ("head.npz", POINTS):
        (tmp_path / name).write_bytes(data)
    path = tmp_path / "head.npz"
    tracemalloc.start()
    try:
        found = []
        for error, read in (
            (npz.NpzError, lambda: npz.unpack_arrays(data)),
            (ModelError, lambda: load_head(path)),
            (InputError, lambda: reference_points(tmp_path, "a")),
        ):
            with pytest.raises(error) as caught:
                read()
            found.append(str(caught.value))
        with pytest.raises(InputError) as caught:
            record.read_arrays(path)
        found.append(str(caught.value))
        if message != "damaged, or no .npz":  # else it may lie behind the header
            found.append(header_problem(tmp_path, path.name))
        assert tracemalloc.get_traced_memory()[1] < 2**26 + 4 * len(data)
    finally:
        tracemalloc.stop()
    for text in found:
        assert message in text and "\n" not in text and "pickle" not in text, text


def test_no_flipped_byte_brings_up_anything_else():
    """One byte changed anywhere: the same arrays, or one reason."""
    rng = np.random.default_rng(0)
    whole = packed(*((f"{k}.npy", plain(v)) for k, v in GOOD.items()))
    refused = 0
    for at in range(len(whole)):
        data = bytearray(whole)
        data[at] ^= int(rng.integers(1, 256))
        try:
            back = npz.unpack_arrays(bytes(data))
        except npz.NpzError as error:
            assert len(str(error)) < 200
            refused += 1
        else:  # a date, an attribute, or a name that stands in the directory alone
            assert all(np.array_equal(a, b) for a, b in zip(back.values(), GOOD.values()))
    assert refused > len(whole) / 2
