"""`bakery render`: frames of an avatar, by the reference of the runtime."""

from pathlib import Path

import click

from bakery.cli import complete, options


@click.command(cls=options.Command)
@click.argument("bundle", type=click.Path(path_type=Path))
@click.option(
    "-o", "--output", required=True, type=click.Path(path_type=Path),
    help="Picture to write: .png, .jpg, .webp or .exr (linear, with alpha).",
)  # fmt: skip
@click.option(
    "--expression", default="", shell_complete=complete.expressions,
    help="Named: laugh, laugh=0.5 or smile=0.6,wink=0.3; `bakery shapes` lists the names.",
)  # fmt: skip
@options.weights
@click.option(
    "--fit", "fitted", type=click.Path(path_type=Path),
    help="Expression and camera from what `bakery fit` wrote of another photo.",
)  # fmt: skip
@click.option("--gaze", help="YAW,PITCH in degrees, to the subject's left and up.")
@click.option(
    "--view", default="front", show_default=True,
    help="photo (of a bundle built with --keep-photo), front or YAW,PITCH.",
)  # fmt: skip
@options.framing
@click.option("--size", type=click.IntRange(16, 8192), help="Pixels on a side (512).")
@click.option(
    "--background", metavar="none|gray|photo|#RRGGBB",
    help="What is behind the head; none is alpha (gray; photo with --view photo; none in EXR).",
)  # fmt: skip
@click.option(
    "--light", metavar="NAME|FILE", shell_complete=complete.lights,
    help="Another light than the photo's: neutral, studio, rim, sunset; a .toml as those; .json with "
    "27 coefficients, or what `bakery fit` wrote; .exr, a map of the surroundings.",
)  # fmt: skip
@click.option(
    "--turntable", type=click.IntRange(2, 999), metavar="N",
    help="N views around the head, as NAME.000.png, NAME.001.png ...",
)  # fmt: skip
@click.option(
    "--textures", type=click.Choice(["dynamic", "static"]), default="dynamic", show_default=True,
    help="Blend the baked expressions, or show the neutral texture alone.",
)  # fmt: skip
@click.option("--hair/--no-hair", default=True, help="Show the hair (shown).")
@click.option("--mask", type=click.Path(path_type=Path), help="PNG of the pixels of the face.")
@options.overwrite
def render(bundle, output, mask, turntable, overwrite, **wanted):
    """Draw a frame of BUNDLE.

    \b
    bakery render portrait.avatar -o out.png --weights jawOpen=0.6,mouthSmileLeft=0.8
    bakery render portrait.avatar -o laugh.png --expression laugh=0.7 --view 40,0
    bakery render portrait.avatar -o out.png --fit smiling.json --mask mask.png
    bakery render portrait.avatar -o out.png --view photo
    bakery render portrait.avatar -o head.png --background none --turntable 36
    bakery render portrait.avatar -o out.png --light sunset --view 30,0

    A light stays where it is when --view goes round the head. Each is as bright as `neutral`, over
    all directions; its file may say by how many stops (exposure) it is more.
    """
    from bakery.export.bundle import read_manifest
    from bakery.export.open import open_avatar
    from bakery.formats.image import write_image
    from bakery.formats.mark import of_manifest, stamp
    from bakery.show import frame as frames

    scene = frames.output_scene(output, frames.Scene(**frames.parse(**wanted)))
    if mask is not None:
        frames.check_ending(mask, frames.MASKS)
    scenes = [(scene, output, mask)]
    if turntable:
        scenes = [
            (turned, *(place and frames.numbered(place, number) for place in (output, mask)))
            for number, turned in enumerate(frames.turntable(scene, turntable))
        ]
    for _, place, covered in scenes:
        options.may_write(place, overwrite, inputs=[covered] if covered else [])
        options.may_write(covered, overwrite)
    avatar, said = open_avatar(bundle), of_manifest(read_manifest(bundle))
    with options.progress() as progress:
        for done, (scene, place, covered) in enumerate(scenes):
            progress("render", done, len(scenes))
            picture, face = frames.draw_scene(avatar, scene)
            frames.write(place, picture)
            stamp(place, said)
            if covered is not None:
                write_image(covered, face, mark=said)
    options.wrote(*(place for _, place, _ in scenes[:1]))


@click.command(cls=options.Command)
@click.argument("bundle", type=click.Path(path_type=Path))
@click.argument("expressions", nargs=-1, shell_complete=complete.shapes)
@click.option(
    "-o", "--output", required=True, type=click.Path(path_type=Path), help="EXR to write."
)
@options.overwrite
def recover(bundle, expressions, output, overwrite):
    """Write the textures T_e of EXPRESSIONS (all 52 without any) as the parts of an EXR file.

    \b
    bakery recover portrait.avatar jawOpen mouthSmileLeft -o facs.exr
    """
    from bakery.export.bundle import read_manifest
    from bakery.export.open import open_avatar
    from bakery.formats.exr import write_exr
    from bakery.formats.mark import of_manifest, stamp
    from bakery.show import frame as frames

    options.may_write(output, overwrite, endings=(".exr",))
    write_exr(output, frames.recover(open_avatar(bundle), expressions))
    stamp(output, of_manifest(read_manifest(bundle)))
    options.wrote(output)
