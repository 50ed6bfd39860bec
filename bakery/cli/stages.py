"""The steps of the bake as commands; each reads the last one's file."""

from pathlib import Path

import click

from bakery.cli import options
from bakery.errors import BakeryError

output = click.option("-o", "--output", required=True, type=click.Path(path_type=Path))
overlay = click.option(
    "--preview", type=click.Path(path_type=Path),
    help="Picture of what was found, drawn over the photo (of several, a folder).",
)  # fmt: skip
OVERLAYS = (".png", ".jpg", ".webp")


@click.command(cls=options.Command)
@options.photos
@output
@overlay
@options.frame
@options.overwrite
@options.dry_run
def detect(photos, output, preview, frame, overwrite, dry_run):
    """Find faces and their 478 landmarks in PHOTOS.

    Writes JSON to a file (one photo; "-" is stdout) or as NAME.json into a folder.

    \b
    bakery detect portrait.jpg -o portrait.json
    bakery detect photos/*.jpg -o points/ --preview seen/
    """
    if len(photos) == 1:
        _check_early(photos[0], frame)
    from bakery import steps
    from bakery.formats import record
    from bakery.runtime.overlay import draw_faces

    def one(photo, place, shown):
        image, faces = steps.find_faces(photo, frame)
        if not dry_run:
            height, width = image.encoded.shape[:2]
            options.write(place, record.dump(record.faces_to_table(width, height, faces)))
            _show(shown, lambda: draw_faces(_bytes(image), faces))

    _each(photos, output, preview, overwrite, one)


@click.command(cls=options.Command)
@options.photos
@output
@overlay
@options.head
@options.which_face
@options.overwrite
@options.dry_run
def fit(photos, output, preview, head, landmarks, face, frame, overwrite, dry_run):
    """Fit the head model to PHOTOS.

    Writes JSON to a file (one photo; "-" is stdout) or as NAME.json into a folder.

    \b
    bakery fit portrait.jpg -o fit.json --preview fit.png
    bakery fit photos/*.jpg --landmarks points/ -o fits/
    """
    if len(photos) == 1:
        _check_early(photos[0], frame)
    from bakery import steps
    from bakery.formats import record
    from bakery.runtime.overlay import draw_fit

    model = steps.load_head(head)

    def one(photo, place, shown):
        given = steps.landmarks_file(landmarks, photo)
        image, points = steps.one_face(photo, frame, given, face)
        if not dry_run:
            fitted, _ = steps.place_head(photo, image, points, model)
            options.write(place, record.dump(record.fit_to_table(fitted, image)))
            neutral = steps.fitted_neutral(model, fitted)
            shape = model.vertices(neutral, fitted.expression, fitted.gaze)
            _show(shown, lambda: draw_fit(_bytes(image), points, fitted, model, shape))

    _each(photos, output, preview, overwrite, one)


@click.command(cls=options.Command)
@options.photos
@output
@overlay
@options.chosen
@options.which_face
@options.overwrite
@options.dry_run
def segment(
    photos, output, preview, preset, settings, landmarks, face, frame, overwrite, dry_run
):  # fmt: skip
    """Label every pixel of PHOTOS.

    Writes an indexed PNG (one photo; "-" is stdout) or NAME.png into a folder. A pixel's index is
    its label: 0 background, 1 skin (beards, brows and lashes too), 2 hair, 3 clothes, 4 glasses,
    5 eyes, 6 lips, 7 mouth, 8 hidden (part of the face that hair or deep shadow covers).

    \b
    bakery segment portrait.jpg -o labels.png --preview seen.png
    bakery segment photos/*.jpg -o labels/
    """
    if len(photos) == 1:
        _check_early(photos[0], frame)
    from bakery import steps
    from bakery.formats.labels import encode_labels
    from bakery.runtime.overlay import LABEL_COLORS, draw_labels

    chosen = options.build_options(preset, settings)

    def one(photo, place, shown):
        given = steps.landmarks_file(landmarks, photo)
        image, points = steps.one_face(photo, frame, given, face)
        if not dry_run:
            labels = steps.segment_portrait(image, points, chosen).labels
            options.write(place, encode_labels(labels, LABEL_COLORS))
            _show(shown, lambda: draw_labels(_bytes(image), labels))

    _each(photos, output, preview, overwrite, one, ".png")


def _bytes(photo):
    """The photo [H, W, 3] uint8 sRGB."""
    import numpy as np

    return (np.clip(photo.encoded, 0, 1) * 255 + 0.5).astype(np.uint8)


def _show(place, draw):
    """Write an overlay if one is wanted."""
    from bakery.formats.image import write_image

    if place is not None:
        write_image(place, draw())


def _check_early(photo, frame):
    """Before the slow imports: a wrong file is told at once."""
    from bakery.formats.image_header import check_file

    check_file(photo, frame)


