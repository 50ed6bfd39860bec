"""The bake: the order of the steps, what each is made from, what is kept of it.

photo -> detect -> segment -> fit -> textures -> masks -> bundle
"""

from dataclasses import asdict, dataclass, replace
from functools import cache
from pathlib import Path

from bakery.bake.steps import (
    BuildOptions,
    detector_name,
    draw_masks,
    examine,
    landmarks_file,
    one_face,
    pack,
    paint,
    place_head,
    plug_in,
    segment_portrait,
)
from bakery.export import bundle as files
from bakery.export.manifest import Baked
from bakery.formats import image, record
from bakery.formats.files import digest, digest_file, read_bytes
from bakery.formats.place import check_place
from bakery.formats.work import key_of, work_folder
from bakery.heads.file import load_head
from bakery.paths import PACKAGE
from bakery.stages.detect import face_size


@dataclass(frozen=True)
class Request:
    """One bake."""

    photo: Path
    output: Path
    options: BuildOptions = BuildOptions()
    head: str = "makehuman"
    generator: str = "pagan"
    detector: str = "network"
    landmarks: Path | None = None
    face: int | None = None
    frame: int | None = None
    strict: bool = False
    keep_photo: bool = False
    overwrite: bool = False
    work: Path | None = None


def build(request, progress=None):
    """Bake one portrait into an avatar bundle.

    Steps that an interrupted bake of the same portrait finished are taken from the work folder.

    Args:
        request: Request.
        progress: called with (step, done, total).

    Returns:
        list of assess.Finding.

    Raises:
        BakeryError: what the user can mend; with `strict`, findings too.
    """
    request = replace(request, landmarks=landmarks_file(request.landmarks, request.photo))
    show = progress or (lambda step, done, total: None)
    options = request.options
    check_place(request.output, request.overwrite)
    generator = plug_in("generators", request.generator)
    head = load_head(request.head)
    photo = image.read_photo(request.photo, request.frame)
    code = source_digest()
    with work_folder(request.output, request.work) as work:
        show("detect", 0, 4)
        given = digest(read_bytes(request.landmarks)) if request.landmarks else None
        key = key_of(code, photo.sha256, request.frame, given, request.face, request.detector)
        landmarks = work.step(
            "landmarks.json", key, lambda: _landmarks_record(request, photo), _landmarks_of_record
        )
        show("fit", 1, 4)
        segmentation = segment_portrait(photo, landmarks, options)
        key = key_of(key, files.head_digest(head), asdict(options.fit), asdict(options.segment))
        fit = work.step(
            "fit.json",
            key,
            lambda: record.dump(
                record.fit_to_table(
                    place_head(request.photo, photo, landmarks, head, options, segmentation)[0]
                )
            ),
            lambda data: record.fit_from_table("fit.json", record.parse("fit.json", data)),
        )
        findings = examine(
            request.photo, photo, landmarks, fit, segmentation, options, request.strict
        )
        key = key_of(key, generator.name, asdict(options.texture))
        textures = work.step(
            "textures.npz",
            key,
            lambda: record.pack_arrays(
                record.textures_to_arrays(
                    paint(photo, landmarks, fit, segmentation, head, generator, options, show)
                )
            ),
            lambda data: record.textures_from_arrays(record.unpack_arrays("textures.npz", data)),
        )
        show("masks", 2, 4)
        masks = draw_masks(head, options)
        show("pack", 3, 4)
        detector = detector_name(request.landmarks, request.detector)
        baked = Baked(photo, fit, head, textures, masks, findings, generator, detector)
        pack(request.output, baked, options.bundle, request.keep_photo, request.overwrite)
    return findings


def _landmarks_record(request, photo):
    """The one face that is meant, as the bytes that `bakery detect` would write."""
    _, chosen = one_face(
        request.photo, request.frame, request.landmarks, request.face, request.detector, photo
    )
    height, width = photo.encoded.shape[:2]
    return record.dump(record.faces_to_table(width, height, [chosen]))


def _landmarks_of_record(data):
    return record.faces_from_table("landmarks", record.parse("landmarks", data))[1][0]


@cache
def source_digest():
    """SHA-256 over the program itself, so that another version takes nothing from a work folder."""
    package = PACKAGE
    paths = sorted(
        path
        for folder in (package, package.parent / "presets")
        if folder.is_dir()
        for path in folder.rglob("*")
        if path.suffix in (".py", ".toml", ".json", ".npz", ".safetensors")
    )
    return key_of([[path.name, digest_file(path)] for path in paths])


def describe(request):
    """What `build` would do, as text, after checking what can be checked quickly.

    Raises:
        BakeryError: what `build` would refuse before it begins to paint.
    """
    check_place(request.output, request.overwrite)
    plug_in("generators", request.generator)
    head = load_head(request.head)
    photo, face = one_face(
        request.photo, request.frame, request.landmarks, request.face, request.detector
    )
    height, width = photo.encoded.shape[:2]
    lines = [
        f"photo       {request.photo} ({width}x{height}{''.join(', ' + n for n in photo.notes)})",
        f"face        {face_size(face):.0f} pixels, score {face.score:.2f}",
        f"head        {head.name} ({len(head.mean)} vertices)",
        f"generator   {request.generator}",
        f"bundle      {request.output}",
    ]
    for table, values in asdict(request.options).items():
        lines += [f"{table}.{key} = {value}" for key, value in values.items()]
    return "\n".join(lines)
