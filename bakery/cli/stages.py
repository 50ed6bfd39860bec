"""The steps of the bake as commands; each reads the last one's file."""

from pathlib import Path

import click

from bakery.cli import options
from bakery.errors import BakeryError

output = click.option("-o", "--output", required=True, type=click.Path(path_type=Path))


@click.command(cls=options.Command)
@options.photos
@output
@options.frame
@options.overwrite
@options.dry_run
def detect(photos, output, frame, overwrite, dry_run):
    """Find faces and their 478 landmarks in PHOTOS.

    Writes JSON to a file (one photo; "-" is stdout) or as NAME.json into a folder.

    \b
    bakery detect portrait.jpg -o portrait.json
    bakery detect photos/*.jpg -o points/
    """
    if len(photos) == 1:
        _check_early(photos[0], frame)
    from bakery.bake import steps
    from bakery.formats import record

    def one(photo, place):
        image, faces = steps.find_faces(photo, frame)
        if not dry_run:
            height, width = image.encoded.shape[:2]
            options.write(place, record.dump(record.faces_to_table(width, height, faces)))

    _each(photos, output, overwrite, one)


@click.command(cls=options.Command)
@options.photos
@output
@options.head
@options.which_face
@options.overwrite
@options.dry_run
def fit(photos, output, head, landmarks, face, frame, overwrite, dry_run):
    """Fit the head model to PHOTOS.

    Writes JSON to a file (one photo; "-" is stdout) or as NAME.json into a folder.

    \b
    bakery fit portrait.jpg -o fit.json
    bakery fit photos/*.jpg --landmarks points/ -o fits/
    """
    if len(photos) == 1:
        _check_early(photos[0], frame)
    from bakery.bake import steps
    from bakery.formats import record

    model = steps.load_head(head)

    def one(photo, place):
        given = steps.landmarks_file(landmarks, photo)
        image, points = steps.one_face(photo, frame, given, face)
        if not dry_run:
            fitted, _ = steps.place_head(photo, image, points, model)
            options.write(place, record.dump(record.fit_to_table(fitted, image)))

    _each(photos, output, overwrite, one)


def _check_early(photo, frame):
    """Before the slow imports: a wrong file is told at once."""
    from bakery.formats.image_header import check_file

    check_file(photo, frame)


def _each(photos, output, overwrite, one):
    """Call `one` for each photo; a bad photo does not stop the others, but the exit code tells."""
    failed = None
    places = options.destinations(photos, output)
    with options.progress() as progress:
        for done, (photo, place) in enumerate(places):
            progress("photos", done, len(places))
            try:
                options.may_write(place, overwrite)
                one(photo, place)
            except BakeryError as error:
                if failed is not None:
                    click.echo(f"bakery: {failed}", err=True)
                failed = error
    if failed is not None:
        raise failed


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
    from bakery.bake import steps
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
    from bakery.bake import steps
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
    from bakery.bake import steps
    from bakery.export.manifest import Baked
    from bakery.formats import record

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
    from bakery.bake import steps
    from bakery.formats import record

    fit = record.read_fit(fitted)
    given = steps.landmarks_file(landmarks, photo)
    image, points = steps.one_face(photo, frame, given, face)
    return steps.Portrait(image, points, fit)
