"""`bakery segment`: what each pixel of a portrait shows."""

import click

from bakery.cli import options
from bakery.cli.each import as_bytes, check_early, each, output, overlay, show


@click.command(cls=options.Command)
@options.photos
@output
@overlay
@options.baking
@options.dry_run
def segment(
    photos, output, preview, dry_run, overwrite, preset, settings, detector, landmarks,
    face, frame, **others,
):  # fmt: skip
    """Label every pixel of PHOTOS.

    Writes an indexed PNG (one photo; "-" is stdout) or NAME.png into a folder. A pixel's index is
    its label: 0 background, 1 skin (lashes too), 2 hair, 3 clothes, 4 glasses (their frames, what
    they mirror, dark lenses), 5 eyes, 6 lips, 7 mouth, 8 hidden (part of the face that hair or deep
    shadow covers), 9 lens (of glasses), 10 ears, 11 neck, 12 brows, 13 beard, 14 hat, 15 thing (a
    hand or something else before the person). By colours (--set segment.method=colours) no label
    above 8 is given. The overlay hatches hard cast shadow too, which lies on any label.

    \b
    bakery segment portrait.jpg -o labels.png --preview seen.png
    bakery segment photos/*.jpg -o labels/
    """
    check_early(photos, frame)
    from bakery.bake.faces import landmarks_file, one_face
    from bakery.bake.fitting import segment_portrait
    from bakery.formats.labels import encode_labels
    from bakery.runtime.overlay import LABEL_COLORS, draw_labels

    chosen = options.build_options(preset, settings)

    def one(photo, place, drawn):
        given = landmarks_file(landmarks, photo)
        image, points = one_face(photo, frame, given, face, detector)
        if not dry_run:
            found = segment_portrait(image, points, chosen)
            options.write(place, encode_labels(found.labels, LABEL_COLORS))
            show(drawn, lambda: draw_labels(as_bytes(image), found.labels, found.shadow))
        return not dry_run

    each(photos, output, preview, overwrite, one, ".png")
