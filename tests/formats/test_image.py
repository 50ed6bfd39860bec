"""Photos: what is converted, what is refused, how fast."""

import io
import os
import struct
import subprocess
import sys
import time
import zlib

import cv2
import numpy as np
import pytest
from PIL import Image, ImageCms

from bakery.errors import InputError
from bakery.formats import image
from bakery.formats.image import encode_image, read_photo, write_image
from bakery.formats.image_header import count_scans


@pytest.fixture
def picture():
    """Smooth colours [240, 320, 3] uint8 whose four corners all differ."""
    y, x = np.mgrid[:240, :320]
    return np.stack([x * 255 // 319, y * 255 // 239, 40 + 0 * x], -1).astype(np.uint8)


def save(path, picture, **options):
    saved = picture if isinstance(picture, Image.Image) else Image.fromarray(picture)
    saved.save(path, **options)
    return path


def close(photo, expected, atol=1.5 / 255):
    np.testing.assert_allclose(photo.encoded, expected, atol=atol)


@pytest.mark.parametrize("ending", ["png", "tiff", "bmp", "webp", "jp2", "ppm"])
def test_lossless_formats_come_back(tmp_path, picture, ending):
    options = {"lossless": True} if ending == "webp" else {}
    photo = read_photo(save(tmp_path / f"a.{ending}", picture, **options))
    close(photo, picture / 255, atol=1e-6)
    assert photo.notes == () and len(photo.sha256) == 64


def test_headers_are_read_first_thing_in_a_program(tmp_path, picture):
    """Pillow loads its readers when they are asked for; no test before this one may have done so."""
    for ending in ("png", "jpg", "webp", "avif"):
        save(tmp_path / f"a.{ending}", picture)
        code = "import sys; from bakery.formats.image_header import check_file; check_file(sys.argv[1])"
        command = [sys.executable, "-c", code, str(tmp_path / f"a.{ending}")]
        done = subprocess.run(command, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("orientation", range(1, 9))
def test_orientation_is_undone(tmp_path, picture, orientation):
    """Stored by the inverse of what the EXIF table says, it must come back upright."""
    stored = {
        1: lambda a: a,
        2: lambda a: a[:, ::-1],
        3: lambda a: a[::-1, ::-1],
        4: lambda a: a[::-1],
        5: lambda a: a.transpose(1, 0, 2),
        6: lambda a: np.rot90(a),
        7: lambda a: np.rot90(a, 2).transpose(1, 0, 2),
        8: lambda a: np.rot90(a, -1),
    }[orientation](picture)
    exif = Image.Exif()
    exif[0x0112] = orientation
    path = save(
        tmp_path / "a.jpg", np.ascontiguousarray(stored), quality=98, subsampling=0, exif=exif
    )
    photo = read_photo(path)
    close(photo, picture / 255, atol=6 / 255)  # JPEG
    assert bool(photo.notes) == (orientation != 1)


def test_sixteen_bits_are_kept(tmp_path):
    import cv2

    ramp = np.linspace(0, 65535, 128 * 128).reshape(128, 128).astype(np.uint16)
    cv2.imwrite(str(tmp_path / "a.png"), np.stack([ramp] * 3, -1))
    photo = read_photo(tmp_path / "a.png")
    assert len(np.unique(photo.encoded)) > 10_000
    assert photo.notes == ("16-bit samples",)


def test_grey_and_palette(tmp_path, picture):
    grey = read_photo(save(tmp_path / "g.png", picture[:, :, 0]))
    close(grey, np.repeat(picture[:, :, :1], 3, 2) / 255)
    assert grey.notes == ("grey picture",)
    few = Image.fromarray(picture).quantize(16)
    close(read_photo(save(tmp_path / "p.png", few)), np.asarray(few.convert("RGB")) / 255)


def with_alpha(picture, alpha):
    return np.concatenate([picture, np.broadcast_to(alpha, (240, 320))[..., None]], -1)


def cut_out(softness):
    """Alpha of a disk of radius 100 whose edge is as wide as `softness` pixels."""
    y, x = np.mgrid[:240, :320]
    distance = np.hypot(y - 120, x - 160)
    return (np.clip((100 - distance) / softness + 0.5, 0, 1) * 255).astype(np.uint8)


def test_a_cut_out_person_is_laid_over_grey(tmp_path, picture):
    for softness in (0.1, 10.0):
        alpha = cut_out(softness)
        photo = read_photo(save(tmp_path / "a.png", with_alpha(picture, alpha)))
        share = alpha[..., None] / 255
        close(photo, picture / 255 * share + 0.5 * (1 - share))
        assert photo.notes == ("transparent parts put over mid-grey",)
    grey = Image.fromarray(picture[..., 0]).convert("LA")
    grey.putalpha(Image.fromarray(cut_out(0.1)))
    assert len(read_photo(save(tmp_path / "g.png", grey)).notes) == 2
    opaque = read_photo(save(tmp_path / "o.png", with_alpha(picture, np.uint8(255))))
    assert opaque.notes == ()


@pytest.mark.parametrize(
    "alpha, message",
    [
        (np.uint8(128), "100% of what it shows is half-transparent"),
        (np.uint8(51), "100% of what it shows is half-transparent"),
        (cut_out(150.0), r"\d\d% of what it shows is half-transparent"),  # faded all the way
        (np.uint8(0), "transparent everywhere"),
    ],
)
def test_a_ghost_is_refused(tmp_path, picture, alpha, message):
    """Grey would shine through the whole face and become its skin."""
    path = save(tmp_path / "a.png", with_alpha(picture, alpha))
    with pytest.raises(InputError, match=f"{message}.*save it without transparency"):
        read_photo(path)


def test_cmyk_and_profile(tmp_path, picture):
    cmyk = Image.fromarray(picture).convert("CMYK")
    photo = read_photo(save(tmp_path / "c.jpg", cmyk, quality=98))
    close(photo, picture / 255, atol=0.04)
    assert "CMYK" in photo.notes[0]


def wide_gamut():
    """A profile that swaps red and green: easy to see whether it was applied."""
    profile = bytearray(ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes())
    count = struct.unpack(">I", profile[128:132])[0]
    tags = {bytes(profile[132 + 12 * i : 136 + 12 * i]): 132 + 12 * i for i in range(count)}
    red, green = tags[b"rXYZ"], tags[b"gXYZ"]
    entry = profile[red + 4 : red + 12]
    profile[red + 4 : red + 12] = profile[green + 4 : green + 12]
    profile[green + 4 : green + 12] = entry
    return bytes(profile).replace(
        "sRGB built-in".encode("utf-16-be"), "Swap built-in".encode("utf-16-be")
    )


def test_profile_is_converted(tmp_path, picture):
    path = save(tmp_path / "w.png", picture, icc_profile=wide_gamut())
    photo = read_photo(path)
    close(photo, picture[:, :, [1, 0, 2]] / 255, atol=2 / 255)
    assert photo.notes[0] == "colour profile converted to sRGB"  # not in the words of its maker
    named = wide_gamut().replace(
        "Swap built-in".encode("utf-16-be"), "DCI-P3 of mine"[:13].encode("utf-16-be")
    )
    photo = read_photo(save(tmp_path / "n.png", picture, icc_profile=named))
    assert photo.notes[0] == "colour profile 'DCI-P3' converted to sRGB"
    broken = read_photo(save(tmp_path / "b.png", picture, icc_profile=b"nonsense" * 30))
    close(broken, picture / 255, atol=1e-6)


def test_focal_length(tmp_path, picture):
    exif = Image.Exif()
    exif.get_ifd(0x8769)[0xA405] = 85
    assert read_photo(save(tmp_path / "f.jpg", picture, exif=exif)).focal_35mm == 85
    exif.get_ifd(0x8769)[0xA002], exif.get_ifd(0x8769)[0xA003] = 4000, 2000  # cropped since
    assert read_photo(save(tmp_path / "c.jpg", picture, exif=exif)).focal_35mm is None


def test_names_of_every_kind(tmp_path, picture):
    for name in (
        "with space.jpg",
        "zeile\n2.jpg",
        "-leading.jpg",
        "фото.jpg",
        "a?b=1.jpg",
        "%04d.null",
        "none",
        "\udcff.jpg",
    ):
        data = encode_image(picture, ".jpg")
        (tmp_path / name).write_bytes(data)
        read_photo(tmp_path / name)


def png_claiming(width, height):
    def chunk(kind, body):
        return (
            struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
        )

    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    return (
        b"\x89PNG\r\n\x1a\n"
        + chunk(b"IHDR", header)
        + chunk(b"IDAT", b"x" * 99)
        + chunk(b"IEND", b"")
    )


def many_scans(picture, count):
    data = encode_image(picture, ".jpg")
    start = data.rindex(b"\xff\xda")
    return data[:start] + data[start:-2] * count + data[-2:]


def broken_files(picture):
    jpeg, png = encode_image(picture, ".jpg"), encode_image(picture, ".png")
    half = len(jpeg) // 2
    frames = [Image.fromarray(np.roll(picture, 20 * i, 1)) for i in range(3)]
    gif = io.BytesIO()
    frames[0].save(gif, "GIF", save_all=True, append_images=frames[1:])
    webp = io.BytesIO()
    frames[0].save(webp, "WEBP", save_all=True, append_images=frames[1:])
    return {
        "empty": (b"", "empty file"),
        "cut": (jpeg[:half], "truncated"),
        "grey fill": (jpeg[:half] + b"\xff\xd9", "truncated"),
        "hole": (jpeg[:half] + bytes(600) + jpeg[half + 600 :], "truncated"),
        "cut png": (png[: len(png) // 2], "truncated"),
        "flipped png": (png[:-200] + bytes([png[-200] ^ 1]) + png[-199:], "truncated"),
        "bomb": (png_claiming(60000, 60000), "megapixels"),
        "65 megapixels": (png_claiming(6500, 10000), "megapixels"),
        "tiny": (encode_image(picture[:50, :50], ".png"), "at least 96"),
        "scans": (many_scans(picture, 300), "scans"),
        "gif": (gif.getvalue(), "animated"),
        "webp": (webp.getvalue(), "animated"),
        "heic": (
            b"\0\0\0\x18ftypheic" + bytes(99),
            "not a picture that can be read|a HEIC picture",
        ),
        "avif": (b"\0\0\0\x18ftypavif" + bytes(99), "not a picture that can be read"),
        "video": (b"\0\0\0\x18ftypisom" + bytes(99), "video"),
        "pdf": (b"%PDF-1.7\n" + bytes(99), "PDF"),
        "svg": (b"<svg xmlns=''></svg>", "SVG"),
        "text": (b"hello, this is not a picture", "not a picture"),
        "random": (np.random.default_rng(0).bytes(5000), "not a picture"),
    }


def test_bad_files_are_refused_in_a_second(tmp_path, picture):
    for what, (data, message) in broken_files(picture).items():
        path = tmp_path / f"{what}.jpg"
        path.write_bytes(data)
        start = time.process_time()
        with pytest.raises(InputError, match=message) as caught:
            read_photo(path)
        assert time.process_time() - start < 1, what  # not what a busy machine takes
        assert "\n" not in str(caught.value), what


def test_animated_by_frame(tmp_path, picture):
    path = tmp_path / "a.gif"
    path.write_bytes(broken_files(picture)["gif"][0])
    assert "frame 0" in read_photo(path, frame=0).notes[0]
    with pytest.raises(InputError, match="no frame 7"):
        read_photo(path, frame=7)


def test_pages_are_counted_and_chosen(tmp_path, picture):
    pages = [Image.fromarray(np.roll(picture, 20 * n, 1)) for n in range(3)]
    path = save(tmp_path / "a.tiff", pages[0], save_all=True, append_images=pages[1:])
    with pytest.raises(InputError, match="a file of 3 pages; --frame takes the first"):
        read_photo(path)
    photo = read_photo(path, frame=2)
    close(photo, np.asarray(pages[2]) / 255)
    assert photo.notes == ("frame 2 of a file of 3 pages",)
    many = [Image.fromarray(picture[:96, :96])] * 150
    path = save(tmp_path / "many.tiff", many[0], save_all=True, append_images=many[1:])
    with pytest.raises(InputError, match="100 pages or more"):
        read_photo(path)


@pytest.mark.parametrize(
    "kind, message",
    [
        (np.float32, "floating-point samples"),
        (np.float64, "floating-point samples"),
        (np.int32, "32 bits a sample"),
    ],
)
@pytest.mark.parametrize("channels", [1, 3])
def test_tiffs_of_other_samples_are_called_by_name(tmp_path, picture, kind, message, channels):
    import cv2

    path = tmp_path / "a.tiff"
    cv2.imwrite(str(path), picture[..., :channels].astype(kind))
    with pytest.raises(InputError, match=f"a TIFF with {message}; save it as 8 or 16 bit RGB"):
        read_photo(path)


def test_odd_names_without_descriptors(tmp_path, picture, monkeypatch):
    """Windows has no /dev/fd: a copy takes its place."""
    path = tmp_path / "фото?.null"
    path.write_bytes(encode_image(picture, ".png"))
    monkeypatch.setattr(image.os.path, "isdir", lambda path: False)
    close(read_photo(path), picture / 255, atol=1e-6)


def test_missing_folder_and_pipe(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    for path, message in ((tmp_path / "no.jpg", "no such file"), (tmp_path, "folder|not a file")):
        with pytest.raises(InputError, match=message):
            read_photo(path)
    with pytest.raises(InputError, match="not a file"):
        read_photo(tmp_path / "pipe")


def test_scans_are_counted(picture):
    assert count_scans(encode_image(picture, ".jpg")) == 1
    buffer = io.BytesIO()
    Image.fromarray(picture).save(buffer, "JPEG", progressive=True)
    assert count_scans(buffer.getvalue()) == 10
    assert count_scans(b"\xff\xd8" + b"\xff" * 100) == 0


def test_what_follows_the_end_does_not_matter(tmp_path, picture):
    """Phones append whole films to their photos."""
    film = np.random.default_rng(0).bytes(200_000) + b"\xff\xda\x00\x00"
    (tmp_path / "a.jpg").write_bytes(encode_image(picture, ".jpg") + film)
    read_photo(tmp_path / "a.jpg")


def test_write_image(tmp_path, picture):
    write_image(tmp_path / "a.png", picture / 255)
    assert (np.asarray(Image.open(tmp_path / "a.png")) == picture).all()
    with pytest.raises(InputError, match="not as"):
        write_image(tmp_path / "a.exe", picture)


@pytest.mark.parametrize("kind", [".png", ".jpg", ".webp"])
def test_half_a_picture_is_never_given(monkeypatch, picture, kind):
    """Without memory OpenCV gives what it has, and a flag."""
    whole = encode_image(picture, kind)
    monkeypatch.setattr(cv2, "imencode", lambda *_: (False, np.frombuffer(whole[:100], np.uint8)))
    with pytest.raises(MemoryError):
        encode_image(picture, kind)
