"""Nothing private of a photo goes into what is made of it: no tag, name, path, time, user or machine.

The photo carries in EXIF, XMP, IPTC, ICC, a comment and a thumbnail what cameras and programs write, each
text unlike any other. It is baked and the bundle exported, drawn, shown, played, all under a user, a machine
and folders with such names too. Then every file is searched for every text (hidden.py says in which forms).
The photo's hash is in the bundle by design (docs/guides/marks.md), and its digital source type.
"""

import contextlib
import ctypes
import datetime
import io
import random
import shutil
import socket
import string
import struct
from pathlib import Path

import base
import hidden
import offline

MUST = "0 bytes of the photo's tags, name, place and time in any output"
NEWUTS = 0x04000000  # a host name of one's own
XMP = """<?xpacket begin="\ufeff" id="W5M0MpCehiHzreSzNTczkc9d"?><x:xmpmeta xmlns:x="adobe:ns:meta/">
<rdf:RDF xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#"><rdf:Description rdf:about=""
 xmlns:dc="http://purl.org/dc/elements/1.1/" xmlns:exif="http://ns.adobe.com/exif/1.0/"
 xmlns:xmp="http://ns.adobe.com/xap/1.0/" xmlns:photoshop="http://ns.adobe.com/photoshop/1.0/"
 xmlns:aux="http://ns.adobe.com/exif/1.0/aux/" xmlns:Iptc4xmpExt="http://iptc.org/std/Iptc4xmpExt/2008-02-29/"
 xmp:CreatorTool="{xmp_software}" xmp:CreateDate="1987-06-05T04:03:21" photoshop:City="{xmp_city}"
 aux:SerialNumber="{xmp_serial}" exif:GPSLatitude="48,51.50237N" exif:GPSLongitude="2,17.66913E"
 Iptc4xmpExt:DigitalSourceType="http://cv.iptc.org/newscodes/digitalsourcetype/digitalCapture">
<dc:creator><rdf:Seq><rdf:li>{xmp_creator}</rdf:li></rdf:Seq></dc:creator>
<dc:title><rdf:Alt><rdf:li xml:lang="x-default">{xmp_title}</rdf:li></rdf:Alt></dc:title>
</rdf:Description></rdf:RDF></x:xmpmeta><?xpacket end="w"?>"""
NAMES = (  # of texts, each of which gets letters of its own
    "artist", "description", "software", "make", "model", "serial", "lens_serial", "owner", "copyright",
    "user_comment", "maker_note", "image_id", "xp_author", "xp_title", "gps_area", "xmp_software", "xmp_city",
    "xmp_serial", "xmp_creator", "xmp_title", "iptc_byline", "iptc_city", "iptc_caption", "icc", "comment",
    "thumbnail_comment", "file", "folder", "work_folder", "user", "home", "host",
)  # fmt: skip
KINDS = {
    0x9286: 7,
    0x927C: 7,
    0x1C: 7,
    0x9C9B: 1,
    0x9C9D: 1,
}  # types of tags that are no plain text
LATITUDE, LONGITUDE = ((48, 1), (51, 1), (301422, 10000)), ((2, 1), (17, 1), (401478, 10000))


