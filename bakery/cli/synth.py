"""`bakery synth`: synthetic portraits, painted by the project."""

from pathlib import Path

import click

from bakery.cli import complete, options


@click.group(cls=options.Group)
def synth():
    """Paint synthetic portraits; no real person is in them."""


@synth.command("samples", cls=options.Command)
@click.argument("names", nargs=-1)
@click.option("-o", "--output", required=True, type=click.Path(path_type=Path), help="Folder.")
@options.head
@options.overwrite
def samples(names, output, head, overwrite):
    """Paint the portraits of samples/, or those of NAMES, with their landmarks.

    \b
    bakery synth samples -o samples/
    """
    options.may_fill(output, overwrite)
    from bakery.heads.file import load_head
    from bakery.synth.samples import write

    for path in write(load_head(head), output, names or None):
        click.echo(path)


@synth.command("failures", cls=options.Command)
@click.argument("names", nargs=-1)
@click.option("-o", "--output", required=True, type=click.Path(path_type=Path), help="Folder.")
@options.head
@options.overwrite
def failures(names, output, head, overwrite):
    """Paint portraits that no good avatar can come from, or those of NAMES.

    \b
    bakery synth failures -o runs/failures
    """
    options.may_fill(output, overwrite)
    from bakery.heads.file import load_head
    from bakery.synth.failures import write

    for path in write(load_head(head), output, names or None):
        click.echo(path)


@synth.command("training", cls=options.Command, resumes=True)
@click.option("-n", "--count", required=True, type=click.IntRange(1), help="Pictures.")
@click.option("-o", "--output", required=True, type=click.Path(path_type=Path), help="Folder.")
@click.option(
    "--seed",
    default=0,
    show_default=True,
    type=click.IntRange(0),
    help="Picture k depends on seed and k only.",
)
@options.head
def training(count, output, seed, head):
    """Paint random people with their 478 points, to train or test detectors on.

    \b
    bakery synth training -n 1000 -o runs/painted
    """
    options.may_go_on(output)
    from bakery.heads.file import load_head
    from bakery.synth.training import write

    for path in write(load_head(head), output, count, seed):
        click.echo(path)


@synth.command("portraits", cls=options.Command, resumes=True)
@click.option("-n", "--count", required=True, type=click.IntRange(1), help="Pictures.")
@click.option("-o", "--output", required=True, type=click.Path(path_type=Path), help="Folder.")
@click.option(
    "--seed", default=0, show_default=True, type=click.IntRange(0),
    help="Person k depends on seed and k only.",
)  # fmt: skip
@click.option("--workers", default=1, show_default=True, type=click.IntRange(1), help="Processes.")
@options.head
def portraits(count, output, seed, workers, head):
    """Paint portraits of which each pixel's class is known, for `bakery train segment`.

    \b
    bakery synth portraits -n 8000 --workers 16 -o runs/portraits
    """
    options.may_go_on(output)
    from bakery.synth.portrait_shards import write

    for path in write(head, output, count, seed, workers):
        click.echo(path)


@synth.command("pairs", cls=options.Command, resumes=True)
@click.option("-n", "--count", required=True, type=click.IntRange(1), help="Pairs.")
@click.option("-o", "--output", required=True, type=click.Path(path_type=Path), help="Folder.")
@click.option(
    "--seed",
    default=0,
    show_default=True,
    type=click.IntRange(0),
    help="Subject k depends on seed and k only.",
)
@click.option(
    "--head", "heads", multiple=True, default=("makehuman",), show_default=True,
    shell_complete=complete.heads,
    help="Head model: name or file; several are taken in turn.",
)  # fmt: skip
@click.option("--skins", type=click.Path(path_type=Path), help="Folder of `bakery synth skins`.")
@click.option("--size", default=256, show_default=True, type=click.IntRange(64), help="Pixels.")
@click.option("--keys", is_flag=True, help="Each key expression from each view, not random ones.")
@click.option(
    "--error", default=1.0, show_default=True, type=click.FloatRange(0),
    help="Mistakes of the shape that conditions are drawn with: 1 as a fit's, 0 none.",
)  # fmt: skip
def pairs(count, output, seed, heads, skins, size, keys, error):
    """Paint invented people in neutral and in other expressions, for `bakery train pagan`.

    \b
    bakery synth pairs -n 4096 --seed 1 -o runs/pairs
    """
    options.may_go_on(output)
    from bakery.heads.file import load_head
    from bakery.synth.pairs.painter import PairOptions
    from bakery.synth.pairs.shards import write

    models = [load_head(head) for head in heads]
    wanted = PairOptions(size=size, keys=keys, error=error)
    for path in write(models, output, count, seed, skins, wanted):
        click.echo(path)


@synth.command("skins", cls=options.Command, resumes=True)
@click.argument("photos", type=click.Path(path_type=Path))
@click.option("-o", "--output", required=True, type=click.Path(path_type=Path), help="Folder.")
@options.head
def skins(photos, output, head):
    """Unwrap the NAME_neutral.jpg of PHOTOS into skins for painted training subjects.

    \b
    bakery synth skins portraits/london/train -o runs/skins
    """
    options.may_go_on(output)
    from bakery.heads.file import load_head
    from bakery.train.skins import unwrap_folder

    for path in unwrap_folder(photos, load_head(head), output):
        click.echo(path)


@synth.command("performers", cls=options.Command, resumes=True)
@click.option("-n", "--count", required=True, type=click.IntRange(1), help="People.")
@click.option("-o", "--output", required=True, type=click.Path(path_type=Path), help="Folder.")
@click.option("--seed", default=0, show_default=True, type=click.IntRange(0))
@click.option("--expressions", default=48, show_default=True, type=click.IntRange(2, 1000))
@click.option("--skins", type=click.Path(path_type=Path), help="Folder of `bakery synth skins`.")
@options.head
def performers(count, output, seed, expressions, skins, head):
    """Paint people who all show the same expressions: textures for `bakery train transfer`.

    \b
    bakery synth performers -n 64 -o runs/performers
    """
    options.may_go_on(output)
    from bakery.heads.file import load_head
    from bakery.synth import performers
    from bakery.synth.quick import make_stage
    from bakery.synth.skins import TEXELS

    stage = make_stage(load_head(head), TEXELS)
    for path in performers.write(stage, output, count, seed, expressions, skins):
        click.echo(path)


@synth.command("sheet", cls=options.Command)
@click.argument("pairs", type=click.Path(path_type=Path))
@click.option("-o", "--output", required=True, type=click.Path(path_type=Path), help="Picture.")
@click.option("-n", "--count", default=64, show_default=True, type=click.IntRange(1))
@click.option("--whole", is_flag=True, help="Photo, deformed neutral and target of each.")
@options.overwrite
def sheet(pairs, output, count, whole, overwrite):
    """Lay painted PAIRS side by side, to look at.

    \b
    bakery synth sheet runs/pairs -o sheet.jpg
    """
    from bakery.formats.image import write_image
    from bakery.formats.mark import PAINTED
    from bakery.synth.sheet import contact_sheet

    options.may_write(output, overwrite, endings=options.PICTURES)
    write_image(output, contact_sheet(pairs, count, whole) / 255.0, 92, PAINTED)
    options.wrote(output)
