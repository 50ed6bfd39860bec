"""Small valid files of every kind that the project reads: what the fuzzer starts from."""

import base64
import gzip
import json
import struct

import cv2
import numpy as np
from PIL import Image, ImageCms

from bakery.export import bundle
from bakery.export.glb import write_glb
from bakery.export.manifest import Baked, describe_levels, levels_of_detail, manifest
from bakery.export.web import WebOptions
from bakery.exporters.exr import ExrExporter
from bakery.exporters.glb import ProxiesExporter
from bakery.exporters.head import HeadExporter
from bakery.exporters.web import WebExporter
from bakery.formats import exr, image, livelink, mp4, record, video, webm
from bakery.geometry import camera as cameras
from bakery.heads.base import FOLLOW, PARTS, HeadModel
from bakery.heads.file import load_head, save_head
from bakery.runtime.avatar import Avatar
from bakery.stages.texture.mouth import mouth_landmarks
from bakery.types import (
    EXPRESSIONS,
    LANDMARKS,
    Camera,
    Fit,
    HairMesh,
    Landmarks,
    Maker,
    Photo,
    Textures,
)

SIZE = 16  # texels a side


def head():
    """A head model of some hundred bytes a part: a bent sheet of skin with what else a head has."""
    rng = np.random.default_rng(0)
    points, faces, uv, parts, follow = [], [], [], [], []

    def add(part, where, triangles, chart, moves="skin"):
        faces.extend(np.array(triangles) + sum(map(len, points)))
        parts.extend([PARTS.index(part)] * len(triangles))
        follow.extend([FOLLOW.index(moves)] * len(where))
        points.append(np.array(where, float))
        uv.append(np.array(chart, float))

    side = 6
    y, x = np.mgrid[1 : -1 : side * 1j, -1 : 1 : side * 1j].reshape(2, -1)
    cell = np.arange(side * side).reshape(side, side)
    a, b, c, d = (cell[i : side - 1 + i, j : side - 1 + j].ravel() for i in (0, 1) for j in (0, 1))
    grid = np.concatenate([np.stack([a, c, b], 1), np.stack([b, c, d], 1)])
    skin = np.stack([80 * x, 100 * y, 40 * (2 - x * x - y * y)], 1)
    add("skin", skin, grid, np.stack([x + 1, 1 - y], 1) / 4)
    eight = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]])
    ball = [[i, j, k] for i in (0, 1) for j in (2, 3) for k in (4, 5)]
    for name, sign in (("left", 1), ("right", -1)):
        middle = np.array([30.0 * sign, 30, 40])
        chart = [0.55, 0.05] + 0.02 * (eight[:, :2] + 1)
        add(f"eye_{name}", middle + 12 * eight, ball, chart, f"eye_{name}")
    corners = np.array([[-1, 1, 0], [1, 1, 0], [-1, -1, 0], [1, -1, 0.0]])
    quad = [[0, 2, 1], [1, 2, 3]]
    boxes = {"mouth_sheet": [0.6, 0.6, 0.2, 0.1]}
    boxes |= {
        f"eye_cap_{eye}": [0.6, 0.2 + 0.1 * k, 0.1, 0.1] for k, eye in enumerate(("left", "right"))
    }
    for name, (left, top, width, height) in boxes.items():
        chart = [left, top] + (corners[:, :2] * [1, -1] + 1) / 2 * [width, height]
        add(name, [0, -40, 50] + 20 * corners, quad, chart)
    mean = np.concatenate(points).astype(np.float32)
    faces = np.array(faces, np.int32)
    expression = rng.normal(0, 2, (len(EXPRESSIONS), len(mean), 3)).astype(np.float32)
    expression *= rng.random(expression.shape[:2] + (1,)) < 0.2
    bary = rng.dirichlet(np.ones(3), LANDMARKS).astype(np.float32)
    return HeadModel(
        "tiny", "CC0-1.0", "made up", mean, faces, np.concatenate(uv).astype(np.float32),
        faces.copy(), np.array(parts, np.uint8), np.array(follow, np.uint8),
        rng.normal(0, 1, (3, len(mean), 3)).astype(np.float32), expression,
        (np.arange(LANDMARKS) % len(grid)).astype(np.int32), bary, boxes,
    )  # fmt: skip


