"""`bakery train transfer`: the network that carries expressions from one texture to another."""

import json
from pathlib import Path

import click

from bakery.cli import options

folder = click.Path(path_type=Path)


@click.command("transfer", cls=options.Command, resumes=True)
@click.option("--run", required=True, type=folder, help="Folder of the run; goes on where it was.")
@click.option(
    "--performers", required=True, multiple=True, type=folder, help="Of `synth performers`."
)
@click.option("--steps", type=click.IntRange(1), help="How many steps in all.")
@options.settings_of("transfer")
def transfer(run, performers, steps, settings):
    """Train the texture transfer on people painted by `bakery synth performers`.

    \b
    bakery train transfer --run runs/transfer --performers runs/performers --steps 4000

    A run that was stopped goes on from its checkpoint; people who are painted meanwhile join.
    """
    from bakery.train import transfer as training

    options.may_go_on(run, marks=["options.json"])
    chosen = options.options_of("transfer", settings, steps=steps)
    for figures in training.train(run, performers, chosen):
        click.echo(json.dumps(figures))


@click.command("transfer-export", cls=options.Command)
@click.argument("run", type=folder)
@click.option("-o", "--output", required=True, type=folder, help=".safetensors to write.")
@options.overwrite
def transfer_export(run, output, overwrite):
    """Pack the averaged weights of a run of `train transfer`, as it ships."""
    from bakery.train.transfer import export

    options.may_write(output, overwrite)
    click.echo(json.dumps(export(run, output)))
    options.wrote(output)
