"""`bakery train segment`, `portraits` and `segment-export`: the network that labels portraits."""

import json
from pathlib import Path

import click

from bakery.cli import options

folder = click.Path(path_type=Path)


@click.command("portraits", cls=options.Command)
@click.argument("congress", type=folder)
@click.argument("london", type=folder)
@click.option("-o", "--output", required=True, type=folder, help=".npz to write.")
@options.overwrite
def portraits(congress, london, output, overwrite):
    """Label real portraits as far as they are sure: train of CONGRESS and london/train of LONDON.

    Both are folders with dense478.npz.

    \b
    bakery train portraits portraits/congress portraits -o runs/real.npz
    """
    from bakery.train.segment import real

    options.may_write(output, overwrite)
    sets = [(congress, "train", "", True), (london, "london/train", "", False)]
    for line in real.pack(sets, output):
        click.echo(json.dumps(line))
    options.wrote(output)


@click.command("segment", cls=options.Command, resumes=True)
@click.option("--bank", required=True, type=folder, help="Folder of `bakery synth portraits`.")
@click.option("--real", type=folder, help="npz of `bakery train portraits`.")
@click.option("--run", required=True, type=folder, help="Folder of the run; goes on where it was.")
@click.option(
    "--device", default="cpu", show_default=True, type=click.Choice(["cpu", "cuda"]),
    help="What it computes on.",
)  # fmt: skip
@click.option("--minutes", type=click.FloatRange(0, min_open=True), help="Stop after this long.")
@click.option("--teacher", type=folder, help="Weights whose sure answers label the real photos.")
@options.settings_of("segment-network")
def segment(bank, real, run, device, minutes, teacher, settings):
    """Train the segmentation network on painted and real portraits.

    \b
    bakery train segment --bank runs/portraits --real runs/real.npz --run runs/segment \\
        --device cuda --minutes 9
    """
    from bakery.train import segment

    options.may_go_on(run, marks=["options.json"])
    chosen = options.options_of("segment-network", settings)
    data = segment.Sources(bank, real, teacher)
    for figures in segment.train(run, data, chosen, device, minutes):
        click.echo(json.dumps(figures))


@click.command("segment-export", cls=options.Command)
@click.argument("run", type=folder)
@click.option("-o", "--output", required=True, type=folder, help=".safetensors to write.")
@click.option(
    "--mean-with", "weights", type=folder, help="Weights whose mean with the run's is written."
)
@options.overwrite
def segment_export(run, output, weights, overwrite):
    """Write the averaged weights of a RUN of `train segment` as they ship."""
    from bakery.train.segment import export

    options.may_write(output, overwrite)
    export(run, output, weights)
    options.wrote(output)
