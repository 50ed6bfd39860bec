"""A bank of painted pictures for the detector's networks, made once and cut anew at every step.

A bank is a folder of shards, KIND-NUMBER.npz, uncompressed. Shard k of a kind depends on the seed
and on k alone, so a run that was stopped goes on and two machines make the same bank. What costs a
processor's time happens here: people painted, photographs turned and morphed. What depends on
chance alone (crops, light, lens, noise) happens at each step on the training's device.
"""

import json
import os
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path

import cv2
import numpy as np

from bakery.detectors import frames
from bakery.errors import InputError
from bakery.settings import SEEDS, Settings, setting
from bakery.train import dataset, runs
from bakery.train.backgrounds import Backgrounds
from bakery.train.faces import Faces
from bakery.train.photos import Photo, read_photos

BASE = 320  # pixels on a side of a picture that crops are cut from
MARGIN = 1.75  # its side over the size of the upright face in its middle
SHARD = {"photo": 200, "quick": 96, "careful": 24, "scene": 400}  # pictures in a shard
KINDS = tuple(SHARD)
STORED_QUALITY = 90  # of the photographs in a bank
FRAMES = 16  # pictures of one person by the quick painter
ABSENT = 0.1  # share of the photo pictures without a face


@dataclass(frozen=True)
class BankOptions(Settings):
    """How many pictures a bank holds, and from which seed."""

    photo: int = setting(40000, "photographs seen anew", 0, 10**7)
    quick: int = setting(12000, "pictures by the quick painter", 0, 10**7)
    careful: int = setting(3000, "pictures by the careful painter", 0, 10**7)
    scene: int = setting(40000, "small pictures with any number of faces, for the finder", 0, 10**7)
    background_count: int = setting(400, "procedural pictures", 0, 10**6)
    held: int = setting(
        24, "every so many photographed people, one is left for measuring", 2, 10**6
    )
    seed: int = setting(0, "of all chance", 0, SEEDS)


@dataclass(frozen=True)
class Sources:
    """What a bank is painted from."""

    photos: tuple[tuple[Path, Path], ...]  # folder of photographs, npz with their 478 points
    backgrounds: tuple[Path, ...] = ()
    skins: Path | None = None  # folder of `bakery synth skins`; None: painted skin alone


