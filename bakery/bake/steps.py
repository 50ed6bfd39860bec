"""The steps of the bake over files: `pipeline.build` and the commands for single steps share them."""

import logging
from dataclasses import dataclass, field, replace
from functools import cache
from importlib.metadata import entry_points
from pathlib import Path

import numpy as np

from bakery import __version__
from bakery.detectors.file import FileDetector
from bakery.errors import BundleError, FitError, InputError, ModelError
from bakery.export import bundle as files
from bakery.export import hostile
from bakery.export import manifest as bundles
from bakery.export.glb import write_glb, write_proxies
from bakery.export.layout import RIG
from bakery.export.web import WebOptions, web_files
from bakery.export.web.files import card_picture, small_picture
from bakery.formats import image, record, targets
from bakery.formats.files import write_bytes
from bakery.formats.place import staged
from bakery.heads.file import load_head, save_head
from bakery.heads.lashes import card_rectangle, card_texels, with_lashes
from bakery.parallel import side_by_side
from bakery.runtime.avatar import Avatar
from bakery.runtime.blend import lay_hair
from bakery.runtime.contact_sheet import contact_sheet
from bakery.stages import assess, texture
from bakery.stages.atlas import make_atlas
from bakery.stages.detect import SMALLEST_FACE, detect_faces, face_size
from bakery.stages.fit import FitOptions, fit, prepare
from bakery.stages.fit.lids import close_lids
from bakery.stages.fit.warp import residual_offsets
from bakery.stages.mask import activation_masks
from bakery.stages.segment import SegmentOptions, segment
from bakery.stages.texture import TextureOptions
from bakery.stages.texture.hair import cover_of
from bakery.types import EXPRESSIONS, Fit, Landmarks, Photo

log = logging.getLogger(__name__)
GLB_QUALITY = 95  # of the JPEG inside head.glb
RESOLUTIONS = (512, 4096)  # texels, least and most


@dataclass(frozen=True)
class BundleOptions:
    """What goes into the bundle."""

    masks: int = 512  # texels on a side of the activation masks
    web: WebOptions = field(default_factory=WebOptions)  # the copy for browsers
    glb: int = 1024  # texels on a side of the texture inside head.glb, at most


@dataclass(frozen=True)
class BuildOptions:
    """What `bakery build` is told; one field a table of the preset."""

    segment: SegmentOptions = field(default_factory=SegmentOptions)
    fit: FitOptions = field(default_factory=FitOptions)
    texture: TextureOptions = field(default_factory=TextureOptions)
    bundle: BundleOptions = field(default_factory=BundleOptions)
    limits: assess.Limits = field(default_factory=assess.Limits)

    def __post_init__(self):
        low, high = RESOLUTIONS
        if not low <= self.texture.resolution <= high:
            raise InputError(
                f"resolution {self.texture.resolution}; it must lie between {low} and {high} texels"
            )
        if not 16 <= self.bundle.masks <= high:
            raise InputError(f"bundle.masks {self.bundle.masks}; give 16 to {high} texels")


@dataclass(frozen=True)
class Portrait:
    """A photo with what was found in it."""

    photo: Photo
    landmarks: Landmarks
    fit: Fit


@cache
def plug_in(group, name):
    """Something of an entry-point group, made: the "generators" or "detectors".

    Raises:
        InputError: there is none of this name.
    """
    known = {entry.name: entry for entry in entry_points(group=f"bakery.{group}")}
    if name not in known:
        raise InputError(f"no {group[:-1]} '{name}'; known: {', '.join(sorted(known))}")
    return known[name].load()()


