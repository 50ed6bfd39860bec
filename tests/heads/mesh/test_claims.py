"""Mesh files of a few megabytes that ask for gigabytes are refused before the memory is taken."""

import json
import subprocess
import sys
from base64 import b64encode
from io import BytesIO

import numpy as np
import pytest
from PIL import Image

from bakery.errors import InputError
from bakery.formats.glb import joined
from bakery.heads.mesh import read
from bakery.heads.mesh.read import read_surface

MOST_MEMORY = 2**30  # bytes of a process that has trimesh loaded; the worst of them took 3.1 GiB
FLOAT, SHORT = 5126, 5123
POINTS = {"bufferView": 0, "componentType": FLOAT, "type": "VEC3", "count": 3}
TRIANGLE = np.float32([[0, 0, 0], [1, 0, 0], [0, 1, 0]]).tobytes()


def scene(data=TRIANGLE, accessor=None, more=(), views=None, **other):
    """The description of a GLB whose only mesh is of one accessor, which may be changed."""
    return {
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": len(data)}],
        "bufferViews": views or [{"buffer": 0, "byteLength": len(data)}],
        "accessors": [POINTS if accessor is None else accessor, *more],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "nodes": [{"mesh": 0}],
        "scenes": [{"nodes": [0]}],
        "scene": 0,
    } | other


def glb(data=TRIANGLE, **change):
    return joined(scene(data, **change), data)


def ply(vertices, faces=0, form="binary_little_endian", body=b"\0" * 40, comment=""):
    head = f"ply\nformat {form} 1.0\n{comment}element vertex {vertices}\n"
    head += "".join(f"property float {axis}\n" for axis in "xyz")
    head += f"element face {faces}\nproperty list uchar int vertex_indices\nend_header\n"
    return head.encode() + body


def without_view(count):
    return {key: value for key, value in POINTS.items() if key != "bufferView"} | {"count": count}


MEGABYTE = bytes(2**20)
SMALL_STEP = {"buffer": 0, "byteLength": 2**20, "byteStride": 4}