def hair():
    """Hair with volume of six faces: a cap, a card and a fringe of two each, on an atlas of noise."""
    rng = np.random.default_rng(9)
    square = np.array([[-1, 1], [1, 1], [-1, -1], [1, -1]])
    quad = np.array([[0, 2, 1], [1, 2, 3]])
    places = [[[x * 60, 110 + y * 30, 40 + 5 * card] for x, y in square] for card in range(3)]
    return HairMesh(
        vertices=np.concatenate(places).astype(np.float32),
        faces=np.concatenate([quad + 4 * card for card in range(3)]).astype(np.int32),
        uv=np.tile((square + 1) / 2, (3, 1)).astype(np.float32),
        kind=np.repeat([0, 1, 2], 2).astype(np.uint8),
        card=np.repeat([-1, 0, 1], 2).astype(np.int32),
        levels=np.repeat([7, 3, 1], 2).astype(np.uint8),
        hang=rng.random(12).astype(np.float32),
        texture=rng.random((SIZE, SIZE, 4)).astype(np.float16),
        direction=rng.random((SIZE, SIZE, 2)).astype(np.float16),
        root_to_tip=rng.random((SIZE, SIZE)).astype(np.float16),
        source=rng.integers(0, 5, (SIZE, SIZE)).astype(np.uint8),
    )


def textures(model):
    """Textures of noise."""
    rng = np.random.default_rng(1)

    def noise(*shape):
        return rng.random(shape).astype(np.float16)

    poses = (rng.random((2, len(EXPRESSIONS))) * 0.3).astype(np.float32)
    lips = [mouth_landmarks(model, model.mean, model.vertices(model.mean, row)) for row in poses]
    return Textures(
        neutral=noise(SIZE, SIZE, 3),
        keys=noise(2, SIZE, SIZE, 3),
        key_names=("smile", "open"),
        key_weights=poses.round(2),
        source=rng.integers(0, 5, (SIZE, SIZE)).astype(np.uint8),
        facing=noise(SIZE, SIZE),
        hair=noise(SIZE, SIZE, 4),
        gaze=noise(2, 4, 8, 3),
        gaze_directions=np.array([[0.0, 0.0], [20.0, -5.0]]),
        mouths=noise(2, 4, 6, 3),
        mouth_landmarks=np.stack(lips),
        mouth_weights=poses,
        maker=Maker("rendered", "0.1", "0" * 64, "compositeSynthetic"),
        made_from="1" * 64,
        hair_mesh=hair(),
    )


def fit(model):
    """A Fit of the tiny head in a picture of 96x120 pixels."""
    rng = np.random.default_rng(2)
    camera = Camera(200.0, np.array([48.0, 60]), np.zeros(3), np.array([0, 0, -600.0]), 96, 120)
    return Fit(
        model.name, camera, rng.normal(size=3), rng.random(len(EXPRESSIONS)) * 0.2,
        np.array([3.0, -2.0]), rng.random((9, 3)), rng.normal(size=4), rng.normal(size=(468, 3)),
        rng.uniform(10, 90, (LANDMARKS, 2)), 0.1, "exif", {"shadow_share": 0.01},
    )  # fmt: skip


def write_bundle(folder):
    """A whole bundle of some 100 KB, written by what `bakery build` runs; the sheet is noise."""
    model = head()
    made, masks = textures(model), np.random.default_rng(3).random((52, 8, 8), np.float32)
    picture = np.random.default_rng(4).random((120, 96, 3)).astype(np.float32)
    avatar = Avatar(model, model.mean, fit(model), made, masks, picture)
    (folder / "web").mkdir(parents=True)
    said = [
        exporter.export(avatar, folder / exporter.place, SIZE)
        for exporter in (
            ExrExporter(), HeadExporter(), ProxiesExporter(), WebExporter(WebOptions(side=64, photo=64)),
        )
    ]  # fmt: skip
    levels = levels_of_detail(model, model.mean)[:2]  # of four: their descriptions are long
    small = image.encode_image(picture[:SIZE, :SIZE], ".jpg")
    write_glb(folder / "head.glb", levels, EXPRESSIONS, small, None, "test")
    image.write_image(folder / "preview.png", picture)
    image.write_image(folder / "photo.png", picture)
    photo, found_by = Photo(picture, "0" * 64), Maker("network", "0.1", "2" * 64)
    baked = Baked(photo, avatar.fit, model, made, masks, [], made.maker, found_by)
    said.append({"lods": describe_levels(levels)})
    bundle.write_manifest(folder, manifest(baked, said, bundle.list_files(folder)))


def npz(folder):
    """What `bakery texture`, `mask` and `heads` write."""
    model = head()
    painted = record.textures_to_arrays(textures(model))
    save_head(folder / f"{model.name}.npz", model)
    record.write_arrays(folder / "textures.npz", painted)
    bald = {name: array for name, array in painted.items() if not name.startswith("hair_mesh")}
    np.savez_compressed(folder / "deflated.npz", **bald)
    masks = np.random.default_rng(3).random((52, 8, 8), np.float32)
    record.write_arrays(folder / "masks.npz", {"masks": masks, "head": np.array(model.digest)})