def find_faces(path, frame=None, landmarks=None, detector="network", photo=None):
    """A photo and every face in it, the largest first.

    Args:
        path: photo.
        frame: which frame of an animated picture.
        landmarks: a file that `bakery detect` wrote, in place of the detector.
        photo: the Photo, if it was read already.

    Returns:
        Photo and a list of Landmarks, at least one.

    Raises:
        InputError: the photo cannot be read or shows no face, or the landmarks are not its own.
    """
    photo = photo or image.read_photo(path, frame)
    finder = FileDetector(landmarks) if landmarks else plug_in("detectors", detector)
    found = detect_faces(photo.encoded, finder)
    if not found:
        raise InputError(
            f"{path}: no face found; give a photo of a face, upright and at least "
            f"{SMALLEST_FACE} pixels large"
        )
    return photo, found


def landmarks_file(landmarks, photo):
    """The landmarks of a photo: the file given, or NAME.json in the folder given."""
    if landmarks is not None and Path(landmarks).is_dir():
        return Path(landmarks) / f"{Path(photo).stem}.json"
    return landmarks


def one_face(path, frame=None, landmarks=None, number=None, detector="network", photo=None):
    """A photo and the one face in it that is meant.

    Args:
        path, frame, landmarks, detector, photo: see `find_faces`.
        number: which face, from 1; None if there is but one.

    Returns:
        Photo and Landmarks.

    Raises:
        InputError: several faces and no number, or a face that is too small.
    """
    photo, faces = find_faces(path, frame, landmarks, detector, photo)
    if number is None and len(faces) > 1:
        boxes = ", ".join(
            f"{k} at ({face.box[0]:.0f}, {face.box[1]:.0f})" for k, face in enumerate(faces[:6], 1)
        )
        raise InputError(f"{path}: {len(faces)} faces ({boxes}); choose one with --face N")
    if number is not None and number > len(faces):
        raise InputError(f"{path}: has {len(faces)} face(s), no face {number}; give a lower --face")
    chosen = faces[(number or 1) - 1]
    if face_size(chosen) < SMALLEST_FACE:
        raise InputError(
            f"{path}: the face is {face_size(chosen):.0f} pixels large; at least {SMALLEST_FACE} "
            "are needed; give a larger picture"
        )
    return photo, chosen


def place_head(path, photo, landmarks, head, options=BuildOptions(), segmentation=None):
    """Segment the photo and fit the head.

    Returns:
        Fit and Segmentation.

    Raises:
        FitError: see `stages.fit.fit`.
    """
    try:
        if segmentation is None:
            segmentation = segment_portrait(photo, landmarks, options)
        prepare(head, options.fit)  # what all fits of a head share is not the time of one
        return fit(photo, landmarks, head, options.fit, segmentation.skin), segmentation
    except FitError as error:
        raise FitError(f"{path}: {error}") from error


def segment_portrait(photo, landmarks, options):
    """What each pixel of the photo shows: Segmentation."""
    return segment(photo.encoded, landmarks.points, options.segment)


def fitted_neutral(head, fit):
    """The neutral shape [V, 3] mm of a fit, with its residual warp."""
    return head.neutral(fit.identity, residual_offsets(head, fit.residual))


def own_head(head, fit):
    """The head as this person has it, and its neutral shape [V, 3].

    Its lids close on the eyes, and lashes and tear lines stand behind the vertices of `head`.
    """
    neutral = fitted_neutral(head, fit)
    return with_lashes(close_lids(head, neutral), neutral)


def expression_targets():
    """The expressions, gazes and mouths that are baked."""
    folder = targets.presets_folder() / "expressions"
    names, weights = targets.read_keys(folder / "keys.toml")
    return texture.Targets(
        key_names=names,
        key_weights=weights,
        gaze=targets.read_gaze(folder / "gaze.toml"),
        mouths=targets.read_mouths(folder / "mouths.json"),
    )


def paint(photo, landmarks, fit, segmentation, head, generator, options, progress=None):
    """All textures of one fit.

    Args:
        progress: called with (step, done, total).

    Returns:
        Textures.
    """
    wanted = expression_targets()
    poses = min(len(wanted.mouths), options.texture.mouths)
    total = 1 + len(wanted.key_names) + len(wanted.gaze) + poses
    done = 0

    def say(word):
        nonlocal done
        if progress is not None:
            progress(word, done, total)
        done += 1

    own, neutral = own_head(head, fit)
    return texture.bake(
        photo,
        landmarks,
        fit,
        neutral,
        own,
        cover_of(photo.encoded, segmentation, landmarks.points),
        generator,
        wanted,
        options.texture,
        say,
    )


