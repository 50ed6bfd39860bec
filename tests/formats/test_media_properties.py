"""Clips and heads for players by rule: any boxes, any bytes, any small mesh."""

import io
import struct

import numpy as np
from hypothesis import given
from hypothesis import strategies as some
from hypothesis.extra import numpy as arrays

from bakery.errors import InputError
from bakery.export import glb
from bakery.formats import mp4, video, webm

KINDS = some.sampled_from([b"moov", b"trak", b"free", b"mdat", b"stbl", b"\0\0\0\0"])


@given(some.lists(some.tuples(KINDS, some.binary(max_size=30)), max_size=6))
def test_boxes_come_back(content):
    data = b"".join(mp4.box(kind, body) for kind, body in content)
    found = [(kind, data[start:end]) for kind, start, end in mp4.boxes(data)]
    assert found == content


@given(some.binary(max_size=200))
def test_boxes_of_any_bytes_lie_inside_and_in_order(data):
    last = 0
    try:
        for _, start, end in mp4.boxes(data):
            assert last + 8 <= start <= end <= len(data)
            last = end
    except ValueError:
        pass


PIECES = some.recursive(
    some.binary(max_size=24),
    lambda inner: some.lists(
        some.builds(
            lambda kind, body, size: struct.pack(">I4s", size(len(body) + 8), kind) + body,
            some.sampled_from([b"moov", b"trak", b"mdia", b"minf", b"stbl", b"hdlr", b"mdhd", b"stsd",
                               b"stsz", b"stts", b"stsc", b"stco", b"elst", b"edts"]),
            inner,
            some.sampled_from([lambda n: n, lambda n: n, lambda n: n, lambda n: n + 1, lambda n: 0]),
        ),
        max_size=4,
    ).map(b"".join),
    max_leaves=12,
)  # fmt: skip


@given(PIECES)
def test_any_boxes_are_a_clip_or_an_error(tmp_path_factory, inside):
    path = tmp_path_factory.getbasetemp() / "any.mp4"
    path.write_bytes(mp4.box(b"ftyp", b"isom" + bytes(4)) + mp4.box(b"moov", inside))
    try:
        assert isinstance(mp4.read_tracks(path), list)
    except InputError as error:
        assert "\n" not in str(error)


@given(some.integers(1, 40), some.integers(0, 2**32))
def test_samples_are_where_they_were_written(tmp_path_factory, count, seed):
    """Tracks of any lengths, interleaved: sizes, times, places and keys come back."""
    rng = np.random.default_rng(seed)
    folder = tmp_path_factory.getbasetemp()
    sizes = rng.integers(0, 50, count)
    content = rng.bytes(int(sizes.sum()))
    (folder / "raw").write_bytes(content)
    places = [(folder / "raw", int(at), int(n)) for at, n in zip(np.cumsum(sizes) - sizes, sizes)]
    entry = mp4.box(b"mp4v", bytes(70))
    durations = rng.integers(1, 5, count)
    track = mp4.Track(
        "vide", entry, int(rng.integers(1, 90)), durations, places, rng.random(count) < 0.5
    )
    with open(folder / "any.mp4", "wb") as file:
        mp4.write_mp4(file, [track], (16, 16), "note", "<x/>")
    (back,) = mp4.read_tracks(folder / "any.mp4")
    data = (folder / "any.mp4").read_bytes()
    assert b"".join(data[at : at + n] for _, at, n in back.places) == content
    assert [n for *_, n in back.places] == sizes.tolist()
    assert (back.entry, back.timescale) == (entry, track.timescale)
    np.testing.assert_array_equal(back.durations, durations)
    if track.sync.any():  # a file without a table of keys has nothing but keys
        np.testing.assert_array_equal(back.sync, track.sync)


@given(some.sampled_from([0xA3, 0x1654AE6B, 0xD7, 0x4286]), some.binary(max_size=50))
def test_elements_come_back(kind, body):
    data = webm.element(kind, body)
    first = next(webm.elements(io.BytesIO(data)))
    assert first == (kind, len(data) - len(body), len(body))


