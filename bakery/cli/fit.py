"""`bakery fit`: the head model placed in photos."""

import click

from bakery.cli import options
from bakery.cli.each import as_bytes, check_early, each, output, overlay, show


@click.command(cls=options.Command)
@options.photos
@output
@overlay
@options.baking
@options.dry_run
def fit(
    photos, output, preview, dry_run, overwrite, preset, settings, resolution, head, detector,
    landmarks, face, frame, **others,
):  # fmt: skip
    """Fit the head model to PHOTOS.

    Writes JSON to a file (one photo; "-" is stdout) or as NAME.json into a folder.

    \b
    bakery fit portrait.jpg -o fit.json --preview fitted.png
    bakery fit photos/*.jpg --landmarks points/ -o fits/
    """
    check_early(photos, frame)
    from bakery.bake.faces import landmarks_file, one_face
    from bakery.bake.fitting import fit_portrait, fitted_neutral
    from bakery.formats import record
    from bakery.heads.file import load_head
    from bakery.runtime.overlay import draw_fit

    model, chosen = load_head(head), options.build_options(preset, settings, resolution)

    def one(photo, place, drawn):
        given = landmarks_file(landmarks, photo)
        image, points = one_face(photo, frame, given, face, detector)
        points = record.rounded_face(image, points)  # as a bake has them
        if not dry_run:
            fitted, _ = fit_portrait(photo, image, points, model, chosen)
            options.write(place, record.dump(record.fit_to_table(fitted, image)))
            neutral = fitted_neutral(model, fitted)
            shape = model.vertices(neutral, fitted.expression, fitted.gaze)
            show(drawn, lambda: draw_fit(as_bytes(image), points, fitted, model, shape))
        return not dry_run

    each(photos, output, preview, overwrite, one)