def draw_masks(head, options):
    """Activation masks [E, m, m] float32 of a head model."""
    size = min(options.bundle.masks, options.texture.resolution)
    return activation_masks(head, make_atlas(head, size))


def examine(path, photo, landmarks, fit, segmentation, options, strict):
    """Measure what may spoil the avatar, and say so; with `strict`, refuse it.

    Returns:
        list of assess.Finding.
    """
    findings = assess.assess(photo, landmarks, fit, segmentation, options.limits)
    lines = [
        f"{found.message} ({found.code} {found.value:g}, limit {found.limit:g})"
        for found in findings
    ]
    if strict and lines:
        raise InputError(
            f"{path}: {'; '.join(lines)}; give another portrait, or leave out --strict"
        )
    for line in lines:
        log.warning("%s: %s", path, line)
    return findings


def detector_name(landmarks, detector="network"):
    """What the manifest says about who found the landmarks."""
    return "given landmarks" if landmarks else detector


def pack(target, baked, options, keep_photo=False, overwrite=False):
    """Write a bundle.

    Args:
        target: the bundle's folder.
        baked: Baked.
        options: BundleOptions.
        keep_photo: whether the photo goes into the bundle.
        overwrite: whether an older bundle may be replaced.
    """
    textures = baked.textures
    head, neutral = own_head(baked.head, baked.fit)
    kept = baked.photo.encoded if keep_photo else None
    avatar = Avatar(head, neutral, baked.fit, textures, baked.masks, kept)
    with staged(target, overwrite) as folder:

        def heads():
            levels, proxies = bundles.levels_of_detail(head, neutral)
            atlas = small_picture(lay_hair(textures.neutral, textures.hair), options.glb)
            picture = image.encode_image(atlas, ".jpg", GLB_QUALITY)
            maker = f"bakery {__version__}"
            cards = None
            if card_rectangle(head) is not None:
                sheet = textures.hair[card_texels(head, len(textures.hair))]
                cards = image.encode_image(card_picture(sheet), ".png")
            write_glb(folder / "head.glb", levels, EXPRESSIONS, picture, cards, maker)
            write_proxies(folder / "proxies.glb", proxies, EXPRESSIONS, maker)
            modes = np.zeros((0, *neutral.shape), np.float32)
            save_head(folder / RIG, replace(head, mean=neutral, identity_basis=modes))
            return levels

        def web():
            packed, table = web_files(avatar, options.web)
            for name, data in packed.items():
                write_bytes(folder / name, data)
            return table

        def pictures():
            files.write_textures(folder, textures, baked.masks)
            if keep_photo:
                image.write_image(folder / "photo.png", baked.photo.encoded)

        def preview():
            image.write_image(folder / "preview.png", contact_sheet(avatar))

        jobs = (preview, web, pictures, heads)
        _, table, _, levels = side_by_side(lambda job: job(), jobs)
        listed = files.list_files(folder)
        files.write_manifest(folder, bundles.manifest(baked, levels, table, listed))


def open_avatar(path):
    """A bundle, ready to be played; it needs nothing but itself.

    Raises:
        BundleError: damaged.
    """
    manifest = files.read_manifest(path)
    hostile.refuse(path, manifest)
    files.read_file(path, manifest, RIG)  # is it what was written?
    try:
        head = load_head(Path(path) / RIG)
    except ModelError as error:
        raise BundleError(str(error)) from None
    textures, masks = files.read_textures(path, manifest)
    fit = record.fit_from_table(path, manifest["fit"])
    photo = files.read_photo(path, manifest) if "photo" in manifest else None
    return Avatar(head, head.mean, fit, textures, masks, photo)
