"""`bakery render`: one frame of an avatar, by the reference of the runtime."""

from pathlib import Path

import click

from bakery.cli import options


@click.command(cls=options.Command)
@click.argument("bundle", type=click.Path(path_type=Path))
@click.option(
    "-o", "--output", required=True, type=click.Path(path_type=Path), help="PNG to write."
)
@click.option("--weights", default="", help="Expression: jawOpen=0.6,mouthSmileLeft=0.8")
@click.option(
    "--fit", "fitted", type=click.Path(path_type=Path),
    help="Expression and camera from what `bakery fit` wrote of another photo.",
)  # fmt: skip
@click.option("--gaze", help="YAW,PITCH in degrees, to the subject's left and up.")
@click.option("--view", default="front", show_default=True, help="photo, front or YAW,PITCH.")
@click.option("--size", type=click.IntRange(16, 8192), help="Pixels on a side (512).")
@click.option(
    "--textures", type=click.Choice(["dynamic", "static"]), default="dynamic", show_default=True,
    help="Blend the baked expressions, or show the neutral texture alone.",
)  # fmt: skip
@click.option("--hair/--no-hair", default=True, help="Show the hair layer (shown).")
@click.option("--mask", type=click.Path(path_type=Path), help="PNG of the pixels of the face.")
def render(bundle, output, mask, **wanted):
    """Draw a frame of BUNDLE.

    \b
    bakery render portrait.avatar -o out.png --weights jawOpen=0.6,mouthSmileLeft=0.8
    bakery render portrait.avatar -o out.png --fit smiling.json --mask mask.png
    bakery render portrait.avatar -o out.png --view photo

    A frame replaces an older one without asking, for players render many.
    """
    from bakery.export.open import open_avatar
    from bakery.formats.image import write_image
    from bakery.show import frame as frames

    scene = frames.Scene(**frames.parse(**wanted))
    picture, covered = frames.render(open_avatar(bundle), scene)
    write_image(output, picture)
    if mask is not None:
        write_image(mask, covered)


@click.command(cls=options.Command)
@click.argument("bundle", type=click.Path(path_type=Path))
@click.argument("expressions", nargs=-1)
@click.option(
    "-o", "--output", required=True, type=click.Path(path_type=Path), help="EXR to write."
)
@options.overwrite
def recover(bundle, expressions, output, overwrite):
    """Write the textures T_e of EXPRESSIONS (all 52 without any) as the parts of an EXR file.

    \b
    bakery recover portrait.avatar jawOpen mouthSmileLeft -o facs.exr
    """
    from bakery.export.open import open_avatar
    from bakery.formats.exr import write_exr
    from bakery.show import frame as frames

    options.may_write(output, overwrite)
    write_exr(output, frames.recover(open_avatar(bundle), expressions))
