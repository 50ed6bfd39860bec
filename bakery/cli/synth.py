"""`bakery synth`: synthetic portraits, painted by the project."""

from pathlib import Path

import click

from bakery.cli import options


@click.group()
def synth():
    """Paint synthetic portraits; no real person is in them."""


@synth.command("samples", cls=options.Command)
@click.argument("names", nargs=-1)
@click.option("-o", "--output", required=True, type=click.Path(path_type=Path), help="Folder.")
@options.head
def samples(names, output, head):
    """Paint the portraits of samples/, or those of NAMES, with their landmarks.

    \b
    bakery synth samples -o samples/
    """
    from bakery.heads.file import load_head
    from bakery.synth.samples import write

    for path in write(load_head(head), output, names or None):
        click.echo(path)


@synth.command("training", cls=options.Command)
@click.option("-n", "--count", required=True, type=click.IntRange(1), help="Pictures.")
@click.option("-o", "--output", required=True, type=click.Path(path_type=Path), help="Folder.")
@click.option("--seed", default=0, show_default=True, help="Picture k depends on seed and k only.")
@options.head
def training(count, output, seed, head):
    """Paint random people with their 478 points, for `bakery train detector --rendered`.

    \b
    bakery synth training -n 1000 -o runs/painted
    """
    from bakery.heads.file import load_head
    from bakery.synth.training import write

    for path in write(load_head(head), output, count, seed):
        click.echo(path)