def tables(folder):
    """What `bakery fit` and `bakery detect` write."""
    placed = fit(head())
    points = placed.landmarks_projected
    face = Landmarks(np.array([10.0, 10, 80, 80]), 0.9, points, np.full(LANDMARKS, 0.8))
    (folder / "fit.json").write_bytes(record.dump(record.fit_to_table(placed)))
    found = record.faces_to_table(96, 120, [face, face])
    (folder / "faces.json").write_bytes(record.dump(found))
    model = load_head()  # its landmarks in a picture of grey noise
    near = Camera(400.0, np.array([80.0, 100]), np.zeros(3), np.array([0, 10.0, -500.0]), 160, 200)
    marks = cameras.project(model.landmarks(model.mean), near)
    face = Landmarks(
        np.concatenate([marks.min(0), np.ptp(marks, 0)]), 0.9, marks, np.ones(LANDMARKS)
    )
    (folder / "placed.json").write_bytes(record.dump(record.faces_to_table(160, 200, [face])))
    noise = np.random.default_rng(8).random((25, 20, 3)).astype(np.float32)
    image.write_image(folder / "placed.png", cv2.resize(noise, (160, 200)) * 0.2 + 0.4)


def exrs(folder):
    """EXR files with one and with several parts."""
    rng = np.random.default_rng(5)
    exr.write_exr(folder / "one.exr", {"neutral": rng.random((SIZE, SIZE, 3))})
    exr.write_exr(folder / "many.exr", {f"p{k}": rng.random((6, 5, 4)) for k in range(4)})
    grey = {"source": rng.integers(0, 5, (9, 40)), "facing": rng.random((9, 40))}
    exr.write_exr(folder / "grey.exr", grey, exr.DATA)


def takes(folder):
    """Takes, plain and packed."""
    rng = np.random.default_rng(6)
    count = 4
    rows = rng.random((count, 52)).astype(np.float32)
    angles, eyes = rng.normal(0, 5, (count, 3)), rng.normal(0, 5, (count, 2, 2))
    times = np.arange(count) / 30
    whole = livelink.format_take(livelink.Take(times, rows, angles, eyes, 86399.95))
    bare = livelink.format_take(livelink.Take(times, rows, np.zeros((count, 3)), None))
    (folder / "whole.csv").write_bytes(whole)
    (folder / "bare.csv").write_bytes(bare)
    (folder / "dropped.csv").write_bytes(whole.replace(b"\n", b"\n23:59:59:56.000,0\n", 1))
    (folder / "packed.csv.gz").write_bytes(gzip.compress(whole, mtime=0))


def clips(folder):
    """MP4 and WebM files, with and without sound, and the parts that they are made of."""
    rng = np.random.default_rng(7)
    pictures = [rng.integers(0, 255, (32, 48, 3), np.uint8) for _ in range(3)]
    note = video.Note("a", "b")
    for kind in (".mp4", ".webm"):
        part = folder / f"part{kind}"
        part.write_bytes(video.encode(pictures, kind, 25.0))
        video.join(folder / f"mute{kind}", [part], kind, 25.0, (48, 32), note)
        sound = (_aac if kind == ".mp4" else _opus)(folder, rng)
        video.join(folder / f"clip{kind}", [part], kind, 25.0, (48, 32), note, sound)


def _sound_frames(folder, rng, count):
    sizes = rng.integers(8, 30, count)
    raw = folder / "sound.raw"
    raw.write_bytes(rng.bytes(int(sizes.sum())))
    return [(raw, int(at), int(n)) for at, n in zip(np.cumsum(sizes) - sizes, sizes)]


def _aac(folder, rng):
    esds = mp4.full(b"esds", b"\x03\x80\x80\x80\x22decoder")
    body = struct.pack(">HHIHHHHHH", 1, 0, 0, 2, 16, 0xFFFE, 0, 8000, 0)
    wave = mp4.box(b"wave", mp4.box(b"frma", b"mp4a"), esds)
    entry = mp4.box(b"mp4a", bytes(6) + struct.pack(">H", 1) + body + bytes(16) + wave)
    places = _sound_frames(folder, rng, 6)
    return mp4.Track("soun", entry, 8000, np.full(6, 160), places, np.ones(6, bool), 0.01)


