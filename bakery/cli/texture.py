"""`bakery texture` and `bakery mask`: the pictures of a bundle, from a fit and from a head model."""

import click

from bakery.cli import options

output = click.option("-o", "--output", required=True, type=options.PATH)


@click.command(cls=options.Command)
@options.photo
@options.fitted
@output
@options.baking
def texture(photo, fitted, output, overwrite, preset, settings, **request):
    """Paint all textures of one fit of PHOTO into an npz file.

    \b
    bakery texture portrait.jpg --landmarks points.json --fit fit.json -o textures.npz

    Of several photos of one person `bakery build --same-person` paints one set; this step takes one.
    """
    options.may_write(output, overwrite)
    from bakery.bake import pipeline
    from bakery.bake.estimate import plan
    from bakery.bake.targets import read_targets
    from bakery.bake.textures import STEPS, paint
    from bakery.formats import record
    from bakery.heads.file import load_head
    from bakery.plugins import plug_in

    chosen = options.build_options(preset, settings)
    generator, head = plug_in("generators", request["generator"]), load_head(request["head"])
    asked = pipeline.Request(photo, output, chosen, **request)
    seen = pipeline.read_portrait(asked, fitted, head)
    wanted = read_targets(asked.expressions)
    steps = plan(chosen, wanted, asked.generator)
    with options.progress(output.name, {word: steps[word] for word in STEPS}) as progress:
        painted = paint(
            seen.photo, seen.landmarks, seen.fit, seen.segmentation, head, generator,
            plug_in("hair", asked.hair), chosen, progress=progress,
            wanted=wanted,
        )  # fmt: skip
    record.write_arrays(output, record.textures_to_arrays(painted))
    options.wrote(output)


@click.command(cls=options.Command)
@options.photo
@output
@click.option("--fit", "fitted", type=options.PATH, help="From `fit`; made if left out.")
@options.baking
def albedo(photo, fitted, output, overwrite, preset, settings, **request):
    """Write the albedo of PHOTO's person as an OpenEXR file: unwrapped, linear, 0 to 1.

    Light and highlights are taken off. The tone is that of the person: by how photographs are
    exposed, and by the white of the eyes.

    \b
    bakery albedo portrait.jpg -o albedo.exr
    """
    options.may_write(output, overwrite, endings=(".exr",))
    from bakery.bake import pipeline
    from bakery.bake.textures import neutral_albedo
    from bakery.bake.views import PhotoView
    from bakery.formats.exr import write_exr
    from bakery.formats.mark import of_ours, stamp
    from bakery.heads.file import load_head
    from bakery.plugins import plug_in

    chosen = options.build_options(preset, settings)
    head, hair = load_head(request["head"]), plug_in("hair", request["hair"])
    asked = pipeline.Request(photo, output, chosen, **request)
    with options.progress(output.name) as progress:
        if fitted is not None:
            seen = pipeline.read_portrait(asked, fitted, head)
        else:
            seen = pipeline.find_portrait(asked, head, None, progress)
        view = PhotoView(seen.photo, seen.landmarks, seen.fit, seen.segmentation)
        found, _ = neutral_albedo([view], head, hair, chosen.texture)
    write_exr(output, {"albedo": found})
    # Its basis was learned.
    stamp(output, of_ours("compositeWithTrainedAlgorithmicMedia", seen.photo.sha256))
    options.wrote(output)


@click.command(cls=options.Command)
@output
@options.baking
def mask(output, overwrite, preset, settings, head, **others):
    """Draw the activation masks of a head model into an npz file.

    \b
    bakery mask -o masks.npz
    """
    options.may_write(output, overwrite)
    from bakery.bake.mask import draw_masks
    from bakery.formats import record
    from bakery.heads.file import load_head

    model, chosen = load_head(head), options.build_options(preset, settings)
    record.write_arrays(output, {"masks": draw_masks(model, chosen), "head": model.digest})
    options.wrote(output)