def run(inputs: base.Inputs, place: Path, count: int | None = None) -> base.Row:
    """Make everything of one photo, and search it.

    Args:
        place: a folder to work in.
        count: only so many commands, the first ones.
    """
    row = base.Row("traces of a photo", MUST)
    place = place / "traces"
    texts = _texts(random.Random(17))
    folder, out = place / f"{texts['folder']} of Anna", place / "out"
    folder.mkdir(parents=True)
    photo, clip = folder / f"{texts['file']}.jpg", folder / "clip"
    thumbnail, data = tagged(inputs.photo, texts)
    photo.write_bytes(data)
    clip.mkdir()
    for number in range(2):
        shutil.copy(photo, clip / f"{number:04d}.jpg")
    tokens = _tokens(texts, place, thumbnail)
    _check_search(row, place / "planted", tokens)
    missing = {each.name for each in tokens} - hidden.found_in(data, tokens)
    for name in sorted(
        missing - {"file", "folder", "work_folder", "user", "home", "host", "place", "today"}
    ):
        row.fail(f"the row itself: the photo does not hold {name}")
    for words in _lines(photo, clip, inputs.take, out)[:count]:
        end = _process(words, place / texts["work_folder"], texts)
        if end.code:
            row.fail(f"{' '.join(words)[:200]}: exit code {end.code}: {end.said[-300:]}")
    files = [path for path in sorted(out.rglob("*")) if path.is_file()]
    for path in files:
        row.cases += len(tokens)
        name = path.relative_to(out).as_posix()
        found = hidden.found_in(path.read_bytes(), tokens) | hidden.found_in(name.encode(), tokens)
        for each in sorted(found):
            row.fail(f"{name}: holds {each}")
    size = sum(path.stat().st_size for path in files) / 2**20
    row.note = f"{len(tokens)} texts in {len(files)} files of {size:.0f} MiB"
    return row


def _lines(photo: Path, clip: Path, take: Path, out: Path) -> list[list[str]]:
    """All commands that write something of the photo; what they write lies in `out`."""
    plain, kept = out / "plain.avatar", out / "kept.avatar"
    small = ["--size", "64", "-o"]
    lines = [
        ["build", photo, *base.QUICK, "-o", plain],
        ["build", photo, *base.QUICK, "--keep-photo", "-o", kept],
        ["build", photo, "-o", out / "whole.avatar"],
        ["detect", photo, "-o", out / "points.json", "--preview", out / "points.png"],
        ["segment", photo, "-o", out / "labels.png", "--preview", out / "labels.jpg"],
        ["fit", photo, *base.QUICK, "-o", out / "fit.json", "--preview", out / "fit.png"],
        ["texture", photo, *base.QUICK, "--fit", out / "fit.json", "-o", out / "t.npz"],
        ["albedo", photo, *base.QUICK, "--fit", out / "fit.json", "-o", out / "albedo.exr"],
        ["hair", photo, *base.QUICK, "--fit", out / "fit.json", "-o", out / "hair.glb"],
        ["generate", photo, "--weights", "jawOpen=0.5", "-o", out / "generated.png"],
        ["track", clip, "--rate", "25", "-o", out / "take.csv"],
        ["perform", photo, clip, "--rate", "25", "--by", "transfer", *small, out / "transfer.webm"],
    ]
    for name, bundle in (("plain", plain), ("kept", kept)):
        lines += [
            [command, *words]
            for command, words in offline.exported(bundle, out / f"exports-{name}")
        ]
        lines += [
            ["render", bundle, *small, out / f"{name}.{kind}"]
            for kind in ("png", "jpg", "webp", "exr")
        ]
        lines += [
            ["animate", bundle, "--curves", take, *small, out / f"{name}.{kind}"]
            for kind in ("webm", "mp4")
        ]
        lines += [
            ["recover", bundle, "jawOpen", "-o", out / f"{name}-facs.exr"],
            ["preview", bundle, "-o", out / f"{name}.html"],
            ["preview", bundle, "--module", out / f"site-{name}"],
            ["perform", bundle, clip, "--rate", "25", *small, out / f"{name}-perform.webm"],
            ["perform", bundle, clip, "--rate", "25", *small, out / f"{name}-perform.mp4"],
        ]
    lines += [["render", kept, "--view", "photo", "-o", out / "over.png"],
              ["perform", kept, clip, "--rate", "25", "--over", "portrait", "-o",
               out / "over.webm"]]  # fmt: skip
    return [[str(word) for word in line] for line in lines]


