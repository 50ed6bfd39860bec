"""`bakery train identity`: the features that tell people apart."""

import json
from pathlib import Path

import click

from bakery.cli import options

folder = click.Path(path_type=Path)


@click.command("identity", cls=options.Command, resumes=True)
@click.option("--pairs", required=True, multiple=True, type=folder, help="Shards; may be repeated.")
@click.option("--photos", multiple=True, type=folder, help="Shards of `bakery train pairs`.")
@click.option("--run", required=True, type=folder, help="Folder of the run; goes on where it was.")
@click.option("-o", "--output", required=True, type=folder, help=".safetensors to write.")
@options.settings_of("identity")
@options.overwrite
def identity(pairs, photos, run, output, settings, overwrite):
    """Train the identity features on the people of painted pairs, and of photographs.

    \b
    bakery train identity --pairs runs/pairs --run runs/identity -o identity.safetensors
    """
    from bakery.train import identity

    options.may_write(output, overwrite)
    options.may_go_on(run, marks=["options.json"])
    chosen = options.options_of("identity", settings)
    for figures in identity.train(run, identity.People(pairs, photos), chosen):
        click.echo(json.dumps(figures))
    click.echo(json.dumps(identity.export(run, output)))
    options.wrote(output)
