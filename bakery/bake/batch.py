"""Many portraits: which bundle each becomes, which are fresh, and several bakes at once."""

import json
import time
from collections import deque
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import asdict, dataclass, field, replace
from multiprocessing import get_context
from pathlib import Path

from bakery.bake.pipeline import Progress, Request, build, recipe
from bakery.errors import BakeryError, InputError
from bakery.export.bundle import read_manifest
from bakery.formats.place import SIGNATURE

ENDINGS = (
    ".jpg", ".jpeg", ".png", ".tif", ".tiff", ".webp", ".heic", ".heif", ".avif", ".bmp", ".jp2",
)  # fmt: skip
BUNDLE = ".avatar"


@dataclass(frozen=True)
class Outcome:
    """What became of one portrait."""

    photo: str
    bundle: str
    state: str  # "baked", "fresh" or "failed"
    seconds: float = 0.0
    warnings: list[str] = field(default_factory=list)  # codes of assess.Finding
    error: str = ""

    def line(self) -> str:
        """One line for a person."""
        if self.state == "failed":
            return f"{self.photo}: failed: {self.error}"
        notes = f"; warnings: {', '.join(self.warnings)}" if self.warnings else ""
        if self.state == "fresh":
            return f"{self.bundle}: is fresh{notes}"
        return f"{self.bundle}: baked in {self.seconds:.0f} s{notes}"


def portraits(paths: Sequence[Path]) -> list[Path]:
    """The photos that are meant: files as given, folders as the pictures in them, sorted by name.

    Raises:
        InputError: a folder without a picture.
    """
    found = []
    for path in paths:
        if not path.is_dir():
            found.append(path)
            continue
        inside = sorted(
            p for p in path.iterdir()
            if p.suffix.lower() in ENDINGS and p.is_file() and not p.name.startswith(".")
        )  # fmt: skip
        if not inside:
            raise InputError(
                f"{path}: a folder without a picture ({' '.join(ENDINGS)}); give the folder of the "
                "portraits"
            )
        found += inside
    return found


def places(photos: Sequence[Path], folder: Path | None) -> list[tuple[Path, Path]]:
    """The bundle of each photo: NAME.avatar in the folder, or beside the photo without one.

    Photos of one name keep their ending in it, as anna.png.avatar.

    Raises:
        InputError: two photos would become one bundle.
    """
    parents = [folder or photo.parent for photo in photos]
    stems = [(parent, photo.stem) for parent, photo in zip(parents, photos)]
    out: list[tuple[Path, Path]] = []
    taken: dict[Path, Path] = {}
    for photo, parent, stem in zip(photos, parents, stems):
        name = photo.stem if stems.count(stem) == 1 else photo.name
        bundle = parent / f"{name}{BUNDLE}"
        if bundle in taken:
            raise InputError(f"{photo} and {taken[bundle]}: both become {bundle}; use two folders")
        taken[bundle] = photo
        out.append((photo, bundle))
    return out


def is_fresh(request: Request) -> bool:
    """Whether the bundle is there, whole by size, and what this bake would make."""
    try:
        manifest = read_manifest(request.output)
        whole = all(
            (request.output / entry["path"]).stat().st_size == entry["bytes"]
            for entry in manifest["files"]
        )
        signed = request.credentials is None or (request.output / SIGNATURE).is_file()
        return whole and signed and manifest["provenance"].get("recipe") == recipe(request)
    except (BakeryError, OSError):
        return False


def fresh(request: Request) -> Outcome:
    """What there is to say of a bundle that stays as it is.

    Raises:
        BundleError: the bundle is not there or broken.
    """
    codes = [warning["code"] for warning in read_manifest(request.output)["warnings"]]
    return Outcome(str(request.photo), str(request.output), "fresh", warnings=codes)


def baked(request: Request, progress: Progress | None = None) -> Outcome:
    """Bake one portrait.

    Raises:
        BakeryError: see `pipeline.build`.
    """
    begin = time.perf_counter()
    findings = build(request, progress)
    return Outcome(
        str(request.photo),
        str(request.output),
        "baked",
        round(time.perf_counter() - begin, 1),
        [finding.code for finding in findings],
    )


def bake(request: Request, progress: Progress | None = None) -> Outcome:
    """Bake one portrait of several, unless it is fresh; what the user can mend is told, not raised."""
    photo, bundle = str(request.photo), str(request.output)
    try:
        if is_fresh(request):
            return fresh(request)
        return baked(request, progress)
    except BakeryError as error:
        return Outcome(photo, bundle, "failed", error=str(error).removeprefix(f"{photo}: "))


def bake_all(
    requests: Sequence[Request],
    jobs: int = 1,
    progress: Callable[[Request], Progress] | None = None,
) -> Iterator[Outcome]:
    """Bake many portraits, as they are done; one that fails does not stop the others.

    Args:
        jobs: processes; each needs the memory of a bake.
        progress: the progress of one bake, if there is one process.
    """
    if jobs == 1 or len(requests) == 1:
        yield from (bake(one, progress and progress(one)) for one in requests)
        return
    queue, suspects = deque(requests), []
    while queue:
        suspects += yield from _side_by_side(queue, jobs)
    for one in suspects:  # each alone: whose process dies now is named, and no other suffers
        if (yield from _side_by_side(deque([one]), 1)):
            yield Outcome(
                str(one.photo), str(one.output), "failed",
                error="its process was killed, perhaps for lack of memory; use fewer --jobs",
            )  # fmt: skip


def _side_by_side(queue: "deque[Request]", jobs: int) -> Generator[Outcome, None, list[Request]]:
    """Bake what is queued until a process dies; returns what was in work then."""
    waiting: dict[Future[Outcome], Request] = {}
    # spawn: threads of torch and numba do not survive a fork.
    with ProcessPoolExecutor(jobs, get_context("spawn")) as pool:
        while queue or waiting:
            while queue and len(waiting) < jobs:
                one = queue.popleft()
                waiting[pool.submit(bake, one)] = one
            done, _ = wait(waiting, return_when=FIRST_COMPLETED)
            for future in done:
                try:
                    outcome = future.result()
                except BrokenProcessPool:
                    return list(waiting.values())
                del waiting[future]
                yield outcome
    return []


def as_json(outcome: Outcome) -> str:
    """One JSON line."""
    return json.dumps(asdict(outcome))


def summary(outcomes: Sequence[Outcome]) -> str:
    """How many were baked, fresh and failed, in one line."""
    states = [outcome.state for outcome in outcomes]
    return ", ".join(f"{states.count(state)} {state}" for state in ("baked", "fresh", "failed"))


def requests_of(places: Sequence[tuple[Path, Path]], common: Request) -> list[Request]:
    """One request a photo, alike but for photo and bundle."""
    return [replace(common, photo=photo, output=bundle) for photo, bundle in places]