def _opus(folder, rng):
    entry = webm.element(0xE1, webm.element(0xB5, struct.pack(">d", 48000.0)))
    entry += webm.element(0x63A2, b"OpusHead\x01\x01\0\0\x80\xbb\0\0\0\0\0")
    places = _sound_frames(folder, rng, 6)
    return webm.Blocks("A_OPUS", entry, np.arange(6) * 0.02, places, np.ones(6, bool))


def photos(folder):
    """Pictures in every format that photos come in, 96 to 100 pixels a side."""
    y, x = np.mgrid[:96, :100] / 100
    grey = (255 * np.stack([x, y, (x + y) / 2], -1)).astype(np.uint8)
    picture = Image.fromarray(grey)
    exif = Image.Exif()
    exif[274] = 6
    exif.get_ifd(0x8769)[41989] = 50
    profile = ImageCms.ImageCmsProfile(ImageCms.createProfile("XYZ")).tobytes()

    def add(name, image, form, **options):
        image.save(folder / name, form, **options)

    add("plain.jpg", picture, "JPEG", quality=60)
    add("exif.jpg", picture, "JPEG", exif=exif, icc_profile=profile, progressive=True)
    add("cmyk.jpg", picture.convert("CMYK"), "JPEG")
    add("rgb.png", picture, "PNG", icc_profile=profile, exif=exif)
    add("palette.png", picture.quantize(16), "PNG")
    add("alpha.png", picture.convert("RGBA"), "PNG")
    add("plain.tif", picture, "TIFF", compression="tiff_lzw", exif=exif)
    add("lossy.webp", picture, "WEBP", quality=50, exif=exif)
    add("still.gif", picture.quantize(8), "GIF")
    add(
        "moving.gif", picture.quantize(8), "GIF", save_all=True, append_images=[picture.quantize(4)]
    )
    add("plain.bmp", picture.convert("L"), "BMP")
    add("plain.jp2", picture, "JPEG2000")
    add("plain.avif", picture, "AVIF")
    add("plain.ppm", picture, "PPM")
    cv2.imwrite(str(folder / "deep.png"), grey.astype(np.uint16) * 257)


def meshes(folder):
    """A sheet of 512 triangles, as many as a head needs, in every format; with uv and without."""
    import trimesh
    from trimesh.visual.texture import TextureVisuals

    v, u = np.mgrid[0:1:17j, 0:1:17j].reshape(2, -1)
    cell = np.arange(17 * 17).reshape(17, 17)
    a, b, c, d = (cell[i : 16 + i, j : 16 + j].ravel() for i in (0, 1) for j in (0, 1))
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([b, d, c], 1)])
    points = np.stack([u, v, u * v], 1).round(4)
    bare = trimesh.Trimesh(points, faces, process=False)
    whole = trimesh.Trimesh(
        points, faces, process=False, visual=TextureVisuals(uv=np.stack([u, v], 1).round(4))
    )
    whole.export(folder / "whole.obj")
    bare.export(folder / "bare.glb")
    whole.export(folder / "whole.glb")
    bare.export(folder / "bare.ply")
    (folder / "text.ply").write_bytes(trimesh.exchange.ply.export_ply(bare, encoding="ascii"))
    quads = ["v " + " ".join(f"{x:g}" for x in point) for point in points]
    quads += [f"f {p + 1} {q + 1} {s + 1} {r + 1}" for p, q, r, s in zip(a, b, c, d)]
    (folder / "quads.obj").write_text("\n".join(quads))
    binary = points.astype("<f4").tobytes() + faces.astype("<u4").tobytes()
    place = {"componentType": 5126, "type": "VEC3", "count": len(points), "bufferView": 0}
    corners = {"componentType": 5125, "type": "SCALAR", "count": faces.size, "bufferView": 1}
    text = "data:application/octet-stream;base64," + base64.b64encode(binary).decode()
    described = {
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": len(binary), "uri": text}],
        "bufferViews": [
            {"buffer": 0, "byteLength": 12 * len(points)},
            {"buffer": 0, "byteOffset": 12 * len(points), "byteLength": 12 * len(faces)},
        ],
        "accessors": [place, corners],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "nodes": [{"mesh": 0, "scale": [1, 1, 1]}],
        "scenes": [{"nodes": [0]}],
    }
    (folder / "inside.gltf").write_text(json.dumps(described))


def write(folder):
    """All of them, each kind in a folder of its name, and the bundle."""
    for make in (npz, tables, exrs, takes, clips, photos, meshes):
        (folder / make.__name__).mkdir()
        make(folder / make.__name__)
    write_bundle(folder / "whole.avatar")
