"""`bakery evaluate generator`, `painted`, `keys`, `teeth`, `times` and `detail`: the generators, measured."""

import json
from pathlib import Path

import click

from bakery.cli import options

weights_option = click.option(
    "--weights",
    multiple=True,
    metavar="NAME=PATH",
    help="A network by another name beside the shipped one; may be repeated.",
)


def _line(record):
    click.echo(json.dumps(record, default=float))


def _networks(weights):
    """{name: PaganGenerator}: the shipped one, "network", and those of --weights."""
    from bakery.generators import pagan

    found = {"network": pagan.load()}
    for text in weights:
        name, equals, path = text.partition("=")
        if not (name and equals and path):
            raise click.BadParameter(f"{text!r}: give NAME=PATH, such as longer=runs/longer.st")
        found[name] = pagan.load(path)
    return found


@click.command(cls=options.Command)
@click.argument("portraits", type=click.Path(path_type=Path))
@options.head
@weights_option
@click.option("--pictures", type=click.Path(path_type=Path), help="Folder of side-by-side PNGs.")
@click.option("--only", multiple=True, help="Name of a person; may be repeated.")
@click.option("--take", type=click.Path(path_type=Path), help="Live Link Face CSV, for flicker.")
@options.overwrite
def generator(portraits, head, weights, pictures, only, take, overwrite):
    """Smiles painted from neutral photos: network, rendered, and simple baselines."""
    options.may_fill(pictures, overwrite)
    from bakery.evaluate import generator as generators
    from bakery.generators.identity import load_features
    from bakery.heads.file import load_head
    from bakery.plugins import plug_in

    networks, model = _networks(weights), load_head(head)
    painters = networks | {"rendered": plug_in("generators", "rendered")}
    results = []
    for result in generators.everybody(portraits, model, painters, pictures, only):
        scores = {way: vars(score) for way, score in result.scores.items()}
        own = {way: vars(score) for way, score in result.own_geometry.items()}
        _line({"name": result.name, "teeth": result.teeth, **scores, "own_geometry": own})
        results.append(result)
    if results:
        _line(generators.summary(results))
        _line({"identity": generators.identity(results, load_features())})
    if take:
        _line({"flicker": generators.flicker(portraits, model, take, painters, only)})


@click.command(cls=options.Command)
@click.argument("pairs", type=click.Path(path_type=Path))
@weights_option
@click.option("--most", type=click.IntRange(1), help="Use this many pairs only.")
def painted(pairs, weights, most):
    """Expressions of painted people, as in table 1 of paGAN; PAIRS is of `bakery synth pairs`."""
    from bakery.evaluate.generator import painted as generator_painted

    _line(generator_painted.measure(pairs, _networks(weights), most))


@click.command(cls=options.Command)
@click.argument("photos", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option("-o", "--output", required=True, type=click.Path(path_type=Path), help="Picture.")
@click.option("--yaw", default=0.0, type=click.FloatRange(-60, 60), help="Degrees that they turn.")
@options.head
@options.generator
@options.overwrite
def keys(photos, output, yaw, head, generator, overwrite):
    """The six key expressions of PHOTOS beside them, with eyes and mouths, to look at."""
    from bakery.evaluate.generator.sheet import sheet
    from bakery.formats.image import write_image
    from bakery.formats.mark import MIXED

    options.may_write(output, overwrite, endings=options.PICTURES)
    write_image(output, sheet(photos, head, generator, yaw) / 255.0, 92, MIXED)
    options.wrote(output)


@click.command(cls=options.Command)
@click.argument("portraits", type=click.Path(path_type=Path))
@options.head
@options.generator
@click.option("--set", "name", default="val", show_default=True, help="Folder of PORTRAITS.")
@click.option("--count", type=click.IntRange(1), help="Photos to look at, evenly over the set.")
@click.option("--pictures", type=click.Path(path_type=Path), help="Folder of mouths side by side.")
@options.overwrite
def teeth(portraits, head, generator, name, count, pictures, overwrite):
    """Teeth of smiling photos beside the true ones: hidden from the bake, shown to it, and geometry.

    PORTRAITS is a folder with dense478.npz. Between the lips: dB, "gradient" of luma over the
    truth's; of the teeth: "light", luminance over the truth's, and "distance" in CIELAB.

    \b
    bakery evaluate teeth portraits/congress/ --count 24
    """
    options.may_fill(pictures, overwrite)
    from bakery.evaluate import teeth as mouths
    from bakery.heads.file import load_head
    from bakery.plugins import plug_in

    model, painter = load_head(head), plug_in("generators", generator)
    photos = mouths.toothy(portraits, name)
    rows = []
    for path in mouths.spread(list(photos), count):
        rows.append(mouths.measure(path, photos[path], model, painter, pictures))
        _line({"photo": path.stem} | rows[-1])
    _line({"photos": len(rows)} | mouths.summary(rows))


@click.command(cls=options.Command)
@click.argument("photo", type=click.Path(path_type=Path))
@options.head
@options.generator
@click.option(
    "--warm", is_flag=True,
    help="Milliseconds of detection, segmentation and tracking once loaded, without a bake.",
)  # fmt: skip
def times(photo, head, generator, warm):
    """Seconds of each step of a bake of PHOTO, and of a trained generator's network beside a plain
    U-Net.
    """
    from bakery.plugins import plug_in

    if warm:
        from bakery.evaluate.warm import measure
        from bakery.heads.file import load_head

        figures = measure(photo, load_head(head), plug_in("detectors", "network"))
        for name, row in figures.items():
            _line({"name": name, **row})
        return
    from bakery.evaluate.generator import speed as generator_speed

    seconds, textures, pictures = generator_speed.stages(photo, head, generator)
    _line({"steps": seconds})
    if pictures:
        network = plug_in("generators", generator)
        _line({"network": generator_speed.measure(network, textures, pictures)})


@click.command(cls=options.Command)
@click.argument("bundle", type=click.Path(path_type=Path))
def detail(bundle):
    """How much of the photo's own fine detail the key textures of BUNDLE keep."""
    from bakery.evaluate.generator import detail as generator_detail
    from bakery.export.open import open_avatar

    for name, figures in generator_detail.keep(open_avatar(bundle)).items():
        _line({"key": name, **figures})


@click.command(cls=options.Command)
@click.argument("portraits", type=click.Path(path_type=Path))
@options.head
@click.option("--pictures", type=click.Path(path_type=Path), help="Folder of side-by-side PNGs.")
@click.option("--only", multiple=True, help="Name of a person; may be repeated.")
@options.overwrite
def rest(portraits, head, pictures, only, overwrite):
    """Resting faces made of smiling photos, against the neutral photos of the same people."""
    options.may_fill(pictures, overwrite)
    from bakery.evaluate import rest as resting
    from bakery.heads.file import load_head

    results = []
    for result in resting.everybody(portraits, load_head(head), resting.ways(), pictures, only):
        tables = {name: getattr(result, name) for name in resting.FIGURES}
        rows = {name: {way: vars(score) for way, score in t.items()} for name, t in tables.items()}
        _line({"name": result.name, "teeth": result.teeth, **rows})
        results.append(result)
    if results:
        _line(resting.summary(results))
