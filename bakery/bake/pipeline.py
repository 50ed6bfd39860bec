"""The bake: the order of the steps, what each is made from, what is kept of it.

photo -> detect -> segment -> fit -> (condition -> generate ->) texture -> mask -> bundle
"""

import logging
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from functools import cache, partial
from pathlib import Path

import numpy as np

from bakery.bake.bundle import exporters, write_bundle
from bakery.bake.estimate import estimate
from bakery.bake.faces import landmarks_file, one_face
from bakery.bake.fitting import (
    check_head,
    check_same_face,
    examine,
    fit_portrait,
    made_from,
    segment_portrait,
)
from bakery.bake.kept import Kept
from bakery.bake.mask import draw_masks
from bakery.bake.options import BuildOptions
from bakery.bake.person import check_photos, fit_person, leading, tell_marks
from bakery.bake.targets import read_targets
from bakery.bake.textures import paint
from bakery.bake.views import PhotoView
from bakery.errors import InputError
from bakery.export.consent import Consent
from bakery.export.manifest import Baked
from bakery.formats import image, record
from bakery.formats.files import digest, digest_file, read_bytes
from bakery.formats.place import check_place
from bakery.formats.signing import Credentials
from bakery.formats.work import Work, key_of, work_folder
from bakery.generators.base import Generator
from bakery.heads.base import HeadModel
from bakery.heads.file import load_head
from bakery.parallel import ahead, beside
from bakery.paths import PACKAGE
from bakery.plugins import maker_of, plug_in
from bakery.stages.assess import Finding
from bakery.stages.detect import face_size
from bakery.stages.fit import Face, prepare
from bakery.stages.segment import Segmentation, made_by
from bakery.types import Fit, Landmarks, Maker, Photo, Textures

log = logging.getLogger(__name__)
Progress = Callable[[str, int, int], None]


@dataclass(frozen=True)
class Request:
    """One bake."""

    photo: Path
    output: Path
    options: BuildOptions = field(default_factory=BuildOptions)
    head: str = "makehuman"
    generator: str = "pagan"
    hair: str = "cards"
    expressions: Path | None = None  # a file of targets in place of those that ship
    detector: str = "network"
    landmarks: Path | None = None
    face: int | None = None
    frame: int | None = None
    strict: bool = False
    keep_photo: bool = False
    overwrite: bool = False
    work: Path | None = None
    others: tuple[Path, ...] = ()  # further photos of the same person
    consent: Consent | None = None  # of the person shown
    credentials: Credentials | None = None  # what signs the bundle; none leaves it unsigned


@dataclass(frozen=True, eq=False)
class Found:
    """A photo and the face in it."""

    photo: Photo
    landmarks: Landmarks


@dataclass(frozen=True, eq=False)
class Portrait:
    """A photo with what was found in it."""

    photo: Photo
    landmarks: Landmarks
    segmentation: Segmentation
    fit: Fit
    findings: list[Finding]
    key: str  # of everything that the fit is made from
    views: tuple[PhotoView, ...] = ()  # further photos of the person


def build(request: Request, progress: Progress | None = None) -> list[Finding]:
    """Bake one portrait into an avatar bundle.

    What an interrupted bake of the same portrait finished is taken from the work folder.

    Args:
        progress: called with (step, done, total).

    Raises:
        BakeryError: what the user can mend; with `strict`, findings too.
    """
    show = progress or (lambda step, done, total: None)
    options = request.options
    check_place(request.output, request.overwrite)
    head = load_head(request.head)
    ahead(prepare, head, options.fit)  # beside the imports of the networks
    generator: Generator = plug_in("generators", request.generator)
    exporters(options.bundle)  # a name that there is not is told before the work
    with work_folder(request.output, request.work) as work:
        seen = find_portrait(request, head, work, show)
        made_by = _maker("generators", request.generator), _maker("hair", request.hair)
        wanted = read_targets(request.expressions)
        kept = Kept(work, key_of(seen.key, made_by, wanted.digest, asdict(options.texture)))
        with beside(partial(draw_masks, head, options)) as drawn:
            textures = paint(
                seen.photo,
                seen.landmarks,
                seen.fit,
                seen.segmentation,
                head,
                generator,
                plug_in("hair", request.hair),
                options,
                kept,
                show,
                wanted,
                seen.views,
            )
            show("mask", 2, 4)
            masks = drawn()
        show("bundle", 3, 4)
        _bundle(request, seen, head, textures, masks)
    return seen.findings


