"""From a clip to a take to a video, by the commands; what they refuse, in one line."""

import json
import struct
from pathlib import Path

import cv2
import numpy as np
import pytest

from bakery.formats import mp4, video
from bakery.formats.livelink import Take, read_take
from bakery.formats.video import Clip
from bakery.types import EXPRESSIONS

SAMPLES = Path(__file__).resolve().parents[2] / "samples"


@pytest.fixture(scope="module")
def clip(tmp_path_factory):
    """A painted portrait that drifts to the right, 10 frames of 300x376."""
    picture = cv2.imread(str(SAMPLES / "anna.jpg"))
    small = cv2.resize(picture, (300, 376), interpolation=cv2.INTER_AREA)[..., ::-1]
    path = tmp_path_factory.mktemp("clip") / "anna.mp4"
    part = path.with_name("part.mp4")
    frames = (np.roll(small, shift, 1) for shift in range(10))
    part.write_bytes(video.encode(map(np.ascontiguousarray, frames), ".mp4", 25.0))
    video.join(path, [part], ".mp4", 25.0, (300, 376), video.Note("a", "b"))
    return path


@pytest.fixture(scope="module")
def take(bakery, clip):
    path = clip.with_name("take.csv")
    done = bakery("track", clip, "-o", path)
    assert done.returncode == 0, done.stderr
    assert f"wrote {path}: 10 frames, 25 a second" in done.stderr
    return path


def test_a_clip_becomes_a_take(take):
    """Ten frames of a resting face that does not move but in the picture."""
    read = read_take(take)
    assert len(read.seconds) == 10 and read.rate == 25 and read.notes == ()
    assert read.weights.std(0).mean() < 0.005 and read.weights.mean() < 0.05
    assert np.abs(read.head).max() < 20 and np.ptp(read.head, axis=0).max() < 2


