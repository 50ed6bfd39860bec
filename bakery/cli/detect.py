"""`bakery detect`: faces and their landmarks."""

import click

from bakery.cli import options
from bakery.cli.each import as_bytes, check_early, each, output, overlay, show


@click.command(cls=options.Command)
@options.photos
@output
@overlay
@options.baking
@options.dry_run
def detect(photos, output, preview, dry_run, overwrite, detector, face, frame, **others):
    """Find faces and their 478 landmarks in PHOTOS.

    Writes JSON to a file (one photo; "-" is stdout) or as NAME.json into a folder: every face, the
    largest first; beside one that takes a quarter of the photo, those below a seventh of it are not
    looked for. With --face N the file says which one is meant to who takes it by --landmarks.

    \b
    bakery detect portrait.jpg -o portrait.json --preview seen.png
    bakery detect photos/*.jpg -o points/
    """
    check_early(photos, frame)
    from bakery.bake.faces import choose_face, find_faces
    from bakery.formats import record
    from bakery.runtime.overlay import draw_faces

    def one(photo, place, drawn):
        image, faces = find_faces(photo, frame, detector=detector)
        if face is not None:
            choose_face(photo, faces, face)  # refuses a number that there is not
        if not dry_run:
            height, width = image.encoded.shape[:2]
            options.write(place, record.dump(record.faces_to_table(width, height, faces, face)))
            show(drawn, lambda: draw_faces(as_bytes(image), faces))
        return not dry_run

    each(photos, output, preview, overwrite, one)