def find_portrait(request: Request, head: HeadModel, work: Work | None, show: Progress) -> Portrait:
    """The steps before anything is painted: detect, segment, fit, assess.

    Of several photos of one person the leading one is the portrait (`person.leading`).

    Args:
        work: folder of finished steps, or None.

    Raises:
        BakeryError: the portrait cannot be used.
    """
    work = work or Work(None)
    options, paths = request.options, (request.photo, *request.others)
    photos = [image.read_photo(path, request.frame) for path in paths]
    tell_marks(paths, photos)
    check_photos(paths, photos)
    show("detect", 0, 4)
    found = [
        _detected(request, *one, number, work) for number, one in enumerate(zip(paths, photos))
    ]
    show("segment", 1, 4)
    segmentations = [
        segment_portrait(photo, landmarks, options) for photo, (landmarks, _) in zip(photos, found)
    ]
    show("fit", 1, 4)
    labelled_by = asdict(options.segment), made_by(options.segment)
    of_fit = asdict(options.fit), options.texture.neutral
    key = key_of(*(key for _, key in found), head.digest, of_fit, labelled_by)
    faces = [Found(photo, landmarks) for photo, (landmarks, _) in zip(photos, found)]
    fits = _fitted(request, head, faces, segmentations, key, work)
    views = [
        PhotoView(face.photo, face.landmarks, fitted, segmentation)
        for face, fitted, segmentation in zip(faces, fits, segmentations)
    ]
    lead = leading([view.fit for view in views]) if request.others else 0
    seen = views.pop(lead)
    if request.others:
        log.info("%s: leads, the other photos fill what it sees badly", paths[lead])
    findings = examine(
        paths[lead], seen.photo, seen.landmarks, seen.fit, seen.segmentation, options, request.strict,
        landmarks_file(request.landmarks, paths[lead]) is not None,
    )  # fmt: skip
    return Portrait(
        seen.photo, seen.landmarks, seen.segmentation, seen.fit, findings, key, tuple(views)
    )


def _detected(
    request: Request, path: Path, photo: Photo, number: int, work: Work
) -> tuple[Landmarks, str]:
    """The face of one photo, and the key of what it was made from."""
    given = landmarks_file(request.landmarks, path)
    found_by = digest(read_bytes(given)) if given else _maker("detectors", request.detector)
    key = key_of(source_digest(), photo.sha256, request.frame, found_by, request.face)
    name = f"detect{number or ''}.json"

    def detect() -> bytes:
        _, face = one_face(path, request.frame, given, request.face, request.detector, photo)
        height, width = photo.encoded.shape[:2]
        return record.dump(record.faces_to_table(width, height, [face]))

    def load(data: bytes) -> Landmarks:
        return record.faces_from_table(name, record.parse(name, data))[1][0]

    return work.step(name, key, detect, load), key


def _fitted(
    request: Request,
    head: HeadModel,
    faces: list[Found],
    segmentations: list[Segmentation],
    key: str,
    work: Work,
) -> list[Fit]:
    """The fit of each photo; of several, with one identity and one warp."""

    def fit() -> bytes:
        if request.others:
            seen = [
                Face(face.photo, face.landmarks, segmentation.skin, segmentation.labels)
                for face, segmentation in zip(faces, segmentations)
            ]
            fits = fit_person((request.photo, *request.others), seen, head, request.options)
        else:
            given = request.photo, faces[0].photo, faces[0].landmarks
            fits = [fit_portrait(*given, head, request.options, segmentations[0])[0]]
        return record.dump({"fits": [record.fit_to_table(one) for one in fits]})

    def load(data: bytes) -> list[Fit]:
        tables = record.parse("fit.json", data)["fits"]
        return [record.fit_from_table("fit.json", table) for table in tables]

    return work.step("fit.json", key, fit, load)


def read_portrait(request: Request, fitted: Path, head: HeadModel) -> Portrait:
    """A portrait whose fit stands in a file.

    Raises:
        InputError: the fit is of another head, photo or face.
    """
    fit = record.read_fit(fitted)
    check_head(fitted, fit, head)
    given = landmarks_file(request.landmarks, request.photo)
    photo, landmarks = one_face(request.photo, request.frame, given, request.face, request.detector)
    landmarks = record.rounded_face(photo, landmarks)  # as `build` has them
    height, width = photo.encoded.shape[:2]
    if (fit.camera.width, fit.camera.height) != (width, height):
        raise InputError(
            f"{fitted}: a fit of a photo of {fit.camera.width}x{fit.camera.height}, "
            f"{request.photo} has {width}x{height}; fit this photo"
        )
    check_same_face(fitted, fit, landmarks)
    segmentation = segment_portrait(photo, landmarks, request.options)
    findings = examine(
        request.photo, photo, landmarks, fit, segmentation, request.options, request.strict,
        given is not None,
    )  # fmt: skip
    return Portrait(photo, landmarks, segmentation, fit, findings, "")


