"""`bakery fit`: the head model placed in photos."""

from dataclasses import replace

import click

from bakery.cli import options
from bakery.cli.each import as_bytes, check_early, each, output, overlay, show


@click.command(cls=options.Command)
@options.photos
@output
@overlay
@options.baking
@click.option(
    "--same-person",
    is_flag=True,
    help="All PHOTOS show one person: one identity and one warp for all; a file gets the fit of the "
    "leading photo.",
)
@options.strict
@options.dry_run
def fit(
    photos, output, preview, dry_run, overwrite, preset, settings, head, detector,
    landmarks, face, frame, same_person, strict, **others,
):  # fmt: skip
    """Fit the head model to PHOTOS.

    Writes JSON to a file (one photo; "-" is stdout) or as NAME.json into a folder.

    \b
    bakery fit portrait.jpg -o fit.json --preview fitted.png
    bakery fit photos/*.jpg --landmarks points/ -o fits/
    bakery fit ada-front.jpg ada-side.jpg --same-person -o ada/
    """
    check_early(photos, frame)
    from bakery.bake.faces import landmarks_file, one_face
    from bakery.bake.fitting import examine, fit_portrait, fitted_neutral, segment_portrait
    from bakery.bake.person import fit_person, leading
    from bakery.formats import record
    from bakery.heads.file import load_head
    from bakery.runtime.overlay import draw_fit
    from bakery.stages.fit import Face

    model, chosen = load_head(head), options.build_options(preset, settings)

    def found(photo):
        given = landmarks_file(landmarks, photo)
        image, points = one_face(photo, frame, given, face, detector)
        return image, record.rounded_face(image, points)  # as a bake has them

    def refuse(photo, image, points, fitted, labelled):
        """Only for --strict: else `texture` and `bundle` warn, who know it all anyway."""
        if strict:
            given = landmarks_file(landmarks, photo) is not None
            examine(photo, image, points, fitted, labelled, chosen, strict, given)

    def keep(fitted, image, points, place, drawn):
        options.write(place, record.dump(record.fit_to_table(fitted, image)))
        neutral = fitted_neutral(model, fitted)
        shape = model.vertices(neutral, fitted.expression, fitted.gaze)
        show(drawn, lambda: draw_fit(as_bytes(image), points, fitted, model, shape))

    if not same_person:

        def one(photo, place, drawn):
            image, points = found(photo)
            if not dry_run:
                fitted, labelled = fit_portrait(photo, image, points, model, chosen)
                refuse(photo, image, points, fitted, labelled)
                keep(fitted, image, points, place, drawn)
            return not dry_run

        each(photos, output, preview, overwrite, one)
        return
    if len(photos) < 2:
        raise click.UsageError("--same-person needs two photos or more; give another")
    seen = [Face(*found(photo)) for photo in photos]
    if dry_run:
        return
    labelled = [segment_portrait(one.photo, one.landmarks, chosen) for one in seen]
    seen = [replace(one, skin=told.skin, labels=told.labels) for one, told in zip(seen, labelled)]
    fits = fit_person(photos, seen, model, chosen)
    lead = leading(fits)
    leader = seen[lead]
    refuse(photos[lead], leader.photo, leader.landmarks, fits[lead], labelled[lead])
    by_photo = {photo: (fitted, one) for photo, fitted, one in zip(photos, fits, seen)}
    into_one = options.is_file(output)
    options.say(f"{photos[lead]}: leads; one identity and one warp for {len(photos)} photos")

    def write_one(photo, place, drawn):
        fitted, one = by_photo[photo]
        keep(fitted, one.photo, one.landmarks, place, drawn)
        return True

    each(photos[lead : lead + 1] if into_one else photos, output, preview, overwrite, write_one)
