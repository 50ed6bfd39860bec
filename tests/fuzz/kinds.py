"""What is fuzzed: each kind has seeds, a change, and the reader that gets the changed file."""

import gzip
import hashlib
import json
import marshal
import os
import shutil
from dataclasses import dataclass

import containers
import media
import mutate
import numpy as np


@dataclass(frozen=True)
class Kind:
    """One sort of file."""

    name: str
    seeds: dict  # file name -> bytes
    change: object  # (rng, data, others) -> bytes, knows the format
    read: object  # (path) -> None; may raise BakeryError
    structured: float = 0.65  # share of the cases that `change` makes; the rest are plain bytes
    share: float = 1.0  # of the cases that are asked for: a slow reader gets fewer

    def case(self, number):
        """File name and bytes of one case."""
        rng = containers.generator(f"{self.name} {number}")
        name = rng.choice(sorted(self.seeds))
        data, others = self.seeds[name], list(self.seeds.values())
        what = rng.random()
        if what < self.structured:
            data = self.change(rng, data, others)
        if what > self.structured - 0.1:  # some have both
            data = mutate.any_bytes(rng, data, others)
        return name, data


def json_change(rng, data, others):
    """A JSON seed with one value changed."""
    return mutate.json_value(rng, data, _tree(data))


def number_change(rng, data, others):
    """A JSON seed with some numbers changed: it stays readable, what it says may be absurd."""
    return mutate.json_numbers(rng, data, _tree(data))


def points_change(rng, data, others):
    """Landmarks turned, squashed, swapped or shaken: numbers that could be, of no face."""
    table = json.loads(data)
    face = rng.choice(table["faces"])
    points = np.array(face["points"])
    noise = np.random.default_rng(rng.randrange(1 << 30))
    middle, some = points.mean(0), noise.random(len(points)) < rng.choice((0.01, 0.2, 1.0))
    kind = rng.randrange(7)
    if kind == 0:  # on a line, on a point, mirrored, blown up
        points = (points - middle) * [rng.choice((0, 1e-3, 0.2, -1, 2)), rng.choice((0, 1, 1, -1))]
        points += middle
    elif kind == 1:
        angle = rng.uniform(-3.2, 3.2)
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        points = (points - middle) @ turn + middle
    elif kind == 2:
        points[some] = noise.permutation(points[some])
    elif kind == 3:
        points[some] = middle
    elif kind == 4:
        points += noise.normal(0, rng.choice((1, 10, 60)), points.shape) * some[:, None]
    elif kind == 5:
        points += [rng.choice((-150, 0, 80)), rng.choice((-200, 0, 150))]
    else:
        face["confidence"] = (np.array(face["confidence"]) * ~some).tolist()
    face["points"] = points.round(3).tolist()
    return json.dumps(table).encode()


_trees = {}


def _tree(data):
    if data not in _trees:
        _trees[data] = mutate.tree(data)
    return _trees[data]


def take_change(rng, data, others):
    """A take with cells changed; a packed one is packed again."""
    if not data.startswith(b"\x1f\x8b"):
        return mutate.csv_cell(rng, data, others)
    if rng.random() < 0.3:
        return mutate.any_bytes(rng, data, others)
    return gzip.compress(mutate.csv_cell(rng, gzip.decompress(data), others), 1, mtime=0)


def mesh_change(rng, data, others):
    """A mesh with its description, a word or a line changed; a binary PLY in its header."""
    if data.startswith(b"glTF"):
        return containers.glb(rng, data, others)
    if data.startswith(b"{"):
        return json_change(rng, data, others)
    head, mark, rest = data.partition(b"end_header\n")
    if not mark or b"ascii" in head:
        head, mark, rest = data, b"", b""
    return mutate.word(rng, head) + mark + rest