def bundle_files(
    request: Request, head: HeadModel, fitted: Path, textures: Path, masks: Path
) -> None:
    """The last step alone: a bundle from the files that the other steps wrote.

    Raises:
        InputError: the files were made from another photo, fit or head.
    """
    check_place(request.output, request.overwrite)
    seen = read_portrait(request, fitted, head)
    painted = record.read_textures(textures)
    if painted.made_from != made_from(seen.photo, seen.landmarks, seen.fit, head):
        raise InputError(
            f"{textures}: painted from another photo, fit or head; make it again with "
            "`bakery texture`"
        )
    drawn = record.read_arrays(masks, ["masks", "head"])
    if str(drawn["head"]) != head.digest:
        raise InputError(f"{masks}: masks of another head; make them again with `bakery mask`")
    _bundle(request, seen, head, painted, drawn["masks"])


def _bundle(
    request: Request, seen: Portrait, head: HeadModel, textures: Textures, masks: np.ndarray
) -> None:
    marks = [seen.photo.ingredient, *(view.photo.ingredient for view in seen.views)]
    baked = Baked(
        seen.photo, seen.fit, head, textures, masks, seen.findings, textures.maker,
        seen.landmarks.maker, _recipe(request, [seen, *seen.views], head, textures.maker),
        request.consent, tuple(sorted(filter(None, marks), key=lambda one: one.sha256)),
    )  # fmt: skip
    write_bundle(
        request.output, baked, request.options.bundle, request.keep_photo, request.overwrite,
        request.credentials,
    )  # fmt: skip


def recipe(request: Request) -> str:
    """The recipe of the bundle that a request makes; reads the photo and finds the face.

    Raises:
        BakeryError: what `build` would refuse before it fits.
    """
    seen = []
    for path in (request.photo, *request.others):
        given = landmarks_file(request.landmarks, path)
        photo, face = one_face(path, request.frame, given, request.face, request.detector)
        seen.append(Found(photo, record.rounded_face(photo, face)))
    maker = maker_of("generators", plug_in("generators", request.generator))
    return _recipe(request, seen, load_head(request.head), maker)


def _recipe(
    request: Request, seen: Sequence[Found | Portrait | PhotoView], head: HeadModel, painter: Maker
) -> str:
    """SHA-256 over everything that a bundle's content depends on; the manifest keeps it.

    A bundle of the same recipe would come out the same, so that it need not be baked again.

    Args:
        seen: the photos, in any order: which of them leads is told by their fits.
    """
    return key_of(
        source_digest(),
        [
            [
                one.photo.sha256,
                asdict(one.landmarks.maker),
                np.round(one.landmarks.points, 3).tolist(),
            ]
            for one in sorted(seen, key=lambda one: one.photo.sha256)
        ],
        head.digest,
        asdict(painter),
        _maker("hair", request.hair),
        read_targets(request.expressions).digest,
        asdict(request.options),
        made_by(request.options.segment),
        request.keep_photo,
        asdict(request.consent) if request.consent else None,
    )


def _maker(group: str, name: str) -> dict[str, str]:
    return asdict(maker_of(group, plug_in(group, name)))


@cache
def source_digest() -> str:
    """SHA-256 over the program itself, so that another version takes nothing from a work folder."""
    paths = sorted(
        path
        for folder in (PACKAGE, PACKAGE.parent / "presets")
        if folder.is_dir()
        for path in folder.rglob("*")
        if path.suffix in (".py", ".toml", ".json", ".npz", ".safetensors")
    )
    return key_of([[path.name, digest_file(path)] for path in paths])


def describe(request: Request) -> str:
    """What `build` would do, as text, after checking all that it would refuse before it paints.

    Raises:
        BakeryError: what `build` would refuse.
    """
    check_place(request.output, request.overwrite)
    plug_in("generators", request.generator), plug_in("hair", request.hair)
    exporters(request.options.bundle)
    targets = read_targets(request.expressions)
    head = load_head(request.head)
    seen = find_portrait(request, head, None, lambda step, done, total: None)
    height, width = seen.photo.encoded.shape[:2]
    notes = "".join(f", {note}" for note in seen.photo.notes)
    options = request.options
    return "\n".join(
        [
            f"photo       {request.photo} ({width}x{height}{notes})",
            f"face        {face_size(seen.landmarks):.0f} pixels, score {seen.landmarks.score:.2f}",
            f"head        {head.name} ({len(head.mean)} vertices)",
            f"generator   {request.generator}",
            f"bundle      {request.output} ({options.texture.resolution} texels, "
            f"{options.texture.mouths} mouths)",
            f"takes       {estimate(options, targets, request.generator)}",
        ]
    )
