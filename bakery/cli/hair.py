"""`bakery hair`: the hair of a portrait alone."""

import click

from bakery.cli import options


@click.command(cls=options.Command)
@options.photo
@click.option("-o", "--output", required=True, type=options.PATH)
@click.option("--fit", "fitted", type=options.PATH, help="From `fit`; made if left out.")
@options.baking
def hair(photo, fitted, output, overwrite, preset, settings, **request):
    """Write the hair of PHOTO's person as a GLB file: an opaque cap below cards with alpha.

    In metres, on the person's neutral head; what the photo does not show is made up. With --hair
    layer or none there is no such hair.

    \b
    bakery hair portrait.jpg -o hair.glb
    """
    options.may_write(output, overwrite, endings=(".glb",))
    from bakery import __version__
    from bakery.bake import pipeline
    from bakery.bake.fitting import own_head
    from bakery.errors import InputError
    from bakery.export.hair import write_hair
    from bakery.formats.mark import of_ours, stamp
    from bakery.heads.file import load_head
    from bakery.plugins import plug_in

    chosen = options.build_options(preset, settings)
    model, maker = load_head(request["head"]), plug_in("hair", request["hair"])
    asked = pipeline.Request(photo, output, chosen, **request)
    with options.progress(output.name) as progress:
        if fitted is not None:
            seen = pipeline.read_portrait(asked, fitted, model)
        else:
            seen = pipeline.find_portrait(asked, model, None, progress)
        head, neutral = own_head(model, seen.fit)
        mesh = maker.mesh(seen.photo, seen.segmentation, seen.fit, head, neutral)
    if mesh is None:
        raise InputError(
            f"{photo}: no hair that stands off the head by --hair {request['hair']}; "
            "give a portrait with hair, or --hair cards"
        )
    write_hair(output, mesh, f"bakery {__version__}")
    stamp(output, of_ours("compositeSynthetic", seen.photo.sha256))
    options.wrote(output)
