"""`bakery generate`: the generator's own picture of a portrait (paGAN section 4)."""

from pathlib import Path

import click

from bakery.cli import options

path = click.Path(path_type=Path)


@click.command(cls=options.Command)
@options.photo
@click.option("-o", "--output", required=True, type=path, help="PNG to write.")
@click.option(
    "--fit", "fitted", type=path,
    help="Expression, gaze and camera from what `bakery fit` wrote of another photo.",
)  # fmt: skip
@click.option("--weights", default="", help="Expression: jawOpen=0.6,mouthSmileLeft=0.8")
@click.option("--yaw", type=click.FloatRange(-60, 60), help="Degrees to the subject's left.")
@click.option("--pitch", type=click.FloatRange(-60, 60), help="Degrees up.")
@click.option("--gaze", help="YAW,PITCH in degrees, to the subject's left and up.")
@click.option("--hair/--no-hair", default=True, show_default=True, help="Show the hair layer.")
@click.option("--mask", type=path, help="PNG of the pixels of the face.")
@click.option("--generator", default="pagan", show_default=True, help="What paints.")
@options.preset
@options.settings
@options.head
@options.landmarks
@options.face
@options.frame
@options.overwrite
def generate(photo, output, mask, hair, overwrite, preset, settings, generator, head, **wanted):
    """Paint PHOTO's person with another expression, view and gaze: 512x512.

    \b
    bakery generate portrait.jpg --weights mouthSmileLeft=0.8,mouthSmileRight=0.8 -o smile.png
    bakery generate portrait.jpg --fit smiling.json -o smile.png --mask face.png
    bakery generate portrait.jpg --yaw 30 --gaze 10,-5 -o turned.png
    """
    from bakery import portrayal, steps
    from bakery.formats.image import write_image

    for place in (output, mask):
        options.may_write(place, overwrite)
    chosen = options.build_options(preset, settings)
    target = portrayal.parse(
        *(wanted.pop(name) for name in ("weights", "fitted", "gaze", "yaw", "pitch"))
    )
    painter = steps.plug_in("generators", generator)
    picture, face = portrayal.paint(
        portrayal.sit(photo, head, chosen, **wanted), target, painter, hair
    )
    write_image(output, picture)
    if mask is not None:
        write_image(mask, face)
