"""`bakery build`: a portrait in, an avatar bundle out."""

from pathlib import Path

import click

from bakery.cli import options


@click.command(cls=options.Command)
@options.photo
@click.option(
    "-o", "--output", required=True, type=click.Path(path_type=Path), help="The bundle's folder."
)
@options.chosen
@click.option("--resolution", type=click.IntRange(512, 4096), help="Texels on a side (1024).")
@options.head
@options.generator
@click.option("--detector", default="network", show_default=True, help="What finds landmarks.")
@options.which_face
@click.option("--strict", is_flag=True, help="Refuse a portrait that gives warnings.")
@click.option("--keep-photo", is_flag=True, help="Keep the portrait in the bundle.")
@click.option("--work", type=click.Path(path_type=Path), help="Keep finished steps in this folder.")
@options.overwrite
@options.dry_run
def build(photo, output, preset, settings, resolution, dry_run, **request):
    """Bake PHOTO into an avatar bundle.

    \b
    bakery build portrait.jpg -o portrait.avatar
    bakery build portrait.jpg -o portrait.avatar --resolution 2048 --set texture.mouths=100

    An interrupted bake goes on where it stopped when it is called again.
    """
    from bakery.formats.image_header import check_file

    check_file(photo, request["frame"])  # before the slow imports: a wrong file is told at once
    from bakery.bake import pipeline

    chosen = options.build_options(preset, settings, resolution)
    asked = pipeline.Request(photo=photo, output=output, options=chosen, **request)
    if dry_run:
        click.echo(pipeline.describe(asked))
        return
    with options.progress() as progress:
        pipeline.build(asked, progress)
    options.say(f"{output}: look at {output / 'preview.png'}")
