"""Files and packets of others by rule: any bytes give a value or one line of ours; what is written returns."""

import json
import runpy
import struct
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as some
from hypothesis.extra import numpy as arrays

from bakery.bake.targets import read_targets
from bakery.errors import BakeryError, InputError
from bakery.export.validate_glb import glb_problems
from bakery.formats import glb, light, livelink_udp, record
from bakery.geometry import harmonics
from bakery.geometry.color import LUMA
from bakery.heads.mesh.read import Surface, read_surface
from bakery.motion.fits import FRAMES, IDENTITY, ROWS, ClipFit, read_fits, write_fits
from bakery.types import EXPRESSIONS

OURS = runpy.run_path(str(Path(__file__).parents[1] / "livelink_packets.py"))
TEXT = some.text(some.characters(exclude_categories=("Cs",)), max_size=12)
NUMBERS = some.integers() | some.floats() | some.floats(-1, 2)
JSON = some.recursive(
    some.none() | some.booleans() | NUMBERS | TEXT,
    lambda inner: some.lists(inner, max_size=3) | some.dictionaries(TEXT, inner, max_size=3),
    max_leaves=6,
)
DIGITS = "0x" + "f" * 5000  # valid TOML, but nothing that Python prints


def value_or_line(read, kind=BakeryError):
    """What `read()` gives, or None if it refuses in one short line."""
    try:
        return read()
    except kind as error:
        assert 0 < len(str(error)) < 2000 and "\n" not in str(error)
        return None


def mutated(data):
    """Bytes with a piece of them changed, left out or put in."""
    return some.builds(
        lambda at, gone, new: data[:at] + new + data[at + gone :],
        some.integers(0, len(data)), some.integers(0, 8), some.binary(max_size=8),
    )  # fmt: skip


# --- GLB ---


@given(some.dictionaries(TEXT, JSON.filter(lambda v: v == v), max_size=4), some.binary(max_size=40))
def test_a_glb_comes_apart_as_it_was_joined(document, binary):
    found, rest = glb.apart(data := glb.joined(document, binary))
    assert json.dumps(found) == json.dumps(document)
    assert rest[: len(binary)] == binary and len(rest) - len(binary) < 4 and len(data) % 4 == 0


KEYS = ("bufferViews", "accessors", "meshes", "scenes", "nodes", "buffers")


@given(
    some.binary(max_size=80)
    | some.builds(
        glb.joined, some.fixed_dictionaries(dict.fromkeys(KEYS, JSON)), some.binary(max_size=8)
    ),
    some.integers(0, 1),
)
def test_any_glb_has_findings_in_one_line(data, minor):
    found = glb_problems("a.glb", data, ["skin"], minor)
    assert found and all(line.startswith("a.glb: ") and "\n" not in line for line in found)


# --- meshes ---


@pytest.fixture(scope="module")
def sheets(tmp_path_factory):
    """A sheet of 512 triangles as bytes by the ending of its file, and its Surface."""
    import trimesh

    v, u = np.mgrid[0:1:17j, 0:1:17j].reshape(2, -1)
    cell = np.arange(17 * 17).reshape(17, 17)
    a, b, c, d = (cell[i : 16 + i, j : 16 + j].ravel() for i in (0, 1) for j in (0, 1))
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([b, d, c], 1)])
    points = np.stack([u, v, u * v], 1)
    files = {}
    for kind in ("obj", "ply", "glb"):
        path = tmp_path_factory.mktemp("sheets") / f"sheet.{kind}"
        trimesh.Trimesh(points, faces, process=False).export(path)
        files[kind] = path.read_bytes()
    return files, points[faces]


@given(some.data(), some.sampled_from(["obj", "ply", "glb"]))
def test_a_mesh_that_is_changed_is_a_mesh_or_an_error(sheets, tmp_path_factory, data, kind):
    path = tmp_path_factory.getbasetemp() / f"any.{kind}"
    path.write_bytes(data.draw(mutated(sheets[0][kind]) | some.binary(max_size=60)))
    found = value_or_line(lambda: read_surface(path), InputError)
    if found is not None:
        assert isinstance(found, Surface) and np.isfinite(found.vertices).all()
        assert 0 <= found.faces.min() <= found.faces.max() < len(found.vertices)


