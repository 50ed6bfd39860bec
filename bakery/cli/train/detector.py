"""`bakery train bank`, `detector`, `export`: the detector's networks, made again."""

import json
from pathlib import Path

import click

from bakery.cli import options

folder = click.Path(path_type=Path)


@click.command(cls=options.Command, resumes=True)
@click.argument("output", type=folder)
@click.option("--photos", multiple=True, type=folder, help="Folder of photos; may be repeated.")
@click.option("--dense", multiple=True, type=folder, help="npz with their points, one a folder.")
@click.option("--backgrounds", multiple=True, type=folder, help="Pictures without faces.")
@click.option("--skins", type=folder, help="Folder of `bakery synth skins`.")
@click.option("-j", "--jobs", default=1, show_default=True, type=click.IntRange(1, 256))
@options.settings_of("bank")
def bank(output, photos, dense, backgrounds, skins, jobs, settings):
    """Paint a bank of pictures into OUTPUT for the detector's networks to learn from.

    \b
    bakery train bank runs/bank --photos portraits/london/train --dense portraits/dense478.npz \\
        --photos portraits/congress/train --dense portraits/congress/dense478.npz \\
        --skins runs/skins -j 2
    """
    from bakery.train.detector import bank as banks

    if len(photos) != len(dense):
        raise click.UsageError(
            f"{len(photos)} --photos and {len(dense)} --dense; give one --dense for each --photos"
        )
    options.may_go_on(output, marks=["options.json"])
    chosen = options.options_of("bank", settings)
    sources = banks.Sources(tuple(zip(photos, dense)), backgrounds, skins)
    for path in banks.paint_bank(output, sources, chosen, jobs):
        click.echo(path)


@click.command(cls=options.Command, resumes=True)
@click.argument("network", type=click.Choice(["finder", "points", "eye", "mouth"]))
@click.option("--bank", required=True, type=folder, help="Folder of `bakery train bank`.")
@click.option("--run", required=True, type=folder, help="Folder of the run; goes on where it was.")
@click.option("--device", default="cpu", show_default=True, help="cpu or cuda.")
@options.head
@options.settings_of("detector")
def detector(network, bank, run, device, head, settings):
    """Train one of the detector's networks.

    \b
    bakery train detector points --bank runs/bank --run runs/points --set minutes=600
    """
    from bakery.heads.file import load_head
    from bakery.train import detector as detectors

    options.may_go_on(run, marks=["options.json"])
    chosen = options.options_of("detector", settings, network=network)
    for figures in detectors.train(run, bank, load_head(head), chosen, device):
        click.echo(json.dumps(figures))


@click.command("export", cls=options.Command)
@click.option("--finder", type=folder, help="Run of the finder.")
@click.option("--points", type=folder, help="Run of the points.")
@click.option("--eye", type=folder, help="Run of the eyes.")
@click.option("--mouth", type=folder, help="Run of the mouth.")
@click.option("-o", "--output", required=True, type=folder, help=".safetensors to write.")
@options.overwrite
def export_detector(finder, points, eye, mouth, output, overwrite):
    """Pack trained networks of the detector into one file: finder and points, or eye and mouth.

    \b
    bakery train export --finder runs/finder --points runs/points -o network.safetensors
    bakery train export --eye runs/eye --mouth runs/mouth -o closeups.safetensors
    """
    options.may_write(output, overwrite)
    given = {"finder": finder, "points": points, "eye": eye, "mouth": mouth}
    given = {name: run for name, run in given.items() if run}
    if set(given) not in ({"finder", "points"}, {"eye", "mouth"}):
        raise click.UsageError("give --finder RUN and --points RUN, or --eye RUN and --mouth RUN")
    from bakery.train.detector import export

    export(given, output)
    options.wrote(output)