def _process(words: list[str], folder: Path, texts: dict[str, str]) -> base.Ended:
    """Run a command as a user, on a machine and from a folder with such names."""
    home = folder / texts["home"]
    home.mkdir(parents=True, exist_ok=True)
    env = {"HOME": str(home), "PWD": str(folder)} | dict.fromkeys(
        ("USER", "LOGNAME"), texts["user"]
    )

    def work() -> None:
        libc = ctypes.CDLL(None)
        if hasattr(libc, "unshare") and libc.unshare(NEWUTS) == 0:  # root alone may
            with contextlib.suppress(OSError):
                socket.sethostname(texts["host"])
        base.command_line(words)()

    return base.wait(base.fork(work, folder / "log", folder, env), folder / "log")


def _texts(rng: random.Random) -> dict[str, str]:
    """A text for each name, unlike any other; some with letters that not every encoding has."""
    out = {}
    for name in NAMES:
        out[name] = "Zq" + "".join(rng.choices(string.ascii_letters + string.digits, k=11))
    for name in ("description", "xmp_title", "iptc_caption", "user_comment"):
        out[name] += " é/ü & co"
    return out


def _tokens(texts: dict[str, str], place: Path, thumbnail: bytes) -> list[hidden.Token]:
    tokens = [hidden.token(name, text, text.split()[0]) for name, text in texts.items()]
    degrees = [h + m / 60 + s / 10000 / 3600 for (h, _), (m, _), (s, _) in (LATITUDE, LONGITUDE)]
    binary = [
        data
        for each in (LATITUDE, LONGITUDE)
        for data in (_rationals(each, "<"), _rationals(each, ">"))
    ]
    binary += [b64 for data in list(binary) for b64 in hidden.aligned(data)]
    binary += [struct.pack(order + "d", value) for value in degrees for order in "<>"]
    said = [f"{value:.5f}" for value in degrees] + ["51.50237", "17.66913", "30.1422", "40.1478"]
    today = datetime.datetime.now(datetime.UTC).date()
    tokens += [
        hidden.token("gps", *binary, *said),
        hidden.token("date", "1987:06:05", "1987-06-05", "19870605", "04:03:21"),
        hidden.token("thumbnail", thumbnail[len(thumbnail) // 2 :][:40]),
        hidden.token("place", str(place), str(place.resolve())),
        hidden.token("today", f"{today:%Y-%m-%d}", f"{today:%Y:%m:%d}"),
    ]
    if len(socket.gethostname()) > 7 and socket.gethostname() != "localhost":
        tokens.append(hidden.token("host", socket.gethostname(), texts["host"]))
    return tokens


def _check_search(row: base.Row, folder: Path, tokens: list[hidden.Token]) -> None:
    """Planted texts are found, in each form in which they may be held; and none where none is."""
    text, raw = "Zqplanted é/ü & co", _rationals(LATITUDE, "<")
    tokens = [hidden.token("text", text), *(each for each in tokens if each.name == "gps")]
    for name in hidden.planted(folder, text, raw):
        data = (folder / name.replace(" ", "-")).read_bytes()
        if not hidden.found_in(data, tokens):
            row.fail(f"the row itself: a text planted as {name} is not found")
    if hidden.found_in((base.ROOT / "samples" / "anna.jpg").read_bytes(), tokens):
        row.fail("the row itself: something is found in a file without it")


def tagged(photo: Path, texts: dict[str, str]) -> tuple[bytes, bytes]:
    """(thumbnail, the photo with everything private in it), both JPEG."""
    from PIL import Image, ImageCms

    picture, small, whole = Image.open(photo), io.BytesIO(), io.BytesIO()
    picture.resize((96, 120)).save(small, "JPEG", comment=texts["thumbnail_comment"])
    profile = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
    old, new = "sRGB built-in".encode("utf-16-be"), texts["icc"].encode("utf-16-be")
    picture.save(
        whole, "JPEG", quality=95, comment=texts["comment"], icc_profile=profile.replace(old, new)
    )
    data = whole.getvalue()
    packet = b"http://ns.adobe.com/xap/1.0/\0" + XMP.format(**_escaped(texts)).encode()
    parts = [
        (0xE1, b"Exif\0\0" + _exif(texts, small.getvalue())),
        (0xE1, packet),
        (0xED, _iptc(texts)),
    ]
    head = b"".join(struct.pack(">BBH", 0xFF, kind, len(body) + 2) + body for kind, body in parts)
    return small.getvalue(), data[:2] + head + data[2:]


def _escaped(texts: dict[str, str]) -> dict[str, str]:
    return {name: text.replace("&", "&amp;") for name, text in texts.items()}


def _rationals(values: tuple[tuple[int, int], ...], order: str) -> bytes:
    return b"".join(struct.pack(order + "II", *value) for value in values)


def _exif(texts: dict[str, str], thumbnail: bytes) -> bytes:
    """A TIFF block: the picture's tags, those of EXIF and GPS, and the thumbnail."""
    date, wide = b"1987:06:05 04:03:21\0", "utf-16-le"
    said = {name: text.encode() + b"\0" for name, text in texts.items()}
    image = {0x10E: said["description"], 0x10F: said["make"], 0x110: said["model"], 0x131: said["software"],
             0x132: date, 0x13B: said["artist"], 0x8298: said["copyright"], 0x8769: 0, 0x8825: 0,
             0x9C9B: texts["xp_title"].encode(wide), 0x9C9D: texts["xp_author"].encode(wide)}  # fmt: skip
    exif = {0x9003: date, 0x9004: date, 0x927C: said["maker_note"], 0xA420: said["image_id"],
            0x9286: b"UNICODE\0" + texts["user_comment"].encode(wide), 0xA430: said["owner"],
            0xA431: said["serial"], 0xA435: said["lens_serial"]}  # fmt: skip
    gps = {1: b"N\0", 2: LATITUDE, 3: b"E\0", 4: LONGITUDE, 0x1C: b"ASCII\0\0\0" + said["gps_area"],
           0x1D: b"1987:06:05\0"}  # fmt: skip
    second = {0x201: 0, 0x202: len(thumbnail)}
    tables = [image, exif, gps, second]
    for _ in range(2):  # once to learn where the tables lie, which does not depend on what they say
        places, out = [], b"II*\0" + struct.pack("<I", 8)
        for table in tables:
            places.append(len(out))
            out += _table(table, len(out))
        image[0x8769], image[0x8825], second[0x201] = places[1], places[2], len(out)
    end = 8 + 2 + 12 * len(image)
    return out[:end] + struct.pack("<I", places[3]) + out[end + 4 :] + thumbnail


def _table(table: dict, at: int) -> bytes:
    entries, more, free = b"", b"", at + 2 + 12 * len(table) + 4
    for tag, value in sorted(table.items()):
        kind, count, body = 2, 1, value
        if isinstance(value, int):
            kind, body = 4, struct.pack("<I", value)
        elif isinstance(value, tuple):
            kind, count, body = 5, len(value), _rationals(value, "<")
        else:
            kind, count = KINDS.get(tag, 2), len(value)
        if len(body) > 4:
            body, more = struct.pack("<I", free + len(more)), more + body + b"\0" * (len(body) % 2)
        entries += struct.pack("<HHI", tag, kind, count) + body.ljust(4, b"\0")
    return struct.pack("<H", len(table)) + entries + bytes(4) + more


def _iptc(texts: dict[str, str]) -> bytes:
    fields = {
        80: texts["iptc_byline"],
        90: texts["iptc_city"],
        120: texts["iptc_caption"],
        55: "19870605",
    }
    body = b"".join(
        struct.pack(">BBBH", 0x1C, 2, tag, len(text.encode())) + text.encode()
        for tag, text in fields.items()
    )
    return (
        b"Photoshop 3.0\08BIM\x04\x04\0\0"
        + struct.pack(">I", len(body))
        + body
        + b"\0" * (len(body) % 2)
    )