@pytest.mark.parametrize("kind", ["obj", "ply", "glb"])
def test_a_mesh_that_is_not_comes_back(sheets, tmp_path, kind):
    (tmp_path / f"a.{kind}").write_bytes(sheets[0][kind])
    found = read_surface(tmp_path / f"a.{kind}")
    ours, theirs = found.vertices[found.faces].mean(1), sheets[1].mean(1)
    assert len(ours) == len(theirs)
    np.testing.assert_allclose(  # float32, or eight digits
        ours[np.lexsort(ours.round(5).T)], theirs[np.lexsort(theirs.round(5).T)], atol=1e-6
    )


# --- packets of Live Link Face ---


@given(
    some.binary(max_size=400)
    | mutated(OURS["packet"]({"JawOpen": 0.5}))
    | mutated(OURS["packet"]()).map(lambda data: b"\x06" + data)
)
def test_any_packet_is_a_face_or_none_or_an_error(data):
    found = value_or_line(lambda: livelink_udp.parse_packet(data), InputError)
    if found is not None:
        assert found.values.shape == (61,) and np.isfinite([*found.values, found.seconds]).all()


@given(
    some.lists(some.floats(-6, 6, width=32), min_size=61, max_size=61),
    some.integers(0, 10**7), some.floats(0, 1, width=32), some.integers(1, 240), TEXT,
)  # fmt: skip
def test_packets_come_back(values, frame, part, rate, subject):
    table = dict(zip(OURS["NAMES"], values))
    data = OURS["packet"](table, frame, part, (rate, 1), subject)
    found = livelink_udp.parse_packet(data)
    assert found.subject == subject and found.seconds == (frame + part) / rate
    wanted = [table[name] for name in (*livelink_udp.ORDER, *livelink_udp.HEAD, *livelink_udp.EYES)]
    np.testing.assert_array_equal(found.values, np.float32(wanted))


# --- lights ---


def check_light(name):
    found = value_or_line(lambda: light.read_light(str(name)))
    if found is not None:
        assert found.shape == (9, 3) and np.isfinite(found).all()


@given(TEXT | some.sampled_from(["studio", "sunset", "a.exr", "a.json", ".", ""]))
def test_any_name_is_a_light_or_an_error(name):
    check_light(name)


COLOR = some.lists(NUMBERS, min_size=2, max_size=4) | some.lists(
    some.floats(0, 9), min_size=3, max_size=3
)


@given(
    some.fixed_dictionaries(
        {"sky": COLOR, "ground": COLOR},
        optional={
            "exposure": NUMBERS | TEXT,
            "lamps": JSON | some.lists(
                some.fixed_dictionaries({"azimuth": NUMBERS, "elevation": NUMBERS, "color": COLOR}),
                max_size=2,
            ),
        },
    )
)  # fmt: skip
def test_any_table_is_a_light_or_an_error(table):
    found = value_or_line(lambda: light._exposed("a", light._of_table("a", table), table))
    if found is not None:
        stops = float(table.get("exposure", 0))
        assert harmonics.C0 * found[0] @ LUMA == pytest.approx(2**stops)


EXR = struct.pack("<II", 20000630, 2) + b"channels\0chlist\0\1\0\0\0\0"


@given(
    some.sampled_from([".toml", ".json", ".exr"]),
    some.binary(max_size=60)
    | mutated(b"sky = [1, 1, 1]\nground = [0.1, 0.2, 1]\nexposure = 1\n")
    | mutated(json.dumps({"light": [[1, 1, 1]] * 9}).encode())
    | some.dictionaries(some.sampled_from(["light", "camera", "exposure"]), JSON).map(record.dump)
    | mutated(EXR),
)
@example(".toml", f"sky = [{DIGITS}, 1, 1]\nground = [1, 1, 1]".encode())
@example(".toml", f"{'[' * 9999}".join(["sky = ", ""]).encode())
def test_any_file_is_a_light_or_an_error(tmp_path_factory, kind, data):
    path = tmp_path_factory.getbasetemp() / f"any-light{kind}"
    path.write_bytes(data)
    check_light(path)


# --- expressions ---

WORDS = (*EXPRESSIONS[:3], "x", "keys", "neutral", "-1", "2", "nan", "1e999", "'a'", "true", "[]",
         "9" * 400, "1979-13-01", "é", "directions", "[[0, 0]]", "[[99, 0]]", "[[1], 2]", "{}")  # fmt: skip