def _each(photos, output, preview, overwrite, one, ending=".json"):
    """Call `one` for each photo; a bad photo does not stop the others, but the exit code tells."""
    failed = None
    places = options.destinations(photos, output, ending)
    shown = _overlays(photos, preview)
    if preview is not None and {place for _, place in places} & {preview, *shown}:
        raise click.UsageError("-o and --preview name one file; give two")
    with options.progress() as progress:
        for done, ((photo, place), overlay) in enumerate(zip(places, shown)):
            progress("photos", done, len(places))
            try:
                options.may_write(place, overwrite)
                options.may_write(overlay, overwrite)
                one(photo, place, overlay)
            except BakeryError as error:
                if failed is not None:
                    click.echo(f"bakery: {failed}", err=True)
                failed = error
    if failed is not None:
        raise failed


def _overlays(photos, preview):
    """Where the overlay of each photo goes: paths, or None where none is wanted."""
    if preview is None:
        return [None] * len(photos)
    if str(preview) == "-":
        raise click.UsageError("--preview needs a file; stdout is for what -o writes")
    ending = preview.suffix.lower()
    if ending not in OVERLAYS and ending and not preview.is_dir():
        raise click.UsageError(f"--preview: pictures are {', '.join(OVERLAYS)}, not '{preview}'")
    ending = ending if ending in OVERLAYS else ".png"
    return [place for _, place in options.destinations(photos, preview, ending)]


@click.command(cls=options.Command)
@options.photo
@click.option("--fit", "fitted", required=True, type=click.Path(path_type=Path), help="From `fit`.")
@output
@options.chosen
@options.head
@options.generator
@options.which_face
@options.overwrite
def textures(photo, fitted, output, preset, settings, head, generator, overwrite, **which):
    """Paint all textures of one fit of PHOTO into an npz file.

    \b
    bakery textures portrait.jpg --landmarks points.json --fit fit.json -o textures.npz
    """
    from bakery import steps
    from bakery.formats import record

    options.may_write(output, overwrite)
    chosen = options.build_options(preset, settings)
    read = _read_portrait(photo, fitted, **which)
    segmentation = steps.segment_portrait(read.photo, read.landmarks, chosen)
    painter = steps.plug_in("generators", generator)
    model = steps.load_head(head)
    with options.progress() as progress:
        painted = steps.paint(
            read.photo, read.landmarks, read.fit, segmentation, model, painter, chosen, progress
        )
    record.write_arrays(output, record.textures_to_arrays(painted))


@click.command(cls=options.Command)
@output
@options.chosen
@options.head
@options.overwrite
def masks(output, preset, settings, head, overwrite):
    """Draw the activation masks of a head model into an npz file.

    \b
    bakery masks -o masks.npz
    """
    from bakery import steps
    from bakery.formats import record

    options.may_write(output, overwrite)
    drawn = steps.draw_masks(steps.load_head(head), options.build_options(preset, settings))
    record.write_arrays(output, {"masks": drawn})


@click.command(cls=options.Command)
@options.photo
@click.option("--fit", "fitted", required=True, type=click.Path(path_type=Path), help="From `fit`.")
@click.option("--textures", required=True, type=click.Path(path_type=Path), help="From `textures`.")
@click.option("--masks", required=True, type=click.Path(path_type=Path), help="From `masks`.")
@output
@options.chosen
@options.head
@options.generator
@options.which_face
@click.option("--strict", is_flag=True, help="Refuse a portrait that gives warnings.")
@click.option("--keep-photo", is_flag=True, help="Keep the portrait in the bundle.")
@options.overwrite
def pack(
    photo, fitted, textures, masks, output, preset, settings, head, generator, strict, keep_photo,
    overwrite, **which,
):  # fmt: skip
    """Pack what was made of PHOTO into a bundle.

    \b
    bakery pack portrait.jpg --landmarks points.json --fit fit.json \\
        --textures textures.npz --masks masks.npz -o portrait.avatar
    """
    from bakery import steps
    from bakery.formats import record
    from bakery.stages.bundle import Baked

    chosen = options.build_options(preset, settings)
    read = _read_portrait(photo, fitted, **which)
    segmentation = steps.segment_portrait(read.photo, read.landmarks, chosen)
    baked = Baked(
        photo=read.photo,
        fit=read.fit,
        head=steps.load_head(head),
        textures=record.read_textures(textures),
        masks=record.read_arrays(masks, ["masks"])["masks"],
        findings=steps.examine(
            photo, read.photo, read.landmarks, read.fit, segmentation, chosen, strict
        ),
        generator=steps.plug_in("generators", generator),
        detector=steps.detector_name(which["landmarks"]),
    )
    steps.pack(output, baked, chosen.bundle, keep_photo, overwrite)


def _read_portrait(photo, fitted, frame, landmarks, face):
    """The photo, its landmarks and its fit."""
    from bakery import steps
    from bakery.formats import record

    fit = record.read_fit(fitted)
    given = steps.landmarks_file(landmarks, photo)
    image, points = steps.one_face(photo, frame, given, face)
    return steps.Portrait(image, points, fit)