def files(folder):
    """The kinds whose reader gets one file.

    Args:
        folder: of `seeds.write`.
    """
    from bakery.formats import exr, image, livelink, record, video
    from bakery.heads.file import load_head
    from bakery.heads.mesh.read import read_surface

    note = video.Note("a", "b")

    def found(pattern):
        return {path.name: path.read_bytes() for path in sorted(folder.glob(pattern))}

    def both_exr(path):
        exr.read_header(path)
        exr.read_exr(path)

    def sound(path):
        """The sound of a clip into a new video, as `bakery animate --sound` does."""
        kind = path.suffix
        heard = video.read_sound(path, kind)
        part, out = folder / "clips" / f"part{kind}", path.with_name(f"out{kind}")
        video.join(out, [part], kind, 25.0, (48, 32), note, heard, 0.02)

    def pictures(path):
        for _ in video.Clip(path).frames():
            pass

    def photo(path):
        image.read_photo(path, 1 if path.name == "moving.gif" else None)

    def masks(path):
        record.read_arrays(path, ["masks", "head"])

    arrays = found("npz/[td]e*.npz")
    return [
        Kind("textures", arrays, containers.npz, record.read_textures),
        Kind("masks", found("npz/masks.npz"), containers.npz, masks),
        Kind("head", found("npz/tiny.npz"), containers.npz, load_head),
        Kind("fit", found("tables/fit.json"), json_change, record.read_fit),
        Kind("landmarks", found("tables/faces.json"), json_change, record.read_faces),
        Kind("exr", found("exrs/*.exr"), containers.exr, both_exr),
        Kind("take", found("takes/*"), take_change, livelink.read_take),
        Kind("sound", found("clips/clip.*"), media.video, sound),
        Kind("clip", found("clips/[cm]*.*"), media.video, pictures),
        Kind("photo", found("photos/*"), media.picture, photo),
        Kind("mesh", found("meshes/*"), mesh_change, read_surface),
    ]


class Bundle:
    """A bundle in which one file is changed and listed as if it belonged there."""

    def __init__(self, whole, alone):
        """
        Args:
            whole: the good bundle.
            alone: whether the changed file is the only one beside the manifest: quicker, and what is
                said of the missing ones is no traceback.
        """
        self.whole, self.alone = whole, alone
        self.manifest = json.loads((whole / "avatar.json").read_bytes())
        rest = {key: value for key, value in self.manifest.items() if key != "files"}
        self.rest = json.dumps(rest).encode()[:-1] + b", "

    def seeds(self, *endings):
        """Bytes of the files whose paths end so, by the path with "~" for "/"."""
        return {
            entry["path"].replace("/", "~"): (self.whole / entry["path"]).read_bytes()
            for entry in [*self.manifest["files"], {"path": "avatar.json"}]
            if entry["path"].endswith(endings)
        }

    def sealed(self, data):
        """The bytes of a manifest with the digest of itself that they must carry."""
        mark = self.manifest["sha256"].encode()
        if data.count(mark) != 1:
            return data
        blank = data.replace(mark, b"0" * 64)
        return data.replace(mark, hashlib.sha256(blank).hexdigest().encode())

    def with_file(self, path, use):
        """Call `use(bundle)` of a copy beside `path`, with the file at `path` in its place."""
        folder = path.parent / f"{'one' if self.alone else 'all'}.avatar"
        if not folder.exists():
            if self.alone:
                (folder / "web").mkdir(parents=True)
            else:
                shutil.copytree(self.whole, folder)
        name, data = path.name.replace("~", "/"), path.read_bytes()
        (folder / name).write_bytes(data if name != "avatar.json" else self.sealed(data))
        if name != "avatar.json":
            entry = {"path": name, "role": "web", "bytes": len(data) or 1}
            entry["sha256"] = hashlib.sha256(data).hexdigest()
            listed = [e for e in self.manifest["files"] if e["path"] != name]
            files = json.dumps({"files": [*listed, entry]}).encode()
            (folder / "avatar.json").write_bytes(self.sealed(self.rest + files[1:]))
        try:
            return use(folder)
        finally:
            for changed in {name, "avatar.json"}:
                (folder / changed).unlink(missing_ok=True)
                if not self.alone:
                    shutil.copyfile(self.whole / changed, folder / changed)


PICTURES = (".exr", ".png", ".webp")


def change_any(rng, data, others):
    """A file of a bundle changed as its kind allows."""
    if data.startswith(b"v/1\x01"):
        return containers.exr(rng, data, others)
    if data.startswith(b"PK"):
        return containers.npz(rng, data, others)
    if data.startswith(b"glTF"):
        return containers.glb(rng, data, others)
    if data.startswith((b"\x89PNG", b"RIFF")):
        return media.picture(rng, data, others)
    return json_change(rng, data, others)