IDS = some.sampled_from(
    [webm.SEGMENT, webm.CLUSTER, webm.TRACKS, webm.ENTRY, webm.TIME, webm.SIMPLE, webm.GROUP,
     webm.BLOCK, 0xD7, 0x83, 0x86, 0x2AD7B1, 0xEC]
)  # fmt: skip
TREES = some.recursive(
    some.binary(max_size=12) | some.just(b"A_OPUS") | some.just(b"\x02") | some.just(b"\x01"),
    lambda inner: some.lists(some.builds(webm.element, IDS, inner), max_size=4).map(b"".join),
    max_leaves=12,
)


@given(TREES, some.binary(max_size=4))
def test_any_elements_are_sound_or_an_error(tmp_path_factory, inside, rest):
    path = tmp_path_factory.getbasetemp() / "any.webm"
    path.write_bytes(b"\x1aE\xdf\xa3\x80" + webm.element(webm.SEGMENT, inside) + rest)
    try:
        video.read_sound(path, ".webm")
    except InputError as error:
        assert "\n" not in str(error)


# --- glTF, by pygltflib and by trimesh ---


@some.composite
def surfaces(draw):
    """A small mesh with shapes, some at rest."""
    count = draw(some.integers(3, 12))
    place = some.floats(-300, 300, width=32)
    corners = some.integers(0, count - 1)
    faces = draw(arrays.arrays(np.int64, (draw(some.integers(1, 8)), 3), elements=corners))
    shapes = draw(arrays.arrays(np.float32, (3, count, 3), elements=some.floats(-50, 50, width=32)))
    shapes *= draw(arrays.arrays(bool, (3, count, 1)))
    return glb.Surface(
        "skin",
        draw(arrays.arrays(np.float32, (count, 3), elements=place)),
        np.tile(np.float32([0, 0, 1]), (count, 1)),
        draw(arrays.arrays(np.float32, (count, 2), elements=some.floats(0, 1, width=32))),
        faces,
        shapes,
    )


@given(surfaces())
def test_another_reader_finds_the_mesh_and_its_shapes(tmp_path_factory, surface):
    """Positions in metres to a float's last digit; shapes shorter than `STILL` are at rest."""
    import pygltflib
    import trimesh

    path = tmp_path_factory.getbasetemp() / "any.glb"
    glb.write_glb(path, [[surface]], ["a", "b", "c"], b"\x89PNG", None, "test")
    document = pygltflib.GLTF2.load_binary(str(path))
    blob = document.binary_blob()

    def view(number, kind, width):
        at = document.bufferViews[number]
        return np.frombuffer(blob[at.byteOffset : at.byteOffset + at.byteLength], kind).reshape(
            -1, width
        )

    def accessor(number):
        entry = document.accessors[number]
        width = {"SCALAR": 1, "VEC2": 2, "VEC3": 3}[entry.type]
        kind = {5126: "<f4", 5125: "<u4", 5123: "<u2"}[entry.componentType]
        out = np.zeros((entry.count, width), kind)
        if entry.bufferView is not None:
            out[:] = view(entry.bufferView, kind, width)
        if entry.sparse:
            rows = view(entry.sparse.indices.bufferView, "<u2", 1)[:, 0]
            out[rows] = view(entry.sparse.values.bufferView, kind, width)
        return out

    (primitive,) = document.meshes[0].primitives
    positions = accessor(primitive.attributes.POSITION)
    np.testing.assert_allclose(positions, surface.vertices / 1000, rtol=1e-6)
    np.testing.assert_array_equal(accessor(primitive.attributes.TEXCOORD_0), surface.uv)
    np.testing.assert_array_equal(accessor(primitive.indices).reshape(-1, 3), surface.faces)
    assert document.meshes[0].extras["targetNames"] == ["a", "b", "c"]
    for target, shape in zip(primitive.targets, surface.shapes):
        moving = np.linalg.norm(shape, axis=1) > glb.STILL
        wanted = np.where(moving[:, None], shape, 0) / 1000
        np.testing.assert_allclose(accessor(target["POSITION"]), wanted, rtol=1e-6)
    for number, entry in enumerate(document.accessors):
        if entry.min:
            values = accessor(number)
            np.testing.assert_array_equal(values.min(0), np.float32(entry.min))
            np.testing.assert_array_equal(values.max(0), np.float32(entry.max))
    (mesh,) = trimesh.load(path, process=False, skip_materials=True).geometry.values()
    np.testing.assert_array_equal(mesh.faces, surface.faces)
    np.testing.assert_allclose(mesh.vertices, surface.vertices / 1000, rtol=1e-6)
