"""HEIC and AVIF as phones give them: upright, in sRGB, at full depth; what is refused."""

import io
import runpy
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image, ImageCms

from bakery.errors import InputError
from bakery.formats import heif
from bakery.formats.image import read_photo
from bakery.geometry.color import to_encoded, to_linear

HELP = runpy.run_path(str(Path(__file__).parent / "heic.py"))
LOSSY = 4 / 255  # 4:2:0 and the quantiser of these small streams


@pytest.fixture
def photo(tmp_path):
    """A function (bytes, **read_photo's) -> Photo; skips HEIC without its reader."""

    def read(data, name="a.heic", **given):
        if heif.kind(data) == "heif":
            pytest.importorskip("pi_heif")
        (tmp_path / name).write_bytes(data)
        return read_photo(tmp_path / name, **given)

    return read


def avif(picture, **options):
    stream = io.BytesIO()
    options = {"quality": 95, "subsampling": "4:4:4", **options}
    Image.fromarray(picture).save(stream, "AVIF", **options)
    return stream.getvalue()


@pytest.fixture
def ramps():
    return HELP["ramps"]()


def close(found, expected):
    np.testing.assert_allclose(found, expected, atol=LOSSY)


@pytest.mark.parametrize("turns", range(4))
def test_heic_comes_upright(photo, ramps, turns):
    found = photo(HELP["heic"](turns=turns))
    close(found.encoded, np.rot90(ramps, turns))
    assert found.notes == ()


def test_ten_bits_stay_ten_bits(photo, ramps):
    found = photo(HELP["heic"](bits=10))
    close(found.encoded, ramps)
    assert found.notes == ("16-bit samples",)
    assert len(np.unique(found.encoded)) > 300  # 8 bits have at most 256 values


def test_the_focal_length_is_read_and_the_turn_not_made_twice(photo, ramps):
    exif = Image.Exif()
    exif[0x0112] = 6  # as iPhones write it: said here and in the box of turns
    exif[0x8769] = {0xA405: 26}
    found = photo(HELP["heic"](turns=3, exif=exif.tobytes()[6:]))
    assert found.focal_35mm == 26
    close(found.encoded, np.rot90(ramps, 3))


def from_p3(encoded):
    """The definition: through CIE XYZ, from the primaries of SMPTE EG 432-1 to those of BT.709."""

    def basis(primaries, white=(0.3127, 0.3290)):
        columns = np.array([[x / y, 1, (1 - x - y) / y] for x, y in primaries]).T
        x, y = white
        return columns * np.linalg.solve(columns, [x / y, 1, (1 - x - y) / y])

    p3 = basis([(0.680, 0.320), (0.265, 0.690), (0.150, 0.060)])
    srgb = basis([(0.64, 0.33), (0.30, 0.60), (0.15, 0.06)])
    linear = to_linear(encoded) @ (np.linalg.inv(srgb) @ p3).T
    return to_encoded(np.clip(linear, 0, 1))


def test_display_p3_becomes_srgb(photo, ramps):
    found = photo(HELP["heic"](codes=(12, 13, 1)))
    assert found.notes == ("Display P3 converted to sRGB",)
    plain = photo(HELP["heic"]()).encoded
    np.testing.assert_allclose(found.encoded, from_p3(plain), atol=1e-4)
    assert np.abs(found.encoded - plain).max() > 0.05


def test_a_profile_goes_before_code_points(photo, ramps):
    profile = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
    close(photo(HELP["heic"](profile=profile, codes=(12, 13, 1))).encoded, ramps)


@pytest.mark.parametrize("transfer, name", [(16, "PQ"), (18, "HLG")])
def test_high_dynamic_range_is_refused(photo, transfer, name):
    with pytest.raises(InputError, match=f"high dynamic range .{name}."):
        photo(HELP["heic"](bits=10, codes=(9, transfer, 9)))


@pytest.mark.parametrize("orientation", [1, 3, 6, 8])
def test_avif_comes_upright(photo, ramps, orientation):
    stored = {1: 0, 3: 2, 6: 1, 8: -1}[orientation]
    picture = np.rot90((ramps * 255).round().astype(np.uint8), stored)
    exif = Image.Exif()
    exif[0x0112] = orientation
    found = photo(avif(np.ascontiguousarray(picture), exif=exif), "a.avif")
    close(found.encoded, ramps)


def test_avif_with_alpha_and_of_several_pictures(photo, ramps):
    picture = (ramps * 255).round().astype(np.uint8)
    cut = np.dstack([picture, np.full(picture.shape[:2], 255, np.uint8)])
    cut[:, :40, 3] = 0
    found = photo(avif(cut), "a.avif")
    np.testing.assert_allclose(found.encoded[:, :38], 0.5, atol=LOSSY)
    close(found.encoded[:, 44:], ramps[:, 44:])
    many = avif(picture, save_all=True, append_images=[Image.fromarray(picture[::-1])])
    with pytest.raises(InputError, match="an animated picture; --frame"):
        photo(many, "b.avif")
    close(photo(many, "b.avif", frame=1).encoded, ramps[::-1])
    with pytest.raises(InputError, match="no frame 7"):
        photo(many, "b.avif", frame=7)


@pytest.mark.parametrize("make", ["heic", "avif"])
def test_damage_is_one_line(photo, ramps, make):
    """Cut anywhere, or with bytes turned: a picture, or an error of one line."""
    if make == "heic":
        whole = HELP["heic"]()
    else:
        whole = avif((ramps * 255).astype(np.uint8))
    random = np.random.default_rng(0)
    refused = 0
    for number in range(40):
        data = bytearray(whole)
        if number % 2:
            data = data[: random.integers(20, len(data))]
        else:
            data[random.integers(20, len(data))] ^= 1 << random.integers(8)
        try:
            photo(bytes(data), f"a.{make}")
        except InputError as error:
            refused += 1
            assert "\n" not in str(error)
    assert refused >= 15  # of 20 that are cut


def test_without_its_reader_heic_says_what_to_install(tmp_path):
    (tmp_path / "a.heic").write_bytes(HELP["heic"]())
    code = (
        "import sys; sys.modules['pi_heif'] = None\n"
        "from bakery.formats.image_header import check_file\n"
        f"check_file({str(tmp_path / 'a.heic')!r})"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 1 and "pip install 'bakery[heic]'" in done.stderr


def test_videos_in_boxes_are_no_pictures():
    assert heif.kind(b"\0\0\0\x18ftypisom\0\0\0\0mp42avc1") == ""
    assert heif.kind(b"\0\0\0\x18ftypmif1\0\0\0\0heicmiaf") == "heif"
    assert heif.kind(b"\0\0\0\x1cftypmif1\0\0\0\0avifmif1miaf") == "avif"
    assert heif.kind(b"\0\0\0\0ftyp") == ""