GOOD = """[keys.smile]\njawOpen = 0.5\n[gaze]\ndirections = [[10, -5]]\n[[mouths]]\njawOpen = 1\n"""


@given(
    some.binary(max_size=60)
    | mutated(GOOD.encode())
    | some.builds(
        lambda old, new: GOOD.replace(old, new, 1).encode(),
        some.sampled_from(["smile", "jawOpen", "0.5", "[[10, -5]]", "10", "directions", "1"]),
        some.sampled_from(WORDS),
    )
)
@example(GOOD.replace("10", DIGITS).encode())
@example(GOOD.replace("0.5", DIGITS).encode())
@example(GOOD.replace("jawOpen = 0.5", f"a = [{DIGITS}]").encode())
@example(GOOD.replace("10", "9" * 400).encode())
@example(GOOD.replace("0.5", "9" * 5000).encode())
@example(GOOD.replace("0.5", "[" * 9999).encode())
def test_any_file_is_expressions_or_an_error(tmp_path_factory, data):
    path = tmp_path_factory.getbasetemp() / "any-expressions.toml"
    path.write_bytes(data)
    found = value_or_line(lambda: read_targets(path))
    if found is not None:
        weights = np.concatenate([found.key_weights, found.mouths])
        assert len(found.key_names) == len(found.key_weights) and np.isfinite(found.gaze).all()
        assert weights.min() >= 0 and weights.max() <= 1


# --- fits of a clip ---

FINITE = some.floats(-1e6, 1e6)


@some.composite
def clip_fits(draw):
    count = draw(some.integers(1, 4))
    seed = np.random.default_rng(draw(some.integers(0, 2**32)))

    def array(*shape):
        return draw(arrays.arrays(np.float64, shape, elements=FINITE))

    return ClipFit(
        head=draw(TEXT.filter(lambda text: "\0" not in text)), head_sha256="0" * 64,
        identity=array(3), residual=seed.normal(size=(468, 3)), focal=draw(some.floats(1e-3, 1e6)),
        center=array(2), size=np.array(draw(some.tuples(some.integers(1, 65536), some.integers(1, 9)))),
        seconds=np.cumsum(seed.uniform(0.01, 1, count)), found=seed.random(count) < 0.5,
        rotation=array(count, 3), translation=array(count, 3),
        expression=seed.random((count, len(EXPRESSIONS))), gaze=array(count, 2),
    )  # fmt: skip


@given(clip_fits())
def test_fits_come_back(tmp_path_factory, fits):
    folder = tmp_path_factory.getbasetemp() / "fits"
    write_fits(folder, fits)
    back = read_fits(folder)
    for name, value in vars(fits).items():
        np.testing.assert_array_equal(getattr(back, name), value, err_msg=name)


ANY = arrays.arrays(
    some.sampled_from([np.float64, np.float32, np.int64, bool, "U3"]),
    arrays.array_shapes(min_dims=0, max_dims=3, max_side=3),
)


@given(
    clip_fits(),
    some.dictionaries(some.sampled_from(list(ClipFit.__annotations__)), ANY, max_size=2),
)
def test_any_rows_are_fits_or_an_error(tmp_path_factory, fits, changed):
    folder = tmp_path_factory.getbasetemp() / "any-fits"
    table = {name: np.asarray(value) for name, value in vars(fits).items()} | changed
    rows = {name: table.pop(name) for name in ROWS}
    sha256 = record.write_arrays(folder / IDENTITY, table)
    record.write_arrays(folder / FRAMES, {"identity_sha256": np.array(sha256), **rows})
    found = value_or_line(lambda: read_fits(folder), InputError)
    if found is not None:
        assert len(found.seconds) == len(found.gaze) and found.focal > 0


@given(some.data(), some.sampled_from([IDENTITY, FRAMES]))
def test_a_changed_file_of_fits_is_refused_or_read(tmp_path_factory, data, name):
    folder = tmp_path_factory.getbasetemp() / "changed-fits"
    write_fits(folder, data.draw(clip_fits()))
    (folder / name).write_bytes(data.draw(mutated((folder / name).read_bytes())))
    value_or_line(lambda: read_fits(folder), InputError)