def pictures():
    """A square with uv and a black picture of 169 megapixels: 0.7 MB that unpack to 676 MB."""
    file = BytesIO()
    Image.new("RGBA", (13_000, 13_000)).save(file, "PNG")
    corners = np.float32([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]])
    places = np.tile(corners, (300, 1))
    places[:, 2] = np.arange(300).repeat(4)
    faces = (np.array([[0, 1, 2], [1, 3, 2]]) + 4 * np.arange(300)[:, None, None]).astype("<u4")
    uv = np.ascontiguousarray(places[:, :2])
    parts = [places.tobytes(), faces.tobytes(), uv.tobytes(), file.getvalue()]
    starts = np.cumsum([0, *map(len, parts)])
    accessors = [
        POINTS | {"count": 1200},
        {"bufferView": 1, "componentType": 5125, "type": "SCALAR", "count": faces.size},
        {"bufferView": 2, "componentType": FLOAT, "type": "VEC2", "count": 1200},
    ]
    part = {"attributes": {"POSITION": 0, "TEXCOORD_0": 2}, "indices": 1, "material": 0}
    whole = b"".join(parts)
    described = scene(
        whole, accessors[0], accessors[1:],
        [{"buffer": 0, "byteOffset": int(at), "byteLength": len(p)} for at, p in zip(starts, parts)],
        images=[{"bufferView": 3, "mimeType": "image/png"}], textures=[{"source": 0}],
        materials=[{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
        meshes=[{"primitives": [part]}],
    )  # fmt: skip
    return joined(described, whole)


HOSTILE = {
    "pictures.glb": (pictures, "1200 points of uv"),  # harmless: they are not looked at
    "escaped.gltf": (
        lambda: json.dumps(scene(im=0)).replace('"im"', '"\\u0069mages"'), "not a readable mesh"
    ),
    "zeros.glb": (lambda: glb(accessor=without_view(30_000_000)), "30,000,000 vertices without a buffer view"),
    "zeros.gltf": (
        lambda: json.dumps(scene(accessor=without_view(30_000_000), bufferViews=[], buffers=[])),
        "30,000,000 vertices without a buffer view",
    ),
    "digits.glb": (lambda: glb(accessor=without_view(10**400)), r"add up to over 10\^15 MiB"),
    "shapes.glb": (lambda: glb(more=[without_view(5_000_000)] * 52), "accessors add up to"),
    "beyond.glb": (lambda: glb(accessor=POINTS | {"count": 4}), "4 entries of 12 bytes"),
    "behind.glb": (lambda: glb(accessor=POINTS | {"byteOffset": 4}), "3 entries of 12 bytes"),
    "steps.glb": (
        lambda: glb(MEGABYTE, views=[SMALL_STEP], more=[POINTS | {"count": 87_000}] * 500),
        "accessors add up to",
    ),
    "copies.glb": (
        lambda: glb(MEGABYTE, views=[{"buffer": 0, "byteOffset": 1, "byteLength": 2**20 - 1}] * 3000),
        "buffer views add up to",
    ),
    "view.glb": (
        lambda: glb(views=[{"buffer": 0, "byteLength": 2**40}]), "buffer view 0 has 1,099,511,627,776"
    ),
    "below.glb": (lambda: glb(accessor=without_view(-5)), "accessor 0 has the count -5"),
    "drawn.glb": (
        lambda: glb(
            more=[without_view(3000) | {"componentType": SHORT, "type": "SCALAR"}],
            meshes=[{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        ),
        "3,000 corners without a buffer view",
    ),
    "half.glb": (lambda: glb(accessor=without_view(3e7)), "a count is needed"),
    "crowd.glb": (
        lambda: glb(
            MEGABYTE, accessor=POINTS | {"count": 87_000}, nodes=[{"mesh": 0}] * 900,
            scenes=[{"nodes": list(range(900))}],
        ),
        "78,300,000 vertices",
    ),
    "corners.glb": (
        lambda: glb(
            MEGABYTE, nodes=[{"mesh": 0}] * 12, scenes=[{"nodes": list(range(12))}],
            more=[{"bufferView": 0, "componentType": SHORT, "type": "SCALAR", "count": 2**19}],
            meshes=[{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        ),
        "2,097,156 triangles",
    ),
    "device.gltf": (
        lambda: json.dumps(scene(buffers=[{"byteLength": 36, "uri": "/dev/zero"}])), "is no file"
    ),
    "vertices.ply": (lambda: ply(3_000_000_000), "3,000,000,000 elements 'vertex'"),
    "text.ply": (lambda: ply(3_000_000_000, form="ascii"), "3,000,000,000 elements 'vertex'"),
    "faces.ply": (lambda: ply(3, 2_000_001), "2,000,001 faces"),
    "fewer.ply": (lambda: ply(2_000_000), "2,000,000 elements in 40 bytes"),
    "minus.ply": (lambda: ply(-1), "a count is needed"),
    "blank.ply": (lambda: ply(3, form="ascii", body=b"\n" * 20_000_000), "lines for 3 elements"),
    "hidden.ply": (
        lambda: ply(3_000_000_000, comment="comment no_end_header\n"), "3,000,000,000 elements"
    ),
    "faces.obj": (lambda: b"v 0 0 0\n" + b"f 1 1 1\n" * 2_000_001, "2,000,001 faces"),
    "fan.obj": (lambda: b"v 0 0 0\nf" + b" 1" * 10_000_000, "a line of 20,000,001 bytes"),
}  # fmt: skip
READ = """
import sys
from bakery.errors import InputError
from bakery.heads.mesh.read import read_surface
for path in sys.argv[1:]:
    try:
        print(f"{path}: {len(read_surface(path).uv)} points of uv")
    except InputError as error:
        print(error)
print(next(line for line in open("/proc/self/status") if line.startswith("VmHWM")))
"""


@pytest.fixture(scope="module")
def hostile(tmp_path_factory):
    """The folder of all files, and what is said of each and how much memory reading them takes."""
    folder = tmp_path_factory.mktemp("hostile")
    for name, (make, _) in HOSTILE.items():
        data = make()
        (folder / name).write_bytes(data.encode() if isinstance(data, str) else data)
    done = subprocess.run(
        [sys.executable, "-c", READ, *HOSTILE], cwd=folder, capture_output=True, text=True, check=True
    )  # fmt: skip
    *said, memory = done.stdout.strip().splitlines()
    return dict(line.split(": ", 1) for line in said), int(memory.split()[1]) * 1024


@pytest.mark.parametrize("name", HOSTILE)
def test_it_is_said_in_one_line(hostile, name):
    with pytest.raises(InputError, match=HOSTILE[name][1]):
        raise InputError(hostile[0][name])


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="needs /proc")
def test_they_take_little_memory(hostile):
    assert len(hostile[0]) == len(HOSTILE)
    assert hostile[1] < MOST_MEMORY


def test_the_command_refuses_with_its_code(bakery, tmp_path):
    (tmp_path / "zeros.glb").write_bytes(HOSTILE["zeros.glb"][0]())
    done = bakery("heads", "import", "mesh", tmp_path / "zeros.glb", "-o", tmp_path / "a.npz")
    assert done.returncode == 1
    assert "mesh 0 tells of 30,000,000 vertices without a buffer view" in done.stderr


@pytest.mark.parametrize(
    "data, words",
    [
        (b"v 0\n" * 9001 + b"f 1 1 1\n", "9,001 lines of vertices, at most 9,000"),
        (b"v 0 0 0\n" + b"f 1 1 1 1 1 1 1\n" * 900, "6,300 corners of faces, at most 6,000"),
        (b"v 0 0 0\nf" + b" 1 1 1\\\n" * 2001, "6,003 corners of faces, at most 6,000"),
    ],
)
def test_lines_and_corners_are_counted(tmp_path, monkeypatch, data, words):
    monkeypatch.setattr(read, "MOST_FACES", 1000)
    (tmp_path / "a.obj").write_bytes(data)
    with pytest.raises(InputError, match=words):
        read_surface(tmp_path / "a.obj")


def test_files_beside_count(tmp_path):
    """A buffer that lies beside a glTF is part of it: as large as it is, and refused with it."""
    described = scene(buffers=[{"byteLength": 36, "uri": "large.bin"}])
    (tmp_path / "a.gltf").write_text(json.dumps(described))
    with (tmp_path / "large.bin").open("wb") as file:
        file.truncate(401 * 2**20)  # no block of it is written
    with pytest.raises(InputError, match="401 MiB with the files beside it, at most 400"):
        read_surface(tmp_path / "a.gltf")


def test_good_files_pass(skin, export, tmp_path):
    """Interleaved, beside and inside: the claims of a real mesh hold."""
    whole = read_surface(export(tmp_path / "a.glb", skin))
    points = (
        np.concatenate([skin.vertices, skin.vertices], 1).astype("<f4").tobytes()
    )  # and normals
    corners = skin.faces.astype("<u4").tobytes()
    place = {"componentType": FLOAT, "type": "VEC3", "count": len(skin.vertices), "bufferView": 0}
    index = {"bufferView": 1, "componentType": 5125, "type": "SCALAR", "count": skin.faces.size}
    part = {"attributes": {"POSITION": 0, "NORMAL": 1}, "indices": 2}
    described = scene(
        accessor=place, more=[place | {"byteOffset": 12}, index],
        views=[{"buffer": 0, "byteLength": len(points), "byteStride": 24},
               {"buffer": 0, "byteOffset": len(points), "byteLength": len(corners)}],
        meshes=[{"primitives": [part]}],
    )  # fmt: skip
    (tmp_path / "b.bin").write_bytes(points + corners)
    text = "data:application/octet-stream;base64," + b64encode(points + corners).decode()
    for name, uri in (("beside.gltf", "b.bin"), ("inside.gltf", text)):
        buffers = [{"byteLength": len(points + corners), "uri": uri}]
        (tmp_path / name).write_text(json.dumps(described | {"buffers": buffers}))
        found = read_surface(tmp_path / name)
        np.testing.assert_allclose(
            np.sort(found.vertices, 0), np.sort(whole.vertices, 0), atol=1e-4
        )