def paint_bank(
    folder: Path, sources: Sources, options: BankOptions, processes: int
) -> Iterator[Path]:
    """Paint the shards that the folder lacks.

    The four kinds take turns, so that a training which reads the bank while it grows sees all.

    Args:
        folder: made if missing.
        processes: that paint side by side.

    Yields:
        Path of each shard once it is written.

    Raises:
        InputError: photographs or skins are missing.
    """
    folder.mkdir(parents=True, exist_ok=True)
    runs.keep_options(folder, options, free=KINDS)
    gather(folder, sources)
    todo = sorted(
        (number / max(count, 1), kind, number)
        for kind in KINDS
        for count in [-(-getattr(options, kind) // SHARD[kind])]
        for number in range(count)
        if not shard_path(folder, kind, number).exists()
    )
    if not todo:
        return
    context = get_context("spawn")  # forks hang in OpenCV
    with ProcessPoolExecutor(processes, context, _prepare, (folder, sources, options)) as pool:
        waiting = [pool.submit(_paint_shard, folder, kind, number) for _, kind, number in todo]
        for done in as_completed(waiting):
            yield done.result()


def planned(folder: Path, name: str) -> int:
    """What the options of a bank say: how many pictures of a kind it will hold, for one.

    Raises:
        InputError: the folder is no bank.
    """
    path = folder / "options.json"
    if not path.exists():
        raise InputError(f"{folder}: is no bank; paint one with `bakery train bank`")
    return json.loads(path.read_text())[name]


def shard_path(folder: Path, kind: str, number: int) -> Path:
    """Where shard `number` of a kind lies."""
    return folder / f"{kind}-{number:05d}.npz"


_painters: list = []  # of a worker process: one


def _prepare(folder, sources, options):
    runs.quiet_worker(0)
    _painters.append(Painter(folder, sources, options))


def _paint_shard(folder, kind, number):
    path = shard_path(folder, kind, number)
    arrays = _painters[0].shard(kind, number)
    aside = path.with_suffix(f".{os.getpid()}.tmp")
    with aside.open("wb") as file:
        np.savez(file, **arrays)
    os.replace(aside, path)
    return path


class Painter:
    """Paints any shard of a bank; what it needs is read when it is first needed."""

    def __init__(self, folder: Path, sources: Sources, options: BankOptions):
        self.folder, self.sources, self.options = folder, sources, options
        self._faces = self._stage = self._head = self._skins = None

    @property
    def faces(self):
        """The photographed people that are learned from, as reliefs."""
        if self._faces is None:
            learned, _ = split_photos(self.folder, self.options.held)
            backgrounds = Backgrounds(self.sources.backgrounds, self.options.background_count)
            self._faces = Faces(learned, backgrounds)
        return self._faces

    @property
    def head(self):
        from bakery.heads.file import load_head

        self._head = self._head or load_head()
        return self._head

    @property
    def stage(self):
        from bakery.synth import skins
        from bakery.synth.quick import make_stage

        if self._stage is None:
            self._stage = make_stage(self.head, skins.TEXELS)
            paths = self.sources.skins
            self._skins = [] if paths is None else skins.by_tone(skins.skins_of(paths, self.head))
        return self._stage

    def shard(self, kind: str, number: int) -> dict[str, np.ndarray]:
        """The arrays of a shard.

        Returns:
            of "scene": pictures [n, 192, 192, 3] uint8 RGB, targets [n, 8, 24, 24] float16
            (`dataset.finder_target`); of the others: pictures [n, 320, 320, 3] uint8 RGB, points
            [n, 478, 2] float32 sides of the picture from its middle, present [n] bool.
        """
        seed = (self.options.seed, KINDS.index(kind), number)
        rng = np.random.default_rng(seed)
        if kind == "scene":
            samples = dataset.FinderSamples(self.faces, rng.integers(SEEDS), SHARD[kind])
            pictures, targets = zip(*(samples[i] for i in range(SHARD[kind])))
            return {
                "pictures": np.stack(pictures).transpose(0, 2, 3, 1),
                "targets": np.stack(targets).astype(np.float16),
            }
        drawn = getattr(self, f"_{kind}")(rng, SHARD[kind])
        pictures, points, present = zip(*drawn)
        return {
            "pictures": np.stack(pictures),
            "points": np.stack(points).astype(np.float32),
            "present": np.array(present),
        }

    def _photo(self, rng, count):
        samples = dataset.BaseSamples(self.faces, BASE, MARGIN)
        for _ in range(count):
            if rng.random() < ABSENT:
                picture = samples.without_face(rng)
                yield picture[..., ::-1], np.zeros((frames.POINTS, 2)), False
            else:
                picture, points = samples.face(rng)
                yield picture[..., ::-1], points / BASE - 0.5, True

    def _quick(self, rng, count):
        from bakery.train.detector import people

        while count > 0:
            some = min(FRAMES, count)
            count -= some
            for picture, points in people.quick_frames(rng, self.stage, self._skins, some):
                yield _based(picture, points)

    def _careful(self, rng, count):
        from bakery.train.detector import people

        for _ in range(count):
            for picture, points in people.careful_frames(rng, self.head, 1):
                yield _based(picture, points)


def gather(folder: Path, sources: Sources) -> None:
    """Put the photographs into the bank, small and parted from what is behind them.

    They lie there as photos/NAME.webp, alpha where the person is, with photos.npz as
    `photos.read_photos` takes it: what each process would need a minute for is done once.

    Raises:
        InputError: photographs are missing.
    """
    table = folder / "photos.npz"
    if table.exists() or not sources.photos:
        return
    (folder / "photos").mkdir(exist_ok=True)
    names, points = [], []
    for pictures, dense in sources.photos:
        for photo in read_photos(pictures, dense):
            name = f"photos/{photo.name}.webp"
            picture = np.concatenate([photo.image, photo.mask[..., None]], 2)
            cv2.imwrite(str(folder / name), picture, [cv2.IMWRITE_WEBP_QUALITY, STORED_QUALITY])
            names.append(name)
            points.append(photo.points)
    aside = folder / "photos.tmp"
    with aside.open("wb") as file:
        np.savez_compressed(file, names=np.array(names), points=np.float32(points))
    os.replace(aside, table)


def split_photos(folder: Path, held: int) -> tuple[list[Photo], list[Photo]]:
    """Photographs of a bank to learn from and to measure on.

    A person (the name before the first "_") is in one of them only.
    """
    if not (folder / "photos.npz").exists():
        return [], []
    photos = read_photos(folder / "photos", folder / "photos.npz")
    people = {name: i for i, name in enumerate(sorted({p.name.split("_")[0] for p in photos}))}
    learned, kept = [], []
    for photo in photos:
        (kept if people[photo.name.split("_")[0]] % held == held - 1 else learned).append(photo)
    return learned, kept


def _based(picture, points):
    """A painted picture as a bank keeps it."""
    frame = frames.frame_of_points(points)
    matrix = frames.crop_matrix(frame, BASE, MARGIN)
    base = frames.take_crop(np.ascontiguousarray(picture), matrix, BASE)
    return base, frames.apply_affine(matrix, points) / BASE - 0.5, True


def held_bases(photos) -> tuple[np.ndarray, np.ndarray]:
    """Photographs as they are: pictures [n, 320, 320, 3] uint8 RGB, points [n, 478, 2] sides."""
    based = [
        _based(cv2.cvtColor(photo.image, cv2.COLOR_BGR2RGB), photo.points[:, :2])
        for photo in photos
    ]
    pictures, points, _ = zip(*based)
    return np.stack(pictures), np.stack(points).astype(np.float32)