def test_a_take_becomes_a_video(bundle, bakery, take, tmp_path):
    out = tmp_path / "out.webm"
    done = bakery("animate", bundle, "--curves", take, "-o", out, "--size", "64", "--view", "20,5")
    assert done.returncode == 0, done.stderr
    assert f"wrote {out}: 10 frames, 0.4 s" in done.stderr and done.stdout == ""
    frames = [picture for _, picture in Clip(out).frames()]
    assert len(frames) == 10 and frames[0].shape == (64, 64, 3)
    data = out.read_bytes()
    assert b"Synthetic media" in data and b"digitalsourcetype/compositeWithTrained" in data
    assert [path.name for path in tmp_path.iterdir()] == ["out.webm"]
    assert bakery("animate", bundle, "--curves", take, "-o", out).returncode == 1  # is there
    done = bakery(
        "animate", bundle, "--curves", take, "-o", tmp_path / "photo.mp4", "--view", "photo",
        "--size", "120", "--frames", "2:6", "--textures", "static", "--no-hair",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    frames = [picture for _, picture in Clip(tmp_path / "photo.mp4").frames()]
    assert len(frames) == 4 and frames[0].shape == (120, 100, 3)


def test_a_take_becomes_pictures(bundle, bakery, take, tmp_path):
    """Odd sizes, numbers of the whole take at the new rate, nothing replaced without being asked."""
    out = tmp_path / "shot"
    command = ["animate", bundle, "--curves", take, "-o", f"{out}/f.%03d.png", "--size", "101"]
    done = bakery(*command, "--fps", "50", "--frames", "2:5")
    assert done.returncode == 0, done.stderr
    assert f"{out}/f.###.png: 6 frames, 0.1 s" in done.stderr
    assert sorted(path.name for path in out.iterdir()) == [f"f.{n:03d}.png" for n in range(4, 10)]
    assert cv2.imread(str(out / "f.004.png"), -1).shape == (101, 101, 4)
    before = (out / "f.004.png").read_bytes()
    for more, message in (
        ((), "f.004.png: is already there; --overwrite"),
        (("--overwrite", "--sound", take), "--sound: pictures carry none"),
    ):
        done = bakery(*command, *more)
        assert done.returncode == 1 and message in done.stderr, done.stderr
        assert len(done.stderr.splitlines()) == 1 and (out / "f.004.png").read_bytes() == before
    film = ["animate", bundle, "--curves", take, "-o", tmp_path / "a.mp4", "--size", "101"]
    done = bakery(*film)
    assert done.returncode in (1, 2) and "--size 101: videos have an even number" in done.stderr
    done = bakery(*command, "--overwrite", "--view", "photo", "--frames", "4:6")
    assert done.returncode == 0, done.stderr
    assert sorted(path.name for path in out.iterdir()) == ["f.004.png", "f.005.png"]
    assert cv2.imread(str(out / "f.004.png"), -1).shape == (101, 84, 3)
    assert [path.name for path in tmp_path.iterdir()] == ["shot"]


def test_the_base_of_the_time_code(bakery, take, tmp_path):
    """Ten rows that count 25 frames a second are too few to tell; the option does."""
    lines = take.read_text().splitlines()
    counted = [f"10:00:00:{k:02d},{line.split(',', 1)[1]}" for k, line in enumerate(lines[1:])]
    (tmp_path / "film.csv").write_text("\n".join([lines[0], *counted]))
    for more, rate, said in (((), 60, "too short to tell"), (("--timecode-base", "25"), 25, "")):
        out = tmp_path / f"{rate}.csv"
        done = bakery("retarget", tmp_path / "film.csv", "-o", out, *more)
        assert done.returncode == 0 and said in done.stderr
        assert ("too short" in done.stderr) == bool(said)
        assert read_take(out).rate == rate
    for command in ("animate", "generate", "retarget"):
        assert "--timecode-base N" in bakery(command, "--help").stdout


def test_a_truncated_clip_is_refused(bakery, clip, tmp_path):
    cut = tmp_path / "cut.mp4"
    place, offset, size = mp4.read_tracks(clip)[0].places[3]
    cut.write_bytes(clip.read_bytes()[: offset + size])
    done = bakery("track", cut, "-o", tmp_path / "x.csv")
    assert done.returncode == 1 and len(done.stderr.splitlines()) == 1
    assert "cut.mp4: a truncated MP4: 4 of the 10 frames" in done.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["cut.mp4"]


def test_a_clip_with_a_gap_is_told(monkeypatch):
    """Damage that leaves the index whole, and WebMs, whose index counts nothing."""
    from types import SimpleNamespace

    from bakery.motion import files

    monkeypatch.setattr(files, "Clip", lambda path: SimpleNamespace(count=100, frames=lambda: ()))
    monkeypatch.setattr(files, "plug_in", lambda *_: None)
    for count, told in ((89, True), (95, False)):
        seen = SimpleNamespace(seconds=np.arange(count), doubt=0.0)
        monkeypatch.setattr(files, "follow", lambda *_, seen=seen, **__: seen)
        made = Take(np.arange(count) / 25, np.zeros((count, 52)), np.zeros((count, 3)), None)
        monkeypatch.setattr(files, "solve", lambda *_, **__: None)
        monkeypatch.setattr(files, "take_of", lambda *_, made=made: made)
        notes = files.tracked("clip.webm").notes
        assert bool(notes) == told
        assert not told or "89 of about 100 frames can be read" in notes[0]


def test_retarget(bakery, take, tmp_path):
    out = tmp_path / "mine.csv"
    done = bakery("retarget", take, "-o", out, "--neutral", "0", "--gain", "0.5,head=2")
    assert done.returncode == 0, done.stderr
    before, after = read_take(take), read_take(out)
    np.testing.assert_allclose(after.weights[0], 0, atol=1e-6)
    np.testing.assert_allclose(after.head, 2 * (before.head - before.head[0]), atol=1e-6)


def test_notes_of_a_take_are_told(bakery, take, tmp_path):
    lines = take.read_text().splitlines()
    lines[3] = lines[3].split(",")[0] + ",0"
    (tmp_path / "hole.csv").write_text("\n".join(lines))
    done = bakery("retarget", tmp_path / "hole.csv", "-o", tmp_path / "b.csv")
    assert done.returncode == 0 and "1 dropped frames interpolated" in done.stderr


def test_what_is_refused(bundle, bakery, clip, take, tmp_path, monkeypatch):
    monkeypatch.setattr("bakery.formats.pyav.available", lambda: False)  # it says other things
    """One line, exit code 1, nothing written."""
    blank = tmp_path / "blank.mp4"
    part = tmp_path / "part.mp4"
    part.write_bytes(video.encode([np.full((96, 96, 3), 90, np.uint8)] * 3, ".mp4", 25.0))
    video.join(blank, [part], ".mp4", 25.0, (96, 96), video.Note("a", "b"))
    (tmp_path / "bad.csv").write_text(take.read_text().replace(",61,0", ",61,NaN", 1))
    (tmp_path / "text.mp4").write_text("no video")
    before = sorted(path.name for path in tmp_path.iterdir())
    animate = ["animate", bundle, "-o", tmp_path / "x.mp4", "--curves"]
    for command, message in (
        (["track", blank, "-o", tmp_path / "x.csv"], "no face found in any frame"),
        (["track", tmp_path / "text.mp4", "-o", tmp_path / "x.csv"], "no video that can be read"),
        (["track", clip, "-o", tmp_path / "x.csv", "--gain", "smile=1"], "no 'smile'"),
        ([*animate, tmp_path / "bad.csv"], "row 2, column EyeBlinkLeft: 'NaN"),
        ([*animate, take, "--frames", "50:60"], "has 10 frames"),
        ([*animate, take, "--view", "top"], "--view"),
        ([*animate, take, "--neutral", "99"], "has 10 rows"),
        ([*animate, take, "--sound", tmp_path / "bad.csv"], "taken from MP4, MOV and WebM"),
        (["animate", bundle, "-o", tmp_path / "x.avi", "--curves", take], ".webm"),
        (["animate", bundle, "-o", tmp_path / "x.png", "--curves", take], "give a folder"),
        (["animate", tmp_path, "-o", tmp_path / "x.mp4", "--curves", take], "no bundle"),
    ):
        done = bakery(*command)
        code = 2 if "--view" in command else 1
        assert done.returncode == code and message in done.stderr, (command, done.stderr)
        assert len(done.stderr.splitlines()) == 1, done.stderr
    assert sorted(path.name for path in tmp_path.iterdir()) == before


def test_playing_is_measured(bundle, bakery, take):
    done = bakery("evaluate", "animate", bundle, "--curves", take, "--size", "64")
    assert done.returncode == 0, done.stderr
    table = json.loads(done.stdout)
    assert table["frames"] == 10 and table["size"] == [64, 64] and table["frames_per_second"] > 0


def read_glb(path):
    """A second reader of head.glb, written from the specification: name -> (vertices, targets)."""
    data = path.read_bytes()
    length = struct.unpack("<I", data[12:16])[0]
    document = json.loads(data[20 : 20 + length])
    start = 20 + length + 8
    kinds = {5126: "<f4", 5125: "<u4", 5123: "<u2", 5121: "u1"}
    width = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}

    def values(count, kind, component, view, offset=0):
        view = document["bufferViews"][view]
        at = start + view.get("byteOffset", 0) + offset
        flat = np.frombuffer(data, kinds[component], count * width[kind], at)
        return flat.reshape(count, width[kind])

    def accessor(number):
        entry = document["accessors"][number]
        count, kind = entry["count"], entry["type"]
        out = np.zeros((count, width[kind]), kinds[entry["componentType"]])
        if "bufferView" in entry:
            offset = entry.get("byteOffset", 0)
            out[:] = values(count, kind, entry["componentType"], entry["bufferView"], offset)
        if sparse := entry.get("sparse"):
            n, where = sparse["count"], sparse["indices"]
            offset = where.get("byteOffset", 0)
            rows = values(n, "SCALAR", where["componentType"], where["bufferView"], offset)[:, 0]
            what = sparse["values"]
            offset = what.get("byteOffset", 0)
            out[rows] = values(n, kind, entry["componentType"], what["bufferView"], offset)
        return out

    found = {}
    for mesh in document["meshes"]:
        first = mesh["primitives"][0]
        targets = [accessor(target["POSITION"]) for target in first["targets"]]
        shapes = dict(zip(mesh["extras"]["targetNames"], targets))
        found[mesh["name"]] = accessor(first["attributes"]["POSITION"]), shapes
    return found


def test_a_second_reader_finds_all_morph_targets(bundle, avatar):
    """Names, order and millimetres agree with the head model that the bundle carries."""
    from scipy.spatial import cKDTree

    positions, shapes = read_glb(bundle / "head.glb")["head_LOD0"]
    assert list(shapes) == list(EXPRESSIONS)
    near, rows = cKDTree(avatar.neutral).query(positions * 1000)
    assert np.median(near) < 0.01  # millimetres: glTF has metres
    for name in ("jawOpen", "eyeBlinkLeft", "mouthSmileRight"):
        basis = avatar.head.expression_basis[list(shapes).index(name)][rows]
        apart = np.linalg.norm(shapes[name] * 1000 - basis, axis=1)
        assert np.quantile(apart, 0.9) < 0.05 and np.linalg.norm(basis, axis=1).max() > 1


def test_trimesh_reads_the_geometry(bundle):
    import trimesh

    scene = trimesh.load(bundle / "head.glb")
    manifest = json.loads((bundle / "avatar.json").read_text())
    for lod in manifest["lods"]:
        faces = sum(len(g.faces) for name, g in scene.geometry.items() if lod["node"] in name)
        assert faces == lod["triangles"]
