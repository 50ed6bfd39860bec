"""What commands over many photos share: a result and an overlay each; a bad photo stops no other."""

import click

from bakery.cli import options
from bakery.errors import BakeryError

output = click.option("-o", "--output", required=True, type=options.PATH)
overlay = click.option(
    "--preview", type=options.PATH,
    help="Picture of what was found, drawn over the photo (of several, a folder).",
)  # fmt: skip


def check_early(photos, frame):
    """Before the slow imports: a wrong file is told at once."""
    from bakery.formats.image_header import check_file

    if len(photos) == 1:
        check_file(photos[0], frame)


def each(photos, output, preview, overwrite, one, ending=".json"):
    """Call `one` for each photo; a bad photo does not stop the others, but the exit code tells.

    Args:
        one: function of a photo, its place and its overlay's, which says whether it wrote there.
        ending: of the results.
    """
    failed, written = None, []
    places = options.destinations(photos, output, ending)
    shown = _overlays(photos, preview)
    if preview is not None and {place for _, place in places} & {preview, *shown}:
        raise click.UsageError("-o and --preview name one file; give two")
    with options.progress() as progress:
        for done, ((photo, place), drawn) in enumerate(zip(places, shown)):
            progress("photos", done, len(places))
            try:
                options.may_write(place, overwrite)
                options.may_write(drawn, overwrite)
                if one(photo, place, drawn):
                    written.append(place)
            except BakeryError as error:
                if failed is not None:
                    click.echo(f"bakery: {failed}", err=True)
                failed = error
    if len(written) > 1:
        options.say(f"wrote {len(written)} files to {output}")
    else:
        options.wrote(*written)
    if failed is not None:
        raise failed


def show(place, draw):
    """Write an overlay, if one is wanted."""
    from bakery.formats.image import write_image

    if place is not None:
        write_image(place, draw())


def as_bytes(photo):
    """The photo [H, W, 3] uint8 sRGB."""
    import numpy as np

    return (np.clip(photo.encoded, 0, 1) * 255 + 0.5).astype(np.uint8)


def _overlays(photos, preview):
    """Where the overlay of each photo goes: paths, or None where none is wanted."""
    if preview is None:
        return [None] * len(photos)
    if str(preview) == "-":
        raise click.UsageError("--preview needs a file; stdout is for what -o writes")
    ending = preview.suffix.lower()
    if ending not in options.PICTURES and ending and not preview.is_dir():
        raise click.UsageError(
            f"--preview: pictures are {', '.join(options.PICTURES)}, not '{preview}'"
        )
    ending = ending if ending in options.PICTURES else ".png"
    return [place for _, place in options.destinations(photos, preview, ending)]