def in_bundles(folder):
    """The kinds whose reader gets a bundle; see `files`."""
    from bakery.export import bundle
    from bakery.export.open import open_avatar
    from bakery.export.validate import problems

    whole = folder / "whole.avatar"
    alone, among = Bundle(whole, True), Bundle(whole, False)
    quick_schema()
    quick_texts([alone.manifest, json.loads((whole / "web" / "avatar.json").read_bytes())])

    def look(folder):
        found = problems(folder)
        for line in found:
            if not isinstance(line, str) or "\n" in line or len(line) > 1000:
                raise AssertionError(f"a finding that is no short line: {line!r:.300}")
        return found

    def validate(path):
        """Findings about the file itself."""
        name = path.name.replace("~", "/")
        return [line for line in alone.with_file(path, look) if line.startswith(name)]

    def manifest(path):
        def use(folder):
            look(folder)
            table = bundle.read_manifest(folder)
            shutil.copyfile(whole / "face.exr", folder / "face.exr")
            bundle.summary(folder, table)

        alone.with_file(path, use)

    def avatar(path):
        among.with_file(path, open_avatar)

    one = alone.seeds("avatar.json")
    return [
        Kind("manifest", {"avatar.json": one["avatar.json"]}, json_change, manifest),
        Kind("web", alone.seeds("web/avatar.json"), json_change, validate),
        Kind("glb", alone.seeds(".glb"), containers.glb, validate, 0.85),
        Kind("others", alone.seeds(*PICTURES, ".npz"), change_any, validate, share=0.4),
        Kind("avatar", among.seeds(*PICTURES, ".npz", ".json"), change_any, avatar, share=0.1),
    ]


def in_stages(folder):
    """The kinds that go on with what a reader took: absurd poses and points; see `files`."""
    import numpy as np

    from bakery.bake.faces import one_face
    from bakery.bake.fitting import fit_portrait
    from bakery.export.open import open_avatar
    from bakery.formats import image, record
    from bakery.heads.file import load_head
    from bakery.show import frame

    whole, loaded = folder / "whole.avatar", {}
    os.environ["BAKERY_HEADS"] = str(folder / "npz")  # where a fit finds the tiny head by its name

    def once(name, make):
        if name not in loaded:
            loaded[name] = make()
        return loaded[name]

    def scene(path):
        """`bakery render --fit`, 64 pixels a side."""
        avatar = once("avatar", lambda: open_avatar(whole))
        asked = frame.parse(fitted=path, size=64)
        for picture in frame.render(avatar, frame.Scene(**asked)):
            assert np.isfinite(picture).all(), "a picture that is not finite"

    def placing(path):
        """`bakery fit --landmarks`."""
        head = once("head", lambda: load_head("makehuman"))
        photo = once("photo", lambda: image.read_photo(folder / "tables" / "placed.png"))
        _, face = one_face(path, landmarks=path, photo=photo)
        fit, _ = fit_portrait(path, photo, face, head)
        record.fit_from_table(path, json.loads(record.dump(record.fit_to_table(fit))))

    fits = {"fit.json": (folder / "tables" / "fit.json").read_bytes()}
    points = {"placed.json": (folder / "tables" / "placed.json").read_bytes()}
    return [
        Kind("scene", fits, number_change, scene, 1.1, share=0.1),
        Kind("placing", points, points_change, placing, 0.8, share=0.01),
    ]


def quick_schema():
    """jsonschema remembers what it found good: most of a changed table is as it was."""
    import jsonschema

    kind, good = jsonschema.Draft202012Validator, set()

    def remembered(keyword):
        slow = kind.VALIDATORS[keyword]

        def check(validator, wanted, instance, schema):
            try:
                key = keyword, id(wanted), marshal.dumps(instance)
            except ValueError:
                key = None
            if key not in good:
                errors = list(slow(validator, wanted, instance, schema))
                if not errors and key and len(good) < 10_000:
                    good.add(key)
                yield from errors

        return check

    changed = {keyword: remembered(keyword) for keyword in ("items", "properties", "$ref")}
    jsonschema.Draft202012Validator = jsonschema.validators.extend(kind, changed)


def quick_texts(tables):
    """Entries that are as in `tables` are not looked at again: a case changes one or two."""
    from bakery.export import hostile

    slow = hostile.table_problems
    known = [table for table in tables if not any(slow(table))]

    def problems(table, where="", depth=0):
        if not where and isinstance(table, dict):
            table = {
                key: value
                for key, value in table.items()
                if not any(key in seen and seen[key] == value for seen in known)
            }
        return slow(table, where, depth)

    hostile.table_problems = problems
