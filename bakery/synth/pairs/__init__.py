"""Training pairs of the generator, and the shards that hold them.

A shard is one safetensors file: pictures as PNG bytes behind each other with their offsets, the
numbers as arrays. The neutral photo is kept once for all targets of a subject. Nothing is lost: JPEG
of quality 96 took a third of the space and 0.002 of the similarity of pictures that are alike.
"""

import json
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from bakery.errors import InputError
from bakery.formats.files import write_bytes
from bakery.formats.image import compressed

NAME = "pairs-{:05d}.safetensors"
VERSION = "3"


@dataclass(frozen=True)
class PaintedPair:
    """One subject in neutral and in one target, with the conditions of the target.

    The channels are those of `bakery.generators.channels`; see there for units.
    """

    photo: np.ndarray  # [S, S, 3] uint8 sRGB: the subject in neutral; 0 outside the head
    photo_face: np.ndarray  # [S, S] uint8: the face in the photo, feathered
    target: np.ndarray  # [S, S, 3] uint8 sRGB: the truth; 0 outside the head
    deformed: (
        np.ndarray
    )  # [S, S, 3] uint8 sRGB: T_0, unwrapped from the photo, on the target's mesh
    normals: np.ndarray  # [S, S, 3] int8
    depth: np.ndarray  # [S, S] uint8
    gaze: np.ndarray  # [S, S, 2] uint8
    part: np.ndarray  # [S, S] uint8 into heads.base.PARTS, 255 for none, as the conditions have it
    face: np.ndarray  # [S, S] uint8: where the loss counts
    strain: np.ndarray  # [S, S, 2] uint8, of generators.strain
    folds: np.ndarray  # [S, S, 2] uint8, of generators.expected_folds
    landmarks: np.ndarray  # [L, 2] float32 pixels of the target, true
    expression: np.ndarray  # [E] float32, true weights
    gaze_angles: np.ndarray  # [2] float32 degrees
    yaw: float  # degrees from the frontal view, + to the subject's left
    pitch: float  # degrees, + up
    subject: int  # number of the subject, the same in all of its pairs
    head: str  # name of the head model


PLANES = (
    "photo", "target", "deformed", "photo_face", "normals", "depth", "gaze", "part", "face", "strain",
    "folds",
)  # fmt: skip
PAIRED = ("gaze", "strain", "folds")  # of two channels
ONCE = ("photo", "photo_face")  # the same for all targets of a subject
NUMBERS = ("landmarks", "expression", "gaze_angles", "yaw", "pitch", "subject")


def _pack(name, picture):
    """A picture as the bytes of its image file."""
    if name == "normals":
        picture = picture.view(np.uint8)
    if name in PAIRED:  # PNG has no two channels
        picture = np.concatenate([picture, np.zeros_like(picture[..., :1])], -1)
    return compressed(".png", picture, [cv2.IMWRITE_PNG_COMPRESSION, 3])


def _unpack(name, data):
    picture = cv2.imdecode(data, cv2.IMREAD_UNCHANGED)
    if name == "normals":
        return picture.view(np.int8)
    return np.ascontiguousarray(picture[..., :2]) if name in PAIRED else picture


def write_shard(path, pairs, about=None):
    """Write PaintedPairs, those of one subject behind each other, to one file.

    Args:
        path: Path.
        pairs: iterable of PaintedPair.
        about: {name: value} to keep in the file's metadata.

    Raises:
        DiskError: the file cannot be written.
    """
    from safetensors.numpy import save

    stored = {name: [] for name in PLANES}
    numbers = {name: [] for name in NUMBERS}
    which, heads, last = [], [], None
    for pair in pairs:
        new = last is None or pair.subject != last
        last = pair.subject
        for name in stored:
            if new or name not in ONCE:
                stored[name].append(_pack(name, getattr(pair, name)))
        which.append(len(stored["photo"]) - 1)
        heads.append(pair.head)
        for name in NUMBERS:
            numbers[name].append(getattr(pair, name))
    arrays = {
        name: np.array(values, np.int64 if name == "subject" else np.float32)
        for name, values in numbers.items()
    }
    arrays["which"] = np.array(which, np.int32)
    for name, files in stored.items():
        arrays[name] = np.concatenate(files)
        arrays[name + "_ends"] = np.cumsum([len(file) for file in files]).astype(np.int64)
    # One entry: the library writes several in an order that changes from run to run.
    metadata = {"version": VERSION, "heads": heads} | (about or {})
    write_bytes(path, save(arrays, {"pairs": json.dumps(metadata, sort_keys=True)}))


class Shard:
    """One file of pairs, read as it is asked for: `shard[k]` is a PaintedPair.

    Raises:
        InputError: no shard, or one of another version.
    """

    def __init__(self, path):
        from safetensors import SafetensorError, safe_open

        self.path = Path(path)
        try:
            with safe_open(self.path, "numpy") as file:
                self.about = json.loads((file.metadata() or {}).get("pairs", "{}"))
                self._arrays = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118
        except (SafetensorError, OSError) as error:
            raise InputError(
                f"{path}: no shard of pairs ({error}); paint it with `bakery synth pairs`"
            ) from None
        if self.about.get("version") != VERSION:
            raise InputError(
                f"{path}: version {self.about.get('version')} of the shards, {VERSION} is read; "
                "paint it again with `bakery synth pairs`"
            )
        self._heads = self.about["heads"]

    def __len__(self):
        return len(self._heads)

    def picture(self, name, k):
        """One picture of pair k, decoded."""
        row = int(self._arrays["which"][k]) if name in ONCE else k
        ends = self._arrays[name + "_ends"]
        begin = int(ends[row - 1]) if row else 0
        return _unpack(name, self._arrays[name][begin : int(ends[row])])

    def number(self, name):
        """One of NUMBERS of all pairs, [n, ...]."""
        return self._arrays[name]

    def __getitem__(self, k):
        if not 0 <= k < len(self):
            raise IndexError(k)
        pictures = {name: self.picture(name, k) for name in PLANES}
        numbers = {name: self._arrays[name][k] for name in NUMBERS}
        numbers |= {name: float(numbers[name]) for name in ("yaw", "pitch")}
        return PaintedPair(
            **pictures, **numbers | {"subject": int(numbers["subject"])}, head=self._heads[k]
        )


def shards_of(folder):
    """The shards of a folder, in order: [Path].

    Raises:
        InputError: there is none.
    """
    found = sorted(Path(folder).glob("pairs-*.safetensors"))
    if not found:
        raise InputError(f"{folder}: holds no shards; paint some with `bakery synth pairs`")
    return found


def iterate(folder):
    """Yield every PaintedPair of a folder of shards."""
    for path in shards_of(folder):
        shard = Shard(path)
        for k in range(len(shard)):
            yield shard[k]
