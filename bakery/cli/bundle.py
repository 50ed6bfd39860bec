"""`bakery bundle`: what the other steps made, as one bundle."""

import click

from bakery.cli import options


@click.command(cls=options.Command)
@options.photo
@options.fitted
@click.option("--textures", required=True, type=options.PATH, help="From `texture`.")
@click.option("--masks", required=True, type=options.PATH, help="From `mask`.")
@click.option("-o", "--output", required=True, type=options.PATH, help="The bundle's folder.")
@options.baking
@options.strict
@click.option("--keep-photo", is_flag=True, help="Keep the portrait in the bundle.")
@options.consent
def bundle(photo, fitted, textures, masks, output, preset, settings, **request):
    """Pack what was made of PHOTO into a bundle.

    \b
    bakery bundle portrait.jpg --landmarks points.json --fit fit.json \\
        --textures textures.npz --masks masks.npz -o portrait.avatar

    Who painted the textures stands in their file; --generator changes nothing here. These steps take
    one photo: several photos of one person make one bundle by `bakery build --same-person`.
    """
    options.may_bake(output, request["overwrite"])
    from bakery.bake import pipeline
    from bakery.export.consent import read_consent
    from bakery.heads.file import load_head

    chosen = options.build_options(preset, settings)
    if request["consent"] is not None:
        request["consent"] = read_consent(request["consent"])
    asked = pipeline.Request(photo, output, chosen, **request)
    head = load_head(asked.head)
    pipeline.bundle_files(asked, head, fitted, textures, masks)
    options.wrote(output)
