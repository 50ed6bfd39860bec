"""`bakery generate`: the generator's own picture of a portrait (paGAN section 4)."""

from pathlib import Path

import click

from bakery.cli import options
from bakery.cli.animate import timecode_base

path = click.Path(path_type=Path)


@click.command(cls=options.Command)
@options.photo
@click.option("-o", "--output", required=True, type=path, help="PNG to write, or video.")
@click.option(
    "--fit", "fitted", type=path,
    help="Expression, gaze and camera from what `bakery fit` wrote of another photo.",
)  # fmt: skip
@options.weights
@click.option("--yaw", type=click.FloatRange(-60, 60), help="Degrees to the subject's left.")
@click.option("--pitch", type=click.FloatRange(-60, 60), help="Degrees up.")
@click.option("--gaze", help="YAW,PITCH in degrees, to the subject's left and up.")
@click.option("--hair/--no-hair", default=True, show_default=True, help="Show the hair layer.")
@click.option("--curves", type=path, help="Live Link Face CSV: paint a video of it.")
@timecode_base
@click.option("--frames", metavar="FIRST:LAST", help="Only these frames of the take, from 0.")
@click.option("--mask", type=path, help="PNG of the face, which fades towards scalp, ears, throat.")
@options.generator
@options.preset
@options.settings
@options.head
@options.landmarks
@options.face
@options.frame
@options.overwrite
def generate(
    photo,
    output,
    mask,
    curves,
    base,
    frames,
    hair,
    overwrite,
    preset,
    settings,
    generator,
    head,
    **wanted,
):
    """Paint PHOTO's person with another expression, view and gaze: 512x512.

    \b
    bakery generate portrait.jpg --weights mouthSmileLeft=0.8,mouthSmileRight=0.8 -o smile.png
    bakery generate portrait.jpg --fit smiling.json -o smile.png --mask face.png
    bakery generate portrait.jpg --yaw 30 --gaze 10,-5 -o turned.png
    bakery generate portrait.jpg --curves take.csv -o talking.mp4
    """
    from bakery.formats.files import digest_file
    from bakery.formats.image import write_image
    from bakery.formats.livelink import read_take
    from bakery.formats.mark import of_ours
    from bakery.formats.video import kind_of
    from bakery.motion.animate import parse_frames
    from bakery.plugins import plug_in
    from bakery.show import synthesis

    if curves is not None:
        kind_of(output)
    options.may_write(output, overwrite, endings=() if curves else options.PICTURES)
    options.may_write(mask, overwrite, endings=options.PICTURES)
    chosen = options.build_options(preset, settings)
    asked = [wanted.pop(name) for name in ("weights", "fitted", "gaze", "yaw", "pitch")]
    if curves is None:
        target = synthesis.parse(*asked)
    elif any(asked[:3]) or mask is not None:
        raise click.UsageError("--curves brings its own expressions and gaze; no --mask either")
    painter = plug_in("generators", generator)
    if curves is not None:
        take, view = read_take(curves, base), (asked[3] or 0.0, asked[4] or 0.0)
        chosen_frames = slice(*parse_frames(frames))
        fitted = synthesis.fit_subject(photo, head, chosen, **wanted)
        with options.progress(output.name) as progress:
            synthesis.film(fitted, take, painter, output, view, chosen_frames, progress)
        options.wrote(output)
        for note in take.notes:
            options.say(f"{curves}: {note}")
        return
    fitted = synthesis.fit_subject(photo, head, chosen, **wanted)
    picture, face = synthesis.paint(fitted, target, painter, hair)
    said = of_ours(painter.source_type, digest_file(photo))
    write_image(output, picture, mark=said)
    if mask is not None:
        write_image(mask, face, mark=said)
    options.wrote(output, mask)
