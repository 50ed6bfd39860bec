"""The steps of the bake as commands; each reads the last one's file."""

from pathlib import Path

import click

from bakery.cli import options
from bakery.errors import BakeryError

output = click.option("-o", "--output", required=True, type=click.Path(path_type=Path))


@click.command(cls=options.Command)
@options.photos
@output
@options.baking
@options.dry_run
def detect(photos, output, dry_run, overwrite, detector, frame, **others):
    """Find faces and their 478 landmarks in PHOTOS.

    Writes JSON to a file (one photo; "-" is stdout) or as NAME.json into a folder.

    \b
    bakery detect portrait.jpg -o portrait.json
    bakery detect photos/*.jpg -o points/
    """
    if len(photos) == 1:
        _check_early(photos[0], frame)
    from bakery.bake.faces import find_faces
    from bakery.formats import record

    def one(photo, place):
        image, faces = find_faces(photo, frame, detector=detector)
        if not dry_run:
            height, width = image.encoded.shape[:2]
            options.write(place, record.dump(record.faces_to_table(width, height, faces)))

    _each(photos, output, overwrite, one)


@click.command(cls=options.Command)
@options.photos
@output
@options.baking
@options.dry_run
def fit(
    photos, output, dry_run, overwrite, preset, settings, resolution, head, detector, landmarks,
    face, frame, **others,
):  # fmt: skip
    """Fit the head model to PHOTOS.

    Writes JSON to a file (one photo; "-" is stdout) or as NAME.json into a folder.

    \b
    bakery fit portrait.jpg -o fit.json
    bakery fit photos/*.jpg --landmarks points/ -o fits/
    """
    if len(photos) == 1:
        _check_early(photos[0], frame)
    from bakery.bake.faces import landmarks_file, one_face
    from bakery.bake.fitting import fit_portrait
    from bakery.formats import record
    from bakery.heads.file import load_head

    model, chosen = load_head(head), options.build_options(preset, settings, resolution)

    def one(photo, place):
        given = landmarks_file(landmarks, photo)
        image, points = one_face(photo, frame, given, face, detector)
        height, width = image.encoded.shape[:2]
        # As a bake has them: what its file holds of landmarks is rounded.
        table = record.faces_to_table(width, height, [points])
        points = record.faces_from_table(photo, table)[1][0]
        if not dry_run:
            fitted, _ = fit_portrait(photo, image, points, model, chosen)
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
